"""Columns of a measurement: which quantity each channel holds, and in which unit."""

import json
import re
import shlex
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import pandas as pd
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from pneumo.configuration.plain_yaml import parse_yaml, read_yaml
from pneumo.errors import InputError, printable
from pneumo.fitting.record.channel import PATH, TIME, Channel, is_time
from pneumo.fitting.record.units import (
    ON_OFF,
    PLAIN,
    QUANTITIES,
    Reading,
    Surroundings,
    is_unit,
    plain_unit,
    reading,
)

NAME = rf"t|u|x|T|[Pp]_?[ABabs]|m_A|m_B|{TIME}"
SIDES = str.maketrans("ab", "AB")  # of a pressure's name
SUFFIX = r"[A-Za-z]+\S*(?:\s?[\[(]\w+[\])])?|[^\w\s].*"  # kPa, bar [abs], °C
HEADER = re.compile(
    rf"\s*(?P<name>{NAME})\s*(?:[\[(](?P<unit>.+)[\])]|[_ ]+(?P<suffix>{SUFFIX})|/\s*(?P<per>.+))?\s*"
)
LABEL = re.compile(r"(.+?)(?:\s*[\[(](.+)[\])]|[_ ]+([^\w\s]\S*))?")  # name and unit elsewhere
MOST_NAMED = 8  # columns that a message names
LIKELY = {"t": "s", "u": "V", "x": "mm", "T": "degC", **dict.fromkeys(("m_A", "m_B"), "kg/s")}
LIKELY |= dict.fromkeys(("P_A", "P_B", "P_s"), "bar")
SHUT = "; if the valve was shut all the time: --closed both"
TWO_COMMANDS = (
    "column u_B: a record of a valve for each chamber cannot be fitted by its commands: measure the flows"
    " m_A and m_B in their place"
)
GUESSES = {  # names of columns in other laboratories, in small letters and digits
    "t": re.compile(r"t|(time|zeit|temps|tempo)\w*"),
    "u": re.compile(r"[rfbi]?(u|(u|ventil|valve)?(command|cmd|ventil|valve|stell\w*|spannung|voltage))"),
    "x": re.compile(r"[rf]?(x|s|(act)?pos(ition)?|weg|hub|lage|stroke|displacement)"),
    "P_A": re.compile(r"[rf]?(p|pres|druck|pressure|pression)(a|1)"),
    "P_B": re.compile(r"[rf]?(p|pres|druck|pressure|pression)(b|2)"),
    "P_s": re.compile(r"[rf]?(p|pres|druck|pressure|pression)(s|0|supply)"),
    "T": re.compile(r"temp(eratur)?e?"),
    "m_A": re.compile(r"[rf]?(m|q|flow|massflow)(a|1)"),
    "m_B": re.compile(r"[rf]?(m|q|flow|massflow)(b|2)"),
}


class Column(BaseModel):
    """Column of a file that holds a quantity, and its unit there."""

    model_config = ConfigDict(extra="forbid", coerce_numbers_to_str=True)  # names may be numbers
    column: Annotated[str, Field(min_length=1)]
    unit: str  # of `scale` times the number in the file, plus `offset`
    scale: Annotated[float, Field(allow_inf_nan=False)] = 1.0
    offset: Annotated[float, Field(allow_inf_nan=False)] = 0.0

    def reading(self, path: Path, quantity: str, around: Surroundings, proposed: str = "") -> Reading:
        """Factor and offset that convert the column's numbers to SI units, and the unit in full.

        `InputError` if the quantity has no such unit; where there is none, it ends with the text `proposed`.
        """
        found = reading(quantity, self.unit, around)
        if isinstance(found, str):
            name = printable(self.column, 30)
            raise InputError(f"{path}: column {name}: {found}{'' if self.unit else proposed}")
        offset = found.factor * self.offset + found.offset
        return found._replace(factor=found.factor * self.scale, offset=offset)


Quantity = Literal["t", "u", "x", "P_A", "P_B", "P_s", "m_A", "m_B", "T"]
MAPPING = TypeAdapter(dict[Quantity, Column])
Columns = Mapping[str, Column | Mapping[str, Any]]  # by quantity


