# SPDX-License-Identifier: BSD-3-Clause
"""Two sides in two processes: keys, transport, and the link that joins them.

What comes over it is decided by the compiled `LinkEnd`; docs/link.md has the format
of the bytes, and what is protected against and what is not.
"""

from __future__ import annotations

__all__ = ["SIDES", "LinkError"]

#: Who is at the ends of a link.
SIDES = ("robot", "haptic")


class LinkError(ValueError):
    """A link, or keys for one, cannot be made: one line that says why."""
