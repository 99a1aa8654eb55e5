# pyright: standard
"""The same replays by several means: our kernels, NumPy, SciPy and, where installed, diffrax and numbalsoda.

Each contender is prepared for a case once, compilation included, and then run as often as one likes. The
solvers count time in steps: whole numbers, to which adding a step of one is exact.
"""

import importlib.util
from collections.abc import Callable
from typing import Any, NamedTuple

import numba
import numpy as np
from numba.np.numpy_support import carray
from scipy.integrate import solve_ivp

from pneumo.configuration.experiment import Experiment
from pneumo.configuration.sampling import INTERPOLATED, Sampling
from pneumo.physics.cylinder import Chamber, Side, chamber_of, heat_area, volume
from pneumo.physics.models import Lane, model_dP_dt, temperature
from pneumo.physics.valve import choked_flow, limited
from pneumo.simulation.full_order import Recording
from pneumo.simulation.reference import lane_of, lane_rate
from pneumo.simulation.replay import Replayed, replay, replay_by_reference
from pneumo.simulation.runge_kutta import STAGES, A, B, C
from pneumo.simulation.signals import line_between


class Case(NamedTuple):
    """One recorded run and the lanes to be replayed on it, in both chambers.

    Attributes
    ----------
    experiment : Experiment
    recording : Recording
    lanes : numpy.ndarray
        Shape (lane, 9).
    """

    experiment: Experiment
    recording: Recording
    lanes: np.ndarray

    def first(self, steps: int) -> "Case":
        """The same case, cut after some steps."""
        states, reference, u = (series[: steps + 1] for series in self.recording[:3])
        recording = self.recording._replace(states=states, reference=reference, u=u)
        return self._replace(experiment=self.experiment._replace(steps=steps), recording=recording)


class Outcome(NamedTuple):
    """Result of one run of a contender.

    Attributes
    ----------
    mse : numpy.ndarray
        Mean square error against the recorded run, Pa^2, shape (lane, chamber).
    calls : float
        Right-hand sides computed, per lane and chamber.
    """

    mse: np.ndarray
    calls: float


Run = Callable[[], Outcome]


def mse(case: Case, P: np.ndarray) -> np.ndarray:
    """Mean square error of reduced pressures, Pa, of shape (steps + 1, 2 lanes): all of chamber A first."""
    full = case.recording.states[:, [2, 4]]
    return np.mean((full[:, :, None] - P.reshape(len(full), 2, -1)) ** 2, axis=0).T


# Ours


def our_run(kernel: Callable[..., Replayed], case: Case, sampling: Sampling = INTERPOLATED) -> Run:
    """Prepare one of our two kernels."""
    e = case.experiment
    stride = min(e.pressure_stride, e.steps)

    def run() -> Outcome:
        replayed = kernel(case.recording, case.lanes, sampling, stride)
        return Outcome(replayed.mse, STAGES * e.steps)

    return run


def kernel(case: Case) -> Run:
    """Prepare the study's kernel, all statistics included."""
    return our_run(replay, case)


def scalar(case: Case) -> Run:
    """Prepare the readable kernel, one lane at a time."""
    return our_run(replay_by_reference, case)


# Lanes of both chambers as one array


def signals(case: Case, position: float) -> tuple[float, float, float]:
    """Command (V), position (m) and velocity (m/s) after some steps, interpolated."""
    u, states = case.recording.u, case.recording.states
    series, last = (u, states[:, 0], states[:, 1]), len(u) - 1
    u_now, x, v = (line_between(one, position, 1, last) for one in series)
    return u_now, x, v


