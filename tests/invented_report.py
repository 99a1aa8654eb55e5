"""The report's page of invented runs of the paper's experiments."""

from functools import cache

import numpy as np
import xarray as xr
from packed_traces import unpacked
from paper_study import STUDY as PAPER

from paper.study.pages import report_page as report
from paper.study.pages.packing import MISSING
from paper.study.pages.report_page import part, report_page
from paper.study.trace_layout import TRACED, interval_edges, n_shown, shown_steps
from paper_verdict.page import LOOKS
from pneumo.physics.models import MODELS

HOSTILE = "</script><img src=x onerror=alert(1)>"
MANY_VALUES = 60  # waves in an invented trace
BYTES = 8_000_000  # largest size of the page


def runs(experiment, seed):
    """A full-order run, mean square errors, traces and best n: waves that depend on sampling, model and n."""
    rng = np.random.default_rng(seed)
    shown, edges = shown_steps(experiment), interval_edges(experiment)
    frequencies, phases = rng.uniform(10, 2000, MANY_VALUES), rng.uniform(0, 7, MANY_VALUES)
    angle = (shown / experiment.steps)[:, None] * frequencies + phases
    waves = np.sin(angle) @ rng.normal(0, 1, (MANY_VALUES, 4)) / MANY_VALUES**0.5
    steps = np.arange(experiment.steps + 1)
    P = np.stack([np.interp(steps, shown, p) for p in (5e5 + 8e4 * waves[:, :2]).T], axis=1)
    u = 5 * np.sign(np.sin(steps * experiment.h * 30.0))
    datum = xr.Dataset({"P": (("t", "chamber"), P), "u": ("t", u), "x": ("t", 0.04 * np.sin(steps * 1e-3))})
    datum = datum.assign_coords(chamber=["A", "B"]).assign(status=np.int8(0), failure_time=np.nan)
    mse, traces, best = {}, {}, {}
    has_n = np.array([[name in MODELS and MODELS[name].has_n] for name in TRACED])
    for transport, factor in {"published": 2.0, "exact": 1.0}.items():
        size = (
            np.resize([10, 4, 6, 50, 3, 2.5, 1.5, 1.2, 1.1, 1.0, 1.4, 0.8], (len(TRACED), 1)) * factor * 1e3
        )
        far = np.where(has_n, 1 + 8 * np.abs(np.array(PAPER.n) - rng.choice(PAPER.n, (len(TRACED), 1))), 1.0)
        grid = {"model": list(TRACED), "n": list(PAPER.n), "chamber": ["A", "B"]}
        square = (size * far)[:, :, None] ** 2 * np.mean((waves[:, 2:] + 0.2) ** 2, axis=0)
        of_all = xr.DataArray(square, grid, list(grid))
        mse[transport] = of_all.sel(model=list(MODELS))
        best[transport] = mse[transport].mean("chamber").idxmin("n")
        places = n_shown(of_all.mean("chamber").values, PAPER.n)
        scale = (size * far)[np.arange(len(TRACED)), places][:, :, None, None]
        error = (scale * (waves[:, 2:].T + 0.2)).astype(np.float32)
        spread = rng.lognormal(0, 0.5, (1, 1, 2, len(edges) - 1))
        dims = ("choice", "model", "chamber")
        traces[transport] = xr.Dataset(
            {
                "error": ((*dims, "t"), error),
                "mean_square": ((*dims, "edge"), (scale * spread) ** 2),
                "lowest": ((*dims, "edge"), -2 * scale * spread),
                "highest": ((*dims, "edge"), 3 * scale * spread),
                "n_shown": (dims[:2], np.array(PAPER.n)[places]),
            },
            {"model": list(TRACED), "chamber": ["A", "B"]},
        )
    return datum, mse, traces, best


@cache
def made():
    """Runs of every experiment of the paper."""
    return {name: runs(experiment, seed) for seed, (name, experiment) in enumerate(PAPER.experiments.items())}


@cache
def parts():
    """What the page shows of these runs."""
    return [part(PAPER.experiments[name], *run[:3]) for name, run in made().items()]


@cache
def verdict():
    """Counts of a verdict."""
    statuses = {status: 10 + i for i, status in enumerate(LOOKS)}
    places = [{"name": "Fig. 7", "link": "figures/fig07.svg"}, {"name": "Table 7", "link": "statistics.nc"}]
    return {"headline": {"facts": 75, "statuses": statuses}, "places": places}


@cache
def page():
    """The page."""
    return report_page(PAPER, parts(), verdict(), None, False)


def hostile():
    """The page of one run whose names are markup."""
    experiment = PAPER.experiments["E06"]._replace(name=HOSTILE, cylinder="<b>&")
    mine = PAPER._replace(name="<script>alert(2)</script>", experiments={HOSTILE: experiment})
    return report_page(mine, [part(experiment, *made()["E06"][:3])], None, None, False)


def rows_of(traces: xr.Dataset) -> list[int]:
    """Rows of each group on the page, by model and chamber."""
    n = traces["n_shown"].values
    return [
        2 if name in MODELS and MODELS[name].has_n and n[0, m] != n[1, m] else 1
        for m, name in enumerate(TRACED)
        for _ in "AB"
    ]


def unpacked_groups(
    shown: report.Part, name: str, traces: xr.Dataset, samples: int, rows: int = 1
) -> list[np.ndarray]:
    """Groups of a pack of errors in Pa, by model and chamber, each by (row, t); squares in Pa^2."""
    transport, _, kind = name.partition("-")
    groups = unpacked(shown.traces[name], [rows * count for count in rows_of(traces)], samples)
    steps = shown.facts["cells"][transport]["steps"]
    if kind == "squares":
        return [2.0 ** (group / report.PER_OCTAVE) for group in groups]
    return [
        np.where(group == MISSING, np.nan, group * step) for group, step in zip(groups, steps, strict=True)
    ]
