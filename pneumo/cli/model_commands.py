"""``pneumo linearise``, ``export`` and ``models``: linear models, source code, and the table of models."""

import shlex
from pathlib import Path
from typing import Annotated, Literal

import typer
from typer import Option

from pneumo.cli.options import (
    MODEL,
    Conductance,
    Config,
    Cylinder,
    Index,
    Trust,
    check_index,
    output_to,
    read_configuration,
)

LEAST_PRESSURE = 0.1  # of the atmosphere, at an operating point
STEADY = 1.0  # Pa/s; slower is an equilibrium to all digits that a user types


def linearise(
    model: Annotated[str, MODEL],
    u: Annotated[float, Option("--u", help="command at the operating point, V")],
    P_A: Annotated[float, Option("--P_A", help="absolute pressure of chamber A, Pa")],
    P_B: Annotated[float, Option("--P_B", help="absolute pressure of chamber B, Pa")],
    x: Annotated[float, Option("--x", help="position from mid-stroke, m")] = 0.0,
    v: Annotated[float, Option("--v", help="velocity, m/s")] = 0.0,
    T_A: Annotated[float | None, Option("--T_A", help="full: temperature of chamber A, K [T_0]")] = None,
    T_B: Annotated[float | None, Option("--T_B", help="full: temperature of chamber B, K [T_0]")] = None,
    states: Annotated[
        Literal["chambers", "actuator"],
        Option(help="chambers: x and v are inputs; actuator: they are states"),
    ] = "chambers",
    n: Index = None,
    cylinder: Cylinder = None,
    k0: Conductance = None,
    config: Config = None,
    trust: Trust = False,
    as_json: Annotated[bool, Option("--json", help="print A and B as JSON")] = False,
) -> None:
    """Print a linear model of chambers or actuator at a point."""
    import json

    from pneumo.equations.system import quantity, rate_unit, rates, system
    from pneumo.errors import InputError
    from pneumo.linear.linear_model import linearise as linear_model
    from pneumo.selection.plants import configured_rig

    check_index(model, n)
    _, plant, dynamics = configured_rig(read_configuration(config, trust), cylinder, k0)
    names = system(model, n, plant, piston=states == "actuator", dynamics=dynamics)
    least, most = plant.conditions.P_atm, plant.conditions.P_s
    for name, P in (("P_A", P_A), ("P_B", P_B)):
        if 0 < P < LEAST_PRESSURE * least:
            limit = f"a tenth of the atmosphere, {least:g} Pa"
            raise InputError(f"{name} = {P:g} Pa: must be at least {limit}; is it in bar?")
        if P > 0 and not least <= P <= most:
            usual = f"{least:g} (atmosphere) to {most:g} (supply)"
            typer.echo(f"note: {name} = {P:g} Pa, outside {usual}", err=True)
    if dynamics.dead_time:
        typer.echo(f"note: the valve's dead time, {1e3 * dynamics.dead_time:.4g} ms, is left out", err=True)
    point = {"u": u, "x": x, "v": v, "P_A": P_A, "P_B": P_B}
    linear = linear_model(model, n, plant, **point, T_A=T_A, T_B=T_B, states=states, dynamics=dynamics)
    T_0 = plant.conditions.T_0
    point |= {"T_A": T_0 if T_A is None else T_A, "T_B": T_0 if T_B is None else T_B}
    point |= {"opening": u, "force": 0.0}
    at = rates(names, *([point[name] for name in group] for group in (names.states, names.inputs)))
    moving = [
        f"d{name}/dt = {rate:.3g} Pa/s"
        for name, rate in zip(names.states, (complex(rate).real for rate in at), strict=True)
        if name.startswith("P_") and abs(rate) > STEADY
    ]
    if moving:
        typer.echo(f"note: the point is not an equilibrium: {', '.join(moving)}", err=True)
    A, B = ([[float(rate) for rate in row] for row in matrix] for matrix in (linear.A, linear.B))
    if as_json:
        return typer.echo(json.dumps({"states": names.states, "inputs": names.inputs, "A": A, "B": B}))
    heads = [f"{name} ({quantity(name)[0]})" for name in (*names.states, *names.inputs)]
    typer.echo(" " * 18 + "  ".join(f"{head:>14}" for head in heads))
    for state, by_state, by_input in zip(names.states, A, B, strict=True):
        head = f"d{state}/dt ({rate_unit(state)})"
        typer.echo(f"{head:18}" + "  ".join(f"{rate:14.6g}" for rate in by_state + by_input))
    return None


