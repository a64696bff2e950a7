# SPDX-License-Identifier: BSD-3-Clause
"""The Panda's model and scene against a real arm, its physics and its truth."""

from __future__ import annotations

import os
import xml.etree.ElementTree as ElementTree
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from pydrake.geometry import Role
from pydrake.multibody.tree import (
    BodyIndex,
    JacobianWrtVariable,
    JointActuatorIndex,
)
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder, LeafSystem

import dual_proxy
from dual_proxy.panda import (
    JOINT_LOWER,
    JOINT_UPPER,
    JOINT_VELOCITY_LIMIT,
    Q_REST,
    R_BE_DOWN,
    TORQUE_LIMIT,
    PandaModel,
    add_panda_scene,
    contact_truth,
    p_SE_S,
    rotation_truth,
    sensor_reaction,
)
from dual_proxy.scene_params import (
    CORNER_RADIUS,
    TIP_RADIUS,
    TOOL_COM_S,
    TOOL_MASS,
    SceneParams,
    SurfaceParams,
)
from dual_proxy.systems import SensorReaction

GRAVITY = 9.81
APPROXIMATIONS = ("lagged", "similar", "sap")
DATA = Path(
    os.environ.get(
        "DUAL_PROXY_RECORDINGS",
        Path(__file__).resolve().parents[2].parent / "shared" / "data",
    )
)
URDF = Path(dual_proxy.__path__[0]) / "robots" / "panda" / "panda.urdf"


def box(name: str, position, size) -> SurfaceParams:
    return SurfaceParams(name=name, shape="box", position=position, size=size)


@pytest.fixture(scope="module")
def model() -> PandaModel:
    return PandaModel()


# --- Kinematics against a real arm ------------------------------------------


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_forward_kinematics_matches_the_recorded_arm(model, number):
    path = DATA / f"panda_guided_0{number}.csv"
    if not path.is_file():
        pytest.skip(f"recording {path} is absent")
    data = pd.read_csv(path)
    q = data[[f"q{i}" for i in range(1, 8)]].to_numpy()
    v = data[[f"dq{i}" for i in range(1, 8)]].to_numpy()
    p = data[["px", "py", "pz"]].to_numpy()
    R = data[[f"R{i}{j}" for i in "123" for j in "123"]].to_numpy().reshape(-1, 3, 3)
    twist = data[["vx", "vy", "vz", "wx", "wy", "wz"]].to_numpy()
    assert len(q) > 1000
    position_error = np.empty(len(q))
    cosine = np.empty(len(q))
    model_twist = np.empty((len(q), 6))
    for k in range(len(q)):
        terms = model.calc(q[k], v[k])
        position_error[k] = np.linalg.norm(terms.p_BE - p[k])
        cosine[k] = (np.trace(terms.R_BE.T @ R[k]) - 1.0) / 2.0
        model_twist[k] = terms.J_BE @ v[k]
    assert position_error.max() < 2e-3
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 0.5
    # The recorded twist is noisy: its mean over the run is not.
    for columns in (slice(0, 3), slice(3, 6)):
        error = model_twist[:, columns] - twist[:, columns]
        assert np.abs(error).mean() < 0.2 * np.abs(twist[:, columns]).mean()


# --- Model terms against an independent model -------------------------------

# Craig's parameters (a_{i-1}, d_i, alpha_{i-1}) of joints 1 to 7, m and rad.
CRAIG = (
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -np.pi / 2),
    (0.0, 0.316, np.pi / 2),
    (0.0825, 0.0, np.pi / 2),
    (-0.0825, 0.384, -np.pi / 2),
    (0.0, 0.0, np.pi / 2),
    (0.088, 0.0, np.pi / 2),
)


def link_transforms(q):
    """Homogeneous transforms of links 1 to 7 and of the tool's frame S."""
    X = np.eye(4)
    result = []
    for (a, d, alpha), theta in zip(CRAIG, q, strict=True):
        ca, sa, ct, st = np.cos(alpha), np.sin(alpha), np.cos(theta), np.sin(theta)
        X = X @ np.array(
            [
                [ct, -st, 0, a],
                [st * ca, ct * ca, -sa, -d * sa],
                [st * sa, ct * sa, ca, d * ca],
                [0, 0, 0, 1],
            ]
        )
        result.append(X)
    X_7S = np.eye(4)
    X_7S[2, 3] = 0.107
    return [*result, X @ X_7S]


