# SPDX-License-Identifier: BSD-3-Clause
"""The log of a run: one row per control period, one table of signals.

A log is a pandas DataFrame whose index is the time (s, named `time`) and whose
columns are the components of those signals of `SIGNALS` that the run has, as its
scheme and its parts write them: `robot_position_x`, `torque_0`,
`force_selection_xy`, or the bare name of a scalar.
"""

from __future__ import annotations

import contextlib
import json
import os
import zipfile
from collections.abc import Container, Iterator, Mapping
from pathlib import Path
from typing import IO, Any, NamedTuple

import numpy as np
import pandas as pd
from numpy.typing import ArrayLike, NDArray

from dual_proxy import _core
from dual_proxy.text import one_line

__all__ = [
    "SIGNALS",
    "Signal",
    "column_names",
    "counts",
    "load_log",
    "log_store",
    "make_frame",
    "release",
    "replace_file",
    "save_log",
    "signal",
    "signals",
    "write_mcap",
]

_SCALAR = ("",)
_VECTOR = ("x", "y", "z")
_QUATERNION = ("w", "x", "y", "z")
_MATRIX = tuple(f"{i}{j}" for i in "xyz" for j in "xyz")


class Signal(NamedTuple):
    """What one signal of the log means."""

    components: tuple[str, ...]
    """Suffixes of its columns; one empty suffix for a scalar. A 3x3 matrix is
    row-major."""
    unit: str
    frame: str
    """B robot base, D device base; empty if none applies."""
    description: str
    integer: bool = False
    counter: bool = False
    """Whether it counts, from 0 at the start, what should not happen."""


_COMPONENTS = {
    "scalar": _SCALAR,
    "integer": _SCALAR,
    "counter": _SCALAR,
    "vector": _VECTOR,
    "quaternion": _QUATERNION,
    "matrix": _MATRIX,
}


def _make_signal(kind: str, size: int, unit: str, frame: str, meaning: str) -> Signal:
    counter = kind == "counter"
    return Signal(
        _COMPONENTS.get(kind, tuple(map(str, range(size)))),
        unit,
        frame,
        f"{meaning}, so far" if counter else meaning,
        counter or kind == "integer",
        counter,
    )


#: Every signal that a log may have, by name, in the order of its columns. They
#: are described in C++, beside the code that writes them.
SIGNALS: dict[str, Signal] = {
    name: _make_signal(*description) for name, *description in _core._signal_catalogue()
}

# ZIP can not hold a date before this one; every entry carries it, so that equal
# logs are equal files.
_ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)


# Rows that are turned into text at a time.
_MCAP_BLOCK = 1000


def signals(names: Container[str]) -> list[str]:
    """Return which signals a log with these signals or columns has, in order."""
    return [name for name in SIGNALS if name in names or column_names(name)[0] in names]


def column_names(name: str) -> list[str]:
    """Return the columns of a signal, in order."""
    return [f"{name}_{c}" if c else name for c in SIGNALS[name].components]


def make_frame(time: ArrayLike, values: Mapping[str, ArrayLike]) -> pd.DataFrame:
    """Assemble a log.

    Parameters
    ----------
    time : (n,), s, strictly increasing
    values : Mapping[str, ArrayLike]
        Signals of `SIGNALS`, each (n, components), (n, 3, 3) for a matrix or (n,)
        for a scalar. Arrays of the right type are not copied.

    Returns
    -------
    DataFrame
        Its values are read-only; those of a copy (`log.copy()`) are not.

    Raises
    ------
    ValueError
        If a signal is unknown, its shape does not fit, or it does not hold
        numbers that the log can have.
    """
    times = _numbers("time", time, np.float64)
    if (
        times.ndim != 1
        or not np.all(np.isfinite(times))
        or np.any(np.diff(times) <= 0.0)
    ):
        raise ValueError("time: expected (n,) strictly increasing finite values")
    expected = signals(values)
    unknown = [name for name in values if name not in SIGNALS]
    if unknown:
        raise ValueError(f"signals: unknown {unknown}")
    columns: dict[str, NDArray[Any]] = {}
    for name in expected:
        entry = SIGNALS[name]
        array = _numbers(name, values[name], np.int32 if entry.integer else np.float64)
        width = len(entry.components)
        if array.size != len(times) * width or len(array) != len(times):
            raise ValueError(
                f"{name}: expected shape ({len(times)}, {width}), got {array.shape}"
            )
        table = array.reshape(len(times), width)
        table.setflags(write=False)
        for index, column in enumerate(column_names(name)):
            columns[column] = table[:, index]
    return pd.DataFrame(columns, index=pd.Index(times, name="time"), copy=False)


