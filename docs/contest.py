"""Numbers and tables of the full order in the contest, for which-model.md: paper/decisions/0075."""

import numpy as np
import xarray as xr
from fragments import table

from pneumo.evidence.random_cylinders.contest_statistics import (
    BEFOREHAND,
    LIMIT,
    answer,
    best_in_hindsight,
    row_of,
    runs_counted,
)
from pneumo.physics.models import MODELS
from pneumo.publish.text.formatting import percent_text, span_text, with_interval
from pneumo.publish.text.todays_answer import (
    by_mean_error,
    full_over_beforehand,
    k_0_in_words,
    rule_text,
)

LOOPS = ("open", "closed")
FULL = {law: f"full order, {law} law" for law in ("true", "constant")}
ADIABATIC = "full order, adiabatic"
LOW, HIGH = 1 / 2.7, 2.7  # k_0 told, over the cylinder's
TOLD = {LOW: "2.7 times too small", 1.0: "right", HIGH: "2.7 times too large"}
WRONG_VALVES = (0.97, 1.03)
ROWS = {  # words of the table -> choice, and whether it is told k_0
    "full order, the wall's law as in the plant": (FULL["true"], True),
    "full order, constant k_0": (FULL["constant"], True),
    "full order without wall heat": (ADIABATIC, False),
    "model and n from a simulation (`pneumo study`)": (BEFOREHAND, True),
    "M6, n from a simulation": ("M6, n of a simulation", True),
    "M8, n from a simulation": ("M8, n of a simulation", True),
    "M6, n by the rule below": ("M6 by rule", True),
    "M8, n by the rule below": ("M8 by rule", True),
    "M6 at n = 1.35": ("M6 at 1.35", False),
    "M8 at n = 1.35": ("M8 at 1.35", True),
    "M1": ("M1 at 1.35", False),
}


def error(row: xr.Dataset | None, part: str) -> str:
    """Error over the best's in hindsight, with its interval."""
    return "" if row is None else with_interval(row["error"].sel(part=part).values)


def choices_table(contest: xr.Dataset) -> str:
    """Every choice with the valve known, by loop."""
    rows = []
    for words, (choice, told) in ROWS.items():
        for k_0, told_words in TOLD.items() if told else {1.0: "not needed"}.items():
            row = row_of(contest, choice, k_0)
            if row is None:
                continue
            cells = [error(row, loop) for loop in LOOPS]
            cells += [percent_text(row["within"].sel(part="all").item())]
            cells += [f"{row['nine_tenths'].sel(part='all').item():.2f}"]
            cells += [percent_text(row["of_swing"].sel(part="all").item(), 1)]
            rows.append([words, told_words, *cells])
    head = [
        "choice",
        "k_0 told",
        "open loop",
        "closed loop",
        "within 10 %",
        "nine in ten below",
        "RMS of swing",
    ]
    return table(head, rows)


def valve_table(contest: xr.Dataset) -> str:
    """The same with the valve's coefficient off by 3 per cent; k_0 right."""
    rows = []
    for words, (choice, _told) in ROWS.items():
        made = [row_of(contest, choice, 1.0, valve) for valve in (0.97, 1.0, 1.03)]
        if made[0] is not None:
            rows.append([words, *(error(row, "all") for row in made)])
    return table(["choice", "told 3 % too small", "right", "told 3 % too large"], rows)


def quotient_table(contest: xr.Dataset) -> str:
    """The full order over the choice beforehand with the same knowledge, by part of the runs."""
    parts = [part for part in contest["part"].values if part != "all"]
    rows = []
    for i in range(contest.sizes["case"]):
        at = contest.isel(case=i)
        k_0, valve = at["case_k_0"].item(), at["case_valve"].item()
        if not any(np.isclose(k_0, list(TOLD))):
            continue
        told = TOLD[min(TOLD, key=lambda value: abs(value - k_0))]
        cells = [with_interval(at["full_quotient"].sel(part=part).values) for part in parts]
        rows.append([at["full"].item().removeprefix("full order, "), told, f"{valve:g}", *cells])
    return table(["full order", "k_0 told", "valve told", *parts], rows)


def paper_quotients(contest: xr.Dataset) -> dict[str, np.ndarray]:
    """The full order over the choice beforehand, same knowledge, in each of the paper's experiments."""
    cases = {words: (FULL["constant"], k_0, 1.0) for k_0, words in TOLD.items()}
    cases |= {"without wall heat": (ADIABATIC, 1.0, 1.0)}
    cases |= {f"valve told {valve:g} times": (FULL["constant"], 1.0, valve) for valve in WRONG_VALVES}
    quotients = {}
    for words, (choice, k_0, valve) in cases.items():
        full, beforehand = row_of(contest, choice, k_0, valve), row_of(contest, BEFOREHAND, k_0, valve)
        assert full is not None and beforehand is not None
        quotients[words] = (full["paper_error"] / beforehand["paper_error"]).values
    return quotients


def paper_table(contest: xr.Dataset) -> str:
    """The paper's experiments, each by itself."""
    quotients = paper_quotients(contest)
    rows = [
        [name, *(f"{column[i]:.2g}" for column in quotients.values())]
        for i, name in enumerate(contest["experiment"].values)
    ]
    return table(["experiment", *quotients], rows)