def inertials():
    """(mass, centre of mass, inertia about it) of links 1 to 7 and the tool."""
    root = ElementTree.parse(URDF).getroot()
    result = []
    for number in range(1, 8):
        inertial = root.find(f"link[@name='panda_link{number}']/inertial")
        xyz = np.array([float(x) for x in inertial.find("origin").get("xyz").split()])
        i = {k: float(x) for k, x in inertial.find("inertia").attrib.items()}
        result.append(
            (
                float(inertial.find("mass").get("value")),
                xyz,
                np.array(
                    [
                        [i["ixx"], i["ixy"], i["ixz"]],
                        [i["ixy"], i["iyy"], i["iyz"]],
                        [i["ixz"], i["iyz"], i["izz"]],
                    ]
                ),
            )
        )
    tool = (TOOL_MASS, np.array(TOOL_COM_S), np.diag([0.00019, 0.00019, 0.00008]))
    return [*result, tool]


INERTIALS = inertials()
STEP = 1e-5


def potential_energy(q):
    return sum(
        m * GRAVITY * (X[:3, :3] @ com + X[:3, 3])[2]
        for X, (m, com, _) in zip(link_transforms(q), INERTIALS, strict=True)
    )


def kinetic_energy(q, v):
    before, now, after = (link_transforms(q + s * STEP * v) for s in (-1, 0, 1))
    energy = 0.0
    for X0, X, X1, (m, com, inertia) in zip(before, now, after, INERTIALS, strict=True):
        velocity = ((X1 - X0) @ np.append(com, 1.0))[:3] / (2 * STEP)
        omega = angular_velocity(X0[:3, :3], X[:3, :3], X1[:3, :3])
        omega_link = X[:3, :3].T @ omega
        energy += 0.5 * m * velocity @ velocity
        energy += 0.5 * omega_link @ inertia @ omega_link
    return energy


def angular_velocity(R_before, R, R_after):
    S = (R_after - R_before) @ R.T / (2 * STEP)
    return 0.5 * np.array([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]])


def random_states(count):
    rng = np.random.default_rng(7)
    for _ in range(count):
        yield rng.uniform(JOINT_LOWER, JOINT_UPPER), rng.uniform(-1.5, 1.5, 7)


def test_pose_and_jacobian_match_finite_differences(model):
    for q, v in random_states(50):
        terms = model.calc(q, v)
        X_BS = link_transforms(q)[-1]
        np.testing.assert_allclose(
            terms.p_BE, X_BS[:3, :3] @ p_SE_S + X_BS[:3, 3], atol=1e-12
        )
        np.testing.assert_allclose(terms.R_BE, X_BS[:3, :3], atol=1e-12)
        after = model.calc(q + STEP * v, v)
        before = model.calc(q - STEP * v, v)
        twist = terms.J_BE @ v
        np.testing.assert_allclose(
            twist[:3], (after.p_BE - before.p_BE) / (2 * STEP), atol=1e-7
        )
        np.testing.assert_allclose(
            twist[3:], angular_velocity(before.R_BE, terms.R_BE, after.R_BE), atol=1e-7
        )
        np.testing.assert_allclose(
            terms.Jdot_v, (after.J_BE - before.J_BE) @ v / (2 * STEP), atol=1e-6
        )


def test_mass_and_gravity_match_the_energies(model):
    for q, v in random_states(50):
        terms = model.calc(q, v)
        assert np.array_equal(terms.mass, terms.mass.T)
        assert np.linalg.eigvalsh(terms.mass).min() > 1e-3
        np.testing.assert_allclose(
            0.5 * v @ terms.mass @ v, kinetic_energy(q, v), rtol=1e-6
        )
        power = (potential_energy(q + STEP * v) - potential_energy(q - STEP * v)) / (
            2 * STEP
        )
        np.testing.assert_allclose(terms.gravity @ v, -power, atol=1e-6)


