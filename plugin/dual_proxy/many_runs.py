# SPDX-License-Identifier: BSD-3-Clause
"""Many runs on all cores, each kept as soon as it is there.

What is kept of a run in a folder's `runs/` is its metrics (NAME-KEY.json) and a
series of what a figure shows (NAME-KEY.npz); its log is not. The key is a digest
of all that decides the run, so that a run whose scenario, engine or package has
changed is made again and the others are not. A run that came to no end is not
kept: it is tried again the next time.
"""

from __future__ import annotations

import contextlib
import functools
import hashlib
import importlib.metadata
import io
import json
import multiprocessing
import os
import queue
import re
import subprocess
import sys
import threading
import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dual_proxy.log import replace_file, signal
from dual_proxy.metrics import device_in_robot_frame, normal_error_deg
from dual_proxy.run import Run, RunError, find_fault, run
from dual_proxy.run_folder import hold_folder
from dual_proxy.scenario import Scenario, ScenarioError
from dual_proxy.text import one_line
from dual_proxy.watch import watch

__all__ = ["Job", "Result", "RunsFolder", "count_workers", "run_many"]

Series = dict[str, NDArray[np.float32]]

_BAD_INPUT = 2
_RUN_FAILED = 3
# Of a series, s.
_SERIES_PERIOD = 0.01
# What linear algebra goes by: a run is one thread, all cores have a run.
_THREAD_COUNTS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
# Sections of a scenario that say something about it and decide nothing.
_REMARKS = ("description", "claims")
_PURPOSE = "purpose.txt"
# Sides of a link, and their status without it.
_SIDES = ("robot", "haptic")
_LOST = 2
# A run whose process dies is made again, once.
_TRIES = 2
# s: after so long without workers a cluster's user is told, and it is given up.
_TELL = 3.0
_GIVE_UP = 30.0
# s, between two looks at what has ended there.
_LOOK = 0.1


class Job(NamedTuple):
    """A run to be made."""

    name: str
    """Shown while it is made; of letters, digits and "-" it becomes a file's."""
    scenario: Scenario
    """With all that it is changed by."""
    engine: str
    """ "drake" or "bare", see `choose_engine`."""
    rest: float | None = None
    """s: if given, the run is watched (`dual_proxy.bare.watch`), that long before
    its end to be at rest, and in place of metrics there is what was watched."""


@dataclass(frozen=True)
class Result:
    """What came of a job."""

    metrics: dict[str, Any] | None
    """Of a run that came to its end; else None."""
    failure: str = ""
    """What is wrong with the run, in one line."""
    status: int = 0
    """The exit status that `dual-proxy run` has: 0 done, 2 the scenario cannot be
    run, 3 the run failed."""
    series_path: Path | None = None
    not_made: bool = False
    """Whether nothing is known of the run, as what was to make it ended, or had no
    memory or disk; `failure` says so."""

    def series(self) -> Series:
        """Read what figures are drawn from, in float32; without it nothing.

        Returns
        -------
        dict
            `time` (n,), s, every 10 ms; in B, (n, 3): `device` and `robot`
            position, m, the forces that the `hand` exerts, of the `reference`,
            `sensed` and true `contact`, N; `link_lost` (n,), 1 where it is on a
            side; where there is a filter `normal_error_deg`, `dimension` and
            `true_dimension` (n,).
        """
        if self.series_path is None:
            return {}
        with np.load(self.series_path, allow_pickle=False) as archive:
            return {name: archive[name] for name in archive.files}


