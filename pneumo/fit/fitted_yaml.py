"""`fitted.yaml` of `pneumo fit`: a configuration whose cylinder has what the full order found."""

from typing import Any

import numpy as np
import yaml

from pneumo.configuration.experiment import Plant
from pneumo.configuration.schema import Configuration
from pneumo.errors import printable
from pneumo.fit.fit_result import ClosedChambersResult, FitResult, rms_of_chambers
from pneumo.fit.fitted_parameters import CAUSES, PARAMETERS, of_group
from pneumo.physics.cylinder import Cylinder
from pneumo.statistics.intervals import Interval

DIGITS = 6  # of the numbers written
LONGEST_NAME = 40  # of a study
SUFFIX = "-fitted"
CONFIGURED = tuple(name for name, row in PARAMETERS.items() if row.key and name not in CAUSES)
EXPORTED = {"n": "n", "k_0": "k0"}  # a reduced model's own parameters, and the options that take them


def _text(interval: Interval) -> str:
    """Value and interval."""
    return f"{interval.value:.4g} ({interval.ends_text('.4g')})"


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def fitted_configuration(
    configuration: Configuration, cylinder: str, plant: Plant, fit: FitResult, record: str, T: float
) -> str:
    """Text of a configuration of one cylinder with the parameters of `fit.model_of_rig`.

    The keys are those that the user gave. A parameter with an open interval stays as configured, and a
    comment says so. Another comment has what the best reduced model needs for an export. Of experiments that
    differed in k_0 the first of each loop and signal stays.

    Parameters
    ----------
    configuration, plant
        Configuration that the fit began with, and the cylinder's plant there.
    record : str
        Name of the measurement.
    T : float
        Measured temperature of the surroundings, K; NaN where it was not measured.
    """
    content = configuration.model_dump(exclude_unset=True)
    rig, notes = fit.model_of_rig, list[str]()
    estimates = fit.estimates(rig)
    section = content["cylinders"][cylinder]
    if np.isfinite(T):
        content["supply"] |= {"T_amb_K": _rounded(T), "T_in_K": _rounded(T)}
        notes.append(f"T = {T:.2f} K, measured")
    known = {name: interval for name, interval in estimates.items() if interval.known}
    if "k_0" in known:
        notes.append(f"k_0 = {_text(known['k_0'])} W/K")
        sides = [f"of {c} = {_text(known[f'k_0_{c}'])}" for c in "AB" if f"k_0_{c}" in known]
        notes += [f"  {', '.join(sides)}; the configuration has one key for both"] if sides else []
    if "k_xu" in known:
        notes.append(_put_valve(section, known["k_xu"], plant.valve.k_xu))
    if "leak" in known:
        notes.append(f"leakage past the piston, for which there is no key: {_text(known['leak'])} kg/(s Pa)")
    notes += _put_causes(content, section, known)
    notes += _put_dead_volumes(section, known, plant.cylinder)
    unknown = [f"{name} = {_text(estimates[name])}" for name in CONFIGURED if name in {*estimates} - {*known}]
    if unknown:
        notes.append(f"not determined by the record, so as configured (SI units): {', '.join(unknown)}")
    content["cylinders"] = {cylinder: section}
    content["experiments"] = _experiments(content, configuration, cylinder, known.get("k_0"))
    content["run"] = content.get("run", {}) | {"experiments": list(content["experiments"])}
    content.pop("levels", None)
    content["name"] = content["name"][: LONGEST_NAME - len(SUFFIX)] + SUFFIX
    heading = [
        f"Cylinder {cylinder} as fitted to {printable(record)} by {rig}, which is off by"
        f" {_held_out_error(fit, rig)} on the part held out.",
        *(f"WARNING: {text}" for text in fit.warnings),
        "Found, with 95 % intervals:",
        *(f"  {note}" for note in notes),
        *([] if isinstance(fit, ClosedChambersResult) else _best_model_lines(fit)),
    ]
    body = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
    return "".join(f"# {line}\n" for line in heading) + body


def _held_out_error(fit: FitResult, model: str) -> str:
    return f"{rms_of_chambers(fit.data['rms_held_out'].sel(model=model).values) / 1e3:.3g} kPa rms"


def _best_model_lines(fit: FitResult) -> list[str]:
    """Lines on the best reduced model, with the options that export it."""
    best = fit.best_model
    exported = {name: interval for name, interval in fit.estimates(best).items() if name in EXPORTED}
    values = ", ".join(f"{name} = {_text(interval)}" for name, interval in exported.items())
    options = [f"--{EXPORTED[name]} {_rounded(interval.value)}" for name, interval in exported.items()]
    line = f"Best reduced model: {best}, off by {_held_out_error(fit, best)}"
    if not exported:
        return [line]
    return [f"{line}, with its own {values}", f"  for export and linearise: {best} {' '.join(options)}"]


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
    notes, names = list[str](), of_group("dead volume")
    for name in names if {*names} & {*known} else ():
        key = PARAMETERS[name].key.removeprefix("cylinders.")
        section[key] = _rounded(known[name].value) if name in known else getattr(configured, name)
        heading = PARAMETERS[name].quantity.heading
        notes += [f"{heading} = {_text(known[name].scaled(1e6))} cm3"] if name in known else []
    return notes


def _put_causes(content: dict[str, Any], section: dict[str, Any], known: dict[str, Interval]) -> list[str]:
    """Put the causes that were fitted into their keys, and say what they are."""
    causes = [name for name in CAUSES if name in known]
    notes, without = [f"{name} = {_text(known[name])} (SI units)" for name in causes], list[str]()
    sections = {"supply": content["supply"], "cylinders": section, "cylinders.valve": section.get("valve")}
    for name in causes:
        path, _, key = PARAMETERS[name].key.rpartition(".")
        if (target := sections.get(path)) is None:
            without.append(name)
        else:
            target[key] = _rounded(known[name].value)
    return notes + ([f"  this configuration has no key for {', '.join(without)}"] if without else [])


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
