"""Figures 7 to 11, time traces and error over n: from small datasets, unclipped, the same bytes twice."""

import io
import itertools
import json
from collections.abc import Callable

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure
from matplotlib.text import Text

from pneumo.physics.models import MODELS
from pneumo.publish.figures import performance_figures as figures
from pneumo.publish.figures.panels import symbol
from pneumo.publish.figures.settling_figure import fig07
from pneumo.publish.figures.traces_figure import mse_over_n, time_traces
from pneumo.publish.style import DOUBLE_MM, MM_PER_INCH, SINGLE_MM, paper_style, save
from pneumo.statistics.averages import statistics
from pneumo.verdict.published import table7, table9

EXPERIMENTS = ["E06", "E12"]
LEVELS = {"adiabatic": ["E06"], "typical": ["E06", "E12"], "isothermal": []}
N = [1.0, 1.2, 1.4]
TRANSPORTS = ["published", "exact"]


def a_grid(factor: float) -> xr.Dataset:
    shape = (len(EXPERIMENTS), len(MODELS), len(N), 2)
    mse = factor * np.geomspace(5e8, 1e6, np.prod(shape)).reshape(shape)
    dims = ("experiment", "model", "n", "chamber")
    return xr.Dataset(
        {
            "mean_error": (dims, 0.1 * np.sqrt(mse)),
            "variance": (dims, 0.99 * mse),
            "mse": (dims, mse),
            "failure_time": (dims, np.full(shape, np.nan)),
        },
        coords={"experiment": EXPERIMENTS, "model": list(MODELS), "n": N, "chamber": ["A", "B"]}
        | {"k_0": ("experiment", [0.1, 0.5])},
    )


GRIDS = {"published": a_grid(1.0), "exact": a_grid(0.3)}
STATISTICS = {transport: statistics(grid, LEVELS) for transport, grid in GRIDS.items()}


def a_settling() -> xr.Dataset:
    t = np.arange(4000) * 1e-3
    free = np.clip(t - 1.5, 0, None)
    decay = np.where(t < 1.5, 0.0, np.exp(-4 * free) * np.sin(20 * free))
    step = np.where(t < 1.5, 1.0, np.exp(-4 * free) * np.cos(20 * free))
    dims = ("t", "chamber")
    return xr.Dataset(
        {
            "x": ("t", -0.015 * step),
            "P": (dims, np.stack([5.6e5 + 1.4e5 * step, 5.6e5 - 4e5 * step], axis=1)),
            "T": (dims, np.stack([293 - 70 * decay, 293 + 110 * decay], axis=1)),
            "settling_time": ("quantity", [1.281, 1.061, 1.063, 0.937]),
            "release_time": ((), 1.5),
            "status": 0,
        },
        coords={"t": t, "chamber": ["A", "B"], "quantity": ["P_A", "P_B", "T_A", "T_B"]},
        attrs={"experiment_parameters": json.dumps({"push": {"force": -300.0}})},
    )


def a_datum(seconds: float) -> xr.Dataset:
    t = np.arange(round(seconds / 1e-3) + 1) * 1e-3
    wave = 5e5 + 2e5 * np.sin(15 * t)
    pressure = np.stack([wave, 1e6 - wave], axis=1)
    return xr.Dataset(
        {"P": (("t", "chamber"), pressure), "status": 0},
        coords={"t": t, "chamber": ["A", "B"], "experiment": "E06"},
    )


def a_replay(datum: xr.Dataset, bias: float) -> xr.Dataset:
    error = xr.DataArray(bias * np.arange(len(MODELS), 0, -1), coords={"model": list(MODELS)})
    pressure = (datum["P"].isel(t=slice(None, None, 10)) - error).expand_dims(n=N)
    return pressure.transpose("model", "n", "chamber", "t").to_dataset(name="pressure")


def draw_traces(seconds: float = 3.0) -> Figure:
    datum = a_datum(seconds)
    replays = {transport: a_replay(datum, bias) for transport, bias in (("published", 3e3), ("exact", 1e3))}
    return time_traces(datum, replays, STATISTICS)


DRAW: dict[str, Callable[[], Figure]] = {
    "fig07": lambda: fig07(a_settling()),
    "fig08": lambda: figures.fig08(STATISTICS, table7()),
    "fig09": lambda: figures.fig09(STATISTICS, table7()),
    "fig10": lambda: figures.fig10(STATISTICS, table7()),
    "fig11": lambda: figures.fig11(STATISTICS, table9()),
    "traces": draw_traces,
    "mse_over_n": lambda: mse_over_n(GRIDS, LEVELS),
}


def texts(fig: Figure) -> list[str]:
    return [text.get_text() for text in fig.findobj(Text) if text.get_visible()]


