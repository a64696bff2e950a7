# SPDX-License-Identifier: BSD-3-Clause
"""Habits of Python that every Params class keeps."""

import copy
import dataclasses
import pickle
import typing
from fractions import Fraction

import numpy as np
import pytest
from pydrake.common.yaml import yaml_dump_typed, yaml_load_typed

import dual_proxy as dp
from dual_proxy import _core

PARAMS = [item for item in vars(_core).values() if hasattr(item, "__fields__")]
ALGORITHMS = [
    item
    for item in vars(_core).values()
    if isinstance(item, type) and hasattr(item, "params")
]
FULL = {
    _core.ArmModelParams: lambda: dp.ArmModelParams(mass=np.ones(7)),
    _core.OperatorPathParams: lambda: dp.OperatorPathParams(
        times=[0, 1],
        points=np.ones((3, 2)),
        clutch=[[1, 2]],
        home=[[3, 4]],
        force_scale=[[0, 0.5]],
        gripper=[[0, 0.02]],
    ),
    _core.ContactSceneParams: lambda: dp.ContactSceneParams(
        surfaces=[dp.ContactSurfaceParams(radius=0.2)]
    ),
    _core.SceneParams: lambda: dp.SceneParams(
        surfaces=[
            dp.SurfaceParams(name="a", shape="box", size=[1, 2, 3]),
            dp.SurfaceParams(name="b", stiffness=300.0),
        ]
    ),
    _core.CommunicationChannelParams: lambda: dp.CommunicationChannelParams(
        outages=[[1, 2], [4, 5.5]]
    ),
    _core.LinkParams: lambda: dp.LinkParams(
        channel=dp.CommunicationChannelParams(outages=[[1, 2], [4, 5.5]])
    ),
    _core.LocalPlannerParams: lambda: dp.LocalPlannerParams(
        active=[[1, 2], [4, 5.5]], directions=[[0, 0, 1], [0, 1, 0]]
    ),
    _core.OperatorParams: lambda: dp.OperatorParams(
        waypoints=[dp.Waypoint(), dp.Waypoint(time=2.0)],
        clutch=[[1, 2]],
        home=[[3, 4]],
        force_scale=[[0, 0.5]],
        gripper=[[0, 0.02]],
    ),
}


def full(params):
    """One with something in every list and array."""
    return FULL.get(params, params)()


def name_of(item):
    return item.__name__


def fields(params):
    return {field.name: field.type for field in params.__fields__}


# Numbers.


@pytest.mark.parametrize(
    "number",
    [
        0.25,
        np.float64(0.25),
        np.float32(0.25),
        np.float16(0.25),
        np.longdouble(0.25),
        np.array(0.25),
        Fraction(1, 4),
    ],
    ids=repr,
)
def test_a_number_of_any_kind_is_a_number(number):
    params = dp.CommunicationChannelParams(delay=number)
    assert type(params.delay) is float
    assert params.delay == 0.25
    plane = dp.load_scenario("plane").with_overrides({"link.delay": number})
    assert plane.link.delay == 0.25
    assert "delay: 0.25" in plane.to_yaml()


@pytest.mark.parametrize("kind", [int, np.int64, np.int8, np.uint16, np.array])
def test_an_integer_of_any_kind_is_an_integer(kind):
    params = dp.PointRobotParams(substeps=kind(3), mass=kind(2))
    assert type(params.substeps) is int
    assert (params.substeps, params.mass) == (3, 2.0)
    plane = dp.load_scenario("plane").with_overrides({"seed": kind(3)})
    assert "seed: 3\n" in plane.to_yaml()


def test_bools_and_strings_of_numpy_are_those_of_python():
    plane = dp.load_scenario("plane").with_overrides(
        {
            "extend_for_delay": np.bool_(False),
            "link.reordering": np.array(False),
            "scheme": np.str_("position_force"),
            "sensor.force_bias": np.array([0.5, 0.0, -1.0], dtype=np.float32),
        }
    )
    assert plane.extend_for_delay is False
    assert plane.link.channel.reordering is False
    assert plane.sensor.force_bias.tolist() == [0.5, 0.0, -1.0]
    assert dp.load_scenario("plane").scheme == "dual_proxy"
    loaded = dp.Scenario.from_mapping("plane", plane.to_mapping())
    assert loaded.to_yaml() == plane.to_yaml()
    assert "!!python" not in plane.to_yaml()


@pytest.mark.parametrize(
    ("field", "expected", "values"),
    [
        ("mass", "a number", [True, np.True_, "1", b"1", None, 1j, np.array([1.0])]),
        ("mass", "a number", [np.complex64(1), np.timedelta64(1, "s")]),
        ("substeps", "an integer", [True, np.True_, "1", 1.0, np.float32(1.5)]),
        ("substeps", "an integer", [np.timedelta64(1, "s"), np.array([1])]),
    ],
)
def test_what_is_no_number_is_refused(field, expected, values):
    for value in values:
        with pytest.raises(TypeError, match=f"field `{field}` expected {expected}"):
            dp.PointRobotParams(**{field: value})


