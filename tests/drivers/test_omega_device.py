# SPDX-License-Identifier: BSD-3-Clause
"""The driver from Python, and what it holds to be the SDK's interface."""

import ctypes
import math
import re
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import dual_proxy as dp

ROOT = Path(__file__).resolve().parents[2]


def eventually(condition):
    """Within a time that is long on any machine."""
    end = time.monotonic() + 5
    while time.monotonic() < end:
        if condition():
            return True
        time.sleep(0.001)
    return False


def force(stand_in):
    values = (ctypes.c_double * 7)()
    stand_in.standInGetForce(values)
    return np.array(values)


def test_reads_and_writes(stand_in):
    stand_in.standInSetPath(b"0 0.01 0.02 -0.03")
    stand_in.standInSetYaw(0.3)
    device = dp.OmegaDevice()
    assert not device.read().valid
    with device:
        assert device.name == "omega.7, serial 1234"
        goal = [0.01, 0.02, -0.03]
        assert eventually(lambda: np.allclose(device.read().pose.p, goal, atol=1e-6))
        reading = device.read()
        assert reading.valid
        assert 0 <= reading.age(time.monotonic()) < 5
        assert reading.pose.R[1, 0] == pytest.approx(math.sin(0.3))
        assert reading.velocity.shape == (6,)
        assert reading.gripper_opening == pytest.approx(0.027)
        assert not reading.clutch

        def pushes():
            device.write([0, 3, 0, 0, 0, 0], gripper_force=1)
            return np.allclose(force(stand_in), [0, 3, 0, 0, 0, 0, 1])

        assert eventually(pushes)
        assert device.fault == ""
        assert device.counters.cycles > 0
        assert device.counters.bad_commands == 0
        device.write(np.full(6, np.nan))
        assert device.counters.bad_commands == 1
        start = time.perf_counter()
        for _ in range(10000):
            device.write(device.read().velocity)
        duration = time.perf_counter() - start
        print(f"read and write: {duration / 10000 * 1e6:.2f} us")
    assert not device.read().valid
    assert stand_in.standInCount(b"drdClose") == 1


def test_with_lets_go_of_it_on_an_error(stand_in):
    with pytest.raises(ValueError, match="wrench"), dp.OmegaDevice() as device:
        device.write([1, 0, 0])
    assert np.array_equal(force(stand_in)[3:], np.zeros(4))
    assert stand_in.standInCount(b"dhdStop") == 1
    assert stand_in.standInCount(b"drdClose") == 1


def test_other_threads_run_while_it_opens(stand_in):
    """As homing takes seconds."""
    stand_in.standInSetHomed(0)
    ticks = []
    done = threading.Event()

    def tick():
        while not done.is_set():
            ticks.append(time.monotonic())
            time.sleep(0.005)

    thread = threading.Thread(target=tick)
    thread.start()
    try:
        start = time.monotonic()
        with dp.OmegaDevice(dp.OmegaDeviceParams(homing=True)):
            end = time.monotonic()
    finally:
        done.set()
        thread.join()
    assert end - start > 0.09
    assert sum(start < t < end for t in ticks) > 2


def test_unplugged(stand_in):
    device = dp.OmegaDevice()
    device.open()
    stand_in.standInUnplugAfter(ctypes.c_long(500))
    assert eventually(lambda: device.fault)
    assert "no longer answers (communication error)" in device.fault
    assert not device.read().valid
    assert np.isfinite(device.read().pose.p).all()
    with pytest.raises(dp.DriverError, match="no device found"):
        device.open()
    device.close()
    stand_in.standInUnplugAfter(ctypes.c_long(-1))
    with device:
        assert device.read().valid
        assert device.fault == ""


def test_bad_arguments(stand_in):
    with pytest.raises(ValueError, match=r"`rate` expected a number in \[1000, 4000\]"):
        dp.OmegaDevice(dp.OmegaDeviceParams(thread=dp.HapticDeviceThreadParams(rate=1)))
    params = dp.OmegaDeviceParams(library="/no/such/file")
    with pytest.raises(dp.DriverError, match=r"no/such/file.*forcedimension\.com"):
        dp.OmegaDevice(params).open()


@pytest.fixture
def forcedimension(stand_in):
    return pytest.importorskip(
        "forcedimension_core",
        reason="forcedimension-core (extra `dev`) is not installed",
        exc_type=ModuleNotFoundError,
    )


