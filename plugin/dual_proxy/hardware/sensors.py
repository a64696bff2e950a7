# SPDX-License-Identifier: BSD-3-Clause
"""Force sensors as they are named on the command line."""

from __future__ import annotations

from dual_proxy._core import RdtSensor
from dual_proxy.scenario import ScenarioError

__all__ = ["make_rdt_sensor", "rdt_host"]


def rdt_host(text: str, expected: str) -> str:
    """Return what follows `rdt:`, HOST or HOST:PORT with the port of its web page;
    raise ScenarioError with what was expected."""
    kind, _, host = text.partition(":")
    name, colon, port = host.partition(":")
    if kind != "rdt" or not name or (colon and not _is_port(port)):
        raise ScenarioError(f"--sensor: expected {expected}, got {text!r}")
    return host


def _is_port(text: str) -> bool:
    return text.isdecimal() and 1 <= int(text) <= 65535


def make_rdt_sensor(host: str) -> RdtSensor:
    """Return a sensor, not open yet, with its scales. Raises DriverError."""
    from dual_proxy.ft_sensor import fetch_rdt_params

    name, _, port = host.partition(":")
    return RdtSensor(fetch_rdt_params(name, http_port=int(port or 80)))
