# SPDX-License-Identifier: BSD-3-Clause
"""Tables in pages that a command fills."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Returns a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def fill_page(page: Path, script: str, table: str) -> None:
    """Puts a table after the line `<!-- script -->` of a page, in place of what
    stands there up to the next empty line.

    Raises
    ------
    ValueError
        If the page has no such line.
    """
    line = f"<!-- {script} -->\n"
    before, mark, rest = page.read_text().partition(line)
    if not mark:
        raise ValueError(f"{page}: expected a line {line.strip()!r}")
    _, _, after = f"\n{rest}".partition("\n\n")
    page.write_text(f"{before}{mark}{table}\n\n{after}")
