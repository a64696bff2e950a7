# SPDX-License-Identifier: BSD-3-Clause
"""Whether both sides are made of the same: each tells the other, beside the frames.

What is told is JSON: {"session": of its frames, "made_of": {field: value, ...}}.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dual_proxy.scenario import Scenario

__all__ = ["Agreement", "Value", "describe_side"]

#: A name, a number, or up to 9 numbers.
Value = str | float | list[float]

# s: between two times that it is told.
_PERIOD = 1.0
# Bytes and fields of what is taken, characters of a word, and the largest number.
_LONGEST = 2048
_MOST_FIELDS = 16
_MOST_CHARACTERS = 40
_LARGEST = 1e12
# Senders of whom is known what they told.
_MOST_SENDERS = 8
# Of numbers: what another machine's last bits may be.
_TOLERANCE = 1e-9


def describe_side(scenario: Scenario) -> dict[str, Value]:
    """Return what both sides need alike, by the names of a scenario."""
    workspace_map = scenario.map
    return {
        "scheme": scenario.scheme,
        "map.scale": workspace_map.scale,
        "map.R_DB": workspace_map.R_DB.ravel().tolist(),
        "map.R_cw": workspace_map.R_cw.ravel().tolist(),
        "scene.start_position": workspace_map.p_cw.tolist(),
        "control_period": scenario.control_period,
        "link.rate": scenario.link.sender.rate,
    }


class Agreement:
    """What this side is made of, and how what others told differs from it."""

    def __init__(self, session: int, made_of: Mapping[str, Value]) -> None:
        """`session` is that of this side's frames."""
        self._mine = dict(made_of)
        self._text = json.dumps({"session": session, "made_of": self._mine}).encode()
        self._differences: dict[int, str] = {}
        self._told_to = 0
        self._due = -1.0e300
        self.malformed = 0
        """How often what came was not taken."""

    def tell(self, time: float, peer: int) -> bytes | None:
        """Return what is to be sent now, if anything: to a `peer`, the session of who
        is heard, at once, and once a second."""
        if time < self._due and peer == self._told_to:
            return None
        self._due, self._told_to = time + _PERIOD, peer
        return self._text

    def take(self, data: bytes, peer: int) -> None:
        """Take what came. What a session tells first stands, and of `peer` it is
        kept whoever else tells something."""
        told = _decode(data)
        if told is None:
            self.malformed += 1
            return
        session, made_of = told
        if session in self._differences:
            return
        if len(self._differences) == _MOST_SENDERS:
            del self._differences[next(s for s in self._differences if s != peer)]
        self._differences[session] = _difference(self._mine, made_of)

    def difference(self, session: int) -> str | None:
        """Return the first field in which that sender differs, with both values;
        "" if in none, None as long as it has not told."""
        return self._differences.get(session)


def _decode(data: bytes) -> tuple[int, dict[str, Value]] | None:
    if len(data) > _LONGEST:
        return None
    try:
        told = json.loads(data)
    except (ValueError, RecursionError):
        return None
    if not isinstance(told, dict) or set(told) != {"session", "made_of"}:
        return None
    session, made_of = told["session"], told["made_of"]
    if type(session) is not int or not 0 < session < 2**64:
        return None
    if not isinstance(made_of, dict) or len(made_of) > _MOST_FIELDS:
        return None
    if not all(_is_word(name) and _is_value(v) for name, v in made_of.items()):
        return None
    return session, made_of


def _is_word(value: Any) -> bool:
    return (
        isinstance(value, str)
        and len(value) <= _MOST_CHARACTERS
        and value.isprintable()
    )


def _is_number(value: Any) -> bool:
    # What is not a number compares false.
    return type(value) in (int, float) and abs(value) <= _LARGEST


def _is_value(value: Any) -> bool:
    if isinstance(value, list):
        return len(value) <= 9 and all(map(_is_number, value))
    return _is_word(value) or _is_number(value)


def _difference(mine: Mapping[str, Value], theirs: Mapping[str, Value]) -> str:
    for field in {**mine, **theirs}:
        if field not in theirs:
            return f"no {field}, this one {_text(mine[field])}"
        if field not in mine:
            return f"{field} {_text(theirs[field])}, this one none"
        if not _is_same(mine[field], theirs[field]):
            return f"{field} {_text(theirs[field])}, this one {_text(mine[field])}"
    return ""


def _is_same(a: Value, b: Value) -> bool:
    if isinstance(a, str) or isinstance(b, str):
        return a == b
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(map(_is_same, a, b))
    if isinstance(a, list) or isinstance(b, list):
        return False
    return abs(a - b) <= _TOLERANCE * max(1.0, abs(a))


def _text(value: Value) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_text, value))}]"
    return value if isinstance(value, str) else f"{value:.10g}"
