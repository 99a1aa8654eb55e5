"""Tables for the terminal; pages show the rows of some of them too."""

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr
from rich import box
from rich.markup import escape
from rich.table import Table

from pneumo.fit.fit_result import ClosedChambersResult, FitResult, rms_of_chambers
from pneumo.fit.fitted_parameters import ALSO, CONFIGURED, FULL_ORDER, QUANTITIES, STARTS, VALVE
from pneumo.publish.text.formatting import KILO, ends_text, no_exponent, significant
from pneumo.selection.answer import Answer, Contender
from pneumo.statistics.intervals import CONFIDENCE, Interval
from pneumo.statistics.ranking import RankedModel

if TYPE_CHECKING:
    from pneumo.fit.closed.thermal_time_constant import Transient  # seconds of imports, for one table


def _table(
    title: str, heads: Iterable[str], rows: Iterable[Sequence[str]], bold: str = "", numbers: bool = False
) -> Table:
    """Return a table; the row of the model `bold` is bold; `numbers` aligns all but models right."""
    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for head in heads:
        table.add_column(head, justify="right" if numbers and head != "model" else "left", no_wrap=True)
    for row in rows:
        table.add_row(*row, style="bold" if bold and bold in row else "")
    return table


# --- pneumo study ----------------------------------------------------------------------------------

STUDY_HEADS = (
    *("rank", "model", "n", "RMS (kPa)", "MSE (kPa²)", "MSE / best", "geom.", "wins", "A (kPa)", "B (kPa)"),
)
IN_TERMINAL = len(STUDY_HEADS) - 2  # the chambers' RMS errors are on the page only
BUDGET_TITLE = (
    "RMS error (kPa) on cylinders drawn from what is not known: expected, 95 % interval, and the parts"
    " that each unknown and the model itself cause"
)


def ranking_cells(row: RankedModel) -> list[str]:
    """Cells of a model's row, by `STUDY_HEADS`."""
    if not np.isfinite(row.mse.value):
        return ["–", row.model, "–", "–", f"failed in {row.failed} runs", "–", "–", str(row.wins), "–", "–"]
    mse, _, high = (value / KILO**2 for value in row.mse)
    over = no_exponent(row.over_best.value)
    if row.place > 1 and row.over_best.known:
        over += f" ({no_exponent(row.over_best.low)} to {no_exponent(row.over_best.high)})"
    return [
        str(row.place),
        row.model,
        f"{row.n:g}" if np.isfinite(row.n) else "–",
        no_exponent(mse**0.5),
        f"{no_exponent(mse)} ± {no_exponent(high - mse)}" if row.mse.known else no_exponent(mse),
        over,
        str(row.geometric_place),
        str(row.wins),
        *(no_exponent(value / KILO) for value in row.rms),
    ]


def gain_text(percent: Interval) -> str:
    """Write the reduction of the error by a refinement, in per cent, with its interval."""
    if not np.isfinite(percent.value):
        return "–"
    interval = f" ({percent.low:.0f} to {percent.high:.0f})" if percent.known else ""
    return f"{percent.value:.0f} %{interval}"


def budget_heads(answer: Answer) -> list[str]:
    """Headings of the error budget: the group whose measurement helps most comes first."""
    measured = ["measured"] if answer.budget.measured else []
    return ["model", "n", *measured, "all together", "95 %", *answer.budget.groups, "model itself"]


def budget_cells(contender: Contender, answer: Answer) -> list[str]:
    """Cells of a row, by `budget_heads`: RMS errors in kPa."""
    row, measured = contender.row, answer.budget.measured

    def kpa(value: float) -> str:
        return f"{value / KILO:.2g}" if np.isfinite(value) else "–"

    on_record = [kpa(measured.get(row.model, np.nan))] if measured else []
    parts = [kpa(row.part(group)) if row.known else "–" for group in answer.budget.groups]
    interval = f"{kpa(row.low)} to {kpa(row.high)}" if np.isfinite(row.rms) else "–"
    n = f"{row.n:g}" if np.isfinite(row.n) else ""
    return [row.model, n, *on_record, kpa(row.rms), interval, *parts, kpa(row.own)]


def budget_table(answer: Answer) -> Table:
    """Error budget of one cylinder, lowest expected error first; the chosen model is bold."""
    rows = [budget_cells(contender, answer) for contender in answer.contenders]
    heads = [head.replace(" ", "\n") for head in budget_heads(answer)]
    table = _table("", heads, rows, answer.chosen, numbers=True)
    table.title, table.box = None, None
    return table


