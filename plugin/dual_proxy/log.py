# SPDX-License-Identifier: BSD-3-Clause
"""The log of a run: one row per control period, one table of signals.

A log is a pandas DataFrame whose index is the time (s, named `time`) and whose
columns are the components of the signals in `SIGNALS`, and with the angular
filter those in `ANGULAR_SIGNALS`: `robot_position_x`, `torque_0`,
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

__all__ = [
    "ANGULAR_SIGNALS",
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
_JOINTS = tuple(map(str, range(7)))


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


def _counter(description: str) -> Signal:
    return Signal(_SCALAR, "", "", f"{description}, so far", True, True)


def _link_counters(where: str) -> dict[str, Signal]:
    return {
        f"{where}_link_dropped": _counter("messages refused"),
        f"{where}_link_bad_messages": _counter(
            "of them, those that were not finite or not valid"
        ),
        f"{where}_link_gaps": _counter("sequence numbers skipped"),
        f"{where}_link_spikes": _counter("messages that came unusually late"),
        f"{where}_link_losses": _counter("times that the link was lost"),
    }


def _channel_counters(name: str) -> dict[str, Signal]:
    return {
        f"{name}_lost": _counter("messages lost on the way"),
        f"{name}_overflow": _counter("messages pushed out of the full channel"),
        f"{name}_refused": _counter("messages refused because not finite"),
    }


def _filter_counters(name: str) -> dict[str, Signal]:
    return {
        f"{name}_means_bad_inputs": _counter("samples that its means refused"),
        f"{name}_bad_inputs": _counter("updates refused"),
        f"{name}_all_weights_zero": _counter("updates in which nothing was likely"),
    }


#: Every signal of a log, by name, in the order of its columns.
SIGNALS: dict[str, Signal] = {
    "hand_position": Signal(_VECTOR, "m", "D", "where the hand means to be"),
    "device_position": Signal(_VECTOR, "m", "D", "x_h, of the handle, from home"),
    "device_velocity": Signal(_VECTOR, "m/s", "D", "v_h, of the handle"),
    "haptic_proxy_position": Signal(_VECTOR, "m", "D", "x_ph"),
    "haptic_reference_force": Signal(_VECTOR, "N", "D", "F_h, on the hand"),
    "device_force": Signal(_VECTOR, "N", "D", "sent to the device, on the hand"),
    "robot_position": Signal(_VECTOR, "m", "B", "x_r, of the tool point"),
    "robot_velocity": Signal(_VECTOR, "m/s", "B", "v_BE, of the tool point"),
    "robot_orientation": Signal(_QUATERNION, "", "B", "R_BE as a quaternion"),
    "robot_proxy_position": Signal(_VECTOR, "m", "B", "x_pr, after its limiter"),
    "robot_proxy_orientation": Signal(_QUATERNION, "", "B", "R_pr as a quaternion"),
    "motion_error": Signal(_VECTOR, "m", "B", "dx_m, robot minus proxy"),
    "reference_force": Signal(_VECTOR, "N", "B", "F_r"),
    "sensed_force": Signal(_VECTOR, "N", "B", "F_s, on the environment, at E"),
    "sensed_moment": Signal(_VECTOR, "N m", "B", "M_s, on the environment, about E"),
    "sensor_ready": Signal(
        _SCALAR, "", "", "whether the force sensor's bias is known", True
    ),
    "motion_force": Signal(_VECTOR, "N", "B", "F_m, command in motion space"),
    "force_space_force": Signal(_VECTOR, "N", "B", "F_f, command in force space"),
    "contact_force": Signal(
        _VECTOR, "N", "B", "true, robot on environment, from the simulator"
    ),
    "contact_normal": Signal(
        _VECTOR, "", "B", "true, unit, into the surface; zero without contact"
    ),
    "contact_dimension": Signal(
        _SCALAR, "", "", "true number of independent normals", True
    ),
    "dimension": Signal(_SCALAR, "", "", "of the force space, by the filter", True),
    "force_direction": Signal(
        _VECTOR, "", "B", "U1 of the filter; zero when dimension is 0"
    ),
    "force_selection": Signal(_MATRIX, "", "B", "Omega_f, row by row"),
    "joint_position": Signal(_JOINTS, "rad", "", "q"),
    "joint_velocity": Signal(_JOINTS, "rad/s", "", "dq/dt"),
    "torque": Signal(_JOINTS, "N m", "", "commanded"),
    "observed_energy": Signal(_SCALAR, "J", "", "of the closed force loop"),
    "injected_damping": Signal(_SCALAR, "N s/m", "", "by the passivity controller"),
    "robot_link_status": Signal(
        _SCALAR, "", "", "at the robot: 0 waiting, 1 connected, 2 lost", True
    ),
    "robot_link_age": Signal(_SCALAR, "s", "", "of the message in use at the robot"),
    "haptic_link_status": Signal(
        _SCALAR, "", "", "at the device: 0 waiting, 1 connected, 2 lost", True
    ),
    "haptic_link_age": Signal(_SCALAR, "s", "", "of the message in use at the device"),
    **_link_counters("robot"),
    **_link_counters("haptic"),
    **_channel_counters("to_robot"),
    **_channel_counters("to_device"),
    "robot_bad_inputs": _counter("cycles that the proxy or the controller refused"),
    "robot_limiter_bad_inputs": _counter("targets that the proxy's limiter refused"),
    "robot_sender_bad_inputs": _counter("samples that the sender of poses refused"),
    "robot_force_sender_bad_inputs": _counter(
        "samples that the sender of forces refused"
    ),
    "robot_singular": _counter("cycles with a bounded apparent mass"),
    "torque_limited": _counter("cycles in which a torque was limited"),
    "torque_rate_limited": _counter("cycles in which a torque's rate was limited"),
    "joint_limited": _counter("cycles in which a joint was kept from its limits"),
    "sensor_bad_inputs": _counter("samples that the sensor refused"),
    "sensor_tares_refused": _counter("times at rest that gave the sensor no bias"),
    **_filter_counters("filter"),
    "haptic_bad_inputs": _counter("cycles that the proxy or the controller refused"),
    "haptic_sender_bad_inputs": _counter("samples that the sender refused"),
    "device_bad_inputs": _counter("steps with an input that the device refused"),
}

#: Those that follow in the log of a run with the angular filter.
ANGULAR_SIGNALS: dict[str, Signal] = {
    "robot_angular_velocity": Signal(_VECTOR, "rad/s", "B", "w_BE, of the tool"),
    "reference_moment": Signal(_VECTOR, "N m", "B", "M_r"),
    "moment_space_moment": Signal(_VECTOR, "N m", "B", "M_f, command in moment space"),
    "contact_moment_dimension": Signal(
        _SCALAR, "", "", "true number of rotations that are blocked", True
    ),
    "contact_rotation_axis": Signal(
        _VECTOR, "", "B", "true, unit, of free rotation; zero if there is not just one"
    ),
    "moment_dimension": Signal(
        _SCALAR, "", "", "of the moment space, by the angular filter", True
    ),
    "moment_selection": Signal(_MATRIX, "", "B", "Omega_tau, row by row"),
    **_filter_counters("angular_filter"),
}

_ALL_SIGNALS = SIGNALS | ANGULAR_SIGNALS

# ZIP can not hold a date before this one; every entry carries it, so that equal
# logs are equal files.
_ZIP_EPOCH = (1980, 1, 1, 0, 0, 0)


# Rows that are turned into text at a time.
_MCAP_BLOCK = 1000


def signals(names: Container[str]) -> list[str]:
    """Return the signals of a log with these signals or columns, in order.

    It has those of `ANGULAR_SIGNALS` all or none.
    """
    return list(_ALL_SIGNALS if "moment_dimension" in names else SIGNALS)


def column_names(name: str) -> list[str]:
    """Return the columns of a signal, in order."""
    return [f"{name}_{c}" if c else name for c in _ALL_SIGNALS[name].components]


def make_frame(time: ArrayLike, values: Mapping[str, ArrayLike]) -> pd.DataFrame:
    """Assemble a log.

    Parameters
    ----------
    time : (n,), s, strictly increasing
    values : Mapping[str, ArrayLike]
        Every signal of `SIGNALS`, and all or none of `ANGULAR_SIGNALS`, each
        (n, components), (n, 3, 3) for a matrix or (n,) for a scalar. Arrays of
        the right type are not copied.

    Returns
    -------
    DataFrame
        Its values are read-only; those of a copy (`log.copy()`) are not.

    Raises
    ------
    ValueError
        If a signal is missing, unknown, or its shape does not fit.
    """
    times = np.asarray(time, dtype=np.float64)
    if times.ndim != 1 or np.any(np.diff(times) <= 0.0):
        raise ValueError("time: expected (n,) strictly increasing values")
    expected = signals(values)
    unknown = [name for name in values if name not in expected]
    missing = [name for name in expected if name not in values]
    if unknown or missing:
        raise ValueError(f"signals: unknown {unknown}, missing {missing}")
    columns: dict[str, NDArray[Any]] = {}
    for name in expected:
        entry = _ALL_SIGNALS[name]
        dtype = np.int32 if entry.integer else np.float64
        array = np.asarray(values[name], dtype=dtype)
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


def signal(frame: pd.DataFrame, name: str) -> NDArray[Any]:
    """Return a signal of a log: (n,) for a scalar, else (n, components).

    It is a view, not to be written to, where the log has its columns side by
    side, as after a run; else a copy.
    """
    columns = [frame[column].to_numpy() for column in column_names(name)]
    if _ALL_SIGNALS[name].components == _SCALAR:
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
    names = [name for name in signals(frame.columns) if _ALL_SIGNALS[name].counter]
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
        archive = np.load(path, allow_pickle=False)
        if not isinstance(archive, np.lib.npyio.NpzFile):
            raise ValueError("it holds one array")
        with archive:
            arrays = {name: archive[name] for name in archive.files}
    except OSError:
        raise
    except Exception as error:  # Whatever a damaged archive may cause.
        raise ValueError(f"{path}: expected a log of dual_proxy: {error}") from None
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
    entry = _ALL_SIGNALS[name]
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
    entry = _ALL_SIGNALS[name]
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
    finally:
        partial.unlink(missing_ok=True)


def _mcap_key(component: str) -> str:
    if not component:
        return "value"
    return f"joint_{component}" if component.isdigit() else component
