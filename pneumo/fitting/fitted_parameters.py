"""Parameters of `pneumo fit`: tables for the fit, warnings, files, help and docs.

Those of the group "configured" are known within a stated accuracy, and are fitted within it. Those of the
group "cause" are something that a user may have configured or connected wrongly. If their search starts at a
field of the plant, the fitted value replaces that field in the replay; `fit_problem` applies the others, such
as offsets of the pressure sensors. The tables import no numerics: help texts read them too.
"""

from typing import NamedTuple

from pneumo.fitting.settings import MOST_RECORDS

FULL_ORDER = "full"  # name of the full-order chambers among fitted models


class Quantity(NamedTuple):
    """Names and units of a number that a fit finds."""

    name: str  # in warnings
    heading: str  # of a table's column
    unit: str  # of stored values
    shown_unit: str = ""  # of values in tables and texts
    factor: float = 1.0  # from stored to shown values


class Search(NamedTuple):
    """Bounds, start and scale of a search; a field of the plant is written as "valve.k_xu"."""

    low: float  # bounds, in the stored unit or as multiples of `times`
    high: float
    start: float | str  # value, field of the plant, or "catalogue" or "record": `fit_problem` computes these
    times: str = ""  # field of the plant, or A_q0, the wall's area in mid-stroke
    logarithmic: bool = True  # scale of search and interval


class Parameter(NamedTuple):
    """A number that a fit may vary: its quantity, how the search scales and bounds it, and its texts."""

    quantity: Quantity
    search: Search
    group: str  # of `SEARCHES`
    key: str = ""  # of the configuration, below its section
    explanation: str = ""  # of a cause: sentence with its value and the configured one, in `shown_unit`