def test_an_integer_of_too_many_bits_is_out_of_range():
    with pytest.raises(ValueError, match=r"`substeps` expected .* 2147483647\], got 1"):
        dp.PointRobotParams(substeps=2**40)


def test_what_is_no_number_is_refused_in_overrides():
    plane = dp.load_scenario("plane")
    for key, value, expected in (
        ("link.delay", np.True_, "a number"),
        ("link.delay", np.timedelta64(1, "s"), "a number"),
        ("link.delay", np.float32("nan"), "a finite number"),
        ("seed", np.float64(3.0), "an integer"),
        ("seed", np.True_, "an integer"),
        ("extend_for_delay", np.int64(1), "true or false"),
    ):
        with pytest.raises(dp.ScenarioError, match=f"{key}: expected {expected}"):
            plane.with_overrides({key: value})


@pytest.mark.parametrize(
    "value",
    [[True, False, True], ["1", "2", "3"], [1j, 0, 0], np.ones(3, dtype="m8[s]")],
    ids=repr,
)
def test_what_are_no_numbers_is_no_array(value):
    with pytest.raises(ValueError, match="force_bias: expected numbers"):
        dp.ForceTorqueSensorParams(force_bias=value)


# Copies.


@pytest.mark.parametrize("params", PARAMS, ids=name_of)
def test_an_element_cannot_be_changed_without_a_word(params):
    dut = full(params)
    for name, kind in fields(params).items():
        value = getattr(dut, name)
        if kind is np.ndarray:
            with pytest.raises(ValueError, match="read-only"):
                value[...] = 1.0
        elif typing.get_origin(kind) is list:
            assert value
            with pytest.raises(TypeError):
                value[0] = copy.copy(value[0])
            if isinstance(value[0], np.ndarray):
                with pytest.raises(ValueError, match="read-only"):
                    value[0][...] = 1.0
                continue
            for field in type(value[0]).fields:
                with pytest.raises(AttributeError, match=f"`{field}` cannot be set"):
                    setattr(value[0], field, getattr(value[0], field))


def make(algorithm):
    links = dp.ArmModelParams(mass=np.ones(7), inertia=7 * [np.eye(3)])
    if algorithm is _core.ArmModel:
        return algorithm(links)
    if algorithm is _core.SimulatedArm:
        return algorithm(dp.SimulatedArmParams(), links)
    if algorithm is _core.WorkspaceMap:
        return algorithm(dp.WorkspaceMapParams())
    if algorithm is _core.OperatorPath:
        return algorithm([0, 1], np.zeros((3, 2)))
    if algorithm is _core.LinkEnd:
        return algorithm("to_robot")
    return algorithm()


@pytest.mark.parametrize("algorithm", ALGORITHMS, ids=name_of)
def test_params_of_an_algorithm_cannot_be_changed_without_a_word(algorithm):
    def check(params):
        for name in type(params).fields:
            value = getattr(params, name)
            with pytest.raises(AttributeError, match=f"`{name}` cannot be set"):
                setattr(params, name, value)
            if hasattr(type(value), "fields"):
                check(value)

    check(make(algorithm).params)


def test_a_copy_of_an_element_can_be_changed_and_assigned():
    scenario = dp.load_scenario("plane")
    waypoints = copy.deepcopy(scenario.operator.waypoints)
    waypoints[0].position = [0.4, 0.0, 0.2]
    twin = pickle.loads(pickle.dumps(scenario.operator.waypoints[1]))
    twin.rotation = [0.1, 0.0, 0.0]
    scenario.operator.waypoints = [waypoints[0], twin, *waypoints[2:]]
    assert scenario.operator.waypoints[0].position[0] == 0.4
    assert scenario.operator.waypoints[1].rotation[0] == 0.1
    proxy = dp.RobotSideProxy()
    params = copy.copy(proxy.params)
    params.map.scale = 2.0
    assert dp.RobotSideProxy(params).params.map.scale == 2.0


def test_what_took_the_place_of_a_read_only_copy_can_be_changed():
    for _ in range(100):
        assert dp.LinkMonitor().params.timeout == 0.5
        params = dp.LinkMonitorParams()
        params.timeout = 0.4
        copy.copy(params).timeout = 0.3


# Pickling.


@pytest.mark.parametrize("params", PARAMS, ids=name_of)
def test_params_are_the_same_after_pickling(params):
    dut = full(params)
    assert pickle.loads(pickle.dumps(dut)) == dut
    assert copy.deepcopy(dut) == dut


# Drake's typed YAML.


@pytest.mark.parametrize("params", PARAMS, ids=name_of)
def test_drake_dumps_and_loads_every_class(params):
    dut = full(params)
    assert yaml_load_typed(schema=params, data=yaml_dump_typed(dut)) == dut


