"""The answer of `pneumo study` for one cylinder: which model to take, its expected error, advice.

Candidates are the reduced models, each at one n, and the full order. Their errors are those on cylinders
drawn from what is not known; after a fit, those on the part of the record that it did not see come first.
"""

import shlex
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from pneumo.configuration.experiment import Study
from pneumo.physics.models import FULL, MODELS
from pneumo.selection.cylinder_ranking import LONG_RUN
from pneumo.selection.error_budget import FULL_ORDER, NOISE, RECORD, Budget, Row
from pneumo.selection.ranking import MATERIAL, Ranking, cost, rank_models

ON_MEASURED_AIR = "1.5 to 2.6"  # kPa, RMS error of fitted full orders on parts held out: docs/measurements.md


class Answer(NamedTuple):
    """Which model to take for one cylinder, with the ranking from which this follows."""

    ranking: Ranking
    chosen: str = ""  #: cheapest model within 10 % of the lowest mean square error; empty if all failed
    as_good: tuple[str, ...] = ()  #: the other models within 10 %
    limits: str = ""  #: how well each quantity is known
    reason: str = ""
    advice: tuple[str, ...] = ()

    @property
    def budget(self) -> Budget:
        """Error budget of all models; `Answer` without a chosen model has none."""
        assert self.ranking.budget is not None
        return self.ranking.budget

    @property
    def rows(self) -> tuple[Row, ...]:
        """Candidates, lowest expected error first; empty if no model was chosen."""
        return self.budget.rows if self.chosen else ()

    @property
    def headline(self) -> str:
        """The answer in a few words."""
        return f"Take {named(self.budget.row(self.chosen))}" if self.chosen else "No model"


def answers(cells: xr.Dataset) -> list[Answer]:
    """Answers for the cylinders in `cells` (from `cylinder_ranking.run_study`), in their order there."""
    return [answer(cells, name) for name in dict.fromkeys(cells["cylinder"].values.tolist())]


def answer(cells: xr.Dataset, cylinder: str) -> Answer:
    """Choose the cheapest model whose expected mean square error is within 10 % of the lowest.

    After a fit, errors on the part of the record that was held out are compared; other models have none.
    Strokes into rest are reported beside it. `cells` is from `cylinder_ranking.run_study`.
    """
    ranking = rank_models(cells, cylinder)
    budget = ranking.budget
    if budget is None or ranking.table.empty:
        return Answer(ranking, reason="no full-order run succeeded")
    if not np.isfinite(budget.rows[0].rms):
        return Answer(ranking, reason="every model failed in a run")
    simulated = {row.model: row.rms for row in budget.rows}
    measured = {name: error for name, error in budget.measured.items() if np.isfinite(simulated[name])}
    good = _within(measured or simulated)
    chosen = budget.row(good[0])
    kept = cells.sel(experiment=list(ranking.experiments))
    return Answer(
        ranking=ranking,
        chosen=chosen.model,
        as_good=tuple(sorted(good[1:], key=lambda name: (measured or simulated)[name])),
        limits=str(kept["limits"][0].item()),
        reason=_reason(budget, chosen, good, float((kept["swing"] ** 2).mean()) ** 0.5),
        advice=tuple(_advice(kept, ranking, budget, chosen)),
    )


def _within(errors: Mapping[str, float]) -> list[str]:
    """Models whose mean square error is within 10 % of the lowest, cheapest first."""
    limit = (1 + MATERIAL) ** 0.5 * min(errors.values())
    return sorted((name for name, error in errors.items() if error <= limit), key=model_cost)


def named(row: Row) -> str:
    """Name of a model with its n, if it has one."""
    return f"{row.model} at n = {row.n:g}" if np.isfinite(row.n) else f"the {row.model}".replace("the M", "M")


def exported_name(model: str) -> str:
    """Name by which `pneumo export` knows a model or the full order."""
    return FULL.name if model == FULL_ORDER else model


def model_cost(name: str) -> tuple[int, ...]:
    """Cost of a step of a model, or of the full order, as a sort key.

    A step of the full order has no power and costs less than one of M5 to M10 (docs/export.md).
    """
    return (*cost(MODELS.get(name, FULL)), [*MODELS, FULL_ORDER].index(name))


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
    name, cylinder = exported_name(answer.chosen), answer.ranking.cylinder
    n = answer.budget.row(answer.chosen).n
    words = ["pneumo", "export", name]
    if np.isfinite(n):
        words += ["--n", f"{n:g}"]
    words += ["--to", "c"]
    for file in files or ["CONFIGURATION.yaml"]:
        words += ["--config", file]
    if not files or len({e.cylinder for e in study.experiments.values()}) > 1:
        words += ["--cylinder", cylinder]
    k_0 = [e.plant.k_0 for e in study.experiments.values() if e.cylinder == cylinder]
    if len(set(k_0)) > 1:
        words += ["--k0", f"{k_0[0]:g}"]
    return shlex.join([*words, "-o", f"{name.lower()}.c"])


