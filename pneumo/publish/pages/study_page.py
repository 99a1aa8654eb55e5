"""Page of `pneumo study`: one self-contained HTML file beside the cells it shows."""

from collections.abc import Sequence
from pathlib import Path

import xarray as xr

from pneumo.configuration.experiment import Experiment, Study
from pneumo.configuration.parameters import sonic_conductance
from pneumo.errors import InputError
from pneumo.publish.figures.budget_bars import MOST_SHOWN, budget_bars, causes
from pneumo.publish.pages.page import page_text
from pneumo.publish.text.formatting import KILO, percent_text
from pneumo.publish.text.terminal_tables import (
    BUDGET_TITLE,
    STUDY_HEADS,
    budget_cells,
    budget_heads,
    ranking_rows,
)
from pneumo.selection.answer import Answer, export_command
from pneumo.selection.cylinder_ranking import REST, save_cells
from pneumo.selection.ranking import MATERIAL, Ranking
from pneumo.statistics.intervals import CONFIDENCE
from pneumo.storage.files import write_text

MM2, CM3 = 1e6, 1e6  # in a m², in a m³
MARK = "pneumo study"  # in the page, so that another run may overwrite it
PAGE, CELLS = "study.html", "study.nc"


def study_page(study: Study, answers: Sequence[Answer], commands: Sequence[str] = ()) -> str:
    """Write the page, style and bars inside, with the answer for each cylinder.

    `commands` export each answer's model; by default from a configuration of unknown name. The same results
    give the same text.
    """
    commands = commands or [export_command(answer, study) for answer in answers]
    parts = [
        (answer, command, budget_bars(answer) if answer.chosen else [], _inputs(study, answer.ranking))
        for answer, command in zip(answers, commands, strict=True)
    ]
    return page_text(
        "study.html.j2",
        mark=MARK,
        study=study,
        parts=parts,
        causes=causes,
        heads=STUDY_HEADS,
        ranking_rows=ranking_rows,
        budget_title=BUDGET_TITLE,
        budget_heads=budget_heads,
        budget_cells=budget_cells,
        confidence=percent_text(CONFIDENCE),
        material=percent_text(MATERIAL),
        kilo=KILO,
        most_shown=f"{MOST_SHOWN:g}",
        rest=REST,
    )


def _inputs(study: Study, ranking: Ranking) -> list[tuple[str, str]]:
    """Inputs as (name, text): cylinder, valve and supply, then each experiment."""
    experiments: list[Experiment] = [study.experiments[name] for name in ranking.experiments]
    plant = experiments[0].plant
    c, v, s, g = plant.cylinder, plant.valve, plant.conditions, plant.gas
    size = f"{v.k_xu * MM2:.4g} mm²/V"
    if g.elliptic:
        size = f"C = {sonic_conductance(v, g):.4g} dm³/(s bar), b = {g.critical_ratio:g}"
    leak = f"leak {v.leak * MM2:.3g} mm²" if v.leak else "no leak"
    load, on_rod = f"{c.load:.4g} N", (c.A_B - c.A_A) * s.P_atm
    if on_rod:
        load += f", of it {on_rod:.4g} N by the atmosphere on the rod"
    supply = f"P_s = {s.P_s / KILO:g} kPa, atmosphere {s.P_atm / KILO:g} kPa"
    inputs = [
        ("areas A, B", f"{c.A_A * MM2:.4g}, {c.A_B * MM2:.4g} mm²"),
        ("stroke", f"{c.stroke * KILO:.4g} mm"),
        ("dead volumes A, B", f"{c.V_d_A * CM3:.4g}, {c.V_d_B * CM3:.4g} cm³"),
        ("mass, friction", f"{c.M:g} kg, {c.k_f:g} N s/m, Coulomb {c.coulomb:g} N"),
        ("constant force", load),
        ("valve", f"{size} up to {v.u_max:g} V, exhaust {v.exhaust:g} times, {leak}"),
        ("flow", "ISO 6358" if g.elliptic else f"eq (1), critical ratio {g.critical_ratio:.4g}"),
        ("supply", f"{supply}, start {s.P_0 / KILO:.4g} kPa and {s.T_0:g} K"),
    ]
    for e in experiments:
        length = f"{e.duration:g} s in steps of {e.h:g} s"
        text = f"{e.loop} loop, {e.excitation.signal} signal, k_0 = {e.plant.k_0:.4g} W/K, {length}"
        inputs.append((e.name, text))
    return inputs


def check_folder(folder: Path) -> None:
    """Raise `InputError` if a folder contains a page of another origin."""
    page = folder / PAGE
    if page.exists() and not (page.is_file() and MARK.encode() in page.read_bytes()[:1000]):
        raise InputError(f"{page}: not written by `{MARK}`, not overwritten; name another folder with -o")


def save_study(
    study: Study, cells: xr.Dataset, answers: Sequence[Answer], folder: Path, commands: Sequence[str] = ()
) -> tuple[Path, Path]:
    """Write page and cells of a study and return their paths; `commands` are those of `study_page`."""
    save_cells(study, cells, folder / CELLS)
    write_text(study_page(study, answers, commands), folder / PAGE)
    return folder / PAGE, folder / CELLS
