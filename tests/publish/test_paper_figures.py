"""Figures 7 to 11 and time traces: from small datasets, unclipped, the same bytes twice."""

import io
import itertools
import json
from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from brief import in_brief
from figure_checks import saved_whole
from invented_cells import cells_of
from matplotlib.figure import Figure
from matplotlib.text import Text

from paper.study.averages import statistics
from paper.study.figures import paper_figures as figures
from paper.study.figures.traces_figure import time_traces
from paper.study.paper_2006.printed_tables import table7, table9, traces_of_fig_7, with_percentiles
from pneumo.physics.models import MODELS
from pneumo.publish.style import DOUBLE_MM, MM_PER_INCH, SINGLE_MM, paper_style

EXPERIMENTS = ["E06", "E12"]
LEVELS = {"adiabatic": ["E06"], "typical": ["E06", "E12"], "isothermal": []}
N = [1.0, 1.2, 1.4]


def a_grid(factor: float) -> xr.Dataset:
    coords = {"experiment": EXPERIMENTS, "model": list(MODELS), "n": N, "chamber": ["A", "B"]}
    shape = [len(labels) for labels in coords.values()]
    grid = cells_of(factor * np.geomspace(5e8, 1e6, np.prod(shape)).reshape(shape), coords)
    return grid.assign_coords(k_0=("experiment", [0.1, 0.5]))


GRIDS = {"published": a_grid(1.0), "exact": a_grid(0.3)}
STATISTICS = {transport: statistics(grid, LEVELS) for transport, grid in GRIDS.items()}


def a_settling() -> xr.Dataset:
    t = np.arange(4000) * 1e-3
    free = np.clip(t - 1.5, 0, None)
    decay = np.where(t < 1.5, 0.0, np.exp(-4 * free) * np.sin(20 * free))
    step = np.where(t < 1.5, 1.0, np.exp(-4 * free) * np.cos(20 * free))
    dims = ("t", "chamber")
    data = {"x": ("t", -0.015 * step), "release_time": ((), 1.5), "status": 0}
    data["P"] = (dims, np.stack([5.6e5 + 1.4e5 * step, 5.6e5 - 4e5 * step], axis=1))
    data["T"] = (dims, np.stack([293 - 70 * decay, 293 + 110 * decay], axis=1))
    data["settling_time"] = ("quantity", [1.281, 1.061, 1.063, 0.937])
    coords = {"t": t, "chamber": ["A", "B"], "quantity": ["P_A", "P_B", "T_A", "T_B"]}
    return xr.Dataset(data, coords, {"experiment_parameters": json.dumps({"push": {"force": -300.0}})})


def a_datum(seconds: float) -> xr.Dataset:
    t = np.arange(round(seconds / 1e-3) + 1) * 1e-3
    wave = 5e5 + 2e5 * np.sin(15 * t)
    coords = {"t": t, "chamber": ["A", "B"], "experiment": "E06"}
    return xr.Dataset({"P": (("t", "chamber"), np.stack([wave, 1e6 - wave], axis=1)), "status": 0}, coords)


def a_replay(datum: xr.Dataset, bias: float) -> xr.Dataset:
    biases = np.resize(bias * np.arange(10, 0, -1), len(MODELS))
    error = xr.DataArray(biases, coords={"model": list(MODELS)})
    pressure = (datum["P"].isel(t=slice(None, None, 10)) - error).expand_dims(n=N)
    return pressure.transpose("model", "n", "chamber", "t").to_dataset(name="pressure")


def draw_traces(seconds: float = 3.0) -> Figure:
    datum = a_datum(seconds)
    replays = {transport: a_replay(datum, bias) for transport, bias in (("published", 3e3), ("exact", 1e3))}
    return time_traces(datum, replays, STATISTICS)


DRAW: dict[str, Callable[[], Figure]] = {
    "fig07": lambda: figures.fig07(a_settling(), traces_of_fig_7()),
    "fig08": lambda: figures.fig08(STATISTICS, table7()),
    "fig09": lambda: figures.fig09(STATISTICS, with_percentiles(table7(), 9)),
    "fig10": lambda: figures.fig10(STATISTICS, with_percentiles(table7(), 10)),
    "fig11": lambda: figures.fig11(STATISTICS, with_percentiles(table9(), 11)),
    "traces": draw_traces,
}


def texts(fig: Figure) -> list[str]:
    return [text.get_text() for text in fig.findobj(Text) if text.get_visible()]


@pytest.mark.parametrize("name", in_brief(DRAW, ["fig08"]))
def test_figure_is_unclipped_and_the_same_on_two_renders(name, tmp_path):
    fig, again = DRAW[name](), io.BytesIO()
    svg = saved_whole(fig, tmp_path / name)
    with paper_style():
        DRAW[name]().savefig(again, format="svg", metadata={"Date": None, "Creator": None})
    assert svg.read_bytes() == again.getvalue()
    width_mm = fig.get_size_inches()[0] * MM_PER_INCH
    assert np.isclose(width_mm, [SINGLE_MM, DOUBLE_MM]).any()
    with paper_style():
        boxes = [ax.get_tightbbox() for ax in fig.axes] + [item.get_window_extent() for item in fig.legends]
    for one, other in itertools.combinations(boxes, 2):
        assert not one.overlaps(other), f"{name}: two panels, or a legend and a panel, touch"


@pytest.mark.parametrize(("name", "models"), [("fig08", list(MODELS)), ("fig10", list(MODELS)[4:])])
def test_bars_are_as_high_as_the_results(name, models):
    bars = {c.get_label(): [bar.get_height() for bar in c] for c in DRAW[name]().axes[0].containers}
    averages = {
        "printed in the paper": table7()["mse"],
        "reproduced": STATISTICS["published"]["mse"].sel(level="overall"),
        "reproduced, exact signals": STATISTICS["exact"]["mse"].sel(level="overall"),
    }
    assert bars.keys() == averages.keys()
    for label, mse in averages.items():  # an added model has no printed bar
        np.testing.assert_array_equal(bars[label], mse.reindex(model=models))