def array_rate(xp: Any, case: Case) -> Callable[[Any, Any, Any, Any], Any]:
    """Right-hand side of all lanes in both chambers at once, Pa per step.

    The functions of `pneumo.physics`, but for eq (1): its two branches become a choice between arrays.

    Parameters
    ----------
    xp : module
        numpy, or one that looks like it.
    case : Case

    Returns
    -------
    callable
        Of command (V, unlimited), position (m), velocity (m/s) and pressures (Pa, shape (2 lanes,)).
    """
    plant, h = case.experiment.plant, case.experiment.h
    gas, c, cylinder = plant.gas, plant.conditions, plant.cylinder
    lane = Lane(*(xp.asarray(column) for column in case.lanes.T))
    sign = xp.asarray([[side.sign] for side in Side])
    both = [chamber_of(cylinder, side) for side in Side]
    chamber: Any = Chamber(*(xp.asarray(pair)[:, None] for pair in zip(*both, strict=True)))
    A_q0 = heat_area(0.0, cylinder)

    def rate(u: Any, x: Any, v: Any, P: Any) -> Any:
        P = P.reshape(2, -1)
        u, x, v = sign * xp.clip(u, -plant.valve.u_max, plant.valve.u_max), sign * x, sign * v
        T = temperature(P, c.P_0, c.T_0, lane.a)
        P_port = xp.where(u >= 0, c.P_s, c.P_atm)
        inward = P_port >= P
        A_t, P_u, T_u = plant.valve.k_xu * abs(u), xp.maximum(P, P_port), xp.where(inward, c.T_in, T)
        ratio, g = xp.minimum(P, P_port) / P_u, gas.gamma
        subsonic = ratio ** (2 / g) - ratio ** ((g + 1) / g)
        flow = xp.where(
            ratio <= gas.critical_ratio,
            choked_flow(A_t, P_u, T_u, gas),
            A_t * P_u * (2 * g / ((g - 1) * gas.R * T_u) * subsonic) ** 0.5,
        )  # (1)
        m_in, m_out = xp.where(inward, flow, 0.0), xp.where(inward, 0.0, flow)
        V, A_q = volume(x, chamber, cylinder), heat_area(x, cylinder) / A_q0
        constants = (plant.k_0, c.P_0, c.T_0, c.T_in, c.T_amb, gas.R, g)
        dP_dt: Any = model_dP_dt(P, T, V, chamber.area * v, m_in, m_out, A_q, *constants, lane)  # an array
        return h * dP_dt.reshape(-1)

    return rate


def start(case: Case) -> np.ndarray:
    """Pressures from which all lanes start, Pa."""
    return np.full(2 * len(case.lanes), case.experiment.plant.conditions.P_0)


def numpy_lanes(case: Case) -> Run:
    """Prepare our integration scheme in NumPy, lanes of both chambers as one array."""
    rate, steps = array_rate(np, case), case.experiment.steps

    def run() -> Outcome:
        P = np.empty((steps + 1, 2 * len(case.lanes)))
        P[0] = start(case)
        K = np.empty((STAGES, P.shape[1]))
        for k in range(steps):
            for i in range(STAGES):
                K[i] = rate(*signals(case, k + C[i]), P[k] + A[i, :i] @ K[:i])
            P[k + 1] = P[k] + B @ K
        return Outcome(mse(case, P), STAGES * steps)

    return run


def scipy_solve_ivp(case: Case) -> Run:
    """Prepare SciPy's Dormand-Prince method with all lanes as one system, held to steps of one."""
    rate, steps = array_rate(np, case), case.experiment.steps

    def of_time(t: float, P: np.ndarray) -> np.ndarray:
        return rate(*signals(case, t), P)

    # Tolerances that every step meets, so that the steps are ours.
    options: dict[str, Any] = {"method": "RK45", "first_step": 1.0, "max_step": 1.0, "rtol": 1e9, "atol": 1e9}

    def run() -> Outcome:
        solution = solve_ivp(of_time, (0.0, steps), start(case), **options)
        return Outcome(mse(case, solution.y.T), solution.nfev)

    return run


# From the extra `bench`


def diffrax_dopri5(case: Case) -> Run:
    """Prepare diffrax's Dormand-Prince method, compiled, in double precision and with steps of one."""
    import diffrax  # pyright: ignore[reportMissingImports]
    import jax  # pyright: ignore[reportMissingImports]
    import jax.numpy as jnp  # pyright: ignore[reportMissingImports]

    jax.config.update("jax_enable_x64", True)
    rate, steps = array_rate(jnp, case), case.experiment.steps
    states, u = case.recording.states, case.recording.u
    series = jnp.asarray(np.column_stack([u, states[:, :2]]))

    def of_time(t: Any, P: Any, _: None) -> Any:
        k = jnp.clip(t.astype(int), 0, steps - 1)
        now = series[k] + (t - k) * (series[k + 1] - series[k])
        return rate(now[0], now[1], now[2], P)

    @jax.jit
    def solve(P: Any) -> Any:
        every = diffrax.SaveAt(t0=True, steps=True)
        term, method = diffrax.ODETerm(of_time), diffrax.Dopri5()
        return diffrax.diffeqsolve(term, method, 0.0, steps, 1.0, P, saveat=every, max_steps=steps).ys

    def run() -> Outcome:
        P = np.asarray(solve(jnp.asarray(start(case))))
        return Outcome(mse(case, P), STAGES * steps + 1)  # the last rate of a step is the first of the next

    run()  # compiles
    return run


