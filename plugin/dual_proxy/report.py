# SPDX-License-Identifier: BSD-3-Clause
"""One self-contained HTML page that shows a run: pictures, metrics, parameters."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from dual_proxy.claims import Verdict, limit_text, statement, verdict_text
from dual_proxy.log import (
    SIGNALS,
    counts,
    release,
    replace_file,
    signal,
)
from dual_proxy.metrics import (
    ANGULAR_METRICS,
    METRICS,
    Limit,
    describe_broken_limits,
    device_in_robot_frame,
    format_metric,
    metrics_out_of_limits,
    normal_error_deg,
)

if TYPE_CHECKING:
    from dual_proxy.scenario import Scenario

__all__ = ["render_report", "write_report"]

Array = NDArray[np.float64]

# Colour-blind safe (Okabe and Ito), one meaning each on the whole page.
_BLUE, _ORANGE, _GREEN, _PURPLE, _GREY = (
    "#0072b2",
    "#d55e00",
    "#009e73",
    "#8a5fb0",
    "#6b7280",
)
_JOINT_COLORS = (_BLUE, _ORANGE, _GREEN, _PURPLE, "#b8860b", "#56b4e9", "#444b55")
_AXES = "xyz"
_MAX_POINTS = 4000
_STATUS = ("waiting", "connected", "lost")

_STYLE = """
:root { color-scheme: light; --ink: #1c2430; --soft: #5b6573; --line: #e3e7ec;
  --accent: #0072b2; --paper: #fff; --ground: #f5f7f9; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--ground); color: var(--ink);
  font: 15px/1.55 system-ui, -apple-system, "Segoe UI", sans-serif; }
main { max-width: 1080px; margin: 0 auto; padding: 32px 20px 64px; }
h1 { font-size: 26px; margin: 0 0 4px; }
h2 { font-size: 18px; margin: 0 0 4px; }
p { margin: 0 0 12px; color: var(--soft); max-width: 76ch; }
section { background: var(--paper); border: 1px solid var(--line);
  border-radius: 10px; padding: 20px 22px; margin-top: 20px; }
img { width: 100%; height: auto; display: block; }
.facts { display: flex; flex-wrap: wrap; gap: 8px; margin: 14px 0 0; padding: 0;
  list-style: none; }
.facts li { background: var(--paper); border: 1px solid var(--line);
  border-radius: 999px; padding: 3px 12px; }
