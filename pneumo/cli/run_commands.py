"""``pneumo simulate``: a run of a configured cylinder; ``pneumo live``: a page that does it in the browser.

Modules are imported inside the function, so that help and errors of usage are fast.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer
from typer import Argument, Option

from pneumo.cli.options import Conductance, Cylinder, Trust, output_to, read_configuration

if TYPE_CHECKING:
    import numpy as np

AFTER = 3.0  # s, default time after the last change of the command
MOST_STEPS = 5_000_000  # of a run


def simulate(
    files: Annotated[list[Path], Argument(help="configuration; later files override earlier ones")],
    start: Annotated[
        Literal["vented", "retracted", "extended", "rest", "pressurised"],
        Option("--from", help="state at the start"),
    ] = "vented",
    command: Annotated[
        str | None,
        Option(
            help="command, V: `10`; a sequence with times, s: `10,-10@0.5,0@1`; or a CSV file with columns t"
            " and u, or u_A and u_B of a valve for each chamber [fully open]"
        ),
    ] = None,
    reference: Annotated[
        str | None,
        Option(help="in place of a command, without valve_dynamics: position, mm from mid-stroke; CSV: t, x"),
    ] = None,
    gain: Annotated[
        float | None, Option(min=0.0, help="gain > 0 of the position control, V/m [closed_loop.k_p_V_per_m]")
    ] = None,
    time: Annotated[
        float | None, Option(min=0.0, help="length of the run, s [3 s after the last change]")
    ] = None,
    step: Annotated[float, Option(min=1e-6, max=1.0, help="step, s")] = 1e-3,
    cylinder: Cylinder = None,
    k0: Conductance = None,
    trust: Trust = False,
    output: Annotated[
        Path | None, output_to("file for the run, .nc or .csv; its figure is written beside it")
    ] = None,
) -> None:
    """Simulate strokes: times, speeds, pressures, air.

    The piston has no cushions: it meets the ends at full speed.
    """
    import numpy as np

    from pneumo import runs
    from pneumo.configuration.parameters import study
    from pneumo.configuration.priors import conversion_notes
    from pneumo.errors import InputError
    from pneumo.selection.plants import configured_rig

    if command is not None and reference is not None:
        raise InputError("--command, --reference: give at most one")
    if output is not None and output.suffix not in (".nc", ".csv"):
        raise InputError(f"-o {output}: must end with .nc or .csv")
    if output is not None:
        from pneumo.storage.files import check_output

        check_output(output.absolute().parent)
    configuration = read_configuration(files, trust)
    name, plant, dynamics = configured_rig(configuration, cylinder, k0)
    for note in conversion_notes(configuration):
        typer.echo(f"note: {note}", err=True)
    command = command or f"{plant.valve.u_max:g}"
    option, text = ("--reference", reference) if reference else ("--command", command)
    times, values = _signal(option, text, ("x",) if reference else ("u",))
    end = times[-1] + AFTER if time is None else time
    if not 2 * step <= end <= MOST_STEPS * step:
        raise InputError(f"--time = {end:g} s: must be 2 to {MOST_STEPS:g} steps of {step:g} s")
    at = np.searchsorted(times, step * (np.arange(round(end / step) + 1) + 1e-6), side="right") - 1
    held = values[np.maximum(at, 0)]
    signals: dict[str, Any] = {"command": held[:, 0] if held.shape[1] == 1 else held}
    if reference:
        loop = configuration.cylinders[name].closed_loop
        k_p = loop.k_p_V_per_m if gain is None and loop else gain
        if k_p is None:
            raise InputError("--gain: missing; the cylinder has no section closed_loop")
        signals = {"reference": held[:, 0] * 1e-3, "k_p": k_p}
    run = runs.simulate(plant, step, start=start, dynamics=dynamics, **signals)
    typer.echo(f"from {start} with {option} {text}: {run}")
    if output is not None:
        _write(run, output, study(configuration).config_sha256)


def live(
    output: Annotated[Path | None, output_to("file for a copy of the page, instead of opening it")] = None,
) -> None:
    """Open the page that studies and simulates a cylinder in the browser.

    It is one file and loads nothing else.
    """
    import webbrowser

    from pneumo.publish.pages.page import LIVE_PAGE
    from pneumo.storage.files import write_text

    if output is None:
        typer.echo(LIVE_PAGE)
        webbrowser.open(LIVE_PAGE.as_uri())
    else:
        write_text(LIVE_PAGE.read_text(encoding="utf-8"), output)
        typer.echo(f"{output}: written")


def _number(option: str, text: str) -> float:
    from pneumo.configuration.text_file import NUMBER
    from pneumo.errors import InputError, printable

    if not NUMBER.fullmatch(text.strip()):
        raise InputError(f"{option} = {printable(text, 40)}: must be a number")
    return float(text)


def _signal(option: str, text: str, columns: tuple[str, ...]) -> "tuple[np.ndarray, np.ndarray]":
    """Times, s, from which values hold, and the values, shape (time, signal). Headers may have units."""
    import numpy as np

    from pneumo.errors import InputError

    if text.lower().endswith(".csv"):
        from pneumo.configuration.text_file import read_column, read_csv

        file = Path(text)
        headers = read_csv(file.absolute(), option).columns
        names = headers.str.replace(r"_[sV]$| \[(s|V|mm)\]$|_mm$", "", regex=True)
        plain = dict(zip(names, headers, strict=True))
        if columns == ("u",) and {"u_A", "u_B"} <= {*plain}:
            columns = ("u_A", "u_B")
        series = [np.array(read_column(file, plain.get(name, name), option)) for name in ("t", *columns)]
        times, values = series[0] - series[0][0], np.stack(series[1:], axis=1)
    else:
        parts = [part.partition("@") for part in text.split(",")]
        times = np.array([_number(option, at) if sign else 0.0 for _, sign, at in parts])
        values = np.array([[_number(option, value)] for value, _, _ in parts])
    if times[0] != 0 or (np.diff(times) <= 0).any():
        raise InputError(f"{option}: times must begin at 0 and increase")
    return times, values


def _write(run: Any, output: Path, config_sha256: str) -> None:
    from pneumo.publish.style import save
    from pneumo.storage.files import atomic, attributes, write

    if output.suffix == ".csv":
        with atomic(output) as part:
            run.to_table().to_csv(part, index=False)
    else:
        about = attributes("Simulated run of a cylinder", repr(run), config_sha256)
        write(run.to_xarray(), output, about)
    svg, png = save(run.plot(), output.with_suffix(""))
    typer.echo(f"{output}, {svg}, {png}: written")
