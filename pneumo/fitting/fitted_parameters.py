"""Parameters of `pneumo fit`: the rows of ``parameters.csv``, for the fit, warnings, files, help and docs.

Those of the group "configured" are known within a stated accuracy, and are fitted within it, or freely where
`Problem.also` names them. Those of the groups "cause" and "curve" are something that a user may have
configured or connected wrongly, and are fitted only where `Problem.also` names them. If a search starts at a
field of the plant, the fitted value replaces that field in the replay; `fit_problem` applies the others, such
as offsets of the pressure sensors. No numerics are imported here: help texts read the rows too.
"""

from csv import DictReader
from pathlib import Path
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
    times: str  # field of the plant, or A_q0, the wall's area in mid-stroke
    logarithmic: bool  # scale of search and interval


class Parameter(NamedTuple):
    """A number that a fit may vary: its quantity, how the search scales and bounds it, and its texts."""

    quantity: Quantity
    search: Search
    group: str
    key: str  # of the configuration, below its section
    explanation: str  # of a cause: sentence with its value and the configured one, in `shown_unit`


def _quantity(row: dict[str, str]) -> Quantity:
    return Quantity(row["meaning"], row["heading"], row["unit"], row["shown_unit"], float(row["factor"]))


def _parameter(row: dict[str, str]) -> Parameter:
    start = row["start"]
    search = Search(
        low=float(row["low"]),
        high=float(row["high"]),
        start=start if start[0].isalpha() else float(start),
        times=row["times"],
        logarithmic=row["scale"] == "logarithmic",
    )
    return Parameter(_quantity(row), search, row["group"], row["key"], row["explanation"])


with Path(__file__).with_name("parameters.csv").open(encoding="utf-8", newline="") as _file:
    _ROWS = {row["name"]: row for row in DictReader(_file)}
QUANTITIES = {name: _quantity(row) for name, row in _ROWS.items()}
# In the order of the search; closed chambers have a search of their own.
PARAMETERS = {name: _parameter(row) for name, row in _ROWS.items() if row["scale"]}


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
QUANTITIES |= {name: row.quantity for name, row in PARAMETERS.items()}
CAUSES = of_group("cause")
CONFIGURED = of_group("configured")
CURVE = of_group("curve")
ALSO = (*CONFIGURED, *CAUSES, *CURVE)
VALVE_CURVE = "valve_curve"  # for users: all of `CURVE`
CHOICES = (*CONFIGURED, *CAUSES, VALVE_CURVE)  # that users may have fitted too
VALVE = of_group("valve")  # of the full order only; the reduced models take the valve's from its fit
STARTS = of_group("start", "first temperature")
REPORTED = tuple(name for name in PARAMETERS if name not in (*STARTS, *ALSO))

# Quantities that are configured and not fitted; `configured_quantities` has the problem with each changed.
UNFITTED = (
    *("the bore", "the stroke", "the zero of x", "the scale of x", "T_amb", "P_atm"),
    *("the gain of P_A", "the gain of P_B", "the gain of P_s"),
)
SHIFTING = (*UNFITTED, *(PARAMETERS[name].quantity.name for name in CONFIGURED))