def study_tables(answer: Answer) -> list[Table]:
    """Ranking of the models if everything is known, and gain of each refinement, of one cylinder."""
    ranking = answer.ranking
    intervals = f"intervals {100 * CONFIDENCE:.0f} % over seeds"
    title = f"{ranking.cylinder}: {', '.join(ranking.experiments)}, {ranking.runs} runs each; {intervals}"
    title += "; everything known"
    rows = (ranking_cells(row)[:IN_TERMINAL] for row in ranking.rows)
    gains = ((g.refinement, f"{g.without} to {g.refined}", gain_text(g.percent)) for g in ranking.gains)
    return [
        _table(title, STUDY_HEADS[:IN_TERMINAL], rows, answer.chosen, numbers=True),
        _table("Reduction of the MSE", ("refinement", "models", "gain"), gains),
    ]


# --- pneumo fit ------------------------------------------------------------------------------------

RANKED = "Ranked by rms error on the part held out; 95 % intervals"
ERRORS = ("rms held out (kPa)", "rms fitted (kPa)")


def fitted_quantities(fit: FitResult) -> dict[str, tuple[str, str, float]]:
    """Heading, unit and factor from SI of each quantity in the table of a fit.

    The valve is shown as it was configured: k_x k_u or C.
    """
    names = [name for name in fit.data["parameter"].values if name not in (*VALVE, *ALSO, *STARTS)]
    looks = {name: (q.heading, q.shown_unit, q.factor) for name in names for q in [QUANTITIES[name]]}
    if "k_xu" in looks and fit.C_per_k_xu is not None:
        looks["k_xu"] = ("C", "dm³/(s bar)", fit.C_per_k_xu)
    return looks


def fit_heads(fit: FitResult) -> list[str]:
    """Headings of the table of a fit."""
    names = (f"{name} ({unit})" if unit else name for name, unit, _ in fitted_quantities(fit).values())
    return ["law" if isinstance(fit, ClosedChambersResult) else "model", *ERRORS, *names]


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
            ends = ends_text(low, high) if low != 0 else f"0 to {significant(high)}"  # no leakage is an end
            row.append("" if np.isnan(best) else f"{significant(best)} ({ends})")
        rows.append(row)
    return rows


RIG_TITLE = (
    "The rig, by the full order: intervals allow for errors of the configuration.\n"
    "Green: determined. Yellow: wide, or warned of. Red: not determined."
)
RIG_HEADS = ("of the rig", "light", "95 % interval", "moves by", "mostly by", "because")


def rig_rows(fit: FitResult) -> list[list[str]]:
    """Cells by `RIG_HEADS` of the full order's parameters, and how far configured quantities move each."""
    rows: list[list[str]] = []
    looks, reasons = fitted_quantities(fit), fit.reasons
    headings = {QUANTITIES[name].name: QUANTITIES[name].heading for name in CONFIGURED}
    for name, light in fit.lights.items():
        quantity, cell = QUANTITIES[name], fit.data.sel(model=FULL_ORDER, parameter=name)
        heading, unit, factor = looks.get(name, (quantity.heading, quantity.shown_unit, quantity.factor))
        interval = Interval(*(factor * cell[key].item() for key in ("estimate", "low", "high")))
        # Not `formatting.ends_text`: these may be negative, and an end at zero is a limit.
        form = ".2g" if name in VALVE else ".4g" if name == "P_s" else ".3g"
        value = f"{interval.value:{form}} ({interval.ends_text(form)})"
        row = [f"{heading} ({unit})" if unit else heading, light, value, "–", "–", reasons.get(name, "")]
        moved = factor * cell["moved_by"].values if "moved_by" in cell else np.full(1, np.nan)
        if np.isfinite(moved).all() and moved.any():
            largest = str(cell["quantity"].values[np.argmax(np.abs(moved))])
            row[3:5] = f"± {np.sqrt(moved @ moved):.2g}", headings.get(largest, largest).removeprefix("the ")
        rows.append(row)
    return rows


def fit_tables(fit: FitResult) -> list[Table]:
    """Ranking with n and k_0, then valve and dead volumes, with 95 per cent intervals: 80 columns each.

    Then, where the full order was fitted, how far configured quantities move its parameters.
    """
    if isinstance(fit, ClosedChambersResult):
        return closed_tables(fit)
    heads, rows = [head.removeprefix("rms ").replace(" (", "\n(") for head in fit_heads(fit)], fit_rows(fit)
    return [
        _table(title, [heads[i] for i in columns], [[row[i] for i in columns] for row in rows])
        for title, columns in ((RANKED, (0, 1, 2, 3, 4)), ("Valve and dead volumes", (0, 5, 6, 7)))
    ] + [full_order_table(rows) for rows in [rig_rows(fit)] if rows]


