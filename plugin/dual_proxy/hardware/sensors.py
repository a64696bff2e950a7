# SPDX-License-Identifier: BSD-3-Clause
"""Force sensors as they are named on the command line."""

from __future__ import annotations

from dual_proxy._core import RdtSensor
from dual_proxy.scenario import ScenarioError

__all__ = ["make_rdt_sensor", "rdt_host"]


def rdt_host(text: str, expected: str) -> str:
    """Return the host of `rdt:HOST`; raise ScenarioError with what was expected."""
    kind, _, host = text.partition(":")
    if kind != "rdt" or not host:
        raise ScenarioError(f"--sensor: expected {expected}, got {text!r}")
    return host


def make_rdt_sensor(host: str) -> RdtSensor:
    """Return a sensor, not open yet, with its scales. Raises DriverError."""
    from dual_proxy.ft_sensor import fetch_rdt_params

    return RdtSensor(fetch_rdt_params(host))
