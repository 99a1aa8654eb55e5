"""`fitted.yaml` of `pneumo fit`: a configuration of one cylinder with its fitted parameters."""

from collections.abc import Mapping, Sequence
from math import pi
from typing import Any

import numpy as np
import yaml

from pneumo.configuration.experiment import Plant
from pneumo.configuration.parameters import sonic_conductance
from pneumo.configuration.priors import SIGMAS, Uncertain, uncertainties
from pneumo.configuration.schema import Configuration, CylinderSection, ValveSection
from pneumo.configuration.valve_conversions import CONVERSIONS
from pneumo.errors import printable
from pneumo.fitting.fit_result import FitResult
from pneumo.fitting.on_signals import offset
from pneumo.fitting.record.measurement import Measurement
from pneumo.fitting.valve_signal import ROWS, bent, largest_command, valve_curve
from pneumo.physics.models import FULL_ORDER_WALLS
from pneumo.quantities.table import CURVE, FULL_ORDER, QUANTITIES, STARTS, of_group
from pneumo.statistics.intervals import Interval

DIGITS = 6  # of the numbers written
LONGEST_NAME = 40  # of a study
SUFFIX = "-fitted"
OF_SENSORS = ("offset_A", "offset_B", "offset_P_s", "skew", "filter")  # of the record, not of the rig
DEAD_VOLUMES = of_group("dead volume")
NOTED = tuple(name for name in QUANTITIES if name not in ("n", "T_A", "T_B", *STARTS))
EXPORTED = {"n": "n", "k_0": "k0"}  # a reduced model's own parameters, and the options that take them


def _text(interval: Interval) -> str:
    """Value and interval."""
    return f"{interval.value:.4g} ({interval.ends_text('.4g')})"


def _line(name: str, interval: Interval) -> str:
    """Parameter with value, interval and unit, as the tables show it."""
    quantity = QUANTITIES[name]
    return f"{quantity.heading} = {_text(interval.scaled(quantity.factor))} {quantity.shown_unit}".rstrip()


def _rounded(value: float) -> float:
    return float(f"{value:.{DIGITS}g}")


