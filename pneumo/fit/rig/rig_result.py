"""Additions to the result of a rig's fit: a run as the models replay it, and unphysical estimates."""

from collections.abc import Mapping, Sequence

import numpy as np
import xarray as xr

from pneumo.fit.rig.rig_file import Ends, Rig, factor, key
from pneumo.fit.rig.rig_fit import fitted_runs, values_of
from pneumo.fit.rig.rig_record import Points, Run
from pneumo.fit.rig.rig_replay import replay_run

MOST_SAMPLES = 2000  # of a pressure that is shown
C_D = (0.7, 0.9)  # of an orifice


def physical_ends(rig: Rig) -> Mapping[str, Ends]:
    """Ends between which a quantity is physically possible, SI units; others have the user's ends only."""
    return {"n": (1.0, rig.gas.gamma), "C_d": C_D}


def unphysical(rig: Rig, result: xr.Dataset) -> dict[str, str]:
    """Sentences on estimates outside their `physical_ends`, by model; models without any are missing."""
    sentences = dict[str, str]()
    for model in map(str, result["model"].values):
        outside = [
            f"{key(name)} = {value / factor(name):.3g} is not from {low / factor(name):g} to"
            f" {high / factor(name):g}"
            for name, (low, high) in physical_ends(rig).items()
            if key(name) in result["parameter"]
            and np.isfinite(result["estimate"].sel(model=model, parameter=key(name)))
            and not low <= (value := values_of(result, rig, model)[name]) <= high
        ]
        if outside:
            sentences[model] = " and ".join(outside)
    return sentences


def _thinned(points: Points) -> Points:
    """Every k-th of some points, so that at most `MOST_SAMPLES` remain."""
    return points.part(np.arange(len(points.t)) % max(1, -(-len(points.t) // MOST_SAMPLES)) == 0)


def with_replays(result: xr.Dataset, rig: Rig, runs: Sequence[Run]) -> xr.Dataset:
    """The result of `judged_models` with the last run as it was measured and as the models replay it.

    Pressures: `measured_P`, Pa, by (chamber, t) and `replayed_P`, Pa, by (model, chamber, t). Temperatures,
    if measured: `measured_T`, K, by t_T and `replayed_T`, K, by (model, t_T). The attribute `fitted_until`,
    s, is the time until which the last run was fitted: 0 if there are several runs, since the last is then
    held out.
    """
    run, models = runs[-1], [str(name) for name in result["model"].values]
    measured = [_thinned(P) for P in run.pressures]
    replays = [replay_run(rig, model, values_of(result, rig, model), run) for model in models]
    t = measured[0].t
    P = [[np.interp(t, *pressure) for pressure in replayed.pressures] for replayed in replays]
    shown = xr.Dataset(
        {
            "measured_P": (("chamber", "t"), [np.interp(t, *points) for points in measured], {"units": "Pa"}),
            "replayed_P": (("model", "chamber", "t"), P, {"units": "Pa"}),
        },
        {"model": models, "chamber": ["A", "B"][: len(measured)], "t": ("t", t, {"units": "s"})},
    )
    if run.T is not None:
        T = [np.interp(run.T.t, *replayed.T) for replayed in replays]
        shown["measured_T"] = ("t_T", run.T.values, {"units": "K"})
        shown["replayed_T"] = (("model", "t_T"), T, {"units": "K"})
        shown.coords["t_T"] = ("t_T", run.T.t, {"units": "s"})
    until = 0.0 if len(runs) > 1 else float(fitted_runs(runs)[0].P.t[-1])
    return result.merge(shown).assign_attrs(fitted_until=until)
