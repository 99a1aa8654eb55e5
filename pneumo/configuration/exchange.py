"""Studies as JSON: what the configuration hands to every job. Light, since each job starts by reading it."""

import json
from collections.abc import Mapping
from typing import Any, get_args, get_origin, get_type_hints

from pneumo.configuration.experiment import Study


def plain(value: Any) -> Any:
    """Named tuples as mappings, so that the text reads by field name."""
    if hasattr(value, "_asdict"):
        return {key: plain(inner) for key, inner in value._asdict().items()}
    if isinstance(value, Mapping):
        return {key: plain(inner) for key, inner in value.items()}
    return [plain(inner) for inner in value] if isinstance(value, tuple) else value


def _built(kind: Any, value: Any) -> Any:
    """Value of the annotated kind from what `plain` made of it."""
    if hasattr(kind, "_fields"):
        hints = get_type_hints(kind)
        return kind(**{field: _built(hints[field], value[field]) for field in kind._fields})
    if get_origin(kind) is dict:
        return {key: _built(get_args(kind)[1], inner) for key, inner in value.items()}
    if get_origin(kind) is tuple:
        return tuple(_built(get_args(kind)[0], inner) for inner in value)
    return value


def to_json(study: Study) -> str:
    """Write a study as JSON text."""
    return json.dumps(plain(study), indent=1, allow_nan=False) + "\n"


def from_json(text: str) -> Study:
    """Read what `to_json` wrote; every float comes back exactly."""
    return _built(Study, json.loads(text))
