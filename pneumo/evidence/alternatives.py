"""The study as each alternative of ``paper/2006/assumptions.yaml`` would have it, and under other physics.

An alternative of the ledger is keys of the configuration, or words for one of `IN_WORDS`.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from pneumo.configuration.experiment import Experiment, Plant, Study
from pneumo.configuration.parameters import merged, study, validated
from pneumo.errors import ConfigurationError
from pneumo.evidence.other_runs import first_draw_skipped, keeps_changed_sign, largest_excursions
from pneumo.physics.equilibrium import equilibrium_pressure
from pneumo.simulation.full_order import Recording, record
from pneumo.simulation.runge_kutta import STAGES
from pneumo.simulation.settling import Settling
from pneumo.simulation.signals import (
    EXACT_TRANSPORT,
    PUBLISHED,
    Transport,
    held,
    interpolated,
    study_transport,
)
from pneumo.verdict import PAPER_FOLDER, PaperError
from pneumo.verdict.assumptions import AS_TAKEN, read_assumptions

ROD = 1 - 0.4**2  # share of the bore's area that a rod of 0.4 bores leaves
SUPPLY_PRESSURES = {"4_bar": 4e5, "5_5_bar": 5.5e5, "8_5_bar": 8.5e5, "10_bar": 1e6}  # Pa; the study's is 7e5
INLET = 20.0  # K by which incoming air differs from the walls
CATALOGUE_COULOMB = 0.05  # of supply pressure times piston area: a cylinder's own friction by catalogues
LEAK = 0.01  # of the fully open area, between a chamber and either port: a worn spool
CRITICAL_RATIO = 0.3  # of a bought valve; catalogues have 0.2 to 0.5


class Alternative(NamedTuple):
    """The whole study as one alternative would have it."""

    study: Study
    record: Callable[[Experiment], Recording] = record  #: makes the full-order run of an experiment
    #: Reads the four settling times off a settling run; gets the step, s, too.
    times: Callable[[Settling, float], np.ndarray] = lambda settling, _: settling.times
    other_transport: Transport | None = None  #: in place of the study's published transport
    sign: float = 1.0  #: of the error
    ddof: int = 1  #: of the variance of means in eq (16)

    def transport(self, experiment: Experiment) -> Transport:
        """Return how recorded signals reach the replays of an experiment."""
        return self.other_transport or study_transport(PUBLISHED, self.study.lag, experiment.h)

    def run_key(self, name: str) -> tuple[Any, ...]:
        """Return what the full-order run of an experiment depends on."""
        e = self.study.experiments[name]
        return e.plant, e.drive, e.excitation, e.h, e.steps, self.record


def equal_runs(name: str, alternatives: Mapping[str, Alternative]) -> list[list[str]]:
    """Group the names of alternatives that have the same full-order run of an experiment."""
    groups: dict[tuple[Any, ...], list[str]] = {}
    for alternative, member in alternatives.items():
        groups.setdefault(member.run_key(name), []).append(alternative)
    return list(groups.values())


def with_plants(alternative: Alternative, change: Callable[[Plant], Plant]) -> Alternative:
    """Return the alternative with another plant in every experiment."""
    experiments = {
        name: e._replace(plant=change(e.plant)) for name, e in alternative.study.experiments.items()
    }
    return alternative._replace(study=alternative.study._replace(experiments=experiments))


def _with_rod(plant: Plant) -> Plant:
    c = plant.cylinder
    return plant._replace(cylinder=c._replace(A_A=ROD * c.A_A, A_B=ROD * c.A_B))


def _without_rest_rule(plant: Plant) -> Plant:
    return plant._replace(cylinder=plant.cylinder._replace(rests=False))


def _sticking(plant: Plant) -> Plant:
    """Coulomb friction beside the viscous one."""
    cylinder = plant.cylinder
    coulomb = CATALOGUE_COULOMB * plant.conditions.P_s * cylinder.A_A
    return plant._replace(cylinder=cylinder._replace(coulomb=coulomb))


def _leaking(plant: Plant) -> Plant:
    """A valve that never shuts."""
    valve = plant.valve
    return plant._replace(valve=valve._replace(leak=LEAK * valve.k_xu * valve.u_max))


def _elliptic(plant: Plant) -> Plant:
    """ISO 6358 in place of eq (1), from its own equilibrium."""
    gas, c = plant.gas._replace(critical_ratio=CRITICAL_RATIO, elliptic=True), plant.conditions
    P_0 = equilibrium_pressure(c.P_s, c.P_atm, gas)
    return plant._replace(gas=gas, conditions=c._replace(P_0=P_0))


# The recorded signals (u, x, v) that a replay's stages may have read otherwise.
OTHER_TRANSPORTS = {
    "exact_transport": EXACT_TRANSPORT,
    "hold": held(),
    "command_late": interpolated(np.outer(np.ones(STAGES), [1.0, 0.0, 0.0]), name="command_late"),
    "last_stage_late": interpolated(
        np.outer(np.arange(STAGES) == STAGES - 1, np.ones(3)), name="last_stage_late"
    ),
}
IN_WORDS: dict[str, Callable[[Alternative], Alternative]] = {
    "rod.rod_40_percent": lambda taken: with_plants(taken, _with_rod),
    "end_stop_law.no_rest_rule": lambda taken: with_plants(taken, _without_rest_rule),
    "settling_change.largest_excursion": lambda taken: taken._replace(times=largest_excursions),
    "generator.first_draw_skipped": lambda taken: taken._replace(record=first_draw_skipped),
    "sign_reversal.toggle": lambda taken: taken._replace(record=keeps_changed_sign),
    **{
        f"transport.{name}": lambda taken, transport=transport: taken._replace(other_transport=transport)
        for name, transport in OTHER_TRANSPORTS.items()
    },
    "error_sign.reduced_minus_full": lambda taken: taken._replace(sign=-1.0),
    "variance_of_means.population": lambda taken: taken._replace(ddof=0),
}
OTHER_PHYSICS: dict[str, Callable[[Plant], Plant]] = {
    "friction_law.coulomb": _sticking,
    "valve.leak": _leaking,
    "valve.elliptic": _elliptic,
}


def ledger_alternatives(
    configuration: Mapping[str, Any], folder: Path = PAPER_FOLDER
) -> dict[str, Alternative]:
    """Every alternative of ``assumptions.yaml``, named ``assumption.alternative``, after `AS_TAKEN`.

    Raises
    ------
    PaperError
        If an alternative in words has no code, or names a key that the configuration lacks.
    """
    file = folder / "assumptions.yaml"
    taken = Alternative(study(validated(configuration, [("configuration", configuration)])))
    alternatives = {AS_TAKEN: taken}
    for assumption, entry in read_assumptions(folder).items():
        for alternative, change in entry.alternatives.items():
            name = f"{assumption}.{alternative}"
            if not isinstance(change, str):
                alternatives[name] = reconfigured(configuration, change, f"{file}: {name}")
            elif name in IN_WORDS:
                alternatives[name] = IN_WORDS[name](taken)
            else:
                raise PaperError(f"{file}: {name}: no code for {change!r}; left_out takes a reason")
    return alternatives


def grid_alternatives(
    configuration: Mapping[str, Any], folder: Path = PAPER_FOLDER
) -> dict[str, Alternative]:
    """Every alternative with other full-order runs, of the ledger and of physics, after `AS_TAKEN`.

    Parameters and errors are those of `ledger_alternatives`.
    """
    ledger = ledger_alternatives(configuration, folder)
    taken = ledger[AS_TAKEN]
    alternatives = {
        name: other
        for name, other in ledger.items()
        if other is taken or any(other.run_key(e) != taken.run_key(e) for e in taken.study.experiments)
    }
    alternatives |= {name: with_plants(taken, change) for name, change in OTHER_PHYSICS.items()}
    T_amb = next(iter(taken.study.experiments.values())).plant.conditions.T_amb
    changes = {f"supply.{name}": {"supply.P_s_Pa": P_s} for name, P_s in SUPPLY_PRESSURES.items()}
    changes |= {"inlet.colder": {"supply.T_in_K": T_amb - INLET}}
    changes |= {"inlet.warmer": {"supply.T_in_K": T_amb + INLET}}
    return alternatives | {name: reconfigured(configuration, c, name) for name, c in changes.items()}


def reconfigured(configuration: Mapping[str, Any], change: Mapping[str, Any], source: str) -> Alternative:
    """Study whose configuration has other values at some keys, such as ``supply.P_s_Pa``.

    Raises
    ------
    PaperError
        If a configuration cannot have the values; `source` says where they come from.
    """
    override: dict[str, Any] = {}
    for key, value in change.items():
        nested = value
        for part in reversed(key.split(".")):
            nested = {part: nested}
        override = merged(override, nested)
    sources = [("configuration", configuration), (source, override)]
    try:
        return Alternative(study(validated(merged(configuration, override), sources)))
    except ConfigurationError as error:
        raise PaperError(str(error)) from None