class RunsFolder:
    """A folder for many runs, held open while they are made.

    Parameters
    ----------
    path : Path
        Made if it does not exist.
    purpose : str
        What the runs are for; those of another purpose go elsewhere.

    Raises
    ------
    ScenarioError
        If it cannot be used, is in use, or holds runs for another purpose.
    """

    def __init__(self, path: str | Path, purpose: str) -> None:
        self.path = Path(path)
        self.runs = self.path / "runs"
        try:
            self._check_others(purpose)
            self._made = [p for p in (self.runs, self.path) if not p.exists()]
            self.runs.mkdir(parents=True, exist_ok=True)
            self._handle = hold_folder(self.runs)
        except OSError as error:
            raise ScenarioError(f"{self.path}: {error.strerror}") from None
        try:
            self._check(purpose)
        except BaseException:
            os.close(self._handle)
            raise

    def _check_others(self, purpose: str) -> None:
        """Leave a folder alone that holds what is not ours."""
        if not self.path.is_dir() or (self.runs / _PURPOSE).exists():
            return
        others = sorted(
            path.name
            for path in self.path.iterdir()
            if path != self.runs or not path.is_dir() or any(path.iterdir())
        )
        if others:
            raise ScenarioError(
                f"{self.path}: expected a new or an empty folder or one of "
                f"`{purpose}`, got one with {others[0]}"
            )

    def _check(self, purpose: str) -> None:
        file = self.runs / _PURPOSE
        try:
            if not file.exists():
                replace_file(file, f"{purpose}\n".encode())
            found = file.read_text().strip()
        except OSError as error:
            raise ScenarioError(f"{self.path}: {error.strerror}") from None
        if found != purpose:
            raise ScenarioError(
                f"{self.path}: expected a new folder or one of `{purpose}`, got one "
                f"of `{found}`"
            )

    def load(self, job: Job, key: str) -> Result | None:
        """Return what is kept of a job, None if there is nothing."""
        file = self._file(job, key)
        try:
            record = json.loads(file.read_text())
            return Result(
                dict(record["metrics"]),
                record["failure"],
                record["status"],
                file.with_suffix(".npz"),
            )
        except (OSError, ValueError, KeyError, TypeError):
            return None

    def save(self, job: Job, key: str, result: Result, series: Series) -> Result:
        """Keep the metrics and the series of a run; return the result with both."""
        file = self._file(job, key)
        if series:
            buffer = io.BytesIO()
            np.savez_compressed(buffer, **series)  # type: ignore[arg-type]
            replace_file(file.with_suffix(".npz"), buffer.getbuffer())
        record = {
            "name": job.name,
            "metrics": result.metrics,
            "failure": result.failure,
            "status": result.status,
            "package": _package(),
            "scenario": job.scenario.to_mapping() if job.rest is None else None,
        }
        # Last, as it says that the run is there.
        replace_file(file, (json.dumps(record, indent=1) + "\n").encode())
        return replace(result, series_path=file.with_suffix(".npz"))

    def _file(self, job: Job, key: str) -> Path:
        name = re.sub(r"[^\w.+-]+", "-", job.name)
        return self.runs / f"{name}-{key[:12]}.json"

    def __enter__(self) -> RunsFolder:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        os.close(self._handle)
        if kind is not None and self._made:
            self._remove_if_empty()

    def _remove_if_empty(self) -> None:
        """Take away the folders that were made, if nothing came of them."""
        with contextlib.suppress(OSError):
            if [file.name for file in self.runs.iterdir()] == [_PURPOSE]:
                (self.runs / _PURPOSE).unlink()
                for path in self._made:
                    path.rmdir()


def count_workers(jobs: int | None = None) -> int:
    """Return a number of workers: that, or the processors that there are.

    Raises
    ------
    ScenarioError
        If it is less than one.
    """
    if jobs is None:
        return len(os.sched_getaffinity(0))
    if jobs < 1:
        raise ScenarioError(f"jobs: expected at least 1, got {jobs}")
    return jobs


