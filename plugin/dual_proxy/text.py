# SPDX-License-Identifier: BSD-3-Clause
"""Words for people."""

from __future__ import annotations

__all__ = ["one_line"]


def one_line(message: object, most: int | None = None) -> str:
    """Return what is to be said on one line; of more than `most` characters, the
    first ones and "..."."""
    text = " ".join(str(message).split())
    return text if most is None or len(text) <= most else f"{text[:most]}..."