def fitted_configuration(
    configuration: Configuration,
    cylinder: str,
    plant: Plant,
    fit: FitResult,
    record: str,
    measured: Measurement,
) -> str:
    """Text of a configuration of one cylinder with the parameters of `fit.model_of_rig`.

    Parameters have the values of that model's replays, which are one solution: those that the fit held as
    configured stay so, or are left out if they belong to a lag, null or dead band of zero, and a comment says
    so. Keys are those that the user gave, and those of fitted parameters. Another comment has the options
    that export the best reduced model. Of experiments that differed only in k_0, the first of each loop and
    signal is kept.

    The fit began with `configuration` and, of the cylinder, `plant`; temperature and mean supply pressure
    are from the measurement, which is named `record`.
    """
    content = configuration.model_dump(exclude_unset=True)
    rig, notes = fit.model_of_rig, list[str]()
    estimates = fit.estimates(rig)
    held = [name for name in estimates if name in fit.held(rig)]
    section = content["cylinders"][cylinder]
    if np.isfinite(measured.T):
        content["supply"] |= {"T_amb_K": _rounded(measured.T), "T_in_K": _rounded(measured.T)}
        notes.append(f"T = {measured.T:.2f} K, measured")
    if measured.P_s is not None:
        values = {name: interval.value for name, interval in estimates.items()}
        off = offset(measured.zeros, values, "P_s")
        supply, varies = float(measured.P_s.mean()) - off, float(measured.P_s.std())
        content["supply"]["P_s_Pa"] = _rounded(supply)
        less = ", less its sensor's offset" if off else ""
        text = f"supply = {supply / 1e3:.4g} kPa, the mean of its record{less}"
        notes.append(f"{text}, which varies by {varies / 1e3:.2g} kPa: taken as constant")
    written = {name: estimates[name] for name in NOTED if name in estimates and name not in held}
    notes += _notes(section, written, plant, fit)
    # No valve acts before its command: less than a sample is the clock's.
    dead_time = written.get("dead_time")
    early = ["dead_time"] if dead_time and -measured.period < dead_time.value < 0 else []
    _put_values(content, section, written, plant, (*held, *early))
    _put_valves(section, configuration.cylinders[cylinder], written, plant)
    if written.keys() & {*CURVE, "linearity"}:
        fitted = {name: written[name].value for name in written}
        for key in section.keys() & {"valve", "valve_B"}:
            section[key] = _with_curve(section[key], fitted, fit, plant)
    if rig == FULL_ORDER:
        section["wall_law"] = next(name for name, wall in FULL_ORDER_WALLS.items() if wall == fit.wall)
    section["fitted"] = _fitted_section(fit, estimates, uncertainties(configuration)[cylinder], plant)
    zero = [_line(name, estimates[name]) for name in held if estimates[name].value == 0]
    kept = [_line(name, estimates[name]) for name in held if estimates[name].value != 0]
    if kept:
        notes.append(f"not determined by the record, so as configured: {', '.join(kept)}")
    if zero:
        notes.append(f"may be zero, and taken so: {', '.join(zero)}")
    # The wall keeps the pressure at which it has its k_0, which half-bridge would change with the supply.
    P_s = content["supply"]["P_s_Pa"]
    P_0_per_P_s = plant.conditions.P_0 / (plant.conditions.P_s if isinstance(P_s, str) else P_s)
    if P_0_per_P_s < 1:
        content["supply"]["P_0_per_P_s"] = P_0_per_P_s
    content["cylinders"] = {cylinder: section}
    content["experiments"] = _experiments(content, configuration, cylinder, written.get("k_0"))
    content["run"] = content.get("run", {}) | {"experiments": list(content["experiments"])}
    content.pop("levels", None)
    content["name"] = content["name"][: LONGEST_NAME - len(SUFFIX)] + SUFFIX
    heading = [
        f"Cylinder {cylinder} as fitted to {printable(record)} by {rig}, which is off by"
        f" {fit.error(rig) / 1e3:.3g} kPa rms on the part held out.",
        *(f"WARNING: {text}" for text in fit.warnings),
        "As replayed, with 95 % intervals over all laws of the wall:",
        *(f"  {note}" for note in notes),
        *([] if fit.closed or fit.best_model == FULL_ORDER else _best_model_lines(fit)),
    ]
    body = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
    return "".join(f"# {line}\n" for line in heading) + body


def _best_model_lines(fit: FitResult) -> list[str]:
    """Lines on the best reduced model, with the options that export it."""
    best = fit.best_model
    exported = {name: interval for name, interval in fit.estimates(best).items() if name in EXPORTED}
    values = [f"{name} = {_text(interval)}" for name, interval in exported.items()]
    options = [f"--{EXPORTED[name]} {_rounded(interval.value)}" for name, interval in exported.items()]
    line = f"Best reduced model: {best}, off by {fit.error(best) / 1e3:.3g} kPa rms"
    lines = [f"{line}, with its own {', '.join(values)}" if values else line]
    if values and not fit.on_bound(best):
        lines.append(f"  for export and linearise: {best} {' '.join(options)}")
    return lines


def _notes(
    section: Mapping[str, Any], written: Mapping[str, Interval], plant: Plant, fit: FitResult
) -> list[str]:
    """Notes on the values written, and on those that the cylinder's `section` has no key for."""
    lines = {name: _line(name, interval) for name, interval in written.items()}
    lines |= {name: f"{lines[name]}, of the record's sensor" for name in OF_SENSORS if name in lines}
    if "k_xu" in written and "curve" in section.get("valve", {}):
        times = written["k_xu"].scaled(1 / plant.valve.k_xu)
        lines["k_xu"] = f"conductances of the curve times {_text(times)}"
    elif "k_xu" in written and "valve" in section:
        end = fit.reached if written.keys() >= {*CURVE} else plant.valve.u_max
        C = sonic_conductance(plant.valve, plant.gas) / plant.valve.k_xu * end / plant.valve.u_max
        lines["k_xu"] = f"C = {_text(written['k_xu'].scaled(C))} dm3/(s bar) at {end:.4g} V"
    without = [name for name in written if name not in OF_SENSORS and not _has_key(name, section)]
    headings = ", ".join(QUANTITIES[name].heading for name in without)
    return [*lines.values(), *([f"  this configuration has no key for {headings}"] if without else [])]


