"""What one experiment is: the plant, its drive and how long it runs, all in SI units."""

from typing import NamedTuple

from pneumo.physics.cylinder import Cylinder
from pneumo.physics.valve import Conditions, Gas, Valve


class Plant(NamedTuple):
    """Everything physical about one experiment.

    Attributes
    ----------
    gas : Gas
    valve : Valve
    conditions : Conditions
    cylinder : Cylinder
    k_0 : float
        Thermal conductance of each chamber at equilibrium, W/K.
    """

    gas: Gas
    valve: Valve
    conditions: Conditions
    cylinder: Cylinder
    k_0: float


class Drive(NamedTuple):
    """How the command follows from the reference, Figs 4 and 5.

    Attributes
    ----------
    closed_loop : bool
        Proportional control of position, or the open-loop sequence with forced sign.
    k_p : float
        Proportional gain, V/m.
    x_reverse : float
        Distance from the centre at which the open-loop sign is forced back, m.
    """

    closed_loop: bool
    k_p: float
    x_reverse: float


class Excitation(NamedTuple):
    """Reference signal, Table 3.

    Attributes
    ----------
    seed : int
        Seed of the Random Number block.
    amplitude : float
        Standard deviation of the position reference, m, in closed loop; magnitude of the
        two-valued command, V, in open loop.
    every : int
        Steps between draws, or of each level.
    signal : {"loop's own", "prbs", "gaussian", "sweep", "levels"}
        Signs of random numbers, the random numbers, a sine, or levels; the loop's own is the first of them
        in open loop and the second in closed loop.
    band : tuple of float
        First and last frequency of a sweep, cycles per step.
    levels : tuple of float
        Multiples of the amplitude, one after another and then again.
    """

    seed: int
    amplitude: float
    every: int
    signal: str = "loop's own"
    band: tuple[float, float] = (0.0, 0.0)
    levels: tuple[float, ...] = ()

    @property
    def random(self) -> bool:
        """Whether the seed makes a difference."""
        return self.signal not in ("sweep", "levels")


class Push(NamedTuple):
    """The force of the settling-time runs, Fig. 7.

    Attributes
    ----------
    force : float
        External force while holding, N.
    x_stop : float
        End stop against which it pushes, m.
    tolerance : float
        The piston is held until pressures and temperatures change by less than this fraction of
        their equilibrium values over one thermal time constant.
    """

    force: float
    x_stop: float
    tolerance: float


class Experiment(NamedTuple):
    """One of the paper's E1 ... E16, or a user's.

    Attributes
    ----------
    name, cylinder : str
        Experiment, E01 ..., and cylinder, D or E in the paper.
    plant : Plant
    drive : Drive
    excitation : Excitation
    push : Push
    h : float
        Step, s.
    steps : int
        Number of steps of the full-order run.
    pressure_stride : int
        Steps between stored pressures of the replays.
    """

    name: str
    cylinder: str
    plant: Plant
    drive: Drive
    excitation: Excitation
    push: Push
    h: float
    steps: int
    pressure_stride: int


class Study(NamedTuple):
    """A set of experiments and the grid of models replayed on them.

    Attributes
    ----------
    name : str
        Name of the configuration.
    experiments : dict of str to Experiment
    n : tuple of float
        Polytropic indices of the grid.
    levels : dict of str to tuple of float
        Conductances k_0, W/K, that make up each heat-transfer level.
    lag : float
        Delay of the recorded signals in the published transport, s.
    config_sha256 : str
        Hash of the configuration.
    seeds : int
        How often `pneumo study` runs each experiment, each time with another seed.
    """

    name: str
    experiments: dict[str, Experiment]
    n: tuple[float, ...]
    levels: dict[str, tuple[float, ...]]
    lag: float
    config_sha256: str
    seeds: int = 5

    @property
    def experiments_by_level(self) -> dict[str, list[str]]:
        """Names of the experiments of each heat-transfer level."""
        return {
            level: [name for name, experiment in self.experiments.items() if experiment.plant.k_0 in k_0]
            for level, k_0 in self.levels.items()
        }
