"""The table of quantities: `quantities.csv` has a row for each number of a rig that may be uncertain.

Fits, warnings, `fitted.yaml`, accuracies, studies, help and docs read these rows. Numbers of the group
"configured" are known within a stated accuracy, and are fitted within it, or freely where `Problem.also`
names them. Those of the groups "cause" and "curve" are something that a user may have configured or connected
wrongly, and are fitted only where `Problem.also` names them. Those of the group "unfitted" cannot be fitted
beside the rest, and widen the intervals of the others. The atmosphere is configured where sensors are gauge,
and else unfitted. A row with a `field` acts on the plant, by `applied.with_values`; the others act on the
signals. No numerics are imported here: help texts read the rows too.
"""

from csv import DictReader
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

from pneumo.physics.models import FULL

FULL_ORDER = FULL.name  # among fitted models
MOST_RECORDS = 8  # that are fitted together; each has its own starts
PERCENT = " %"


class Quantity(NamedTuple):
    """A number: its names and units, how a fit searches it, its key, and how well it is known if stated."""

    name: str  # in warnings
    heading: str  # of a table's column
    unit: str  # of stored values
    shown_unit: str = ""  # of values in tables and texts
    factor: float = 1.0  # from stored to shown values
    group: str = ""
    low: float = 0.0  # bounds of the search, in the stored unit or as multiples of `times`
    high: float = 0.0
    times: str = ""  # field of the plant, or A_q0, the wall's area in mid-stroke
    logarithmic: bool = False  # scale of search and interval
    # Value, field of the plant, or "catalogue" or "record", which `fit_problem` computes.
    start: float | str = ""
    field: str = ""  # of the plant, as "valve.k_xu"
    key: str = ""  # of the configuration, below its section
    accuracy: float = 0.0  # half-width of the 95 % interval by default; 0: there is none
    relative: bool = False  # whether that is relative
    stated: tuple[str, ...] = ()  # keys of the configuration that state it, the first of them that is given
    default: float = nan  # with which configurations begin, and that nobody may have measured
    undetermined: float = 0.0  # accuracy of that default
    study_name: str = ""  # in studies and in the section `fitted`
    study_group: str = ""  # quantities that one measurement would settle together
    explanation: str = ""  # of a cause: sentence with its value and the configured one, in `shown_unit`


def _half_width(text: str) -> float:
    return float(text.removesuffix(PERCENT) or 0) / (100 if text.endswith(PERCENT) else 1)


def _quantity(row: dict[str, str]) -> Quantity:
    numbers = {name: float(row[name] or 0) for name in ("factor", "low", "high")}
    start = row["start"] or row["field"]
    derived = {
        "name": row["meaning"],
        "logarithmic": row["scale"] == "logarithmic",
        "start": start if not start or start[0].isalpha() else float(start),
        "accuracy": _half_width(row["accuracy"]),
        "relative": row["accuracy"].endswith(PERCENT),
        "stated": tuple(row["stated"].split()),
        "default": float(row["default"] or nan),
        "undetermined": _half_width(row["undetermined"]),
    }
    values: dict[str, Any] = {name: row[name] for name in row if name in Quantity._fields}
    values.update(numbers)
    values.update(derived)
    return Quantity(**values)


with Path(__file__).with_name("quantities.csv").open(encoding="utf-8", newline="") as _file:
    _ROWS = {row["name"]: row for row in DictReader(_file)}
QUANTITIES = {name: _quantity(row) for name, row in _ROWS.items()}
# In the order of the search; closed chambers have a search of their own.
PARAMETERS = {name: QUANTITIES[name] for name, row in _ROWS.items() if row["scale"]}


def of_group(*groups: str) -> tuple[str, ...]:
    """Names of the quantities of some groups."""
    return tuple(name for name, quantity in QUANTITIES.items() if quantity.group in groups)


def start_name(name: str, record: int) -> str:
    """Name of a first pressure or temperature of a record, counted from 0: start_A, in record 1 start_2_A."""
    stem, side = name.rsplit("_", 1)
    return f"{stem}_{record + 1}_{side}" if record else name


def _of_record(quantity: Quantity, record: int) -> Quantity:
    of = f" in record {record + 1}"
    return quantity._replace(name=quantity.name + of, heading=quantity.heading + of)


STARTS_OF_ONE = of_group("start", "first temperature")
PARAMETERS |= {
    start_name(name, record): _of_record(PARAMETERS[name], record)
    for record in range(1, MOST_RECORDS)
    for name in STARTS_OF_ONE
}
QUANTITIES |= PARAMETERS
SAG = "sag"  # of the supply
CAUSES = of_group("cause")
CONFIGURED = of_group("configured", "atmosphere")
CURVE = of_group("curve")
ALSO = (*CONFIGURED, *CAUSES, *CURVE)
VALVE_CURVE = "valve_curve"  # for users: all of `CURVE`
# What users may have fitted too, and the quantities of each.
CHOICES = {name: (name,) for name in (*CONFIGURED, *CAUSES)} | {VALVE_CURVE: CURVE}
VALVE = of_group("valve")  # of the full order only; the reduced models take the valve's from its fit
STARTS = of_group("start", "first temperature")
REPORTED = tuple(name for name in PARAMETERS if name not in (*STARTS, *ALSO))
UNFITTED = of_group("unfitted", "atmosphere")
SHIFTING = tuple(QUANTITIES[name].name for name in dict.fromkeys((*UNFITTED, *CONFIGURED)))
STUDIED = {quantity.study_name: name for name, quantity in QUANTITIES.items() if quantity.study_name}
GROUPS = ("valve", "dead volumes", "wall heat", "supply")  # of quantities of studies, in the order of tables
