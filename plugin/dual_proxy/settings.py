# SPDX-License-Identifier: BSD-3-Clause
"""YAML text as plain mappings and back, strictly, with one-line errors."""

from __future__ import annotations

import re
from collections.abc import Hashable
from pathlib import Path
from typing import Any

import yaml

from dual_proxy._core import ScenarioError
from dual_proxy.text import one_line

__all__ = ["ScenarioError", "dump_yaml", "parse_yaml", "read_text"]


#: Values that a document may have, each counted where an alias repeats it.
_MOST_VALUES = 100_000


class _Loader(yaml.SafeLoader):
    """Safe YAML in which 1e-3 is a number and a repeated key is an error.

    What an alias stands for is neither endless nor, written out, enormous.
    """

    def get_single_node(self) -> yaml.Node | None:
        node = super().get_single_node()
        if node is not None:
            _count_values(node, {})
        return node

    def construct_object(self, node: yaml.Node, deep: bool = False) -> Any:
        try:
            value = super().construct_object(node, deep)
            if isinstance(value, str):
                value.encode()
        # Whatever Python's own constructors make of a text.
        except (ArithmeticError, AttributeError, LookupError, ValueError):
            kind = node.tag.rpartition(":")[2]
            text = f" {node.value!r:.60}" if isinstance(node.value, str) else ""
            raise yaml.constructor.ConstructorError(
                None, None, f"no valid {kind}:{text}", node.start_mark
            ) from None
        return value

    def construct_mapping(
        self, node: yaml.MappingNode, deep: bool = False
    ) -> dict[Hashable, Any]:
        seen: set[Any] = set()
        for key_node, _ in node.value:
            key = self.construct_object(key_node, deep=True)
            if not isinstance(key, str):
                raise yaml.constructor.ConstructorError(
                    None, None, f"key {key!r} is not a string", key_node.start_mark
                )
            if key in seen:
                raise yaml.constructor.ConstructorError(
                    None, None, f"key {key!r} appears twice", key_node.start_mark
                )
            seen.add(key)
        return super().construct_mapping(node, deep)


def _count_values(node: yaml.Node, counts: dict[yaml.Node, int]) -> int:
    """Return of how many values a node is, written out; 0 while it is counted."""
    if node in counts:
        if counts[node] == 0:
            raise yaml.composer.ComposerError(
                None, None, "a value that contains itself", node.start_mark
            )
        return counts[node]
    counts[node] = 0
    total = 1
    if isinstance(node, yaml.SequenceNode):
        total += sum(_count_values(item, counts) for item in node.value)
    elif isinstance(node, yaml.MappingNode):
        total += sum(_count_values(x, counts) for pair in node.value for x in pair)
    if total > _MOST_VALUES:
        raise yaml.composer.ComposerError(
            None, None, f"more than {_MOST_VALUES} values", node.start_mark
        )
    counts[node] = total
    return total


_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"^[-+]?(\d+\.?\d*|\.\d+)[eE][-+]?\d+$"),
    list("-+.0123456789"),
)


def parse_yaml(text: str, source: str) -> Any:
    """Parse one YAML document; `source` names it in errors.

    Raises
    ------
    ScenarioError
        If the text is not valid YAML, repeats a key, or is too much.
    """
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f", line {mark.line + 1}" if mark else ""
        raise ScenarioError(
            f"{source}{where}: {one_line(error.problem, 300)}"
        ) from None
    except yaml.YAMLError as error:
        raise ScenarioError(f"{source}: {one_line(error, 300)}") from None
    except RecursionError:
        raise ScenarioError(f"{source}: lists or mappings nested too deeply") from None


class _Dumper(yaml.SafeDumper):
    """Safe YAML whose strings come back as they are."""


def _represent_text(dumper: yaml.SafeDumper, text: str) -> yaml.ScalarNode:
    # PyYAML writes these as line ends, which a reader folds.
    style = '"' if any(mark in text for mark in "\x85\u2028\u2029") else None
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style)


_Dumper.add_representer(str, _represent_text)


def dump_yaml(document: Any) -> str:
    """Return plain data as the text that `parse_yaml` reads."""
    text: str = yaml.dump(
        document,
        Dumper=_Dumper,
        sort_keys=False,
        default_flow_style=None,
        width=88,
        allow_unicode=True,
    )
    return text


def read_text(path: Path) -> str:
    """Read a UTF-8 file; `ScenarioError` in place of an operating system error."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ScenarioError(f"{path}: expected UTF-8 text") from None
    except ValueError as error:  # No file has such a name.
        raise ScenarioError(f"{str(path)!r}: {error}") from None
