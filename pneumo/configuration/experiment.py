"""One experiment (plant, drive, signal, length) and a study of several, in SI units."""

from collections.abc import Mapping
from math import isclose
from typing import Any, NamedTuple

from pneumo.configuration.sampling import Sampling
from pneumo.physics.cylinder import Cylinder
from pneumo.physics.models import WallLaw
from pneumo.physics.valve import Conditions, Gas, Valve, mass_flow

MOST_HALVINGS = 6  # of a step that fails or is not accurate
MOST_SEEDS = 1000  # runs of an experiment in one study


class Plant(NamedTuple):
    """Gas, valve, conditions, cylinder and wall conductance of one system, in SI units."""

    gas: Gas  #: in valve and chambers
    valve: Valve  #: one for both chambers
    conditions: Conditions  #: supply, surroundings and equilibrium
    cylinder: Cylinder  #: with its load
    k_0: float  #: thermal conductance of each chamber's wall at equilibrium, W/K
    wall: WallLaw = WallLaw()  #: how the conductance depends on position, pressure and temperature
    #: Fraction by which P_s falls at the largest flow, in runs of the full order; replays take P_s itself.
    sag: float = 0.0

    @property
    def speed(self) -> float:
        """Speed of the piston if chamber A, at rest pressure, takes all flow of the fully open valve, m/s."""
        s = self.conditions
        flow = mass_flow(self.valve.k_xu * self.valve.u_max, s.P_s, s.P_0, s.T_in, self.gas)
        return flow * self.gas.R * s.T_0 / (s.P_0 * self.cylinder.A_A)


class Drive(NamedTuple):
    """How the command follows from the reference, Figs 4 and 5."""

    closed_loop: bool  # proportional control of position, or the open-loop sequence whose sign is reversed
    k_p: float  # proportional gain, V/m
    x_reverse: float  # distance from the centre at which the open-loop sign is reversed, m
    # Whether the sequence keeps its reversed sign; else the command only points inward while the piston is
    # beyond x_reverse.
    toggles: bool = False
    each_stage: bool = True  # whether x is compared with x_reverse at every stage, or once a step
    late: float = 0.0  # samples, 0 to 1, by which a reversal is late in the recorded command


class Excitation(NamedTuple):
    """Reference signal, Table 3."""

    seed: int  # of the Random Number block
    # Standard deviation of the position reference, m, in closed loop; command's size, V, in open loop.
    amplitude: float
    every: int  # steps between draws, or of each level
    # prbs (signs of random numbers), gaussian (the random numbers), sweep (a sine) or levels; the loop's own
    # is prbs in open loop and gaussian in closed loop.
    signal: str = "loop's own"
    band: tuple[float, float] = (0.0, 0.0)  # first and last frequency of a sweep, cycles per step
    levels: tuple[float, ...] = ()  # multiples of the amplitude, one after another and then again

    @property
    def random(self) -> bool:
        """Whether the seed makes a difference."""
        return self.signal not in ("sweep", "levels")


class Push(NamedTuple):
    """Force on the piston in the settling-time runs, Fig. 7, and when these runs end."""

    force: float  # external force while holding, N
    x_stop: float  # end stop against which it pushes, m
    leak: float = 0.0  # of the valve in these runs, beside its own, m^2
    stop: float | None = None  # time after release at which the run ends, s; None: once the air is near T_amb
    near: float = 0.2  # K; both temperatures are back within it of T_amb at the release, and at the end


class Experiment(NamedTuple):
    """One of the paper's E1 ... E16, or a user's."""

    name: str  # E01 ... in the paper
    cylinder: str  # name of the cylinder, D or E in the paper
    plant: Plant
    drive: Drive
    excitation: Excitation
    push: Push
    sampling: Sampling  # of the published replays
    h: float  # step, s
    steps: int  # of the full-order run
    pressure_stride: int  # steps between stored pressures of the replays
    most_halvings: int  # of a step that fails or is not accurate

    @property
    def loop(self) -> str:
        """Kind of loop, open or closed."""
        return "closed" if self.drive.closed_loop else "open"

    @property
    def duration(self) -> float:
        """Length of the full-order run, s."""
        return self.steps * self.h

    def with_seed(self, seed: int) -> "Experiment":
        """Return a copy of the experiment with another random seed."""
        return self._replace(excitation=self.excitation._replace(seed=seed))


class Study(NamedTuple):
    """A set of experiments and the grid of models replayed on them."""

    name: str  # of the configuration
    experiments: dict[str, Experiment]
    n: tuple[float, ...]  # polytropic indices of the grid
    levels: dict[str, tuple[float, ...]]  # conductances k_0, W/K, of each heat-transfer level
    config_sha256: str
    percentile_rule: str = "linear"  # method of `numpy.percentile`
    seeds: int = 5  # how often `pneumo study` runs each experiment, each time with another seed

    @property
    def experiments_by_level(self) -> dict[str, list[str]]:
        """Names of the experiments of each level of wall heat: those whose k_0 is one of the level's."""
        conductances = {name: e.plant.k_0 for name, e in self.experiments.items()}
        # To 0.2 %, since k_0 from lambda_0 in Table 4 is within 0.1 % of the printed one.
        return {
            level: [
                name for name, k_0 in conductances.items() if any(isclose(k_0, k, rel_tol=0.002) for k in of)
            ]
            for level, of in self.levels.items()
        }


def plain(value: Any) -> Any:
    """Convert a value for JSON: named tuples become mappings, other tuples lists; floats and text stay."""
    if hasattr(value, "_asdict"):
        value = value._asdict()
    if isinstance(value, Mapping):
        return {key: plain(inner) for key, inner in value.items()}
    return [plain(inner) for inner in value] if isinstance(value, tuple) else value