HEADER = 2 + len(Lane._fields)  # calls, sign, lane; then the three signals


def numbalsoda_lsoda(case: Case) -> Run:
    """Prepare LSODA with steps of its own choice, lane by lane, at a relative tolerance of 1e-6."""
    from numbalsoda import lsoda, lsoda_sig  # pyright: ignore[reportMissingImports]

    plant, h, steps = case.experiment.plant, case.experiment.h, case.experiment.steps
    P_0, u_max = plant.conditions.P_0, plant.valve.u_max
    A, B = chamber_of(plant.cylinder, 0), chamber_of(plant.cylinder, 1)
    states, u, samples = case.recording.states, case.recording.u, steps + 1

    @numba.cfunc(lsoda_sig)
    def rate(t, P, dP, data):  # pragma: no cover
        values = carray(data, (HEADER + 3 * samples,))
        values[0] += 1
        sign, c = values[1], values[2:HEADER]
        series = values[HEADER:].reshape((3, samples))
        u, x = line_between(series[0], t, 1, samples - 1), line_between(series[1], t, 1, samples - 1)
        v = line_between(series[2], t, 1, samples - 1)
        chamber = A if sign > 0 else B
        dP[0] = h * lane_rate(sign * limited(u, u_max), sign * x, sign * v, P[0], chamber, plant, lane_of(c))

    address, t = rate.address, np.arange(samples, dtype=float)

    @numba.njit
    def solve(lanes, data, P):
        for side in range(2):
            for i in range(len(lanes)):
                data[1], data[2:HEADER] = 1.0 - 2.0 * side, lanes[i]
                solution, _ = lsoda(address, np.array([P_0]), t, data, 1e-6, 1.0)
                P[:, side * len(lanes) + i] = solution[:, 0]

    def run() -> Outcome:
        P = np.empty((samples, 2 * len(case.lanes)))
        data = np.concatenate([np.zeros(HEADER), u, states[:, 0], states[:, 1]])
        solve(case.lanes, data, P)
        return Outcome(mse(case, P), data[0] / P.shape[1])

    run()  # compiles
    return run


class Contender(NamedTuple):
    """One way to replay.

    Attributes
    ----------
    label : str
        What tables and chart call it.
    prepare : callable
    seconds : float
        Length of run that it can afford, s of the experiment's time.
    tolerance : float
        Largest relative difference from the MSE of the readable kernel that passes.
    reason : str
        Where that difference comes from.
    needs : str
        Package that it needs beyond those of pneumo.
    """

    label: str
    prepare: Callable[[Case], Run]
    seconds: float
    tolerance: float
    reason: str
    needs: str = ""


ROUNDING = "same scheme and steps; roundings of eq (1) near equal pressures"
CONTENDERS = {
    "kernel": Contender("pneumo, fast kernel", kernel, 30.0, 1e-9, ROUNDING),
    "scalar": Contender("pneumo, readable kernel", scalar, 1.0, 0.0, "the standard itself"),
    "numpy": Contender("NumPy, arrays of lanes", numpy_lanes, 0.3, 1e-9, ROUNDING),
    "solve_ivp": Contender("SciPy solve_ivp, one system", scipy_solve_ivp, 0.3, 1e-9, ROUNDING),
    "diffrax": Contender("diffrax Dopri5", diffrax_dopri5, 2.0, 1e-9, ROUNDING, "diffrax"),
    "numbalsoda": Contender(
        "numbalsoda LSODA, lane by lane",
        numbalsoda_lsoda,
        1.0,
        3e-2,
        "steps of its own choice, at a relative tolerance of 1e-6: nearer to the solution than steps of 1 ms",
        "numbalsoda",
    ),
}


def installed(contender: Contender) -> bool:
    """Whether the package that a contender needs is there."""
    return not contender.needs or importlib.util.find_spec(contender.needs) is not None