def _has_key(name: str, section: Mapping[str, Any]) -> bool:
    """Whether a cylinder's `section` can have the value of a quantity."""
    path = QUANTITIES[name].key.rpartition(".")[0]
    if path == "cylinders.valve_B":
        return "valve_B" in section or ("valve" in section and "curve" not in section["valve"])
    return bool(path) and (path != "cylinders.valve" or "valve" in section)


def _put_values(
    content: dict[str, Any],
    section: dict[str, Any],
    written: Mapping[str, Interval],
    plant: Plant,
    dropped: Sequence[str],
) -> None:
    """Put values under the keys of their rows, except k_0 and those of a valve with a section of its own.

    Of the dynamics of the valve, those `dropped` are left out.
    """
    dynamics = section.pop("valve_dynamics", {})
    sections = {"supply": content["supply"], "cylinders": section, "cylinders.valve_dynamics": dynamics}
    keys = {name: QUANTITIES[name].key.rpartition(".")[::2] for name in (*written, *dropped, *DEAD_VOLUMES)}
    if written.keys() & {*DEAD_VOLUMES}:  # else one key could change both chambers
        section |= {keys[name][1]: getattr(plant.cylinder, name) for name in DEAD_VOLUMES}
    for name in dropped:
        if QUANTITIES[name].start == 0:
            sections.get(keys[name][0], {}).pop(keys[name][1], None)
    values = {name: interval.value for name, interval in written.items() if name not in dropped}
    if "A_B" in values:
        values["A_B"] = 1e3 * max(plant.cylinder.bore**2 - 4 * values["A_B"] / pi, 0.0) ** 0.5  # of the rod
    for name, value in values.items():
        path, key = keys[name]
        if path in sections and not (name == "k_xu" and "valve" in section):
            sections[path][key] = _rounded(value)
    if dynamics:
        section["valve_dynamics"] = dynamics


def _put_valves(
    section: dict[str, Any], before: CylinderSection, written: dict[str, Interval], plant: Plant
) -> None:
    """Put fitted flows and b into the valves; those of both chambers change by the same factors.

    A fitted side of B beside that makes a valve of its own of it.
    """
    fitted = {name: interval.value for name, interval in written.items()}
    flow = fitted.get("k_xu", plant.valve.k_xu) / plant.valve.k_xu
    exhaust = fitted.get("exhaust", plant.valve.exhaust) / plant.valve.exhaust
    if "C_B" in fitted and "valve_B" not in section and "curve" not in section.get("valve", {"curve": None}):
        given = ValveSection.model_validate(section["valve"])  # without uncertainties, which are of both
        keys = ((key, getattr(given, key)) for key in section["valve"])
        section["valve_B"] = {key: value for key, value in keys if value is not None}
    for key in section.keys() & {"valve", "valve_B"}:
        changed, curve = section[key], section[key].get("curve")
        valve: Any = getattr(before, key) or before.valve  # the key's own, or the one of both chambers
        times = flow * (fitted.get("C_B", 1.0) if key == "valve_B" else 1.0)
        if curve:
            for column in curve.keys() - {"u_V"}:
                factor = times * exhaust if column.startswith("exhaust") else times
                curve[column] = [_rounded(factor * C) for C in curve[column]]
        elif fitted.keys() & {"k_xu", "b", "C_B"}:
            rest = {name: value for name, value in changed.items() if name not in CONVERSIONS}
            changed = section[key] = {"C_dm3_per_sbar": _rounded(times * valve.largest_C)} | rest
        if "exhaust" in fitted and "exhaust_C_dm3_per_sbar" not in (curve or {}):
            changed["exhaust_ratio"] = _rounded(exhaust * valve.exhaust_ratio)
        if "b" in fitted:
            for name in {"b"} | ({"exhaust_b"} & changed.keys()):
                changed[name] = _rounded(fitted["b"])
    for key, C in before.throttles.items():  # a fit scales a path to the exhaust as a whole
        section[key] = _rounded(flow * exhaust * C)


