"""Tables for the terminal; pages show the rows of some of them too."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from rich import box
from rich.table import Table

from pneumo.publish.text.formatting import KILO, ends_text, no_exponent, significant
from pneumo.statistics.intervals import CONFIDENCE, Interval
from pneumo.statistics.model_pairs import CRITERIA
from pneumo.statistics.ranking import RankedModel, Ranking
from pneumo.statistics.robust_choice import RobustModel, UnknownConductance

if TYPE_CHECKING:
    from pneumo.fit.closed.thermal_time_constant import Transient  # seconds of imports, for one table

# --- pneumo study ----------------------------------------------------------------------------------

STUDY_HEADS = (
    *("rank", "model", "n", "RMS (kPa)", "MSE (kPa²)", "MSE / best", "geom.", "wins", "A (kPa)", "B (kPa)"),
)
IN_TERMINAL = len(STUDY_HEADS) - 2  # the chambers' RMS errors are on the page only


ROBUST_TITLE = "RMS error (kPa) if the cylinder's k_0 is another than the models'; n for the worst case"


def ranking_cells(row: RankedModel) -> list[str]:
    """Cells of a model's line, by `STUDY_HEADS`."""
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
    """Write what a refinement takes from the error, in per cent, with its interval."""
    if not np.isfinite(percent.value):
        return "–"
    interval = f" ({percent.low:.0f} to {percent.high:.0f})" if percent.known else ""
    return f"{percent.value:.0f} %{interval}"


def robust_heads(robust: UnknownConductance) -> list[str]:
    """Headings of the worst cases: the cylinder's k_0 over the assumed one, or both in W/K."""
    values = [robust.k_0 * scale for scale in (1 / robust.factor, 1.0, robust.factor)]
    if np.isfinite(robust.k_0):
        return ["model", "n", *(f"k_0 = {value:.2g} W/K" for value in values), "worst"]
    return ["model", "n", f"k_0 / {robust.factor:.2g}", "k_0", f"{robust.factor:.2g} k_0", "worst"]


def robust_cells(row: RobustModel) -> list[str]:
    """Cells of a model's line, by `robust_heads`: RMS errors in kPa."""
    errors = [no_exponent(value / KILO) if np.isfinite(value) else "–" for value in (*row.rms, row.worst)]
    return [row.model, f"{row.n:g}" if np.isfinite(row.n) else "–", *errors]


def study_tables(ranking: Ranking) -> list[Table]:
    """Ranking of the models, their worst cases, and gain of each refinement, of one cylinder."""
    experiments, confidence = ", ".join(ranking.experiments), f"{100 * CONFIDENCE:.0f} %"
    title = f"{ranking.cylinder}: {experiments}, {ranking.runs} runs each; intervals {confidence} over seeds"
    looks: dict[str, Any] = {"title_justify": "left", "box": box.SIMPLE_HEAD}
    table = Table(title=title, padding=(0, 1, 0, 0), **looks)
    for head in STUDY_HEADS[:IN_TERMINAL]:
        table.add_column(head, justify="left" if head == "model" else "right")
    for row in ranking.rows:
        style = "bold" if row.model == ranking.recommended else ""
        table.add_row(*ranking_cells(row)[:IN_TERMINAL], style=style)
    gains = Table("refinement", "models", "gain", title="Taken from the MSE", **looks)
    for gain in ranking.gains:
        gains.add_row(gain.refinement, f"{gain.without} to {gain.refined}", gain_text(gain.percent))
    if ranking.unknown_k_0 is None:
        return [table, gains]
    worst = Table(title=ROBUST_TITLE, padding=(0, 1, 0, 0), **looks)
    for head in robust_heads(ranking.unknown_k_0):
        worst.add_column(head, justify="left" if head == "model" else "right")
    for row in ranking.unknown_k_0.models:
        worst.add_row(*robust_cells(row), style="bold" if row.model == ranking.recommended else "")
    return [table, gains, worst]


# --- pneumo fit ------------------------------------------------------------------------------------

