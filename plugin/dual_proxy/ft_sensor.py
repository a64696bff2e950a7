# SPDX-License-Identifier: BSD-3-Clause
"""What a force/torque sensor says of itself: scales and units of an RDT stream."""

from __future__ import annotations

import math
import re
import time
import urllib.error
import urllib.request
import xml.etree.ElementTree as ET
from http.client import HTTPException
from typing import Any

from dual_proxy._core import DriverError, RdtSensorParams
from dual_proxy.text import one_line

__all__ = ["fetch_rdt_params", "rdt_params_from_xml"]

_MOST_BYTES = 1 << 18
# By code, as in fields cfgfu and cfgtu of the page.
_FORCE_UNITS = ("lbf", "N", "klbf", "kN", "kgf", "gf")
_TORQUE_UNITS = ("lbf-in", "lbf-ft", "Nm", "Nmm", "kgf-cm", "kNm")


def fetch_rdt_params(
    host: str, *, http_port: int = 80, timeout: float = 2.0, **fields: Any
) -> RdtSensorParams:
    """Ask a sensor for its scales and units.

    Parameters
    ----------
    host : its name or address; its page is `http://HOST/netftapi2.xml`.
    timeout : s, for all of it.
    fields : further ones of `RdtSensorParams`: how it is mounted (`R_SN`), ...

    Raises
    ------
    DriverError
        If it does not answer, or its page has no scales and units, or says that
        RDT is off.
    """
    url = f"http://{host}:{http_port}/netftapi2.xml"
    try:
        page = _fetch(url, timeout)
    except (OSError, HTTPException, ValueError) as error:
        reason = getattr(error, "reason", None) or error
        raise DriverError(f"{url}: {one_line(reason, 200)}") from None
    try:
        return rdt_params_from_xml(page, host=host, **fields)
    except DriverError as error:
        raise DriverError(f"{url}: {error}") from None


def rdt_params_from_xml(page: bytes, **fields: Any) -> RdtSensorParams:
    """Read scales and units from the page `netftapi2.xml` of a sensor.

    Raises
    ------
    DriverError
        Naming the field that is missing or wrong.
    """
    # What an entity stands for could be of any size; the page needs none.
    if b"\0" in page or b"<!" in page.replace(b"<!--", b""):
        raise DriverError("expected XML without declarations of types or entities")
    try:
        root = ET.fromstring(page)
    except (ET.ParseError, LookupError, ValueError) as error:
        raise DriverError(f"expected XML: {one_line(error, 200)}") from None
    texts: dict[str, str] = {}
    for element in root.iter():
        texts.setdefault(element.tag.rpartition("}")[2], (element.text or "").strip())
    if texts.get("comrdte", "").lower() in ("0", "disabled"):
        raise DriverError(
            'field `comrdte` expected "Enabled", got '
            f'"{texts["comrdte"]}": RDT is off; see the sensor\'s page Communications'
        )
    return RdtSensorParams(
        counts_per_force=_scale(texts, "cfgcpf"),
        counts_per_torque=_scale(texts, "cfgcpt"),
        force_unit=_unit(texts, "cfgfu", _FORCE_UNITS),
        torque_unit=_unit(texts, "cfgtu", _TORQUE_UNITS),
        **fields,
    )


def _fetch(url: str, timeout: float) -> bytes:
    # A sensor is on a network of its own; no proxy knows it.
    opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
    end = time.monotonic() + timeout
    page = b""
    with opener.open(url, timeout=timeout) as response:
        # A timeout is that of a single read, of which there may be any number.
        while chunk := response.read1(65536):
            page += chunk
            if len(page) > _MOST_BYTES:
                raise ValueError(f"expected at most {_MOST_BYTES} bytes")
            if time.monotonic() > end:
                raise ValueError(f"not complete after {timeout:g} s")
    return page


def _field(texts: dict[str, str], name: str) -> str:
    if not texts.get(name):
        raise DriverError(f"field `{name}` is missing")
    return texts[name]


def _scale(texts: dict[str, str], name: str) -> float:
    text = _field(texts, name)
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise DriverError(f"field `{name}` expected a number > 0, got {text[:80]!r}")
    return value


def _plain(unit: str) -> str:
    """Return "nm" for "N-m", "N.m" and "Nm", of which sensors have each."""
    return re.sub(r"[-. ]", "", unit).lower()


def _unit(texts: dict[str, str], name: str, units: tuple[str, ...]) -> str:
    """Return a unit by its name (`scfgfu`), or by its code where there is none."""
    if text := texts.get(f"s{name}"):
        name = f"s{name}"
        found = [unit for unit in units if _plain(unit) == _plain(text)]
    else:
        text = _field(texts, name)
        found = [unit for i, unit in enumerate(units, 1) if text == str(i)]
    if not found:
        raise DriverError(
            f"field `{name}` expected one of {', '.join(units)}, got {text[:80]!r}"
        )
    return found[0]
