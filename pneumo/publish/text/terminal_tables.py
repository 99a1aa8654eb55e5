"""Tables for the terminal; pages show the rows of some of them too."""

import math
from collections.abc import Iterable, Mapping, Sequence
from io import StringIO
from typing import Any

import numpy as np
from markupsafe import escape as html
from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from pneumo.configuration.experiment import Study
from pneumo.fitting.fit_result import AS_STATED, COMMANDS_END, FitResult, rms_of_chambers
from pneumo.publish.text.formatting import KILO, ends_text, no_exponent, significant, table_html
from pneumo.quantities.table import ALSO, CONFIGURED, FULL_ORDER, QUANTITIES, STARTS, VALVE
from pneumo.selection.answer import Answer, export_command
from pneumo.selection.error_budget import Row
from pneumo.selection.ranking import Ranking
from pneumo.statistics.intervals import Interval


def _table(
    title: str,
    heads: Iterable[str],
    rows: Iterable[Sequence[str]],
    bold: str = "",
    numbers: bool = False,
    gap: int = 2,
) -> Table:
    """Return a table; the row of the model `bold` is bold; `numbers` aligns all but models right."""
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, gap - 1, 0, 0))
    for head in heads:
        table.add_column(head, justify="right" if numbers and head != "model" else "left", no_wrap=True)
    for row in rows:
        table.add_row(*row, style="bold" if bold and bold in row else "")
    return table


WIDEST = 200  # columns


def print_table(table: Table, **options: Any) -> None:
    """Print a table with all its digits, also where it is wider than the terminal.

    `options` are those of `rich.console.Console`.
    """
    Console(width=WIDEST, **options).print(table)


# --- pneumo study ----------------------------------------------------------------------------------

STUDY_HEADS = ("rank", "model", "n", "RMS (kPa)", "MSE (kPa²)", "MSE / best", "A (kPa)", "B (kPa)")
BUDGET_TITLE = "RMS error (kPa): expected, 95 % interval, and the part of each cause"


def ranking_rows(ranking: Ranking) -> list[list[str]]:
    """Cells by `STUDY_HEADS`, a row per model, best first."""
    rows: list[list[str]] = []
    for model, cells in ranking.table.iterrows():
        row = {str(name): float(value) for name, value in cells.items()}
        if not np.isfinite(row["best_mse"]):
            rows.append(["–", str(model), "–", "–", f"failed in {row['failed']:g} runs", "–", "–", "–"])
            continue
        mse, half = row["best_mse"] / KILO**2, (row["best_mse_high"] - row["best_mse"]) / KILO**2
        over, known = no_exponent(row["over_best"]), ranking.runs > 1
        if row["place"] > 1 and known:
            over += f" ({no_exponent(row['over_best_low'])} to {no_exponent(row['over_best_high'])})"
        n = f"{row['best_n']:g}" if np.isfinite(row["best_n"]) else "–"
        error = f"{no_exponent(mse)} ± {no_exponent(half)}" if known else no_exponent(mse)
        chambers = (no_exponent(row[name] / KILO) for name in ("rms_A", "rms_B"))
        rows.append([f"{row['place']:g}", str(model), n, no_exponent(mse**0.5), error, over, *chambers])
    return rows


def budget_heads(answer: Answer) -> list[str]:
    """Headings of the error budget: the group that causes most of the error comes first."""
    measured = ["record"] if answer.budget.measured else []
    strokes = ["into rest"] if _strokes(answer) else []
    errors = ["all", "95\N{NO-BREAK SPACE}%", *answer.budget.groups, "model itself"]
    return ["model", "n", *measured, *errors, *strokes]


def _strokes(answer: Answer) -> bool:
    return any(np.isfinite(row.stroke) for row in answer.rows)


def budget_cells(row: Row, answer: Answer) -> list[str]:
    """Cells of a row, by `budget_heads`: RMS errors in kPa."""
    measured = answer.budget.measured

    def kpa(value: float) -> str:
        return f"{float(f'{value / KILO:.2g}'):g}" if np.isfinite(value) else "–"

    on_record = [kpa(measured.get(row.model, np.nan))] if measured else []
    parts = [kpa(row.part(group)) if row.known else "–" for group in answer.budget.groups]
    interval = f"{kpa(row.low)} to {kpa(row.high)}" if np.isfinite(row.rms) else "–"
    n = f"{row.n:g}" if np.isfinite(row.n) else ""
    strokes = [kpa(row.stroke)] if _strokes(answer) else []
    return [row.model, n, *on_record, kpa(row.rms), interval, *parts, kpa(row.own), *strokes]


def budget_table(answer: Answer) -> Table:
    """Error budget of one cylinder, lowest expected error first; the chosen model is bold."""
    rows = [budget_cells(row, answer) for row in answer.rows]
    heads = [head.replace(" ", "\n", 1) for head in budget_heads(answer)]
    table = _table(BUDGET_TITLE, heads, rows, answer.chosen, numbers=True)
    table.box = None
    return table


