"""The answer of `pneumo study` for one cylinder: the row to take, or rows that its runs do not distinguish.

Rows are the reduced models, each at one n, and the full order. All take the assumed k_0; the error of a row
is that of its worst case over the range of k_0. Two rows are compared run by run.
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
from pneumo.selection.plants import AIR
from pneumo.statistics.intervals import UNKNOWN, Interval, paired_ratio
from pneumo.statistics.ranking import MATERIAL, Ranking, cost, rank_models
from pneumo.statistics.robust_choice import FULL_ORDER, RobustModel, UnknownConductance

# Beside `cost` of the models: it needs k_0, but no power; a step costs less than one of M5 to M10.
FULL_ORDER_COST = (1, 0, 0, 1)
MORE_SEEDS = 4  # times as many halve an interval
FIRST_SEEDS, MOST_SEEDS = 5, 1000  # after a single run; of `pneumo study`
UNKNOWN_FILE = "CONFIGURATION.yaml"  # in a command, where the name is not known
LONG_RUN = 10.0  # thermal time constants that a run should last: section 4's rule


class Contender(NamedTuple):
    """A candidate for a cylinder: a reduced model at one n, or the full order."""

    row: RobustModel
    over_chosen: (
        Interval  #: its worst mean square error over the chosen row's, geometric mean over paired runs
    )
    step: StepCost | None  #: None for a model added to the paper's

    @property
    def exported_name(self) -> str:
        """Name by which `pneumo export` knows the model."""
        return EXPORTED_FULL_ORDER if self.row.model == FULL_ORDER else self.row.model


class Answer(NamedTuple):
    """Which model to take for one cylinder, with the ranking from which this follows."""

    ranking: Ranking
    contenders: tuple[Contender, ...] = ()  #: lowest worst case first; empty if no run succeeded
    chosen: str = ""  #: cheapest row within 10 % of the lowest worst mean square error; empty if all failed
    tied: tuple[str, ...] = ()  #: rows whose interval over the chosen row's error contains 1
    compared: bool = False  #: whether rows were compared over several runs, or the signals are not random
    swing: float = np.nan  #: standard deviation of the pressures, Pa
    reason: str = ""
    advice: tuple[str, ...] = ()
    more_seeds: int = 0  #: runs of each experiment that may decide; 0 if these do, or if any tied row will do

    @property
    def recommended(self) -> str:
        """Name of the chosen model, if the runs distinguish it from all others; else an empty text."""
        return self.chosen if self.compared and not self.tied else ""

    @property
    def headline(self) -> str:
        """The answer in a few words: recommended, undecided or a tie."""
        if not self.chosen:
            return "Recommended: none"
        if self.recommended:
            return f"Recommended: {named(self.contender(self.chosen).row)}"
        if not self.compared:
            return f"Undecided by one run of a random signal: {named(self.contender(self.chosen).row)}"
        return f"Tie: {', '.join(named(self.contender(name).row) for name in (self.chosen, *self.tied))}"

    def contender(self, name: str) -> Contender:
        """The candidate of a model's name; "full" is the full order."""
        return next(contender for contender in self.contenders if contender.row.model == name)


def answers(cells: xr.Dataset) -> list[Answer]:
    """Answers for the cylinders in `cells` (from `cylinder_ranking.run_study`), in their order there."""
    names = dict.fromkeys(cells["cylinder"].values.tolist())
    return [answer(cells, name) for name in names]


def answer(cells: xr.Dataset, cylinder: str) -> Answer:
    """Choose the cheapest model whose worst case is not materially worse than the lowest worst case.

    Worst cases are over the range of k_0. Also lists the models that the runs cannot distinguish from it.
    `cells` is from `cylinder_ranking.run_study`.
    """
    ranking = rank_models(cells, cylinder)
    robust = ranking.unknown_k_0
    if robust is None:
        return Answer(ranking, reason="no full-order run succeeded")
    if not np.isfinite(robust.models[0].worst):
        return Answer(ranking, reason="every model failed in a run")
    kept = cells.sel(experiment=list(ranking.experiments))
    random = bool(kept["random"].any())
    kept = kept.sel(run=(kept["run_status"] == 0).all("experiment")) if random else kept.isel(run=[0])
    best = robust.rows[0]
    limit = (1 + MATERIAL) ** 0.5 * best.worst
    chosen = min((row for row in robust.rows if row.worst <= limit), key=row_cost)
    squares = {row.model: _worst_by_run(kept, row) for row in robust.rows}
    costs = step_costs()
    contenders = tuple(
        Contender(
            row,
            _over(squares[row.model], squares[chosen.model]),
            costs.get(EXPORTED_FULL_ORDER if row.model == FULL_ORDER else row.model),
        )
        for row in robust.rows
    )
    tied = tuple(
        row.model
        for row, over, _ in contenders
        if row != chosen and over.known and over.low <= 1 <= over.high
    )
    swing = float((kept["swing"] ** 2).mean()) ** 0.5 if "swing" in kept else np.nan
    more_seeds = _more_seeds([over for row, over, _ in contenders if row.model in tied], ranking.runs, random)
    return Answer(
        ranking=ranking,
        contenders=contenders,
        chosen=chosen.model,
        tied=tied,
        compared=ranking.runs > 1 or not random,
        swing=swing,
        reason=_reason(robust, chosen, tied, swing),
        advice=tuple(_advice(kept, ranking, robust, chosen, tied, more_seeds)),
        more_seeds=more_seeds,
    )