def test_bias_is_lagranges_without_gravity(model):
    zero = np.zeros(7)
    for q, v in random_states(20):
        gradient = np.empty(7)
        for i, e in enumerate(np.eye(7)):
            difference = (
                model.calc(q + STEP * e, zero).mass
                - model.calc(q - STEP * e, zero).mass
            )
            gradient[i] = 0.5 * v @ difference @ v / (2 * STEP)
        mass_rate = (
            model.calc(q + STEP * v, zero).mass - model.calc(q - STEP * v, zero).mass
        ) / (2 * STEP)
        np.testing.assert_allclose(
            model.calc(q, v).bias, mass_rate @ v - gradient, atol=1e-6
        )
    assert np.array_equal(model.calc(Q_REST, zero).bias, zero)


@pytest.mark.parametrize("tool_mass", [TOOL_MASS, 2.3])
def test_terms_equal_the_simulators(tool_mass):
    params = SceneParams(tool_mass=tool_mass)
    plant = add_panda_scene(DiagramBuilder(), params).plant
    context = plant.CreateDefaultContext()
    model = PandaModel(tool_mass)
    world = plant.world_frame()
    tool_point = plant.GetFrameByName("tool_point")
    of_tool_point = (context, JacobianWrtVariable.kV, tool_point, np.zeros(3))
    linear_angular = [3, 4, 5, 0, 1, 2]
    rng = np.random.default_rng(11)
    for _ in range(200):
        q = rng.uniform(JOINT_LOWER, JOINT_UPPER)
        v = rng.uniform(-JOINT_VELOCITY_LIMIT, JOINT_VELOCITY_LIMIT)
        plant.SetPositionsAndVelocities(context, np.concatenate([q, v]))
        X_BE = tool_point.CalcPoseInWorld(context)
        jacobian = plant.CalcJacobianSpatialVelocity(*of_tool_point, world, world)
        acceleration = plant.CalcBiasSpatialAcceleration(*of_tool_point, world, world)
        expected = {
            "p_BE": X_BE.translation(),
            "R_BE": X_BE.rotation().matrix(),
            "J_BE": jacobian[linear_angular],
            "mass": plant.CalcMassMatrix(context),
            "bias": plant.CalcBiasTerm(context),
            "gravity": plant.CalcGravityGeneralizedForces(context),
            "Jdot_v": acceleration.get_coeffs()[linear_angular],
        }
        terms = model.calc(q, v)._asdict()
        assert terms.keys() == expected.keys()
        for name, value in expected.items():
            error = np.linalg.norm(terms[name] - value)
            assert error < 1e-10 * np.linalg.norm(value), name


def test_terms_are_not_overwritten_by_the_next_call(model):
    first = model.calc(Q_REST, np.ones(7))
    kept = [x.copy() for x in first]
    model.calc(Q_REST + 0.1, -np.ones(7))
    for x, y in zip(first, kept, strict=True):
        assert np.array_equal(x, y)


def test_tool_mass_and_gravity_reach_the_model():
    q, zero = Q_REST, np.zeros(7)
    light = PandaModel().calc(q, zero)
    heavy = PandaModel(tool_mass=TOOL_MASS + 1.0).calc(q, zero)
    # One more kilogram at the tool's centre of mass.
    p_EC = light.R_BE @ (np.array(TOOL_COM_S) - p_SE_S)
    J_linear = light.J_BE[:3] - np.cross(p_EC, np.eye(3)).T @ light.J_BE[3:]
    np.testing.assert_allclose(
        heavy.gravity - light.gravity, J_linear.T @ [0, 0, -GRAVITY], atol=1e-10
    )
    assert np.array_equal(PandaModel(gravity=0.0).calc(q, zero).gravity, zero)


@pytest.mark.parametrize("name", ["tool_mass", "gravity"])
@pytest.mark.parametrize("value", [-1.0, np.nan, 1e9])
def test_model_refuses_values_out_of_range(name, value):
    with pytest.raises(ValueError, match=name):
        PandaModel(**{name: value})


# --- Inverse kinematics -----------------------------------------------------


