"""The allowed values of a field in words, and the one-line message for a wrong configuration."""

import re
from collections.abc import Callable, Mapping, Sequence
from difflib import get_close_matches
from math import inf
from typing import Any

from pneumo.configuration.schema import SCHEMA
from pneumo.errors import printable, shown

PATTERNS = {
    r"^[\w-]{1,40}$": "of at most 40 letters, digits, _ and -",
    r"^[A-Za-z][A-Za-z0-9_-]{0,39}$": "of at most 40 letters a to z, digits, _ and -, a letter first",
}
HINTS = (  # keys, between which values of them, what the cause may be
    (("T_amb_K", "T_in_K"), -60, 150, "is it in degC?"),
    (("bore_mm", "stroke_mm"), 0, 1, "is it in metres?"),
    (("P_s_Pa",), 0, 100, "is it in bar?"),
    (("C_dm3_per_sbar",), 19, inf, "is this a nominal flow in l/min? then Q_n_l_per_min"),
    (("C_m3_per_sPa",), 1e-5, inf, "is this in dm3/(s bar)? then C_dm3_per_sbar"),
)
DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+")
BOUNDS = (
    ("greater than", "gt", "exclusiveMinimum"),
    ("at least", "ge", "minimum"),
    ("less than", "lt", "exclusiveMaximum"),
    ("at most", "le", "maximum"),
)


def resolved(node: Mapping[str, Any]) -> Mapping[str, Any]:
    """Follow a reference in the JSON schema: the section that a node refers to, else the node itself."""
    node = next((option for option in node.get("anyOf", ()) if "$ref" in option), node)
    return SCHEMA["$defs"][node["$ref"].rsplit("/", 1)[1]] if "$ref" in node else node


def named_sections(node: Mapping[str, Any]) -> Mapping[str, Any] | None:
    """Schema of the values of a mapping whose keys the user chooses (such as cylinders); None for others."""
    return next(iter(node.get("patternProperties", {}).values()), node.get("additionalProperties") or None)


def allowed(node: Mapping[str, Any]) -> str:
    """Return the allowed values of a field in words, from its schema."""
    node = resolved(node)
    if "anyOf" in node:
        return " or ".join(allowed(option) for option in node["anyOf"] if option.get("type") != "null")
    if "const" in node:
        return node["const"]
    if "enum" in node:
        return " or ".join(node["enum"])
    if node["type"] == "array":
        return f"a list{' (not empty)' if node.get('minItems') else ''}, each {allowed(node['items'])}"
    kind = {"number": "a number", "integer": "a whole number", "string": "text", "object": "a section"}
    limits = [f"{words} {node[key]:.10g}" for words, *keys in BOUNDS for key in keys if key in node]
    pattern = f" {PATTERNS[node['pattern']]}" if "pattern" in node else ""
    return f"{kind[node['type']]} {' and '.join(limits)}".rstrip() + pattern


def schema_at(location: tuple[Any, ...]) -> tuple[tuple[Any, ...], Mapping[str, Any]]:
    """Path and schema of the field at an error's location; for an unknown key, the schema of its section."""
    node: Mapping[str, Any] = SCHEMA
    path: list[Any] = []
    for key in location:
        if "anyOf" in node or key == "[key]":  # the rest names branches of a union, not fields
            break
        path.append(key)
        inner = node.get("properties", {}).get(key) or named_sections(node) or node.get("items")
        if inner is None:
            break
        node = resolved(inner)
    return tuple(path), node


def _sets(content: Mapping[str, Any], path: tuple[Any, ...]) -> bool:
    """Whether a configuration file sets the field at `path`, or the list that contains it."""
    node: Any = content
    for key in path:
        if isinstance(node, list):
            return True
        if not isinstance(node, Mapping) or key not in node:
            return False
        node = node[key]
    return True


def dotted(path: tuple[Any, ...]) -> str:
    """Path of a field as text, its keys joined by points."""
    return ".".join(printable(key) if isinstance(key, str) else shown(key) for key in path)


def _hint(key: Any, value: Any) -> str:
    """Likely cause of a wrong value, as a question or a remedy; empty if none is known."""
    if isinstance(value, str):
        return "decimal point, not comma" if DECIMAL_COMMA.fullmatch(value.strip()) else ""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return ""
    return next((words for keys, low, high, words in HINTS if key in keys and low < value < high), "")


def error_line(
    error: Any,
    sources: Sequence[tuple[str, Mapping[str, Any]]],
    written: Callable[[tuple[Any, ...]], tuple[tuple[Any, ...], str]] = lambda path: (path, dotted(path)),
) -> str:
    """Return the message for a validation error: source, field, value, what is allowed.

    `written` returns the path that a field has in its source, and the words for it.
    """
    path, node = schema_at(error["loc"])
    value, text = error["input"], f"must be {allowed(node)}"
    paths, missing = [path], error["type"] == "missing"
    if error["type"] == "conflict":
        value, text = error["ctx"]["value"], error["ctx"]["condition"]
        paths = [path + field for field in error["ctx"]["fields"]]
        path, missing = paths[0], value is None
        if missing:
            text = f"must be {allowed(schema_at(path)[1])}; {text}"
    elif error["type"] in ("extra_forbidden", "invalid_key"):
        known = node["properties"]
        near = get_close_matches(str(error["loc"][-1]), known, 1)
        text = f"unknown key{''.join(f', perhaps {key}' for key in near)}; known keys: {', '.join(known)}"
    elif error["loc"][-1:] == ("[key]",):
        _, parent = schema_at(error["loc"][:-2])
        words = [PATTERNS[pattern] for pattern in parent.get("patternProperties", ())]
        text = " ".join(["the name must be text", *words])
    if not missing and (hint := _hint(path[-1] if path else "", value)):
        text += f"; {hint}"
    text += error.get("ctx", {}).get("remedy", "")
    path, field = written(path)
    paths = [written(each)[0] for each in paths]
    setters = [name for name, content in sources if any(_sets(content, path) for path in paths)]
    if missing:
        without = [name for name, content in sources if _sets(content, path[:-1])]
        return f"{(setters[-1:] or without or ['configuration'])[0]}: {field}: missing; {text}"
    return f"{setters[-1] if setters else 'configuration'}: {field} = {shown(value)}: {text}"