def full_order_table(rows: Sequence[Sequence[str]]) -> Table:
    """Table of `rig_rows`, with the lights in their colours; below it the reasons of those not green."""
    *heads, _ = RIG_HEADS
    shown = ([row[0], f"[{row[1]}]{row[1]}[/]", *row[2:-1]] for row in rows)
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


def closed_tables(fit: FitResult) -> list[Table]:
    """Ranking of thermal laws with n or k_0, then every parameter of the law used for the configuration."""
    law, heads, rows = fit.model_of_rig, fit_heads(fit), fit_rows(fit)
    ranking: list[list[str]] = []
    for row in rows:
        n, k_0 = (row[heads.index(head)] for head in ("n", "k_0 (W/K)"))
        ranking.append([*row[:3], f"n   {n}" if n else f"k_0 {k_0}" if k_0 else ""])
    chosen = next(row for row in rows if row[0] == law)
    parameters = [cells for cells in zip(heads[3:], chosen[3:], strict=True) if cells[1]]
    return [
        _table(RANKED, ("law", "held out\n(kPa)", "fitted\n(kPa)", "n, or k_0 (W/K)"), ranking),
        _table(law, ("", "95 % interval"), parameters),
    ]


def wall_text(fit: ClosedChambersResult) -> str:
    """Conventions of a fit of closed chambers."""
    T, P = fit.T_wall, fit.P_0 / KILO
    return (
        f"mean k: of the part fitted; k_0: at {P:.4g} kPa, {T:.5g} K and mid-stroke by the law of the row.\n"
        f"Assumed for the wall: {T:.5g} K; every k scales with its inverse, predictions do not depend on it"
    )


def transient_text(transient: "Transient") -> str:
    """Conductance from the transient of a closed chamber, on three lines."""
    tau = ends_text(transient.tau_low, transient.tau_high)
    k_0 = f"{significant(transient.k_0)} W/K ({ends_text(transient.k_0_low, transient.k_0_high)})"
    return (
        f"thermal time constant  {significant(transient.tau)} s ({tau})\n"
        f"k_av = m c_v / tau     {significant(transient.k_av)} W/K, at {transient.P_inf / KILO:.4g} kPa\n"
        f"k_0, square-root law   {k_0}; rms residual {transient.rms:.3g} Pa"
    )


# --- pneumo rig ------------------------------------------------------------------------------------


RIG_ERRORS = ("model", *ERRORS, "temperature (K)")
RIG_ESTIMATES = ("model", "parameter", "estimate", "95 % interval")
ON_BOUND = "on its bound"
NONE = 1e-9  # estimate, in the unit of its key, that is 0: the smallest of a rig's file is 1e-6
SIGNED = ("valve_opening_delay_ms", "valve_closing_delay_ms")  # whose ends may be negative


def rig_cells(result: xr.Dataset) -> tuple[list[list[str]], list[list[str]]]:
    """Rows of `RIG_ERRORS`, best first, and of `RIG_ESTIMATES`, from `judged_models`."""
    errors: list[list[str]] = []
    estimates: list[list[str]] = []
    for name in result["model"].values[np.argsort(result["held_out"].values)]:
        row = result.sel(model=name)
        of_pressure = [significant(row[error].item() / KILO) for error in ("held_out", "fitted")]
        T = row["T_error"].item()
        errors.append([str(name), *of_pressure, significant(T) if np.isfinite(T) else "–"])
        for parameter in result["parameter"].values:
            value, low, high = (
                row[key].sel(parameter=parameter).item() for key in ("estimate", "low", "high")
            )
            if np.isfinite(value):
                if np.isnan(low) and np.isnan(high):
                    ends = ON_BOUND
                elif parameter in SIGNED and np.isfinite(high - low):
                    ends = f"{significant(low)} to {significant(high)}"
                else:
                    ends = ends_text(low, high)
                number = significant(value) if abs(value) > NONE else "0"
                estimates.append([str(name), str(parameter), number, ends])
    return errors, estimates


def rig_tables(result: xr.Dataset) -> list[Table]:
    """Tables of `rig_cells`: 80 columns."""
    errors, estimates = rig_cells(result)
    return [
        _table("RMS errors", RIG_ERRORS, errors),
        _table("Estimates", RIG_ESTIMATES, estimates),
    ]
