# SPDX-License-Identifier: BSD-3-Clause
"""What the force-space particle filter's accuracy costs.

Runs trials (`dual_proxy.run_filter_trial`) of every likelihood over numbers of
particles and rates, and measures what the updates of each take. Results but for
the costs depend on the plan alone, not on the number of workers.
"""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from dual_proxy import _core
from dual_proxy._core import (
    FilterTrialMetrics,
    FilterTrialParams,
    ForceSpaceParticleFilterParams,
    FrictionConeParams,
    run_filter_trial,
)
from dual_proxy.bench.filter_situations import SITUATIONS, Situation

__all__ = [
    "FULL",
    "LATE_MS",
    "LIKELIHOODS",
    "QUICK",
    "Config",
    "Plan",
    "measure_grid",
    "measure_situations",
    "measure_still",
    "worker_pool",
]

#: All likelihoods of the filter.
LIKELIHOODS: tuple[str, ...] = _core._LIKELIHOODS

#: From when a contact found, a contact lost and a second wall found are late.
LATE_MS = {"detection": 50.0, "loss": 50.0, "second": 100.0}

Array = NDArray[np.float64]
Row = dict[str, Any]

_FRICTIONS = (0.0, 0.25, 0.5)
# Speeds (m/s) and forces (N) of each scene; the tool skims faster and lighter.
_SPEEDS_AND_FORCES = dict.fromkeys(
    ("plane", "cylinder", "inner_corner", "step_edge", "soft"),
    ((0.03, 0.05, 0.1), (3.0, 6.0, 10.0)),
) | {"grazing": ((0.1, 0.2, 0.3), (1.5, 2.0, 3.0))}
_DRIVES = ("closed_loop", "true_selection", "kinematic")


class Config(NamedTuple):
    """A setting of the filter."""

    likelihood: str
    num_particles: int
    rate: float
    """Hz."""

    @property
    def params(self) -> ForceSpaceParticleFilterParams:
        """The filter's parameters."""
        return ForceSpaceParticleFilterParams(
            likelihood=self.likelihood,
            num_particles=self.num_particles,
            period=1.0 / self.rate,
        )


@dataclass(frozen=True)
class Plan:
    """How much is run."""

    num_particles: tuple[int, ...]
    rates: tuple[float, ...]
    """Hz."""
    full_square: bool
    """Whether every drive meets every friction; else each is there once."""
    repeats: int
    """Of each trial with another seed, and of each measurement of the cost."""
    still_time: float
    """s: of pressing without moving."""
    situation_trials: int
    """Of each situation."""

    @property
    def configs(self) -> list[Config]:
        """Every setting of the filter."""
        return [
            Config(likelihood, num_particles, rate)
            for likelihood in LIKELIHOODS
            for num_particles in self.num_particles
            for rate in self.rates
        ]

    def trials(self) -> list[FilterTrialParams]:
        """Every trial that each setting of the filter goes through.

        Speed and force go through their values such that each drive and each
        friction meets each of them equally often.
        """
        square = [
            (i, j)
            for i in range(3)
            for j in range(3)
            if self.full_square or j == (i + 1) % 3
        ]
        trials = [
            FilterTrialParams(
                scene=scene,
                drive=_DRIVES[i],
                friction=_FRICTIONS[j],
                speed=speeds[(i + j) % 3],
                force=forces[(i + 2 * j) % 3],
            )
            for scene, (speeds, forces) in _SPEEDS_AND_FORCES.items()
            for i, j in square
            for _ in range(self.repeats)
        ]
        trials += [
            FilterTrialParams(scene="free", drive=drive)
            for drive in ("closed_loop", "kinematic")
            for _ in range(self.repeats)
        ]
        for seed, trial in enumerate(trials):
            trial.seed = seed
        return trials


FULL = Plan(
    num_particles=(100, 300, 1000, 3000, 10000),
    rates=(15.0, 60.0, 100.0, 200.0, 500.0),
    full_square=True,
    repeats=2,
    still_time=300.0,
    situation_trials=12,
)
QUICK = Plan(
    num_particles=(100, 1000),
    rates=(15.0, 100.0, 200.0),
    full_square=False,
    repeats=1,
    still_time=20.0,
    situation_trials=1,
)


def worker_pool(workers: int | None = None) -> ThreadPoolExecutor:
    """Return threads, one per available processor by default.

    Trials run in C++ without Python's global lock.
    """
    return ThreadPoolExecutor(workers or len(os.sched_getaffinity(0)))


def measure_grid(
    plan: Plan,
    pool: ThreadPoolExecutor,
    progress: Callable[[str], None] = lambda _: None,
) -> list[Row]:
    """Run all trials with each setting of the filter.

    Returns
    -------
    rows
        Per setting one over all trials, and one per scene, drive and friction
        (those keys are None where all are pooled). Quantities of which there is
        none (no second wall in scene `plane`) are None. `cost_us_per_s`, in the
        first: what the updates take per second of operation.
    """
    trials = plan.trials()
    rows = []
    for config in plan.configs:
        progress(
            f"{config.likelihood}, {config.num_particles} particles, {config.rate:g} Hz"
        )
        results = list(pool.map(_run, trials, itertools.repeat(config.params)))
        pooled = [
            dict(zip(("scene", "drive", "friction"), key, strict=True)) | row
            for key, row in _pool_results(trials, results)
        ]
        pooled[0]["cost_us_per_s"] = _measure_cost(config.params, plan.repeats)
        rows += [config._asdict() | row for row in pooled]
    return rows