def study_text(answers: Sequence[Answer], study: Study, files: Sequence[str] = (), width: int = 80) -> str:
    """Answers of a study as text: model, error budget, advice, and the command that exports it.

    `study` has all cylinders of the configuration in `files`.
    """
    plain: dict[str, Any] = {"file": StringIO(), "color_system": None, "force_jupyter": False}
    console = Console(width=width, **plain)
    for answer in answers:
        console.print(f"{answer.ranking.cylinder}: {answer.headline}. {answer.reason}.", markup=False)
        if answer.rows:
            print_table(budget_table(answer), **plain)
        for advice in answer.advice:
            console.print(f"- {advice}", markup=False)
        if command := export_command(answer, study, files):
            console.print(f"Next: {command}", markup=False, soft_wrap=True)
        for reason in dict.fromkeys(answer.ranking.left_out):  # once, where all runs are the same
            console.print(f"Left out: {reason}.", markup=False)
    return "\n".join(line.rstrip() for line in plain["file"].getvalue().splitlines())


def answer_html(answer: Answer) -> str:
    """Answer for one cylinder, with its error budget and advice, for notebooks."""
    first = f"{answer.ranking.cylinder}: {answer.headline}."
    text = f"<p><strong>{html(first)}</strong> {html(answer.reason)}.</p>"
    if answer.rows:
        rows = [budget_cells(row, answer) for row in answer.rows]
        text += table_html(rows, budget_heads(answer), BUDGET_TITLE)
    return text + "".join(f"<p>{html(advice)}</p>" for advice in answer.advice)


# --- pneumo fit ------------------------------------------------------------------------------------

RANKED = "Ranked by rms error on the part held out; 95 % intervals"
ERRORS = ("rms held out (kPa)", "rms fitted (kPa)")


def shown_quantity(fit: FitResult, name: str) -> tuple[str, str, float]:
    """Heading, unit and factor from SI of a quantity; the valve as it was configured: k_x k_u or C."""
    if name == "k_xu" and fit.C_per_k_xu is not None:
        return "C", "dm³/(s bar)", fit.C_per_k_xu
    quantity = QUANTITIES[name]
    return quantity.heading, quantity.shown_unit, quantity.factor


def fitted_quantities(fit: FitResult) -> dict[str, tuple[str, str, float]]:
    """Heading, unit and factor from SI of each quantity in the table of a fit."""
    hidden = (*VALVE, *ALSO, *STARTS)
    names = [str(name) for name in fit.data["parameter"].values if name not in hidden]
    return {name: shown_quantity(fit, name) for name in names}


def parameter_heads(fit: FitResult) -> list[str]:
    """Headings of the parameters in the table of a fit, with their units."""
    return [f"{name} ({unit})" if unit else name for name, unit, _ in fitted_quantities(fit).values()]


def fit_heads(fit: FitResult) -> list[str]:
    """Headings of the table of a fit."""
    return ["law" if fit.closed else "model", *ERRORS, *parameter_heads(fit)]


def fit_rows(fit: FitResult) -> list[list[str]]:
    """Cells by `fit_heads`, a row per model, best first; an interval without limits is not determined."""
    rows = []
    for model in fit.models:
        part = fit.data.sel(model=model)
        row = [model]
        row += [f"{rms_of_chambers(part[name].values) / KILO:.3g}" for name in ("rms_held_out", "rms_fitted")]
        for parameter, (_, _, factor) in fitted_quantities(fit).items():
            cell = part.sel(parameter=parameter)
            best, low, high = (factor * cell[key].item() for key in ("estimate", "low", "high"))
            if np.isnan(best):
                row.append("")
            elif np.isnan([low, high]).all() and cell["at_bound"].item():
                row.append(f"{significant(best)} (on its bound)")
            else:
                row.append(f"{significant(best)} ({ends_text(low, high)})")
        rows.append(row)
    return rows


RIG_TITLE = (
    "Parameters of the rig, by the full order. Intervals include uncertain inputs.\n"
    "Green: determined. Yellow: wide, or a warning. Red: not determined.\n"
    "As stated: known from the configuration, to which the record adds little."
)
COLOURS = {AS_STATED: "cyan"}  # of lights whose name is none
RIG_HEADS = ("parameter", "light", "value (95 % interval)", "inputs", "mainly", "reason")


