# SPDX-License-Identifier: BSD-3-Clause
import copy
import math
import pickle

import numpy as np
import pytest
import yaml

from dual_proxy import RobotSide
from dual_proxy import scenario as scenario_module
from dual_proxy.scenario import (
    SCHEMES,
    Scenario,
    ScenarioError,
    list_scenarios,
    load_scenario,
)
from dual_proxy.settings import parse_yaml

MINIMAL = """
tiny:
  operator:
    waypoints:
      - {time: 0, position: [0.45, 0, 0.18]}
      - {time: 1, position: [0.45, 0, 0.15]}
"""
_QUOTED = ", ".join(f'"{scheme}"' for scheme in SCHEMES)
BALL = {"name": "a", "shape": "sphere", "position": [0, 0, 0], "radius": 1}


def load_text(tmp_path, text):
    path = tmp_path / "x.yaml"
    path.write_text(text)
    return load_scenario(path)


def leaves(mapping, prefix=""):
    for key, value in mapping.items():
        if isinstance(value, dict):
            yield from leaves(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


@pytest.fixture
def plane():
    return load_scenario("plane")


def test_defaults(tmp_path):
    dut = load_text(tmp_path, MINIMAL)
    assert dut.name == "tiny"
    assert (dut.robot, dut.scheme, dut.law) == ("panda", "dual_proxy", "default")
    assert dut.seed == 0
    assert dut.link.rate == 50.0
    assert dut.link.delay == 0.0
    assert dut.map.scale == 2.5
    assert dut.filter.num_particles == 1000
    assert dut.scene.table_height == 0.10


def test_plane_is_packaged_and_presses_with_six_to_seven_newtons(plane):
    assert "plane" in list_scenarios()
    assert plane.run_duration() == 20.0
    motion = plane.operator_motion()
    assert not motion.sampled
    depth = plane.scene.contact_height - motion.positions[:, 2].min()
    hand, proxy = plane.device.hand_stiffness, plane.map.scale * 500.0
    force = hand * proxy / (hand + proxy) * depth / plane.map.scale
    assert 6.0 < force < 7.0
    pressing = motion.positions[:, 2] < plane.scene.contact_height
    figure = motion.positions[pressing][:, :2]
    assert np.ptp(figure[:, 0]) == pytest.approx(0.10)
    assert np.ptp(figure[:, 1]) > 0.0
    np.testing.assert_array_equal(figure[0], figure[-1])
    # A minimum-jerk move is at most 1.875 times as fast as its mean.
    slide = np.linalg.norm(np.diff(figure, axis=0), axis=1)
    duration = np.diff(motion.times[pressing])
    assert np.max(1.875 * slide / duration) < 0.0525


def test_flat_tool_turns_its_tool_as_its_waypoints_say(plane):
    assert plane.operator_motion().rotations.shape == (0, 3)
    assert not plane.has_angular_filter
    scenario = load_scenario("flat_tool")
    assert scenario.has_angular_filter
    assert scenario.scene.contact_height == scenario.scene.table_height
    motion = scenario.operator_motion()
    assert motion.rotations.shape == motion.positions.shape
    np.testing.assert_array_equal(motion.rotations[0], 0.0)
    np.testing.assert_array_equal(motion.rotations[-1], [0.05, 0.0, 0.6])
    # The spring's moment at that tilt, between the angular filter's threshold and
    # what tips the tool.
    moment = scenario.robot_proxy.rotational_stiffness * 0.05
    assert scenario.angular_filter.pressure_centre.contact_moment < moment
    assert moment < 6.5 * scenario.scene.tool_size / 2.0


def test_one_of_everything_round_trips(plane, tmp_path):
    # Every number is changed a little, every switch thrown.
    values = {}
    for key, value in leaves(plane.to_mapping()):
        if isinstance(value, bool):
            values[key] = not value
        elif isinstance(value, int | float) and key not in ("link.loss",):
            values[key] = type(value)(value * (2 if isinstance(value, int) else 1.01))
    values |= {
        "link.loss": 0.1,
        "description": "a: #b 'c'\u00e9",
        "robot_proxy.workspace.shape": "cylinder",
        "robot_proxy.handover": "printed",
        "scene.contact_approximation": "sap",
        "scene.surfaces": [
            {"name": "ball", "shape": "sphere", "position": [1, 2, 3], "radius": 1}
        ],
        "scene.model_directives": "/models.dmd.yaml",
        "map.R_DB": [[0, 1, 0], [-1, 0, 0], [0, 0, 1]],
    }
    dut = plane.with_overrides(values)
    for key, value in values.items():
        if key not in ("scene.surfaces",):
            assert leaf(dut, key) == value, key
    again = load_text(tmp_path, dut.to_yaml())
    assert again == dut
    assert again.to_yaml() == dut.to_yaml()
    (ball,) = again.scene.surfaces
    assert ball.radius == 1.0
    assert ball.size is None


def leaf(dut, key):
    return dict(leaves(dut.to_mapping()))[key]


def test_loading_and_overriding_leave_the_original_alone(plane):
    before = plane.to_yaml()
    plane.with_overrides({"link.delay": 0.3, "law": "printed"})
    assert plane.to_yaml() == before
    for twin in (
        copy.deepcopy(plane),
        copy.copy(plane),
        pickle.loads(pickle.dumps(plane)),
    ):
        assert type(twin) is Scenario
        assert twin == plane
        twin.controller.force_gain = 2.5
        assert plane.controller.force_gain == 1.0


def test_shared_values_are_written_once(plane):
    dut = plane.with_overrides(
        {
            "control_period": 5e-4,
            "scene.start_position": [0.5, 0.01, 0.48],
            "map.scale": 2.0,
            "link.timeout": 0.25,
            "robot_proxy.stiffness": 400,
            "controller.passivity": False,
            "scene.tool_mass": 0.3,
        }
    )
    np.testing.assert_array_equal(dut.map.p_cw, [0.5, 0.01, 0.48])
    for side in (dut.robot_proxy, dut.haptic_proxy):
        assert side.map == dut.map
        assert side.link.timeout == 0.25
    for params in (
        dut.robot_proxy,
        dut.robot_proxy.limiter,
        dut.haptic_proxy,
        dut.controller,
        dut.controller.force_passivity,
        dut.haptic_controller,
        dut.device,
        dut.sensor,
        dut.link.sender,
    ):
        assert params.period == 5e-4
    assert dut.filter.period == 0.01
    assert dut.haptic_proxy.robot_stiffness == 400.0
    assert dut.controller.force_passivity.enabled is False
    assert dut.sensor.tool_mass == 0.3


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [
        ("link.dely", 1, "plane.link: unknown key 'dely', did you mean 'delay'?"),
        ("lnk", {}, "plane: unknown key 'lnk', did you mean 'link'?"),
        ("link.delay.x", 1, "plane.link.delay: has no parts"),
        ("link.delay", "fast", "plane.link.delay: expected a number, got 'fast'"),
        ("link.delay", True, "plane.link.delay: expected a number, got True"),
        ("link.delay", None, "plane.link.delay: expected a number, got None"),
        ("link.delay", math.nan, "plane.link.delay: expected a finite number"),
        ("link.delay", -0.1, r"plane.link.delay: expected .*10], got -0.1"),
        ("link.delay", 10.5, r"plane.link.delay: expected .*\[0, 10\], got 10.5"),
        ("link.loss", 1.5, "plane.link.loss: expected"),
        ("link.rate", 1e6, "plane.link.rate: expected"),
        ("link.timeout", 0.01, "plane.link.timeout: expected at least two messages"),
        ("link.max_age", 0.01, "plane.link.max_age: expected more than the delay"),
        ("link", [1], r"plane.link: expected a mapping, got \[1\]"),
        ("seed", 1.5, "plane.seed: expected an integer, got 1.5"),
        ("seed", -1, "plane.seed: expected a finite value >= 0"),
        ("seed", 2**63, "plane.seed: expected an integer of 64 bits"),
        ("duration", 0, "plane.duration: expected a number in"),
        (
            "scheme",
            "magic",
            f'plane.scheme: expected one of {_QUOTED}, got "magic"',
        ),
        (
            "law",
            "murphy",
            'plane.law: expected one of "default", "printed", got "murphy"',
        ),
        (
            "schemes.position_force.force_scale",
            -1,
            r"plane.schemes.position_force.force_scale: expected .*0, got -1",
        ),
        ("position_force.force_scale", 1, "plane: unknown key 'position_force'"),
        ("law", 3, "plane.law: expected a string, got 3"),
        ("robot", "ur5", 'plane.robot: expected one of "panda"'),
        ("map.R_cw", [[1, 0, 0]], "plane.map.R_cw: expected 3 x 3 numbers"),
        ("map.R_cw", [[1, 0, 0]] * 3, "plane.map.R_cw: expected a rotation matrix"),
        (
            "map.R_cw",
            [[1, 0, 0], [0, "a", 0], [0, 0, 1]],
            r"plane.map.R_cw\[1\]\[1\]: expected a number, got 'a'",
        ),
        ("controller.q_rest", [0] * 6, "plane.controller.q_rest: expected 7 numbers"),
        ("controller.feed_forward", 1, "feed_forward: expected true or false, got 1"),
        ("controller.max_mass", -3, "plane.controller.max_mass: expected .* got -3"),
        ("robot_proxy.handover", "x", 'plane.robot_proxy.handover: expected one of "'),
        ("robot_proxy.limiter.max_velocity", 0, "robot_proxy.limiter.max_velocity: "),
        ("filter.num_particles", 0, "plane.filter.num_particles: expected"),
        ("filter.period", 1e-5, "plane.filter.period: expected"),
        ("scene.friction", -1, r"plane.scene.friction: expected a number in \[0, 5\]"),
        ("scene.table_size", [1, 0], r"plane.scene.table_size\[1\]: expected a number"),
        (
            "scene.contact_approximation",
            "x",
            'plane.scene.contact_approximation: expected one of "lagged", "similar", '
            '"sap", got "x"',
        ),
        (
            "scene.surfaces",
            [{"name": "a", "position": [0, 0, 0]}],
            r"plane.scene.surfaces\[0\]: missing key 'shape'",
        ),
        (
            "scene.surfaces",
            [{"nam": "a"}],
            r"plane.scene.surfaces\[0\]: unknown key 'nam', ",
        ),
        (
            "scene.surfaces",
            [3],
            r"plane.scene.surfaces\[0\]: expected a mapping, got 3",
        ),
        ("scene.surfaces", 3, "plane.scene.surfaces: expected a list, got 3"),
        (
            "scene.surfaces",
            [{**BALL, "size": [1, 1, 1]}],
            r"plane.scene.surfaces\[0\].size: expected none, as a sphere has no use",
        ),
        (
            "scene.surfaces",
            [{**BALL, "shape": "cylinder"}],
            r"surfaces\[0\].length: expected a value, as a cylinder needs it, got none",
        ),
        (
            "scene.surfaces",
            [{**BALL, "friction": None}],
            r"plane.scene.surfaces\[0\].friction: expected a number, got None",
        ),
        (
            "scene.surfaces",
            [BALL, {**BALL, "name": "b", "radius": 0}],
            r"plane.scene.surfaces\[1\].radius: expected a number in \[0.0001, 10\]",
        ),
        (
            "scene.surfaces",
            [BALL, BALL],
            "plane.scene.surfaces: expected names used once",
        ),
        (
            "scene.start_position",
            [0.45, 0, 0.39],
            r"plane.scene.start_position: expected .* 0.01\d* m inside of \"table\"",
        ),
        ("map.p_cw", [0, 0, 0], "is taken from plane.scene.start_position"),
        ("robot_proxy.map.scale", 1, "robot_proxy.map.scale: is taken from plane.map"),
        ("haptic_proxy", {"period": 1}, "haptic_proxy.period: is taken from"),
        ("operator.waypoints", [], "plane.operator.waypoints: expected at least two"),
    ],
)
def test_wrong_values_are_named_in_one_line(plane, key, value, message):
    with pytest.raises(ScenarioError, match=message) as caught:
        plane.with_overrides({key: value})
    assert "\n" not in str(caught.value)


