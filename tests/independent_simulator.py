"""A second simulator of the paper's sixteen experiments: own equations, own excitation, SciPy's LSODA.

It reads config/paper.yaml and shares no code with the package. It is also the example of the run format of
docs/verdict.md::

    python tests/independent_simulator.py runs E13 E16
    pneumo paper verdict --runs runs --tool "independent implementation"

Without names of experiments it runs all sixteen, in some 20 minutes. Time is continuous here: no step of
1 ms, only samples. Where a sign is reversed depends on samples, as in the study.
"""

import sys
from math import log, pi, sqrt
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr
import yaml
from paper_equations import full_order, mass_flow
from scipy.integrate import solve_ivp

CONFIGURATION = Path(__file__).parents[1] / "config/paper.yaml"
SIGNALS = ("t", "u", "x", "v", "P_A", "P_B", "T_A", "T_B")
UNITS = dict(zip(SIGNALS, ("s", "V", "m", "m/s", "Pa", "Pa", "K", "K"), strict=True))
RELATIVE, ABSOLUTE = (
    1e-8,
    np.array([1e-11, 1e-9, 1e-3, 1e-3, 1e-6, 1e-6]),
)  # errors of x, v, P_A, P_B, T_A, T_B


class Actuator(NamedTuple):
    """One cylinder with its valve and supply, SI units."""

    R: float
    gamma: float
    P_s: float
    P_atm: float
    T_amb: float
    P_0: float
    bore: float
    stroke: float
    V_d: float
    M: float
    k_f: float
    k_xu: float
    u_max: float
    k_0: float

    def wall(self, x):
        """Area of the walls of chamber A, or of chamber B at -x."""
        return pi * self.bore**2 / 2 + pi * self.bore * (self.stroke / 2 + x)


def random_numbers(seed):
    """Simulink's Random Number block: a multiplicative generator, polar method, second deviate unused."""
    low = seed & 0x8000
    high = seed >> 16
    state = ((((seed - (high << 16)) + low) << 16) + low + high) % 2**32
    while True:
        point = []
        for _ in range(2):
            state = 16807 * state % 2147483647
            point.append(2 * 4.656612875245797e-10 * state - 1)
        radius = point[0] ** 2 + point[1] ** 2
        if radius <= 1:
            yield point[0] * sqrt(-2 * log(radius) / radius)


def chamber(a, u, x, v, P, T):
    """Rates of pressure and temperature of one chamber, u, x, v counted outward: eqs (1), (2), (4) to (8)."""
    area, port = pi * a.bore**2 / 4, a.P_s if u >= 0 else a.P_atm
    opening, m_in, m_out = a.k_xu * abs(u), 0.0, 0.0
    if port >= P:
        m_in = mass_flow(opening, port, P, a.T_amb, a.gamma, a.R)
    else:
        m_out = mass_flow(opening, P, port, T, a.gamma, a.R)
    V, walls, at_rest = a.V_d + area * (a.stroke / 2 + x), a.wall(x), a.wall(0.0)
    air = (a.T_amb, a.T_amb, a.P_0, a.T_amb, a.gamma, a.R)  # T_amb, T_in, P_0, T_0, gamma, R
    return full_order(P, T, V, area * v, m_in, m_out, *air, a.k_0, walls, at_rest)


def rates(a, command, state, held):
    """Rates of (x, v, P_A, P_B, T_A, T_B); the piston does not move while it is `held` on a stop."""
    x, v, P_A, P_B, T_A, T_B = state
    u = min(max(command(x), -a.u_max), a.u_max)
    dP_A, dT_A = chamber(a, u, x, v, P_A, T_A)
    dP_B, dT_B = chamber(a, -u, -x, -v, P_B, T_B)
    force = pi * a.bore**2 / 4 * (P_A - P_B) - a.k_f * v  # (3)
    motion = (0.0, 0.0) if held else (v, force / a.M)
    return (*motion, dP_A, dP_B, dT_A, dT_B)


def advance(a, command, state, start, times):
    """States at the times, the last of which ends the piece, through impacts on the stops and releases."""
    half, area, done = a.stroke / 2, pi * a.bore**2 / 4, []
    while len(done) < len(times):
        pushed = (state[2] - state[3]) * area
        held = state[1] == 0 and ((state[0] == half and pushed > 0) or (state[0] == -half and pushed < 0))

        def outside(_t, y):
            return half - abs(y[0])

        def released(_t, y, outward=state[0]):
            return outward * (y[2] - y[3])

        def moving(_t, y, held=held):
            return rates(a, command, y, held)

        event = released if held else outside
        event.terminal, event.direction = True, -1
        options = {"method": "LSODA", "rtol": RELATIVE, "atol": ABSOLUTE, "t_eval": times[len(done) :]}
        solved = solve_ivp(moving, (start, times[-1]), state, events=event, **options)
        if not solved.success and solved.status != 1:
            raise RuntimeError(solved.message)
        done += list(np.reshape(solved.y, (6, -1)).T)
        if solved.status == 1:
            start, state = solved.t_events[0][0], solved.y_events[0][0].copy()
            if not held:  # a plastic impact
                state[:2] = np.sign(state[0]) * half, 0.0
            else:
                state[0] *= 1 - 1e-12
    return np.array(done)


