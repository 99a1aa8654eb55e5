"""FMUs of FMI 2.0 and 3.0, for model exchange and co-simulation, around the exported C."""

import io
import platform
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterable
from dataclasses import dataclass
from hashlib import sha256
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Literal, NamedTuple

from sympy import Symbol
from sympy.printing.codeprinter import CodePrinter

from pneumo.equations.branches import Choice
from pneumo.equations.equation_list import Constant, Statement
from pneumo.equations.system import System, quantity, rate_unit
from pneumo.errors import InputError
from pneumo.export.c_source import CPrinter, Kink, c99
from pneumo.export.printing import TEMPLATES, digits, heading, printed, validity
from pneumo.physics.cylinder import Side

COMPILER = "gcc"


class Platform(NamedTuple):
    """A platform of FMUs: its names, the folders of both versions of FMI, and the suffix of a library."""

    name: str
    target: str  #: zig's name
    fmi_2: str  #: empty where FMI 2 has no name for it
    fmi_3: str
    suffix: str


PLATFORMS = (
    Platform("Linux x86-64", "x86_64-linux-gnu.2.28", "linux64", "x86_64-linux", ".so"),
    Platform("Linux ARM64", "aarch64-linux-gnu.2.28", "", "aarch64-linux", ".so"),
    Platform("Windows x86-64", "x86_64-windows-gnu", "win64", "x86_64-windows", ".dll"),
    Platform("macOS x86-64", "x86_64-macos", "darwin64", "x86_64-darwin", ".dylib"),
    Platform("macOS ARM64", "aarch64-macos", "", "aarch64-darwin", ".dylib"),
)
STEP = 1e-3  # s, longest inside a step of co-simulation
# First value references; a curve of the valve has hundreds of parameters and kinks.
REFERENCES = {"INPUT": 200, "STATE": 300, "RATE": 400, "PARAMETER": 10_000, "KINK": 20_000}
# Depend on each other: not to be tuned alone.
GAS = ("R", "gamma_", "sonic_coefficient", "critical_ratio", "area_per_C")
UNITS: dict[str, dict[str, float]] = {  # name: powers of the base units, and a factor
    "s": {"s": 1},
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s^2": {"m": 1, "s": -2},
    "m^2": {"m": 2},
    "m^3": {"m": 3},
    "kg": {"kg": 1},
    "kg/s": {"kg": 1, "s": -1},
    "K": {"K": 1},
    "K/s": {"K": 1, "s": -1},
    "N": {"kg": 1, "m": 1, "s": -2},
    "N/m": {"kg": 1, "s": -2},
    "N s/m": {"kg": 1, "s": -1},
    "Pa": {"kg": 1, "m": -1, "s": -2},
    "Pa/s": {"kg": 1, "m": -1, "s": -3},
    "V": {"kg": 1, "m": 2, "s": -3, "A": -1},
    "V/s": {"kg": 1, "m": 2, "s": -4, "A": -1},
    "m^2/V": {"kg": -1, "s": 3, "A": 1},
    "dm^3/(s bar)": {"kg": -1, "m": 4, "s": 1, "factor": 1e-8},
    "W/K": {"kg": 1, "m": 2, "s": -3, "K": -1},
    "J/(kg K)": {"m": 2, "s": -2, "K": -1},
}


@dataclass
class Variable:
    """A variable in an FMU's modelDescription.xml."""

    name: str
    reference: int
    place: int  # from 1, in the list of variables
    unit: str
    meaning: str
    causality: Literal["parameter", "input", "output", "local"]
    variability: Literal["fixed", "tunable", "continuous"] = "continuous"
    initial: str = ""
    start: str | None = None
    nominal: str = ""
    derivative: "Variable | None" = None  # the state of which this is the rate
    kink: bool = False


def _conditions(value: Any) -> list[Any]:
    """Conditions of a `Choice` and of all choices inside it."""
    if not isinstance(value, Choice):
        return []
    return [value.condition, *_conditions(value.yes), *_conditions(value.no)]