def _numbers(
    name: str, values: ArrayLike, dtype: type[np.int32 | np.float64]
) -> NDArray[Any]:
    """Return an array of a type, the given one if it is that."""
    array = np.asarray(values)
    if array.dtype.kind not in "biuf":
        raise ValueError(f"{name}: expected numbers, got {array.dtype!s:.100}")
    with np.errstate(over="ignore"):  # What is too large becomes infinite.
        if dtype is np.int32 and array.dtype != np.int32:
            limits = np.iinfo(np.int32)
            if not np.all((array >= limits.min) & (array <= limits.max)):
                raise ValueError(f"{name}: expected integers of 32 bits")
        return array.astype(dtype, copy=False)


def signal(frame: pd.DataFrame, name: str) -> NDArray[Any]:
    """Return a signal of a log: (n,) for a scalar, else (n, components).

    It is a view, not to be written to, where the log has its columns side by
    side, as after a run; else a copy.
    """
    columns = [frame[column].to_numpy() for column in column_names(name)]
    if SIGNALS[name].components == _SCALAR:
        return columns[0]
    first = columns[0]
    places = [column.__array_interface__["data"][0] for column in columns]
    spacing = places[1] - places[0]
    if (
        all(column.strides == first.strides for column in columns)
        and all(column.dtype == first.dtype for column in columns)
        and all(_owner(column) is _owner(first) for column in columns)
        and places == [places[0] + i * spacing for i in range(len(places))]
    ):
        return np.lib.stride_tricks.as_strided(
            first,
            (len(first), len(columns)),
            (*first.strides, spacing),
            writeable=False,
        )
    return np.column_stack(columns)


def release(frame: pd.DataFrame) -> None:
    """Give back the memory that a log on disk occupies after it was read.

    It is read again where it is needed; a log in memory stays there.
    """
    store = log_store(frame)
    if store is not None:
        store.release()


def log_store(frame: pd.DataFrame) -> _core._RunLogStore | None:
    """Return what the log of a run is in, None for other logs."""
    owner = _owner(frame[frame.columns[0]].to_numpy())
    return owner if isinstance(owner, _core._RunLogStore) else None


def _owner(array: NDArray[Any]) -> object:
    """Return what the values of an array are in."""
    while isinstance(array, np.ndarray) and array.base is not None:
        array = array.base
    return array


def counts(frame: pd.DataFrame) -> dict[str, int]:
    """Return what a log's counters came to, those that are not zero."""
    names = [name for name in signals(frame.columns) if SIGNALS[name].counter]
    totals = {name: int(frame[name].iloc[-1]) if len(frame) else 0 for name in names}
    return {name: total for name, total in totals.items() if total}


def save_log(frame: pd.DataFrame, path: str | Path) -> None:
    """Write a log without loss as .npz: `time` and one array per signal.

    Equal logs give equal bytes. `numpy.load` reads it, too.

    Raises
    ------
    OSError
        If it cannot be written; then there is no such file, or the old one.
    """
    with (
        _replacing(path) as file,
        zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=6) as archive,
    ):
        for name in ("time", *signals(frame.columns)):
            array = frame.index.to_numpy(np.float64)
            if name != "time":
                array = signal(frame, name)
            info = zipfile.ZipInfo(f"{name}.npy", _ZIP_EPOCH)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.file_size = array.nbytes  # So that it chooses the right format.
            with archive.open(info, "w") as entry:
                # Column by column, as neighbours in time compress well.
                np.lib.format.write_array(entry, np.asfortranarray(array))
            release(frame)


