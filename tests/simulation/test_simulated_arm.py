# SPDX-License-Identifier: BSD-3-Clause
"""The arm without Drake beside Drake's plant, and its bindings.

Both take steps of one kind, so what they differ by in the air is rounding; in
contact it is that Drake's friction lags by a step and slips a little while it
sticks.
"""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable

import numpy as np
import pytest
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

import dual_proxy as dp
from dual_proxy.panda import (
    PandaModel,
    PandaTerms,
    add_panda_scene,
    p_SE_S,
    read_contacts,
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

STEP = 1e-3
# What the scene's tool has when its mass is TOOL_MASS.
TOOL_INERTIA = np.diag([0.00019, 0.00019, 0.00008])
Control = Callable[[float, PandaTerms, np.ndarray], np.ndarray]


def make_arm(model: PandaModel, params: SceneParams) -> dp.SimulatedArm:
    """The same scene: its surfaces, its tool."""
    flat = params.tool == "flat"
    return dp.SimulatedArm(
        dp.SimulatedArmParams(
            time_step=params.time_step,
            p_EBall=np.transpose(params.corners() if flat else [np.zeros(3)]),
            p_SE=p_SE_S,
            tool_mass=params.tool_mass,
            tool_com=TOOL_COM_S,
            tool_inertia=params.tool_mass / TOOL_MASS * TOOL_INERTIA,
        ),
        model.arm_params,
        dp.ContactSceneParams(
            surfaces=params.contact_surfaces(),
            tool_radius=CORNER_RADIUS if flat else TIP_RADIUS,
        ),
    )


class Record:
    """What came of each step; arrays with a row per step."""

    def __init__(self) -> None:
        self._rows: list[tuple[np.ndarray, ...]] = []

    def add(self, *row: np.ndarray) -> None:
        self._rows.append(row)

    def freeze(self) -> None:
        self.q, self.v, self.reaction, self.truth, self.p_BE, self.v_BE = map(
            np.array, zip(*self._rows, strict=True)
        )

    @property
    def force(self) -> np.ndarray:
        return self.truth[:, :3]


def simulate(
    params: SceneParams, control: Control, seconds: float
) -> tuple[Record, Record]:
    """Runs Drake's plant and the arm, each under its own control."""
    builder = DiagramBuilder()
    model = PandaModel(params.tool_mass, params.gravity)
    q_start = model.inverse_kinematics(params.start_position)
    scene = add_panda_scene(builder, params, q_start, drawn=False)
    builder.ExportInput(scene.actuation_port, "torque")
    simulator = Simulator(builder.Build())
    root = simulator.get_mutable_context()
    torque_port = simulator.get_system().GetInputPort("torque")
    context = scene.plant.GetMyContextFromRoot(root)
    arm = make_arm(model, params)
    state = arm.make_state(q_start)
    drake, ours = Record(), Record()
    q, v = q_start, np.zeros(7)
    for i in range(round(seconds / STEP)):
        torque_port.FixValue(root, control(i * STEP, model.calc(q, v), v))
        simulator.AdvanceTo((i + 1) * STEP)
        q, v = np.split(scene.state_port.Eval(context), 2)
        reaction = scene.reaction_forces_port.Eval(context)
        contacts = scene.contact_results_port.Eval(context)
        terms = model.calc(q, v)
        drake.add(
            q,
            v,
            sensor_reaction(reaction, scene.sensor_joint),
            read_contacts(contacts, scene.tool_body, places=True),
            terms.p_BE,
            terms.J_BE @ v,
        )
        arm.update(control(i * STEP, model.calc(state.q, state.v), state.v), state)
        ours.add(
            state.q,
            state.v,
            state.reaction,
            state.contact_truth,
            state.pose.p,
            state.velocity,
        )
    drake.freeze()
    ours.freeze()
    return drake, ours


def press_and_slide(push: np.ndarray, velocity: np.ndarray, start: float) -> Control:
    """Pushes, pointing down; from `start` on it also moves, by a stiff damper."""
    moving = np.where(velocity != 0, 1.0, 0.0)
    R_goal = np.diag([1.0, -1.0, -1.0])

    def control(time: float, terms: PandaTerms, v: np.ndarray) -> np.ndarray:
        twist = terms.J_BE @ v
        goal = velocity * min(1.0, max(0.0, (time - start) / 0.1))
        force = push - 20 * twist[:3] + 200 * moving * (goal - twist[:3])
        error = np.sum(np.cross(R_goal.T, terms.R_BE.T), axis=0) / 2
        moment = -150 * error - 3 * twist[3:]
        wrench = np.concatenate([force, moment])
        return terms.J_BE.T @ wrench - terms.gravity + terms.bias - 1.0 * v

    return control


def largest_difference(drake: Record, ours: Record, name: str, time: slice) -> float:
    difference = getattr(ours, name)[time] - getattr(drake, name)[time]
    return float(np.abs(difference).max())


# Before, and after the tool is to move along; both settled. Steps.
STILL, SLIDING = slice(350, 500), slice(1000, 1500)


def check_contact(drake: Record, ours: Record) -> None:
    size = np.linalg.norm(drake.force[SLIDING], axis=1).mean()
    assert size > 7.0
    for name, at_rest, in_motion in (
        ("force", 0.05, 0.005),  # N
        ("reaction", 0.05, 0.005),  # N, N m
        ("p_BE", 2e-5, 5e-6),  # m
        ("v_BE", 1e-3, 1e-5),  # m/s, rad/s
    ):
        assert largest_difference(drake, ours, name, STILL) < at_rest
        assert largest_difference(drake, ours, name, SLIDING) < in_motion
    np.testing.assert_allclose(
        ours.truth[SLIDING, 3:], drake.truth[SLIDING, 3:], atol=1e-3
    )
    # The impact is over in some steps.
    peak = np.linalg.norm(drake.force, axis=1).max()
    assert np.linalg.norm(ours.force, axis=1).max() == pytest.approx(peak, rel=0.05)
    assert largest_difference(drake, ours, "p_BE", slice(None)) < 1e-4


def test_free_motion_is_drakes():
    params = SceneParams(tool_mass=0.5, start_position=[0.45, 0.1, 0.35])
    rng = np.random.default_rng(3)
    amplitude = rng.uniform(-1, 1, size=7) * [1, 1.5, 1, 1, 0.15, 0.15, 0.06]

    def control(time, terms, v):
        return amplitude * np.sin(8 * time) - terms.gravity - 0.1 * v

    drake, ours = simulate(params, control, 1.0)
    assert np.abs(drake.v).max() > 1.0
    assert not drake.force.any()
    np.testing.assert_allclose(ours.q, drake.q, atol=1e-12)
    np.testing.assert_allclose(ours.v, drake.v, atol=1e-11)
    np.testing.assert_allclose(ours.reaction, drake.reaction, atol=1e-10)
    assert not ours.truth.any()


@pytest.mark.parametrize("tool", ["sphere", "flat"])
@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_pressing_and_sliding_is_drakes(tool, friction):
    params = SceneParams(tool=tool, friction=friction, tool_size=0.04)
    params.start_position = [0.45, 0.0, params.contact_height + 0.002]
    control = press_and_slide(
        np.array([0, 0, -8.0]), np.array([0.05, 0.03, 0]), start=0.5
    )
    drake, ours = simulate(params, control, 1.5)
    check_contact(drake, ours)
    force = ours.force[SLIDING]
    np.testing.assert_allclose(
        np.linalg.norm(force[:, :2], axis=1), -friction * force[:, 2], atol=1e-3
    )
    depth = params.contact_height - ours.p_BE[SLIDING, 2]
    np.testing.assert_allclose(
        depth, -force[:, 2] / params.contact_stiffness, rtol=0.01
    )
    assert ours.truth[-1, 6] == 1
    assert ours.truth[-1, 10] == (2 if tool == "flat" else 0)


@pytest.mark.parametrize("friction", [0.0, 0.2])
def test_corner_is_drakes(friction):
    wall = SurfaceParams(
        name="wall", shape="box", position=[0.5, 0.15, 0.2], size=[0.4, 0.1, 0.4]
    )
    params = SceneParams(surfaces=[wall], friction=friction)
    params.start_position = [0.45, 0.085, params.contact_height + 0.002]
    control = press_and_slide(
        np.array([0, 6.0, -8.0]), np.array([0.05, 0, 0]), start=0.5
    )
    drake, ours = simulate(params, control, 1.5)
    check_contact(drake, ours)
    assert ours.truth[-1, 6] == 2


def test_params_and_state():
    model = PandaModel()
    arm = make_arm(model, SceneParams())
    assert pickle.loads(pickle.dumps(arm.params)) == arm.params
    assert list(arm.params.fields) == [
        "period",
        "time_step",
        "p_EBall",
        "p_SE",
        "tool_mass",
        "tool_com",
        "tool_inertia",
    ]
    np.testing.assert_array_equal(arm.params.p_EBall, np.zeros((3, 1)))
    assert arm.arm == model.arm_params
    assert len(arm.scene.surfaces) == 1
    q = model.inverse_kinematics([0.45, 0.0, 0.18])
    v = np.full(7, 0.1)
    state = arm.make_state(q, v)
    terms = model.calc(q, v)
    np.testing.assert_array_equal(state.q, q)
    np.testing.assert_array_equal(state.v, v)
    np.testing.assert_array_equal(state.pose.p, terms.p_BE)
    np.testing.assert_array_equal(state.pose.R, terms.R_BE)
    np.testing.assert_allclose(state.velocity, terms.J_BE @ v, atol=1e-15)
    assert not state.reaction.any()
    saved = copy.copy(state)
    arm.update(np.full(7, np.nan), state)
    assert state.bad_inputs == 1
    assert saved.bad_inputs == 0
    assert not np.array_equal(saved.q, state.q)
    with pytest.raises(ValueError, match=r"^torque: .*\(7,\).*\(6,\)"):
        arm.update(np.zeros(6), state)
    with pytest.raises(ValueError, match="field `q` expected finite values"):
        arm.make_state(np.full(7, np.nan))
    with pytest.raises(ValueError, match="`p_EBall` expected 1 to 4 columns, got 5"):
        dp.SimulatedArmParams(p_EBall=np.zeros((3, 5)))