def test_wrong_values_set_in_python_are_found_by_validate(plane):
    plane.operator.press_depth = math.nan
    with pytest.raises(ScenarioError, match=r"plane.operator.press_depth: expected"):
        plane.validate()
    with pytest.raises(AttributeError):
        plane.dleay = 1
    with pytest.raises(TypeError, match="`recording` expected a string, got b'x'"):
        plane.operator.recording = b"x"
    with pytest.raises(TypeError, match="`surfaces` expected a list, got 3"):
        plane.scene.surfaces = 3
    with pytest.raises(TypeError, match="`waypoints` expected Waypoint, got 3"):
        plane.operator.waypoints = [3]


def test_lists_are_changed_by_assigning_the_whole(plane):
    first, *rest = plane.operator.waypoints
    with pytest.raises(AttributeError, match="Waypoint: field `position` cannot be"):
        first.position = [0.45, 0.01, 0.48]
    first = copy.copy(first)
    first.position = [0.45, 0.01, 0.48]
    assert plane.operator.waypoints[0].position[1] == 0.0
    plane.operator.waypoints = [first, *rest]
    assert plane.operator.waypoints[0].position[1] == 0.01
    with pytest.raises(AttributeError):
        plane.operator.waypoints.append(first)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([(1.0, [0.45, 0, 0.48]), (2.0, [0.45, 0, 0.48])], r"\[0\].time: expected 0"),
        ([(0.0, [0.45, 0, 0.48]), (0.0, [0.45, 0, 0.4])], r"\[1\].time: expected more"),
        ([(0.0, [0.45, 0, 0.48]), (1.0, [0.9, 0, 0.4])], r"\[1\].position: expected a"),
    ],
)
def test_waypoints_are_checked(plane, points, message):
    waypoints = [{"time": t, "position": p} for t, p in points]
    with pytest.raises(ScenarioError, match=f"plane.operator.waypoints{message}"):
        plane.with_overrides({"operator.waypoints": waypoints})


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: 2\n", "expected one top-level key"),
        ("- 1\n", "expected one top-level key"),
        ("", "expected one top-level key"),
        ("a: [1, 2\n", r"x.yaml, line 2"),
        ("a:\n  seed: 1\n  seed: 2\n", "line 3: key 'seed' appears twice"),
        ("a:\n  1: 2\n", "key 1 is not a string"),
        ("a: 3\n", "a: expected a mapping, got 3"),
        ("a:\n  overrides: 3\n", "a.overrides: expected a mapping"),
        ("a:\n  overrides: {law: printed}\n", "a.overrides.law: set a.law instead"),
        ("a:\n  overrides: {link: {dely: 1}}\n", "a.link: unknown key 'dely', did"),
        ("a:\n  overrides: {device: {period: 1}}\n", "a.device.period: is taken from"),
        ("a:\n  overrides: {link.delay: 1}\n", "a: unknown key 'link.delay'"),
        ("a: !!python/object:os.system {}\n", "x.yaml, line 1"),
    ],
)
def test_wrong_files_are_refused_in_one_line(tmp_path, text, message):
    with pytest.raises(ScenarioError, match=message) as caught:
        load_text(tmp_path, text)
    assert "\n" not in str(caught.value)


