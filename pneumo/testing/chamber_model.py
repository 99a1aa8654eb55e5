"""A chamber model under test: its rates at a point, its features, and runs of a shut chamber."""

import inspect
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import cos, isfinite, pi, sin
from typing import Any, NamedTuple

import numpy as np

from pneumo.configuration.experiment import Plant
from pneumo.equations.chamber_rate import chamber_rate
from pneumo.equations.named_model import model_and_index
from pneumo.equations.system import system
from pneumo.errors import InputError
from pneumo.physics.cylinder import Side, chamber_of, volume
from pneumo.physics.models import Lane, Model, full_order_lane, lane, temperature
from pneumo.physics.valve import chamber_flows, choked_flow

READABLE = ("P", "T", "x", "v", "u", "side", "plant", "n", "h")  # parameters of a function under test
FREQUENCY = 4.0  # Hz, of the piston in `ChamberModel.swing`


class Point(NamedTuple):
    """State of one chamber and its command; x, v and u are positive where they enlarge or fill it."""

    P: float  #: Pa
    T: float  #: K; models that take it from P do not read it
    x: float  #: m
    v: float  #: m/s
    u: float  #: V
    side: Side

    def __str__(self) -> str:
        state = f"P = {self.P:.6g} Pa, T = {self.T:.5g} K, x = {self.x:.4g} m, v = {self.v:.4g} m/s"
        return f"{state}, u = {self.u:.4g} V, chamber {self.side.name}"


