"use strict";
// The page of `heli follow --serve`: it requests views and draws them; it requests nothing else.
const SPAN = 60, GAP = 0.5; // seconds that are drawn; without data for longer a line is broken
const AXES = ["pitch", "elevation", "travel"];
const SVG = "http://www.w3.org/2000/svg";
const WIDTH = 560, HEIGHT = 130, LEFT = 52, BOTTOM = 18;
let points = [];
let marks = []; // events
let declared = [null, null, null];
const byId = (id) => document.getElementById(id);

function svgElement(name, attributes, text) {
  const node = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) node.setAttribute(key, value);
  if (text !== undefined) node.textContent = text;
  return node;
}

function axisTicks(low, high, count) {
  const raw = (high - low) / count, power = 10 ** Math.floor(Math.log10(raw));
  const step = power * [1, 2, 5, 10].find((m) => m * power >= raw);
  const digits = Math.max(0, -Math.floor(Math.log10(step)));
  const result = [];
  for (let k = Math.ceil(low / step); k * step <= high; k++) result.push([k * step, (k * step).toFixed(digits).replace("-", "−")]);
  return result;
}

function addChart(parent, title, series) {
  const svg = svgElement("svg", { viewBox: `0 0 ${WIDTH} ${HEIGHT}`, role: "img", "aria-label": title });
  const frame = { x: LEFT, y: 4, width: WIDTH - LEFT - 4, height: HEIGHT - BOTTOM - 4 };
  const scale = svgElement("g", {}), lines = series.map(([kind]) => svgElement("path", { class: kind }));
  svg.append(svgElement("rect", { ...frame, class: "frame" }), scale, ...lines,
    svgElement("text", { x: LEFT + 6, y: 16, class: "tick" }, title));
  parent.append(svg);
  return () => {
    if (!points.length) return;
    const end = points[points.length - 1].time, begin = Math.max(end - SPAN, points[0].time);
    const columns = series.map(([, value]) => points.map(value));
    const all = columns.flat().filter((y) => y !== null && Number.isFinite(y));
    if (!all.length || end === begin) return;
    let low = Math.min(...all), high = Math.max(...all);
    const margin = 0.06 * (high - low) || 0.01;
    low = title.includes("mrad") ? 0 : low - margin;
    high += 3 * margin; // room for the title
    const x = (t) => frame.x + (frame.width * (t - begin)) / (end - begin);
    const y = (v) => frame.y + (frame.height * (high - v)) / (high - low);
    columns.forEach((column, k) => {
      let path = "", isDrawing = false;
      column.forEach((value, i) => {
        if (value === null || !Number.isFinite(value)) { isDrawing = false; return; }
        if (i && points[i].time - points[i - 1].time > GAP) isDrawing = false;
        path += `${isDrawing ? "L" : "M"}${x(points[i].time).toFixed(1)} ${y(value).toFixed(1)}`;
        isDrawing = true;
      });
      lines[k].setAttribute("d", path);
    });
    const verticalLine = (t, kind) =>
      svgElement("line", { x1: x(t), x2: x(t), y1: frame.y, y2: frame.y + frame.height, class: kind });
    scale.replaceChildren(
      ...axisTicks(low, high, 4).flatMap(([v, text]) => [
        svgElement("line", { x1: LEFT, x2: frame.x + frame.width, y1: y(v), y2: y(v), class: "grid" }),
        svgElement("text", { x: LEFT - 5, y: y(v) + 4, "text-anchor": "end", class: "tick" }, text)]),
      ...axisTicks(begin, end, 6).flatMap(([t, text]) => [
        verticalLine(t, "grid"),
        svgElement("text", { x: x(t), y: HEIGHT - 4, "text-anchor": "middle", class: "tick" }, `${text} s`)]),
      ...marks.filter((mark) => mark.time_s > begin && mark.time_s < end).map((mark) => {
        const line = verticalLine(mark.time_s, `mark ${mark.what.split(" ")[0]}`);
        line.append(svgElement("title", {}, `${mark.what} ${mark.name}`));
        return line;
      }));
  };
}

const milli = (value) => (value === null ? null : 1000 * value);
const redraws = AXES.flatMap((axis, k) => [
  addChart(byId("angles"), `${axis} [rad]`, [
    ["measured", (p) => (p.measured === null ? null : p.measured[k])],
    ["following", (p) => p.predicted[k]],
    ["alone", (p) => p.predicted_alone[k]],
  ]),
  addChart(byId("errors"), `${axis} [mrad]`, [
    ["following", (p) => milli(p.error[k])],
    ["alone", (p) => milli(p.error_alone[k])],
    ["declared", () => milli(declared[k])],
  ]),
]);

function formatNumber(value) {
  return value === null || value === undefined ? "" : value === 0 ? "0" : Number(value.toPrecision(4)).toString().replace("-", "−");
}

function formatInterval(value, half) { // with the digits that half of the interval determines
  if (!half) return formatNumber(value);
  const digits = Math.min(Math.max(1 - Math.floor(Math.log10(half)), 0), 12);
  return `${value.toFixed(digits)} ± ${half.toFixed(digits)}`.replace("-", "−");
}

function tableCell(text, kind, label) {
  const node = document.createElement("td");
  node.textContent = text;
  if (kind) node.className = kind;
  if (label && text) node.dataset.label = label; // on a narrow screen
  return node;
}

function showValues(values) {
  byId("values").replaceChildren(...values.map((value) => {
    const row = document.createElement("tr");
    row.append(tableCell(value.name), tableCell(formatNumber(value.start), "", "at the start"),
      tableCell(formatInterval(value.used, value.band), value.used !== value.start ? "changed" : "", "in use"),
      tableCell(value.unit));
    return row;
  }));
}

function showEvents(list) {
  byId("events").replaceChildren(...list.slice().reverse().map((event) => {
    const item = document.createElement("li");
    item.className = event.what.split(" ")[0];
    const value = event.name ? ` ${event.name} = ${formatInterval(event.value, 1.96 * event.standard_error)}` : "";
    const other = event.other ? ` (or ${event.other})` : "";
    item.textContent = `${event.time_s.toFixed(1)} s  ${event.what}${value}${other}: ${event.why}`;
    return item;
  }));
}

function showView(view) {
  points = view.past;
  byId("title").textContent = view.title;
  byId("stream").textContent = view.stream;
  if (!view.values.length) return;
  const suspect = view.suspect ? `, likeliest: ${view.suspect}` : "";
  byId("state").textContent =
    `${view.time.toFixed(1)} s, ${view.mode}; detector at ${(100 * view.alarm).toFixed(0)} % of its threshold${suspect}`;
  declared = view.declared;
  marks = view.events;
  showValues(view.values);
  showEvents(view.events);
  for (const redraw of redraws) redraw();
}

async function requestView() {
  try {
    showView(await (await fetch("view")).json());
  } catch {
    byId("stream").textContent = "heli follow does not answer: the flight has ended. What is shown stays until this page is closed.";
  }
  setTimeout(requestView, 200);
}
requestView();