.facts b { font-weight: 600; }
.failed { border-left: 5px solid #b42318; }
.failed h2, .failed p { color: #b42318; }
.scroll { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; padding: 6px 12px 6px 0; vertical-align: top;
  border-top: 1px solid var(--line); }
thead th { border-top: 0; color: var(--soft); font-weight: 600; }
td.number { text-align: right; font-variant-numeric: tabular-nums; }
td.number, td.limit { white-space: nowrap; }
tr.out td, tr.out code { color: #b42318; font-weight: 600; }
td.note, tr.out td.note { color: var(--soft); font-weight: 400; }
code, pre { font: 13px/1.5 ui-monospace, "SF Mono", Menlo, Consolas, monospace; }
pre { margin: 8px 0 0; overflow-x: auto; background: var(--ground);
  padding: 14px; border-radius: 8px; }
details summary { cursor: pointer; color: var(--accent); }
footer { color: var(--soft); margin-top: 20px; font-size: 13px; }
"""


def write_report(
    log: pd.DataFrame,
    metrics: Mapping[str, Any],
    scenario: Scenario,
    path: str | Path,
    failure: str = "",
    links: Iterable[str] = (),
    recording: str = "",
    verdicts: Sequence[Verdict] = (),
) -> None:
    """Write `render_report` to a file, whole or not at all."""
    text = render_report(log, metrics, scenario, failure, links, recording, verdicts)
    replace_file(path, text.encode())


def render_report(
    log: pd.DataFrame,
    metrics: Mapping[str, Any],
    scenario: Scenario,
    failure: str = "",
    links: Iterable[str] = (),
    recording: str = "",
    verdicts: Sequence[Verdict] = (),
) -> str:
    """Return the page.

    Parameters
    ----------
    log : DataFrame
        As `dual_proxy.log.make_frame` makes it; may be cut short or empty.
    metrics : Mapping
        As `dual_proxy.metrics.compute_metrics` makes it.
    scenario : Scenario
        What was run.
    failure : str
        Why the run stopped early; empty if it did not.
    links : iterable of str
        Files beside the report to link to.
    recording : str
        `Run.recording`: what was made of a recording.
    verdicts : sequence of Verdict
        `Run.judge_claims`: what is claimed of the scene.
    """
    title = f"{scenario.name}: {scenario.scheme}, {scenario.link.delay * 1e3:g} ms"
    facts = [
        ("scheme", scenario.scheme),
        ("law", scenario.law),
        ("one-way delay", f"{scenario.link.delay * 1e3:g} ms"),
        ("link", f"{scenario.link.rate:g} Hz"),
        ("seed", str(scenario.seed)),
        ("simulated", f"{format_metric(metrics['sim_s'])} s"),
    ]
    if metrics["real_time_factor"] is not None:
        facts.append(("real-time factor", format_metric(metrics["real_time_factor"])))
    chips = "".join(
        f"<li>{html.escape(key)} <b>{html.escape(value)}</b></li>"
        for key, value in facts
    )
    parts = [
        f"<h1>{html.escape(title)}</h1>",
        f"<p>{html.escape(scenario.description)}</p>" if scenario.description else "",
        f'<ul class="facts">{chips}</ul>',
    ]
    if recording:
        file = html.escape(scenario.operator.recording)
        parts.append(f"<p>Recording {file}: {html.escape(recording)}.</p>")
    if failure:
        parts.append(
            '<section class="failed"><h2>This run failed</h2>'
            f"<p>{html.escape(failure)}</p><p>What was logged until then is below."
            "</p></section>"
        )
    if metrics["limits_broken"]:
        broken = describe_broken_limits(log, scenario)
        items = "".join(f"<li>{html.escape(text)}</li>" for text in broken)
        parts.append(
            '<section class="failed"><h2>This run broke limits of the arm</h2>'
            f"<p>A real arm would have stopped.</p><ul>{items}</ul></section>"
        )
    parts.append(_claims_table(verdicts))
    parts.append(_metrics_table(metrics))
    parts.append(_counters_table(log))
    if len(log) > 1:
        parts += [
            _section(log, scenario, *entry)
            for entry in _SECTIONS
            if _NEEDS.get(entry[0]) in (None, *log.columns)
        ]
    parts.append(
        "<section><h2>Scenario</h2><p>Every value of this run; "
        "<code>dual-proxy run scenario.yaml</code> repeats it.</p>"
        "<details><summary>Show all parameters</summary>"
        f"<pre>{html.escape(scenario.to_yaml())}</pre></details></section>"
    )
    names = [html.escape(name, quote=True) for name in links]
    if names:
        items = ", ".join(f'<a href="{name}">{name}</a>' for name in names)
        parts.append(f"<footer>Beside this page: {items}</footer>")
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{html.escape(title)}</title><style>{_STYLE}</style></head>"
        f"<body><main>{''.join(parts)}</main></body></html>\n"
    )


def _claims_table(verdicts: Sequence[Verdict]) -> str:
    if not verdicts:
        return ""
    rows = "".join(
        f"<tr{'' if met else _OUT}><td>{html.escape(statement(claim))}</td>"
        f'<td class="limit"><code>{html.escape(limit_text(claim))}</code></td>'
        f'<td class="number">{format_metric(value)}</td>'
        f"<td>{verdict_text(met)}</td></tr>"
        for claim, value, met in verdicts
    )
    return (
        "<section><h2>Claims</h2><p>What the paper says of this scene, with its place "
        "there, and what this project aims at, as limits of metrics.</p>"
        '<div class="scroll"><table><thead><tr><th>claim</th><th>limit</th>'
        "<th>measured</th><th>met</th></tr></thead>"
        f"<tbody>{rows}</tbody></table></div></section>"
    )


def _metrics_table(metrics: Mapping[str, Any]) -> str:
    described = METRICS | ANGULAR_METRICS
    out = set(metrics_out_of_limits(metrics))
    rows = "".join(
        f"<tr{_OUT if key in out else ''}><td><code>{key}</code></td>"
        f'<td class="number">{format_metric(value)}</td>'
        f"<td>{described[key].unit}</td>"
        f'<td class="limit">{_format_limit(described[key].limit)}</td>'
        f'<td class="note">{html.escape(described[key].description)}</td></tr>'
        for key, value in metrics.items()
    )
    return (
        "<section><h2>Metrics</h2><p>From the log and the simulator's true "
        "contacts; a dash means that it does not apply. Limits are those of the "
        "arm, which a run must not break, or what a good run keeps to; what is "
        "out is red.</p>"
        '<div class="scroll"><table><thead><tr><th>metric</th><th>value</th>'
        "<th>unit</th><th>limit</th><th>what it is</th></tr></thead>"
        f"<tbody>{rows}</tbody></table></div></section>"
    )


_OUT = ' class="out"'


def _format_limit(limit: Limit | None) -> str:
    if limit is None:
        return ""
    bound = f"&ge; {limit.least:g}" if limit.least > -np.inf else f"&le; {limit.most:g}"
    return f"{bound}{', arm' if limit.of_arm else ''}"


def _counters_table(log: pd.DataFrame) -> str:
    rows = "".join(
        f'<tr><td><code>{name}</code></td><td class="number">{total}</td>'
        f'<td class="note">{html.escape(SIGNALS[name].description)}</td></tr>'
        for name, total in counts(log).items()
    )
    if not rows:
        return ""
    return (
        "<section><h2>Counters</h2><p>What both sides, the link and the simulated "
        "hardware counted over the run; those that stayed at zero are left out."
        '</p><div class="scroll"><table><thead><tr><th>counter</th><th>total</th>'
        f"<th>what it counts</th></tr></thead><tbody>{rows}</tbody></table></div>"
        "</section>"
    )


def _section(
    log: pd.DataFrame,
    scenario: Scenario,
    heading: str,
    text: str,
    count: int,
    draw: Callable[[pd.DataFrame, Scenario, list[Axes]], None],
) -> str:
    figure = Figure(figsize=(10.4, 0.7 + 1.75 * count), layout="constrained")
    FigureCanvasAgg(figure)
    axes = list(figure.subplots(count, 1, sharex=True, squeeze=False)[:, 0])
    force = signal(log, "contact_force")
    touching = np.einsum("ij,ij->i", force, force) > 0.5**2
    time = log.index.to_numpy(np.float64)
    # The rows beside those where a contact begins or ends say it all.
    changes = np.flatnonzero(touching[1:] != touching[:-1])
    corners = np.unique([0, *changes, *(changes + 1), len(time) - 1])
    for axis in axes:
        axis.grid(color="#e3e7ec", linewidth=0.7)
        axis.spines[["top", "right"]].set_visible(False)
        axis.fill_between(
            time[corners], 0, 1, where=touching[corners].tolist(), color="#eef2f6",
            linewidth=0, transform=axis.get_xaxis_transform(),
        )  # fmt: skip
    draw(log, scenario, axes)
    for axis in axes:
        if axis.get_legend_handles_labels()[0]:
            axis.legend(
                loc="center left",
                bbox_to_anchor=(1.0, 0.5),
                frameon=False,
                fontsize=8,
            )
    axes[-1].set_xlabel("time, s")
    axes[0].set_xlim(float(time[0]), float(time[-1]))
    buffer = io.BytesIO()
    # Without the date and version that matplotlib would add, equal runs give
    # equal pages.
    figure.savefig(buffer, format="png", dpi=96, metadata={"Software": None})
    release(log)
    data = base64.b64encode(buffer.getvalue()).decode()
    return (
        f"<section><h2>{heading}</h2><p>{text}</p>"
        f'<img alt="{heading}" src="data:image/png;base64,{data}"></section>'
    )


def _plot(axis: Axes, log: pd.DataFrame, values: Array, **style: Any) -> None:
    """Plot against time; long series as the extremes of short spans."""
    time = log.index.to_numpy(np.float64)
    span = -(-2 * len(values) // _MAX_POINTS)
    if span > 2 and np.isfinite(values).all():
        count = len(values) // span
        blocks = values[: count * span].reshape(count, span)
        first = span * np.arange(count)
        pairs = np.sort([first + blocks.argmin(1), first + blocks.argmax(1)], axis=0)
        rows = np.append(pairs.T.ravel(), len(values) - 1)
        time, values = time[rows], values[rows]
    axis.plot(time, values, linewidth=1.1, **style)


def _draw_positions(log: pd.DataFrame, scenario: Scenario, axes: list[Axes]) -> None:
    hand = device_in_robot_frame(scenario, signal(log, "hand_position"))
    device = device_in_robot_frame(scenario, signal(log, "device_position"))
    proxy = signal(log, "robot_proxy_position")
    robot = signal(log, "robot_position")
    for i, axis in enumerate(axes):
        _plot(axis, log, hand[:, i], color=_GREY, linestyle=":", label="hand intends")
        _plot(axis, log, device[:, i], color=_ORANGE, label="device, mapped")
        _plot(axis, log, proxy[:, i], color=_PURPLE, linestyle="--", label="proxy")
        _plot(axis, log, robot[:, i], color=_BLUE, label="robot")
        axis.set_ylabel(f"{_AXES[i]}, m")


def _draw_forces(log: pd.DataFrame, scenario: Scenario, axes: list[Axes]) -> None:
    # The force on the hand, turned to B and negated: what the hand exerts.
    hand = -signal(log, "device_force") @ scenario.map.R_DB
    curves = (
        ("true contact", signal(log, "contact_force"), _GREY, "-"),
        ("sensed", signal(log, "sensed_force"), _BLUE, "-"),
        ("reference", signal(log, "reference_force"), _PURPLE, "--"),
        ("hand exerts", hand, _ORANGE, "-"),
    )
    for i, axis in enumerate(axes):
        for label, values, color, line in curves:
            _plot(axis, log, values[:, i], color=color, linestyle=line, label=label)
        axis.set_ylabel(f"{_AXES[i]}, N")


def _draw_perception(log: pd.DataFrame, scenario: Scenario, axes: list[Axes]) -> None:
    del scenario
    _plot(axes[0], log, normal_error_deg(log), color=_BLUE, label="normal error")
    axes[0].set_ylabel("error, deg")
    axes[0].set_ylim(bottom=0.0)
    _draw_dimensions(log, "contact_dimension", "dimension", axes[1])


def _draw_dimensions(log: pd.DataFrame, true: str, estimate: str, axis: Axes) -> None:
    for name, color, line, label in (
        (true, _GREY, "-", "true"),
        (estimate, _BLUE, "--", "filter"),
    ):
        values = signal(log, name).astype(np.float64)
        style: dict[str, Any] = {"color": color, "linestyle": line, "label": label}
        _plot(axis, log, values, drawstyle="steps-post", **style)
    axis.set_ylabel("dimension")
    axis.set_yticks(range(4))
    axis.set_ylim(-0.2, 3.2)


def _draw_rotations(log: pd.DataFrame, scenario: Scenario, axes: list[Axes]) -> None:
    del scenario
    curves = (("sensed_moment", _BLUE, "-"), ("reference_moment", _PURPLE, "--"))
    for i, axis in enumerate(axes[:3]):
        for name, color, line in curves:
            label = name.removesuffix("_moment")
            values = signal(log, name)[:, i]
            _plot(axis, log, values, color=color, linestyle=line, label=label)
        axis.set_ylabel(f"{_AXES[i]}, N m")
    _draw_dimensions(log, "contact_moment_dimension", "moment_dimension", axes[3])


def _draw_link(log: pd.DataFrame, scenario: Scenario, axes: list[Axes]) -> None:
    del scenario
    for side, color, line in (("robot", _BLUE, "-"), ("haptic", _ORANGE, "--")):
        age = 1e3 * signal(log, f"{side}_link_age")
        status = signal(log, f"{side}_link_status").astype(np.float64)
        style: dict[str, Any] = {"color": color, "linestyle": line, "label": side}
        _plot(axes[0], log, age, **style)
        _plot(axes[1], log, status, drawstyle="steps-post", **style)
    axes[0].set_ylabel("age, ms")
    axes[0].set_ylim(bottom=0.0)
    axes[1].set_yticks(range(3), _STATUS)
    axes[1].set_ylim(-0.2, 2.2)


def _draw_torques(log: pd.DataFrame, scenario: Scenario, axes: list[Axes]) -> None:
    del scenario
    period = np.diff(log.index.to_numpy(np.float64))
    largest = np.zeros(len(log))
    for joint, color in enumerate(_JOINT_COLORS):
        torque = signal(log, "torque")[:, joint]
        _plot(axes[0], log, torque, color=color, label=f"joint {joint + 1}")
        np.maximum(largest[1:], np.abs(np.diff(torque) / period), out=largest[1:])
    _plot(axes[1], log, largest, color=_BLUE, label="largest joint")
    axes[0].set_ylabel("torque, N m")
    axes[1].set_ylabel("|rate|, N m/s")
    axes[1].set_ylim(bottom=0.0)


def _draw_energy(log: pd.DataFrame, scenario: Scenario, axes: list[Axes]) -> None:
    del scenario
    _plot(axes[0], log, signal(log, "observed_energy"), color=_BLUE)
    _plot(axes[1], log, signal(log, "injected_damping"), color=_ORANGE)
    axes[0].set_ylabel("energy, J")
    axes[1].set_ylabel("damping, N s/m")


# Heading, text, number of axes, what draws them.
_Section: TypeAlias = tuple[
    str, str, int, Callable[[pd.DataFrame, "Scenario", list[Axes]], None]
]
_SECTIONS: tuple[_Section, ...] = (
    (
        "Positions",
        "Both sides in the robot's base frame. Shaded: the tool truly touches.",
        3,
        _draw_positions,
    ),
    (
        "Forces",
        "In the robot's base frame, as exerted on the environment; the hand's is "
        "what the hand exerts on the device, turned into that frame.",
        3,
        _draw_forces,
    ),
    (
        "Contact direction",
        "Angle between the filter's direction and the true normal, and the number "
        "of contact directions, estimated and true.",
        2,
        _draw_perception,
    ),
    (
        "Link",
        "Age of the message in use and state of the link, on both sides.",
        2,
        _draw_link,
    ),
    (
        "Torques",
        "Commanded joint torques and the fastest change among them.",
        2,
        _draw_torques,
    ),
    (
        "Passivity",
        "Energy that the passivity observer saw in the force loop, and the damping "
        "that the passivity controller injected.",
        2,
        _draw_energy,
    ),
    (
        "Rotations",
        "Moments about the tool point, in the robot's base frame, as exerted on the "
        "environment, and the number of blocked rotations, estimated and true.",
        4,
        _draw_rotations,
    ),
)
# Headings of what not every run has, a filter or joints -> a column that tells.
_NEEDS = {
    "Contact direction": "dimension",
    "Torques": "torque_0",
    "Rotations": "moment_dimension",
}
