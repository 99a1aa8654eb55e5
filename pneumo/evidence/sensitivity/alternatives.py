"""The study under each alternative of ``paper/2006/assumptions.yaml``, and with other physics.

An alternative of that file is keys of the configuration with their values, or the name of one of `IN_WORDS`.
"""

from collections.abc import Callable, Mapping
from functools import reduce
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pneumo.configuration.experiment import Experiment, Plant, Study
from pneumo.configuration.parameters import merged, study, validated
from pneumo.configuration.sampling import EXACT_SAMPLING, INTERPOLATED, Sampling
from pneumo.errors import ConfigurationError
from pneumo.papers.paper_2006.printed_tables import PAPER_FOLDER
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.simulation.excitation import reference_series
from pneumo.simulation.full_order import STATE, Recording, record, recorded
from pneumo.simulation.settling import QUANTITIES, Settling, settling_time
from pneumo.simulation.signals import PUBLISHED, study_sampling
from pneumo.verdict import PaperError
from pneumo.verdict.assumptions import AS_TAKEN, read_assumptions

ROD = 1 - 0.4**2  # fraction of the bore's area beside a rod of 0.4 bores
SUPPLY_PRESSURES = {"4_bar": 4e5, "5_5_bar": 5.5e5, "8_5_bar": 8.5e5, "10_bar": 1e6}  # Pa; the study's is 7e5
INLET = 20.0  # K between incoming air and the walls
CATALOGUE_COULOMB = 0.05  # of supply pressure times piston area: friction of a cylinder by catalogues
LEAK = 0.01  # of the fully open area, between a chamber and either port: a worn spool
CRITICAL_RATIO = 0.3  # of a bought valve; catalogues have 0.2 to 0.5


class Alternative(NamedTuple):
    """The whole study under one alternative."""

    study: Study
    record: Callable[[Experiment], Recording] = record  #: makes the full-order run of an experiment
    #: Reads the four settling times, s, off a settling run with a step, s.
    times: Callable[[Settling, float], np.ndarray] = lambda settling, _: settling.times
    other_sampling: Sampling | None = None  #: signal sampling, if not the study's published one
    sign: float = 1.0  #: of the error
    ddof: int = 1  #: of the variance of means in eq (16)

    def sampling(self, experiment: Experiment) -> Sampling:
        """Return the signal sampling of the replays of an experiment."""
        return self.other_sampling or study_sampling(PUBLISHED, experiment)

    def run_key(self, name: str) -> tuple[Any, ...]:
        """Return all that the full-order run of an experiment depends on."""
        e = self.study.experiments[name]
        return e.plant, e.drive, e.excitation, e.h, e.steps, e.most_halvings, self.record

    def has_other_runs(self, taken: "Alternative") -> bool:
        """Whether the full-order run of some experiment differs from that of `taken`."""
        return any(self.run_key(name) != taken.run_key(name) for name in taken.study.experiments)

    def with_plants(self, change: Callable[[Plant], Plant]) -> "Alternative":
        """Return the alternative with another plant in every experiment."""
        return self._replace(study=self.study.changed(lambda e: e._replace(plant=change(e.plant))))

    def with_halvings(self) -> "Alternative":
        """Return the alternative with steps halved wherever they fail or are not accurate."""
        return self._replace(study=self.study.with_halvings())


def equal_runs(name: str, alternatives: Mapping[str, Alternative]) -> list[list[str]]:
    """Group the names of alternatives that have the same full-order run of an experiment."""
    groups: dict[tuple[Any, ...], list[str]] = {}
    for alternative, member in alternatives.items():
        groups.setdefault(member.run_key(name), []).append(alternative)
    return list(groups.values())


def _with_cylinder(plant: Plant, **fields: Any) -> Plant:
    return plant._replace(cylinder=plant.cylinder._replace(**fields))


def _elliptic(plant: Plant) -> Plant:
    """Replace eq (1) by the flow law of ISO 6358, and start from the equilibrium that it gives."""
    gas, c = plant.gas._replace(critical_ratio=CRITICAL_RATIO, elliptic=True), plant.conditions
    P_0 = equilibrium_pressure(c.P_s, c.P_atm, gas)
    return plant._replace(gas=gas, conditions=c._replace(P_0=P_0))


def first_draw_skipped(experiment: Experiment) -> Recording:
    """Full-order run whose reference leaves out the first random draw."""
    excitation = experiment.excitation
    series = reference_series(experiment.drive, excitation, experiment.steps + excitation.every)
    return recorded(experiment, series[excitation.every :])


def leaking(experiment: Experiment) -> Recording:
    """Full-order run with a leaking valve; the recording has the tight valve, which the replays use."""
    plant = experiment.plant
    valve = plant.valve._replace(leak=experiment.push.leak, net_leak=True)
    return record(experiment._replace(plant=plant._replace(valve=valve)))._replace(plant=plant)


def _judged_on_last_values(settling: Settling, h: float, quantities: str) -> np.ndarray:
    """Settling times, s; those of `quantities` (P or T) are judged on the last value.

    Their settling band is relative to the largest deviation from the last value.
    """
    times, free = settling.times.copy(), settling.states[settling.release_step :]
    for i, quantity in enumerate(QUANTITIES):
        if quantity.startswith(quantities):
            series = free[:, STATE.index(quantity)]
            times[i] = settling_time(series, series[-1], np.abs(series - series[-1]).max(), h)
    return times


