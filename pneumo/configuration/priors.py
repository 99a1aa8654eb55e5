"""How well each quantity of a cylinder is known, and the joint distribution of their deviations.

Limits are half-widths of 95 % intervals: those of the configuration, else those of a fit, else those of the
table of quantities for what nobody stated. Deviations are normal; of a factor, such as a conductance, its
logarithm is.
"""

from collections.abc import Collection, Mapping
from math import exp, expm1, log, log1p
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np

from pneumo.catalogue import conductance_factor
from pneumo.configuration.experiment import Plant
from pneumo.configuration.schema import Configuration, CylinderSection, ExperimentSection
from pneumo.configuration.valve_conversions import CONVERSIONS, USUAL_B, conductance
from pneumo.quantities.applied import LEAST_B, MOST_B, value_in, with_values
from pneumo.quantities.table import GROUPS, QUANTITIES, STUDIED

SIGMAS = 1.96  # half-width of a 95 % interval over the standard deviation
K_0_FACTOR = 2.0  # of a given k_0: estimates of the same wall differ as much
CATALOGUE_FLOW = 0.10  # of C or k_x_k_u without a stated uncertainty
B_UNKNOWN = 0.15  # b from 0.15 to 0.45
DEAD_VOLUME_UNKNOWN = log(2.5)  # as assumed where it is left out
ZERO_UNSEEN = 5e-3  # m, of the zero of x where neither stops nor dead volumes show it
SI = {"mm": 1e-3, "percent": 1e-2, "kPa": 1e3}  # factors by the end of a key; others are in SI units
Accuracy = Mapping[str, float]  # half-width of the 95 % interval by quantity, relative where the table's is


def group_of(name: str) -> str:
    """Group of a quantity of studies."""
    return QUANTITIES[STUDIED[name]].study_group


def accuracy(
    configuration: Configuration | None = None,
    position_shown: bool = True,
    cylinder: str | None = None,
    unmeasured: Collection[str] = (),
) -> Accuracy:
    """Accuracy of a cylinder's rig, SI units, as configured or as the table of quantities has it.

    `position_shown` says whether a record or configured dead volumes would reveal a wrong zero of x.
    `cylinder` may be left out if there is only one. Of the `unmeasured` quantities, those that are
    `defaults_taken` have the accuracy of a default.
    """
    known = {name: quantity.accuracy for name, quantity in QUANTITIES.items() if quantity.accuracy}
    if not position_shown:
        known["x_zero"] = ZERO_UNSEEN
    if configuration is None:
        return known
    cylinder = cylinder or next(iter(configuration.cylinders))
    for name in known:
        given = [_stated(configuration, cylinder, key, name) for key in QUANTITIES[name].stated]
        known[name] = next((half for half in given if half is not None), known[name])
    taken = defaults_taken(configuration, unmeasured)
    return known | {name: QUANTITIES[name].undetermined for name in taken}


def defaults_taken(configuration: Configuration, names: Collection[str]) -> list[str]:
    """Those of some quantities of the supply whose value is a default without a stated uncertainty."""
    supply = configuration.supply
    keys = {name: QUANTITIES[name].stated[0].rpartition(".")[2] for name in names}
    return [
        name
        for name, key in keys.items()
        if getattr(supply, key) == QUANTITIES[name].default and supply.uncertainty(key) is None
    ]


def default_notes(configuration: Configuration, names: Collection[str]) -> list[str]:
    """Note on those of some quantities that are `defaults_taken`, and how to state them."""
    taken = [(QUANTITIES[name], name) for name in defaults_taken(configuration, names)]
    limits = [
        f"{name} = {q.factor * q.default:g} {q.shown_unit} ± {100 * q.undetermined:g} %"
        if q.relative
        else f"{name} = {q.default:g} ± {q.undetermined:g} {q.shown_unit}"
        for q, name in taken
    ]
    keys = ", ".join(q.stated[0] for q, _ in taken)
    text = f"not measured, so taken as a default: {', '.join(limits)}; state {keys} with ±"
    return [text] if taken else []


def _stated(configuration: Configuration, cylinder: str, path: str, name: str) -> float | None:
    """Accuracy of a quantity that a key states: of the section sensors its number, else its uncertainty."""
    first, *rest, key = path.split(".")
    section: Any = getattr(configuration, first)
    section = section[cylinder] if first == "cylinders" else section
    for part in rest:
        section = section and getattr(section, part)
    if section is None:
        return None
    itself = first == "sensors" or key.endswith("percent")  # the key's number is the accuracy
    relative = QUANTITIES[name].relative and not itself
    half = getattr(section, key) if itself else section.uncertainty(key, relative=relative)
    return half if half is None or relative else half * SI.get(key.rpartition("_")[2], 1.0)


