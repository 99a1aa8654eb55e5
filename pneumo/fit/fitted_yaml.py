"""`fitted.yaml` of `pneumo fit`: a configuration whose cylinder has what the full order found."""

from typing import Any

import numpy as np
import xarray as xr
import yaml

from pneumo.configuration.experiment import Plant
from pneumo.configuration.schema import Configuration
from pneumo.errors import printable
from pneumo.fit.fitted_parameters import CAUSES, FULL
from pneumo.physics.cylinder import Cylinder
from pneumo.statistics.intervals import Interval

DIGITS = 6  # of the numbers written
LONGEST_NAME = 40  # of a study
SUFFIX = "-fitted"
CLOSED = "closed_chambers"  # attribute of a fit of thermal laws, which has no reduced model
KEPT = ("k_0", "k_xu", "V_d_A", "V_d_B")  # what a configuration has keys for
EXPORTED = {"n": "n", "k_0": "k0"}  # a reduced model's own parameters, and the options that take them


def _text(one: Interval) -> str:
    """Value and interval."""
    ends = ("open" if np.isnan(end) else f"{end:.4g}" for end in (one.low, one.high))
    return f"{one.value:.4g} ({' to '.join(ends)})"


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def best_model(fit: xr.Dataset) -> str:
    """Name of the first reduced model: the one to replay or export."""
    return next(str(name) for name in fit["model"].values if name != FULL.name)


def row_of_the_rig(fit: xr.Dataset) -> str:
    """Name of the row for the configuration: the full order's, or without its intervals the best model's.

    Of closed chambers it is the best thermal law with a k_0.
    The parameters of a reduced model also make up for what that model lacks.
    """
    if CLOSED in fit.attrs:  # the best law with a k_0
        known = [name for name in map(str, fit["model"].values) if "k_0" in estimates(fit, name)]
        return (known or [best_model(fit)])[0]
    if FULL.name not in fit["model"].values:
        return best_model(fit)
    ends = fit[["low", "high"]].sel(model=FULL.name).to_array()
    return FULL.name if np.isfinite(ends).any() else best_model(fit)


def estimates(fit: xr.Dataset, model: str) -> dict[str, Interval]:
    """What a model of a fit found, by parameter, in SI units."""
    row = fit.sel(model=model)
    columns = (row[name].values.tolist() for name in ("estimate", "low", "high"))
    found = dict(zip(fit["parameter"].values.tolist(), map(Interval, *columns), strict=True))
    return {name: one for name, one in found.items() if np.isfinite(one.value)}


def _error(fit: xr.Dataset, model: str) -> str:
    """Error of a model on the part held out."""
    return f"{np.sqrt(np.nanmean(fit['rms_held_out'].sel(model=model).values ** 2)) / 1e3:.3g} kPa rms"


def fitted_configuration(
    configuration: Configuration, cylinder: str, plant: Plant, fit: xr.Dataset, record: str, T: float
) -> str:
    """Return the text of a configuration of one cylinder as `row_of_the_rig` of a fit has it.

    The keys are those that the user gave. What has an open interval stays as configured, and a comment says
    so. Another has what the best reduced model needs for an export. Of experiments that differed in k_0 the
    first of each loop and signal stays.

    Parameters
    ----------
    configuration, plant
        What the fit was made with, and the cylinder's plant there.
    fit : xarray.Dataset
        From `fit_measurement`, the best model first.
    record : str
        Name of the measurement.
    T : float
        Measured temperature of the surroundings, K; NaN where it was not measured.
    """
    content = configuration.model_dump(exclude_unset=True)
    rig, best = row_of_the_rig(fit), best_model(fit)
    found, of_best, notes = estimates(fit, rig), estimates(fit, best), list[str]()
    section = content["cylinders"][cylinder]
    if np.isfinite(T):
        content["supply"] |= {"T_amb_K": _rounded(T), "T_in_K": _rounded(T)}
        notes.append(f"T = {T:.2f} K, measured")
    known = {name: one for name, one in found.items() if one.known}
    if "k_0" in known:
        notes.append(f"k_0 = {_text(known['k_0'])} W/K")
        sides = [f"of {c} = {_text(known[f'k_0_{c}'])}" for c in "AB" if f"k_0_{c}" in known]
        notes += [f"  {', '.join(sides)}, and one key has both"] if sides else []
    if "k_xu" in known:
        notes.append(_put_valve(section, known["k_xu"], plant.valve.k_xu))
    if "leak" in known:
        notes.append(f"leakage past the piston, for which there is no key: {_text(known['leak'])} kg/(s Pa)")
    notes += _put_causes(content, section, known)
    notes += _put_dead_volumes(section, known, plant.cylinder)
    open_ends = [f"{name} = {_text(one)}" for name, one in found.items() if name in KEPT and not one.known]
    if open_ends:
        notes.append(f"not determined by the record, so as configured (SI units): {', '.join(open_ends)}")
    content["cylinders"] = {cylinder: section}
    content["experiments"] = _experiments(content, configuration, cylinder, known.get("k_0"))
    content["run"] = content.get("run", {}) | {"experiments": list(content["experiments"])}
    content.pop("levels", None)
    content["name"] = content["name"][: LONGEST_NAME - len(SUFFIX)] + SUFFIX
    options = [f"--{key} {_rounded(of_best[n].value)}" for n, key in EXPORTED.items() if n in of_best]
    own = [f"{n} = {_text(of_best[n])}" for n in EXPORTED if n in of_best]
    heading = [
        f"Cylinder {cylinder} as fitted to {printable(record)} by {rig}, which is off by {_error(fit, rig)}"
        " on the part held out.",
        *(f"WARNING: {text}" for text in str(fit.attrs.get("warnings", "")).split("\n") if text),
        "Found, with 95 % intervals:",
        *(f"  {note}" for note in notes),
    ]
    if CLOSED not in fit.attrs:
        heading.append(
            f"Best reduced model: {best}, off by {_error(fit, best)}{', with its own ' if own else ''}"
            + ", ".join(own)
        )
    if options and CLOSED not in fit.attrs:
        heading.append(f"  for export and linearise: {best} {' '.join(options)}")
    body = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
    return "".join(f"# {line}\n" for line in heading) + body


