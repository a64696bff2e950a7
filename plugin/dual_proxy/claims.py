# SPDX-License-Identifier: BSD-3-Clause
"""What is claimed of a scene, beside what a run measured.

A scenario's `claims` are the paper's statements on it, as ranges for metrics, and
aims of this project beyond them."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from dual_proxy._core import Claim
from dual_proxy.metrics import ANGULAR_METRICS, METRICS, format_metric
from dual_proxy.scenario import Scenario
from dual_proxy.text import one_line

__all__ = [
    "Verdict",
    "claims_json",
    "judge",
    "judge_value",
    "limit_text",
    "statement",
    "verdict_text",
]


class Verdict(NamedTuple):
    """A claim and what a run has to say to it."""

    claim: Claim
    value: Any
    met: bool | None
    """None: the run has no such value."""


def judge(scenario: Scenario, metrics: Mapping[str, Any]) -> list[Verdict]:
    """Compare the claims that are about a run with its metrics.

    Parameters
    ----------
    scenario : Scenario
        What was run.
    metrics : Mapping
        `Run.metrics`.
    """
    return [
        Verdict(claim, value, judge_value(claim, value))
        for claim in scenario.claims
        if is_about(claim, scenario)
        for value in [metrics.get(claim.metric)]
    ]


def is_about(claim: Claim, scenario: Scenario) -> bool:
    """Tell whether a claim is about runs with a scenario's scheme, delay and
    friction."""
    return bool(
        claim.scheme == scenario.scheme
        and claim.min_delay <= scenario.link.delay <= claim.max_delay
        and (
            claim.max_friction is None or scenario.scene.friction <= claim.max_friction
        )
    )


def judge_value(claim: Claim, value: float | None) -> bool | None:
    """Tell whether a claim is met; None if there is no value."""
    if value is None:
        return None
    return bool(
        (claim.at_least is None or value >= claim.at_least)
        and (claim.at_most is None or value <= claim.at_most)
    )


def verdict_text(met: bool | None) -> str:
    """Return "met", "not met", or "no value"."""
    return {True: "met", False: "not met", None: "no value"}[met]


def statement(claim: Claim) -> str:
    """Return what is claimed, in one line: of the paper with its place in it."""
    if not claim.paper:
        return "aim of this project"
    text = f"{claim.paper} ({claim.source})" if claim.source else claim.paper
    return one_line(text)


def limit_text(claim: Claim) -> str:
    """Return a claim as a range: "normal_error_mean_deg <= 5 deg"."""
    unit = (METRICS | ANGULAR_METRICS)[claim.metric].unit
    bounds = [
        f"{sign} {format_metric(bound)}"
        for sign, bound in ((">=", claim.at_least), ("<=", claim.at_most))
        if bound is not None
    ]
    return f"{claim.metric} {' and '.join(bounds)} {unit}".rstrip()


def claims_json(verdicts: Iterable[Verdict]) -> str:
    """Return the text of claims.json: a list with an object for each claim, its
    `claim` in words, `metric`, `at_least` and `at_most` (null if there is no such
    bound), the measured `value`, and whether it is `met` (null without a value)."""
    rows = [
        {
            "claim": statement(claim),
            "metric": claim.metric,
            "at_least": claim.at_least,
            "at_most": claim.at_most,
            "value": value,
            "met": met,
        }
        for claim, value, met in verdicts
    ]
    return json.dumps(rows, indent=2, allow_nan=False) + "\n"