RANKED = "Ranked by rms error on the part held out; 95 % intervals"
ERRORS = ("rms held out (kPa)", "rms fitted (kPa)")
FITTED = {  # parameter -> heading, unit, factor from SI
    "n": ("n", "", 1.0),
    "k_0": ("k_0", "W/K", 1.0),
    "k_xu": ("k_x k_u", "mm²/V", 1e6),
    "V_d_A": ("V_d of A", "cm³", 1e6),
    "V_d_B": ("V_d of B", "cm³", 1e6),
    # Of closed chambers:
    "k_0_A": ("k_0 of A", "W/K", 1.0),
    "k_0_B": ("k_0 of B", "W/K", 1.0),
    "k_A": ("mean k of A", "W/K", 1.0),
    "k_B": ("mean k of B", "W/K", 1.0),
    "leak": ("leakage A to B", "mg/(s bar)", 1e11),
    "T_A": ("first T of A", "K", 1.0),
    "T_B": ("first T of B", "K", 1.0),
}


def fitted_parameters(fit: xr.Dataset) -> dict[str, tuple[str, str, float]]:
    """Heading, unit and factor from SI of each parameter of a fit that is shown.

    The valve is shown as it was configured: k_x k_u, or C where the fit's attribute has C over k_x k_u.
    """
    looks = {name: look for name, look in FITTED.items() if name in fit["parameter"].values}
    if "k_xu" in looks and "C_per_k_xu" in fit.attrs:
        looks["k_xu"] = ("C", "dm³/(s bar)", fit.attrs["C_per_k_xu"])
    return looks


def fit_heads(fit: xr.Dataset) -> list[str]:
    """Headings of the table of a fit."""
    names = (f"{name} ({unit})" if unit else name for name, unit, _ in fitted_parameters(fit).values())
    return ["law" if "closed_chambers" in fit.attrs else "model", *ERRORS, *names]


def rms_of_chambers(by_chamber: xr.DataArray) -> float:
    """Root mean square over both chambers of their RMS errors, in the same unit."""
    return float(np.sqrt(np.nanmean(by_chamber.values**2)))


def fit_rows(fit: xr.Dataset) -> list[list[str]]:
    """Cells by `fit_heads`, a row per model, best first; an end that the data do not limit is open."""
    rows = []
    for model in fit["model"].values:
        part = fit.sel(model=model)
        row = [str(model)]
        row += [f"{rms_of_chambers(part[name]) / KILO:.3g}" for name in ("rms_held_out", "rms_fitted")]
        for parameter, (_, _, factor) in fitted_parameters(fit).items():
            one = part.sel(parameter=parameter)
            best, low, high = (factor * one[key].item() for key in ("estimate", "low", "high"))
            ends = ends_text(low, high) if low != 0 else f"0 to {significant(high)}"  # no leakage is an end
            row.append("" if np.isnan(best) else f"{significant(best)} ({ends})")
        rows.append(row)
    return rows


def fit_tables(fit: xr.Dataset) -> list[Table]:
    """Ranking with n and k_0, then valve and dead volumes, with 95 per cent intervals: 80 columns each."""
    if "closed_chambers" in fit.attrs:
        return closed_tables(fit)
    places = (0, 1, 2, 3, 4), (0, 5, 6, 7)
    heads, tables = fit_heads(fit), list[Table]()
    for title, columns in zip((RANKED, "Valve and dead volumes"), places, strict=True):
        table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
        for place in columns:
            head = heads[place].removeprefix("rms ").replace(" (", "\n(")
            table.add_column(head, no_wrap=True)
        for row in fit_rows(fit):
            table.add_row(*(row[place] for place in columns))
        tables.append(table)
    return tables


def closed_tables(fit: xr.Dataset) -> list[Table]:
    """Ranking of thermal laws with n or k_0, then every parameter of the one for the configuration."""
    from pneumo.fit.fitted_yaml import row_of_the_rig  # seconds of imports, for one table

    looks: dict[str, Any] = {"title_justify": "left", "box": box.SIMPLE_HEAD, "padding": (0, 1, 0, 0)}
    ranking = Table("law", "held out\n(kPa)", "fitted\n(kPa)", "n, or k_0 (W/K)", title=RANKED, **looks)
    table, law, heads = Table(title=row_of_the_rig(fit), **looks), row_of_the_rig(fit), fit_heads(fit)
    table.add_column("")
    table.add_column("95 % interval")
    for row in fit_rows(fit):
        n, k_0 = (row[heads.index(head)] for head in ("n", "k_0 (W/K)"))
        ranking.add_row(*row[:3], f"n   {n}" if n else f"k_0 {k_0}" if k_0 else "")
        for head, value in zip(heads[3:], row[3:], strict=True):
            if value and row[0] == law:
                table.add_row(head, value)
    return [ranking, table]


