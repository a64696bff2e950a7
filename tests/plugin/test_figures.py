# SPDX-License-Identifier: BSD-3-Clause
"""Figures of many runs say what they show and what they cut."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure

from dual_proxy import figures
from dual_proxy.metrics import METRICS


@pytest.fixture
def drawn(monkeypatch):
    """Figures by name, in place of files."""
    kept = {}
    monkeypatch.setattr(
        figures, "_save", lambda figure, path: kept.setdefault(path.name, figure)
    )
    return kept


def make_series(**changes):
    time = np.arange(0.0, 5.0, 0.01, dtype=np.float32)
    wave = np.sin(time)[:, None] * np.ones((1, 3), np.float32)
    series = {"time": time, "link_lost": np.zeros_like(time)}
    series |= dict.fromkeys(("device", "robot"), 0.01 * wave + 0.5)
    series |= dict.fromkeys(("hand", "reference", "sensed", "contact"), 5.0 * wave)
    series["normal_error_deg"] = np.full_like(time, 2.0)
    series |= dict.fromkeys(("dimension", "true_dimension"), np.ones_like(time))
    return series | changes


def texts(axis):
    return [text.get_text() for text in axis.texts]


@pytest.mark.parametrize(
    ("values", "marks"),
    [
        ([0.0, 5.0], []),
        ([0.0, 42.3, 7.0], ["\u25b2 42"]),
        ([-31.0, np.nan, 20.0], ["\u25bc -31"]),
        ([-31.0, 42.0], ["\u25b2 42", "\u25bc -31"]),
        ([np.nan, np.nan], []),
        ([], []),
    ],
)
def test_what_an_axis_cuts_is_marked(values, marks):
    axis = Figure().subplots()
    axis.plot(values)
    axis.set_ylim(-20.0, 20.0)
    figures.mark_cut(axis)
    assert texts(axis) == marks


def test_zero_need_not_be_in_an_axis():
    axis = Figure().subplots()
    axis.plot([0.5, 0.52])
    figures.mark_cut(axis)
    assert texts(axis) == []


def test_a_scene_names_its_panels_its_run_and_what_is_cut(drawn, tmp_path):
    hand = np.zeros((500, 3), np.float32)
    hand[7, 2] = 42.0
    error = np.full(500, 1.0, np.float32)
    error[3] = 35.0
    series = make_series(hand=hand, normal_error_deg=error)
    figures.draw_scene({0.05: series}, tmp_path / "a.png", "scene plane, seed 3")
    figure = drawn["a.png"]
    (legend,) = figure.legends
    assert legend.get_title().get_text() == "scene plane, seed 3"
    labels = [axis.get_ylabel() for axis in figure.axes]
    assert labels == [
        *("position\nx, m", "position\ny, m", "position\nz, m"),
        *("force\nx, N", "force\ny, N", "force\nz, N"),
        *("error of the\nnormal, deg", "dimension"),
    ]
    assert [texts(axis) for axis in figure.axes] == [
        *([], [], [], [], [], ["\u25b2 42"], ["\u25b2 35"], [])
    ]


@pytest.mark.parametrize("lost", [False, True])
def test_a_lost_link_is_shaded_and_explained(drawn, tmp_path, lost):
    series = make_series()
    series["link_lost"][100:200] = lost
    figures.draw_scene({0.3: series}, tmp_path / "a.png", "scene")
    figure = drawn["a.png"]
    for axis in figure.axes:
        assert sum(len(patch.get_paths()) for patch in axis.collections) == lost
    (legend,) = figure.legends
    assert ("link lost" in [text.get_text() for text in legend.get_texts()]) is lost


def test_a_comparison_names_scene_hand_and_the_seed_that_is_drawn(drawn, tmp_path):
    rows = [("tdpa", 0.0, "soft", seed, True) for seed in (3, 4)]
    table = pd.DataFrame(rows, columns=["scheme", "delay", "hand", "seed", "stable"])
    for key in METRICS:
        table[key] = 0.1
    result = SimpleNamespace(series=make_series)
    figures.draw_comparison(table, [result, result], tmp_path, "plane")
    titles = {
        name: figure.legends[0].get_title().get_text() for name, figure in drawn.items()
    }
    assert titles == {
        "forces_soft.png": "scene plane, soft hand, seed 3",
        "positions_soft.png": "scene plane, soft hand, seed 3",
        "errors_soft.png": "scene plane, soft hand",
    }
