"""Checks of a chamber model in an FMU, by co-simulation through fmpy."""

from collections.abc import Mapping
from inspect import Parameter, Signature
from os import PathLike, fspath
from shutil import rmtree
from typing import Any

from pneumo.configuration.experiment import Plant
from pneumo.errors import InputError
from pneumo.testing.chamber_checks import CheckReport, check_model

VARIABLES = ("u", "x", "v", "P_A", "P_B", "T_A", "T_B")


class _Fmu:
    """An FMU as a function of a chamber's state and inputs, as `model_checks` describes one."""

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
        self.instance: Any = fmpy.instantiate_fmu(self.folder, description, "CoSimulation")
        reads = ["P", "x", "v", "u", "h"]
        reads += [given for name, given in (("T_A", "T"), ("P_B", "side")) if name in self.references]
        self.__signature__ = Signature([Parameter(name, Parameter.KEYWORD_ONLY) for name in reads])

    def __call__(
        self, P: float, x: float, v: float, u: float, h: float, side: str = "A", T: float | None = None
    ) -> list[float]:
        """Mean rates of a chamber's states over a step of h s, from a state that both chambers start in."""
        fmu, states = self.instance, {"P": P} if T is None else {"P": P, "T": T}
        start = {f"{name}_{chamber}": value for name, value in states.items() for chamber in "AB"}
        values = {name: start.get(name) for name in self.references} | {"x": x, "v": v, "u": u}
        known = {self.references[name]: value for name, value in values.items() if value is not None}
        after = [self.references[f"{name}_{side}"] for name in states]
        fmu.reset()
        if self.second:
            fmu.setupExperiment(startTime=0.0)
        (fmu.setReal if self.second else fmu.setFloat64)([*known], [*known.values()])
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        fmu.doStep(currentCommunicationPoint=0.0, communicationStepSize=h)
        ends = (fmu.getReal if self.second else fmu.getFloat64)(after)
        return [(end - begin) / h for end, begin in zip(ends, states.values(), strict=True)]


def check_fmu(
    file: str | PathLike[str],
    plant: Plant,
    n: float | None = None,
    *,
    names: Mapping[str, str] | None = None,
    **options: Any,
) -> CheckReport:
    """Check the physics of chambers in an FMU for co-simulation, as `check_model` does for a function.

    Rates are those of steps of 1 us from states that are set before the start: errors below about 1 % pass.

    Parameters
    ----------
    file : str or path
        The FMU, of FMI 2 or 3. If temperatures are among its variables, they are states.
    plant, n, options
        As in `model_checks`.
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
    fmu = _Fmu(fspath(file), names or {})
    try:
        return check_model(fmu, plant, n, **options)
    finally:
        fmu.instance.freeInstance()
        rmtree(fmu.folder, ignore_errors=True)