def _near(within: float) -> Callable[["Alternative"], "Alternative"]:
    """Change: settling runs are released, and end, when temperatures are back within `within` K of T_amb."""
    return lambda taken: taken._replace(
        study=taken.study.changed(lambda e: e._replace(push=e.push._replace(near=within)))
    )


# Other ways in which a replay's stages may have read u, x and v.
OTHER_SAMPLINGS = {
    "exact_transport": EXACT_SAMPLING,
    "command_late": INTERPOLATED._replace(delay=(1.0, 0.0, 0.0)),
}
IN_WORDS: dict[str, Callable[[Alternative], Alternative]] = {
    "rod.rod_40_percent": lambda taken: taken.with_plants(
        lambda p: _with_cylinder(p, A_A=ROD * p.cylinder.A_A, A_B=ROD * p.cylinder.A_B)
    ),
    "end_stop_law.no_rest_rule": lambda taken: taken.with_plants(lambda p: _with_cylinder(p, rests=False)),
    "hold.back_within_0_1_K": _near(0.1),
    "hold.back_within_0_4_K": _near(0.4),
    "settling_change.largest_excursion": lambda taken: taken._replace(
        times=lambda settling, h: _judged_on_last_values(settling, h, "P")
    ),
    "settling_change.temperatures_to_last_value": lambda taken: taken._replace(
        times=lambda settling, h: _judged_on_last_values(settling, h, "T")
    ),
    "valve_leak.leak_in_runs_alone": lambda taken: taken._replace(record=leaking),
    "generator.first_draw_skipped": lambda taken: taken._replace(record=first_draw_skipped),
    **{
        f"transport.{name}": lambda taken, sampling=sampling: taken._replace(other_sampling=sampling)
        for name, sampling in OTHER_SAMPLINGS.items()
    },
    "error_sign.reduced_minus_full": lambda taken: taken._replace(sign=-1.0),
    "variance_of_means.population": lambda taken: taken._replace(ddof=0),
}
OTHER_PHYSICS: dict[str, Callable[[Plant], Plant]] = {
    "friction_law.coulomb": lambda p: _with_cylinder(
        p, coulomb=CATALOGUE_COULOMB * p.conditions.P_s * p.cylinder.A_A
    ),
    "valve.leak": lambda p: p._replace(valve=p.valve._replace(leak=LEAK * p.valve.k_xu * p.valve.u_max)),
    "valve.elliptic": _elliptic,
}


def ledger_alternatives(
    configuration: Mapping[str, Any], folder: Path = PAPER_FOLDER
) -> dict[str, Alternative]:
    """Every alternative of ``assumptions.yaml``, named ``assumption.alternative``, after `AS_TAKEN`.

    Those with other full-order runs halve steps that fail or are not accurate. `PaperError` if an alternative
    in words has no code, or names a key that the configuration lacks.
    """
    file = folder / "assumptions.yaml"
    taken = Alternative(study(validated(configuration, [("configuration", configuration)])))
    alternatives = {AS_TAKEN: taken}
    for assumption, entry in read_assumptions(folder).items():
        for alternative, change in entry.alternatives.items():
            name = f"{assumption}.{alternative}"
            if not isinstance(change, str):
                member = reconfigured(configuration, change, f"{file}: {name}")
            elif name in IN_WORDS:
                member = IN_WORDS[name](taken)
            else:
                raise PaperError(f"{file}: {name}: no code for {change!r}; left_out takes a reason")
            alternatives[name] = member.with_halvings() if member.has_other_runs(taken) else member
    return alternatives


def grid_alternatives(
    configuration: Mapping[str, Any], folder: Path = PAPER_FOLDER
) -> dict[str, Alternative]:
    """Alternatives with other full-order runs, of ``assumptions.yaml`` and of physics; first `AS_TAKEN`."""
    ledger = {name: each.with_halvings() for name, each in ledger_alternatives(configuration, folder).items()}
    taken = ledger[AS_TAKEN]
    alternatives = {n: each for n, each in ledger.items() if n == AS_TAKEN or each.has_other_runs(taken)}
    alternatives |= {name: taken.with_plants(change) for name, change in OTHER_PHYSICS.items()}
    T_amb = next(iter(taken.study.experiments.values())).plant.conditions.T_amb
    changes = {f"supply.{name}": {"supply.P_s_Pa": P_s} for name, P_s in SUPPLY_PRESSURES.items()}
    inlets = {"inlet.colder": T_amb - INLET, "inlet.warmer": T_amb + INLET}
    changes |= {name: {"supply.T_in_K": T_in} for name, T_in in inlets.items()}
    return alternatives | {name: reconfigured(configuration, c, name) for name, c in changes.items()}


def reconfigured(configuration: Mapping[str, Any], change: Mapping[str, Any], source: str) -> Alternative:
    """Alternative whose configuration has other values at the keys of `change`, such as ``supply.P_s_Pa``.

    `PaperError` if a configuration cannot have the values; `source` says where they come from.
    """
    override: dict[str, Any] = {}
    for key, value in change.items():
        override = merged(override, reduce(lambda inner, part: {part: inner}, key.split(".")[::-1], value))
    sources = [("configuration", configuration), (source, override)]
    try:
        return Alternative(study(validated(merged(configuration, override), sources)))
    except ConfigurationError as error:
        raise PaperError(str(error)) from None