def kinks(system: System, parts: dict[str, list[Statement]], printer: CodePrinter) -> tuple[Kink, ...]:
    """Expressions at whose change of sign a rate jumps or bends: conditions in the equations, end stops."""
    result, seen = list[Kink](), set[Any]()

    def add(zero: Any, meaning: str) -> None:
        if zero not in seen and -zero not in seen:
            seen.add(zero)
            result.append(Kink(str(printer.doprint(zero)), meaning))

    for condition in (c for statement in parts["valve"] for c in _conditions(statement.value)):
        add(condition.lhs - condition.rhs, f"{condition}, valve")
    for side in Side:
        outside = {name: sign * Symbol(outer) for name, (sign, outer) in system.flows(side).items()}
        outside["P"] = Symbol(f"state[{system.name}_P_{side.name}]")
        constant = {name: f"p->{outer}" for name, outer in system.of_chambers[side.name].items()}
        outside |= {name: Symbol(outer) for name, outer in constant.items()}
        for condition in (c for statement in parts["chamber"] for c in _conditions(statement.value)):
            inner = {s: outside[s.name] for s in condition.free_symbols if s.name in outside}
            add((condition.lhs - condition.rhs).xreplace(inner), f"{condition}, chamber {side.name}")
    if system.piston and not system.plant.cylinder.coulomb:  # else there is no model exchange
        (force,) = (statement.value for statement in parts["piston"] if statement.names == ("a",))
        places = {f"P_{side.name}": f"state[{system.name}_P_{side.name}]" for side in Side}
        places |= {"x": f"state[{system.name}_x]", "v": f"state[{system.name}_v]"}
        places["force"] = f"inputs[{system.name}_force]"
        turned = force.xreplace({s: Symbol(places[s.name]) for s in force.free_symbols if s.name in places})
        stops = {"stop, x_min": "{} - p->x_min", "stop, x_max": "p->x_max - {}"}
        result += [Kink(pattern.format(places["x"]), meaning) for meaning, pattern in stops.items()]
        result.append(Kink(str(printer.doprint(turned)), "force on a piston at rest on a stop"))
    return tuple(result)


def _variables(system: System, constants: list[Constant], indicators: tuple[Kink, ...]) -> list[Variable]:
    """All variables of the FMU, with the value references that instance.h uses."""
    variables = list[Variable]()

    def add(name: str, reference: int, unit: str, meaning: str, **options: Any) -> Variable:
        variables.append(Variable(name, reference, len(variables) + 1, unit, meaning, **options))
        return variables[-1]

    tuned = {"causality": "parameter", "variability": "tunable", "initial": "exact"}
    add("longest_step", 1, "s", "longest step inside a step of co-simulation", start=digits(STEP), **tuned)
    for i, c in enumerate(constants):
        unit, variability = c.unit if c.unit in UNITS else "", "fixed" if c.name in GAS else "tunable"
        options = tuned | {"variability": variability, "start": digits(c.value)}
        add(c.name, REFERENCES["PARAMETER"] + i, unit, c.comment, **options)
    for i, name in enumerate(system.inputs):
        add(name, REFERENCES["INPUT"] + i, *quantity(name), causality="input", start="0.0")
    for i, (name, start, nominal) in enumerate(zip(system.states, system.at_rest, system.scale, strict=True)):
        options = {"initial": "exact", "start": digits(start), "nominal": digits(nominal)}
        state = add(name, REFERENCES["STATE"] + i, *quantity(name), causality="output", **options)
        rate = f"der({name})", REFERENCES["RATE"] + i, rate_unit(name), f"rate of {name}"
        add(*rate, causality="local", derivative=state)
    for i, kink in enumerate(indicators):
        add(f"kink[{i + 1}]", REFERENCES["KINK"] + i, "", kink.meaning, causality="local", kink=True)
    return variables