def named(row: RobustModel) -> str:
    """Name of a model with its n, if it has one."""
    return f"{row.model} at n = {row.n:g}" if np.isfinite(row.n) else row.model


def row_cost(row: RobustModel) -> tuple[int, ...]:
    """Cost of a row as a sort key: first the k_0 to be measured, then powers and terms to be computed."""
    if row.model == FULL_ORDER:
        return (*FULL_ORDER_COST, 0)
    return (*cost(MODELS[row.model]), list(MODELS).index(row.model))


def next_command(answer: Answer, study: Study, files: Sequence[str] = ()) -> str:
    """Command line of the next step: the study with more seeds where they may decide, else the export.

    Parameters are those of `export_command`.
    """
    if not answer.more_seeds:
        return export_command(answer, study, files)
    words, cylinder = ["pneumo", "study", *(files or [UNKNOWN_FILE])], answer.ranking.cylinder
    if not files or len({e.cylinder for e in study.experiments.values()}) > 1:
        words += ["--cylinder", cylinder]
    if {name for name, e in study.experiments.items() if e.cylinder == cylinder} > {
        *answer.ranking.experiments
    }:
        words += [word for name in answer.ranking.experiments for word in ("--experiment", name)]
    return shlex.join([*words, "--seeds", str(answer.more_seeds)])


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


