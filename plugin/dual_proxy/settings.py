# SPDX-License-Identifier: BSD-3-Clause
"""Typed settings from YAML: one strict filler for dataclasses and C++ Params.

A settings tree is made of dataclasses whose leaves are numbers, strings, lists
or the `...Params` structs of `dual_proxy._core`. Both kinds of node are filled
from mappings by the same rules: an unknown key, a value of the wrong type or
shape, a number that is not finite or lies out of range is a `ScenarioError` of
one line that starts with the dotted path of the field.

A dataclass field may carry metadata: `doc`, `min` and `max` (inclusive bounds
of numbers, element by element), `choices` (of strings), `required` (in the items of
a list), `flat` (the field's own keys stand directly in the mapping of its
parent) and `hidden` (not part of the settings).
"""

from __future__ import annotations

import dataclasses
import difflib
import math
import re
import typing
from collections.abc import Hashable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml


class ScenarioError(ValueError):
    """A scenario is wrong; the message is one line that names the field."""


class _Loader(yaml.SafeLoader):
    """Safe YAML in which 1e-3 is a number and a repeated key is an error."""

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
        If the text is not valid YAML or repeats a key.
    """
    try:
        return yaml.load(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f", line {mark.line + 1}" if mark else ""
        raise ScenarioError(f"{source}{where}: {error.problem}") from None
    except yaml.YAMLError as error:
        raise ScenarioError(f"{source}: {' '.join(str(error).split())}") from None


def read_text(path: Path) -> str:
    """Read a UTF-8 file; `ScenarioError` in place of an operating system error."""
    try:
        return path.read_text(encoding="utf-8")
    except OSError as error:
        raise ScenarioError(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ScenarioError(f"{path}: expected UTF-8 text") from None


def is_params(value: object) -> bool:
    """Whether `value` is one of the bound C++ `...Params` structs."""
    return isinstance(getattr(type(value), "fields", None), Mapping)


def _is_node(value: object) -> bool:
    return is_params(value) or (
        dataclasses.is_dataclass(value) and not isinstance(value, type)
    )


def _metadata(node: Any, name: str) -> Mapping[str, Any]:
    if is_params(node):
        return {}
    return next(f.metadata for f in dataclasses.fields(node) if f.name == name)


def owners(node: Any) -> dict[str, Any]:
    """Map each key of `node`, in order, to the object that has the attribute."""
    if is_params(node):
        return {name: node for name in type(node).fields}
    found: dict[str, Any] = {}
    for item in dataclasses.fields(node):
        if item.metadata.get("hidden"):
            continue
        if item.metadata.get("flat"):
            found.update(owners(getattr(node, item.name)))
        else:
            found[item.name] = node
    return found


def resolve(root: Any, dotted: str, prefix: str) -> tuple[Any, str]:
    """Find the object and attribute behind the dotted key `dotted`.

    Raises
    ------
    ScenarioError
        If a part of the key does not exist; `prefix` starts the message.
    """
    node = root
    path = prefix
    parts = dotted.split(".")
    for position, part in enumerate(parts):
        if not _is_node(node):
            raise ScenarioError(f"{path}: has no parts, got {dotted!r}")
        known = owners(node)
        if part not in known:
            raise _unknown_key(path, part, known)
        if position == len(parts) - 1:
            return known[part], part
        node = getattr(known[part], part)
        path = f"{path}.{part}"
    raise AssertionError("a dotted key has at least one part")


def get_value(root: Any, dotted: str) -> Any:
    """Return the value at an existing dotted key."""
    owner, name = resolve(root, dotted, "settings")
    return getattr(owner, name)


def set_value(
    root: Any,
    dotted: str,
    value: Any,
    prefix: str,
    derived: Mapping[str, str] | None = None,
) -> None:
    """Set one value by dotted key, checked as `fill` checks it."""
    _refuse_derived(dotted, prefix, derived or {})
    owner, name = resolve(root, dotted, prefix)
    _assign(owner, name, value, f"{prefix}.{dotted}", dotted, derived or {})


def fill(
    node: Any,
    mapping: Any,
    path: str,
    derived: Mapping[str, str] | None = None,
    key: str = "",
) -> None:
    """Fill a settings node from a mapping, in place.

    Parameters
    ----------
    node : dataclass or Params instance
        Fields that the mapping does not name keep their value.
    mapping : Any
        Should be a mapping from field names to values.
    path : str
        Dotted path of `node`, for errors.
    derived : Mapping[str, str], optional
        Dotted keys (from the root) that must not be set, each with the key it
        is derived from.
    key : str
        Dotted key of `node` from the root; empty for the root.

    Raises
    ------
    ScenarioError
        One line: path, what was expected, what was found.
    """
    derived = derived or {}
    if not isinstance(mapping, Mapping):
        raise ScenarioError(f"{path}: expected a mapping, got {mapping!r}")
    known = owners(node)
    for name, value in mapping.items():
        child = f"{key}.{name}" if key else str(name)
        _refuse_derived(child, path.removesuffix(f".{key}") if key else path, derived)
        if name not in known:
            raise _unknown_key(path, str(name), known)
        _assign(known[name], name, value, f"{path}.{name}", child, derived)


def check(node: Any, path: str) -> None:
    """Check the ranges of a whole tree: metadata bounds and `Params.validate()`.

    Raises
    ------
    ScenarioError
        For the first field out of range.
    """
    for name, owner in owners(node).items():
        value = getattr(owner, name)
        if _is_node(value):
            check(value, f"{path}.{name}")
        elif not is_params(owner):
            if isinstance(value, list) and any(map(_is_node, value)):
                for index, item in enumerate(value):
                    check(item, f"{path}.{name}[{index}]")
            else:
                _check_bounds(value, _metadata(owner, name), f"{path}.{name}")
    for params in _params_of(node):
        try:
            params.validate()
        except ValueError as error:
            raise _params_error(path, error) from None


def to_mapping(
    node: Any, derived: Mapping[str, str] | None = None, key: str = ""
) -> dict[str, Any]:
    """Return the tree as plain dicts, lists, numbers and strings.

    `fill` on a default tree gives an equal tree back. Keys in `derived` are
    left out.
    """
    derived = derived or {}
    result: dict[str, Any] = {}
    for name, owner in owners(node).items():
        child = f"{key}.{name}" if key else name
        if child in derived:
            continue
        value = getattr(owner, name)
        if _is_node(value):
            result[name] = to_mapping(value, derived, child)
        elif isinstance(value, list) and any(map(_is_node, value)):
            result[name] = [to_mapping(item) for item in value]
        else:
            result[name] = plain(value)
    return result


def plain(value: Any) -> Any:
    """Return a leaf as YAML writes it: arrays become lists."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    return list(value) if isinstance(value, list | tuple) else value


