# SPDX-License-Identifier: BSD-3-Clause
"""The situations of real contact that the filter is held against, by name."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from dual_proxy._core import FilterTrialParams

__all__ = ["SITUATIONS", "Situation"]

# In place of noise on each update's mean, what a real sensor adds at 1 kHz.
_SENSOR = {
    "force_noise": 0.0,
    "sensor_noise": (0.1, 0.2),
    "sensor_hum": 0.1,
    "sensor_step": 0.02,
}


@dataclass(frozen=True)
class Situation:
    """Trials of a kind, and what the filter is told of the sensors."""

    trial: dict[str, Any]
    """Of `FilterTrialParams`; of a tuple each trial has the next value."""
    cone: dict[str, float] = field(default_factory=dict)
    """Of `FrictionConeParams`."""

    def trials(self, number: int) -> list[FilterTrialParams]:
        """Return trials, each with a seed of its own."""
        fields = {"drive": "quasi_static"} | _SENSOR | self.trial
        return [
            FilterTrialParams(
                seed=seed,
                **{
                    name: value[seed % len(value)]
                    if isinstance(value, tuple)
                    else value
                    for name, value in fields.items()
                },
            )
            for seed in range(number)
        ]


_DRIVES = ("quasi_static", "closed_loop")
_PLANE = {"scene": "plane", "friction": (0.0, 0.25, 0.5), "speed": (0.03, 0.06)}
_CORNER = {
    "scene": "pressed_corner",
    "friction": (0.0, 0.3),
    "stiffness": (3e3, 1e4, 2e4),
}
_FREE = {"scene": "free", "drive": _DRIVES}
_FITTING = {"friction": (0.0, 0.15, 0.3), "drive": _DRIVES}
_SPIKES = {"spike": 50.0}
_BIAS = {"sensor_bias": (0.3, 0.6, 1.0)}
_COMPLIANT = {"tool_compliance": (3e-4, 6e-4, 1e-3)}

#: Of what a trial goes through by tuples of 2 and of 3, six are all of it.
SITUATIONS: dict[str, Situation] = {
    "plane": Situation(_PLANE | {"drive": _DRIVES}),
    "corner that gives": Situation(_CORNER),
    "corner that gives, closed loop": Situation(_CORNER | {"drive": "closed_loop"}),
    "soft corner": Situation(_CORNER | {"stiffness": (1e3, 2e3, 3e3)}),
    "bias, plane": Situation(_PLANE | _BIAS),
    "bias, corner": Situation(_CORNER | _BIAS),
    "bias, free": Situation(_FREE | _BIAS),
    "turning bias, plane": Situation(
        _PLANE | {"sensor_bias": (0.2, 0.5), "bias_turn": 0.3}
    ),
    "turning bias, free": Situation(
        _FREE | {"sensor_bias": (0.3, 0.8), "bias_turn": 0.5}
    ),
    "bias never learned, plane": Situation(
        _PLANE | {"sensor_bias": (0.2, 0.4, 0.6), "filter_start": 0.3}
    ),
    "wall met at rest": Situation({"scene": "wall_at_rest", "friction": 0.0}),
    "wall met at rest, friction": Situation({"scene": "wall_at_rest", "friction": 0.2}),
    "spikes, plane": Situation(_PLANE | _SPIKES),
    "spikes, corner": Situation(_CORNER | _SPIKES),
    "spikes, free": Situation(_FREE | _SPIKES),
    "pulled at rest": Situation({"scene": "pulled", "friction": 0.4}),
    "pulled at rest, noisy velocity": Situation(
        {"scene": "pulled", "friction": 0.4, "velocity_noise": 2e-3},
        {"velocity_noise": 2e-3},
    ),
    "breathing, at rest": Situation(
        {"scene": "still", "hold_time": 6.0, "breathing": 5e-3}
    ),
    "breathing, sliding": Situation(_PLANE | {"breathing": 5e-3}),
    "conveyor, at rest": Situation(
        {
            "scene": "still",
            "hold_time": 6.0,
            "friction": (0.1, 0.4),
            "surface_speed": (0.02, 0.05, 0.08),
        }
    ),
    "conveyor, sliding": Situation(_PLANE | {"surface_speed": (0.02, 0.05, 0.08)}),
    "tissue": Situation(
        {
            "scene": "plane",
            "stiffness": 300.0,
            "force": 10.0,
            "friction": (0.2, 0.4),
            "speed": (0.01, 0.02, 0.03),
        }
    ),
    "stick-slip": Situation(
        {"scene": "plane", "friction": (0.2, 0.3), "stiction": 0.2, "speed": 0.02}
    ),
    "compliant tool, plane": Situation(_PLANE | _COMPLIANT),
    "compliant tool, corner": Situation(_CORNER | _COMPLIANT),
    "V-groove": Situation({"scene": "groove"} | _FITTING),
    "slot": Situation({"scene": "slot"} | _FITTING),
    "bore": Situation({"scene": "bore"} | _FITTING),
    "chamfer": Situation({"scene": "chamfer"} | _FITTING),
    "cylinder of 20 mm": Situation(
        {
            "scene": "cylinder",
            "radius": 0.02,
            "friction": (0.0, 0.2, 0.4),
            "speed": (0.015, 0.03),
        }
    ),
    "friction 0.8": Situation(_PLANE | {"friction": (0.7, 0.8, 0.9)}),
}