def rig_rows(fit: FitResult) -> list[list[str]]:
    """Cells by `RIG_HEADS` of the full order's parameters, and how far configured quantities move each."""
    rows: list[list[str]] = []
    headings = {QUANTITIES[name].name: QUANTITIES[name].heading for name in CONFIGURED}
    for name, (light, reason) in fit.judgements.items():
        cell = fit.data.sel(model=FULL_ORDER, parameter=name)
        heading, unit, factor = shown_quantity(fit, name)
        interval = Interval(*(factor * cell[key].item() for key in ("estimate", "low", "high")))
        # Not `formatting.ends_text`: these may be negative, and an end at zero is a limit.
        form = ".2g" if name in VALVE else ".4g" if name == "P_s" else ".3g"
        value = f"{_rounded(interval):{form}} ({interval.ends_text(form)})"
        row = [f"{heading} ({unit})" if unit else heading, light, value, "–", "–", reason]
        moved = factor * cell["moved_by"].values if "moved_by" in cell else np.full(1, np.nan)
        if np.isfinite(moved).all() and moved.any():
            largest = str(cell["quantity"].values[np.argmax(np.abs(moved))])
            row[3:5] = f"± {np.sqrt(moved @ moved):.2g}", headings.get(largest, largest).removeprefix("the ")
        rows.append(row)
        if name == "k_xu" and fit.C_per_k_xu is not None and reason.startswith(COMMANDS_END):
            part = fit.reached / fit.u_max
            row = [f"C at {fit.reached:.3g} V", "green", *row[2:-1], ""]
            row[2] = f"{part * interval.value:{form}} ({interval.scaled(part).ends_text(form)})"
            row[3] = f"± {part * np.sqrt(moved @ moved):.2g}" if row[3] != "–" else row[3]
            rows.append(row)
    return rows


def _rounded(interval: Interval) -> float:
    """Value of an interval to two digits of its half-width: one that is zero within it is short."""
    half = (interval.high - interval.low) / 2
    return round(interval.value, 1 - math.floor(math.log10(half))) + 0.0 if half > 0 else interval.value


def lights_text(rows: Sequence[Sequence[str]]) -> str:
    """How many of the `rig_rows` have each light, with the names of those that are yellow or red."""
    counts: list[str] = []
    for light in ("green", "yellow", "red", AS_STATED):
        names = [row[0].partition(" (")[0] for row in rows if row[1] == light]
        listed = f" ({', '.join(names)})" if light in ("yellow", "red") else ""
        counts += [f"{len(names)} {light}{listed}"] if names else []
    return ", ".join(counts)


def fit_tables(fit: FitResult) -> list[Table]:
    """Ranking with n and k_0, then valve and dead volumes, with 95 per cent intervals: 80 columns each.

    Then, where the full order was fitted, how far configured quantities move its parameters. Of closed
    chambers, every parameter of one law is a row.
    """
    heads, rows = [head.removeprefix("rms ").replace(" (", "\n(") for head in fit_heads(fit)], fit_rows(fit)
    if fit.closed:
        return [_laws_table(heads, rows), _law_table(fit)]
    parts = (RANKED, (0, 1, 2, 3, 4), 2), ("Valve and dead volumes", (0, 5, 6, 7), 1)
    return [
        _table(title, [heads[i] for i in columns], [[row[i] for i in columns] for row in rows], gap=gap)
        for title, columns, gap in parts
    ] + [full_order_table(rows) for rows in [rig_rows(fit)] if rows]


def _laws_table(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Table:
    """Errors of every law, and its n, or its k_0 of each chamber."""
    errors = 1 + len(ERRORS)
    shown = {"n": "n", "k_0 of A\n(W/K)": "A", "k_0 of B\n(W/K)": "B"}
    columns = [(shown[head], i) for i, head in enumerate(heads) if head in shown]
    laws = [[*row[:errors], "\n".join(f"{name} {row[i]}" for name, i in columns if row[i])] for row in rows]
    return _table(RANKED, (*heads[:errors], "n, or k_0 of A and B\n(W/K)"), laws)


def _law_table(fit: FitResult) -> Table:
    """Every parameter of the law whose parameters a configuration gets."""
    row = next(row for row in fit_rows(fit) if row[0] == fit.model_of_rig)
    heads = parameter_heads(fit)
    rows = [pair for pair in zip(heads, row[-len(heads) :], strict=True) if pair[1]]
    return _table(fit.model_of_rig, ("parameter", "value (95 % interval)"), rows)


def full_order_table(rows: Sequence[Sequence[str]]) -> Table:
    """Table of `rig_rows`, with the lights in their colours; below it the reasons of those not green."""
    *heads, _ = RIG_HEADS
    shown = ([row[0], f"[{COLOURS.get(row[1], row[1])}]{row[1]}[/]", *row[2:-1]] for row in rows)
    table = _table(RIG_TITLE, heads, shown)
    named: dict[str, list[str]] = {}
    for heading, *_, reason in rows:
        named.setdefault(reason, []).append(heading.partition(" (")[0])
    lines = [f"{', '.join(names)}: {escape(reason)}" for reason, names in named.items() if reason]
    table.caption, table.caption_justify = "\n".join(lines) or None, "left"
    return table


def validation_tables(errors: Mapping[str, np.ndarray]) -> list[Table]:
    """Table of RMS `errors` on another record: by fitted model, Pa, of chambers A and B; none if empty."""
    rows = [[name, *(f"{rms / KILO:.3g}" for rms in pair)] for name, pair in errors.items()]
    title = "Errors on the other record, of which only first pressures and temperatures were fitted"
    return [_table(title, ("model", "A (kPa)", "B (kPa)"), rows)] if rows else []