def _params_of(node: Any) -> Iterator[Any]:
    if is_params(node):
        yield node
        return
    for item in dataclasses.fields(node):
        if item.metadata.get("flat") and is_params(getattr(node, item.name)):
            yield getattr(node, item.name)


def _refuse_derived(key: str, prefix: str, derived: Mapping[str, str]) -> None:
    for candidate, source in derived.items():
        if key == candidate or key.startswith(f"{candidate}."):
            raise ScenarioError(
                f"{prefix}.{key}: is taken from {prefix}.{source}, set that instead"
            )


def _unknown_key(path: str, name: str, known: Mapping[str, Any]) -> ScenarioError:
    close = difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean {close[0]!r}?" if close else f"expected {', '.join(known)}"
    return ScenarioError(f"{path}: unknown key {name!r}, {hint}")


def _params_error(path: str, error: Exception) -> ScenarioError:
    """Turn "FooParams: field `x` expected ..., got ..." into "path.x: expected..."."""
    text = " ".join(str(error).split())
    match = re.match(r"(?:\w+: )?field `([\w.]+)` (.*)", text)
    if match:
        return ScenarioError(f"{path}.{match[1]}: {match[2]}")
    return ScenarioError(f"{path}: {text}")


def _assign(
    owner: Any,
    name: str,
    value: Any,
    path: str,
    key: str,
    derived: Mapping[str, str],
) -> None:
    current = getattr(owner, name)
    if _is_node(current):
        fill(current, value, path, derived, key)
        return
    if is_params(owner):
        converted = _convert(current, value, path)
        try:
            setattr(owner, name, converted)
        except (TypeError, ValueError) as error:
            parent = path.removesuffix(f".{name}")
            raise _params_error(parent, error) from None
        return
    hint = typing.get_type_hints(type(owner))[name]
    metadata = _metadata(owner, name)
    item_type = typing.get_args(hint)[0] if typing.get_origin(hint) is list else None
    if item_type is not None and dataclasses.is_dataclass(item_type):
        converted = _convert_items(item_type, value, path)
    else:
        converted = _convert(current, value, path)
        _check_bounds(converted, metadata, path)
    setattr(owner, name, converted)


