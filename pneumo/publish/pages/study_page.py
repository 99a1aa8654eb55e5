"""`pneumo study` as one self-contained HTML page and as tables for the terminal; nothing is computed here."""

import base64
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure
from rich import box
from rich.table import Table

from pneumo.configuration.experiment import Experiment, Study
from pneumo.engineer.own_study import TITLE, save_cells
from pneumo.errors import InputError, ResultError
from pneumo.publish.figures import study_figures
from pneumo.publish.pages.verdict_page import page_environment, with_indices
from pneumo.publish.style import paper_style
from pneumo.statistics.intervals import CONFIDENCE, Interval
from pneumo.statistics.ranking import RankedModel, Ranking
from pneumo.statistics.recommendation import MATERIAL
from pneumo.storage.files import read, write_text

MARK = "pneumo study"  # names the page's maker, so that another run may replace it
PAGE, CELLS = "study.html", "study.nc"
KILO = 1e3


def picture(fig: Figure) -> str:
    """Return a figure as an SVG in a data address."""
    buffer = io.BytesIO()
    with paper_style():
        fig.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    return "data:image/svg+xml;base64," + base64.b64encode(buffer.getvalue()).decode()


def render(study: Study, cells: xr.Dataset, rankings: Sequence[Ranking]) -> str:
    """Write the page.

    Parameters
    ----------
    study : Study
    cells : xarray.Dataset
        From `pneumo.engineer.own_study.repeated`.
    rankings : sequence of Ranking
        One for each cylinder.

    Returns
    -------
    str
        HTML with style and pictures inside; the same text for the same results.
    """
    environment = page_environment()
    environment.filters["math"] = with_indices
    parts = [(ranking, _pictures(cells, ranking), _inputs(study, ranking)) for ranking in rankings]
    return environment.get_template("study.html.j2").render(
        mark=MARK,
        study=study,
        parts=parts,
        heads=HEADS,
        cells_of=cells_of,
        gain=gain_text,
        confidence=f"{100 * CONFIDENCE:.0f} %",
        material=f"{100 * MATERIAL:.0f} %",
        kilo=KILO,
    )


def _pictures(cells: xr.Dataset, ranking: Ranking) -> list[tuple[str, str]]:
    """Pictures of a cylinder as (data address, caption)."""
    if not ranking.recommended:
        return []
    found = [
        (
            study_figures.places(ranking),
            "RMS error of each model at its best constant n, both chambers together.",
        ),
        (study_figures.over_n(cells, ranking), "RMS error over n; marks: the best n of the grid."),
        (study_figures.gains(ranking), "Gain of each refinement, from paired runs."),
    ]
    found += [
        (
            study_figures.traces(cells, ranking, name),
            f"{name}, first run: position, full-order pressures, and full-order minus reduced pressure"
            " (chamber A drawn, B dashed).",
        )
        for name in ranking.experiments
        if not int(cells["run_status"].sel(experiment=name).values[0])
    ]
    return [(picture(fig), caption) for fig, caption in found]


def _inputs(study: Study, ranking: Ranking) -> list[tuple[str, str]]:
    """What was put in, in SI units: cylinder, valve and supply, then each experiment."""
    experiments: list[Experiment] = [study.experiments[name] for name in ranking.experiments]
    plant = experiments[0].plant
    c, v, s, g = plant.cylinder, plant.valve, plant.conditions, plant.gas
    law = "ISO 6358" if g.elliptic else "eq (1)"
    found = [
        ("areas A, B", f"{c.A_A:.4g}, {c.A_B:.4g} m²"),
        ("stroke, dead volume", f"{c.stroke:.4g} m, {c.V_d:.4g} m³ for each chamber"),
        ("mass, friction", f"{c.M:g} kg, {c.k_f:g} N s/m, Coulomb {c.coulomb:g} N"),
        ("constant force", f"{c.load:.4g} N"),
        (
            "valve",
            f"{v.k_xu:.4g} m²/V up to {v.u_max:g} V, exhaust {v.exhaust:g} times, leak {v.leak:.3g} m²",
        ),
        ("flow", f"{law}, critical ratio {g.critical_ratio:g}"),
        ("supply", f"{s.P_s:g} Pa, atmosphere {s.P_atm:g} Pa, start {s.P_0:.5g} Pa and {s.T_0:g} K"),
    ]
    for e in experiments:
        loop = "closed" if e.drive.closed_loop else "open"
        length = f"{e.steps * e.h:g} s in steps of {e.h:g} s"
        text = f"{loop} loop, {e.excitation.signal} signal, k_0 = {e.plant.k_0:.4g} W/K, {length}"
        found.append((e.name, text))
    return found