@pytest.mark.parametrize("name", DRAW)
def test_figure_is_unclipped_and_the_same_on_two_renders(name, tmp_path):
    fig = DRAW[name]()
    svg, png = save(fig, tmp_path / name)
    again = io.BytesIO()
    with paper_style():
        DRAW[name]().savefig(again, format="svg", metadata={"Date": None, "Creator": None})
    assert svg.read_bytes() == again.getvalue()
    assert png.stat().st_size > 10_000

    width_mm = fig.get_size_inches()[0] * MM_PER_INCH
    assert np.isclose(width_mm, [SINGLE_MM, DOUBLE_MM]).any()
    with paper_style():
        ink, page = fig.get_tightbbox(), fig.get_size_inches()
        assert ink.x0 >= 0 and ink.y0 >= 0 and ink.x1 <= page[0] and ink.y1 <= page[1], f"{name} is clipped"
        boxes = [ax.get_tightbbox() for ax in fig.axes] + [item.get_window_extent() for item in fig.legends]
    for one, other in itertools.combinations(boxes, 2):
        assert not one.overlaps(other), f"{name}: two panels, or a legend and a panel, touch"


def test_fig07_shows_force_release_and_settling_times():
    fig = DRAW["fig07"]()
    force = fig.axes[0].lines[0]
    assert list(force.get_xdata())[1:3] == [1.5, 1.5] and list(force.get_ydata()) == [-300, -300, 0, 0]
    shown = [text for text in texts(fig) if text.startswith("$t_s$")]
    assert shown == [f"$t_s$ = {t_s:.3f} s" for t_s in (1.281, 1.063, 1.061, 0.937)]  # P_A, T_A, P_B, T_B


@pytest.mark.parametrize(("name", "models"), [("fig08", list(MODELS)), ("fig10", list(MODELS)[4:])])
def test_bars_are_as_high_as_the_results(name, models):
    bars = {c.get_label(): [bar.get_height() for bar in c] for c in DRAW[name]().axes[0].containers}
    averages = {
        "printed in the paper": table7()["mse"],
        "reproduced": STATISTICS["published"]["mse"].sel(level="overall"),
        "reproduced, exact transport": STATISTICS["exact"]["mse"].sel(level="overall"),
    }
    assert bars == {label: mse.sel(model=models).values.tolist() for label, mse in averages.items()}


def test_fig11_says_which_level_has_no_experiments_and_leaves_out_m4():
    panels = {ax.get_title(): [text.get_text() for text in ax.texts] for ax in DRAW["fig11"]().axes}
    assert panels == {"adiabatic": [], "typical": [], "isothermal": ["not reproduced: no experiment"]}
    labels = [text.get_text() for text in DRAW["fig11"]().axes[0].get_xticklabels()]
    assert labels == [symbol(model) for model in MODELS if model != "M4"]


@pytest.mark.parametrize(("seconds", "window"), [(1.0, (0.0, 1.0)), (3.0, (1.0, 3.0)), (23.0, (20.0, 22.0))])
def test_traces_fit_their_window_to_the_run(seconds, window):
    axes = draw_traces(seconds).axes
    np.testing.assert_allclose([ax.get_xlim() for ax in axes], [window] * len(axes))


def test_residual_is_full_order_minus_reduced():
    # Rows of two columns; the zero line is fig. M7 and M8 are four and three biases too low.
    below = draw_traces().axes[4]
    for line, residual in zip(below.lines[1:], (12.0, 9.0), strict=True):
        np.testing.assert_allclose(line.get_ydata(), residual, rtol=1e-9)


def test_a_model_that_failed_everywhere_is_left_out():
    grid = GRIDS["published"].copy(deep=True)
    grid["mse"].loc[{"model": "M5"}] = np.nan
    failed = dict.fromkeys(TRANSPORTS, statistics(grid, LEVELS))
    datum = a_datum(3.0)
    replays = dict.fromkeys(TRANSPORTS, a_replay(datum, 1e3))
    assert len(time_traces(datum, replays, failed).axes[2].lines) == 2  # zero and M1
    assert "$M_{5}$" in texts(figures.fig10(failed, table7()))  # its printed value still stands there


@pytest.mark.parametrize("name", ["fig08", "fig09", "fig10", "fig11"])
def test_averages_name_the_experiments_that_they_leave_out(name):
    failed = {transport: data.copy(deep=True) for transport, data in STATISTICS.items()}
    failed["published"]["failure_time"][0] = 0.4
    table = table9() if name == "fig11" else table7()
    left_out = f"left out, since the full-order run failed: {EXPERIMENTS[0]}"
    assert left_out in texts(getattr(figures, name)(failed, table))
    assert not any("left out" in text for text in texts(DRAW[name]()))


def test_models_without_n_are_horizontal_lines():
    for ax in DRAW["mse_over_n"]().axes:
        lines = {line.get_label(): line for line in ax.lines}
        assert set(lines) == {symbol(model) for model in MODELS}
        bare = {label for label, line in lines.items() if line.get_marker() == "None"}
        assert bare == {"$M_{1}$", "$M_{3}$", "$M_{4}$"}