def tables(contest: xr.Dataset) -> dict[str, str]:
    """Tables of the page by name."""
    return {
        "choices": choices_table(contest),
        "valve": valve_table(contest),
        "quotients": quotient_table(contest),
        "paper": paper_table(contest),
    }


def _of_cases(contest: xr.Dataset, valve_right: bool) -> xr.Dataset:
    right = np.isclose(contest["case_valve"], 1.0)
    told = ~contest["full"].str.contains("adiabatic").values
    return contest.isel(case=np.flatnonzero((right == valve_right) & told))


def turns(contest: xr.Dataset) -> dict[str, str]:
    """The full order with constant k_0 told too large over the choice beforehand, where it is not ahead."""
    cases = full_over_beforehand(contest, True)
    at = cases.isel(case=int(np.argmax(cases["case_k_0"].values)))
    parts = {"full_middle_third": "middle third", "full_not_cut": "not cut"}
    return {name: with_interval(at.sel(part=part).values) for name, part in parts.items()}


def median_quotients(contest: xr.Dataset) -> list[float]:
    """Medians of the full order's error, both laws, over the choice's with the same knowledge, by loop.

    The valve is right.
    """
    counted = runs_counted(contest)
    at = contest.sel(valve_told=1.0)
    quotients = at["mse_full"] / at["mse_simulated"].sel(carried="best")
    medians = [quotients.where(counted[loop]).median(("cylinder", "loop")).values for loop in LOOPS]
    return np.array(medians).ravel().tolist()


def classical_best(contest: xr.Dataset) -> float:
    """Fraction of the held-out runs in which one of M1 to M4 is below the best of M5 to M10 in hindsight."""
    counted = runs_counted(contest)["all"]
    below = best_in_hindsight(contest, tuple(MODELS)[:4]) < best_in_hindsight(contest)
    return float((below & counted).sum() / counted.sum())


def lowest_of_all(contest: xr.Dataset) -> float:
    """Lowest error of all reduced models, n and k_0 told, over the best's of M5 to M10 at the true k_0."""
    counted = runs_counted(contest)["all"]
    lowest = np.minimum(
        contest["mse_without_k_0"].min(("model_without_k_0", "n")),
        contest["mse_with_k_0"].min(("model_with_k_0", "n", "k_0_told")),
    )
    return float(np.exp(np.log(lowest / best_in_hindsight(contest)).where(counted).mean()))


def numbers(contest: xr.Dataset) -> dict[str, str]:
    """Numbers of the page by name."""
    known, wrong = _of_cases(contest, True), _of_cases(contest, False)
    loops = known["full_quotient"].sel(part=list(LOOPS))
    off = wrong["full_quotient"].sel(part=list(LOOPS))

    def error_text(choice: str, k_0: float = 1.0, part: str = "all") -> str:
        return error(row_of(contest, choice, k_0), part)

    worst = known.isel(case=int(np.argmax(loops.sel(bound="high").max("part").values)))
    not_below = int((off.sel(bound="high") >= LIMIT).sum())
    return {
        "answer": answer(contest),
        "held_out": f"{contest['cylinders'].sel(part='all').item()}",
        "cylinders": f"{contest.sizes['cylinder']}",
        "full_quotient": span_text(loops.sel(bound="value").values),
        "full_quotient_most": f"{loops.sel(bound='high').max().item():.2f}",
        "full_quotient_worst": f"{worst['full'].item()}, {k_0_in_words(worst['case_k_0'].item())}",
        "full_quotient_wrong_valve": span_text(off.sel(bound="value").values),
        "experiments": f"{contest.sizes['experiment']}",
        "paper_low_worse": f"{int((paper_quotients(contest)[TOLD[LOW]] > 1).sum())}",
        "paper_high_worse": f"{int((paper_quotients(contest)[TOLD[HIGH]] > 1).sum())}",
        "paper_high_most": f"{paper_quotients(contest)[TOLD[HIGH]].max():.1f}",
        "wrong_valve_cases": f"{off.sel(bound='high').size}",
        "wrong_valve_not_below": f"{not_below}",
        **turns(contest),
        "by_mean_error": by_mean_error(contest, HIGH),
        "lowest_of_all": f"{lowest_of_all(contest):.2f}",
        "full_median_most": f"{max(median_quotients(contest)):.2f}",
        "classical_best": percent_text(classical_best(contest)).removesuffix(" %"),
        "simulated": error_text(BEFOREHAND),
        "simulated_low": error_text(BEFOREHAND, LOW),
        "simulated_high": error_text(BEFOREHAND, HIGH),
        **{f"adiabatic_{loop}": error_text(ADIABATIC, part=loop) for loop in LOOPS},
        "adiabatic_low_third": error_text(ADIABATIC, part="lowest third"),
        "M6_rule": error_text("M6 by rule"),
        "M8_rule": error_text("M8 by rule"),
        "M6_configured": error_text("M6 at 1.35"),
        "M8_configured": error_text("M8 at 1.35"),
        "direct_rule": error_text("rule of decision 57"),
        **{f"n_{model}": rule_text(contest, model) for model in contest["ruled"].values},
    }