def run_many(
    jobs: Sequence[Job],
    folder: RunsFolder | None = None,
    workers: int | None = None,
    progress: Callable[[str], None] | None = None,
    cluster: str | None = None,
) -> list[Result]:
    """Make runs, several at a time, each in a process of its own.

    Parameters
    ----------
    jobs : sequence of Job
        Equal ones are run once.
    folder : RunsFolder, optional
        Where runs are kept; those that are there already are not made again.
    workers : int, optional
        How many at a time; by default as many as there are processors.
    progress : callable, optional
        Called with a line for each run that has ended; by default it is printed
        to standard error.
    cluster : str, optional
        Address of a dask.distributed scheduler, "tcp://HOST:PORT", whose workers
        have this package: they make the runs, in place of processes here. What a
        worker had when it died another one makes.

    Returns
    -------
    list of Result
        Of each job; whatever happens to one, the others are there. What a process
        had when it died is made once more; if that dies, too, it is `not_made`.

    Raises
    ------
    KeyboardInterrupt
        If it is interrupted; what was done by then is kept, and the message says
        so.
    OSError
        If something cannot be kept.
    ScenarioError
        If the cluster does not answer or has no workers for 30 s, or
        dask.distributed is not installed.
    """
    say = progress or functools.partial(print, file=sys.stderr, flush=True)
    keys = [_key(job) for job in jobs]
    results: dict[str, Result] = {}
    todo = dict(zip(keys, jobs, strict=True))
    total = len(todo)
    if folder is not None:
        for key, job in list(todo.items()):
            if kept := folder.load(job, key):
                results[key] = kept
                del todo[key]
    if results:
        say(f"{len(results)} of {total} runs are there already")
    if todo:
        try:
            with _make_pool(workers, len(todo), cluster, say) as pool:
                for key, (result, series, wall_s) in pool.run(todo):
                    if folder is not None and result.metrics is not None:
                        result = folder.save(todo[key], key, result, series)
                    results[key] = result
                    text = result.failure or f"{wall_s:.1f} s"
                    say(f"{len(results)}/{total}  {todo[key].name}: {text}")
        except (KeyboardInterrupt, OSError) as error:
            done = f" after {len(results)} of {total} runs"
            if folder is not None:
                done += f" (in {folder.runs}); the same command makes the others"
            if isinstance(error, OSError):
                error.strerror = f"{error.strerror or error}{done}"
                raise
            text = str(error) or "interrupted"
            raise KeyboardInterrupt(text + done) from None
    return [results[key] for key in keys]


_Done = tuple[Result, Series, float]


class _Worker:
    """A process that makes one run after the other.

    It knows nothing of the script that began it, unlike one of multiprocessing,
    and Ctrl-C in a terminal does not reach it. It ends with its pipe, whose other
    end only we hold.
    """

    def __init__(self) -> None:
        self._pipe, theirs = multiprocessing.Pipe()
        environment = os.environ | dict.fromkeys(_THREAD_COUNTS, "1")
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, sys.path))
        handle = theirs.fileno()
        with theirs:
            self._process = subprocess.Popen(
                [
                    *(sys.executable, "-c"),
                    f"from dual_proxy.many_runs import _serve; _serve({handle})",
                ],
                env=environment,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=[handle],
                process_group=0,
            )

    def work(self, job: Job) -> tuple[Result, Series]:
        """Make a run.

        Raises
        ------
        EOFError, OSError
            If the process has ended, or ends meanwhile.
        """
        self._pipe.send(job)
        done: tuple[Result, Series] = self._pipe.recv()
        return done

    def kill(self) -> None:
        """End the process at once."""
        self._process.kill()

    def close(self) -> int:
        """Wait for its end; return its exit code."""
        self._pipe.close()
        return self._process.wait()