def test_unknown_scenarios_are_answered_with_the_known_ones(tmp_path):
    with pytest.raises(ScenarioError, match=r"unknown scenario 'plan', avail.*: .*pl"):
        load_scenario("plan")
    with pytest.raises(ScenarioError, match=r"none\.yaml: No such file"):
        load_scenario(tmp_path / "none.yaml")


def test_printed_law_turns_every_improvement_off(plane):
    assert plane.filter.likelihood == "friction_cone"
    assert plane.filter.period == 0.01
    dut = plane.with_overrides({"law": "printed"})
    assert dut.filter.likelihood == "paper"
    assert dut.filter.period == 1 / 15
    assert dut.robot_proxy.handover == "printed"
    assert dut.robot_proxy.max_motion_error == 0.0
    assert dut.controller.unit_mass_motion_force is False
    assert dut.controller.feed_forward is False
    assert dut.controller.selection_blend_time == 0.0
    assert dut.controller.force_filter_cutoff == 0.0
    assert dut.controller.force_integral_delay == 0.0
    assert dut.controller.passivity is False
    assert dut.controller.position_stiffness == 500.0


def test_baseline_has_its_own_gains_and_gives_them_back(plane):
    plane = plane.with_overrides({"controller.position_damping": 30})
    dut = plane.with_overrides({"scheme": "position_force"})
    assert dut.controller.position_stiffness == 100.0
    assert dut.controller.position_damping == 20.0
    assert dut.robot_proxy.max_motion_error == 0.0
    assert dut.with_overrides({"scheme": "dual_proxy"}) == plane
    twin = pickle.loads(pickle.dumps(dut))
    assert twin.with_overrides({"scheme": "dual_proxy"}) == plane


