# SPDX-License-Identifier: BSD-3-Clause
"""Scenes of several surfaces, and of Drake's models."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pydrake.systems.framework import DiagramBuilder

import dual_proxy as dp
from dual_proxy.log import signal
from dual_proxy.panda import add_panda_scene
from dual_proxy.station import build_station

DATA = Path(__file__).resolve().parents[1] / "data"
MODELS = DATA / "models" / "block_and_ball.dmd.yaml"


@pytest.fixture(scope="module")
def runs():
    scenario = dp.load_scenario(DATA / "surfaces.yaml")
    return {engine: dp.run(scenario, engine=engine) for engine in ("drake", "bare")}


def test_both_engines_build_the_same_world(runs):
    drake, bare = runs["drake"].log, runs["bare"].log
    for name in ("robot_position", "device_position"):
        difference = np.abs(signal(bare, name) - signal(drake, name))
        assert difference.max() < 2e-3, name
    # On the ramp, on the pipe, on the rod.
    for where in (slice(2.5, 3.5), slice(9.5, 10.5), slice(14.0, 15.0)):
        pressed = bare.loc[where], drake.loc[where]
        for log in pressed:
            assert (log["contact_dimension"] == 1).all()
        forces = [signal(log, "contact_force").mean(axis=0) for log in pressed]
        assert np.linalg.norm(forces[1]) > 2.0
        np.testing.assert_allclose(*forces, rtol=0, atol=0.1)
        normals = [signal(log, "contact_normal") for log in pressed]
        assert np.einsum("ij,ij->i", *normals).min() > np.cos(np.radians(0.5))


def test_normal_is_the_ramps(runs):
    for run in runs.values():
        normal = signal(run.log.loc[2.5:3.5], "contact_normal")
        expected = [-np.sin(0.2), 0.0, -np.cos(0.2)]
        np.testing.assert_allclose(
            normal, np.tile(expected, (len(normal), 1)), atol=1e-9
        )


def test_ramp_and_pipe_make_a_corner(runs):
    for run in runs.values():
        in_corner = run.log.loc[5.6:6.0]
        assert (in_corner["contact_dimension"] == 2).mean() > 0.9
        assert (in_corner["dimension"] == 2).mean() > 0.9


def test_a_bore_is_for_the_bare_engine(tmp_path):
    bore = {
        "name": "bore",
        "shape": "cylinder",
        "position": [0.45, 0.0, 0.49],
        "radius": 0.1,
        "length": 0,
        "hollow": True,
    }
    scenario = dp.load_scenario("plane").with_overrides(
        {"scene.table": False, "scene.surfaces": [bore], "duration": 5.0}
    )
    run = dp.run(scenario, engine="bare")
    assert run.log.loc[5.0, "contact_force_z"] < -3.0
    run.save(tmp_path)
    assert (tmp_path / "replay.html").exists()
    with pytest.raises(
        dp.ScenarioError,
        match=r"^plane.scene.surfaces\[0\].hollow: expected false with engine drake",
    ):
        dp.run(scenario)


# --- Model directives --------------------------------------------------------


@pytest.fixture(scope="module")
def with_models():
    return dp.load_scenario("plane").with_overrides(
        {"scene.model_directives": str(MODELS), "duration": 8.0}
    )


def test_a_path_is_relative_to_the_scenarios_file(tmp_path):
    text = dp.load_scenario("plane").to_yaml()
    text = text.replace("scene:", "scene:\n    model_directives: more.yaml", 1)
    text = text.replace("model_directives: ''", "")
    (tmp_path / "x.yaml").write_text(text)
    scenario = dp.load_scenario(tmp_path / "x.yaml")
    assert scenario.scene.model_directives == str(tmp_path / "more.yaml")


def test_models_are_part_of_the_world(with_models):
    run, alone = dp.run(with_models), dp.run("plane", duration=8.0)
    # The tool slides until it meets the block, whose face is at 0.50 m.
    assert alone.log.loc[8.0, "robot_position_x"] > 0.51
    assert run.log.loc[8.0, "robot_position_x"] == pytest.approx(0.49, abs=1e-3)
    assert run.log.loc[8.0, "contact_dimension"] == 2
    before = slice(0.0, 5.0)
    assert run.log.loc[before, "contact_dimension"].max() == 1
    assert not signal(run.log.loc[0.0:3.0], "contact_force").any()


def test_both_wirings_have_the_same_bits_with_models(with_models):
    logs = []
    for wiring in ("fused", "systems"):
        station = build_station(with_models, wiring=wiring)
        station.advance_to(4.0)
        log = station.log_frame()
        logs.append(log[sorted(log.columns)])
    assert logs[0].equals(logs[1])


def test_a_free_body_moves_and_is_no_contact_of_the_tool(with_models):
    station = build_station(with_models)
    station.advance_to(1.0)
    plant = station.diagram.GetSubsystemByName("plant")
    context = plant.GetMyContextFromRoot(station.simulator.get_context())
    ball = plant.GetBodyByName("ball")
    height = plant.EvalBodyPoseInWorld(context, ball).translation()[2]
    assert height == pytest.approx(0.43, abs=1e-3)
    results = plant.get_contact_results_output_port().Eval(context)
    assert results.num_point_pair_contacts() == 1
    assert station.log_frame()["contact_dimension"].max() == 0
    assert plant.num_positions() == 7 + 7


def test_models_are_drawn(with_models):
    scene = add_panda_scene(DiagramBuilder(), with_models.scene, touching=False)
    block = scene.plant.GetBodyByName("block")
    assert len(scene.plant.GetVisualGeometriesForBody(block)) == 1


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        (None, 'expected a file, got "'),
        ("directives: 3\n", ".*directives"),
        ("directives: [{add_model: {name: a, file: 'file:///no.sdf'}}]\n", ".*no.sdf"),
    ],
)
def test_directives_that_cannot_be_read_are_named(tmp_path, text, problem):
    path = tmp_path / "models.dmd.yaml"
    if text is not None:
        path.write_text(text)
    with pytest.raises(
        dp.ScenarioError, match=f"^plane.scene.model_directives: {problem}"
    ) as caught:
        dp.run("plane", overrides={"scene.model_directives": str(path)})
    assert "\n" not in str(caught.value)
    assert str(path) in str(caught.value)


def test_an_ellipsoid_that_touches_is_refused():
    egg = str(MODELS.with_name("egg.dmd.yaml"))
    with pytest.raises(
        dp.ScenarioError,
        match=r"^plane.scene.model_directives: geometry 'nest::shell' of body 'egg' of "
        "model 'nest' is an Ellipsoid, .* up to 22 degrees off",
    ):
        dp.run("plane", overrides={"scene.model_directives": egg})


def test_models_need_drake(with_models):
    with pytest.raises(
        dp.ScenarioError,
        match=r"^plane.scene.model_directives: expected none with engine bare",
    ):
        dp.run(with_models, engine="bare")
