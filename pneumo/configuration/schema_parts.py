"""Parts of the schema: kinds of numbers, sections with one key of two, and errors of conflicting values."""

import itertools
from collections.abc import Iterable, Mapping
from typing import Annotated, Any

from pydantic import BaseModel, BeforeValidator, ConfigDict, Field
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
Name = Annotated[str, Field(pattern=r"^[A-Za-z][\w-]{0,39}$")]
Count = Annotated[int, BeforeValidator(_number)]


def key_of(meaning: str, default: Any = ..., **limits: Any) -> Any:
    """Key of the configuration: its meaning, its default if it has one, and its limits."""
    return Field(default, description=meaning, **limits)


def listed(names: Iterable[Any]) -> str:
    """Names in one line of text, at most twenty."""
    first = [printable(str(name)) for name in itertools.islice(names, 21)]
    return ", ".join([*first[:20], "..."] if len(first) > 20 else first)


def conflict(value: Any, condition: str, *fields: tuple[str, ...]) -> PydanticCustomError:
    """Error for a value that conflicts with others; `fields` are their paths, first that of the value."""
    context = {"value": value, "condition": condition, "fields": fields}
    return PydanticCustomError("conflict", "{condition}", context)


# Keys of one section of which it may have only one.
ALTERNATIVES = (("k_0_W_per_K", "lambda_0_W_per_m2K"), ("amplitude_mm", "variance_m2"))


def merged(base: Mapping[str, Any], override: Mapping[str, Any]) -> dict[str, Any]:
    """Copy of `base` in which keys of `override` replace its own; sections are merged key by key.

    A key replaces its alternative too: k_0_W_per_K a lambda_0_W_per_m2K of `base`.
    """
    result = dict(base)
    for pair in ALTERNATIVES:
        for key, other in (pair, pair[::-1]):
            if override.get(key) is not None and other not in override:
                result.pop(other, None)
    for key, value in override.items():
        inner = result.get(key)
        both = isinstance(value, Mapping) and isinstance(inner, Mapping)
        result[key] = merged(inner, value) if both else value  # type: ignore[arg-type]
    return result


class Section(BaseModel):
    """A frozen section of the configuration without unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    def exactly_one(self, key: str, other: str, other_in_words: str = "") -> None:
        """Raise an error if a section has neither or both of two keys."""
        value, words = getattr(self, key), other_in_words or other
        if (value is None) == (getattr(self, other) is None):
            condition = f"or give {words}" if value is None else f"conflicts with {words}; give only one"
            raise conflict(value, condition, (key,), (other,))