def test_one_file_has_the_parameters_of_all_schemes(plane):
    dut = plane.with_overrides(
        {
            "schemes.position_force.force_scale": 0.5,
            "schemes.position_position.haptic_stiffness": 300,
        }
    )
    assert dut.schemes.position_force.force_scale == 0.5
    for scheme in SCHEMES:
        other = dut.with_overrides({"scheme": scheme})
        assert other.schemes == dut.schemes
        for params in (other.robot_side_params(), other.haptic_side_params()):
            assert params.scheme == scheme
            assert params.schemes == dut.schemes
        finds = "dimension" in RobotSide(other.robot_side_params()).layout
        assert other.uses_selections == finds


def test_overrides_of_one_section_add_up(plane):
    dut = plane.with_overrides({"law": "printed", "controller.passivity": True})
    dut = dut.with_overrides({"controller": {"feed_forward": True}, "link.delay": 0.1})
    dut = dut.with_overrides({"link": {"jitter": 0.01}})
    assert (dut.controller.passivity, dut.controller.feed_forward) == (True, True)
    assert (dut.link.delay, dut.link.channel.jitter) == (0.1, 0.01)


def test_overrides_win_over_presets_in_any_order_and_in_files(plane, tmp_path):
    dut = plane.with_overrides({"controller.feed_forward": True, "law": "printed"})
    assert dut.controller.feed_forward is True
    assert dut.controller.passivity is False
    again = load_text(tmp_path, dut.to_yaml())
    assert again == dut
    assert yaml.safe_load(dut.to_yaml())["plane"]["overrides"] == {
        "controller": {"feed_forward": True}
    }
    assert again.with_overrides({"link.delay": 1}).controller.feed_forward is True