@dataclass(frozen=True)
class ChamberModel:
    """A model under test, with its plant and what it declares."""

    function: Callable[..., Any]
    reads: frozenset[str]  #: its parameters, of `READABLE`
    plant: Plant
    n: float
    declared: Model | None  #: row whose features the model has; None: the full order, or not declared

    @property
    def tolerance(self) -> float:
        """Error of a rate over the size of its terms: eq (1) amplifies roundings to 1e-8, a step averages."""
        return 0.01 if "h" in self.reads else 1e-6

    @property
    def full(self) -> bool:
        """Whether the temperature is a state."""
        return "T" in self.reads

    @property
    def lane(self) -> Lane | None:
        """Coefficients that the model declares."""
        gamma = self.plant.gas.gamma
        if self.full:
            return full_order_lane(gamma, self.plant.wall)
        return lane(self.declared, self.n, gamma) if self.declared else None

    @property
    def features(self) -> dict[str, bool]:
        """Whether the model has each feature that a check may need."""
        gamma, valve, c, row = self.plant.gas.gamma, self.plant.valve, self.plant.conditions, self.lane
        adiabatic, isothermal = self.within(n=gamma).lane, self.within(n=1.0).lane
        limits = {"plant"} if self.full else {"plant", "n"}
        limit = "plant" in self.reads if self.full else isothermal is not None and isothermal.n_V == 1
        return {
            "no leak": valve.leak == 0,
            "no table of openings": valve.paths.knots == 0,
            "T_0 = T_amb": c.T_amb == c.T_0,
            "T as a state": self.full,
            "parameter side": "side" in self.reads,
            "parameter plant": "plant" in self.reads,
            "parameter plant or n": bool(self.reads & limits),
            "declared features (`like`)": row is not None,
            "n_in = n_out": row is None or row.n_in == row.n_out,
            "n_V = gamma at n = gamma": adiabatic is not None and adiabatic.n_V == gamma,
            "an isothermal limit, by n or k_0": limit,
            "wall heat": row is not None and row.wall_scale > 0,
            "indices gamma": row is not None and {row.n_V, row.n_in, row.n_out} == {gamma},
            "mixing": row is not None and row.mixing > 0,
            "variable temperature": self.full
            or bool(self.declared and self.declared.temperature != "constant"),
        }

    def within(self, plant: Plant | None = None, n: float | None = None) -> "ChamberModel":
        """Return the model with another plant or n, where it reads these."""
        plant = plant if plant and "plant" in self.reads else self.plant
        return replace(self, plant=plant, n=n if n and "n" in self.reads else self.n)

    def area(self, at: Point) -> float:
        """Piston area, m^2."""
        return chamber_of(self.plant.cylinder, at.side).area

    def volume(self, at: Point) -> float:
        """Volume of the chamber, m^3."""
        return volume(at.x, chamber_of(self.plant.cylinder, at.side), self.plant.cylinder)

    def work(self, at: Point) -> float:
        """Power of the air on the piston, P dV/dt, W."""
        return at.P * self.area(at) * at.v

    def temperature(self, at: Point) -> float:
        """Temperature of the air, K: the state, or what the declared law gives."""
        c = self.plant.conditions
        return at.T if self.full or not self.lane else temperature(at.P, c.P_0, c.T_0, self.lane.a)

    def valve_flows(self, at: Point) -> tuple[float, float]:
        """Mass flows into and out of the chamber by the plant's valve, kg/s: eqs (1), (2)."""
        gas, valve, c, *_ = self.plant
        return chamber_flows(at.u, at.P, self.temperature(at), valve, gas, c, at.side)

    def rates(self, at: Point, h: float = 1e-6, **changes: float) -> tuple[float, float]:
        """V dP/dt and (P V / T) dT/dt, W, at a point with changes; the second is 0 where T is no state.

        An `AssertionError` if the model raises an error or gives anything but finite numbers.
        """
        at = at._replace(**changes)
        sign, V = at.side.sign, self.volume(at)
        outside = {"x": sign * at.x, "v": sign * at.v, "u": sign * at.u, "side": at.side.name}
        known = at._asdict() | outside | {"plant": self.plant, "n": self.n, "h": h}
        try:
            result = self.function(**{name: known[name] for name in self.reads})
            numbers = [float(rate) for rate in np.ravel(result).tolist()]
        except Exception as error:
            raise AssertionError(f"{type(error).__name__}: {error}, at {at}") from error
        if len(numbers) != 1 + self.full or not all(map(isfinite, numbers)):
            raise AssertionError(f"rates {numbers}: {1 + self.full} finite numbers are needed, at {at}")
        return V * numbers[0], at.P * V / at.T * numbers[1] if self.full else 0.0

    def power(self, at: Point, **changes: float) -> float:
        """V dP/dt, W, at a point with changes."""
        return self.rates(at, **changes)[0]

    def size(self, at: Point) -> float:
        """Size of a rate's terms before they cancel, W."""
        gas, valve, c, *_ = self.plant
        area = valve.k_xu * abs(at.u) * max(1.0, valve.exhaust) + 2 * valve.leak
        flow = choked_flow(area, max(at.P, c.P_s), min(at.T, c.T_in), gas)
        flow *= gas.R * max(self.temperature(at), c.T_in)
        return gas.gamma * (flow + abs(self.work(at))) + abs(self.power(at, u=0.0, v=0.0))

    def swing(self, steps: int, cycles: float) -> list[Point]:
        """States of a shut chamber A, at rest at first, whose piston swings; steps are those of a cycle."""
        c, amplitude, h = self.plant.conditions, 0.2 * self.plant.cylinder.stroke, 1 / FREQUENCY / steps

        def at(k: float, state: np.ndarray) -> Point:
            angle, omega = 2 * pi * k / steps, 2 * pi * FREQUENCY
            P, T = state
            return Point(P, T, amplitude * sin(angle), amplitude * omega * cos(angle), 0.0, Side.A)

        def change(point: Point) -> np.ndarray:
            power, heating = self.rates(point, h)
            return h / self.volume(point) * np.array([power, heating * point.T / point.P])

        states = [np.array([c.P_0, c.T_amb])]
        for k in range(round(steps * cycles)):
            middle = states[k] if "h" in self.reads else states[k] + change(at(k, states[k])) / 2
            states.append(states[k] + change(at(k + 0.5, middle)))
        return [at(k, state) for k, state in enumerate(states)]


def chamber_model(
    model: Model | str | Callable[..., Any], plant: Plant, n: float | None, like: Model | str | None
) -> ChamberModel:
    """Model under test from a row, a name or a function; errors as in `model_checks`."""
    if isinstance(model, Model | str):
        chosen = system(model, n, plant)
        reads = {*READABLE} - ({"T", "h"} if chosen.model else {"h"})
        return ChamberModel(partial(chamber_rate, model), frozenset(reads), plant, chosen.n, chosen.model)
    parameters = inspect.signature(model).parameters.values()
    reads = {p.name for p in parameters if p.name in READABLE}
    needed = {p.name for p in parameters if p.default is p.empty}
    if not {"P", "x", "v", "u"} <= reads or needed - reads:
        raise InputError(
            f"model with the parameters {', '.join(p.name for p in parameters)}: must have P, x, v and u; may"
            f" have T, side, plant, n and h; others need a default"
        )
    declared, n = model_and_index(like, n) if like else (None, n or 1.0)
    return ChamberModel(model, frozenset(reads), plant, n, declared)