def wall_text(fit: xr.Dataset) -> str:
    """State the conventions of a fit of closed chambers; an empty text for other fits."""
    if "closed_chambers" not in fit.attrs:
        return ""
    T, P = fit.attrs["T_wall_K"], fit.attrs["P_0_Pa"] / KILO
    return (
        f"mean k: of the part fitted; k_0: at {P:.4g} kPa, {T:.5g} K and mid-stroke by eqs (7) and (8).\n"
        f"Taken for the wall: {T:.5g} K; every k scales with its inverse, predictions do not depend on it"
    )


def valve_text(fit: xr.Dataset) -> str:
    """What the full-order fit says of the valve's command and of what was fitted too.

    An empty text where there is no such fit.
    """
    if "full" not in fit["model"]:
        return ""
    parts: list[str] = []
    for name, text, unit, factor in (
        ("lag", "lag", "ms", KILO),
        ("dead_time", "dead time", "ms", KILO),
        ("null", "null offset", "V", 1.0),
        ("P_s", "supply", "kPa", 1 / KILO),
        ("exhaust", "exhaust over supply path", "", 1.0),
        ("A_B", "piston area of B", "mm²", 1e6),
        ("offset_A", "offset of P_A", "kPa", 1 / KILO),
        ("offset_B", "offset of P_B", "kPa", 1 / KILO),
    ):
        if name not in fit["parameter"]:
            continue
        one = fit.sel(model="full", parameter=name)
        best, low, high = (factor * one[key].item() for key in ("estimate", "low", "high"))
        # These may be negative, and no lag is an end that the search has.
        digits = 2 if name in ("lag", "dead_time", "null") else 4
        ends = " to ".join("open" if np.isnan(end) else f"{end:.{digits}g}" for end in (low, high))
        parts.append(f"{text} {best:.{digits}g}{unit and ' '}{unit} ({ends})")
    return f"valve, from the full order: {', '.join(parts)}"


def warning_texts(fit: xr.Dataset) -> list[str]:
    """Return the reasons not to believe a fit, one sentence each."""
    return [text for text in str(fit.attrs.get("warnings", "")).split("\n") if text]


def transient_text(transient: "Transient") -> str:
    """Conductance from the transient of a closed chamber, on three lines."""
    tau = ends_text(transient.tau_low, transient.tau_high)
    k_0 = f"{significant(transient.k_0)} W/K ({ends_text(transient.k_0_low, transient.k_0_high)})"
    return (
        f"thermal time constant  {significant(transient.tau)} s ({tau})\n"
        f"k_av = m c_v / tau     {significant(transient.k_av)} W/K, at {transient.P_inf / KILO:.4g} kPa\n"
        f"k_0, law of the root   {k_0}; {transient.rms:.3g} Pa rms are left"
    )


# --- pneumo paper identify -------------------------------------------------------------------------

IDENTIFIED_UNIT = {"M": "kg", "k_f": "N s/m", "stop": ""}


