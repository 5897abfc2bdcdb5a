"""What the tests with hosts in C share: compiling one, what it is told of a unit, a log to play."""

import subprocess
from pathlib import Path
from xml.etree import ElementTree

HOSTS = Path(__file__).parent / "hosts"


def compiled(command, sources, target, *flags):
    """Compile a program or library; warnings count if the flags say so."""
    libraries = [] if target.suffix == ".exe" else ["-ldl", "-lm"]
    done = subprocess.run(
        [*command, "-std=gnu11", *flags, *map(str, sources), "-o", str(target), *libraries],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return target


def written_log(folder):
    """A log of 1 s for the LogPlayer."""
    path = folder / "log.csv"
    header = "time [s],v_front [V],v_rear [V],pitch [rad],elevation [rad],travel [rad]\n"
    path.write_text(header + "".join(f"{0.01 * k:.2f},{k},{-k},.1,.2,.3\n" for k in range(100)))
    return path


def described(folder):
    """GUID, reference of the log's path or -1, and the references of inputs and outputs behind their number.

    As in hosts/bare_host.py, inputs whose range is narrow keep their start values.
    """
    root = ElementTree.parse(folder / "modelDescription.xml").getroot()
    variables = {v.get("name"): v for v in root.iter("ScalarVariable")}

    def listed(causality):
        found = [
            v.get("valueReference")
            for name, v in variables.items()
            if v.get("causality") == causality and not name.startswith(("correction.", "measured.fresh"))
        ]
        return [str(len(found)), *found]

    text = variables["log.path"].get("valueReference") if "log.path" in variables else "-1"
    return root.get("guid"), text, [*listed("input"), *listed("output")]
