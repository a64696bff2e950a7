# SPDX-License-Identifier: BSD-3-Clause
"""A folder with the files of one run, never of two."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import itertools
import os
import shutil
from pathlib import Path
from types import TracebackType

__all__ = ["RunFolder", "hold_folder"]

_DATA = ("metrics.json", "scenario.yaml", "log.npz")
_FILES = (
    *_DATA,
    "claims.json",
    "log.mcap",
    "report.html",
    "replay.html",
)
# Written to find out whether there is space at all, bytes.
_TRIAL = bytes(4096)


def hold_folder(path: Path) -> int:
    """Open a folder that nobody else can open so meanwhile, on this machine.

    Returns
    -------
    int
        A file descriptor, to be closed.

    Raises
    ------
    OSError
        If it is no folder; BlockingIOError if another process has it open.
    """
    handle = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        os.close(handle)
        error.strerror = "another run is going to save there"
        error.filename = str(path)
        raise
    except OSError:
        pass  # Some network drives know no locks.
    return handle


class RunFolder:
    """A folder for the files of a run, held open until they are there.

    They are made in a folder within, `draft`, and `keep` moves all of them to
    their place; what is not kept disappears. Nobody else can open the folder
    meanwhile, on this machine; what a process that was killed has left is
    removed by the next one.

    Parameters
    ----------
    path : str or Path
        Made if it does not exist, and removed again if nothing is kept.

    Raises
    ------
    OSError
        If it cannot be made or written to, or another run has it open.
    """

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        self._made: list[Path] = []
        for folder in (self.path, *self.path.parents):
            if folder.exists():
                break
            self._made.append(folder)
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except FileExistsError:
            raise NotADirectoryError(
                errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(self.path)
            ) from None
        self._handle = hold_folder(self.path)
        self.draft = self.path / ".saving"
        try:
            self._check_files()
            self._make_draft()
        except BaseException:
            self._remove()
            raise

    @classmethod
    def numbered(cls, path: Path) -> RunFolder:
        """Open a new folder: `path`, or with -2, -3... at its end the first that
        does not exist."""
        for number in itertools.count(1):
            candidate = path
            if number > 1:
                candidate = path.with_name(f"{path.name}-{number}")
            if not os.path.lexists(candidate):
                with contextlib.suppress(BlockingIOError):
                    return cls(candidate)
        raise AssertionError

    def keep(self) -> None:
        """Put what was made in the place of an earlier run's files.

        First those go, then the new ones come. If that is cut short, the folder
        is as it was; if the process is killed meanwhile, there are files of one
        run only.
        """
        old = self.draft / "old"
        new = sorted(self.draft.iterdir())
        old.mkdir()
        replaced = [self.path / name for name in _FILES if (self.path / name).exists()]
        moves = [(file, old / file.name) for file in replaced]
        moves += [(file, self.path / file.name) for file in new]
        done = 0
        try:
            for source, target in moves:
                os.replace(source, target)
                done += 1
        except BaseException:
            for source, target in reversed(moves[:done]):
                os.replace(target, source)
            raise
        self._made.clear()

    def keep_data(self) -> bool:
        """Keep only what all else is made from; False if that is not there."""
        if not all((self.draft / name).is_file() for name in _DATA):
            return False
        for file in self.draft.iterdir():
            if file.name not in _DATA:
                shutil.rmtree(file) if file.is_dir() else file.unlink()
        self.keep()
        return True

    def close(self) -> None:
        """Remove what was not kept; let others open the folder."""
        shutil.rmtree(self.draft, ignore_errors=True)
        self._remove()

    def __enter__(self) -> RunFolder:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()

    def _check_files(self) -> None:
        for name in _FILES:
            if (self.path / name).is_dir():
                raise IsADirectoryError(
                    errno.EISDIR, os.strerror(errno.EISDIR), str(self.path / name)
                )

    def _make_draft(self) -> None:
        """Make it, and find out whether something can be written there."""
        shutil.rmtree(self.draft, ignore_errors=True)
        try:
            self.draft.mkdir()
            trial = self.draft / "trial"
            trial.write_bytes(_TRIAL)
            trial.unlink()
        except OSError as error:
            shutil.rmtree(self.draft, ignore_errors=True)
            error.filename = str(self.path)
            raise

    def _remove(self) -> None:
        for folder in self._made:
            with contextlib.suppress(OSError):
                folder.rmdir()
        os.close(self._handle)
