# SPDX-License-Identifier: BSD-3-Clause
"""Runs that are watched as they go, in place of being logged."""

from __future__ import annotations

import math
from typing import Any

from dual_proxy.bare import BareStation
from dual_proxy.metrics import watch_log
from dual_proxy.run import run
from dual_proxy.scenario import Scenario

__all__ = ["Watched", "watch"]

#: By name: `value`, the worst, None if it could not be told; its `unit`; the
#: `time` of it, s, or None; `most` that it may be, where that does not depend on
#: the run; `detail`, where it stands, in words.
Watched = dict[str, dict[str, Any]]


def watch(scenario: Scenario, rest: float, engine: str = "bare") -> Watched:
    """Simulate a scenario and tell what became of its limits.

    With the bare engine nothing of the run is kept, so that a day can be watched.

    Parameters
    ----------
    scenario : Scenario
        What is run.
    rest : float
        How long before the end all should be at rest, s.
    engine : str
        "bare" or "drake".

    Returns
    -------
    dict
        See `Watched`; the names are those of experiment/run_watch.h.

    Raises
    ------
    ScenarioError, RunError
        As `run`.
    """
    scenario.validate()
    end = scenario.run_duration()
    if engine == "bare":
        station = BareStation(scenario, end, rest)
        station.advance_to(end)
        watched = station.watched()
    else:
        watched = watch_log(run(scenario, engine=engine).log, scenario, end, rest)
    return {
        name: {
            "value": _number(value),
            "unit": unit,
            "time": _number(time),
            "most": most,
            "detail": detail,
        }
        for name, unit, value, time, most, detail in watched
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