def _put_valve(section: dict[str, Any], k_xu: Interval, configured: float) -> str:
    """Put the valve's coefficient into the key that was given, and say what it is."""
    if "valve" in section:
        C = k_xu.scaled(section["valve"]["C_dm3_per_sbar"] / configured)
        section["valve"]["C_dm3_per_sbar"] = _rounded(C.value)
        return f"C = {_text(C)} dm3/(s bar) at u_max_V"
    section["k_x_k_u_m2_per_V"] = _rounded(k_xu.value)
    return f"k_x k_u = {_text(k_xu)} m2/V"


def _put_dead_volumes(section: dict[str, Any], known: dict[str, Interval], configured: Cylinder) -> list[str]:
    """Put each chamber's dead volume into its key, if one was found, and say what they are."""
    if not {"V_d_A", "V_d_B"} & set(known):
        return []
    notes = list[str]()
    for side, key in (("A", "dead_volume_m3"), ("B", "dead_volume_B_m3")):
        one = known.get(f"V_d_{side}")
        section[key] = _rounded(one.value) if one else getattr(configured, f"V_d_{side}")
        notes += [f"V_d of {side} = {_text(one.scaled(1e6))} cm3"] if one else []
    return notes


def _put_causes(content: dict[str, Any], section: dict[str, Any], known: dict[str, Interval]) -> list[str]:
    """Put what was fitted too into the keys that there are for it, and say what it is."""
    if "P_s" in known:
        content["supply"]["P_s_Pa"] = _rounded(known["P_s"].value)
    if "exhaust" in known and "valve" in section:
        section["valve"]["exhaust_ratio"] = _rounded(known["exhaust"].value)
    notes = [f"{name} = {_text(known[name])} (SI units)" for name in CAUSES if name in known]
    without = [name for name in ("A_B", "offset_A", "offset_B") if name in known]
    return notes + ([f"  no key has {', '.join(without)}"] if without else [])


def _experiments(
    content: dict[str, Any], configuration: Configuration, cylinder: str, k_0: Interval | None
) -> dict[str, Any]:
    """Entries of the experiments on the cylinder that are to run, by name, with the k_0 that was found.

    With a k_0, experiments of one loop and signal that differed by k_0 alone become one.
    """
    runs = configuration.run.experiments
    kept: dict[str, Any] = {}
    seen: list[tuple[Any, Any]] = []
    for name, experiment in content["experiments"].items():
        if experiment["cylinder"] != cylinder or (runs != "all" and name not in runs):
            continue
        if k_0 is not None:
            experiment.pop("lambda_0_W_per_m2K", None)
            experiment["k_0_W_per_K"] = _rounded(k_0.value)
        kind = experiment["loop"], experiment.get("signal")
        if kind not in seen or k_0 is None:
            kept[name] = experiment
            seen.append(kind)
    return kept
