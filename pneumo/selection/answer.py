"""The answer of `pneumo study` for one cylinder: which model to take, its expected error, what to measure.

Candidates are the reduced models, each at one n, and the full order. Their errors are those on cylinders
drawn from what is not known; after a fit, those on the part of the record that it did not see come first.
"""

import shlex
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Study
from pneumo.equations.system import FULL_ORDER as EXPORTED_FULL_ORDER
from pneumo.export.step_cost import StepCost, step_costs
from pneumo.physics.models import MODELS
from pneumo.selection.cylinder_ranking import LONG_RUN
from pneumo.statistics.error_budget import FULL_ORDER, Budget, Row
from pneumo.statistics.intervals import UNKNOWN, Interval, paired_ratio
from pneumo.statistics.ranking import MATERIAL, Ranking, cost, rank_models

# Beside `cost` of the models: no power, so that a step costs less than one of M5 to M10 (`step_cost`).
FULL_ORDER_COST = (0, 4, 0, 1)
UNKNOWN_FILE = "CONFIGURATION.yaml"  # in a command, where the name is not known


class Contender(NamedTuple):
    """A candidate for a cylinder: a reduced model at one n, or the full order."""

    row: Row
    over_chosen: Interval  #: its mean square error over the chosen one's, geometric mean over paired draws
    step: StepCost | None  #: None for a model added to the paper's

    @property
    def exported_name(self) -> str:
        """Name by which `pneumo export` knows the model."""
        return EXPORTED_FULL_ORDER if self.row.model == FULL_ORDER else self.row.model


class Answer(NamedTuple):
    """Which model to take for one cylinder, with the ranking from which this follows."""

    ranking: Ranking
    contenders: tuple[Contender, ...] = ()  #: lowest expected error first; empty if no run succeeded
    chosen: str = ""  #: cheapest model within 10 % of the lowest mean square error; empty if all failed
    as_good: tuple[str, ...] = ()  #: the other models within 10 %
    swing: float = np.nan  #: standard deviation of the pressures, Pa
    limits: str = ""  #: how well each quantity is known
    reason: str = ""
    advice: tuple[str, ...] = ()

    @property
    def budget(self) -> Budget:
        """Error budget of all models; `Answer` without a chosen model has none."""
        assert self.ranking.budget is not None
        return self.ranking.budget

    @property
    def headline(self) -> str:
        """The answer in a few words."""
        return f"Take {named(self.contender(self.chosen).row)}" if self.chosen else "No model"

    def contender(self, name: str) -> Contender:
        """The candidate of a model's name; "full order" is the full order."""
        return next(contender for contender in self.contenders if contender.row.model == name)


def answers(cells: xr.Dataset) -> list[Answer]:
    """Answers for the cylinders in `cells` (from `cylinder_ranking.run_study`), in their order there."""
    names = dict.fromkeys(cells["cylinder"].values.tolist())
    return [answer(cells, name) for name in names]


def answer(cells: xr.Dataset, cylinder: str) -> Answer:
    """Choose the cheapest model whose expected mean square error is within 10 % of the lowest.

    After a fit, errors on the part of the record that was held out are compared; other models have none.
    `cells` is from `cylinder_ranking.run_study`.
    """
    ranking = rank_models(cells, cylinder)
    budget = ranking.budget
    if budget is None or not ranking.rows:
        return Answer(ranking, reason="no full-order run succeeded")
    if not np.isfinite(budget.rows[0].rms):
        return Answer(ranking, reason="every model failed in a run")
    simulated = {row.model: row.rms for row in budget.rows}
    measured = {name: error for name, error in budget.measured.items() if np.isfinite(simulated[name])}
    errors = measured or simulated
    good = _within(errors)
    chosen = min((budget.row(name) for name in good), key=row_cost)
    costs = step_costs()
    contenders = tuple(
        Contender(
            row,
            _over(row.mse, chosen.mse),
            costs.get(EXPORTED_FULL_ORDER if row.model == FULL_ORDER else row.model),
        )
        for row in budget.rows
    )
    kept = cells.sel(experiment=list(ranking.experiments))
    swing = float((kept["swing"] ** 2).mean()) ** 0.5
    return Answer(
        ranking=ranking,
        contenders=contenders,
        chosen=chosen.model,
        as_good=tuple(name for name in good if name != chosen.model),
        swing=swing,
        limits=str(kept["limits"][0].item()),
        reason=_reason(budget, chosen, good, swing),
        advice=tuple(_advice(kept, ranking, budget, chosen)),
    )


def _within(errors: dict[str, float]) -> list[str]:
    """Models whose mean square error is within 10 % of the lowest, lowest first."""
    limit = (1 + MATERIAL) ** 0.5 * min(errors.values())
    return [name for name in sorted(errors, key=lambda name: errors[name]) if errors[name] <= limit]


def named(row: Row) -> str:
    """Name of a model with its n, if it has one."""
    return f"{row.model} at n = {row.n:g}" if np.isfinite(row.n) else f"the {row.model}".replace("the M", "M")


def row_cost(row: Row) -> tuple[int, ...]:
    """Cost of a row as a sort key."""
    return model_cost(row.model)