def actuator(file, name):
    """Actuator of an experiment of a configuration; its cylinder's and the experiment's own sections."""
    everything = yaml.safe_load(file.read_text(encoding="utf-8"))
    experiment = everything["experiments"][name]
    c, gas, supply = everything["cylinders"][experiment["cylinder"]], everything["gas"], everything["supply"]
    bore, stroke = c["bore_mm"] / 1000, c["stroke_mm"] / 1000
    walls = pi * bore**2 / 2 + pi * bore * stroke / 2
    k_0 = (
        experiment["k_0_W_per_K"] if "k_0_W_per_K" in experiment else experiment["lambda_0_W_per_m2K"] * walls
    )
    a = Actuator(
        gas["R_J_per_kgK"],
        gas["gamma"],
        supply["P_s_Pa"],
        supply["P_atm_Pa"],
        supply["T_amb_K"],
        supply["P_0_per_P_s"] * supply["P_s_Pa"],
        bore,
        stroke,
        c["dead_volume_m3"],
        c["mass_kg"],
        c["friction_Ns_per_m"],
        c["k_x_k_u_m2_per_V"],
        c["u_max_V"],
        k_0,
    )
    return a, c, experiment, everything["step_s"]


def simulate(name, duration=None, file=CONFIGURATION):
    """Samples of an experiment by signal, from rest; `duration`, s, if not the experiment's own."""
    a, c, experiment, step = actuator(file, name)
    closed, every = experiment["loop"] == "closed", round(c["sample_time_s"] / step)
    count = round((duration or experiment["duration_s"]) / step) + 1
    numbers = random_numbers(c["seed"])
    draws = np.array([next(numbers) for _ in range((count - 1) // every + 1)])
    if closed:
        draws *= sqrt(c["closed_loop"]["variance_m2"])
    else:
        loop = c["open_loop"]
        draws, limit = loop["amplitude_V"] * np.sign(draws), loop["reverse_at"] * a.stroke / 2
        toggles = loop["reversal"] == "toggled"
    states, signs, u = np.empty((count, 6)), np.ones(count), np.empty(count)
    states[0] = 0.0, 0.0, a.P_0, a.P_0, a.T_amb, a.T_amb
    k, sign = 0, 1.0
    while k < count - 1:
        draw, end = draws[k // every], min((k // every + 1) * every, count - 1)
        if closed:

            def command(x, draw=draw):
                return c["closed_loop"]["k_p_V_per_m"] * (draw - x)
        else:
            turned = -1.0 if _outward(states[k, 0], sign * draw, limit) else 1.0
            signs[k : end + 1] = sign * turned
            sign *= turned if toggles else 1.0

            def command(_x, held=signs[k] * draw):
                return held

        part = advance(a, command, states[k], k * step, np.arange(k + 1, end + 1) * step)
        if not closed:  # a sample at which the sign changes ends the piece
            now = signs[k] * draw
            for i, x in enumerate(part[:-1, 0]):
                before = draw * (sign if toggles else 1.0)
                if (-before if _outward(x, before, limit) else before) != now:
                    end = k + 1 + i
                    break
        states[k + 1 : end + 1] = part[: end - k]
        k = end
    at = np.arange(count) // every
    if closed:
        u = c["closed_loop"]["k_p_V_per_m"] * (draws[at] - states[:, 0])
    else:
        before = np.concatenate([signs[:1], signs[:-1]])
        late = c["open_loop"]["reversal_recorded_late"]  # the recorded command shows a reversal that late
        u = draws[at] * ((1 - late) * signs + late * before)
    return dict(zip(SIGNALS, (np.arange(count) * step, u, *states.T), strict=True))


def _outward(x, reference, limit):
    return abs(x) >= limit and reference * x > 0


def write_run(signals, file):
    """Write the samples of a run as NetCDF, in the format that `pneumo paper verdict --runs` reads."""
    columns = {name: ("t", values, {"units": UNITS[name]}) for name, values in signals.items() if name != "t"}
    xr.Dataset(columns, {"t": ("t", signals["t"], {"units": "s"})}).to_netcdf(file)


if __name__ == "__main__":
    folder, *names = sys.argv[1:]
    Path(folder).mkdir(exist_ok=True)
    for experiment in names or yaml.safe_load(CONFIGURATION.read_text(encoding="utf-8"))["experiments"]:
        write_run(simulate(experiment), Path(folder, f"{experiment}.nc"))
        print(experiment, flush=True)
