"""A study as JSON, the file that every job of the workflow reads; few imports, so that jobs start fast."""

import json
from collections.abc import Mapping
from typing import Any, get_args, get_origin, get_type_hints

from pneumo.configuration.experiment import Study


def plain(value: Any) -> Any:
    """Convert a value for JSON: named tuples become mappings, other tuples lists; floats and text stay."""
    if hasattr(value, "_asdict"):
        return {key: plain(inner) for key, inner in value._asdict().items()}
    if isinstance(value, Mapping):
        return {key: plain(inner) for key, inner in value.items()}
    return [plain(inner) for inner in value] if isinstance(value, tuple) else value


def _built(kind: Any, value: Any) -> Any:
    """Convert the result of `plain` back to a value of the type `kind`."""
    if hasattr(kind, "_fields"):
        hints = get_type_hints(kind)
        return kind(**{field: _built(hints[field], value[field]) for field in kind._fields})
    if get_origin(kind) is dict:
        return {key: _built(get_args(kind)[1], inner) for key, inner in value.items()}
    if get_origin(kind) is tuple:
        return tuple(_built(get_args(kind)[0], inner) for inner in value)
    return value


def to_json(study: Study) -> str:
    """Return a study as JSON text."""
    return json.dumps(plain(study), indent=1, allow_nan=False) + "\n"


def from_json(text: str | bytes) -> Study:
    """Return the study that `to_json` wrote; every float comes back exactly."""
    return _built(Study, json.loads(text))