def export(
    model: Annotated[str, MODEL],
    to: Annotated[str, Option(help="c, st (IEC 61131-3), matlab (and Octave) or fmu")],
    n: Index = None,
    cylinder: Cylinder = None,
    k0: Conductance = None,
    config: Config = None,
    trust: Trust = False,
    precision: Annotated[str, Option(help="double, or float (c and st only)")] = "double",
    valve: Annotated[
        bool, Option("--valve/--no-valve", help="with the valve's flow; without it mass flows are inputs")
    ] = True,
    two_valves: Annotated[
        bool, Option("--two-valves", help="a valve for each chamber, with the inputs u_A and u_B")
    ] = False,
    piston: Annotated[
        bool,
        Option("--piston/--no-piston", help="with the equation of motion; without it x and v are inputs"),
    ] = False,
    observer: Annotated[
        Literal["none", "one", "both"] | None,
        Option(help="c: with a filter that estimates the pressures, from x and this many measured"),
    ] = None,
    fmi: Annotated[Literal["2", "3"], Option(help="version of the FMU")] = "2",
    name: Annotated[
        str | None, Option(help="name of functions, blocks and FMU, for several in one program [the model's]")
    ] = None,
    output: Annotated[Path | None, output_to("file to write [a single file: standard output]")] = None,
) -> None:
    """Write a model as source code, or as an FMU."""
    from pneumo.equations.system import system
    from pneumo.errors import InputError
    from pneumo.export import exported, write_files
    from pneumo.export.printing import validity
    from pneumo.selection.plants import configured_rig

    if to == "simulink" or (output and output.suffix == ".slx"):
        raise InputError("Simulink imports an FMU: use --to fmu --output FILE.fmu, and the block FMU Import")
    suffix = {"c": ".c", "st": ".st", "fmu": ".fmu", "matlab": ".m"}.get(to)
    if suffix and (to in ("c", "st", "fmu") if output is None else output.suffix != suffix):
        raise InputError(f"--to {to}: needs --output FILE{suffix}")
    check_index(model, n)
    _, plant, dynamics = configured_rig(read_configuration(config, trust), cylinder, k0)
    files = exported(
        model,
        n,
        plant,
        to,
        stem=output.stem if output else None,
        precision=precision,
        valve=valve,
        piston=piston,
        fmi=3 if fmi == "3" else 2,
        observer=observer,
        dynamics=dynamics,
        two_valves=two_valves,
        name=name,
    )
    if output is None:
        return typer.echo("".join(text.decode() for text in files.values()), nl=False)
    if not output.parent.exists():
        typer.echo(f"{output.parent}: new folder")
    write_files(files, output.parent)
    moving = piston or observer is not None
    chosen = system(model, n, plant, valve=valve, piston=moving, dynamics=dynamics, two_valves=two_valves)
    typer.echo(f"{', '.join(str(output.parent / file) for file in files)}: written")
    typer.echo(f"states {', '.join(chosen.states)}; inputs {', '.join(chosen.inputs)}")
    if to == "fmu":
        from pneumo.export.fmu import platforms_note

        typer.echo(platforms_note(files[output.name]))
    if limit := validity(chosen):
        typer.echo(f"note: {limit}")
    if to == "c":
        stem = output.with_suffix("")
        build = shlex.join(["cc", "-O2", str(output), f"{stem}_test.c", "-lm", "-o", f"{stem}_test"])
        run = shlex.quote(f"{stem}_test" if stem.is_absolute() else f"./{stem}_test")
        typer.echo(f"Test it: {build} && {run}")
    return None


def models() -> None:
    """Print the table of models: their exponents, laws and wall heat."""
    from rich.console import Console
    from rich.table import Table

    from pneumo.physics.models import MODELS, Model

    table = Table(*(field.replace("_", " ") if field != "n_V" else "n V" for field in Model._fields))
    for model in MODELS.values():
        table.add_row(*(str(cell) for cell in model))
    Console().print(table)