def test_rest_posture(model):
    X_BE = model.forward_kinematics(Q_REST)
    np.testing.assert_allclose(X_BE.translation(), [0.45, 0.0, 0.18], atol=1e-4)
    np.testing.assert_allclose(X_BE.rotation().matrix(), R_BE_DOWN, atol=1e-9)
    assert np.minimum(Q_REST - JOINT_LOWER, JOINT_UPPER - Q_REST).min() > 0.5


def test_inverse_kinematics_over_the_table(model):
    rng = np.random.default_rng(3)
    for _ in range(30):
        p = rng.uniform([0.35, -0.25, 0.11], [0.65, 0.25, 0.4])
        q = model.inverse_kinematics(p)
        X_BE = model.forward_kinematics(q)
        np.testing.assert_allclose(X_BE.translation(), p, atol=1e-4)
        np.testing.assert_allclose(X_BE.rotation().matrix(), R_BE_DOWN, atol=1e-4)
        assert (q >= JOINT_LOWER).all()
        assert (q <= JOINT_UPPER).all()


def test_inverse_kinematics_says_what_it_can_not_reach(model):
    with pytest.raises(ValueError, match=r"no posture reaches p_BE = \[2\.0"):
        model.inverse_kinematics([2.0, 0.0, 0.2])


# --- Scene ------------------------------------------------------------------


def test_limits_of_joints_and_actuators():
    plant = add_panda_scene(DiagramBuilder()).plant
    assert np.array_equal(plant.GetPositionLowerLimits(), JOINT_LOWER)
    assert np.array_equal(plant.GetPositionUpperLimits(), JOINT_UPPER)
    assert np.array_equal(plant.GetVelocityUpperLimits(), JOINT_VELOCITY_LIMIT)
    assert np.array_equal(plant.GetVelocityLowerLimits(), -JOINT_VELOCITY_LIMIT)
    limits = [
        plant.get_joint_actuator(JointActuatorIndex(i)).effort_limit()
        for i in range(plant.num_actuators())
    ]
    assert np.array_equal(limits, TORQUE_LIMIT)


def test_what_is_not_drawn_has_no_visuals():
    for drawn in (True, False):
        scene = add_panda_scene(DiagramBuilder(), drawn=drawn)
        inspector = scene.scene_graph.model_inspector()
        bodies = {
            scene.plant.GetBodyFromFrameId(inspector.GetFrameId(visual)).name()
            for visual in inspector.GetAllGeometryIds(Role.kIllustration)
        }
        everything = {f"panda_link{i}" for i in range(8)} | {"tool", "world"}
        assert bodies == (everything if drawn else set())
        # The frames of the bodies are there all the same.
        assert inspector.num_frames() == len(everything)


def test_the_physics_are_the_same_drawn_or_not():
    params = SceneParams(table_height=0.3)
    states = []
    for drawn in (True, False):
        builder = DiagramBuilder()
        scene = add_panda_scene(builder, params, Q_REST, drawn)
        simulator = Simulator(builder.Build())
        context = scene.plant.GetMyMutableContextFromRoot(
            simulator.get_mutable_context()
        )
        scene.actuation_port.FixValue(context, np.zeros(7))
        simulator.AdvanceTo(0.2)
        results = scene.contact_results_port.Eval(context)
        assert contact_truth(results, scene.tool_body).dimension == 1
        states.append(scene.state_port.Eval(context))
    assert np.array_equal(*states)


def test_only_the_tip_and_the_surfaces_can_touch():
    wall = box("wall", (0.6, 0.0, 0.2), (0.1, 0.1, 0.2))
    scene = add_panda_scene(DiagramBuilder(), SceneParams(surfaces=[wall]))
    inspector = scene.scene_graph.model_inspector()
    assert inspector.NumGeometriesWithRole(Role.kProximity) == 3
    (tip,) = scene.plant.GetCollisionGeometriesForBody(
        scene.plant.get_body(scene.tool_body)
    )
    assert inspector.GetShape(tip).radius() == TIP_RADIUS
    np.testing.assert_array_equal(inspector.GetPoseInFrame(tip).translation(), p_SE_S)