class _Workers:
    """Threads that each have a process."""

    def __init__(self, number: int) -> None:
        self._local = threading.local()
        self._lock = threading.Lock()
        self._workers: set[_Worker] = set()
        self._stopped = False
        self._threads = ThreadPoolExecutor(number)

    def __enter__(self) -> _Workers:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        if kind is not None:
            self._threads.shutdown(wait=False, cancel_futures=True)
            with self._lock:
                self._stopped = True
                for worker in self._workers:
                    worker.kill()
        self._threads.shutdown()
        for worker in self._workers:
            worker.close()

    def run(self, jobs: Mapping[str, Job]) -> Iterator[tuple[str, _Done]]:
        """Yield key and result of each job as soon as it is there."""
        futures = {
            self._threads.submit(self._wait, job): key for key, job in jobs.items()
        }
        for future in as_completed(futures):
            # Not to be held until the last one has ended.
            yield futures.pop(future), future.result()

    def _wait(self, job: Job) -> _Done:
        """In a thread: have its process make a run, or, if that dies, another."""
        why = ""
        for _ in range(_TRIES):
            worker: _Worker | None = getattr(self._local, "worker", None)
            began = clock.monotonic()
            if worker is None:
                with self._lock:
                    if self._stopped:
                        return _not_made("not begun"), {}, 0.0
                    worker = self._local.worker = _Worker()
                    self._workers.add(worker)
            try:
                return (*worker.work(job), clock.monotonic() - began)
            except (EOFError, OSError):
                with self._lock:
                    self._workers.remove(worker)
                self._local.worker = None
                why = f"the process of the run ended with exit code {worker.close()}"
        return _not_made(f"{why}, {_TRIES} times"), {}, clock.monotonic() - began


class _Cluster:
    """Workers of a dask.distributed cluster."""

    def __init__(self, address: str, say: Callable[[str], None]) -> None:
        try:
            import distributed
        except ImportError:
            raise ScenarioError(
                "cluster: needs dask.distributed (pip install "
                "'drake-dual-proxy[cluster]')"
            ) from None
        try:
            self._client = distributed.Client(address, timeout=10)
        except (OSError, ValueError) as error:
            raise ScenarioError(f"cluster {address}: {one_line(error)}") from None
        self._as_completed = distributed.as_completed
        self._address = address
        self._say = say

    def __enter__(self) -> _Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        self._client.close()

    def run(self, jobs: Mapping[str, Job]) -> Iterator[tuple[str, _Done]]:
        """Yield key and result of each job as soon as it is there.

        Raises
        ------
        ScenarioError
            If there are no workers for a while.
        """
        futures = {
            self._client.submit(_timed_work, job, key=key, pure=False): key
            for key, job in jobs.items()
        }
        ended = self._as_completed(futures)
        seen = clock.monotonic()
        told = False
        while futures:
            batch = ended.next_batch(block=False)
            for future in batch:
                try:
                    done: _Done = future.result()
                except Exception as error:
                    text = f"the cluster: {type(error).__name__}: {one_line(error)}"
                    done = (_not_made(text), {}, 0.0)
                yield futures.pop(future), done
            if not batch:
                clock.sleep(_LOOK)
            now = clock.monotonic()
            if batch or self._client.scheduler_info()["workers"]:
                seen, told = now, False
            elif now - seen > _GIVE_UP:
                raise ScenarioError(
                    f"cluster {self._address}: no workers for {_GIVE_UP:g} s"
                )
            elif now - seen > _TELL and not told:
                told = True
                self._say(f"cluster {self._address}: no workers; waiting for one")


def _make_pool(
    workers: int | None,
    jobs: int,
    cluster: str | None,
    say: Callable[[str], None],
) -> _Workers | _Cluster:
    if cluster is not None:
        return _Cluster(cluster, say)
    return _Workers(min(count_workers(workers), jobs))


def _not_made(why: str) -> Result:
    return Result(None, f"not made: {why}", _RUN_FAILED, not_made=True)


def _timed_work(job: Job) -> _Done:
    """In a cluster's worker: make a run."""
    began = clock.monotonic()
    return (*_work(job), clock.monotonic() - began)


