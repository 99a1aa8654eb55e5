"""The ten reduced-order models of section 3 as one table and one right-hand side.

The models differ in six fields of `Model`. All that uses models (replays, Table 1, property tests, exports)
derives from `MODELS`; a new model is a new row. `FULL` is the row of the full order.
"""

from typing import Literal, NamedTuple

import numpy as np

from pneumo.physics.chamber import dP_dt, wall_conductance, wall_heat

Index = Literal["n", "gamma"] | float
Wall = Literal["none", "k_0", "lambda_0 A_q", "lambda A_q"]


class Model(NamedTuple):
    """A reduced-order model: one row of the table `MODELS`."""

    name: str  #: paper's name, M1 ... M10
    n_V: Index  #: index on the volume term of eq (10)
    n_in: Index  #: index on the inflow term
    n_out: Index  #: index on the outflow term
    temperature: Literal["constant", "polytropic", "state"]  #: T = T_0, eq (6), or eq (5) of the full order
    mixing: bool  #: whether inflow enters at T_in (mixing) or at the chamber's T
    #: Explicit wall heat by eq (13), eq (11) or eq (7), or none.
    wall: Wall

    @property
    def has_n(self) -> bool:
        """Whether the polytropic index n plays a role in this model."""
        return "n" in (self.n_V, self.n_in, self.n_out) or self.temperature == "polytropic"


# fmt: off
MODELS: dict[str, Model] = {model.name: model for model in (
    #     name   n_V      n_in     n_out    temperature   mixing  wall
    Model("M1",  1.0,     1.0,     1.0,     "constant",   False,  "none"),
    Model("M2",  "n",     "n",     "n",     "constant",   False,  "none"),
    Model("M3",  "gamma", "gamma", "gamma", "constant",   False,  "none"),
    Model("M4",  1.2,     1.4,     1.0,     "constant",   False,  "none"),
    Model("M5",  "n",     "n",     "n",     "polytropic", False,  "none"),
    Model("M6",  "n",     "n",     "n",     "polytropic", True,   "none"),
    Model("M7",  "gamma", "gamma", "gamma", "polytropic", False,  "k_0"),
    Model("M8",  "gamma", "gamma", "gamma", "polytropic", True,   "k_0"),
    Model("M9",  "gamma", "gamma", "gamma", "polytropic", True,   "lambda_0 A_q"),
    Model("M10", "gamma", "gamma", "gamma", "polytropic", True,   "lambda A_q"),
)}
# fmt: on
# The full order: eqs (4), (5), (7), (8).
FULL = Model("full", "gamma", "gamma", "gamma", "state", mixing=True, wall="lambda A_q")

# Wall law -> (`Lane.wall_scale`, exponent of A_q / A_q0, exponent of PT / (P_0 T_0)).
WALL_LAWS = {
    "none": (0.0, 0.0, 0.0),
    "k_0": (1.0, 0.0, 0.0),  # (13)
    "lambda_0 A_q": (1.0, 1.0, 0.0),  # (11)
    "lambda A_q": (1.0, 1.0, 0.5),  # (7), (8)
}


class WallLaw(NamedTuple):
    """Law of the conductance of a wall, k_0 (A_q / A_q0)^e_A (PT / P_0 T_0)^e_PT: by default eq (8)."""

    e_A: float = 1.0  #: exponent of the wall's area
    e_PT: float = 0.5  #: exponent of pressure times temperature


EQ_8 = WallLaw()
# Names of the laws of a full order's wall in a configuration.
FULL_ORDER_WALLS: dict[str, Wall] = {"area_PT": "lambda A_q", "area": "lambda_0 A_q", "constant": "k_0"}


def wall_law(wall: Wall) -> WallLaw:
    """Exponents of a law of `WALL_LAWS`."""
    _, e_A, e_PT = WALL_LAWS[wall]
    return WallLaw(e_A, e_PT)