def test_a_flat_tool_touches_with_its_corners():
    params = SceneParams(tool="flat", tool_size=0.05)
    scene = add_panda_scene(DiagramBuilder(), params)
    inspector = scene.scene_graph.model_inspector()
    tool = scene.plant.get_body(scene.tool_body)
    corners = scene.plant.GetCollisionGeometriesForBody(tool)
    places = {
        tuple(np.round(inspector.GetPoseInFrame(corner).translation() - p_SE_S, 12))
        for corner in corners
    }
    # In E, whose origin is in the face.
    half = params.tool_size / 2.0
    assert places == {
        (x, y, -CORNER_RADIUS) for x in (-half, half) for y in (-half, half)
    }
    for corner in corners:
        assert inspector.GetShape(corner).radius() == CORNER_RADIUS
    # There is something to see of it.
    assert len(scene.plant.GetVisualGeometriesForBody(tool)) == 3 + 4 + 1


def test_scene_keeps_a_copy_of_its_params():
    params = SceneParams()
    scene = add_panda_scene(DiagramBuilder(), params)
    params.friction = 0.7
    assert scene.params.friction == 0.3


def test_scene_refuses_bad_arguments():
    with pytest.raises(ValueError, match=r"`q_start` expected shape \(7,\), got \(5,"):
        add_panda_scene(DiagramBuilder(), q_start=np.zeros(5))
    params = SceneParams()
    params.friction = -0.1
    with pytest.raises(ValueError, match="friction"):
        add_panda_scene(DiagramBuilder(), params)


class Spring(LeafSystem):
    """Holds the tool point near `target(time)`, pointing down, at 1 kHz."""

    def __init__(self, model: PandaModel, target) -> None:
        super().__init__()
        self._model = model
        self._target = target
        self._state = self.DeclareVectorInputPort("state", 14)
        self.DeclareStateOutputPort("torque", self.DeclareDiscreteState(7))
        self.DeclarePeriodicDiscreteUpdateEvent(1e-3, 0.0, self._update)

    def _update(self, context, discrete):
        q, v = np.split(self._state.Eval(context), 2)
        terms = self._model.calc(q, v)
        S = R_BE_DOWN @ terms.R_BE.T
        turn = 0.5 * np.array([S[2, 1] - S[1, 2], S[0, 2] - S[2, 0], S[1, 0] - S[0, 1]])
        twist = terms.J_BE @ v
        pull = np.empty(6)
        pull[:3] = 1000.0 * (self._target(context.get_time()) - terms.p_BE)
        pull[:3] -= 80.0 * twist[:3]
        pull[3:] = 50.0 * turn - 3.0 * twist[3:]
        torque = terms.J_BE.T @ pull - 0.5 * v + terms.bias - terms.gravity
        discrete.set_value(torque)


class Bench:
    """A simulated arm that a spring pulls along a target."""

    def __init__(self, target, params: SceneParams | None = None) -> None:
        builder = DiagramBuilder()
        params = params or SceneParams()
        self.model = PandaModel(params.tool_mass)
        q_start = self.model.inverse_kinematics(target(0.0))
        self.scene = add_panda_scene(builder, params, q_start)
        spring = builder.AddSystem(Spring(self.model, target))
        reaction = builder.AddSystem(SensorReaction(self.scene.sensor_joint))
        builder.Connect(self.scene.state_port, spring.GetInputPort("state"))
        builder.Connect(spring.GetOutputPort("torque"), self.scene.actuation_port)
        builder.Connect(
            self.scene.reaction_forces_port, reaction.GetInputPort("reaction_forces")
        )
        self.simulator = Simulator(builder.Build())
        root = self.simulator.get_context()
        self.plant_context = self.scene.plant.GetMyContextFromRoot(root)
        self.reaction_context = reaction.GetMyContextFromRoot(root)
        self.reaction_port = reaction.GetOutputPort("reaction")

    def advance(self, time):
        self.simulator.AdvanceTo(time)

    @property
    def terms(self):
        q, v = np.split(self.scene.state_port.Eval(self.plant_context), 2)
        return self.model.calc(q, v)

    @property
    def velocity(self):
        state = self.scene.state_port.Eval(self.plant_context)
        return (self.terms.J_BE @ state[7:])[:3]

    @property
    def truth(self):
        results = self.scene.contact_results_port.Eval(self.plant_context)
        return contact_truth(results, self.scene.tool_body)

    @property
    def rotation_truth(self):
        results = self.scene.contact_results_port.Eval(self.plant_context)
        return rotation_truth(results, self.scene.tool_body)

    @property
    def reaction(self):
        forces = self.scene.reaction_forces_port.Eval(self.plant_context)
        return sensor_reaction(forces, self.scene.sensor_joint)


