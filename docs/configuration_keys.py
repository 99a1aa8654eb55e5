"""Write what `pneumo init --keys` prints, every key of the configuration, from the schema: `make numbers`."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from pneumo.configuration.schema import SCHEMA
from pneumo.configuration.schema_messages import allowed, named_sections, resolved

KEYS = Path(__file__).parents[1] / "pneumo/configuration/keys.md"


def _sections(path: str, node: Mapping[str, Any]) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield every section of the schema with its path, outermost first."""
    yield path, node
    for key, field in node["properties"].items():
        inner, name = resolved(field), key
        if values := named_sections(inner):
            inner, name = resolved(values), f"{key}.NAME"
        if "properties" in inner:
            yield from _sections(f"{path}.{name}".lstrip("."), inner)


def _row(section: Mapping[str, Any], key: str, field: Mapping[str, Any]) -> str:
    """Line of a section's Markdown table for one field."""
    inner = named_sections(resolved(field))
    limits = f"names, for each {allowed(inner)}" if inner else allowed(field)
    meaning = field.get("description") or resolved(field)["description"].rstrip(".")
    limits += ", also with ± and its uncertainty" if field.get("uncertain") else ""
    optional = "" if key in section.get("required", ()) else " (optional)"
    return f"| `{key}` | {limits} | {meaning}{optional} |"


def keys() -> str:
    """Return a table of every key of the configuration, section by section, as Markdown."""
    shown: dict[str, str] = {}  # path of the table by section
    lines = ["# Keys of a configuration", ""]
    for path, section in _sections("", SCHEMA):
        lines += [f"## {'`' + path + '`' if path else 'Top level'}", ""]
        if (first := shown.setdefault(str(section), path)) != path:
            lines += [f"Keys as in `{first}`.", ""]
            continue
        lines += [section["description"], ""]
        lines += ["| key | allowed | meaning |", "|---|---|---|"]
        lines += [_row(section, key, field) for key, field in section["properties"].items()] + [""]
    return "\n".join(lines).rstrip() + "\n"


if __name__ == "__main__":
    KEYS.write_text(keys(), encoding="utf-8")