def _serve(handle: int) -> None:
    """In a worker's process: make the runs that come through the pipe."""
    pipe = Connection(handle)
    jobs: queue.SimpleQueue[Job] = queue.SimpleQueue()

    def receive() -> None:
        try:
            while True:
                jobs.put(pipe.recv())
        finally:  # Nobody is there any more, even if in the middle of a run.
            os._exit(1)

    threading.Thread(target=receive, daemon=True).start()
    while True:
        pipe.send(_work(jobs.get()))


def _work(job: Job) -> tuple[Result, Series]:
    """In a process: make a run."""
    try:
        if job.rest is not None:
            return Result(watch(job.scenario, job.rest, job.engine)), {}
        result = run(job.scenario, engine=job.engine)
    except (ScenarioError, ImportError) as error:
        return Result(None, one_line(error), _BAD_INPUT), {}
    except RunError as error:
        return Result(None, one_line(error), _RUN_FAILED), {}
    except (MemoryError, OSError) as error:
        return _not_made(f"{type(error).__name__}: {one_line(error)}"), {}
    except Exception as error:
        text = f"{type(error).__name__}: {one_line(error)}"
        return Result(None, text, _RUN_FAILED), {}
    fault = find_fault(result)
    status = _RUN_FAILED if fault else 0
    return Result(result.metrics, fault, status), _make_series(result)


def _make_series(result: Run) -> Series:
    """Take from a log what figures show; see `Result.series`."""
    log, scenario = result.log, result.scenario
    step = max(1, round(_SERIES_PERIOD / scenario.control_period))
    log = log.iloc[::step]
    # Turned to B.
    hand = -signal(log, "device_force") @ scenario.map.R_DB
    series = {
        "time": log.index.to_numpy(np.float64),
        "device": device_in_robot_frame(scenario, signal(log, "device_position")),
        "robot": signal(log, "robot_position"),
        "hand": hand,
        "reference": signal(log, "reference_force"),
        "sensed": signal(log, "sensed_force"),
        "contact": signal(log, "contact_force"),
        "link_lost": np.any(
            [signal(log, f"{side}_link_status") == _LOST for side in _SIDES], axis=0
        ),
    }
    if "dimension" in log.columns:
        series["normal_error_deg"] = normal_error_deg(log)
        series["dimension"] = signal(log, "dimension")
        series["true_dimension"] = signal(log, "contact_dimension")
    return {name: values.astype(np.float32) for name, values in series.items()}


def _key(job: Job) -> str:
    """A digest of all that decides a run."""
    scenario = job.scenario.to_mapping()
    for name in _REMARKS:
        scenario.pop(name, None)
    decisive = (
        job.engine,
        job.rest,
        _package(),
        [(str(path), _digest(path)) for path in _files(job.scenario)],
        scenario,
    )
    return hashlib.sha256(json.dumps(decisive).encode()).hexdigest()


def _files(scenario: Scenario) -> Iterator[Path]:
    """What a scenario reads: a recording, models."""
    if scenario.operator.recording:
        yield Path(scenario.operator.recording)
    if scenario.scene.model_directives:
        path = Path(scenario.scene.model_directives)
        if path.with_name("package.xml").exists():
            yield from sorted(file for file in path.parent.rglob("*") if file.is_file())
        else:
            yield path


def _digest(path: Path) -> str:
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        return ""  # What cannot be read, the run will say.


@functools.cache
def _package() -> dict[str, str]:
    """The software that makes the runs: a digest of ours, the version of others'."""
    folder = Path(__file__).parent
    digests = [
        f"{path.relative_to(folder)} {_digest(path)}"
        for path in sorted(folder.rglob("*"))
        if path.suffix in (".py", ".so", ".urdf")
    ]
    text = "\n".join(digests).encode()
    return {
        "dual_proxy": hashlib.sha256(text).hexdigest(),
        **{name: _version(name) for name in ("drake", "numpy")},
    }


def _version(name: str) -> str:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return ""  # Not installed by pip.
