# SPDX-License-Identifier: BSD-3-Clause
"""What people and files may give, and what must not be given to people."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from typing import Any

from hypothesis import strategies as st
from hypothesis.extra import numpy as npst

TEXTS = st.one_of(
    st.text(max_size=20),
    st.sampled_from(
        ["", "\0", "\ud800", "a\nb", "\x85", "é€😀", "k" * 5000, "~", "../x"]
    ),
)
FLOATS = st.one_of(
    st.floats(),
    st.sampled_from(
        [0.0, -0.0, 1.0, 5e-324, 2.3e-308, 1e-300, 1e16, 1e160, 1e300, -1e308, 1e-3]
    ),
)
INTEGERS = st.one_of(
    st.integers(-10, 10), st.integers(), st.sampled_from([2**31, 2**63, 2**64, 10**400])
)
SCALARS = st.one_of(st.none(), st.booleans(), INTEGERS, FLOATS, TEXTS)
#: Plain data of any shape, as a YAML file may hold.
DATA = st.recursive(
    SCALARS,
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(st.text(max_size=5), inner, max_size=3),
    ),
    max_leaves=6,
)
ARRAYS = npst.arrays(
    st.one_of(
        npst.floating_dtypes(endianness="?"),
        npst.integer_dtypes(endianness="?"),
        npst.boolean_dtypes(),
        npst.complex_number_dtypes(),
        npst.datetime64_dtypes(),
        npst.unicode_string_dtypes(),
    ),
    npst.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=9),
)


def require_line(error: Exception, pattern: str = ".+") -> None:
    """An error of one line, of a length that people read, that says `pattern`."""
    text = str(error)
    assert len(text) < 2000
    assert re.search(pattern, text), ascii(text)
    assert not [c for c in text if ord(c) < 32 or ord(c) == 127], ascii(text)


def leaves(mapping: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yields dotted key and value of all that is no mapping."""
    for key, value in mapping.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def same(given: Any, back: Any) -> bool:
    """Whether what was given came back; a number may have become a float."""
    if isinstance(back, float):
        try:
            number = float(given)
        except OverflowError:
            number = math.inf
        return number == back or (math.isnan(number) and math.isnan(back))
    return bool(given == back)