class Uncertain(NamedTuple):
    """Joint normal distribution of the deviations of a cylinder's quantities."""

    names: tuple[str, ...]  #: of `STUDIED`
    covariance: tuple[tuple[float, ...], ...]
    measured: Mapping[str, float] = MappingProxyType({})  #: by model, RMS error on data held out of a fit, Pa
    accuracy: Accuracy = MappingProxyType({})  #: of what a fit takes as configured
    flow: str = ""  #: how to state the valve's flow with its accuracy; empty if that is known already

    @property
    def groups(self) -> tuple[str, ...]:
        """Groups of the quantities, in the order of `GROUPS`."""
        return tuple(group for group in GROUPS if any(group_of(name) == group for name in self.names))

    def half_width(self, name: str) -> float:
        """Half-width of a quantity's 95 % interval; of its logarithm for a factor."""
        place = self.names.index(name)
        return SIGMAS * self.covariance[place][place] ** 0.5

    def alone(self, group: str, deviations: np.ndarray) -> np.ndarray:
        """Deviations, shape (draw, quantity), if only the quantities of a group deviate.

        The others move with them as far as they are correlated. The rest, which would remain if the group
        were known, is independent of it (Matheron's rule).
        """
        inside = np.array([group_of(name) == group for name in self.names])
        covariance = np.array(self.covariance)
        gain = np.linalg.pinv(covariance[np.ix_(inside, inside)]) @ covariance[inside]
        return deviations[:, inside] @ gain

    def text(self, name: str) -> str:
        """Quantity with its limit, such as "C ± 10 %"."""
        half, name_shown = self.half_width(name), name.replace("V_d_", "V_d of ")
        quantity = QUANTITIES[STUDIED[name]]
        if not quantity.logarithmic:
            return f"{name_shown} ± {quantity.factor * half:.2g} {quantity.shown_unit}".rstrip()
        limit = f"± {100 * expm1(half):.2g} %" if half < 0.3 else f"× or ÷ {exp(half):.2g}"
        return f"{name_shown} {limit}"


def plant_with(plant: Plant, names: tuple[str, ...], deviations: np.ndarray) -> Plant:
    """Plant whose quantities deviate, each by the entry of `deviations` at its place in `names`."""
    values = dict[str, float]()
    for name, deviation in zip(map(STUDIED.__getitem__, names), deviations.tolist(), strict=True):
        value = value_in(plant, name) if QUANTITIES[name].field else 0.0
        values[name] = value * exp(deviation) if QUANTITIES[name].logarithmic else value + deviation
    if "b" in values:
        values["b"] = min(max(values["b"], LEAST_B), MOST_B)
    plant = with_values(plant, values)
    if "linearity" in values:
        # Below -0.25 the openings of small commands would be negative.
        plant = plant._replace(valve=plant.valve.with_linearity(max(values["linearity"], -0.25)))
    c = plant.conditions
    return plant._replace(conditions=c._replace(P_s=max(c.P_s, 1.05 * c.P_atm)))


def uncertainties(configuration: Configuration) -> dict[str, Uncertain]:
    """How well each cylinder of a configuration is known, by its name.

    A cylinder with the section `fitted` has the joint distribution of that fit; quantities that the fit did
    not estimate have their limits.
    """
    return {name: _uncertain(configuration, name) for name in configuration.cylinders}


def _uncertain(configuration: Configuration, cylinder: str) -> Uncertain:
    section, limits = configuration.cylinders[cylinder], _limits(configuration, cylinder)
    names = tuple(limits)
    covariance = np.diag([(limit / SIGMAS) ** 2 for limit in limits.values()])
    if "b" in names and (slope := _slope_of_flow(section)):  # a nominal flow: C follows from it with b
        C, b = names.index("C"), names.index("b")
        covariance[C, b] = covariance[b, C] = slope * covariance[b, b]
        covariance[C, C] += slope**2 * covariance[b, b]
    measured: dict[str, float] = {}
    fitted: list[str] = []
    if section.fitted:
        measured = {name: 1e3 * error for name, error in section.fitted.error_kPa.items()}
        fitted = [name for name in section.fitted.quantities if name in names]
        of_fit = [[*map(str, section.fitted.quantities)].index(name) for name in fitted]
        place = [names.index(name) for name in fitted]
        covariance[place] = covariance[:, place] = 0.0
        of_all = np.array(section.fitted.covariance).reshape((len(section.fitted.quantities),) * 2)
        covariance[np.ix_(place, place)] = of_all[np.ix_(of_fit, of_fit)]
    rows = tuple(tuple(row) for row in covariance.tolist())
    flow = ""
    if section.valve and not section.valve.curve and "C" not in fitted:
        key, value = section.valve.flow_as_given
        if section.valve.uncertainty(key) is None:
            flow = f"{key}: {value:g} ± 3 %"
    return Uncertain(names, rows, measured, accuracy(configuration, cylinder=cylinder), flow)