def model_cost(name: str) -> tuple[int, ...]:
    """Cost of a step of a model, or of the full order, as a sort key."""
    if name == FULL_ORDER:
        return (*FULL_ORDER_COST, 0)
    return (*cost(MODELS[name]), list(MODELS).index(name))


def export_command(answer: Answer, study: Study, files: Sequence[str] = ()) -> str:
    """Command line that exports the chosen model as C; an empty text if none was chosen.

    Parameters
    ----------
    answer : Answer
        Answer for one cylinder, with the chosen model.
    study : Study
        All cylinders of the configuration: where there are several, the command names the one.
    files : sequence of str
        Names of the configuration files; empty if they are not known.
    """
    if not answer.chosen:
        return ""
    contender, cylinder = answer.contender(answer.chosen), answer.ranking.cylinder
    name = contender.exported_name
    words = ["pneumo", "export", name]
    if np.isfinite(contender.row.n):
        words += ["--n", f"{contender.row.n:g}"]
    words += ["--to", "c"]
    for file in files or [UNKNOWN_FILE]:
        words += ["--config", file]
    if not files or len({e.cylinder for e in study.experiments.values()}) > 1:
        words += ["--cylinder", cylinder]
    k_0 = [e.plant.k_0 for e in study.experiments.values() if e.cylinder == cylinder]
    if len(set(k_0)) > 1:
        words += ["--k0", f"{k_0[0]:g}"]
    return shlex.join([*words, "-o", f"{name.lower()}.c"])


def _over(upper: np.ndarray, lower: np.ndarray) -> Interval:
    """Geometric mean of upper / lower over paired draws, with its 95 % interval."""
    if not (np.isfinite(upper).all() and (upper > 0).all() and (lower > 0).all()):
        return UNKNOWN
    return paired_ratio(upper, lower)


def _kpa(rms: float) -> str:
    return f"{float(f'{rms / 1e3:.2g}'):g} kPa"


def _error(row: Row) -> str:
    """Expected error with the interval in which 95 % of the drawn cylinders are."""
    return f"{_kpa(row.rms)} RMS ({_kpa(row.low)} to {_kpa(row.high)} in 95 % of cases)"


def _reason(budget: Budget, chosen: Row, good: Sequence[str], swing: float) -> str:
    """Sentences on the error of the chosen model and on those that are as good."""
    name = named(chosen)
    if budget.measured:
        errors = sorted(budget.measured.items(), key=lambda item: item[1])[:3]
        shown = ", ".join(f"{model} {_kpa(error)}" for model, error in errors)
        reason = f"On the part of the record that was held out: {shown}"
        reason += f". In simulation {name} has {_error(chosen)}"
        best = budget.rows[0]
        if chosen.rms**2 > (1 + MATERIAL) * best.rms**2:
            reason += f", {named(best)} {_kpa(best.rms)}: believe the measurement"
        return reason
    reason = f"Expected error {_error(chosen)}"
    reason += f", {100 * chosen.rms / swing:.2g} % of the pressures' swing of {_kpa(swing)}"
    if others := [other for other in good if other != chosen.model]:
        reason += f". As good within {100 * MATERIAL:.0f} %, but not cheaper: {', '.join(others)}"
    return reason


def _advice(cells: xr.Dataset, ranking: Ranking, budget: Budget, chosen: Row) -> list[str]:
    """Steps that would make the answer more certain, one line each."""
    lines: list[str] = []
    if budget.groups:
        group, lowest = budget.groups[0], budget.rows[0].rms
        known = budget.lowest_if_known(group)
        if known**2 * (1 + MATERIAL) < lowest**2:
            how = "another record" if budget.measured else "`pneumo fit`"
            lines.append(f"Measure the {group} first ({how}): {_kpa(lowest)} becomes {_kpa(known)}.")
    if chosen.model != FULL_ORDER and MODELS[chosen.model].temperature == "polytropic" and _has_wall(chosen):
        lines.append(f"{chosen.model} drifts to P_0 in a closed chamber: not for a piston held at rest.")
    columns = (cells[name].values for name in ("experiment", "duration", "time_constant"))
    lines += [
        f"Longer runs: {name} lasts less than ten thermal time constants, {time_constant:.3g} s each."
        for name, duration, time_constant in zip(*columns, strict=True)
        if duration < LONG_RUN * time_constant
    ]
    edges = {float(cells["n"].min()), float(cells["n"].max())} - {1.0, float(np.max(cells["gamma"]))}
    if chosen.n in edges:  # neither isothermal nor adiabatic
        lines.append(f"A wider grid: the best n of {chosen.model} is the first or last of the list n.")
    return [*lines, *_other_winners(ranking)]


def _has_wall(row: Row) -> bool:
    return MODELS[row.model].wall != "none"


def _other_winners(ranking: Ranking) -> list[str]:
    """Advice if another reduced model is best in an experiment than over all of them, if all is known."""
    winners = {
        name: min(rms, key=lambda model: np.nan_to_num(rms[model], nan=np.inf))
        for name, rms in ranking.by_experiment.items()
    }
    if {*winners.values()} == {ranking.rows[0].model}:
        return []
    listed = ", ".join(f"{model} in {name}" for name, model in winners.items())
    return [f"With everything known, the best reduced model is {listed}."]