class Lane(NamedTuple):
    """Coefficients of one model at one n, or of the full order, as the core reads them.

    `lane` sets `flow_scale` to 1, and `wall_scale` to 1 or, without wall heat, to 0. A fit sets others; so
    does a replay with a wrong k_0.
    """

    n_V: float  #: index on the volume term
    n_in: float  #: index on the inflow term
    n_out: float  #: index on the outflow term
    a: float  #: exponent of the temperature law, (n - 1)/n, or 0 for constant temperature
    mixing: float  #: 1 where inflow enters at T_in, 0 where it enters at the chamber's T
    flow_scale: float  #: mass flows of this lane over those of the plant's valve
    wall_scale: float  #: k_0 of this lane over the plant's; 0 without explicit wall heat
    e_A: float  #: exponent of A_q / A_q0 in the wall law
    e_PT: float  #: exponent of PT / (P_0 T_0) in the wall law
    full: float = 0.0  #: 1 where the temperature is a state, by eq (5); 0 where it follows by eq (6)


def lane(model: Model, n: float, gamma: float) -> Lane:
    """Coefficients of a model at one polytropic index n; a model without n (see `Model.has_n`) ignores it."""

    def value(index: Index) -> float:
        return n if index == "n" else gamma if index == "gamma" else index

    a = (n - 1) / n if model.temperature == "polytropic" else 0.0
    wall_scale, e_A, e_PT = WALL_LAWS[model.wall]
    return Lane(
        n_V=value(model.n_V),
        n_in=value(model.n_in),
        n_out=value(model.n_out),
        a=a,
        mixing=float(model.mixing),
        flow_scale=1.0,
        wall_scale=wall_scale,
        e_A=e_A,
        e_PT=e_PT,
        full=float(model.temperature == "state"),
    )


def full_order_lane(gamma: float, wall: WallLaw = EQ_8, wall_scale: float = 1.0) -> Lane:
    """Coefficients of `FULL`, or with another wall: its law, and its k_0 over the plant's, 0 if adiabatic."""
    return lane(FULL, 1.0, gamma)._replace(wall_scale=wall_scale, **wall._asdict())


def temperature(P: float, P_0: float, T_0: float, a: float) -> float:
    """Temperature that a model assigns to a pressure, K: eq (6); constant where a = 0."""
    return T_0 * (P / P_0) ** a  # (6)


def model_dP_dt(
    P: float,
    T: float,
    V: float,
    dV_dt: float,
    m_in: float,
    m_out: float,
    area_ratio: float,
    k_0: float,
    P_0: float,
    T_0: float,
    T_in: float,
    T_amb: float,
    R: float,
    gamma: float,
    lane: Lane,
) -> float:
    """Rate of pressure of a chamber by any reduced model, Pa/s.

    P in Pa, V in m^3, dV_dt in m^3/s, mass flows m_in and m_out in kg/s; all may be arrays or symbols. T, K,
    is the result of `temperature` for P; outflow has this temperature too. `area_ratio` is A_q(x) / A_q(x_0);
    k_0 is the thermal conductance of the wall at equilibrium, W/K; `lane` holds the coefficients of model and
    n.
    """
    T_inlet = lane.mixing * T_in + (1 - lane.mixing) * T
    conductance = wall_conductance(k_0, area_ratio, P * T / (P_0 * T_0), lane.e_A, lane.e_PT)
    heat = lane.wall_scale * wall_heat(T, conductance, T_amb)
    n_in, n_out = lane.n_in * lane.flow_scale, lane.n_out * lane.flow_scale
    return dP_dt(P, T, V, dV_dt, m_in, m_out, T_inlet, heat, lane.n_V, n_in, n_out, R, gamma)


def lane_array(lanes: list[Lane]) -> np.ndarray:
    """Array of coefficients for the core: a row for each lane (a model at one n, or a full order)."""
    return np.array(lanes, dtype=float).reshape(len(lanes), len(Lane._fields))
