# SPDX-License-Identifier: BSD-3-Clause
"""Runs a scenario and keeps what came of it."""

from __future__ import annotations

import os
import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from dual_proxy import _core
from dual_proxy.bare import BareStation
from dual_proxy.claims import Verdict, claims_json, judge
from dual_proxy.log import release, replace_file, save_log, write_mcap
from dual_proxy.metrics import compute_metrics, describe_broken_limits
from dual_proxy.run_folder import RunFolder
from dual_proxy.scenario import Scenario, ScenarioError, load_scenario
from dual_proxy.text import one_line

__all__ = [
    "ENGINES",
    "Run",
    "RunError",
    "change_scenario",
    "choose_engine",
    "find_fault",
    "run",
]

# Simulated time between two calls of `progress`, s.
_PROGRESS_INTERVAL = 0.1
# Of a replay, Hz; a longer one than 200 s has fewer, as a browser must hold them.
_FRAME_RATE = 30.0
_MOST_FRAMES = 6000

ENGINES = ("auto", "drake", "bare")
# What simulates a robot, the usual one first; bare does with all of them.
_ENGINES_OF = {"panda": ("drake", "bare"), "point_mass": ("bare",)}


@dataclass(frozen=True)
class Run:
    """A finished run, or what there is of one that failed."""

    scenario: Scenario
    log: pd.DataFrame
    """One row per control period, see `dual_proxy.log.SIGNALS`. Read-only
    (`log.copy()` is not): that of a long run is on disk, and costs memory where
    it is read."""
    metrics: dict[str, Any]
    """See `dual_proxy.metrics.METRICS`."""
    failure: str = ""
    """Why the run ended early; empty if it did not."""
    recording: str = ""
    """`OperatorMotion.note`: what was made of a recording; empty without one."""
    engine: str = "drake"
    """What simulated the robot: "drake" or "bare"."""

    def judge_claims(self) -> list[Verdict]:
        """Compare what is claimed of such a run with what was measured; nothing is
        of one that ended early."""
        return [] if self.failure else judge(self.scenario, self.metrics)

    def save(
        self,
        directory: str | Path | RunFolder,
        mcap: bool = False,
        pages: bool = True,
    ) -> Path:
        """Save everything: all files or none.

        Writes metrics.json, log.npz, scenario.yaml, claims.json (if anything is
        claimed of the run), report.html, replay.html (if anything was logged) and,
        on request, log.mcap. They take the place of those of an earlier run.

        Parameters
        ----------
        directory : str, Path or RunFolder
            Made if it does not exist.
        mcap : bool
            Whether to write the log for Foxglove and PlotJuggler, too.
        pages : bool
            Whether to draw report.html and replay.html, which takes longest.

        Returns
        -------
        Path
            Of the report, if pages are drawn.

        Raises
        ------
        OSError
            If something cannot be written, or another run is being saved there
            at this moment; the directory is then as it was.
        """
        if not isinstance(directory, RunFolder):
            with RunFolder(directory) as folder:
                return self.save(folder, mcap, pages)
        draft = directory.draft
        metrics = _core._metrics_json(list(self.metrics.items()))
        replace_file(draft / "metrics.json", metrics.encode())
        replace_file(draft / "scenario.yaml", self.scenario.to_yaml().encode())
        save_log(self.log, draft / "log.npz")
        # From here on, what fails leaves what all else is made from.
        if verdicts := self.judge_claims():
            replace_file(draft / "claims.json", claims_json(verdicts).encode())
        if mcap:
            write_mcap(self.log, draft / "log.mcap")
        if pages:
            self._write_pages(draft)
        release(self.log)
        directory.keep()
        return directory.path / "report.html"

    def _write_pages(self, draft: Path) -> None:
        # Plotting is imported only where something is plotted.
        from dual_proxy.report import write_report

        links = [path.name for path in sorted(draft.iterdir())]
        if len(self.log):
            self._write_replay(draft / "replay.html")
            links.append("replay.html")
            release(self.log)
        write_report(
            self.log,
            self.metrics,
            self.scenario,
            draft / "report.html",
            self.failure,
            links,
            self.recording,
            self.judge_claims(),
        )

    def _write_replay(self, path: Path) -> None:
        # Drake's viewer is imported only where something is drawn.
        from dual_proxy._core import WorkspaceMap
        from dual_proxy.replay import write_replay

        write_replay(
            self.log,
            path,
            params=self.scenario.scene,
            robot=self.scenario.robot,
            workspace_map=WorkspaceMap(self.scenario.map),
            title=f"{self.scenario.name}, {self.scenario.scheme}, "
            f"{self.scenario.link.delay * 1e3:g} ms",
            frame_rate=min(_FRAME_RATE, _MOST_FRAMES / self.metrics["sim_s"]),
        )


class RunError(RuntimeError):
    """A run failed midway; `run` holds what was logged until then."""

    def __init__(self, message: str, run: Run) -> None:
        super().__init__(message)
        self.run = run

    def __reduce__(self) -> tuple[Any, ...]:
        # What `args` does not hold goes along, or a pool of processes that gets
        # this error breaks.
        return type(self), (*self.args, self.run), vars(self)


def change_scenario(
    scenario: Scenario | str | Path,
    scheme: str | None = None,
    delay: float | None = None,
    duration: float | None = None,
    seed: int | None = None,
    recording: str | Path | None = None,
    overrides: Mapping[str, Any] | None = None,
) -> Scenario:
    """Return the scenario that `run` runs; arguments and errors are its own."""
    if not isinstance(scenario, Scenario):
        if not isinstance(scenario, str | os.PathLike):
            raise TypeError(
                "scenario: expected a scenario's name, the path of a YAML file or a "
                f"Scenario, got {scenario!r}"
            )
        scenario = load_scenario(scenario)
    changes: dict[str, Any] = {}
    for key, value in (
        ("scheme", scheme),
        ("link.delay", delay),
        ("duration", duration),
        ("seed", seed),
        ("operator.recording", None if recording is None else str(recording)),
    ):
        if value is not None:
            changes[key] = value
    if overrides is None:
        overrides = {}
    if isinstance(overrides, Mapping):
        overrides = {**overrides, **changes}
    return scenario.with_overrides(overrides)


