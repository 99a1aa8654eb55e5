"""Checks of a chamber model in an FMU, by co-simulation through fmpy."""

from collections.abc import Mapping
from os import PathLike, fspath
from shutil import rmtree
from typing import Any

from hypothesis import settings as Settings

from pneumo.configuration.experiment import Plant
from pneumo.equations.named_model import model_and_index
from pneumo.errors import InputError
from pneumo.physics.models import Model
from pneumo.testing.chamber_checks import DERANDOMISED, CheckReport, checks_of, report_of
from pneumo.testing.chamber_model import ChamberModel, Point

SHORT = 1e-6  # s, a step whose mean rate is that at its start
TOLERANCE = 0.01  # of such a rate: near equal pressures the flow changes within the step
VARIABLES = ("u", "x", "v", "P_A", "P_B", "T_A", "T_B")


class _Instance:
    """An instance of an FMU, whose variables have the names in `VARIABLES`."""

    def __init__(self, file: str, names: Mapping[str, str]) -> None:
        import fmpy

        description = fmpy.read_model_description(file)
        known = {variable.name: variable.valueReference for variable in description.modelVariables}
        named = {name: names.get(name, name) for name in VARIABLES}
        self.references = {name: known[given] for name, given in named.items() if given in known}
        if missing := [name for name in ("u", "x", "v", "P_A") if name not in self.references]:
            needed = ", ".join(f"{name} ({named[name]})" for name in missing)
            raise InputError(f"{file}: no variable for {needed}: give its name in `names`")
        if description.coSimulation is None:
            raise InputError(f"{file}: not for co-simulation")
        self.second = description.fmiVersion == "2.0"
        self.folder = fmpy.extract(file)
        self.fmu: Any = fmpy.instantiate_fmu(self.folder, description, "CoSimulation")

    def close(self) -> None:
        self.fmu.freeInstance()
        rmtree(self.folder, ignore_errors=True)

    def put(self, **values: float) -> None:
        known = {self.references[name]: value for name, value in values.items() if name in self.references}
        (self.fmu.setReal if self.second else self.fmu.setFloat64)([*known], [*known.values()])

    def get(self, *names: str) -> list[float]:
        known = [self.references[name] for name in names if name in self.references]
        return list((self.fmu.getReal if self.second else self.fmu.getFloat64)(known))

    def start(self, P: float, T: float, **inputs: float) -> None:
        """Begin again with one pressure and temperature in both chambers."""
        self.fmu.reset()
        if self.second:
            self.fmu.setupExperiment(startTime=0.0)
        self.put(P_A=P, P_B=P, T_A=T, T_B=T, **inputs)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()

    def step(self, t: float, h: float) -> None:
        self.fmu.doStep(currentCommunicationPoint=t, communicationStepSize=h)

    def rates(self, P: float, T: float, side: str, **inputs: float) -> list[float]:
        """Rates of a chamber's states, from a short step."""
        self.start(P, T, **inputs)
        self.step(0.0, SHORT)
        after = self.get(f"P_{side}", f"T_{side}")
        return [(end - start) / SHORT for end, start in zip(after, (P, T), strict=False)]

    def stepped(self, start: Point, inputs: list[Point], h: float) -> list[tuple[float, float]]:
        """Pressure and temperature of chamber A after each step of h s, in which inputs are held."""
        self.start(start.P, start.T, x=start.x, v=start.v, u=start.u)
        run = list[tuple[float, float]]()
        for k, now in enumerate(inputs):
            self.put(x=now.x, v=now.v, u=now.u)
            self.step(k * h, h)
            P, T = (*self.get("P_A", "T_A"), start.T)[:2]
            run.append((P, T))
        return run


def check_fmu(
    file: str | PathLike[str],
    plant: Plant,
    n: float | None = None,
    *,
    like: Model | str | None = None,
    names: Mapping[str, str] | None = None,
    not_claimed: Mapping[str, str] | None = None,
    settings: Settings = DERANDOMISED,
) -> CheckReport:
    """Check the physics of chambers in an FMU for co-simulation, as `check_model` does for a function.

    Rates are those of steps of 1 us from states that are set before the start, so errors below about 1 %
    pass.

    Parameters
    ----------
    file : str or path
        The FMU, of FMI 2 or 3.
    plant, n, like, not_claimed, settings
        As in `check_model`. An FMU with temperatures among its variables has them as states.
    names : mapping of str to str
        Names of the FMU's variables for the inputs "u", "x" and "v" and the outputs "P_A", "P_B", "T_A" and
        "T_B", where they differ from these; "P_B" and the temperatures may be absent.

    Raises
    ------
    InputError
        If the FMU is not for co-simulation or has no variable for an input or P_A.
    ImportError
        If fmpy is not installed.
    """
    declared, n = model_and_index(like, n) if like else (None, n or 1.0)
    instance = _Instance(fspath(file), names or {})

    def rates(P: float, side: str = "A", T: float = plant.conditions.T_0, **inputs: float) -> list[float]:
        return instance.rates(P, T, side, **inputs)

    reads = {"P", "x", "v", "u"} | {"T"} & {name[0] for name in instance.references}
    reads |= {"side"} if "P_B" in instance.references else set()
    model = ChamberModel(rates, frozenset(reads), plant, n, declared, TOLERANCE, instance.stepped)
    try:
        return report_of(checks_of(model, not_claimed, settings))
    finally:
        instance.close()