QUANTITIES = {  # in the order of the search
    "n": Quantity("n", "n", "1"),
    "k_0": Quantity("k_0", "k_0", "W K-1", "W/K"),
    "k_xu": Quantity("the valve coefficient", "k_x k_u", "m2 V-1", "mm²/V", 1e6),
    **{f"V_d_{c}": Quantity(f"the dead volume of {c}", f"V_d of {c}", "m3", "cm³", 1e6) for c in "AB"},
    "start_A": Quantity("the first pressure of A", "first P of A", "Pa", "kPa", 1e-3),
    "start_B": Quantity("the first pressure of B", "first P of B", "Pa", "kPa", 1e-3),
    "lag": Quantity("the valve's lag", "lag", "s", "ms", 1e3),
    "dead_time": Quantity("the valve's dead time", "dead time", "s", "ms", 1e3),
    "null": Quantity("the valve's null offset", "null offset", "V", "V"),
    **{f"start_T_{c}": Quantity(f"the first temperature of {c}", f"first T of {c}", "K", "K") for c in "AB"},
    "b": Quantity("the critical pressure ratio", "b", "1"),
    "P_s": Quantity("the supply pressure", "supply", "Pa", "kPa", 1e-3),
    "exhaust": Quantity("the exhaust path", "exhaust ratio", "1"),
    "T_in": Quantity("the supply's temperature", "T_in", "K", "K"),
    "A_B": Quantity("the piston area of B", "area of B", "m2", "mm²", 1e6),
    "C_B": Quantity("the valve's side of B", "side of B over A", "1"),
    "dead_band": Quantity("the valve's dead band", "dead band", "V", "V"),
    "hysteresis": Quantity("the valve's hysteresis", "hysteresis", "V", "V"),
    # The valve's conductance at parts of the record's largest command, each over that at the next: it rises.
    "curve_eighth": Quantity("the valve's C at 1/8 of the largest command over 1/4", "C 1/8 / 1/4", "1"),
    "curve_quarter": Quantity("the valve's C at 1/4 of the largest command over 1/2", "C 1/4 / 1/2", "1"),
    "curve_half": Quantity("the valve's C at 1/2 of the largest command over 1", "C 1/2 / 1", "1"),
    "sag": Quantity("the sag of the supply", "sag of supply", "1"),
    "piston_leak": Quantity("the leak past the piston", "piston leak", "1", "%", 1e2),
    "valve_leak": Quantity("the leak of the valve's paths", "valve leak", "1", "%", 1e2),
    "skew": Quantity("the delay of x", "delay of x", "s", "ms", 1e3),
    "filter": Quantity("the filter of the pressures", "filter of P", "s", "ms", 1e3),
    "offset_A": Quantity("the offset of the sensor of P_A", "offset P_A", "Pa", "kPa", 1e-3),
    "offset_B": Quantity("the offset of the sensor of P_B", "offset P_B", "Pa", "kPa", 1e-3),
}
SEARCHES: dict[str, dict[str, Search]] = {  # by group
    "index": {"n": Search(0.8, 1.8, 1.2, logarithmic=False)},
    "wall": {"k_0": Search(0.3, 1000.0, "catalogue", times="A_q0")},
    "flow": {"k_xu": Search(0.05, 20.0, "valve.k_xu", times="valve.k_xu")},
    "dead volume": {
        f"V_d_{c}": Search(0.02, 50.0, f"cylinder.V_d_{c}", times=f"cylinder.V_d_{c}") for c in "AB"
    },
    "start": {f"start_{c}": Search(0.1, 3.0, "record", times="conditions.P_0") for c in "AB"},
    "valve": {  # of the full order only; the reduced models take the valve's from its fit
        "lag": Search(0.0, 0.05, 0.0, logarithmic=False),
        "dead_time": Search(-0.02, 0.05, 0.0, logarithmic=False),
        "null": Search(-0.1, 0.1, 0.0, times="valve.u_max", logarithmic=False),
    },
    "first temperature": {
        f"start_T_{c}": Search(0.7, 1.4, "conditions.T_0", times="conditions.T_0") for c in "AB"
    },
    "configured": {  # fitted within the configuration's accuracy, or freely where `Problem.also` names them
        "b": Search(0.02, 0.8, "gas.critical_ratio", logarithmic=False),
        "P_s": Search(0.5, 2.0, "conditions.P_s", times="conditions.P_s"),
        "exhaust": Search(0.2, 5.0, "valve.exhaust"),
        "T_in": Search(0.8, 1.25, "conditions.T_in", times="conditions.T_in", logarithmic=False),
    },
    "cause": {  # fitted only where `Problem.also` names them
        "A_B": Search(0.5, 2.0, "cylinder.A_B", times="cylinder.A_B"),
        "C_B": Search(0.3, 3.0, 1.0),
        "dead_band": Search(0.0, 0.2, 0.0, times="valve.u_max", logarithmic=False),
        "hysteresis": Search(0.0, 0.1, 0.0, times="valve.u_max", logarithmic=False),
        "sag": Search(0.0, 0.6, 0.0, logarithmic=False),
        **dict.fromkeys(("piston_leak", "valve_leak"), Search(0.0, 0.3, 0.0, logarithmic=False)),
        "skew": Search(-0.03, 0.03, 0.0, logarithmic=False),
        "filter": Search(0.0, 0.05, 0.0, logarithmic=False),
        **dict.fromkeys(("offset_A", "offset_B"), Search(-1e5, 1e5, 0.0, logarithmic=False)),
    },
    "curve": dict.fromkeys(
        ("curve_eighth", "curve_quarter", "curve_half"), Search(0.02, 1.0, 0.5, logarithmic=False)
    ),
}
KEYS = {
    "k_0": "experiments.k_0_W_per_K",
    "k_xu": "cylinders.k_x_k_u_m2_per_V",  # or C in its section valve
    "V_d_A": "cylinders.dead_volume_m3",
    "V_d_B": "cylinders.dead_volume_B_m3",
    "lag": "cylinders.valve_dynamics.lag_s",
    "dead_time": "cylinders.valve_dynamics.dead_time_s",
    "null": "cylinders.valve_dynamics.null_V",
    "b": "cylinders.valve.b",
    "P_s": "supply.P_s_Pa",
    "exhaust": "cylinders.valve.exhaust_ratio",
    "T_in": "supply.T_in_K",
    "dead_band": "cylinders.valve_dynamics.dead_band_V",
}
EXPLANATIONS = {
    "b": "a critical pressure ratio b of {:.3g} (configured: {:.3g})",
    "P_s": "a supply of {:.4g} kPa (configured: {:.4g})",
    "exhaust": "an exhaust path of {:.3g} times the area of the supply's (configured: {:.3g})",
    "T_in": "a supply at {:.4g} K (configured: {:.4g})",
    "A_B": "a piston area of {:.4g} mm² in chamber B (configured: {:.4g}; is the rod right?)",
    "C_B": "a valve whose side of B has {:.3g} times the area of that of A (configured: {:.3g})",
    "dead_band": "a dead band of the valve of {:.2g} V to either side",
    "hysteresis": "a hysteresis of the valve of {:.2g} V to either side",
    **dict.fromkeys(SEARCHES["curve"], "a valve whose flow is not proportional to the command"),
    "sag": "a supply that sags by a fraction of {:.2g} at full flow",
    "piston_leak": "a leak past the piston of {:.2g} % of the valve's C",
    "valve_leak": "a leak of each path of the valve of {:.2g} % of its C",
    "skew": "an x logged {:.2g} ms later than the pressures",
    "filter": "pressures filtered or averaged over some {:.2g} ms",
    "offset_A": "an offset of {:.3g} kPa of the sensor of P_A",
    "offset_B": "an offset of {:.3g} kPa of the sensor of P_B",
}
PARAMETERS = {
    name: Parameter(quantity, rows[name], group, KEYS.get(name, ""), EXPLANATIONS.get(name, ""))
    for name, quantity in QUANTITIES.items()
    for group, rows in SEARCHES.items()
    if name in rows
}


