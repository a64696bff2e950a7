# SPDX-License-Identifier: BSD-3-Clause
"""A control period's worst case: `dual-proxy bench cycle`.

Each call of the loop is timed by itself, in the bare engine: both sides, link,
sensor and simulated device, what a period has for it beside the plant.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from dual_proxy.bare import BareStation
from dual_proxy.bench.pages import markdown_table, number_text
from dual_proxy.bench.subject import Results, Subject, make_axes, progress, save_axes
from dual_proxy.run import change_scenario

__all__ = ["SUBJECT", "cycle_table", "measure"]

_MARK = "dual-proxy bench cycle"
# Periods of each row.
_FULL, _QUICK = 1_000_000, 20_000
# Row -> scene, overrides.
_ROWS: dict[str, tuple[str, dict[str, Any]]] = {
    "plane": ("plane", {}),
    "two contacts (inner_corner)": ("inner_corner", {}),
    "rotations, too (flat_tool)": ("flat_tool", {}),
    "point mass (sim_surfaces)": ("sim_surfaces", {}),
    "plane, filter at 1 kHz": ("plane", {"filter.period": 0.001}),
    "plane, inputs that are denormal": (
        "plane",
        {
            "faults": [
                {"input": name, "kind": "denormal", "start": 3.0, "end": 17.0}
                for name in ("sensor", "robot_velocity", "device_velocity")
            ]
        },
    ),
}


def measure(quick: bool) -> Results:
    """Time the periods of each row.

    Returns
    -------
    dict
        `rows`, each with `name`, `cycles`, and of them the `median_us`, `p999_us`
        and `max_us`; `page_faults` in them; `share_above_50us`. A run is repeated, bit
        for bit, until there are so many: `own_us` is the greatest of what each of its
        periods took at least, without what else the machine did meanwhile.
    """
    wanted = _QUICK if quick else _FULL
    rows = []
    for name, (scene, overrides) in _ROWS.items():
        progress(name)
        scenario = change_scenario(scene, overrides=overrides)
        duration = scenario.run_duration()
        times: list[Any] = []
        faults = 0
        while sum(found.size for found in times) < wanted:
            station = BareStation(scenario, duration, rest=1.0)
            found, pages = station.time_cycles(duration)
            times.append(found)
            faults += pages
        of_all = 1e6 * np.concatenate(times)[:wanted]
        rows.append(
            {
                "name": name,
                "cycles": len(of_all),
                "median_us": float(np.median(of_all)),
                "p999_us": float(np.quantile(of_all, 0.999)),
                "max_us": float(of_all.max()),
                "own_us": 1e6 * float(np.min(times, axis=0)[:wanted].max()),
                "share_above_50us": float(np.mean(of_all > 50)),
                "page_faults": faults,
            }
        )
    return {"rows": rows}


def cycle_table(results: Results) -> str:
    """Return the rows, as Markdown."""
    head = ["what runs", "periods", "median, us", "99.9 %, us", "greatest, us"]
    return markdown_table(
        [*head, "its own, us", "longer than 50 us", "page faults"],
        (
            [
                *(row["name"], f"{row['cycles']:d}", number_text(row["median_us"])),
                *(number_text(row[key]) for key in ("p999_us", "max_us", "own_us")),
                f"{1e6 * row['share_above_50us']:.0f} in a million",
                f"{row['page_faults']:d}",
            ]
            for row in results["rows"]
        ),
    )


def _tables(results: Results) -> Mapping[str, str]:
    return {_MARK: cycle_table(results)}


def _draw(results: Results, path: Path) -> None:
    axes = make_axes(1, 1, (8, 4.5))
    axis = axes[0, 0]
    rows = results["rows"]
    places = np.arange(len(rows))
    for key, label, shift in (
        ("median_us", "median", -0.25),
        ("p999_us", "99.9 %", 0.0),
        ("max_us", "greatest", 0.25),
    ):
        axis.barh(places + shift, [row[key] for row in rows], 0.22, label=label)
    axis.set_yticks(places, [row["name"] for row in rows])
    axis.set_xscale("log")
    axis.set_xlabel("a call of the loop, us")
    axis.legend(frameon=False)
    save_axes(axes, path)


SUBJECT = Subject("cycle", (_MARK,), measure, _tables, _draw)
