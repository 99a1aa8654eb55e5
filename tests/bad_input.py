"""Bad input by the schema: one mistake anywhere in a configuration, and odd command lines."""

import copy
import math
import re
from pathlib import Path
from typing import NamedTuple

import pytest
import yaml
from hypothesis import strategies as st

from pneumo.configuration.parameters import Sources, study
from pneumo.configuration.plain_yaml import read_yaml
from pneumo.configuration.schema import SCHEMA
from pneumo.configuration.schema_messages import named_sections, resolved
from pneumo.configuration.schema_parts import merged
from pneumo.errors import ConfigurationError

PAPER = Path(__file__).parents[1] / "config" / "paper.yaml"
BASE = read_yaml(PAPER)
EXPERIMENTS = ("E01", "E03", "E06", "E07", "E16")  # others add nothing to try
FEW = BASE | {"experiments": {name: BASE["experiments"][name] for name in EXPERIMENTS}}


class Mistake(NamedTuple):
    """A file that is wrong, and what the line about it has to name."""

    kind: str
    content: bytes
    words: tuple[str, ...]


def places(node, content, path=()):
    """Every place of a configuration, as (path, schema): sections, fields and items of lists."""
    yield path, node
    node = resolved(node)
    inner = named_sections(node)
    if isinstance(content, dict):
        for key, value in content.items():
            yield from places(inner or node["properties"][key], value, (*path, key))
    elif isinstance(content, list):
        items = node.get("items") or next(option["items"] for option in node["anyOf"] if "items" in option)
        for i, value in enumerate(content):
            yield from places(items, value, (*path, i))


def fields(node=SCHEMA, path=()):
    """Every field of the schema that holds a value, as (path, schema); names that the user gives are NAME."""
    for key, field in node["properties"].items():
        inner, here = resolved(field), (*path, key)
        if values := named_sections(inner):
            inner, here = resolved(values), (*here, "NAME")
        if "properties" in inner:
            yield from fields(inner, here)
        else:
            yield here, inner


def changed(path, change):
    """The paper's configuration after `change(holder, key)` at `path`, as YAML."""
    result = {"": copy.deepcopy(FEW)}
    holder, key = result, ""
    for step in path:
        holder, key = holder[key], step
    change(holder, key)
    return as_yaml(result[""])


def as_yaml(content):
    return yaml.dump(content, Dumper=NoAliases, allow_unicode=False, sort_keys=False).encode()


def with_value(path, value):
    """The paper's configuration with a value at `path`, as YAML."""
    return changed(path, lambda holder, key: holder.__setitem__(key, value))


class NoAliases(yaml.CSafeDumper):
    def ignore_aliases(self, data):
        return True


def bounds(node):
    """Every limit of a field, as (limit, side of what is refused, whether it is refused itself, type)."""
    node = resolved(node)
    keys = {"ge": -1, "minimum": -1, "gt": -1, "exclusiveMinimum": -1}
    keys |= {"le": 1, "maximum": 1, "lt": 1, "exclusiveMaximum": 1}
    for option in node.get("anyOf", [node]):
        for key in keys.keys() & option.keys():
            yield option[key], keys[key], key in ("gt", "lt") or "exclusive" in key, option["type"]


def limits(node):
    """Numbers just and far outside what a field takes."""
    for limit, sign, exclusive, kind in bounds(node):
        step = limit + sign if kind == "integer" else math.nextafter(limit, sign * math.inf)
        yield limit if exclusive else step
        yield limit + sign * 1e9
        yield limit + sign * 1e300


