"""Files of an export: their names and content for each target, and how they are written."""

from pathlib import Path
from typing import Literal

from pneumo.configuration.experiment import Plant
from pneumo.equations.system import system
from pneumo.errors import InputError
from pneumo.export.c_source import c99
from pneumo.export.fmu import fmu
from pneumo.export.matlab import matlab
from pneumo.export.observer_noise import observer_noise
from pneumo.export.structured_text import structured_text
from pneumo.physics.models import Model
from pneumo.physics.valve_dynamics import PROPORTIONAL, ValveDynamics
from pneumo.storage.files import atomic

PRECISIONS = ("double", "float")
STEPPING = "c", "st"  # source code with steps, in either precision
TARGETS = ("c", "st", "matlab", "fmu")


def exported(
    model: Model | str,
    n: float | None,
    plant: Plant,
    target: str,
    *,
    stem: str | None = None,
    precision: str = "double",
    valve: bool = True,
    piston: bool = False,
    fmi: Literal[2, 3] = 2,
    observer: str | None = None,
    dynamics: ValveDynamics = PROPORTIONAL,
    two_valves: bool = False,
    name: str | None = None,
) -> dict[str, bytes]:
    """Files that export a model of a plant, their content by name; the main file comes first.

    Parameters
    ----------
    model : Model or str
        A row of `MODELS`, one of your own, the name of one in `MODELS`, or "full" for the full order.
    n : float or None
        Polytropic index; None where the model has none.
    plant : Plant
        Gas, valve, conditions, cylinder and k_0.
    target : str
        One of `TARGETS`.
    stem : str
        Name of the files without suffix; by default `name`.
    precision : {"double", "float"}
        Type of numbers, in C and Structured Text only.
    valve, piston : bool
        Whether the equations include the valve (without it, mass flows are inputs) and the piston by eq (3)
        (without it, position and velocity are inputs). In C, Structured Text and FMU only.
    fmi : {2, 3}
        Version of the FMU.
    observer : {"none", "one", "both"}, optional
        Add a Kalman filter that estimates the pressures from the position and from this many measured
        pressures. In C only, with valve and piston.
    dynamics : ValveDynamics
        Lag, null offset and dead band of the valve. A dead time, as a sag of the plant's supply, is only
        named in the heads of the files.
    two_valves : bool
        A valve for each chamber, with commands u_A and u_B, as in `pneumo.simulate`.
    name : str, optional
        Name with which names in the code begin, such as `left` for ``left_step``; by default the model's.

    Raises
    ------
    InputError
        If there is no such model or target, n or an option is out of range, or the name cannot be that of a
        function.
    """
    moving = piston or observer is not None
    parts = {"valve": valve, "piston": moving, "two_valves": two_valves}
    chosen = system(model, n, plant, dynamics=dynamics, own_name="" if name is None else name, **parts)
    observed = observer is not None
    what = "model name" if name is None else "--name"
    name = chosen.name if name is None else name
    stem = name if stem is None else stem
    single = precision == "float" and target not in STEPPING
    problems = {
        f"--to {target}: no such target; there are {', '.join(TARGETS)}": target not in TARGETS,
        f"--precision {precision}: must be one of {', '.join(PRECISIONS)}": precision not in PRECISIONS,
        f"--precision float: only with --to c and --to st; {target} computes in double precision": single,
        f"{what} {name!r}: must be letters, digits and _, no digit first; exported functions get this name": (
            not (name.isascii() and name.isidentifier())
        ),
        "--piston, --no-valve: only with --to c, st and fmu; matlab gets the chambers with their valve": (
            target == "matlab" and not observed and (piston or not valve)
        ),
        "--observer: only with --to c, and without --no-valve": observed and (target != "c" or not valve),
        "--observer: not for a cylinder with valve_dynamics: its filter models no lag or dead band": (
            observed and not dynamics.proportional
        ),
        "--observer: not with --two-valves: its filter models one valve": observed and two_valves,
        f"--output {stem!r}: its #include could not be read; leave out quotes and backslashes": (
            target == "c" and not (stem.isprintable() and not {*stem} & {'"', "\\"})
        ),
    }
    for text, wrong in problems.items():
        if wrong:
            raise InputError(text)
    if target == "fmu":
        return {f"{stem}.fmu": fmu(chosen, fmi)}
    if target == "c":
        noise = None if observer is None else observer_noise(chosen, observer)
        files = c99(chosen, stem, precision, noise=noise)
    elif target == "st":
        files = structured_text(chosen, stem, precision)
    else:
        files = {f"{stem}.m": matlab(chosen)}
    return {name: text.encode() for name, text in files.items()}


def write_files(files: dict[str, bytes], folder: Path) -> None:
    """Write files into a folder, each atomically: whole or not at all.

    Raises
    ------
    InputError
        If a file cannot be written.
    """
    for name, content in files.items():
        if (folder / name).is_dir():
            raise InputError(f"{folder / name}: is a folder")
        try:
            with atomic(folder / name) as part:
                part.write_bytes(content)
        except OSError as error:
            raise InputError(f"{folder / name}: cannot be written: {error.strerror}") from None