def _with_curve(
    valve: dict[str, Any], fitted: dict[str, float], fit: FitResult, plant: Plant
) -> dict[str, Any]:
    """Section of a valve with a fitted curve or linearity in place of C, up to u_max.

    Its rows are those between which the fit of a curve has straight lines.
    """
    largest, u_max = largest_command(fit.fitted_commands, plant), plant.valve.u_max
    parts = np.array([*ROWS, *([u_max / largest] * (largest < u_max))])
    opening = bent(parts, fitted["linearity"]) if "linearity" in fitted else valve_curve(fitted, parts)
    C = valve["C_dm3_per_sbar"] * largest / u_max * opening
    rest = {key: value for key, value in valve.items() if key not in ("C_dm3_per_sbar", "linearity_percent")}
    columns = {"u_V": largest * parts, "C_dm3_per_sbar": C}
    return rest | {"curve": {key: [_rounded(x) for x in column] for key, column in columns.items()}}


def _fitted_section(
    fit: FitResult, estimates: dict[str, Interval], before: Uncertain, plant: Plant
) -> dict[str, Any]:
    """Joint covariance of the fitted quantities, and each model's error on the part held out, for a study.

    Errors of the sensor of x move the dead volumes, but hardly change a replay on another record from this
    sensor: the covariance is without them. An interval without ends, or of a parameter held as configured
    and not as zero, says nothing: that one is as uncertain as `before`.
    """
    rig = fit.model_of_rig
    deviations = dict[str, float]()
    unknown = set[str]()
    for name, (value, low, high) in estimates.items():
        known_as = QUANTITIES[name].study_name
        if not known_as:
            continue
        ends = np.array([low, high])
        if np.isnan(ends).all() or (name in fit.held(rig) and QUANTITIES[name].start != 0):
            if known_as in before.names:
                deviations[name] = before.half_width(known_as) / SIGMAS
                unknown.add(name)
            continue
        away = np.log(ends / value) if QUANTITIES[name].logarithmic else ends - value
        deviations[name] = np.nanmax(np.abs(away)) / SIGMAS  # draws are symmetric, and cover both ends
    names = list(deviations)
    covariance = np.diag(np.square(list(deviations.values())))
    if "covariance" in fit.data:
        joint = fit.correlation(rig, "covariance")
        known = [name for name in names if name in joint.index and name not in unknown]
        at = [names.index(name) for name in known]
        covariance[np.ix_(at, at)] = joint.loc[known, known]
    # One that is not zero is in the curve, and a study has none to draw.
    if {"k_xu", "linearity"} <= {*names} - unknown and "linearity" in fit.held(rig):
        change = _to_whole_range(names, fit.reached / plant.valve.u_max)
        covariance = change @ covariance @ change.T
    errors = {"full order" if model == FULL_ORDER else model: fit.error(model) / 1e3 for model in fit.models}
    return {
        "quantities": [QUANTITIES[name].study_name for name in names],
        "covariance": [[float(f"{value:.12g}") for value in row] for row in covariance.tolist()],
        "error_kPa": {model: _rounded(error) for model, error in errors.items()},
    }


def _to_whole_range(names: Sequence[str], reached: float) -> np.ndarray:
    """Change of deviations to those of C and linearity up to u_max, of which a record `reached` a part.

    Openings up to there remain the same, to first order.
    """
    C, linearity = names.index("k_xu"), names.index("linearity")
    change = np.eye(len(names))
    change[linearity, linearity] = 1 / reached
    change[C, linearity] = 4 * (1 - 1 / reached)
    return change


def _experiments(
    content: dict[str, Any], configuration: Configuration, cylinder: str, k_0: Interval | None
) -> dict[str, Any]:
    """Experiments that are to run with the cylinder, by name, with the fitted k_0 if there is one.

    With a k_0, experiments of one loop and signal that differed by k_0 alone become one.
    """
    runs = configuration.run.experiments
    kept: dict[tuple[Any, ...], tuple[str, Any]] = {}
    for name, experiment in content["experiments"].items():
        if experiment["cylinder"] != cylinder or (runs != "all" and name not in runs):
            continue
        kind = experiment["loop"], experiment.get("signal"), name if k_0 is None else ""
        if k_0 is not None:
            experiment.pop("lambda_0_W_per_m2K", None)
            experiment["k_0_W_per_K"] = _rounded(k_0.value)
        kept.setdefault(kind, (name, experiment))
    return dict(kept.values())
