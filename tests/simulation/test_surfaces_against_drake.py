# SPDX-License-Identifier: BSD-3-Clause
"""A spherical tool at every shape of surface: distance, normal, force as Drake's.

Drake is exact for these pairs however deep they are in each other, edges, rims
and caps included, so nothing is excluded here. What it does not have is the
bore; and an ellipsoid, which it takes for something else, we have not.
"""

from __future__ import annotations

import numpy as np
import pytest
from pydrake.geometry import (
    AddContactMaterial,
    Box,
    Capsule,
    Cylinder,
    HalfSpace,
    ProximityProperties,
    SceneGraph,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    CoulombFriction,
    MultibodyPlant,
)
from pydrake.multibody.tree import SpatialInertia, UnitInertia
from pydrake.systems.framework import DiagramBuilder
from scipy.spatial.transform import Rotation

import dual_proxy as dp

TOOL_RADIUS = 0.02
TOOL_STIFFNESS = 3e4
SURFACE_STIFFNESS = 1e4
ZERO = np.zeros(3)
# Drake's cylinder and capsule lie along z, ours along x.
ALONG_X = RigidTransform(RotationMatrix.MakeYRotation(np.pi / 2))
UPRIGHT = RigidTransform()
SHAPES: dict[str, tuple[dict[str, object], Shape, RigidTransform]] = {
    "half_space": ({}, HalfSpace(), UPRIGHT),
    "box": ({"half_size": [0.1, 0.07, 0.2]}, Box(0.2, 0.14, 0.4), UPRIGHT),
    "sphere": ({"radius": 0.1}, Sphere(0.1), UPRIGHT),
    "cylinder": ({"radius": 0.1, "length": 0.3}, Cylinder(0.1, 0.3), ALONG_X),
    "capsule": ({"radius": 0.1, "length": 0.3}, Capsule(0.1, 0.3), ALONG_X),
}


def draw_pose(rng: np.random.Generator) -> RigidTransform:
    R = Rotation.from_quat(rng.normal(size=4)).as_matrix()
    return RigidTransform(RotationMatrix(R), 0.1 * rng.normal(size=3))


def contact_surface(
    name: str, X_BS: RigidTransform, **more: object
) -> dp.ContactSurface:
    return dp.ContactSurface(
        dp.ContactSurfaceParams(
            shape=name,
            position=X_BS.translation(),
            rotation=X_BS.rotation().matrix(),
            **SHAPES[name][0],
            **more,
        )
    )


class DrakeScene:
    """A surface of a shape at a pose and a spherical tool that can be put anywhere.

    The tool is so heavy that no contact moves it: what the plant's solver says of
    a step is the law at the place and speed that it was given.
    """

    def __init__(self, name: str, X_BS: RigidTransform) -> None:
        builder = DiagramBuilder()
        self.plant: MultibodyPlant
        self.scene_graph: SceneGraph
        self.plant, self.scene_graph = AddMultibodyPlantSceneGraph(builder, 1e-3)
        # Its answers are of where the tool is now, not of a step before.
        self.plant.SetUseSampledOutputPorts(False)
        self.plant.mutable_gravity_field().set_gravity_vector(ZERO)
        inertia = SpatialInertia(1e9, ZERO, UnitInertia.SolidSphere(1.0))
        self.tool = self.plant.AddRigidBody("tool", inertia)
        self.plant.RegisterCollisionGeometry(
            self.tool,
            RigidTransform(),
            Sphere(TOOL_RADIUS),
            "tool",
            self._material(TOOL_STIFFNESS),
        )
        _, shape, X_SG = SHAPES[name]
        self.plant.RegisterCollisionGeometry(
            self.plant.world_body(),
            X_BS @ X_SG,
            shape,
            "surface",
            self._material(SURFACE_STIFFNESS),
        )
        self.plant.Finalize()
        self.diagram = builder.Build()
        self.context = self.diagram.CreateDefaultContext()
        self.plant_context = self.plant.GetMyMutableContextFromRoot(self.context)

    @staticmethod
    def _material(stiffness: float) -> ProximityProperties:
        properties = ProximityProperties()
        AddContactMaterial(
            dissipation=2.0,
            point_stiffness=stiffness,
            friction=CoulombFriction(0.4, 0.4),
            properties=properties,
        )
        return properties

    def put_tool(self, p: np.ndarray) -> None:
        self.plant.SetFreeBodyPose(self.plant_context, self.tool, RigidTransform(p))

    def penetration(self) -> tuple[float, np.ndarray] | None:
        """Depth and normal INTO the surface, if they touch."""
        query = self.scene_graph.get_query_output_port().Eval(
            self.scene_graph.GetMyContextFromRoot(self.context)
        )
        pairs = query.ComputePointPairPenetration()
        if not pairs:
            return None
        (pair,) = pairs
        frame = query.inspector().GetFrameId(pair.id_A)
        is_tool_A = self.plant.GetBodyFromFrameId(frame) is self.tool
        return pair.depth, -pair.nhat_BA_W if is_tool_A else pair.nhat_BA_W

    def force(self) -> np.ndarray:
        """Of the tool on the surface; zero if they do not touch."""
        results = self.plant.get_contact_results_output_port().Eval(self.plant_context)
        if results.num_point_pair_contacts() == 0:
            return ZERO
        info = results.point_pair_contact_info(0)
        force: np.ndarray = info.contact_force()  # On body B.
        return -force if info.bodyB_index() == self.tool.index() else force


@pytest.mark.parametrize("name", SHAPES)
def test_penetration_and_normal(name):
    rng = np.random.default_rng(1)
    touching = inside = 0
    for _ in range(20):
        X_BS = draw_pose(rng)
        scene = DrakeScene(name, X_BS)
        dut = contact_surface(name, X_BS)
        for _ in range(250):
            p = X_BS @ (0.12 * rng.normal(size=3))
            scene.put_tool(p)
            expected = scene.penetration()
            contact = dut.calc(p, ZERO, TOOL_RADIUS)
            assert (expected is not None) == (contact.penetration > 0)
            if expected is None:
                continue
            touching += 1
            inside += contact.penetration > TOOL_RADIUS
            assert contact.penetration == pytest.approx(expected[0], abs=1e-14)
            np.testing.assert_allclose(contact.normal, expected[1], atol=1e-13)
    assert touching > 1000
    assert touching - inside > 300


@pytest.mark.parametrize("name", SHAPES)
def test_force_at_rest(name):
    rng = np.random.default_rng(2)
    X_BS = draw_pose(rng)
    scene = DrakeScene(name, X_BS)
    # Two bodies' stiffness is in series.
    stiffness = 1 / (1 / TOOL_STIFFNESS + 1 / SURFACE_STIFFNESS)
    dut = contact_surface(name, X_BS, stiffness=stiffness, friction=0.4)
    touching = 0
    for _ in range(1000):
        p = X_BS @ (0.12 * rng.normal(size=3))
        scene.put_tool(p)
        force = dut.calc(p, ZERO, TOOL_RADIUS).force
        touching += bool(force.any())
        np.testing.assert_allclose(force, scene.force(), rtol=1e-6, atol=1e-6)
    assert touching > 100