ODD_TEXTS = [
    *("", " ", "\n", "\0", "\x1b[31m", "\u202e", "Ä" * 30, "x" * 100_000, "../../etc/passwd", "/", "<b>"),
    *("null", "{{7*7}}", "$(id)", "%s%n", "\ufeff", "__class__", "E 1", "0.1.2", "1e", "१"),
]
NO_NUMBER = [math.nan, math.inf, -math.inf, 10**400, -(10**400), 1e308 * 10]
NO_LEAF = [{}, [], [[]], {"a": 1}, {"": {}}, [None], [[[[[[1]]]]]], [0] * 2000]
WRONG = {
    "number": [*NO_NUMBER, None, True, *NO_LEAF, *ODD_TEXTS],
    "integer": [*NO_NUMBER, 1.5, None, False, *NO_LEAF, *ODD_TEXTS],
    "string": [0, 1.5, None, True, 10**400, *NO_LEAF, *ODD_TEXTS],
    "array": [0, 1.5, True, None, "x", "", {}, {"a": 1}, [[]], [{}], [None], [[1.2]], 10**400],
    "object": [0, 1.5, True, "x", "", [], [{}], math.nan, 10**400],
}


def wrong_values(node):
    """Values that a place does not take, by what its schema says."""
    optional = any(option.get("type") == "null" for option in node.get("anyOf", ()))
    node = resolved(node)
    options = node.get("anyOf", [node])
    kinds = {option.get("type", "string") for option in options} | ({"string"} if "enum" in node else set())
    values = [value for kind in sorted(kinds - {"null"}) for value in WRONG[kind]]
    if optional:
        values = [value for value in values if value is not None]
    if "array" in kinds and "minItems" not in str(options):
        values = [value for value in values if value != []]
    if pattern := node.get("pattern"):
        values = [value for value in values if not (isinstance(value, str) and re.search(pattern, value))]
    if kinds == {"object"} and "properties" not in node:
        values.append({})  # names are missing
    return [*values, *limits(node)]


def name_of(path):
    return ".".join(map(str, path))


@st.composite
def wrong_field(draw):
    """A field, section or item that holds what it may not."""
    path, node = draw(st.sampled_from(list(places(SCHEMA, FEW))[1:]))
    value = draw(st.sampled_from(wrong_values(node)))
    return Mistake("value", with_value(path, value), (name_of(path[:3]), " = "))


@st.composite
def missing_key(draw):
    keys = [p for p in places(SCHEMA, FEW) if p[0] and isinstance(p[0][-1], str)]
    path, _ = draw(st.sampled_from(keys))
    parent = next((resolved(node) for place, node in places(SCHEMA, FEW) if place == path[:-1]), SCHEMA)
    # Without an experiment, a level or an option the configuration may be a smaller one.
    section = path[0] in ("experiments", "levels") and len(path) == 2
    option = "properties" in parent and path[-1] not in parent.get("required", ())
    words = () if section or option else (name_of(path), "missing")
    words = (".cylinder = ", "must") if path in (("cylinders", "D"), ("cylinders", "E")) else words
    return Mistake("missing", changed(path, dict.__delitem__), words)


@st.composite
def unknown_key(draw):
    sections = [p for p, node in places(SCHEMA, FEW) if "properties" in resolved(node)]
    path = draw(st.sampled_from(sections))
    key = draw(st.text(min_size=1, max_size=50) | st.sampled_from(ODD_TEXTS))
    value = draw(st.sampled_from([1, None, "x", {}, [], "y" * 5000]))

    def change(holder, last):
        holder[last][key if key not in holder[last] else "colour"] = value

    return Mistake("unknown key", changed(path, change), (name_of(path), "unknown key"))


TEXT = as_yaml(FEW).decode()
LAUGHS, MERGES = "a0: &a0 [x, x]\n", "a0: &a0 {x: 1}\n"
for i in range(30):
    LAUGHS += f"a{i + 1}: &a{i + 1} [{', '.join([f'*a{i}'] * 9)}]\n"
    MERGES += f"a{i + 1}: &a{i + 1}\n  <<: [*a{i}, *a{i}, *a{i}]\n"