def of_group(*groups: str) -> tuple[str, ...]:
    """Names of the parameters of some groups."""
    return tuple(name for name, parameter in PARAMETERS.items() if parameter.group in groups)


def start_name(name: str, record: int) -> str:
    """Name of a first pressure or temperature of a record, counted from 0: start_A, in record 1 start_2_A."""
    stem, side = name.rsplit("_", 1)
    return f"{stem}_{record + 1}_{side}" if record else name


def _of_record(row: Parameter, record: int) -> Parameter:
    q, of = row.quantity, f" in record {record + 1}"
    return row._replace(quantity=q._replace(name=q.name + of, heading=q.heading + of))


STARTS_OF_ONE = of_group("start", "first temperature")
PARAMETERS |= {
    start_name(name, record): _of_record(PARAMETERS[name], record)
    for record in range(1, MOST_RECORDS)
    for name in STARTS_OF_ONE
}
CAUSES = of_group("cause")
CONFIGURED = of_group("configured")
CURVE = of_group("curve")
ALSO = (*CONFIGURED, *CAUSES, *CURVE)
VALVE_CURVE = "valve_curve"  # for users: all of `CURVE`
CHOICES = (*CONFIGURED, *CAUSES, VALVE_CURVE)  # that users may have fitted too
VALVE = of_group("valve")
STARTS = of_group("start", "first temperature")
REPORTED = tuple(name for name in PARAMETERS if name not in (*STARTS, *ALSO))

# Quantities that are configured and not fitted; `configured_quantities` has the problem with each changed.
UNFITTED = (
    *("the bore", "the stroke", "the zero of x", "the scale of x", "T_amb", "P_atm"),
    *("the gain of P_A", "the gain of P_B", "the gain of P_s"),
)
SHIFTING = (*UNFITTED, *(PARAMETERS[name].quantity.name for name in CONFIGURED))

# Found in fits of closed chambers besides n, k_0 and the dead volumes.
OF_CLOSED_CHAMBERS = {
    **{f"k_0_{c}": Quantity(f"k_0 of {c}", f"k_0 of {c}", "W K-1", "W/K") for c in "AB"},
    "leak": Quantity("the leakage past the piston", "leakage A to B", "kg s-1 Pa-1", "mg/(s bar)", 1e11),
    **{f"T_{c}": Quantity(f"the first temperature of {c}", f"first T of {c}", "K", "K") for c in "AB"},
}
QUANTITIES |= {name: row.quantity for name, row in PARAMETERS.items()} | OF_CLOSED_CHAMBERS