def _limits(configuration: Configuration, cylinder: str) -> dict[str, float]:
    """Half-width of the 95 % interval of each quantity; of its logarithm for a factor."""
    section, known = configuration.cylinders[cylinder], accuracy(configuration, cylinder=cylinder)
    valve = section.valve
    where, key = (valve, valve.flow_as_given[0]) if valve else (section, "k_x_k_u_m2_per_V")
    flow, rule = where.uncertainty(key, relative=True), CONVERSIONS[key].within if valve else 0.0
    limits = {"C": log1p((CATALOGUE_FLOW**2 + rule**2) ** 0.5 if flow is None else flow)}
    if valve:
        limits["b"] = B_UNKNOWN if valve.b is None else known["b"]
        limits["linearity"] = 0.0 if valve.curve else known["linearity"]
    limits |= {name: log1p(known[name]) for name in ("exhaust", "V_d_A", "V_d_B")}
    if section.dead_volume_m3 is None:
        limits["V_d_A"] = DEAD_VOLUME_UNKNOWN
    if section.dead_volume_m3 is None and section.dead_volume_B_m3 is None:
        limits["V_d_B"] = DEAD_VOLUME_UNKNOWN
    walls = [e for e in configuration.experiments.values() if e.cylinder == cylinder]
    limits["k_0"] = max((_wall_limit(e, section) for e in walls), default=log(K_0_FACTOR))
    limits |= {"P_s": log1p(known["P_s"]), "T_in": known["T_in"]}
    return {name: limit for name, limit in limits.items() if limit > 0}


def _wall_limit(experiment: ExperimentSection, section: CylinderSection) -> float:
    """Half-width of the 95 % interval of the logarithm of an experiment's k_0."""
    if experiment.k_0_W_per_K == "catalogue":
        return log(conductance_factor(section.bore_mm * 1e-3))
    key = "lambda_0_W_per_m2K" if experiment.k_0_W_per_K is None else "k_0_W_per_K"
    given = experiment.uncertainty(key, relative=True)
    return log(K_0_FACTOR) if given is None else log1p(given)


def _slope_of_flow(section: CylinderSection) -> float:
    """Derivative of ln C by b of a valve that is given by its nominal flow, otherwise 0."""
    if section.valve is None or not CONVERSIONS[section.valve.flow_as_given[0]].nominal:
        return 0.0
    key, value = section.valve.flow_as_given
    low, high = (conductance(key, value, section.valve.critical_ratio + step) for step in (-0.02, 0.02))
    return log(high / low) / 0.04


def dynamics_notes(configuration: Configuration) -> list[str]:
    """Sentence on each cylinder with `valve_dynamics`, which a study leaves out."""
    note = "used by simulate and exports; in the runs of `study` the valve follows at once"
    cylinders = configuration.cylinders.items()
    return [f"{name}: valve_dynamics: {note}" for name, section in cylinders if section.valve_dynamics]


def conversion_notes(configuration: Configuration) -> list[str]:
    """Sentences on the figures of valves that were converted, with rule and accuracy, and on a missing b."""
    notes = []
    for name, section in configuration.cylinders.items():
        if section.valve is None:
            continue
        key, value = section.valve.flow_as_given
        rule = CONVERSIONS[key]
        if key != "C_dm3_per_sbar":
            within = f", within {100 * rule.within:.0f} %" if rule.within else ""
            C = section.valve.largest_C
            notes.append(f"{name}: {key} = {value:g} is C = {C:.4g} dm3/(s bar): {rule.rule}{within}")
        if section.valve.b is None:
            notes.append(f"{name}: b is unknown: {USUAL_B} assumed; pneumo study takes 0.15 to 0.45")
    return notes