def load_log(path: str | Path) -> pd.DataFrame:
    """Read a log that `save_log` wrote.

    Raises
    ------
    ValueError
        If the file is not such a log.
    OSError
        If it cannot be read.
    """
    try:
        # Opened here, as NumPy does not close what it cannot read.
        with open(path, "rb") as file:
            archive = np.load(file, allow_pickle=False)
            if not isinstance(archive, np.lib.npyio.NpzFile):
                raise ValueError("it holds one array")
            with archive:
                arrays = {name: archive[name] for name in archive.files}
    except OSError:
        raise
    except Exception as error:  # Whatever a damaged archive may cause.
        why = one_line(error, 300)
        raise ValueError(f"{path}: expected a log of dual_proxy: {why}") from None
    if "time" not in arrays:
        raise ValueError(f"{path}: expected a log of dual_proxy: no array 'time'")
    time = arrays.pop("time")
    try:
        return make_frame(time, arrays)
    except ValueError as error:
        raise ValueError(f"{path}: expected a log of dual_proxy: {error}") from None


def write_mcap(frame: pd.DataFrame, path: str | Path) -> None:
    """Write a log as MCAP for Foxglove or PlotJuggler.

    One channel per signal, `/robot_position` and so on, with JSON messages:
    an object of the components, `{"value": ...}` for a scalar, with nine digits
    (`save_log` keeps all). A value that is not finite becomes null.
    """
    from mcap.writer import CompressionType, Writer

    names = signals(frame.columns)
    with _replacing(path) as file:
        writer = Writer(file, compression=CompressionType.ZSTD)
        writer.start(profile="", library="dual_proxy")
        channels = [_add_channel(writer, name) for name in names]
        times = frame.index.to_numpy(np.float64)
        stamps = np.round(times * 1e9).astype(np.int64).tolist()
        for start in range(0, len(frame), _MCAP_BLOCK):
            block = frame.iloc[start : start + _MCAP_BLOCK]
            texts = [_mcap_texts(block, name) for name in names]
            for row in range(len(block)):
                stamp = stamps[start + row]
                for channel, column in zip(channels, texts, strict=True):
                    data = column[row].encode()
                    writer.add_message(
                        channel, stamp, data, stamp, sequence=start + row
                    )
        writer.finish()  # type: ignore[no-untyped-call]


def _add_channel(writer: Any, name: str) -> int:
    """Announce a signal; return the channel's number."""
    entry = SIGNALS[name]
    kind = "integer" if entry.integer else "number"
    schema = {
        "type": "object",
        "description": f"{entry.description} [{entry.unit or '-'}]"
        + (f" in {entry.frame}" if entry.frame else ""),
        "properties": {_mcap_key(c): {"type": kind} for c in entry.components},
    }
    schema_id = writer.register_schema(
        name=f"dual_proxy.{name}",
        encoding="jsonschema",
        data=json.dumps(schema).encode(),
    )
    channel: int = writer.register_channel(
        topic=f"/{name}",
        message_encoding="json",
        schema_id=schema_id,
        metadata={"unit": entry.unit, "frame": entry.frame},
    )
    return channel


def _mcap_texts(frame: pd.DataFrame, name: str) -> list[str]:
    """Return a signal's message of each row."""
    entry = SIGNALS[name]
    keys = [_mcap_key(component) for component in entry.components]
    pattern = "%d" if entry.integer else "%.9g"
    template = "{" + ",".join(f'"{key}":{pattern}' for key in keys) + "}"
    rows = signal(frame, name).reshape(len(frame), len(keys))
    texts = [template % tuple(values) for values in rows.tolist()]
    for index in np.flatnonzero(~np.isfinite(rows).all(axis=1)):
        numbers = [x if np.isfinite(x) else None for x in rows[index].tolist()]
        texts[index] = json.dumps(dict(zip(keys, numbers, strict=True)))
    return texts


def replace_file(path: str | Path, *parts: bytes | memoryview) -> None:
    """Write a file whole or not at all: to a neighbour first, then renamed."""
    with _replacing(path) as file:
        file.writelines(parts)


@contextlib.contextmanager
def _replacing(path: str | Path) -> Iterator[IO[bytes]]:
    """Open a file that takes the place of `path` if nothing is raised."""
    path = Path(path)
    partial = path.with_name(f".{path.name}.partial")
    try:
        with partial.open("w+b") as file:
            yield file
        os.replace(partial, path)
    except OSError as error:
        # A full disk does not say where; the neighbour's name says nothing.
        error.filename, error.filename2 = str(path), None
        raise
    finally:
        partial.unlink(missing_ok=True)


def _mcap_key(component: str) -> str:
    if not component:
        return "value"
    return f"joint_{component}" if component.isdigit() else component
