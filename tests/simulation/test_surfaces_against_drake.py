# SPDX-License-Identifier: BSD-3-Clause
"""A spherical tool in a scene of surfaces: distance, normal, force as Drake's.

Drake is exact for these pairs however deep they are in each other, edges, rims
and caps included, so nothing is excluded here. What it does not have is the
bore; and an ellipsoid, which it takes for something else, we have not.
"""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.geometry import Role, SceneGraph, Sphere
from pydrake.math import RigidTransform
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    DiscreteContactApproximation,
    MultibodyPlant,
)
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.systems.framework import DiagramBuilder
from scipy.spatial.transform import Rotation

import dual_proxy as dp
from dual_proxy._core import _make_drake_scene
from dual_proxy.panda import _pose, _proximity_properties, _shape, add_panda_scene

TOOL_RADIUS = 0.02
STEP = 1e-3
ZERO = np.zeros(3)
SHAPES: dict[str, dict[str, object]] = {
    "half_space": {"shape": "half_space"},
    "box": {"shape": "box", "size": [0.2, 0.14, 0.4]},
    "sphere": {"shape": "sphere", "radius": 0.1},
    "cylinder": {"shape": "cylinder", "radius": 0.1, "length": 0.3},
    "endless": {"shape": "cylinder", "radius": 0.1, "length": 0.0},
    "capsule": {"shape": "capsule", "radius": 0.1, "length": 0.3},
}


def draw_scene(rng: np.random.Generator, tool: str = "sphere") -> dp.SceneParams:
    """One surface of each shape somewhere, all of different materials."""
    surfaces = [
        dp.SurfaceParams(
            name=name,
            position=0.1 * rng.normal(size=3),
            rotation=Rotation.from_quat(rng.normal(size=4)).as_rotvec(),
            stiffness=10.0 ** rng.uniform(3.0, 6.0),
            dissipation=rng.uniform(0.0, 10.0),
            friction=0.0 if name == "sphere" else rng.uniform(0.05, 1.5),
            **shape,
        )
        for name, shape in SHAPES.items()
    ]
    return dp.SceneParams(table=False, surfaces=surfaces, tool=tool)


class DrakeScene:
    """A scene's surfaces and a ball of its tool that can be put anywhere.

    The ball is so heavy that no contact moves it: what the plant's solver says of
    a step is the law at the place and speed that it was given.
    """

    def __init__(self, params: dp.SceneParams) -> None:
        builder = DiagramBuilder()
        self.plant: MultibodyPlant
        self.scene_graph: SceneGraph
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(builder, STEP)
        self.plant.set_discrete_contact_approximation(
            DiscreteContactApproximation.kLagged
        )
        # Its answers are of where the ball is now, not of a step before.
        self.plant.SetUseSampledOutputPorts(False)
        self.plant.mutable_gravity_field().set_gravity_vector(ZERO)
        inertia = SpatialInertia(1e15, ZERO, UnitInertia.SolidSphere(1.0))
        self.ball = self.plant.AddRigidBody("ball", inertia)
        material, surfaces = _make_drake_scene(params)
        self.plant.RegisterCollisionGeometry(
            self.ball,
            RigidTransform(),
            Sphere(TOOL_RADIUS),
            "ball",
            _proximity_properties(material),
        )
        for surface in surfaces:
            self.plant.RegisterCollisionGeometry(
                self.plant.world_body(),
                _pose(surface),
                _shape(surface),
                surface.name,
                _proximity_properties(surface.material),
            )
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.plant_context = self.plant.GetMyMutableContextFromRoot(self.context)

    def put_ball(self, p: np.ndarray, v: np.ndarray = ZERO) -> None:
        self.plant.SetFreeBodyPose(self.plant_context, self.ball, RigidTransform(p))
        self.plant.SetVelocities(self.plant_context, np.concatenate([ZERO, v]))

    def penetrations(self) -> dict[str, tuple[float, np.ndarray]]:
        """Depth and normal INTO the surface, of each that is touched."""
        query = self.scene_graph.get_query_output_port().Eval(
            self.scene_graph.GetMyContextFromRoot(self.context)
        )
        inspector = query.inspector()
        result = {}
        for pair in query.ComputePointPairPenetration():
            ball_is_A = self._name(inspector, pair.id_A) == "ball"
            surface = self._name(inspector, pair.id_B if ball_is_A else pair.id_A)
            normal = -pair.nhat_BA_W if ball_is_A else pair.nhat_BA_W
            result[surface] = pair.depth, normal
        return result

    def forces(self) -> dict[str, np.ndarray]:
        """Of the ball on each surface that is touched."""
        results = self.plant.get_contact_results_output_port().Eval(self.plant_context)
        inspector = self.scene_graph.model_inspector()
        result = {}
        for i in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(i)
            pair = info.point_pair()
            ball_is_A = self._name(inspector, pair.id_A) == "ball"
            surface = self._name(inspector, pair.id_B if ball_is_A else pair.id_A)
            force = info.contact_force()  # On body B.
            result[surface] = force if ball_is_A else -force
        return result

    @staticmethod
    def _name(inspector, geometry) -> str:
        return inspector.GetName(geometry).rsplit("::", 1)[-1]


