"""Configuration files: plain YAML of a reasonable size.

Words and numbers are those of YAML 1.2: 010 is ten, and 1:30, 2_5 and yes are text. Refused are tags,
anchors, aliases, merges, repeated keys and keys that are not text: a configuration needs none of them, and
they can create objects, fill the memory or hide a value.
"""

import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml
from yaml.composer import ComposerError
from yaml.constructor import ConstructorError

from pneumo.configuration.text_file import NUMBER, read_text
from pneumo.errors import ConfigurationError, printable, shown

LARGEST_CONFIGURATION = 1_000_000  # bytes; the paper's configuration has 3 500


class _PlainLoader(yaml.SafeLoader):
    def compose_node(self, parent: Any, index: Any) -> Any:
        event = self.peek_event()
        tag = getattr(event, "tag", None)
        refused = f"tag {tag}" if tag else "anchor or alias" if getattr(event, "anchor", None) else None
        if refused:
            problem = f"a configuration must not contain the {refused}"
            raise ComposerError(None, None, problem, event.start_mark)
        return super().compose_node(parent, index)

    def construct_scalar(self, node: Any) -> Any:
        value = super().construct_scalar(node)
        value.encode()  # a lone surrogate, of an escape such as "\\ud800", is not text: ValueError
        return value

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[Hashable, Any]:
        names = set()
        for key, _ in node.value:
            name = key.value if key.tag == "tag:yaml.org,2002:str" else None
            if name is None or name in names:
                text = shown(key.value) if isinstance(key, yaml.ScalarNode) else "that is a section"
                problem = f"key {text} is {'not text' if name is None else 'given twice'}"
                raise ConstructorError(None, None, problem, key.start_mark)
            names.add(name)
        return super().construct_mapping(node, deep)


def _decimal(loader: _PlainLoader, node: Any) -> int:
    return int(loader.construct_scalar(node))  # PyYAML's own takes 010 for eight


_PlainLoader.yaml_implicit_resolvers = {}  # not those of YAML 1.1
INTEGER = re.compile(r"[+-]?[0-9]+\Z")
FLOAT = re.compile(rf"(?:{NUMBER.pattern}|[+-]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN))\Z")
for _tag, _pattern, _first in (
    ("bool", re.compile(r"(?:true|True|TRUE|false|False|FALSE)\Z"), "tTfF"),
    ("null", re.compile(r"(?:~|null|Null|NULL|)\Z"), ["~", "n", "N", ""]),
    ("int", INTEGER, "+-0123456789"),
    ("float", FLOAT, "+-.0123456789"),
):
    _PlainLoader.add_implicit_resolver(f"tag:yaml.org,2002:{_tag}", _pattern, _first)
_PlainLoader.add_constructor("tag:yaml.org,2002:int", _decimal)


def read_yaml(file: Path) -> dict[str, Any]:
    """Return the content of a configuration file.

    `ConfigurationError` if it is missing, too large, not plain YAML, or does not hold a mapping.
    """
    name = printable(str(file), 300)
    return parse_yaml(read_text(file, LARGEST_CONFIGURATION, name), name)


def parse_yaml(text: str, name: str) -> dict[str, Any]:
    """Return the content of a configuration; `ConfigurationError` as of `read_yaml`, with the name."""
    try:
        result = yaml.load(text, _PlainLoader)  # noqa: S506 - a stricter SafeLoader
    except RecursionError:
        raise ConfigurationError(f"{name}: nested too deeply; sections have at most four levels") from None
    except (yaml.YAMLError, ValueError) as error:
        problem = printable(" ".join(str(error).split()), 300)
        raise ConfigurationError(f"{name}: not valid YAML: {problem}") from None
    if not isinstance(result, dict):
        kind = type(result).__name__
        raise ConfigurationError(f"{name}: must hold `key: value` pairs, but holds {kind}")
    return result
