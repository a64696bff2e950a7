# SPDX-License-Identifier: BSD-3-Clause
"""What benchmarks save: tables in pages, JSON, and where it was measured."""

from __future__ import annotations

import errno
import io
import json
import os
import platform
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from dual_proxy.log import replace_file
from dual_proxy.run_folder import try_folder
from dual_proxy.settings import ScenarioError

__all__ = [
    "check_page",
    "fill_page",
    "machine",
    "markdown_table",
    "number_text",
    "optional_text",
    "page_image",
    "save_figure",
    "write_json",
]

# After such a line of a page stands a table, up to the next empty line.
_MARK = "<!-- {} -->\n"


def markdown_table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cells)} |" for cells in lines)


def number_text(value: float) -> str:
    """Return a number in three digits, or all before the point."""
    return f"{value:.0f}" if value >= 100 else f"{value:.3g}"


def optional_text(value: float | None) -> str:
    """Return a number in three digits, "-" for None."""
    return "-" if value is None else number_text(value)


def fill_page(page: Path, script: str, table: str) -> None:
    """Put a table after the line `<!-- script -->` of a page, in place of what
    stands there up to the next empty line.

    Raises
    ------
    ValueError
        If the page has no such line.
    """
    line = _MARK.format(script)
    before, mark, rest = page.read_text("utf-8").partition(line)
    if not mark:
        raise ValueError(f"{page}: expected a line {line.strip()!r}")
    _, _, after = f"\n{rest}".partition("\n\n")
    filled = f"{before}{mark}{table}\n\n{after}"
    replace_file(page.resolve(), filled.encode())


def page_image(page: Path, name: str) -> Path:
    """Return where a page has an image."""
    return page.parent / "images" / name


def check_page(
    page: Path, quick: bool, scripts: Iterable[str], images: Iterable[str] = ()
) -> None:
    """Raise ScenarioError unless a command can fill a page, and write images beside
    it, before it begins."""
    if quick:
        raise ScenarioError("--page: expected the whole benchmark, got --quick")
    try:
        text = page.read_text("utf-8")
    except UnicodeDecodeError:
        raise ScenarioError(f"--page {page}: expected text in UTF-8") from None
    except OSError as error:
        raise ScenarioError(f"--page {page}: {error.strerror}") from None
    for script in scripts:
        mark = _MARK.format(script)
        if mark not in text:
            raise ScenarioError(f"--page {page}: expected a line {mark.strip()!r}")
    try:
        if not os.access(page, os.W_OK):
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(page))
        try_folder(page.resolve().parent, [])
        folder = page_image(page, "image").parent
        if folder.exists():
            try_folder(folder, images)
    except OSError as error:
        raise ScenarioError(f"--page {error.filename}: {error.strerror}") from None


def machine() -> dict[str, Any]:
    """Describe where the costs were measured."""
    model = platform.processor() or platform.machine()
    info = Path("/proc/cpuinfo")
    if info.exists():
        for line in info.read_text().splitlines():
            if line.startswith("model name"):
                model = line.partition(":")[2].strip()
                break
    return {"processor": model, "processors": len(os.sched_getaffinity(0))}


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a file that is there whole or not at all."""
    replace_file(path, f"{json.dumps(content, indent=1, allow_nan=False)}\n".encode())


def save_figure(figure: Any, path: Path) -> None:
    """Write a figure of matplotlib as PNG, whole or not at all; its folder may not
    exist."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=100, metadata={"Software": None})
    path.parent.mkdir(parents=True, exist_ok=True)
    replace_file(path, buffer.getbuffer())
