# SPDX-License-Identifier: BSD-3-Clause
"""A folder with the files of one run, never of two."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import itertools
import os
import shutil
from collections.abc import Iterable, Iterator
from pathlib import Path
from types import TracebackType

__all__ = ["RunFolder", "folder_for", "hold_folder", "try_folder"]

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


def _make_folder(path: Path) -> list[Path]:
    """Make a folder; return what was made for it, the innermost first."""
    made = []
    for folder in (path, *path.parents):
        if folder.exists():
            break
        made.append(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise NotADirectoryError(
            errno.ENOTDIR, os.strerror(errno.ENOTDIR), str(path)
        ) from None
    return made


def _remove_empty(folders: Iterable[Path]) -> None:
    for folder in folders:
        with contextlib.suppress(OSError):
            folder.rmdir()


def _check_files(path: Path, names: Iterable[str]) -> None:
    """Find out whether files can have these names in a folder."""
    for name in names:
        if (path / name).is_dir():
            raise IsADirectoryError(
                errno.EISDIR, os.strerror(errno.EISDIR), str(path / name)
            )


def _try_to_write(folder: Path) -> None:
    trial = folder / f".trial-{os.getpid()}"
    try:
        trial.write_bytes(_TRIAL)
    finally:
        with contextlib.suppress(OSError):
            trial.unlink()


def try_folder(path: Path, names: Iterable[str]) -> None:
    """Find out whether files can be written in a folder that exists.

    Raises
    ------
    OSError
        If they cannot; its file name is the folder's, or the file's.
    """
    _check_files(path, names)
    try:
        _try_to_write(path)
    except OSError as error:
        error.filename = str(path)
        raise


@contextlib.contextmanager
def folder_for(path: Path, names: Iterable[str]) -> Iterator[None]:
    """Make a folder that files are going to be written in, and try it out; at the
    end it goes, if it was made for that and nothing is in it.

    Raises
    ------
    OSError
        As for `try_folder`.
    """
    made = _make_folder(path)
    try:
        try_folder(path, names)
        yield
    finally:
        _remove_empty(made)


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
        self._made = _make_folder(self.path)
        self._handle = hold_folder(self.path)
        self.draft = self.path / ".saving"
        try:
            _check_files(self.path, _FILES)
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

    def _make_draft(self) -> None:
        """Make it, and find out whether something can be written there."""
        shutil.rmtree(self.draft, ignore_errors=True)
        try:
            self.draft.mkdir()
            _try_to_write(self.draft)
        except OSError as error:
            shutil.rmtree(self.draft, ignore_errors=True)
            error.filename = str(self.path)
            raise

    def _remove(self) -> None:
        _remove_empty(self._made)
        os.close(self._handle)