@pytest.mark.parametrize("params", PARAMS, ids=name_of)
def test_the_schema_has_every_field(params):
    kinds = fields(params)
    for name in params.fields:
        value = getattr(full(params), name)
        if name not in kinds:  # Its fields stand there in its place.
            assert set(fields(type(value))) < set(kinds)
        elif isinstance(value, tuple):
            assert kinds[name] == list[type(value[0])]
        else:
            kind = kinds[name]
            assert type(value) in (typing.get_args(kind) or (kind,))


@pytest.mark.parametrize("params", PARAMS, ids=name_of)
def test_every_field_says_what_it_means(params):
    for field in params.__fields__:
        assert field.meaning
        assert field.meaning in getattr(params, field.name).__doc__


def test_a_field_says_unit_range_and_default():
    def told(params, name):
        (field,) = (field for field in params.__fields__ if field.name == name)
        texts = (field.unit, field.range, field.default)
        return *texts, getattr(params, name).__doc__

    proxy, link = dp.RobotSideProxyParams, dp.LinkParams
    doc = "N/m, >= 0: k_vir_r, default 500"
    assert told(proxy, "stiffness") == ("N/m", ">= 0", "500", doc)
    names = 'one of "printed", "bumpless"'
    assert told(proxy, "handover")[1:3] == (names, '"bumpless"')
    assert told(proxy, "map")[:3] == ("", "WorkspaceMapParams", "")
    assert told(link, "rate")[:3] == ("Hz", "in (0, 1/period]", "50")
    assert link.sender.__doc__.startswith("PoseSenderParams: ")
    rotation = told(dp.WorkspaceMapParams, "R_DB")
    assert rotation[:3] == ("", "a rotation matrix", "identity")
    assert rotation[3].startswith("(3, 3), a rotation matrix: ")
    color = told(dp.SurfaceParams, "color")
    assert color[1:3] == ("in [0, 1]", "[0.8, 0.7, 0.56, 1]")
    assert told(dp.SceneParams, "surfaces")[1] == "list of SurfaceParams"
    size = told(dp.SurfaceParams, "size")
    assert size[:3] == ("m", "in [0.0001, 10]", "")
    assert size[3].startswith("(3,), m, in [0.0001, 10]: ")


@dataclasses.dataclass
class Mine:
    filter: dp.ForceSpaceParticleFilterParams = dataclasses.field(
        default_factory=lambda: dp.ForceSpaceParticleFilterParams(period=0.01)
    )
    link: dp.LinkParams = dataclasses.field(default_factory=dp.LinkParams)
    scene: dp.SceneParams | None = None
    hands: dict[str, dp.SimulatedHapticDeviceParams] = dataclasses.field(
        default_factory=dict
    )
    path: list[dp.Waypoint] = dataclasses.field(default_factory=list)
    law: dp.HapticControllerParams | dp.VirtualSpringParams = dataclasses.field(
        default_factory=dp.HapticControllerParams
    )


def test_a_dataclass_of_ones_own_with_params_in_it():
    dut = yaml_load_typed(
        schema=Mine,
        data="""
          filter: {num_particles: 300, update_thresholds: {force_low: 1e-3}}
          link: {delay: 0.1, timeout: 1}
          scene:
            tool: flat
            surfaces: [{name: a, shape: box, size: [0.1, 0.2, 0.3], friction: 0.4}]
          hands: {left: {hand_mass: 1}}
          path: [{time: 1, position: [0.4, 0.0, 0.2]}]
          law: !VirtualSpringParams {}
        """,
    )
    assert dut.filter.num_particles == 300
    assert dut.filter.period == 0.01
    assert dut.filter.update_thresholds.force_low == 1e-3
    assert dut.link.channel.delay == 0.1
    assert dut.link.monitor.timeout == 1.0
    assert dut.scene.tool == "flat"
    (surface,) = dut.scene.surfaces
    assert surface.size[2] == 0.3
    assert surface.friction == 0.4
    assert surface.stiffness is None
    assert dut.hands["left"].hand_mass == 1.0
    assert dut.path[0].position[2] == 0.2
    assert isinstance(dut.law, dp.VirtualSpringParams)
    assert yaml_load_typed(schema=Mine, data=yaml_dump_typed(dut)) == dut


def test_what_is_not_written_keeps_the_given_default():
    defaults = dp.LinkParams(channel=dp.CommunicationChannelParams(delay=0.2))
    dut = yaml_load_typed(defaults=defaults, data="{rate: 100}")
    assert (dut.delay, dut.rate) == (0.2, 100.0)
    assert defaults.rate == 50.0
    assert yaml_dump_typed(dut, defaults=defaults) == "rate: 100.0\n"


def test_errors_of_the_schema_are_drakes_and_of_the_values_are_ours():
    kind = dp.SceneParams
    with pytest.raises(RuntimeError, match=r"'fricton'.* unknown to the schema"):
        yaml_load_typed(schema=kind, data="{fricton: 1}")
    with pytest.raises(ValueError, match="field `tool` expected one of"):
        yaml_load_typed(schema=kind, data="{tool: cube}")
    with pytest.raises(ValueError, match=r"start_position: expected shape \(3,\)"):
        yaml_load_typed(schema=kind, data="{start_position: [1, 2]}")