def still(x, y, z):
    point = np.array([x, y, z])
    return lambda time: point


def test_sensor_in_the_air_reads_the_tools_weight():
    bench = Bench(still(0.45, 0.0, 0.18), SceneParams(tool_mass=0.5))
    bench.advance(1.5)
    weight = 0.5 * GRAVITY
    # The arm holds the tool up; S points down and its axes are link 7's.
    np.testing.assert_allclose(bench.reaction[:3], [0, 0, -weight], atol=1e-3)
    np.testing.assert_allclose(bench.reaction[3:], np.zeros(3), atol=1e-3)
    truth = bench.truth
    assert np.array_equal(truth.force, np.zeros(3))
    assert np.array_equal(truth.normal, np.zeros(3))
    assert truth.dimension == 0


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
def test_pressing_reads_into_the_surface(approximation):
    params = SceneParams(contact_approximation=approximation)
    bench = Bench(still(0.45, 0.02, params.contact_height - 0.008), params)
    bench.advance(1.5)
    # Regularised stiction creeps a little.
    assert np.linalg.norm(bench.velocity) < 5e-4
    truth = bench.truth
    assert -9.0 < truth.force[2] < -6.0
    np.testing.assert_allclose(truth.normal, [0, 0, -1], atol=1e-9)
    assert truth.dimension == 1
    # The series stiffness of tool and table.
    p_BE = bench.terms.p_BE
    depth = params.contact_height - p_BE[2]
    np.testing.assert_allclose(
        -truth.force[2], params.contact_stiffness * depth, rtol=0.02
    )
    # In standstill: sensed force = contact force - weight, robot on environment.
    R_BS = bench.terms.R_BE
    wrench = bench.reaction
    weight = np.array([0.0, 0.0, -params.tool_mass * GRAVITY])
    sensed = R_BS @ wrench[:3] + weight
    size = np.linalg.norm(truth.force)
    np.testing.assert_allclose(sensed, truth.force, atol=0.02 * size)
    # Its moment about S: the force acts where the sphere touches.
    p_BS = p_BE - R_BS @ p_SE_S
    p_SC_B = p_BE - TIP_RADIUS * np.array([0, 0, 1]) - p_BS
    moment = R_BS @ wrench[3:] + np.cross(R_BS @ np.array(TOOL_COM_S), weight)
    np.testing.assert_allclose(
        moment, np.cross(p_SC_B, truth.force), atol=0.02 * size * 0.11
    )


def test_sensor_reaction_system_gives_what_the_function_gives():
    bench = Bench(still(0.45, 0.0, 0.105))
    bench.advance(0.2)
    wrench = bench.reaction_port.Eval(bench.reaction_context)
    assert np.linalg.norm(wrench) > 1.0
    assert np.array_equal(wrench, bench.reaction)


@pytest.mark.parametrize("approximation", APPROXIMATIONS)
@pytest.mark.parametrize("friction", [0.1, 0.3])
def test_sliding_obeys_coulomb(approximation, friction):
    params = SceneParams(friction=friction, contact_approximation=approximation)

    def target(time):
        return np.array(
            [0.42 + 0.06 * time, -0.05 + 0.03 * time, params.contact_height - 0.008]
        )

    bench = Bench(target, params)
    bench.advance(0.8)
    for time in (0.9, 1.0, 1.1):
        bench.advance(time)
        force, velocity = bench.truth.force, bench.velocity
        assert np.linalg.norm(velocity[:2]) > 0.02
        # The robot drags the table along: friction on it is along the slip.
        np.testing.assert_allclose(
            force[:2],
            friction * -force[2] * velocity[:2] / np.linalg.norm(velocity[:2]),
            atol=0.02 * friction * -force[2],
        )


