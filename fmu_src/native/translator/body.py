"""One function while it is translated: its lines, its variables, conversions of its values, and its branches and loops.

Every assignment makes a variable of its own in C. Where two branches meet, or a loop begins again, a variable that they
have both set becomes one variable that both assign to. What the types of results and of growing lists are is found by
translating the function again until none widens any more.
"""

from __future__ import annotations

import ast
import dataclasses
import inspect
import re
from collections.abc import Callable, Collection, Iterator
from contextlib import contextmanager
from types import FunctionType
from typing import Any, NoReturn

from heli_plant.dual import Dual

from ...errors import BuildError
from . import types as c
from .values import Expr, Run, known_items, literal, type_of, unwrapped


class Untranslatable(BuildError):
    """A function of the step path uses a form that has no translation to C: file, line, reason."""

    def __init__(self, file: str, line: int, reason: str) -> None:
        super().__init__(file, line, reason)  # as it passes from one process to another
        self.file, self.line, self.reason = file, line, reason

    def __str__(self) -> str:
        return f"{self.file}, line {self.line}: {self.reason}"


class Body:
    """One function in translation.

    Parameters
    ----------
    program : Translation
        It translates the functions that are called and defines the types that are used.
    function : FunctionType
    origin : tuple
        File of the function and the line before its first.
    returns : CType or None
        Type of the result, where its annotation says it.
    """

    def __init__(
        self, program: Any, function: FunctionType, origin: tuple[str, int], returns: c.CType | None
    ) -> None:
        self.program, self.function, self.origin, self.returns = program, function, origin, returns
        self.returned: c.CType = returns or c.UNKNOWN
        self.names: dict[str, Any] = {}
        """What the function's global names stand for."""
        self.codes: dict[ast.AST, Any] = {}
        """Its expressions, ready to be evaluated."""
        self.grown: dict[str, c.CType] = {}
        """Types of the elements that are appended to a variable."""
        self.stored: set[str] = set()
        """Variables of which an element is changed, or to which one is appended: they are lists in C."""
        self.needs_space = False
        self.begin()

    def begin(self) -> None:
        """Begin a pass."""
        self.lines: list[str] = []
        self.depth, self.count = 1, 0
        self.env: dict[str, Any] | None = {}
        """Values of the variables; None behind a return."""
        self.loops: list[tuple[dict[str, Expr], dict[str, c.CType]]] = []
        """Of each loop around: the variables that it carries from turn to turn, and the widest types assigned."""

    # Lines

    def emit(self, line: str) -> None:
        """Add a line to the current block."""
        self.lines.append("    " * self.depth + line)

    @contextmanager
    def aside(self, apart: list[str], deeper: int = 1) -> Iterator[None]:
        """Collect lines apart from the current block."""
        outer, self.lines = self.lines, apart
        self.depth += deeper
        yield
        self.depth -= deeper
        self.lines = outer

    @contextmanager
    def block(self, head: str) -> Iterator[None]:
        """Add a block in braces."""
        self.emit(f"{head} {{")
        self.depth += 1
        yield
        self.depth -= 1
        self.emit("}")

    def refuse(self, node: ast.AST, reason: str) -> NoReturn:
        """Refuse a form of Python."""
        file, before = self.origin
        raise Untranslatable(file, before + getattr(node, "lineno", 1), reason)

    # Variables of C

    def fresh(self, name: str = "t") -> str:
        """Return a name that is not taken."""
        self.count += 1
        return f"{name}_{self.count}"

    def declare(self, kind: c.CType, name: str = "t", text: str = "") -> Expr:
        """Declare a variable, with a value or without."""
        made = Expr(self, kind, self.fresh(name))
        self._begin(made, text)
        return made

    def _begin(self, made: Expr, text: str) -> None:
        self.program.use(made.type)
        self.emit(f"{f'{made.type.name} '.replace('* ', '*')}{made.code}{f' = {text}' if text else ''};")

    def opened(self, value: Expr) -> Any:
        """Return a tuple of known length as a tuple of its elements, a dual number as one of its parts."""
        if value.type == c.DUAL:
            return Dual(Expr(self, c.FLOAT, value.path("value")), Expr(self, c.FLOAT, value.path("slope")))
        if not isinstance(value.type, c.Row):
            return value
        return tuple(self.opened(Expr(self, kind, value.path(f"x{i}"))) for i, kind in enumerate(value.type.items))

    def kept(self, value: Any, name: str = "t") -> Any:
        """Return ``value`` so that it may be used repeatedly: in a variable if it is more than a name."""
        if isinstance(value, tuple) and not hasattr(value, "_fields"):
            return tuple(self.kept(one, name) for one in value)
        if isinstance(value, Dual):
            return Dual(self.kept(value.value, name), self.kept(value.slope, name))
        if isinstance(value, list):
            return [self.kept(one, name) for one in value]
        if not isinstance(value, Expr) or value.is_simple:
            return value
        return self.declare(value.type, name, value.bare)

    def new_list(self, kind: c.CType, room: str, name: str = "t") -> Expr:
        """Declare an empty list with room for some elements."""
        self.needs_space = True
        return self.declare(kind, name, f"new_{kind.name}(space, {room})")

    def push(self, made: Expr, value: Any) -> None:
        """Append a value to a list."""
        self.needs_space = True
        item = self.as_type(value, c.element(made.type))
        self.emit(f"push_{made.type.name}(space, &{made.code}, {item.bare});")

    # Conversions

    def as_type(self, value: Any, wanted: c.CType) -> Expr:
        """Return ``value`` as an expression of type ``wanted``.

        Raises
        ------
        NoType
            It cannot be one.
        """
        have = type_of(value)
        if isinstance(value, Expr) and (have == wanted or wanted == c.UNKNOWN):
            return value
        if have == c.UNKNOWN:  # an element of a list whose type a further pass knows
            return Expr(self, wanted, value.code)
        self.program.use(wanted)
        if isinstance(wanted, c.Maybe):
            inner = "0" if have == c.NOTHING else f"true, {self.as_type(value, wanted.item).bare}"
            return Expr(self, wanted, f"({wanted.name}){{{inner}}}")
        if isinstance(have, c.Maybe):
            return self.as_type(unwrapped(value), wanted)
        if isinstance(wanted, c.Choice) and isinstance(have, c.Function):
            return Expr(self, wanted, str(wanted.functions.index(have.function)))
        if wanted == c.DUAL:
            parts = (value.value, value.slope) if isinstance(value, Dual) else (value, 0.0)
            return Expr(self, c.DUAL, f"(Dual){{{', '.join(self.as_type(part, c.FLOAT).bare for part in parts)}}}")
        if have in (c.BOOL, c.INT, c.FLOAT, c.TEXT) and not isinstance(value, Expr) and have in (wanted, c.BOOL, c.INT):
            return Expr(self, wanted, literal(float(value) if wanted == c.FLOAT else value))
        if wanted in (c.INT, c.FLOAT) and have in (c.BOOL, c.INT):
            before = value.as_float if wanted == c.FLOAT else ""
            return Expr(self, wanted, before or f"({wanted.name}){value.code}")
        items = known_items(value)
        if items is not None and isinstance(wanted, c.Row) and len(items) == len(wanted.items):
            inner = ", ".join(self.as_type(one, kind).bare for one, kind in zip(items, wanted.items, strict=True))
            return Expr(self, wanted, f"({wanted.name}){{{inner}}}")
        if isinstance(wanted, c.Listing) and (items == [] or have == c.Listing(c.UNKNOWN)):
            return Expr(self, wanted, f"({wanted.name}){{0}}")
        if isinstance(wanted, c.Listing) and isinstance(have, c.Listing | c.Row):
            kind = wanted if wanted.item != c.UNKNOWN else c.Listing(c.element(have))
            made = self.new_list(kind, str(len(items or ())))
            self.each(value, 0, lambda one: self.push(made, one))
            return made
        if isinstance(wanted, c.Row) and isinstance(have, c.Listing):
            return self.as_type(self.unpacked(value, len(wanted.items)), wanted)
        if items is not None and have == wanted and isinstance(wanted, c.Struct):
            return self.made(wanted.kind, *items)
        raise c.NoType(f"{have.said} is given where {wanted.said} is needed")

    def unpacked(self, value: Any, count: int) -> tuple[Any, ...]:
        """Return ``count`` elements of a tuple or list."""
        items = known_items(value)
        if items is None and isinstance(type_of(value), c.Listing):
            items = [self.item(value, i) for i in range(count)]
        if items is None or len(items) != count:
            raise c.NoType(f"{type_of(value).said} does not fit {count} variables")
        return tuple(items)

    def flat(self, shape: Any, value: Any) -> list[Any]:
        """Return the values that the names of a target take, in order."""
        if shape == 0:
            return [value]
        parts = self.unpacked(value, len(shape))
        return [one for own, part in zip(shape, parts, strict=True) for one in self.flat(own, part)]

    # Loops

    def repeat(self, head: str, assigned: Collection[str], turn: Callable[[], None]) -> None:
        """Add a loop whose body ``turn`` translates; it assigns to variables, some of which live before it."""
        assert self.env is not None
        before = self.env
        first = {name: before[name] for name in sorted(before.keys() & set(assigned))}
        kinds, wider = {name: type_of(value) for name, value in first.items()}, None
        start = self.count
        while kinds != wider:
            kinds, self.count, lines = wider or kinds, start, list[str]()
            carried = {name: Expr(self, kind, self.fresh(name)) for name, kind in kinds.items()}
            opened = {name: self.opened(made) for name, made in carried.items()}
            self.loops.append((carried, dict(kinds)))
            self.env = {**before, **opened}
            with self.aside(lines):
                turn()
                self.commit()
            wider = self.loops.pop()[1]
        for name, made in carried.items():
            self._begin(made, self.as_type(first[name], made.type).bare)
        self.emit(f"{head} {{")
        self.lines += lines
        self.emit("}")
        self.env = {**before, **opened}

    def commit(self) -> None:
        """Assign what the innermost loop carries into its next turn, or out of it."""
        if self.env is None:
            return
        (carried, kinds), texts = self.loops[-1], {}
        own = {made.code for made in carried.values()}
        for name, made in carried.items():
            value = self.env[name]
            kinds[name] = c.joined(kinds[name], type_of(value))
            if kinds[name] != made.type:
                continue  # the loop is translated again
            new = self.as_type(value, made.type)
            if new.code == made.code:
                continue
            if own & set(re.findall(r"\w+", new.code)):
                new = self.declare(made.type, name, new.bare)
            texts[made.code] = new.bare
        for code, text in texts.items():
            self.emit(f"{code} = {text};")

    def each(self, over: Any, shape: Any, take: Callable[..., Any], assigned: Collection[str] = ()) -> None:
        """Let ``take`` see every element: unrolled where they are known one by one, else in a loop."""
        items = known_items(over)
        if items is not None:
            for item in items:
                take(*self.flat(shape, item))
            return
        run, k = self.run(over), self.fresh("k")
        count = self.kept(Expr(self, c.INT, run.count)).code
        self.repeat(
            f"for (int64_t {k} = 0; {k} < {count}; {k}++)", assigned,
            lambda: take(*map(self.kept, self.flat(shape, run.at(k)))),
        )  # fmt: skip

    # Tuples and lists

    def run(self, over: Any) -> Run:
        """Return what a loop in C runs over."""
        if isinstance(over, Run):
            return over
        kind = type_of(unwrapped(over))
        known = known_items(over)
        if known is not None:
            kind = c.Listing(c.element(c.Row(tuple(map(type_of, known)))))
            over = self.as_type(tuple(known), kind)
        if not isinstance(kind, c.Listing):
            raise c.NoType(f"a loop cannot run over {kind.said}")
        sequence = self.kept(unwrapped(over))
        return Run(sequence.path("count"), lambda k: self.item(sequence, Expr(self, c.INT, k)))

    def collect(self, fill: Callable[[Callable[[Any], None]], None], room: str = "0") -> Any:
        """Return what ``fill`` puts: a tuple where no loop or condition is in between, else a list."""
        values: list[Any] = []
        lines: list[str] = []
        outer = deepest = self.depth

        def see(value: Any) -> None:
            nonlocal deepest
            deepest = max(deepest, self.depth)
            values.append(value)

        with self.aside(lines, 0):
            fill(see)
        if deepest == outer:
            self.lines += lines
            return tuple(values)
        made = self.new_list(c.Listing(c.element(c.Row(tuple(map(type_of, values))))), room)
        fill(lambda value: self.push(made, value))
        return made

    def collected(self, over: Any) -> Any:
        """Return a new tuple or list of the same elements."""
        room = "0" if known_items(over) is not None else self.run(over).count
        return self.collect(lambda put: self.each(over, 0, put), room)

    def display(self, *parts: tuple[bool, Any]) -> Any:
        """Return ``(a, *b)``: of known length unless a list is among its parts."""

        def fill(put: Callable[[Any], None]) -> None:
            for is_starred, one in parts:
                if is_starred:
                    self.each(one, 0, put)
                else:
                    put(one)

        return self.collect(fill)

    def item(self, value: Any, index: Any) -> Any:
        """``value[index]``; a part of a list is a list of its own."""
        value = unwrapped(value)
        if isinstance(value, dict):
            return value[index]
        bounds = (index.start, index.stop, index.step) if isinstance(index, slice) else (index,)
        items = known_items(value)
        if items is not None and not any(isinstance(bound, Expr) for bound in bounds):
            return tuple(items[index]) if isinstance(index, slice) else items[index]
        if items is not None:
            value = self.as_type(tuple(items), c.Listing(c.element(c.Row(tuple(map(type_of, items))))))
        value = self.kept(value)
        if not isinstance(value.type, c.Listing):
            raise c.NoType(f"{value.type.said} has no elements")
        places = [self.place(value, bound) for bound in bounds]
        if not isinstance(index, slice):
            return self.opened(Expr(self, value.type.item, f"{value.path('at')}[{places[0]}]"))
        self.needs_space = True
        first, beyond, step = places[0] or "0", places[1] or value.path("count"), places[2] or "1"
        return Expr(self, value.type, f"part_of_{value.type.name}(space, {value.code}, {first}, {beyond}, {step})")

    def place(self, value: Expr, index: Any) -> str:
        """Return an index as C counts it: a negative one counts from the end."""
        if index is None:
            return ""
        if isinstance(index, int) and index < 0:
            return f"{value.path('count')} - {-index}"
        return self.as_type(index, c.INT).bare

    # Functions and classes of the project

    def call(self, function: Any, *given: Any, **named: Any) -> Any:
        """Call a function of the project, which is translated for the types of its arguments."""
        function = inspect.unwrap(function)
        bound = inspect.signature(function).bind(*given, **named)
        bound.apply_defaults()
        values = []
        for value, hint in zip(bound.arguments.values(), parameter_types(function).values(), strict=True):
            kind = type_of(value)
            is_own = hint is None or (kind, hint) == (c.DUAL, c.FLOAT)
            values.append(value if isinstance(kind, c.Function) else self.as_type(value, kind if is_own else hint))  # type: ignore[arg-type]
        unit = self.program.function(function, tuple(map(type_of, values)))
        self.needs_space = self.needs_space or unit.needs_space
        texts = ["space"] if unit.needs_space else []
        texts += [self._passed(value) for value in values if isinstance(value, Expr)]
        text = f"{unit.name}({', '.join(texts)})"
        if unit.result == c.NOTHING:
            self.emit(f"{text};")
            return None
        return self.opened(self.declare(unit.result, function.__name__.strip("_"), text))

    def _passed(self, value: Expr) -> str:
        """Return an argument as C passes it: a struct by its address."""
        if not isinstance(value.type, c.Struct):
            return value.bare
        if value.code.startswith("(*"):
            return value.code[2:-1]
        return f"&{value.code if re.fullmatch(r'[a-zA-Z_][^(){}]*', value.code) else self.kept(value).code}"

    def made(self, kind: type, *given: Any, **named: Any) -> Expr:
        """Make a struct: ``PlantState(...)``."""
        bound = inspect.signature(kind).bind(*given, **named)
        for field in dataclasses.fields(kind) if dataclasses.is_dataclass(kind) else ():
            if field.default_factory is not dataclasses.MISSING:
                bound.arguments.setdefault(field.name, field.default_factory())
        bound.apply_defaults()
        inner = [f".{name} = {self.as_type(bound.arguments[name], own).bare}" for name, own in c.fields(kind).items()]
        return self._checked(self.declare(c.Struct(kind), kind.__name__.lower(), f"{{{', '.join(inner)}}}"))

    def replaced(self, old: Expr, **new: Any) -> Expr:
        """``old._replace(...)``: a copy of a struct with other values in some fields."""
        assert isinstance(old.type, c.Struct)
        kinds = c.fields(old.type.kind)
        texts = {name: self.as_type(value, kinds[name]).bare for name, value in new.items()}
        made = self.declare(old.type, "t", old.bare)
        for name, text in texts.items():
            self.emit(f"{made.path(name)} = {text};")
        return self._checked(made)

    def _checked(self, made: Expr) -> Expr:
        """Let a value check itself, where it does."""
        check = getattr(made.type.kind, "__post_init__", None)  # type: ignore[union-attr]
        if check is not None:
            self.call(check, made)
        return made

    def chosen(self, which: Expr, given: tuple[Any, ...]) -> Any:
        """Call the function that an index chooses, among those that take as many arguments."""
        if not isinstance(which.type, c.Choice):
            raise c.NoType(f"{which.type.said} is no function")
        given = self.kept(given)
        made = self.declare(c.FLOAT, "t", "0.0")
        with self.block(f"switch ({which.bare})"):
            for index, function in enumerate(which.type.functions):
                if len(inspect.signature(function).parameters) == len(given):
                    with self.block(f"case {index}:"):
                        self.emit(f"{made.code} = {self.as_type(self.call(function, *given), c.FLOAT).bare};")
                        self.emit("break;")
        return made


def parameter_types(function: FunctionType) -> dict[str, c.CType | None]:
    """Return the type of each parameter as its annotation says it; None where there is none that C has."""
    return {name: annotation(function, name) for name in inspect.signature(function).parameters}


def annotation(function: FunctionType, name: str) -> c.CType | None:
    """Return the type of a parameter, or of ``return``, as its annotation says it; None where it says none."""
    hint = function.__annotations__.get(name, inspect.Parameter.empty)
    try:
        hint = eval(hint, function.__globals__) if isinstance(hint, str) else hint  # our own source
        return None if hint is inspect.Parameter.empty else c.annotated(hint)
    except (NameError, c.NoType):
        return None