def contact_surfaces(params: dp.SceneParams) -> dict[str, dp.ContactSurface]:
    return {
        surface.name: dp.ContactSurface(contact)
        for surface, contact in zip(
            params.all_surfaces(), params.contact_surfaces(), strict=True
        )
    }


def draw_place(rng: np.random.Generator, params: dp.SceneParams) -> np.ndarray:
    """Near one of the surfaces."""
    surface = params.surfaces[rng.integers(len(params.surfaces))]
    return surface.position + 0.12 * rng.normal(size=3)


def test_penetration_and_normal():
    rng = np.random.default_rng(1)
    touching = dict.fromkeys(SHAPES, 0)
    inside = dict.fromkeys(SHAPES, 0)
    for _ in range(40):
        params = draw_scene(rng)
        scene = DrakeScene(params)
        dut = contact_surfaces(params)
        for _ in range(200):
            p = draw_place(rng, params)
            scene.put_ball(p)
            expected = scene.penetrations()
            for name, surface in dut.items():
                contact = surface.calc(p, ZERO, TOOL_RADIUS)
                assert (name in expected) == (contact.penetration > 0)
                if name not in expected:
                    continue
                touching[name] += 1
                inside[name] += contact.penetration > TOOL_RADIUS
                depth, normal = expected[name]
                assert contact.penetration == pytest.approx(depth, abs=1e-14)
                np.testing.assert_allclose(contact.normal, normal, atol=1e-13)
    for name in SHAPES:
        assert touching[name] > 500
        assert touching[name] - inside[name] > 100


@pytest.mark.parametrize("tool", ["sphere", "flat"])
def test_force_at_rest_is_that_of_the_surfaces_own_stiffness(tool):
    rng = np.random.default_rng(2)
    touching = 0
    share = 1.0 if tool == "sphere" else 0.25
    for _ in range(10):
        params = draw_scene(rng, tool)
        scene = DrakeScene(params)
        dut = contact_surfaces(params)
        for _ in range(100):
            p = draw_place(rng, params)
            scene.put_ball(p)
            forces = scene.forces()
            touching += len(forces)
            for name, force in forces.items():
                expected = share * dut[name].calc(p, ZERO, TOOL_RADIUS).force
                np.testing.assert_allclose(
                    force, expected, rtol=1e-6, atol=1e-6 * np.linalg.norm(expected)
                )
    assert touching > 500


def test_sliding_and_sinking_are_those_of_the_surfaces_own_material():
    rng = np.random.default_rng(3)
    pressing = frictionless = 0
    for _ in range(20):
        params = draw_scene(rng)
        scene = DrakeScene(params)
        dut = contact_surfaces(params)
        for _ in range(100):
            p = draw_place(rng, params)
            v = rng.normal(size=3)
            scene.put_ball(p, v)
            for name, force in scene.forces().items():
                surface = dut[name]
                contact = surface.calc(p, v, TOOL_RADIUS)
                material = surface.params
                sinking = contact.normal @ v
                sliding = v - sinking * contact.normal
                # Drake's normal force is that at the end of the step, its friction
                # that of the normal force at the beginning.
                depth = contact.penetration + STEP * sinking
                expected = (
                    material.stiffness
                    * max(0.0, depth)
                    * max(0.0, 1.0 + material.dissipation * sinking)
                )
                normal_force = contact.normal @ force
                assert normal_force == pytest.approx(expected, rel=1e-4, abs=1e-6)
                if expected < 1.0 or np.linalg.norm(sliding) < 0.3:
                    continue
                pressing += 1
                friction = force - normal_force * contact.normal
                if name == "sphere":
                    frictionless += 1
                    assert np.linalg.norm(friction) < 1e-9 * normal_force
                direction = sliding / np.linalg.norm(sliding)
                np.testing.assert_allclose(
                    friction / contact.normal_force,
                    material.friction * direction,
                    atol=1e-3,
                )
    assert pressing > 500
    assert frictionless > 50


def test_the_arms_scene_is_made_of_the_same():
    """The plant of a scenario has what was looked at above."""
    rng = np.random.default_rng(4)
    params = draw_scene(rng, "flat")
    scene = add_panda_scene(DiagramBuilder(), params)
    inspector = scene.scene_graph.model_inspector()
    ball, surfaces = _make_drake_scene(params)
    expected = {surface.name: surface for surface in surfaces}
    found = set()
    for geometry in inspector.GetAllGeometryIds(Role.kProximity):
        name = inspector.GetName(geometry).rsplit("::", 1)[-1]
        properties = inspector.GetProximityProperties(geometry)
        surface = expected.get(name)
        material = surface.material if surface else ball
        stiffness = properties.GetProperty("material", "point_contact_stiffness")
        assert stiffness == material.stiffness
        dissipation = properties.GetProperty("material", "hunt_crossley_dissipation")
        assert dissipation == material.dissipation
        friction = properties.GetProperty("material", "coulomb_friction")
        assert friction.static_friction() == material.friction
        assert friction.dynamic_friction() == material.friction
        found.add(name)
        if surface:
            X_BG = inspector.GetPoseInFrame(geometry)
            assert X_BG.IsExactlyEqualTo(_pose(surface))
            assert type(inspector.GetShape(geometry)) is type(_shape(surface))
    assert found == {*SHAPES, *(f"corner{i}" for i in range(4))}