def test_a_corner_has_two_normals():
    wall = box("wall", (0.60, 0.0, 0.2), (0.1, 0.4, 0.2))
    params = SceneParams(surfaces=[wall], friction=0.0)

    def target(time):
        share = min(time / 0.6, 1.0)
        return np.array([0.51 + 0.036 * share, 0.0, 0.14 - 0.036 * share])

    bench = Bench(target, params)
    bench.advance(1.5)
    truth = bench.truth
    assert truth.dimension == 2
    assert truth.force[0] > 3.0
    assert truth.force[2] < -3.0
    # Without friction the normal forces' sum is all there is.
    np.testing.assert_allclose(
        truth.normal, truth.force / np.linalg.norm(truth.force), atol=1e-9
    )


def test_two_boxes_of_one_height_are_one_normal():
    step = box("step", (0.5, 0.0, 0.05), (0.2, 0.2, 0.1))
    bench = Bench(still(0.45, 0.0, 0.102), SceneParams(surfaces=[step]))
    bench.advance(1.0)
    results = bench.scene.contact_results_port.Eval(bench.plant_context)
    assert results.num_point_pair_contacts() == 2
    truth = bench.truth
    assert truth.dimension == 1
    np.testing.assert_allclose(truth.normal, [0, 0, -1], atol=1e-9)
    sensed = bench.terms.R_BE @ bench.reaction[:3] - [0, 0, TOOL_MASS * GRAVITY]
    np.testing.assert_allclose(sensed, truth.force, atol=0.02 * 8.0)


def test_a_flat_tool_presses_as_a_sphere_does():
    params = SceneParams(tool="flat")
    bench = Bench(still(0.45, 0.02, params.contact_height - 0.008), params)
    assert params.contact_height == params.table_height
    bench.advance(0.1)
    assert bench.rotation_truth == (0, pytest.approx(np.zeros(3)))
    bench.advance(1.5)
    truth = bench.truth
    assert -9.0 < truth.force[2] < -6.0
    assert truth.dimension == 1
    # Its corners share the stiffness.
    depth = params.contact_height - bench.terms.p_BE[2]
    np.testing.assert_allclose(
        -truth.force[2], params.contact_stiffness * depth, rtol=0.02
    )
    blocked = bench.rotation_truth
    assert blocked.dimension == 2
    np.testing.assert_allclose(blocked.free_axis, [0, 0, -1], atol=1e-3)


@pytest.mark.parametrize("tool_is_body_a", [False, True])
def test_truth_does_not_depend_on_the_order_of_the_bodies(tool_is_body_a):
    tool, world, other = BodyIndex(9), BodyIndex(0), BodyIndex(4)
    into_surface = np.array([0.6, 0.0, -0.8])
    force_on_surface = 5.0 * into_surface + [0.0, 1.0, 0.0]

    def contact(body_a, body_b, force_on_b, normal_from_b_to_a):
        return SimpleNamespace(
            bodyA_index=lambda: body_a,
            bodyB_index=lambda: body_b,
            contact_force=lambda: force_on_b,
            point_pair=lambda: SimpleNamespace(nhat_BA_W=normal_from_b_to_a),
        )

    contacts = [
        contact(tool, world, force_on_surface, -into_surface)
        if tool_is_body_a
        else contact(world, tool, -force_on_surface, into_surface),
        # Not the tool's contact.
        contact(world, other, np.array([0.0, 0.0, 70.0]), np.array([0.0, 0.0, -1.0])),
    ]
    results = SimpleNamespace(
        num_point_pair_contacts=lambda: len(contacts),
        point_pair_contact_info=lambda i: contacts[i],
    )
    truth = contact_truth(results, tool)
    np.testing.assert_allclose(truth.force, force_on_surface, atol=1e-12)
    np.testing.assert_allclose(truth.normal, into_surface, atol=1e-12)
    assert truth.dimension == 1
