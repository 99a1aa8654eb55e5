"""Parts of the schema: kinds of numbers, sections with one key of several, errors of conflicting values."""

import itertools
import re
from collections.abc import Iterable, Mapping
from math import inf
from typing import Annotated, Any, ClassVar, Self

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ModelWrapValidatorHandler,
    PrivateAttr,
    SerializerFunctionWrapHandler,
    model_serializer,
    model_validator,
)
from pydantic_core import PydanticCustomError

from pneumo.configuration.text_file import NUMBER
from pneumo.errors import printable


def _number(value: Any) -> Any:
    """Refuse values that pydantic would accept as numbers: booleans, text such as 1_000, non-ASCII digits."""
    if isinstance(value, bool) or (isinstance(value, str) and not NUMBER.fullmatch(value.strip())):
        raise ValueError("must be a number")
    return value


Number = Annotated[float, BeforeValidator(_number), Field(allow_inf_nan=False)]
Fraction = Annotated[Number, Field(gt=0, lt=1)]
Seconds = Annotated[Number, Field(gt=0, le=1e5)]
Frequency = Annotated[Number, Field(gt=0, le=1e4)]
Level = Annotated[Number, Field(ge=-100, le=100)]
Conductance = Annotated[Number, Field(ge=0, le=1e4)]
Name = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,39}$")]
Count = Annotated[int, BeforeValidator(_number)]


def key_of(meaning: str, default: Any = ..., *, uncertain: bool = False, **limits: Any) -> Any:
    """Key of the configuration: its meaning, its default if it has one, and its limits.

    The number of a key that is `uncertain` may have an uncertainty.
    """
    extra: dict[str, Any] | None = {"uncertain": True} if uncertain else None
    return Field(default, description=meaning, json_schema_extra=extra, **limits)


def listed(names: Iterable[Any]) -> str:
    """Names in one line of text, at most twenty."""
    first = [printable(str(name)) for name in itertools.islice(names, 21)]
    return ", ".join([*first[:20], "..."] if len(first) > 20 else first)


def conflict(value: Any, condition: str, *fields: tuple[str, ...]) -> PydanticCustomError:
    """Error for a value that conflicts with others; `fields` are their paths, first that of the value."""
    context = {"value": value, "condition": condition, "fields": fields}
    return PydanticCustomError("conflict", "{condition}", context)


def increasing(values: list[float]) -> list[float]:
    """Return numbers that increase; an error for others."""
    for before, after in itertools.pairwise(values):
        if before >= after:
            raise conflict(values, f"must increase, and {after:g} follows {before:g}", ())
    return values


def merged(base: Mapping[str, Any], override: Mapping[str, Any]) -> dict[str, Any]:
    """Copy of `base` in which keys of `override` replace its own; sections are merged key by key.

    A key replaces its alternatives too: k_0_W_per_K a lambda_0_W_per_m2K of `base`.
    """
    replaced = {
        key
        for section in Section.__subclasses__()
        if any(override.get(key) is not None for key in section.exactly_one)
        for key in section.exactly_one
    }
    result = {key: value for key, value in base.items() if key in override or key not in replaced}
    for key, value in override.items():
        inner = result.get(key)
        both = isinstance(value, Mapping) and isinstance(inner, Mapping)
        result[key] = merged(inner, value) if both else value  # type: ignore[arg-type]
    return result


UNCERTAIN = re.compile(rf"({NUMBER.pattern})\s*(?:±|\+-|\+/-)\s*({NUMBER.pattern})\s*(%?)")
MOST_PERCENT = 1e4


class Section(BaseModel):
    """A frozen section of the configuration without unknown keys.

    A number may be written with its uncertainty, 1.5 ± 0.1 or 1.5 ± 10 %, under keys that say so.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)
    exactly_one: ClassVar[tuple[str, ...]] = ()  # of these keys a section has one
    # Half-widths of 95 % intervals, by key, and % where they are relative.
    _uncertainties: dict[str, tuple[float, str]] = PrivateAttr(default_factory=dict)

    @model_validator(mode="wrap")
    @classmethod
    def _without_uncertainties(cls, value: Any, handler: ModelWrapValidatorHandler[Self]) -> Self:
        if not isinstance(value, Mapping):
            return handler(value)
        numbers, found = dict(value), dict[str, tuple[float, str]]()
        for key, given in value.items():
            extra = cls.model_fields[key].json_schema_extra if key in cls.model_fields else None
            match = UNCERTAIN.fullmatch(given.strip()) if extra and isinstance(given, str) else None
            if match is None:
                continue
            numbers[key], half_width, percent = float(match[1]), float(match[4]), match[7]
            if not 0 <= half_width <= (MOST_PERCENT if percent else inf):
                raise conflict(given, f"the uncertainty must be 0 to {MOST_PERCENT:g} %", (key,))
            if numbers[key] == 0:
                raise conflict(given, "0 cannot have an uncertainty", (key,))
            found[key] = half_width, percent
        section = handler(numbers)
        section._uncertainties.update(found)
        return section

    @model_validator(mode="after")
    def _one_of_its_alternatives(self) -> Self:
        keys = self.exactly_one
        given = [key for key in keys if getattr(self, key) is not None]
        if keys and not given:
            raise conflict(None, f"or give {', '.join(keys[1:])}", keys[:1])
        if len(given) > 1:
            condition = f"conflicts with {given[1]}; give only one"
            raise conflict(getattr(self, given[0]), condition, (given[0],), (given[1],))
        return self

    @model_serializer(mode="wrap")
    def _with_uncertainties(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        content = handler(self)
        for key, (half_width, percent) in self._uncertainties.items():
            if content.get(key) is not None:
                content[key] = f"{content[key]!r} ± {half_width!r}{' %' if percent else ''}"
        return content

    def uncertainty(self, key: str, *, relative: bool = False) -> float | None:
        """Half-width of the 95 % interval of a key's number, in its unit or `relative`; None if not given."""
        value, (half_width, percent) = getattr(self, key), self._uncertainties.get(key, (None, ""))
        if half_width is None or value is None:
            return None
        half_width *= abs(value) / 100 if percent else 1
        return half_width / abs(value) if relative else half_width