HEADS = ("rank", "model", "n", "RMS (kPa)", "MSE (kPa²)", "MSE / best", "geom.", "wins", "A (kPa)", "B (kPa)")
IN_TERMINAL = len(HEADS) - 2  # the chambers' RMS errors are on the page only


def _around(value: float) -> str:
    """Write a number with three digits and no exponent."""
    return f"{value:.0f}" if value >= 100 else f"{value:.1f}" if value >= 10 else f"{value:.2f}"


def cells_of(row: RankedModel) -> list[str]:
    """Cells of a model's line, by `HEADS`."""
    if not np.isfinite(row.mse.value):
        return ["–", row.model, "–", "–", f"failed in {row.failed} runs", "–", "–", str(row.wins), "–", "–"]
    mse, _, high = (value / KILO**2 for value in row.mse)
    over = _around(row.over_best.value)
    if row.place > 1 and row.over_best.known:
        over += f" ({_around(row.over_best.low)} to {_around(row.over_best.high)})"
    return [
        str(row.place),
        row.model,
        f"{row.n:g}" if np.isfinite(row.n) else "–",
        _around(mse**0.5),
        f"{_around(mse)} ± {_around(high - mse)}" if row.mse.known else _around(mse),
        over,
        str(row.geometric_place),
        str(row.wins),
        *(_around(value / KILO) for value in row.rms),
    ]


def gain_text(percent: Interval) -> str:
    """Write a gain with its interval."""
    if not np.isfinite(percent.value):
        return "–"
    around = f" ({percent.low:.0f} to {percent.high:.0f})" if percent.known else ""
    return f"{percent.value:.0f} %{around}"


def tables(ranking: Ranking) -> list[Table]:
    """Ranking and gains of a cylinder for the terminal."""
    experiments, confidence = ", ".join(ranking.experiments), f"{100 * CONFIDENCE:.0f} %"
    title = f"{ranking.cylinder}: {experiments}, {ranking.runs} runs each; intervals {confidence} over seeds"
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for head in HEADS[:IN_TERMINAL]:
        table.add_column(head, justify="left" if head == "model" else "right")
    for row in ranking.rows:
        table.add_row(*cells_of(row)[:IN_TERMINAL], style="bold" if row.model == ranking.recommended else "")
    gained = Table(
        "refinement", "models", "gain", title="Taken from the MSE", title_justify="left", box=box.SIMPLE_HEAD
    )
    for gain in ranking.gains:
        gained.add_row(gain.refinement, f"{gain.without} to {gain.refined}", gain_text(gain.percent))
    return [table, gained]


def check_folder(folder: Path) -> None:
    """Make sure that a study may write into a folder.

    Raises
    ------
    InputError
        If it is a file, cannot be written, or holds a page or cells that no study wrote.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder}: is a file; name a folder with -o")
    page, cells = folder / PAGE, folder / CELLS
    foreign = None
    if page.exists() and not (page.is_file() and MARK.encode() in page.read_bytes()[:1000]):
        foreign = page
    if cells.exists():
        try:
            foreign = foreign or (None if read(cells).attrs.get("title") == TITLE else cells)
        except ResultError:
            foreign = cells
    if foreign:
        raise InputError(
            f"{foreign}: not written by `pneumo study`, so left alone; name another folder with -o"
        )


def save_study(
    study: Study, cells: xr.Dataset, rankings: Sequence[Ranking], folder: Path
) -> tuple[Path, Path]:
    """Write page and cells of a study and return their paths."""
    save_cells(study, cells, folder / CELLS)
    write_text(render(study, cells, rankings), folder / PAGE)
    return folder / PAGE, folder / CELLS
