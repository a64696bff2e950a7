# SPDX-License-Identifier: BSD-3-Clause
"""The same log, bit for bit, whatever the processor, the threads and the clones.

Whole scenes in the bare engine, beginnings that reach contact in Drake; copies of
the bare engine's state are in tests/station/copied_state_test.cc. In a build,
`python -m pytest tests/plugin/test_determinism.py`.
"""

from __future__ import annotations

import ctypes
import hashlib
import json
import os
import struct
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import dual_proxy as dp
from dual_proxy.bare import BareStation
from dual_proxy.many_runs import Job, run_many
from dual_proxy.native import FACES_VARIABLE
from dual_proxy.station import Station

FOLDER = Path(__file__).parents[2] / "examples" / "scenarios"
SCENES = sorted(path.stem for path in FOLDER.glob("*.yaml"))
PANDA_SCENES = [name for name in SCENES if not name.startswith("sim_")]
# What a processor without fused multiply-add and wide vectors is to the C
# library, to NumPy, to OpenBLAS and to the project's own loops.
OLD_PROCESSOR = {
    "GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-AVX512F,-FMA,-FMA4",
    "NPY_DISABLE_CPU_FEATURES": ",".join(np._core._multiarray_umath.__cpu_dispatch__),
    "OPENBLAS_CORETYPE": "Prescott",
    "DUAL_PROXY_INSTRUCTIONS": "baseline",
}
THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS")
# `make test` comes here once more with the LeafSystems in Python.
without_systems = pytest.mark.skipif(
    os.environ.get(FACES_VARIABLE) == "python", reason="does not depend on them"
)


def digest(log: pd.DataFrame) -> str:
    """Of all bits of a log."""
    data = hashlib.sha256(",".join(log.columns).encode())
    data.update(log.index.to_numpy().tobytes())
    for name in log.columns:
        data.update(log[name].to_numpy().tobytes())
    return data.hexdigest()


def run_scene(name: str) -> str:
    return digest(dp.run(name, engine="bare").log)


def calc_sines() -> str:
    """A digest of the C library's sines, which shows what variants it chose."""
    libm = ctypes.CDLL("libm.so.6")
    libm.sin.restype = ctypes.c_double
    sines = [libm.sin(ctypes.c_double(0.001 * i)) for i in range(3000)]
    return hashlib.sha256(struct.pack("3000d", *sines)).hexdigest()


def test_there_are_scenes_of_both_robots():
    assert len(PANDA_SCENES) >= 6
    assert len(SCENES) - len(PANDA_SCENES) >= 3


@pytest.fixture(scope="module")
def digests() -> dict[str, str]:
    """Of every scene's whole log, made here."""
    return {name: run_scene(name) for name in SCENES}


@without_systems
@pytest.mark.parametrize(
    ("threads", "environment"),
    [(1, OLD_PROCESSOR), (2, {"DUAL_PROXY_INSTRUCTIONS": "avx2"})],
    ids=["old processor", "avx2"],
)
def test_same_log_with_every_instruction_set(digests, threads, environment):
    result = subprocess.run(
        [sys.executable, "-B", __file__],
        env=os.environ | environment | dict.fromkeys(THREADS, str(threads)),
        check=True,
        stdout=subprocess.PIPE,
        text=True,
    )
    theirs = json.loads(result.stdout)
    sines = theirs.pop("sines")
    assert theirs == digests
    if "GLIBC_TUNABLES" in environment and "fma" in _processor_flags():
        assert sines != calc_sines()  # Else this has shown nothing.


def _processor_flags() -> list[str]:
    return Path("/proc/cpuinfo").read_text().split()


@without_systems
def test_unknown_instruction_set_is_refused():
    code = "import dual_proxy as dp; dp.run('plane', engine='bare', duration=0.01)"
    result = subprocess.run(
        [sys.executable, "-B", "-c", code],
        env=os.environ | {"DUAL_PROXY_INSTRUCTIONS": "mmx"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode != 0
    assert (
        "DUAL_PROXY_INSTRUCTIONS: expected one of "
        '"baseline", "avx2", "avx512", got "mmx"' in result.stderr
    )


@without_systems
def test_same_log_in_two_threads_at_once(digests):
    with ThreadPoolExecutor(2) as threads:
        theirs = [threads.map(run_scene, SCENES) for _ in range(2)]
        for logs in theirs:
            assert dict(zip(SCENES, logs, strict=True)) == digests


@without_systems
def test_engines_that_take_turns_do_not_disturb_each_other(digests):
    scenarios = {name: dp.load_scenario(name) for name in SCENES}
    ends = {name: scenario.run_duration() for name, scenario in scenarios.items()}
    stations = {name: BareStation(scenarios[name], end) for name, end in ends.items()}
    for time in np.arange(0.0, max(ends.values()) + 0.3, 0.3):
        for name, station in stations.items():
            station.advance_to(min(time, ends[name]))
    assert digests == {
        name: digest(station.log_frame()) for name, station in stations.items()
    }


@without_systems
def test_same_runs_with_one_and_two_processes():
    jobs = [Job(name, dp.load_scenario(name), engine="bare") for name in SCENES[:4]]
    one, two = (run_many(jobs, workers=n, progress=lambda _: None) for n in (1, 2))
    for first, second in zip(one, two, strict=True):
        metrics = [dict(result.metrics) for result in (first, second)]
        for values in metrics:
            assert values.pop("wall_s") > 0.0
            assert values.pop("real_time_factor") > 0.0
        assert metrics[0] == metrics[1]


@pytest.mark.parametrize(
    ("scene", "wiring"),
    [
        *((scene, "fused") for scene in PANDA_SCENES),
        ("plane", "systems"),
        ("flat_tool", "systems"),
    ],
)
def test_a_cloned_context_goes_on_with_the_same_bits(scene, wiring):
    """Where a context is set back to a clone, and to a clone of that."""
    station = Station(dp.load_scenario(scene), wiring=wiring)
    station.advance_to(4.5)
    clone = station.simulator.get_context().Clone()
    again = clone.Clone()
    station.advance_to(4.6)
    rows = station.log_frame().loc[4.51:]
    assert len(rows) > 80
    assert rows["contact_dimension"].max() > 0
    for context in (clone, again):
        station.simulator.reset_context(context)
        station.advance_to(4.6)
        continued = station.log_frame().loc[4.51:]
        pd.testing.assert_frame_equal(continued, rows, check_exact=True)


@pytest.mark.skipif(not dp.native_available(), reason="needs the C++ systems")
@without_systems
@pytest.mark.parametrize("scene", PANDA_SCENES)
def test_same_log_with_systems_in_python_and_in_cpp(scene, monkeypatch):
    """The one with one system for the loop, the other with many."""
    logs = []
    for faces, wiring in (("python", "fused"), ("native", "systems")):
        monkeypatch.setenv(FACES_VARIABLE, faces)
        station = Station(dp.load_scenario(scene), wiring=wiring)
        station.advance_to(4.0)
        logs.append(station.log_frame())
    pd.testing.assert_frame_equal(*logs, check_exact=True)


if __name__ == "__main__":
    print(
        json.dumps({name: run_scene(name) for name in SCENES} | {"sines": calc_sines()})
    )