def _run(
    trial: FilterTrialParams, params: ForceSpaceParticleFilterParams
) -> FilterTrialMetrics:
    metrics = FilterTrialMetrics()
    metrics.add(run_filter_trial(trial, params, trial.seed))
    return metrics


def _pool_results(
    trials: Sequence[FilterTrialParams], results: Sequence[FilterTrialMetrics]
) -> Iterator[tuple[tuple[str | None, str | None, float | None], Row]]:
    pairs = list(zip(trials, results, strict=True))
    yield (None, None, None), _summary(results)
    for scene in dict.fromkeys(trial.scene for trial in trials):
        yield (
            (scene, None, None),
            _summary(result for trial, result in pairs if trial.scene == scene),
        )
    for drive in _DRIVES:
        yield (
            (None, drive, None),
            _summary(result for trial, result in pairs if trial.drive == drive),
        )
    for friction in _FRICTIONS:
        yield (
            (None, None, friction),
            _summary(
                result
                for trial, result in pairs
                if trial.friction == friction and trial.scene != "free"
            ),
        )


def _summary(results: Iterable[FilterTrialMetrics]) -> Row:
    """Pool the results of some trials, each sample and each event alike."""
    results = list(results)

    def total(name: str) -> int:
        return sum(getattr(result, name) for result in results)

    def values(name: str) -> Array:
        return np.concatenate([getattr(result, name) for result in results])

    def share(some: str, all_: str) -> float | None:
        return total(some) / total(all_) if total(all_) else None

    row: Row = {
        "trials": len(results),
        "samples": total("samples"),
        "contact_samples": total("contact_samples"),
        "dimension_right": share("right_dimension_samples", "contact_samples"),
        "coverage": share("covered_samples", "stated_samples"),
        "confidence": share("confident_right_samples", "confident_samples"),
        "false_contact_share": share("false_contact_samples", "free_samples"),
        "dimension_changes": total("dimension_changes"),
        "false_contact_samples": total("false_contact_samples"),
    }
    for name in ("direction_error", "axis_error"):
        errors = values(name)
        row[f"{name}_mean_deg"] = float(errors.mean()) if errors.size else None
        row[f"{name}_p95_deg"] = (
            float(np.quantile(errors, 0.95)) if errors.size else None
        )
    for name in LATE_MS:
        times = 1e3 * values(f"{name}_latency")
        found = times[np.isfinite(times)]
        # What is never found counts as slowest; None if that is the quantile.
        p95 = np.quantile(times, 0.95, method="higher") if times.size else np.inf
        row[f"{name}_mean_ms"] = float(found.mean()) if found.size else None
        row[f"{name}_p95_ms"] = float(p95) if np.isfinite(p95) else None
        row[f"{name}_events"] = int(times.size)
        row[f"{name}_missed"] = int(times.size - found.size)
        late = times > LATE_MS[name]
        row[f"{name}_late"] = float(late.mean()) if times.size else None
    return row


def _measure_cost(filter_params: ForceSpaceParticleFilterParams, repeats: int) -> float:
    """Measure the updates alone, us per second of operation."""
    costs = []
    for scene in ("plane", "inner_corner"):
        for seed in range(2):
            trial = run_filter_trial(
                FilterTrialParams(scene=scene, force=10.0, seed=seed), filter_params
            )
            costs.append(
                _core._measure_filter_cost(trial, filter_params, 0, repeats + 1)
            )
    return float(np.mean(costs))


def measure_situations(
    plan: Plan,
    configs: Sequence[Config],
    pool: ThreadPoolExecutor,
    progress: Callable[[str], None] = lambda _: None,
) -> list[Row]:
    """Run every situation with each setting of the filter; return a row for each.

    `coverage` is the share of the updates in contact with the right dimension, 1
    or 2, where the direction error is within the stated uncertainty, and
    `confidence` that of the right dimension where the filter is surer of it than
    0.9: None where it states nothing.
    """

    def submit(config: Config, situation: Situation) -> list[Future[Any]]:
        params = config.params
        params.friction_cone = FrictionConeParams(**situation.cone)
        return [
            pool.submit(_run, trial, params)
            for trial in situation.trials(plan.situation_trials)
        ]

    progress("situations")
    runs = [
        (config, name, submit(config, situation))
        for name, situation in SITUATIONS.items()
        for config in configs
    ]
    return [
        config._asdict()
        | {"situation": name}
        | _summary(run.result() for run in of_situation)
        for config, name, of_situation in runs
    ]


def measure_still(
    plan: Plan, configs: Sequence[Config], pool: ThreadPoolExecutor
) -> list[Row]:
    """Press without moving; return per setting and force how long dimension is 1.

    `dimension_one` is the share of the updates from 1 s after touching until
    the tool lifts.
    """

    def share(config: Config, force: float, seed: int) -> float:
        trial = run_filter_trial(
            FilterTrialParams(
                scene="still",
                force=force,
                friction=_FRICTIONS[seed],
                hold_time=plan.still_time,
                seed=seed,
            ),
            config.params,
            seed,
        )
        pressing = np.linalg.norm(trial.true_force, axis=1) >= 0.5
        pressing &= trial.time >= trial.contacts[0, 0] + 1.0
        return float((trial.dimension[pressing] == 1).mean())

    cases = [(config, force) for config in configs for force in (3.0, 6.0, 10.0)]
    runs = [
        [pool.submit(share, config, force, seed) for seed in range(3)]
        for config, force in cases
    ]
    return [
        config._asdict()
        | {
            "force": force,
            "time": plan.still_time,
            "dimension_one": float(np.mean([run.result() for run in of_case])),
        }
        for (config, force), of_case in zip(cases, runs, strict=True)
    ]