def test_another_program_reads_the_same(forcedimension, stand_in):
    """Python bindings of others, over the same library."""
    dhd = forcedimension.dhd
    stand_in.standInSetPath(b"0 0.02 -0.01 0.04")
    stand_in.standInSetYaw(-0.7)
    with dp.OmegaDevice() as device:
        goal = [0.02, -0.01, 0.04]
        assert eventually(lambda: np.allclose(device.read().pose.p, goal, 0, 1e-9))
        reading = device.read()
        position = [0.0] * 3
        assert dhd.getPosition(position, 0) == 0
        assert position == pytest.approx(list(reading.pose.p), abs=1e-8)
        frame = [[0.0] * 3 for _ in range(3)]
        assert dhd.getOrientationFrame(frame, 0) == 0
        assert np.array_equal(frame, reading.pose.R)
        gap = ctypes.c_double()
        assert dhd.getGripperGap(gap, 0) == 0
        assert gap.value == reading.gripper_opening
        assert dhd.getSystemName(0) == device.name.split(",")[0]

        def same_force():
            device.write([1, 2, 3, 0, 0, 0], 0.5)
            f, t, gripper = [0.0] * 3, [0.0] * 3, ctypes.c_double()
            dhd.getForceAndTorqueAndGripperForce(f, t, gripper, 0)
            return f == [1, 2, 3] and t == [0, 0, 0] and gripper.value == 0.5

        assert eventually(same_force)


C_TYPES = {
    "void": None,
    "bool": ctypes.c_bool,
    "char": ctypes.c_byte,
    "int": ctypes.c_int,
    "unsigned int": ctypes.c_uint,
    "uint32_t": ctypes.c_uint32,
    "size_t": ctypes.c_size_t,
    "unsigned char": ctypes.c_ubyte,
    "unsigned short": ctypes.c_ushort,
    "double": ctypes.c_double,
    "signed char": ctypes.c_byte,
    "Id": ctypes.c_byte,
    "char*": ctypes.c_char_p,
    "const char*": ctypes.c_char_p,
}
# What the SDK's headers have as a number, and the Python package gives as a bool.
SWITCHES = (ctypes.c_int, ctypes.c_ubyte)


def c_type(text):
    """`double* x`, `double*` -> POINTER(c_double)"""
    words = re.findall(r"\w+|\*", text)
    for size in (len(words), len(words) - 1):  # Without and with a name.
        name = " ".join(words[:size]).replace(" *", "*")
        if name in C_TYPES:
            return C_TYPES[name]
        if name.endswith("*") and name[:-1] in C_TYPES:
            return ctypes.POINTER(C_TYPES[name[:-1]])
    raise ValueError(text)


def signatures(path, pattern):
    text = re.sub(r"\\\n", " ", path.read_text())
    for result, name, arguments in re.findall(pattern, text):
        split = [a for a in " ".join(arguments.split()).split(",") if a.strip()]
        yield name, c_type(result), [c_type(a) for a in split]


@pytest.mark.parametrize(
    ("path", "pattern", "count"),
    [
        (
            "plugin/drivers/omega/force_dimension_sdk.h",
            r"X\(([\w *]+?),\s+(d[hr]d\w+),\s+\(([^)]*)\)\)",
            30,
        ),
        (
            "tests/drivers/force_dimension_stand_in.cc",
            r"(?:EXPORT|STUB\()\s*([\w *]+?)[\s,]+(d[hr]d\w+)[\s,]*\(([^)]*)\)",
            213,  # Eleven more are questions, all `bool (Id)`.
        ),
    ],
)
def test_signatures_are_those_that_others_use(forcedimension, path, pattern, count):
    library = forcedimension.runtime._libdhd
    found = list(signatures(ROOT / path, pattern))
    assert len(found) == count
    for name, result, arguments in found:
        function = getattr(library, name)
        assert function.argtypes is not None, name
        assert function.restype == result, name
        assert len(function.argtypes) == len(arguments), name
        for theirs, ours in zip(function.argtypes, arguments, strict=True):
            switch = theirs is ctypes.c_bool and ours in SWITCHES
            assert theirs is ours or switch, (name, theirs, ours)


SNIPPETS = re.findall(
    r"```python\n(.*?)```", (ROOT / "docs/omega.md").read_text(), re.S
)


@pytest.mark.parametrize("snippet", SNIPPETS, ids=["no force", "spring"])
def test_programs_of_the_guide(stand_in, snippet):
    stand_in.standInSetPath(b"0 0.02 0 0")
    assert "DURATION = 20" in snippet
    names = {}
    exec(snippet.replace("DURATION = 20", "DURATION = 1.2"), names)
    position = names["reading"].pose.p
    # 30 N/m of the spring against 600 N/m of the hand.
    expected = 0.02 * 600 / 630 if "30 *" in snippet else 0.02
    assert position == pytest.approx([expected, 0, 0], abs=1e-3)