def identification_tables(identified: xr.Dataset) -> Iterator[Table]:
    """Parameters of ``results/identification.nc`` by cylinder, then, if any, amplitudes and transports."""
    cylinders = identified["cylinder"].values
    table = Table("cylinder", "parameter", "estimate", "95 % interval", "searched", title="Table 5")
    for cylinder in cylinders:
        for parameter in identified["parameter"].values:
            part = identified.sel(cylinder=cylinder, parameter=parameter)
            names = ("estimate", "low", "high", "bound_low", "bound_high")
            estimate, low, high, least, most = (part[name].item() for name in names)
            heading = f"{parameter} ({IDENTIFIED_UNIT[parameter] or 'of the half-stroke'})"
            ends = ends_text(low, high)
            table.add_row(cylinder, heading, significant(estimate), ends, f"{least:g} to {most:g}")
    yield table
    table = Table("cylinder", "rms fitted", "rms scored", "r(M, k_f)", "widening", "evaluations")
    for cylinder in cylinders:
        part = identified.sel(cylinder=cylinder)
        rms = (f"{part[key].item():.2%}" for key in ("fitted_rms", "scored_rms"))
        others = (f"{part[key].item():.2f}" for key in ("correlation", "widening"))
        table.add_row(cylinder, *rms, *others, str(part["evaluations"].item()))
    yield table
    if "amplitude" not in identified:
        return
    table = Table("cylinder", "amplitude (V)", "95 % interval", title="Table 7")
    for cylinder in cylinders:
        part = identified.sel(cylinder=cylinder)
        ends = ends_text(part["amplitude_low"].item(), part["amplitude_high"].item())
        table.add_row(cylinder, significant(part["amplitude"].item()), ends)
    yield table
    table = Table("transport", "rms Table 7", "rms Table 9", "amplitudes D, E (V)")
    for transport in identified["transport"].values:
        part = identified.sel(transport=transport)
        amplitudes = ", ".join(significant(value) for value in part["transport_amplitude"].values)
        table.add_row(transport, *(f"{value:.4f}" for value in part["transport_rms"].values), amplitudes)
    yield table
    table = Table("experiment", "settling run ends (s)", "about as well", "rms", title="Table 5, closed loop")
    for name in identified["stopped"].values:
        part = identified.sel(stopped=name)
        stop, low, high, misfit = (
            part[f"settling_stop{end}"].item() for end in ("", "_low", "_high", "_misfit")
        )
        table.add_row(name, significant(stop), ends_text(low, high), f"{misfit:.2%}")
    yield table


# --- pneumo paper ensemble -------------------------------------------------------------------------

TRANSPORT_HEADS = {"published": "transport as published", "exact": "exact transport"}
AVERAGE_HEADS = {"mean": "mean", "geometric": "geom. mean"}


def ratio_table(ensemble: xr.Dataset) -> Table:
    """Quotients of ``results/ensemble.nc`` per level, with intervals, in 80 columns."""
    title = "Quotient of mean square errors, [95 % interval]; seed: what one seed resolves"
    table = Table("models", "level", "average", title=title, box=box.SIMPLE_HEAD, padding=0)
    for head in TRANSPORT_HEADS.values():
        table.add_column(head.replace("transport ", "transport\n"), justify="right", no_wrap=True)
        table.add_column("seed", justify="right")
    for ratio in ensemble["ratio"].values:
        for level in ensemble["level"].values:
            for averaged, average_head in AVERAGE_HEADS.items():
                cells = []
                for transport in TRANSPORT_HEADS:
                    at = ensemble.sel(ratio=ratio, level=level, averaged=averaged, transport=transport)
                    names = ("value", "low", "high", "resolvable")
                    value, low, high, least = (at[f"ratio_{name}"].item() for name in names)
                    cells += [f"{value:.3f} [{low:.3f}, {high:.3f}]", f"{100 * (least - 1):.0f} %"]
                table.add_row(ratio, level, average_head.removesuffix(" mean"), *cells)
    return table


def probability_table(ensemble: xr.Dataset, transport: str, level: str) -> Table:
    """How often each model from M5 on has the lower error than another, by the three criteria."""
    models = ensemble["model"].values[4:]
    sets = ensemble["seed_sets"].item()
    title = f"Of {sets} seed sets, per cent in which the row beats the column; {TRANSPORT_HEADS[transport]}"
    caption = "* not told apart (Holm, 5 %)"
    table = Table("criterion", "model", *models, title=f"{title}, {level}", caption=caption)
    for criterion in CRITERIA:
        here = ensemble.sel(criterion=criterion, transport=transport, level=level)
        for model in models:
            cells = []
            for other in models:
                at = here.sel(model=model, other=other)
                mark = "" if at["resolved"].item() else " *"
                cells.append("" if model == other else f"{100 * at['probability'].item():.0f}{mark}")
            table.add_row(criterion, model, *cells)
    return table