def _worst_by_run(cells: xr.Dataset, row: RobustModel) -> np.ndarray:
    """Mean square error of a model in each run, Pa^2, shape (run,), in the model's worst case."""
    case, full = int(np.argmax(row.every)), row.model == FULL_ORDER
    if case >= len(row.rms):
        mse = cells["mse_of_full_order_off_plant" if full else "mse_of_off_plant"]
        mse = mse.isel(off_plant=case - len(row.rms))
    elif case == 1:
        mse = 0.0 * cells["mse_of_full_order"].isel(k_0_end=0) if full else cells["mse"]
    else:
        mse = cells["mse_of_full_order" if full else "mse_of_wrong_k_0"].isel(k_0_end=case // 2)
    if not full:
        mse = mse.sel(model=row.model, n=row.n if np.isfinite(row.n) else cells["n"][0])
    return mse.mean(("experiment", "chamber"), skipna=False).values


def _over(upper: np.ndarray, lower: np.ndarray) -> Interval:
    """Geometric mean of upper / lower over paired runs, with its 95 % interval.

    Not determined if an upper error is not finite; infinite if a lower error is zero.
    """
    if not np.isfinite(upper).all():
        return UNKNOWN
    if (lower > 0).all() and (upper > 0).all():
        return paired_ratio(upper, lower)
    return Interval(1.0, 1.0, 1.0) if np.array_equal(upper, lower) else Interval(np.inf, np.inf, np.inf)


def _more_seeds(tied: Sequence[Interval], runs: int, random: bool) -> int:
    """Number of seeds for a repetition that may decide; 0 if none is needed, or after `MOST_SEEDS` runs.

    No repetition is needed if the ratio of each tied row to the chosen one is known to be within 10 % of 1.
    """
    if random and runs < 2:
        return FIRST_SEEDS
    limit = 1 + MATERIAL
    if all(1 / limit <= over.low and over.high <= limit for over in tied) or runs >= MOST_SEEDS:
        return 0
    return min(MORE_SEEDS * runs, MOST_SEEDS)


def _kpa(rms: float) -> str:
    return f"{rms / 1e3:.3g} kPa"


def _range(robust: UnknownConductance) -> str:
    """Ranges in which k_0, valve and dead volumes are known, as a phrase."""
    if robust.factor == 1:
        k_0 = "at the given k_0"
    elif not np.isfinite(robust.k_0):
        k_0 = f"where k_0 is known within a factor of {robust.factor:.2g}"
    else:
        low, high = robust.k_0 / robust.factor, robust.k_0 * robust.factor
        k_0 = f"for k_0 from {low:.2g} to {high:.2g} W/K"
    others = [
        f"{words} within {100 * limit:.2g} %"
        for words, limit in (("the valve", robust.valve), ("dead volumes", robust.dead_volumes))
        if limit
    ]
    together = ", in every combination of their ends" if others else ""
    return " and ".join([", ".join([k_0, *others[:-1]]), *others[-1:]]) + together


def _reason(robust: UnknownConductance, chosen: RobustModel, tied: Sequence[str], swing: float) -> str:
    """Sentences with the errors of the chosen model and of those it is compared with.

    `swing` is the standard deviation of the pressures, Pa.
    """
    best = robust.rows[0]
    reason = f"{named(chosen) if tied else 'It'} has at most {_kpa(chosen.worst)} RMS error"
    if np.isfinite(swing):
        reason += f", {100 * chosen.worst / swing:.2g} % of the pressures' swing of {_kpa(swing)},"
    reason += f" {_range(robust)}"
    if tied:
        reason += f", and costs least; the runs do not tell {' and '.join(tied)} from it"
    elif chosen == best:
        reason += ": the lowest worst case"
    if chosen != best and best.model not in tied:
        needs = "" if _needs_k_0(chosen) else "needs no k_0 and "
        reason += (
            f"; it {needs}is the cheapest within {100 * MATERIAL:.0f} % of the lowest worst mean square"
            f" error, that of {best.model} ({_kpa(best.worst)} RMS)"
        )
    shown = {chosen.model, best.model, *tied}
    without_k_0 = [row for row in robust.models if not _needs_k_0(row)]
    for words, rows in (("Best reduced model", robust.models), ("Best without k_0", without_k_0)):
        rival = min(rows, key=lambda row: row.worst)
        if rival.model not in shown and np.isfinite(rival.worst):
            shown.add(rival.model)
            reason += f". {words}: {named(rival)}, at most {_kpa(rival.worst)}"
    return reason


def _needs_k_0(row: RobustModel) -> bool:
    return row.model == FULL_ORDER or MODELS[row.model].wall != "none"


def _advice(
    cells: xr.Dataset,
    ranking: Ranking,
    robust: UnknownConductance,
    chosen: RobustModel,
    tied: Sequence[str],
    more_seeds: int,
) -> list[str]:
    """Steps that would make the answer more certain, one line each."""
    first = ranking.rows[0]
    lines: list[str] = []
    names = ", ".join((chosen.model, *tied))
    if tied and more_seeds:
        lines.append(f"More seeds distinguish {names}: --seeds {more_seeds}.")
    elif tied:
        lines.append(
            f"Any of {names} will do: their worst mean square errors differ by less than"
            f" {100 * MATERIAL:.0f} %. {chosen.model} costs least."
        )
    elif more_seeds:
        lines.append(
            f"Repeat with several seeds (--seeds {more_seeds}): one run of a random signal has no intervals."
        )
    if chosen.model == FULL_ORDER:
        lines.append(
            "Confirm the full order on a measured record (pneumo fit): these runs are its own equations,"
            " with the configured friction. Its error here comes only from what is said not to be known."
        )
    elif robust.factor > 1 and max(chosen.rms) == chosen.worst:
        lines.append(_about_k_0(robust, chosen))
    if max(chosen.every) > max(chosen.rms):
        unknown = (("valve", robust.valve), ("dead volumes", robust.dead_volumes))
        names = " and ".join(name for name, limit in unknown if limit)
        lines.append(
            f"Measure {names}, above all (pneumo fit): known exactly, they leave at most"
            f" {_kpa(max(chosen.rms))} RMS instead of {_kpa(chosen.worst)}."
        )
    columns = (cells[name].values for name in ("experiment", "duration", "time_constant"))
    lines += [
        f"Longer runs: {name} lasts less than ten thermal time constants, {time_constant:.3g} s each."
        for name, duration, time_constant in zip(*columns, strict=True)
        if duration < LONG_RUN * time_constant
    ]
    gamma = float(np.max(cells.get("gamma", AIR.gamma)))  # not in cells of earlier code
    edges = {float(cells["n"].min()), float(cells["n"].max())} - {1.0, gamma}  # isothermal, adiabatic
    at_edge = {row.model: None for row in (chosen, first) if row.n in edges}
    if at_edge:
        lines.append(
            f"A wider grid: the best n of {' and '.join(at_edge)} is the first or last of the list n."
        )
    return [*lines, *_other_winners(ranking)]


def _about_k_0(robust: UnknownConductance, chosen: RobustModel) -> str:
    """Sentence that says whether measuring k_0 would reduce the error of the chosen reduced model."""
    if chosen.worst**2 > (1 + MATERIAL) * robust.known**2:
        return (
            "Measure k_0, above all: known exactly, with model and n chosen for it, it leaves at most"
            f" {_kpa(robust.known)} RMS instead of {_kpa(chosen.worst)}."
        )
    limit = f"{100 * MATERIAL:.0f} %"
    return f"k_0 is known well enough: knowing it exactly lowers the mean square error by less than {limit}."


def _other_winners(ranking: Ranking) -> list[str]:
    """Advice if the model ranked first is not the best in every experiment and by the geometric mean too."""
    winners = {
        name: min(rms, key=lambda model: np.nan_to_num(rms[model], nan=np.inf))
        for name, rms in ranking.by_experiment.items()
    }
    geometric = min(ranking.rows, key=lambda row: row.geometric_place).model
    if {*winners.values(), geometric} == {ranking.rows[0].model}:
        return []
    listed = ", ".join(f"{model} in {name}" for name, model in winners.items())
    return [
        f"Runs like those of your machine: of the reduced models with k_0 known, best are {listed}, and"
        f" {geometric} by the geometric mean over all runs; the largest errors dominate the arithmetic mean."
    ]