def _convert_items(item_type: Any, value: Any, path: str) -> list[Any]:
    if not isinstance(value, list):
        raise ScenarioError(f"{path}: expected a list, got {value!r}")
    items = []
    for index, mapping in enumerate(value):
        item = item_type()
        item_path = f"{path}[{index}]"
        fill(item, mapping, item_path)
        missing = [
            name
            for name in owners(item)
            if _metadata(item, name).get("required") and name not in mapping
        ]
        if missing:
            raise ScenarioError(f"{item_path}: missing key {missing[0]!r}")
        items.append(item)
    return items


def _convert(current: Any, value: Any, path: str) -> Any:
    """Convert `value` to the type (and shape) of `current`."""
    if isinstance(current, bool):
        if not isinstance(value, bool):
            raise ScenarioError(f"{path}: expected true or false, got {value!r}")
        return value
    if isinstance(current, int):
        if isinstance(value, bool) or not isinstance(value, int):
            raise ScenarioError(f"{path}: expected an integer, got {value!r}")
        return value
    if isinstance(current, float):
        return _number(value, path)
    if isinstance(current, str):
        if not isinstance(value, str):
            raise ScenarioError(f"{path}: expected a string, got {value!r}")
        return value
    if isinstance(current, np.ndarray):
        return np.array(_numbers(value, current.shape, path))
    if isinstance(current, list | tuple):
        return type(current)(_numbers(value, (len(current),), path))
    raise ScenarioError(f"{path}: cannot be set from a scenario")


def _number(value: Any, path: str) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ScenarioError(f"{path}: expected a number, got {value!r}")
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ScenarioError(f"{path}: expected a finite number, got {value!r}")
    return number


def _numbers(value: Any, shape: tuple[int, ...], path: str) -> list[Any]:
    if not isinstance(value, list | tuple | np.ndarray) or len(value) != shape[0]:
        size = " x ".join(map(str, shape))
        raise ScenarioError(f"{path}: expected {size} numbers, got {value!r}")
    plain_value = value.tolist() if isinstance(value, np.ndarray) else value
    if len(shape) == 1:
        return [_number(v, f"{path}[{i}]") for i, v in enumerate(plain_value)]
    return [_numbers(v, shape[1:], f"{path}[{i}]") for i, v in enumerate(plain_value)]


def _check_bounds(value: Any, metadata: Mapping[str, Any], path: str) -> None:
    choices = metadata.get("choices")
    if choices is not None and value not in choices:
        names = ", ".join(choices)
        raise ScenarioError(f"{path}: expected one of {names}, got {value!r}")
    low, high = metadata.get("min", -math.inf), metadata.get("max", math.inf)
    is_list = isinstance(value, list | tuple)
    for index, number in enumerate(value if is_list else [value]):
        if isinstance(number, bool) or not isinstance(number, int | float):
            continue
        # Written so that NaN, set from Python, is refused too.
        if not (math.isfinite(number) and low <= number <= high):
            where = f"{path}[{index}]" if is_list else path
            raise ScenarioError(
                f"{where}: expected a number in [{low:g}, {high:g}], got {number!r}"
            )
