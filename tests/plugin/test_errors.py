# SPDX-License-Identifier: BSD-3-Clause
"""Errors arrive whole in another process."""

import concurrent.futures
import copy
import importlib
import multiprocessing
import pickle
import pkgutil

import pandas as pd
import pytest

import dual_proxy as dp


def find_errors():
    modules = [dp, dp._core] + [
        importlib.import_module(info.name)
        for info in pkgutil.walk_packages(dp.__path__, "dual_proxy.")
        if info.name not in ("dual_proxy._native", "dual_proxy.__main__")
    ]
    return sorted(
        {
            item
            for module in modules
            for item in vars(module).values()
            if isinstance(item, type)
            and issubclass(item, BaseException)
            and item.__module__.startswith("dual_proxy")
        },
        key=lambda item: item.__name__,
    )


def make(kind):
    if kind is not dp.RunError:
        return kind("text")
    log = pd.DataFrame({"time": [0.0, 0.1]})
    return kind("text", dp.Run(dp.load_scenario("plane"), log, {"sim_s": 0.1}, "why"))


@pytest.mark.parametrize("kind", find_errors(), ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("twin", [copy.copy, copy.deepcopy, None])
def test_every_error_is_the_same_after_pickling(kind, twin):
    error = make(kind)
    error.add_note("a note")
    dut = pickle.loads(pickle.dumps(error)) if twin is None else twin(error)
    assert type(dut) is kind
    assert str(dut) == "text"
    assert dut.args == error.args
    assert getattr(dut, "__notes__", None) == getattr(error, "__notes__", None)
    if kind is dp.RunError:
        pd.testing.assert_frame_equal(dut.run.log, error.run.log)
        assert dut.run.scenario == error.run.scenario
        assert (dut.run.metrics, dut.run.failure) == ({"sim_s": 0.1}, "why")


def fail(seed):
    def stop(now, end):
        if now > 0.1:
            raise RuntimeError(f"stopped {seed}")

    dp.run("plane", duration=0.4, seed=seed, progress=stop)


def test_a_failing_run_does_not_break_the_pool():
    spawn = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(1, spawn) as pool:
        runs = [pool.submit(fail, seed) for seed in (1, 2)]
        for seed, run in zip((1, 2), runs, strict=True):
            with pytest.raises(dp.RunError, match=f"stopped {seed}") as caught:
                run.result()
            assert caught.value.run.scenario.seed == seed
            assert len(caught.value.run.log) > 150