def fmu(system: System, fmi: Literal[2, 3] = 2) -> bytes:
    """FMU of a system, as the bytes of its file, with C sources, and binaries if a compiler is installed.

    ziglang compiles for Linux, Windows and macOS, gcc for the Linux on which it runs.

    `fmi` is the version of the standard. The bytes are the same on every run.

    Raises
    ------
    InputError
        If the compiler refuses the sources.
    """
    if fmi not in (2, 3):
        raise InputError(f"--fmi {fmi}: must be 2 or 3")
    parts, constants = printed(system)
    indicators = kinks(system, parts, CPrinter(constants))
    sources = c99(system, "model", kinks=indicators, derivatives=True)
    del sources["model_test.c"]
    # With Coulomb friction a step that reverses the velocity ends at rest, which an outer solver cannot do.
    stuck = system.piston and system.plant.cylinder.coulomb > 0
    kinds = ["CoSimulation"] if stuck else ["ModelExchange", "CoSimulation"]
    known: dict[str, Any] = {
        "M": system.name,
        "token": "",
        "fmi": fmi,
        "F": f"fmi{fmi}",
        "tool": f"pneumo {version('pneumo')}",
        "title": " ".join((heading(system).partition("\n")[0], validity(system))).rstrip(),
        "binaries": "",
        "kinds": kinds,
        "constants": constants,
        "piston": system.piston and "ModelExchange" in kinds,
        "kinks": indicators,
        "references": REFERENCES,
        "units": UNITS,
        "longest_step": digits(STEP),
        "start": [digits(value) for value in system.at_rest],
        "nominals": ", ".join(map(digits, system.scale)),
        "variables": _variables(system, constants, indicators),
    }

    def text(template: str) -> str:
        return TEMPLATES.get_template(f"{template}.j2").render(known)

    everything = "".join((*sources.values(), text(f"fmi{fmi}.xml"), text("fmi.c")))
    known["token"] = "{" + sha256(everything.encode()).hexdigest()[:32] + "}"
    sources |= {"instance.h": text("instance.h"), f"fmi{fmi}.c": text("fmi.c")}
    binaries = _binaries(system.name, sources, fmi)
    known["binaries"] = f" {platforms_text(binaries)}."
    files = {"modelDescription.xml": text(f"fmi{fmi}.xml").encode()}
    files |= {f"sources/{name}": source.encode() for name, source in sources.items()}
    if fmi == 3:
        files["sources/buildDescription.xml"] = text("build.xml").encode()
    return _packed(files | binaries)


def _platforms(paths: Iterable[str]) -> list[Platform]:
    """Platforms whose binaries are among the paths of an FMU's files."""
    folders = {path.split("/")[1] for path in paths if path.startswith("binaries/")}
    return [platform for platform in PLATFORMS if folders & {platform.fmi_2, platform.fmi_3}]


def platforms_text(paths: Iterable[str]) -> str:
    """Phrase that says for which platforms an FMU of these files has binaries."""
    names = ", ".join(platform.name for platform in _platforms(paths))
    return f"Binaries for {names}" if names else "No binaries, C sources only"


def platforms_note(content: bytes) -> str:
    """Line on the binaries of an FMU, and on how to get those for other platforms."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        paths = archive.namelist()
    present = _platforms(paths)
    if len(present) > 1:
        third = "sources/fmi3.c" in paths
        absent = [of.name for of in PLATFORMS if of not in present and (third or of.fmi_2)]
        failed = f"; the compiler crashed for {', '.join(absent)}" if absent else ""
        return platforms_text(paths) + failed
    return f"{platforms_text(paths)}; for Windows, macOS and Linux: pip install ziglang, and export again"


def _binaries(name: str, sources: dict[str, str], fmi: int) -> dict[str, bytes]:
    """Binaries by their paths in the FMU: of all `PLATFORMS` with ziglang, else of this Linux with gcc."""
    if find_spec("ziglang") is not None:
        compilers = {of: [sys.executable, "-m", "ziglang", "cc", "-target", of.target] for of in PLATFORMS}
    elif sys.platform == "linux" and shutil.which(COMPILER) is not None:
        compilers = {of: [COMPILER] for of in PLATFORMS if of.fmi_3 == f"{platform.machine()}-linux"}
    else:
        compilers = {}
    flags = ["-std=c99", "-O2", "-shared", "-fPIC", "-fvisibility=hidden", "-s"]
    binaries = dict[str, bytes]()
    with TemporaryDirectory() as folder:
        for source, text in sources.items():
            (Path(folder) / source).write_text(text, encoding="utf-8")
        units = [source for source in sources if source.endswith(".c")]
        for of, compiler in compilers.items():
            if place := of.fmi_2 if fmi == 2 else of.fmi_3:
                library = f"model{of.suffix}"
                command = [*compiler, *flags, "-o", library, *units, "-lm"]
                ran = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
                if ran.returncode and not ran.stderr.strip():
                    continue  # a crash of the compiler, as of zig 0.17.1 for macOS
                if ran.returncode:
                    raise InputError(f"{' '.join(compiler[:3])}: {ran.stderr.strip().splitlines()[0]}")
                binaries[f"binaries/{place}/{name}{of.suffix}"] = (Path(folder) / library).read_bytes()
    return binaries


def _packed(files: dict[str, bytes]) -> bytes:
    """Zip archive of files, with a fixed date, so that equal files give equal bytes."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0))
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    return packed.getvalue()