def read_mapping(source: str | Mapping[str, Any]) -> dict[str, Column]:
    """Columns by quantity, from YAML such as `{P_A: {column: "pressure 1", unit: kPa}}`, a file or a mapping.

    `InputError` if a key is no quantity, or column or unit is missing.
    """
    given = isinstance(source, Mapping)
    name = "columns" if given else "--columns" if source.lstrip().startswith("{") else source
    try:
        content = source if given else parse_yaml(source, name) if name != source else read_yaml(Path(source))
        return {str(quantity): column for quantity, column in MAPPING.validate_python(content).items()}
    except ValidationError as error:
        first = error.errors(include_url=False)[0]
        field = ".".join(str(part) for part in first["loc"] if part != "[key]")
        expected = f"must be one of {', '.join(QUANTITIES)}, each with column and unit"
        raise InputError(f"{name}: {printable(field)}: {expected}") from None


def columns_of(mapping: Columns | None, channels: Sequence[Channel]) -> dict[str, Column]:
    """Columns by quantity, as given or else by header; t by header where it is not given.

    `InputError` if a file has the commands of two valves, and no mapping says which one to read.
    """
    if not mapping:
        found = columns_by_header(channels)
        ends = [PATH.sub("", channel.name).strip().lower() for channel in channels]
        if any(end.startswith("u_b") for end in ends) and "m_A" not in found:
            raise InputError(TWO_COMMANDS)
        return found
    times = [channel for channel in channels if is_time(channel.name) or _is_unit_of_time(channel)]
    return columns_by_header(times) | read_mapping(mapping)


def _is_unit_of_time(channel: Channel) -> bool:
    return isinstance(reading("t", _unit(channel.name, channel.unit)), Reading)


def columns_by_header(channels: Sequence[Channel]) -> dict[str, Column]:
    """Columns by quantity, from names such as `P_A_kPa`, `P_A [bar abs]`, `/bench/P_A (bar(g))` or `T_°C`.

    The last part of a path counts where no channel has the whole name. `InputError` if two name a quantity.
    """
    clocks = {channel.clock.name for channel in channels if channel.clock is not None}
    found = dict[str, dict[int, list[Column]]]()  # by quantity and rank, of which the lowest counts
    for channel in channels:
        for of_path, name in enumerate((channel.name, PATH.sub("", channel.name))):
            quantity, unit = _name_and_unit(name)
            if not quantity or (quantity == "t" and channel.name in clocks):
                continue
            if channel.unit and unit and not is_unit(unit):
                continue  # T_low
            unit = channel.unit or unit
            if quantity == "u" and not unit and _is_on_off(channel):
                unit = ON_OFF
            rank = of_path if not unit or channel.unit or is_unit(unit) else 2
            if not name.strip().startswith(quantity):
                rank += 3  # Time, beside t; P, beside P_A
            column = Column(column=channel.name, unit=plain_unit(unit))
            found.setdefault(quantity, {}).setdefault(rank, []).append(column)
            break
    best = {quantity: ranked[min(ranked)] for quantity, ranked in found.items()}
    timed = [c for c in channels if c.name not in clocks and _is_unit_of_time(c)]
    if "t" not in best and len(timed) == 1:
        (channel,) = timed
        best["t"] = [Column(column=channel.name, unit=_unit(channel.name, channel.unit))]
    for quantity, columns in best.items():
        if len(columns) > 1:
            both = " and ".join(repr(printable(column.column, 30)) for column in columns[:2])
            firsts = {name: some[0] for name, some in best.items()}
            raise InputError(f"columns {both}: both are {quantity}{proposal(firsts)}")
    return {quantity: columns[0] for quantity, columns in best.items()}


def _is_on_off(channel: Channel) -> bool:
    """Whether a command has two states: 0 and 1, or words such as TRUE and FALSE."""
    states = {str(value).strip().lower() for value in pd.unique(channel.values)[:5]}
    return states - {"", "nan"} in ({"0", "1"}, {"0.0", "1.0"}, {"true", "false"}, {"on", "off"})


def clock_unit(clock: Channel, columns: Mapping[str, Column]) -> str:
    """Unit of a channel's own times: of the channel, in its name, or else that of the column t."""
    t = columns.get("t")
    names = (clock.name, PATH.sub("", clock.name))
    own = clock.unit or next((unit for _, unit in map(_name_and_unit, names) if unit), "")
    own = "" if t and t.column == clock.name else own
    return own or (t.unit if t else "")