TAGS = [
    *("!!python/object/apply:os.system ['touch oops']", "!!python/name:os.system", "!!python/module:os"),
    *("!x 1", "!!binary aGVsbG8=", "!!set {a, b}", "!!int ''", "!!float x", "!!timestamp x", "!!bool maybe"),
    "!!null x",
]
SYNTAX = [
    *("x: [1", "x: {a", "\tx: 1", "x: 'a", 'x: "a', "a: b: c", "- a\nb: 1", "? {a: b}\n: 1", "#", "- 1", "1"),
    *("%YAML 9.9\n---\nx: 1", "--- 1\n--- 2", "x: \x01", "@x", "`x", "x: *nothing", "x: &", "[]", "", "null"),
    *("=: =", "x: 2001-99-99", "[" * 5000, "{a: " * 5000, "- " * 5000, r'x: "\ud800"', "x: " + "9" * 5000),
    *("\n".join(" " * i + "a:" for i in range(2000)), "x: 0x" + "f" * 5000, "? " * 3000),
]


@st.composite
def broken_text(draw):
    """Text that is no YAML, or more than plain YAML."""
    at = draw(st.integers(0, len(TEXT)))
    tag = draw(st.sampled_from(TAGS))
    garbage = draw(st.binary(min_size=1, max_size=200))
    choices = [
        ("anchors", LAUGHS + TEXT),
        ("anchors", MERGES + TEXT),
        ("anchors", TEXT.replace("gas:", "gas: &gas", 1)),
        ("tag", TEXT.replace("700000.0", tag, 1)),
        ("tag", TEXT.replace("name: paper", f"name: {tag}", 1)),
        ("twice", TEXT + "\nname: again\n"),
        ("twice", TEXT.replace("mass_kg: 1.5", "mass_kg: 1.5\n    mass_kg: 2.5")),
        ("tab", TEXT.replace("  bore_mm", "\tbore_mm", 1)),
        ("syntax", draw(st.sampled_from(SYNTAX))),
        ("syntax", TEXT + "\n" + draw(st.sampled_from([s for s in SYNTAX if s not in ("", "#")]))),
        ("size", TEXT + "# " + "x" * 1_000_000),
        ("garbage", TEXT.encode()[:at] + b"\xff" + garbage + TEXT.encode()[at:]),
        ("garbage", garbage),
        ("UTF-16", TEXT.encode("utf-16")),
    ]
    kind, text = draw(st.sampled_from(choices))
    return Mistake(kind, text if isinstance(text, bytes) else text.encode(), ())


def mistakes():
    """Any mistake in a configuration."""
    kinds = (wrong_field, missing_key, unknown_key, broken_text)
    return st.one_of(*(kind() for kind in kinds))


WORDS = ["check", "models", "paper", "explain", "verdict", "E07", "M8", "1.35", "T7.M8.mse", "--results"]
ODD = [
    *("--", "-", "", "..", "/", "../..", "nan", "inf", "-1", "1e999", "M99", "E99", "../E07", "a/b", "é"),
    *("x" * 5000, "\n", "\x1b[2J", "\ud800", "http://x/y", "file::x", "%00", "--help=1", "--record=1"),
    *("--no", "-h", "nowhere"),
]


def command_lines():
    """Arguments that seldom are a right command line."""
    surrogates_too = st.characters(exclude_characters="\0", exclude_categories=())
    word = st.sampled_from([*WORDS, "config/paper.yaml", *ODD]) | st.text(surrogates_too, max_size=20)
    return st.lists(word, max_size=6)


def made(override, *more):
    """The study of an override of the paper's configuration."""
    return study(Sources(merged(BASE, override), more).validated())


def override_of(path, value):
    """An override that sets one field."""
    for key in reversed(path.split(".")):
        value = {key: value}
    return value


def error_of(content, *sources):
    """The line that a configuration gets."""
    with pytest.raises(ConfigurationError) as error:
        Sources(content, sources).validated()
    return str(error.value)


def complaint(path, value):
    """The line that an override of one field in a second file gets."""
    override = override_of(path, value)
    return error_of(merged(BASE, override), ("config/paper.yaml", BASE), ("mine.yaml", override))


def assert_one_line(done, *words):
    """Check that a command (exit code, output, error) refused its input in one line with these words."""
    code, out, err = done
    assert (code, out) == (2, "") and len(err.splitlines()) == 1 and err.startswith("pneumo: "), err
    assert all(word in err for word in words), err