def _kpa(rms: float) -> str:
    return f"{float(f'{rms / 1e3:.2g}'):g} kPa"


def _reason(budget: Budget, chosen: Row, good: Sequence[str], swing: float) -> str:
    """Sentences on the error of the chosen model and on those that are as good."""
    low, high = _kpa(chosen.low).removesuffix(" kPa"), _kpa(chosen.high)
    expected = f"{_kpa(chosen.rms)} RMS ({low} to {high} in 95 % of cases)"
    if budget.measured:
        errors = sorted(budget.measured.items(), key=lambda item: item[1])[:3]
        shown = ", ".join(f"{model} {_kpa(error)}" for model, error in errors)
        causes = f"the {budget.groups[0]} most of all" if budget.groups else "with everything known"
        return (
            f"Measured on the part of the record held out, with the sensors' noise: {shown}. What the fit"
            f" leaves unknown, {causes}, makes {expected} in simulation"
        )
    reason = f"Expected error {expected}, {100 * chosen.rms / swing:.2g} % of the pressures' swing"
    if np.isfinite(chosen.stroke):
        reason += f", {_kpa(chosen.stroke)} over strokes into rest"
    others = [row for row in budget.rows if row.model in good and row is not chosen]
    if others:
        within = f"within {100 * MATERIAL:.0f} % in mean square error and no faster on a microcontroller"
        reason += f". {_listed([row.model for row in others])} {within}"
    if any(row.stroke > (1 + MATERIAL) ** 0.5 * chosen.stroke for row in others):
        strokes = ", ".join(f"{row.model} {_kpa(row.stroke).removesuffix(' kPa')}" for row in others)
        reason += f"; into rest: {strokes} kPa"
    return reason


def _listed(names: Sequence[str]) -> str:
    """Names as the subject of a sentence, with its verb."""
    *first, last = names
    return f"{', '.join(first)} and {last} are" if first else f"{last} is"


def _advice(cells: xr.Dataset, ranking: Ranking, budget: Budget, chosen: Row) -> list[str]:
    """Steps that would make the answer more certain, and what it does not hold for, one line each."""
    lines: list[str] = []
    after, lowest = budget.after_record, budget.rows[0].rms
    largest_cause = budget.groups[0] if budget.groups else ""
    flow = cells["flow"][0].item() if "flow" in cells else ""
    if largest_cause == "dead volumes":
        lines.append("The dead volumes matter most: give dead_volume_m3 (with tubes), or fit.")
    if largest_cause == "valve" and flow:
        lines.append(f"The valve matters most: give its accuracy ({flow}), or fit.")
    if lowest**2 > after**2 + NOISE**2:  # what a record gains, sensors show
        lines.append(
            f"After a {RECORD:g} s record and a fit: {_kpa(after)} if the full order were exact; on public"
            f" records of real air, none with a servo valve, it was {ON_MEASURED_AIR} kPa."
        )
    both = {row.model: (row.rms**2 + row.stroke**2) ** 0.5 for row in budget.rows}
    if not np.isnan(chosen.stroke) and chosen.model not in (best := _within(both)):
        other = budget.row(best[0])
        change = f"for both take {named(other)}, {_kpa(other.rms)} and {_kpa(other.stroke)}"
        lines.append(f"Over full strokes into rest {chosen.model} has {_kpa(chosen.stroke)}: {change}.")
    elif chosen.model != FULL_ORDER:
        model = MODELS[chosen.model]
        if model.temperature == "polytropic" and model.wall != "none":
            lines.append(f"{model.name} drifts to P_0 in a closed chamber: not for a piston held at rest.")
    columns = (cells[name].values for name in ("experiment", "duration", "time_constant"))
    lines += [
        f"Longer runs: {name} lasts less than ten thermal time constants, {time_constant:.3g} s each."
        for name, duration, time_constant in zip(*columns, strict=True)
        if duration < LONG_RUN * time_constant
    ]
    edges = {float(cells["n"].min()), float(cells["n"].max())} - {1.0, float(np.max(cells["gamma"]))}
    if chosen.n in edges:  # neither isothermal nor adiabatic
        lines.append(f"A wider grid: the best n of {chosen.model} is the first or last of the list n.")
    winners = ranking.by_experiment.idxmin(axis="columns")
    if chosen.model != FULL_ORDER and {*winners} != {ranking.table.index[0]}:
        listed = ", ".join(f"{name} {model}" for name, model in winners.items())
        lines.append(f"Best reduced model by experiment if all is known: {listed}.")
    return lines