@pytest.mark.parametrize(
    ("overrides", "expected"),
    [
        ({"link.delay": 0.15}, 20.45),
        ({"link.delay": 1.5}, 24.5),
        ({"link.delay": 1.5, "duration": 5.0}, 5.0),
        ({"duration": 30.0}, 30.0),
        ({"extend_for_delay": False, "link.delay": 1.5}, 20.0),
    ],
)
def test_run_is_long_enough_for_a_late_release(plane, overrides, expected):
    assert plane.with_overrides(overrides).run_duration() == pytest.approx(expected)


def test_installed_scenarios_are_preferred(tmp_path, monkeypatch):
    module = tmp_path / "a" / "b" / "scenario.py"
    (module.parent / "scenarios").mkdir(parents=True)
    (module.parent / "scenarios" / "tiny.yaml").write_text(MINIMAL)
    monkeypatch.setattr(scenario_module, "__file__", str(module))
    assert list_scenarios() == ["tiny"]
    assert load_scenario("tiny").name == "tiny"


def test_numbers_in_yaml():
    assert parse_yaml("1e-3", "x") == 0.001
    assert parse_yaml("-2E3", "x") == -2000.0
    assert parse_yaml("1e", "x") == "1e"
    assert parse_yaml("0.5", "x") == 0.5


def test_scenario_from_mapping_without_a_file():
    mapping = yaml.safe_load(MINIMAL)["tiny"]
    assert Scenario.from_mapping("x", mapping).name == "x"