def missing_columns(channels: Sequence[Channel], known: Mapping[str, Column], missing: Sequence[str]) -> str:
    """Text for a message on missing quantities, with the option ``--columns`` for a shell.

    It has columns that are guessed by their names or else their order, if there are enough.
    """
    guessed = _guessed(channels, known, missing)
    hint = SHUT if "u" in missing else ""
    text = (
        f"must have a header such as {missing[0]}_{LIKELY[missing[0]]}, or be named with --columns; columns:"
        f" {_listed(channels)}{hint}"
    )
    if len(guessed) < len(missing):
        return text
    return text + proposal({**known, **guessed})


def proposal(columns: Mapping[str, Column]) -> str:
    """Text with the option ``--columns`` for a shell; units that are missing are the usual ones."""
    content = {
        q: column.model_dump(exclude_defaults=True) | {"unit": _likely(q, column.unit)}
        for q, column in columns.items()
    }
    return f"; to check and complete: --columns {shlex.quote(json.dumps(content, ensure_ascii=False))}"


def _guessed(
    channels: Sequence[Channel], known: Mapping[str, Column], missing: Sequence[str]
) -> dict[str, Column]:
    """Columns of missing quantities, by names in other laboratories or a unit of time; others by order."""
    used = {column.column for column in known.values()}
    left_over = [channel for channel in channels if channel.name not in used]
    free = {channel.name: channel.unit for channel in left_over}
    timed = [channel.name for channel in left_over if _is_unit_of_time(channel)]
    names = dict[str, str]()
    for quantity in missing:
        labels = ((name, _foreign(label)[0]) for name in free for label in (name, PATH.sub("", name)))
        by_name = [name for name, label in labels if GUESSES[quantity].fullmatch(label) and name not in names]
        by_name += timed if quantity == "t" and len(timed) == 1 else []
        names |= {name: quantity for name in by_name[:1]}
    left = [quantity for quantity in QUANTITIES if quantity in {*missing} - {*names.values()}]
    by_order = [c.name for c in left_over if c.name not in names and _is_signal(c)]
    names |= dict(zip(by_order, left, strict=False))
    return {quantity: Column(column=name, unit=_unit(name, free[name])) for name, quantity in names.items()}


def _is_signal(channel: Channel) -> bool:
    """Whether a channel has numbers that change, and not those of samples."""
    if channel.values.dtype.kind not in "iuf":
        return False
    steps = np.diff(channel.values)
    return bool(np.isfinite(steps).any() and np.any(steps != steps[0]))


def _unit(name: str, unit: str) -> str:
    """Unit of a channel: its own, or that in its name."""
    return plain_unit(unit or _foreign(name)[1])


def _likely(quantity: str, unit: str) -> str:
    """Unit of a proposal: the usual one where none is written, or one of something else."""
    return unit if unit and isinstance(reading(quantity, unit), Reading) else LIKELY[quantity]


def _listed(channels: Sequence[Channel]) -> str:
    """Names of channels, not too many."""
    names = [printable(channel.name, 30) for channel in channels]
    more = f" and {len(names) - MOST_NAMED} more" if len(names) > MOST_NAMED else ""
    return f"{', '.join(names[:MOST_NAMED])}{more}"


def unused_note(channels: Sequence[Channel], columns: Mapping[str, Column]) -> list[str]:
    """Note on channels that were not read."""
    used = {column.column for column in columns.values()}
    used |= {channel.clock.name for channel in channels if channel.clock is not None}
    unused = [channel for channel in channels if channel.name not in used]
    return [f"columns not used: {_listed(unused)}"] if unused else []


def _foreign(header: str) -> tuple[str, str]:
    """Letters and digits of a header in lower case, and the unit behind them: in brackets, or a sign."""
    match = LABEL.fullmatch(header.strip())
    name, *units = match.groups("") if match else (header, "")
    return re.sub(r"[\W_]", "", name.lower()), "".join(units)


def _name_and_unit(name: str) -> tuple[str, str]:
    """Quantity and unit of a header such as `pA [bar]` or `t/s`; no unit for `P_A` or `X_Value`."""
    match = HEADER.fullmatch(name.translate(PLAIN))
    if match is None:
        return "", ""
    name, per = match["name"], match["per"] or ""
    if name[0] in "Pp":
        name = f"P_{name[-1].translate(SIDES)}"
    quantity = name if name in QUANTITIES else "t"
    unit = (match["unit"] or match["suffix"] or per).replace("_per_s", "/s")
    sure = not per and (not match["suffix"] or unit.isalpha())
    return (quantity, unit) if sure or isinstance(reading(quantity, unit), Reading) else ("", "")
