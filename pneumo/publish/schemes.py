"""The schematic figures 1-6 and 12, drawn anew from the paper's text: the scan has no artwork."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Polygon

from pneumo.publish.drawing import (
    HAIR,
    LIMIT,
    LINE,
    NOISE,
    SIGN,
    WALL,
    Box,
    arrow,
    badge,
    block,
    body,
    canvas,
    dimension,
    dot,
    flow,
    gain,
    head,
    icon,
    junction,
    label,
    line,
    restriction,
)
from pneumo.publish.style import ACCENT, DOUBLE_MM, GREY, INK, PALE, SINGLE_MM, paper_style

CENTRE_LINE = (0, (12, 2, 2, 2))
DASHED = (0, (3, 2))
STEEL = "#c4c4c4"  # moving parts; the housing is PALE


# --- Fig. 1: servo-valve ---------------------------------------------------------------------------


@paper_style()
def fig01_servo_valve() -> Figure:
    """Fig. 1: four-way servo-valve, (a) spool moved by x_v > 0 and (b) its two half-bridges.

    By eq. (2), u >= 0 opens restrictions 1 (supply to A) and 4 (B to exhaust),
    u < 0 opens 2 (A to exhaust) and 3 (supply to B).
    """
    fig, ax = canvas(DOUBLE_MM, 60)
    _spool(ax, 42, 33.5)
    _bridge(ax, 130, 33.5)
    label(ax, 42, 3, "(a)  $u > 0$")
    label(ax, 130, 3, "(b)")
    return fig


def _spool(ax: Axes, x: float, y: float) -> None:
    bore, wall, port, shift = 5.0, 5.0, 5.0, 2.0  # half bore, sleeve wall, port width, x_v
    for side, ports in ((1, (-9, 9)), (-1, (-18, 0, 18))):
        edges = [-31, *(p + s * port / 2 for p in ports for s in (-1, 1)), 31]
        for left, right in zip(edges[::2], edges[1::2], strict=True):
            body(ax, x + left, y + (bore if side > 0 else -bore - wall), right - left, wall)
    body(ax, x - 20, y - 1.2, 56 + shift, 2.4, "white")
    for left, right in ((-28, -15.5), (-2.5, 2.5), (15.5, 28)):  # zero overlap when centred
        body(ax, x + left + shift, y - bore, right - left, 2 * bore, STEEL)
    # The streams at u > 0: P_s -> 1 -> A and B -> 4 -> P_atm.
    rise = [(0, -16.5), (0, -11), (0, -8), (-1.5, -8), (-1.5, -5.5)]
    inflow = [*rise, (-1.5, -0.5), (-9, -2), (-9, 5), (-9, 16.5)]
    outflow = [(px + 18, py) for px, py in reversed(inflow)]
    for stream in (inflow, outflow):
        flow(ax, *((x + px, y + py) for px, py in stream))
    for p, name in ((-9, "chamber A"), (9, "chamber B")):
        label(ax, x + p, y + 18, name, va="bottom")
    for p, name in ((-18, r"$P_{\mathrm{atm}}$"), (0, r"$P_s$"), (18, r"$P_{\mathrm{atm}}$")):
        label(ax, x + p, y - 20, name)
    for p, number in ((-12.4, "2"), (-5.6, "1"), (5.6, "3"), (12.4, "4")):
        badge(ax, x + p, y - 7.5, number, ACCENT if number in "14" else GREY)
    line(ax, (x + 36, y + 1.8), (x + 36, y + 6.2), lw=HAIR)
    arrow(ax, (x + 36, y + 4.6), (x + 42, y + 4.6), lw=HAIR)
    label(ax, x + 39, y + 7.6, r"$x_v$")


def _bridge(ax: Axes, x: float, y: float) -> None:
    reach, rail, middle = 22.0, 18.0, 10.0  # half distance of the branches; heights of rails and restrictions
    for side, name in ((1, r"supply $P_s$"), (-1, r"exhaust $P_{\mathrm{atm}}$")):
        line(ax, (x - reach, y + side * rail), (x + reach, y + side * rail))
        line(ax, (x, y + side * rail), (x, y + side * (rail + 2)))
        dot(ax, x, y + side * rail)
        label(ax, x + 3, y + side * (rail + 3), name, ha="left")
    ax.add_patch(Circle((x, y + rail + 2.6), 0.9, facecolor="white", edgecolor=INK, linewidth=LINE, zorder=3))
    outlet = [(x - 1.6, y - rail - 2), (x + 1.6, y - rail - 2), (x, y - rail - 4.6)]
    ax.add_patch(Polygon(outlet, closed=True, facecolor="white", edgecolor=INK, linewidth=LINE, zorder=3))
    for sx, sy, number in ((-1, 1, "1"), (-1, -1, "2"), (1, 1, "3"), (1, -1, "4")):
        color, ls = (ACCENT, "-") if number in "14" else (GREY, DASHED)
        bx, by = x + sx * reach, y + sy * middle
        line(ax, (bx, y + max(sy, 0) * rail), (bx, y + min(sy, 0) * rail), color=color, ls=ls)
        restriction(ax, bx, by, vertical=True, color=color, variable=True)
        badge(ax, bx + sx * 7, by, number, color)
        head(ax, (bx, by - 6.4), (bx, by), color)
        dot(ax, bx, y)
    line(ax, (x - reach, y), (x + reach, y))
    body(ax, x - 13, y - 4.5, 26, 9, "white")
    body(ax, x - 1.2, y - 4.5, 2.4, 9, STEEL)
    label(ax, x - 7, y, "A")
    label(ax, x + 7, y, "B")
    label(ax, x, y + 10.5, r"$u \geq 0$: 1 and 4 open", color=ACCENT)
    label(ax, x, y - 10.5, r"$u < 0$: 2 and 3 open", color="#5a5a5a")


# --- Fig. 2: throat --------------------------------------------------------------------------------


@paper_style()
def fig02_ideal_throat() -> Figure:
    """Fig. 2: ideal throat of area A_t between the upstream state P_u, T_u and P_d."""
    fig, ax = canvas(SINGLE_MM, 32)
    x, y, half = 42.0, 16.0, 30.0
    s = np.linspace(-half, half, 161)
    profile = 3.2 + 7.3 * (1 - np.exp(-((s / np.where(s < 0, 9.0, 14.0)) ** 2)))  # short inlet, long outlet
    for side in (-1, 1):
        inner = np.column_stack([x + s, y + side * profile])
        outer = [(x + half, y + side * 14), (x - half, y + side * 14)]
        ax.add_patch(Polygon(np.vstack([inner, outer]), closed=True, facecolor=PALE, edgecolor="none"))
        line(ax, *map(tuple, inner), lw=WALL)
    line(ax, (x - half - 4, y), (x + half + 4, y), color=GREY, lw=HAIR, ls=CENTRE_LINE)
    dimension(ax, (x, y + 3.2), (x, y - 3.2))
    label(ax, x, y + 6.2, "$A_t$")
    for start, state in ((-26.0, r"$P_u,\ T_u$"), (15.0, r"$P_d$")):
        arrow(ax, (x + start, y), (x + start + 11, y), color=ACCENT, lw=1.5, scale=1.4)
        label(ax, x + start + 5.5, y + 4.2, state)
        label(ax, x + start + 5.5, y - 3.8, r"$\dot{m}$", color=ACCENT)
    return fig


# --- Fig. 3: cylinder ------------------------------------------------------------------------------


@paper_style()
def fig03_symmetric_cylinder() -> Figure:
    """Fig. 3: symmetric cylinder with x from the centre; positive x enlarges chamber A.

    The stroke l is the travel of the piston's middle between the stops, so V_A = V_d + A_A (l/2 + x)
    and V_B = V_d + A_B (l/2 - x), with the dead volume V_d beside the stops.
    """
    fig, ax = canvas(DOUBLE_MM, 56)
    x, y, half, bore, stop, piston = 60.0, 31.5, 42.0, 10.0, 3.0, 6.0
    travel, xp = half - stop - piston / 2, x + 12  # l/2 and the piston's middle
    line(ax, (x, y + bore + 5), (x, y - 26), color=GREY, lw=HAIR, ls=CENTRE_LINE)
    for side in (-1, 1):
        body(ax, x - half - 4, y + side * (bore + 1.5) - 1.5, 2 * half + 8, 3)
        body(ax, x + side * (half + 2) - 2, y - bore, 4, 2 * bore)
        body(ax, x + side * (half - stop / 2) - stop / 2, y - 4.5, stop, 9)
        ghost = x + side * travel - piston / 2
        body(ax, ghost, y - bore, piston, 2 * bore, "none", edgecolor=GREY, linewidth=HAIR, linestyle=DASHED)
        line(ax, (x + side * travel, y - bore), (x + side * travel, y - 26), lw=HAIR, color=GREY)
    body(ax, 5, y - 1.8, 117, 3.6, "white")
    body(ax, xp - piston / 2, y - bore, piston, 2 * bore, STEEL)
    for name, side, middle in (("A", -1, x - 15), ("B", 1, x + 24)):
        label(ax, middle, y + 5.8, rf"$P_{name},\ T_{name},\ V_{name}$")
        face = xp + side * piston / 2
        arrow(ax, (face + side * 3.6, y - 5.8), (face, y - 5.8))
        label(ax, face + side * 5.8, y - 5.8, rf"$A_{name}$")
        port = x + side * (half - stop / 2)
        body(ax, port - 1.2, y + bore - 0.3, 2.4, 3.6, "white", edgecolor="none")
        for dx in (-1.2, 1.2):
            line(ax, (port + dx, y + bore), (port + dx, y + bore + 6))
        outer, inner = (port, y + bore + 8.5), (port, y + bore + 1)
        arrow(ax, *((outer, inner) if side < 0 else (inner, outer)), color=ACCENT, lw=1.3, scale=1.3)
        label(ax, port, y + bore + 11, rf"$\dot{{m}}_{name}$", color=ACCENT)
        line(ax, (port, y - 7), (port + side * 6, y - 17), lw=HAIR)
        dot(ax, port, y - 7)
        label(ax, port + side * 7, y - 19.2, r"$V_d$")
    line(ax, (xp, y - bore - 3), (xp, y - 20), lw=HAIR, color=GREY)
    arrow(ax, (x, y - 18.5), (xp, y - 18.5), lw=HAIR)
    label(ax, x + 6, y - 16.4, "$x$")
    dimension(ax, (x - travel, y - 24.5), (x, y - 24.5))
    dimension(ax, (x, y - 24.5), (x + travel, y - 24.5))
    for side in (-1, 1):
        label(ax, x + side * travel / 2, y - 22, "$l/2$")
    _load(ax, 122, y)
    return fig


def _load(ax: Axes, x: float, y: float) -> None:
    ground, wall = y - 11.5, x + 44
    body(ax, x, y - 8.5, 20, 17, STEEL)
    label(ax, x + 10, y, "$M$")
    for dx in (4.5, 15.5):
        ax.add_patch(Circle((x + dx, y - 10), 1.5, facecolor="white", edgecolor=INK, linewidth=LINE))
    outline = [(x - 3, ground), (wall, ground), (wall, y + 8.5)]
    line(ax, *outline, lw=WALL)
    fixed = [*outline, (wall + 2.5, y + 8.5), (wall + 2.5, ground - 2.5), (x - 3, ground - 2.5)]
    ax.add_patch(Polygon(fixed, closed=True, facecolor=PALE, edgecolor="none", zorder=0))
    line(ax, (x + 20, y), (x + 31, y))  # piston rod of the dashpot, its piston, its cup
    line(ax, (x + 31, y - 2.4), (x + 31, y + 2.4), lw=WALL + 0.5)
    line(ax, (x + 26, y + 3.4), (x + 35, y + 3.4), (x + 35, y - 3.4), (x + 26, y - 3.4), lw=WALL)
    line(ax, (x + 35, y), (wall, y))
    label(ax, x + 30.5, y + 6.2, "$k_f$")
    arrow(ax, (x + 10, y + 11), (x + 18, y + 11), lw=HAIR)
    line(ax, (x + 10, y + 9.2), (x + 10, y + 12.8), lw=HAIR)
    label(ax, x + 14, y + 13.4, r"$x,\ \dot{x}$")


# --- Figs. 4 and 5: full-order simulations ---------------------------------------------------------


def _plant(ax: Axes, x: float, y: float, tap: float) -> Box:
    """Draw limiter, valve, cylinder and recorder; `x` is where u enters, `tap` where it is recorded."""
    limit = icon(ax, x + 6, y, LIMIT, "10 V limit")
    valve = block(ax, x + 29, y, 20, 16, "Servo-valve\neqs (1), (2)")
    cylinder = block(ax, x + 62, y, 24, 16, "Cylinder, full\norder: eqs (3),\n(4), (5), (7)")
    arrow(ax, (limit.right, y), (valve.left, y))
    for side, name in ((1, "A"), (-1, "B")):
        arrow(ax, (valve.right, y + 4 * side), (cylinder.left, y + 4 * side), color=ACCENT)
        label(ax, (valve.right + cylinder.left) / 2, y + 4 * side + 2.6, rf"$\dot{{m}}_{name}$", color=ACCENT)
    start, back = cylinder.x - 6, y - 14
    arrow(ax, (start, cylinder.bottom), (start, back), (valve.x, back), (valve.x, valve.bottom))
    label(ax, (valve.x + cylinder.x) / 2 - 3, back + 2.4, r"$P_A,\ T_A,\ P_B,\ T_B$")
    record = block(ax, (tap - 6 + cylinder.right) / 2, y - 25, cylinder.right - tap + 6, 9)
    label(ax, record.x, record.y, r"Recorded:  $u,\ x,\ \dot{x},\ P_A,\ P_B,\ T_A,\ T_B$")
    dot(ax, tap, y)
    arrow(ax, (tap, y), (tap, record.top))
    label(ax, tap + 1.6, y + 2.4, "$u$")
    arrow(ax, (cylinder.x + 6, cylinder.bottom), (cylinder.x + 6, record.top))
    return cylinder


@paper_style()
def fig04_open_loop() -> Figure:
    """Fig. 4: open-loop simulation, a random square wave reversed before the piston meets a stop."""
    fig, ax = canvas(DOUBLE_MM, 60)
    y = 34.0
    noise = icon(ax, 11, y, NOISE, "Gaussian random\nnumber generator", axes=False)
    sign = icon(ax, 31, y, SIGN, "Sign")
    amplitude = gain(ax, 48, y, "Amplitude")
    reverse = block(ax, 73, y, 26, 16, "Sign reversal\nat $x = \\pm 0.96\\,l/2$")
    cylinder = _plant(ax, 98, y, 91.5)
    for start, end in ((noise, sign), (sign, amplitude), (amplitude, reverse)):
        arrow(ax, (start.right, y), (end.left, y))
    arrow(ax, (reverse.right, y), (98, y))
    top = y + 18
    arrow(ax, (cylinder.x, cylinder.top), (cylinder.x, top), (reverse.x, top), (reverse.x, reverse.top))
    label(ax, (cylinder.x + reverse.x) / 2, top + 2.2, "$x$")
    return fig


@paper_style()
def fig05_closed_loop() -> Figure:
    """Fig. 5: closed-loop simulation with proportional position control."""
    fig, ax = canvas(DOUBLE_MM, 60)
    y = 34.0
    noise = icon(ax, 15, y, NOISE, "Gaussian random\nnumber generator", axes=False)
    error = junction(ax, 48, y, {"$+$": (-4.6, 2.2), "$-$": (2.4, 4.8)})
    control = gain(ax, 70, y, "Proportional\ncontrol", "$k_p$")
    cylinder = _plant(ax, 98, y, 87)
    arrow(ax, (noise.right, y), (error.left, y))
    label(ax, 31.5, y + 2.6, "reference")
    arrow(ax, (error.right, y), (control.left, y))
    arrow(ax, (control.right, y), (98, y))
    top = y + 18
    arrow(ax, (cylinder.x, cylinder.top), (cylinder.x, top), (error.x, top), (error.x, error.top))
    label(ax, (cylinder.x + error.x) / 2, top + 2.2, "$x$")
    return fig


# --- Fig. 6: reduced models ------------------------------------------------------------------------


@paper_style()
def fig06_reduced_models() -> Figure:
    """Fig. 6: replay of the recorded u, x and dx/dt through a reduced model of each chamber."""
    fig, ax = canvas(DOUBLE_MM, 76)
    y, arm = 38.0, 17.0
    record = block(ax, 15, y, 22, 68, "Recorded\nin the\nfull-order\nsimulation")
    limit = icon(ax, 46, y, LIMIT, "10 V limit")
    valve = block(ax, 71, y, 20, 16, "Servo-valve\neqs (1), (2)")
    result = block(ax, 161, y, 18, 16, "Error:\n$\\mu$, $\\sigma$, MSE")
    arrow(ax, (record.right, y), (limit.left, y))
    label(ax, 33, y + 2.4, "$u$")
    arrow(ax, (limit.right, y), (valve.left, y))
    for side, name in ((1, "A"), (-1, "B")):
        level = y + side * arm
        model = block(ax, 113, level, 27, 14, f"Chamber {name}:\nmodel $M_i(n)$")
        error = junction(ax, 143, level, {"$-$": (-4.4, -side * 2.4), "$+$": (2.4, side * 4.6)})
        edge = {1: "top", -1: "bottom"}[side]
        away, near = getattr(valve, edge), y + side * 4
        arrow(ax, (valve.x, away), (valve.x, level), (model.left, level), color=ACCENT)
        label(ax, 85, level + side * 2.8, rf"$\dot{{m}}_{name}$", color=ACCENT)
        arrow(ax, (model.x, level - side * 7), (model.x, near), (valve.right, near))
        label(ax, 97, near + side * 2.6, rf"$P_{name},\ T_{name}$")
        for lane, end, target, text in (
            (y + side * 27.5, model.x, level + side * 7, r"$x,\ \dot{x}$"),
            (y + side * 32.5, error.x, level + side * 2.2, rf"datum $P_{name}$"),
        ):
            arrow(ax, (record.right, lane), (end, lane), (end, target))
            label(ax, 45, lane + 2.3, text)
        arrow(ax, (model.right, level), (error.left, level))
        label(ax, 132, level + side * 2.6, rf"$P_{name}$")
        arrow(ax, (error.right, level), (result.x, level), (result.x, getattr(result, edge)))
    return fig


# --- Fig. 12: half-bridge --------------------------------------------------------------------------


@paper_style()
def fig12_half_bridge() -> Figure:
    """Fig. 12: half-bridge model of the centred valve, whose leakages set the equilibrium pressure."""
    fig, ax = canvas(SINGLE_MM, 30)
    y = 13.0
    line(ax, (8, y), (76, y))
    for x, text in ((10, "$P_s,\\ T_s$"), (75.5, r"$P_{\mathrm{atm}}$")):
        label(ax, x, y - 4.8, text)
    for x, number in ((25, "1"), (59, "2")):
        restriction(ax, x, y)
        label(ax, x, y - 4.8, f"$A_{number}$")
        arrow(ax, (x - 5, y + 5.4), (x + 5, y + 5.4), color=ACCENT, lw=1.3, scale=1.3)
        label(ax, x, y + 8.6, rf"$\dot{{m}}_{number}$", color=ACCENT)
    block(ax, 42, y, 12, 12, "$P,\\ T$")
    return fig


SCHEMES: dict[str, Callable[[], Figure]] = {
    "fig01": fig01_servo_valve,
    "fig02": fig02_ideal_throat,
    "fig03": fig03_symmetric_cylinder,
    "fig04": fig04_open_loop,
    "fig05": fig05_closed_loop,
    "fig06": fig06_reduced_models,
    "fig12": fig12_half_bridge,
}