def choose_engine(engine: str, scenario: Scenario) -> str:
    """Return "drake" or "bare": what `run` simulates a scenario with.

    Raises
    ------
    ScenarioError
        If `engine` is none of `ENGINES`, or cannot simulate the robot.
    """
    if engine not in ENGINES:
        raise ScenarioError(
            f"engine: expected one of {', '.join(ENGINES)}, got {engine!r}"
        )
    engines = _ENGINES_OF[scenario.robot]
    if engine == "auto":
        return engines[0]
    if engine not in engines:
        raise ScenarioError(
            f'engine: expected "auto" or "bare" with robot {scenario.robot}, which '
            'has no MultibodyPlant, got "drake"'
        )
    return engine


def find_fault(result: Run) -> str:
    """Return what makes a run that came to its end a failed one, or ""."""
    if not result.metrics["finite"]:
        return "the log holds values that are not finite"
    sensor = result.scenario.sensor
    if result.metrics["sensor_ready"] is False:
        return (
            "the force sensor's bias was not learned, so the robot held still: at "
            f"rest it felt more than sensor.tare_max_force ({sensor.tare_max_force:g} "
            f"N) or more noise than sensor.tare_max_noise ({sensor.tare_max_noise:g} N)"
        )
    if result.metrics["limits_broken"]:
        broken = describe_broken_limits(result.log, result.scenario)
        return f"limits of the arm were broken: {'; '.join(broken)}"
    return ""


def run(
    scenario: Scenario | str | Path,
    scheme: str | None = None,
    delay: float | None = None,
    duration: float | None = None,
    seed: int | None = None,
    recording: str | Path | None = None,
    overrides: Mapping[str, Any] | None = None,
    meshcat: bool = False,
    realtime: bool = False,
    progress: Callable[[float, float], None] | None = None,
    engine: str = "auto",
) -> Run:
    """Simulate a scenario.

    Parameters
    ----------
    scenario : Scenario, str or Path
        A scenario, or what `load_scenario` takes. It is not changed.
    scheme : str, optional
        One of `Scenario.SCHEMES`.
    delay : float, optional
        One-way delay of the link, s, in [0, 10].
    duration : float, optional
        Simulated time, s. Without it the run lasts as long as the scenario
        says, lengthened for the delay (`Scenario.extend_for_delay`).
    seed : int, optional
        Of everything random; equal seeds give equal logs.
    recording : str or Path, optional
        CSV file of a human motion that the operator follows, see
        `dual_proxy.recording`.
    overrides : Mapping[str, Any], optional
        Further values by dotted key, as for `Scenario.with_overrides`; the
        arguments above win.
    meshcat : bool
        Show the run in the browser while it goes on.
    realtime : bool
        Never run faster than real time.
    progress : callable, optional
        Called with simulated time and duration, s, every 0.1 s of it.
    engine : str
        What simulates the robot: "drake", "bare" (the project's own plant, many
        times faster; nothing is drawn meanwhile), or "auto", which takes Drake
        for a Panda and the bare engine for a point mass, which Drake has not.

    Returns
    -------
    Run

    Raises
    ------
    ScenarioError
        If the scenario or an argument is wrong.
    TypeError
        If `scenario` is none of what it may be.
    RunError
        If the simulation fails midway, or is interrupted (Ctrl-C); it carries
        what was logged.
    OSError
        If there is no space for the log of a long run, before it begins.
    ImportError
        If pydrake cannot be loaded.
    """
    scenario = change_scenario(
        scenario, scheme, delay, duration, seed, recording, overrides
    )
    engine = choose_engine(engine, scenario)
    if engine == "bare" and meshcat:
        raise ScenarioError("meshcat: expected False with engine bare, got True")
    end = scenario.run_duration()
    motion = scenario.operator_motion()

    station: Any
    try:
        if engine == "bare":
            station = BareStation(scenario, end)
        else:
            # pydrake is imported only where it simulates.
            from dual_proxy.station import build_station

            station = build_station(scenario, meshcat=meshcat)
            station.store_log(end)
    except OSError:
        raise
    except ScenarioError:
        raise
    except (ValueError, RuntimeError) as error:
        raise ScenarioError(
            f"{scenario.name}: cannot be built: {one_line(error)}"
        ) from error
    failure = ""
    cause: BaseException | None = None
    began = clock.monotonic()
    try:
        steps = max(1, round(end / _PROGRESS_INTERVAL))
        for step in range(1, steps + 1):
            now = end * step / steps
            station.advance_to(now)
            if realtime:
                clock.sleep(max(0.0, began + now - clock.monotonic()))
            if progress is not None:
                progress(now, end)
        station.log_frame()  # What is left goes to the disk, too.
    except KeyboardInterrupt as error:
        failure, cause = str(error) or "interrupted", error
    except Exception as error:
        failure = one_line(error) or type(error).__name__
        cause = error
    wall_s = clock.monotonic() - began
    log = station.log_frame()
    metrics = compute_metrics(
        log, scenario, wall_s, motion.scale if motion.note else None
    )
    result = Run(scenario, log, metrics, failure, motion.note, engine)
    release(log)
    if cause is not None:
        at = result.metrics["sim_s"]
        raise RunError(f"the run failed after {at:g} s: {failure}", result) from cause
    return result
