# SPDX-License-Identifier: BSD-3-Clause
"""The Franka Panda with a wrist force/torque sensor: plant, model and truth.

Three things live here:

- `add_panda_scene` puts the simulated arm and the surfaces around it into a
  diagram: what stands in for the real arm and its surroundings.
- `PandaModel` gives a controller its model terms (pose, Jacobian, mass matrix,
  bias, gravity) from joint positions and velocities alone. It is made from a
  plant of its own, so a controller's model may differ from the simulated arm.
- `sensor_reaction`, `contact_truth` and `rotation_truth` read the simulator:
  what the wrist sensor takes, and what really touches.

Frames: B is panda_link0 (= Drake world), S the sensor at the flange with the
axes of panda_link7, E the tool point, 0.207 m along +z of panda_link7 with its
axes. Units are SI; 6-vectors are [linear; angular] or [force; moment].
"""

from __future__ import annotations

import copy
import importlib.resources
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import dual_proxy._pydrake  # noqa: F401

# isort: split
import numpy as np
from numpy.typing import ArrayLike, NDArray
from pydrake.geometry import (
    AddContactMaterial,
    Box,
    Capsule,
    Cylinder,
    Ellipsoid,
    HalfSpace,
    ProximityProperties,
    Role,
    SceneGraph,
    Shape,
    Sphere,
)
from pydrake.math import RigidTransform, RotationMatrix
from pydrake.multibody.math import SpatialForce
from pydrake.multibody.parsing import (
    LoadModelDirectives,
    Parser,
    ProcessModelDirectives,
)
from pydrake.multibody.plant import (
    AddMultibodyPlantSceneGraph,
    ContactModel,
    ContactResults,
    CoulombFriction,
    DiscreteContactApproximation,
    MultibodyPlant,
)
from pydrake.multibody.tree import (
    BodyIndex,
    FixedOffsetFrame,
    ModelInstanceIndex,
    RotationalInertia,
    SpatialInertia,
    WeldJoint,
)
from pydrake.systems.framework import (
    DiagramBuilder,
    InputPort,
    OutputPort,
)

from dual_proxy._core import (
    _PANDA,
    ArmModel,
    ArmModelParams,
    ScenarioError,
    _ContactTruth,
    _DrakeMaterial,
    _DrakeSurface,
    _ellipsoid_problem,
    _make_drake_scene,
    _make_picture,
    _single_contact_truth,
)
from dual_proxy.scene_params import (
    CORNER_RADIUS,
    TIP_RADIUS,
    TOOL_COM_S,
    TOOL_MASS,
    SceneParams,
)
from dual_proxy.text import one_line

__all__ = [
    "JOINT_LOWER",
    "JOINT_UPPER",
    "JOINT_VELOCITY_LIMIT",
    "NUM_JOINTS",
    "Q_REST",
    "R_BE_DOWN",
    "TOOL_MOMENTS",
    "TORQUE_LIMIT",
    "ContactTruth",
    "PandaModel",
    "PandaScene",
    "PandaTerms",
    "RotationTruth",
    "add_panda_scene",
    "contact_truth",
    "p_SE_S",
    "read_contacts",
    "rotation_truth",
    "scene_picture",
    "sensor_reaction",
]

Vector = NDArray[np.float64]

# pydrake's type stubs name array types that no array has, so what takes or
# gives arrays below is declared Any.


def _constant(values: ArrayLike) -> Vector:
    array = np.array(values, dtype=np.float64)
    array.setflags(write=False)
    return array


NUM_JOINTS = 7
#: Joint position limits, (7,), rad, the manufacturer's.
JOINT_LOWER = _constant(_PANDA["joint_lower"])
JOINT_UPPER = _constant(_PANDA["joint_upper"])
#: Joint speed limits, (7,), rad/s.
JOINT_VELOCITY_LIMIT = _constant(_PANDA["joint_speed"])
#: Joint torque limits, (7,), N m.
TORQUE_LIMIT = _constant(_PANDA["torque"])
#: Orientation of the tool point that points the tool straight down, (3, 3).
R_BE_DOWN = _constant(_PANDA["tool_pointing_down"])
#: Rest posture, (7,), rad: E at (0.45, 0, 0.18) m, the tool pointing straight
#: down, no joint within 0.5 rad of its limits.
Q_REST = _constant(_PANDA["q_rest"])
#: Position of the tool point from the sensor's frame, (3,), m, in S.
p_SE_S = _constant([0.0, 0.0, 0.1])

_CONTACT_APPROXIMATIONS = {
    "lagged": DiscreteContactApproximation.kLagged,
    "similar": DiscreteContactApproximation.kSimilar,
    "sap": DiscreteContactApproximation.kSap,
}

# The flange, where the sensor's frame S is, in panda_link7, m.
_p_7S = _constant(_PANDA["flange"])
# What is beyond the flange (the sensor's own moving half, the shaft, the tip)
# has these moments of inertia about its centre of mass, along the axes of S,
# kg m^2, when its mass is TOOL_MASS.
TOOL_MOMENTS = (0.00019, 0.00019, 0.00008)
_DARK = _constant([0.16, 0.17, 0.19, 1.0])
_STEEL = _constant([0.66, 0.69, 0.73, 1.0])
# What is drawn of sensor and tool: name, shape, its centre along z of S (m),
# colour.
_TOOL_VISUALS: tuple[tuple[str, Shape, float, Any], ...] = (
    ("sensor", Cylinder(0.0375, 0.03), 0.015, _DARK),
    ("collar", Cylinder(0.03, 0.008), 0.034, _STEEL),
    ("shaft", Cylinder(0.006, 0.062), 0.069, _STEEL),
)


def _translation(p: Any) -> RigidTransform:
    return RigidTransform(p)


@dataclass(frozen=True)
class PandaScene:
    """What `add_panda_scene` added, and the ports to wire.

    Attributes
    ----------
    plant, scene_graph : the systems; the plant is finalized and connected.
    params : the parameters it was built with.
    arm : model instance of arm and tool.
    tool_body : index of the tool's body, for `contact_truth`.
    sensor_joint : index of the sensor's joint, which is its place in the
        reaction forces, for `sensor_reaction`.
    """

    plant: MultibodyPlant
    scene_graph: SceneGraph
    params: SceneParams
    arm: ModelInstanceIndex
    tool_body: BodyIndex
    sensor_joint: int

    @property
    def actuation_port(self) -> InputPort:
        """Joint torques, (7,), N m, clamped by the plant at `TORQUE_LIMIT`."""
        return self.plant.get_actuation_input_port(self.arm)

    @property
    def state_port(self) -> OutputPort:
        """Joint positions, rad, then velocities, rad/s, (14,)."""
        return self.plant.get_state_output_port(self.arm)

    @property
    def reaction_forces_port(self) -> OutputPort:
        """Reaction at each joint (abstract); see `sensor_reaction`."""
        return self.plant.get_reaction_forces_output_port()

    @property
    def contact_results_port(self) -> OutputPort:
        """Drake's ContactResults (abstract); see `contact_truth`."""
        return self.plant.get_contact_results_output_port()


def _add_arm(plant: Any, tool_mass: float) -> ModelInstanceIndex:
    """Adds the arm, standing on the world, with sensor and tool.

    Its visuals come along if the plant is registered with a scene graph.
    """
    urdf = importlib.resources.files(__package__).joinpath("robots/panda/panda.urdf")
    (arm,) = Parser(plant).AddModelsFromString(urdf.read_text("utf-8"), "urdf")
    scale = tool_mass / TOOL_MASS
    inertia = RotationalInertia(*(moment * scale for moment in TOOL_MOMENTS))
    com: Any = TOOL_COM_S
    tool = plant.AddRigidBody(
        "tool", arm, SpatialInertia.MakeFromCentralInertia(tool_mass, com, inertia)
    ).body_frame()
    link7 = plant.GetFrameByName("panda_link7", arm)
    flange = plant.AddFrame(FixedOffsetFrame("flange", link7, _translation(_p_7S)))
    plant.AddJoint(WeldJoint("ft_sensor", flange, tool, RigidTransform()))
    plant.AddFrame(FixedOffsetFrame("tool_point", tool, _translation(p_SE_S)))
    plant.WeldFrames(plant.world_frame(), plant.GetFrameByName("panda_link0", arm))
    return arm


def _tool_parts(params: SceneParams) -> list[tuple[str, Shape, Vector]]:
    """What of the tool touches: name, shape, its centre in S (m)."""
    if params.tool == "sphere":
        return [("tip", Sphere(TIP_RADIUS), p_SE_S)]
    ball = Sphere(CORNER_RADIUS)
    return [
        (f"corner{i}", ball, p_SE_S + corner)
        for i, corner in enumerate(params.corners())
    ]


def _draw_tool(plant: Any, tool: Any, params: SceneParams) -> None:
    visuals = [
        (name, shape, _constant([0.0, 0.0, height]), color)
        for name, shape, height, color in _TOOL_VISUALS
    ]
    visuals += [(*part, _DARK) for part in _tool_parts(params)]
    if params.tool == "flat":
        edge = params.tool_size + 2.0 * CORNER_RADIUS
        pad = Box(edge, edge, CORNER_RADIUS)
        visuals.append(("pad", pad, p_SE_S - [0.0, 0.0, CORNER_RADIUS], _STEEL))
    for name, shape, p_SG, color in visuals:
        plant.RegisterVisualGeometry(tool, _translation(p_SG), shape, name, color)


def _proximity_properties(material: _DrakeMaterial) -> ProximityProperties:
    properties = ProximityProperties()
    AddContactMaterial(
        dissipation=material.dissipation,
        point_stiffness=material.stiffness,
        friction=CoulombFriction(material.friction, material.friction),
        properties=properties,
    )
    properties.AddProperty("material", "relaxation_time", material.relaxation_time)
    return properties


def _shape(surface: _DrakeSurface) -> Shape:
    if surface.shape == "box":
        return Box(*surface.size)
    if surface.shape == "sphere":
        return Sphere(surface.radius)
    if surface.shape == "cylinder":
        return Cylinder(surface.radius, surface.length)
    if surface.shape == "capsule":
        return Capsule(surface.radius, surface.length)
    return HalfSpace()


def _pose(surface: _DrakeSurface) -> RigidTransform:
    R_BG: Any = surface.R_BG
    p_BG: Any = surface.p_BG
    return RigidTransform(RotationMatrix(R_BG), p_BG)


def scene_picture(
    params: SceneParams,
) -> list[tuple[str, Shape, RigidTransform, Any]]:
    """Returns name, shape, pose in B and colour (4,) of what is to be seen of the
    scene's surfaces."""
    return [
        (surface.name, _shape(surface), _pose(surface), surface.color)
        for surface in _make_picture(params)
    ]


def _add_models(plant: Any, path: str) -> None:
    """Adds the models of a file of directives, if there is one."""
    if not path:
        return
    parser = Parser(plant)
    file = Path(path)
    package = file.with_name("package.xml")
    try:
        if package.exists():
            parser.package_map().AddPackageXml(package)
        ProcessModelDirectives(LoadModelDirectives(file), parser)
    except (RuntimeError, ValueError) as error:
        raise ScenarioError(
            f"scene.model_directives: {path}: {one_line(error)}"
        ) from error


def _check_models(plant: Any, inspector: Any) -> None:
    """Raises ScenarioError for a geometry whose contacts would be wrong."""
    for geometry in inspector.GetAllGeometryIds(Role.kProximity):
        if isinstance(inspector.GetShape(geometry), Ellipsoid):
            body = plant.GetBodyFromFrameId(inspector.GetFrameId(geometry))
            problem = _ellipsoid_problem(
                inspector.GetName(geometry),
                body.name(),
                plant.GetModelInstanceName(body.model_instance()),
            )
            raise ScenarioError(f"scene.model_directives: {problem}")


def add_panda_scene(
    builder: DiagramBuilder,
    params: SceneParams | None = None,
    q_start: ArrayLike | None = None,
    drawn: bool = True,
    touching: bool = True,
) -> PandaScene:
    """Adds the simulated Panda, the surfaces of its scene and what its model
    directives name to a diagram.

    If there is a `package.xml` beside the directives, their folder is a package.
    Of arm and tool only what touches carries collision geometry. The plant is
    discrete and its output ports are sampled: reaction forces and contact
    results are those of the last step (zero and empty before the first).

    Parameters
    ----------
    builder : the diagram under construction.
    params : scene and contact parameters; a copy is kept.
    q_start : (7,) rad, default joint positions of the built diagram; if not
        given, those near `Q_REST` that hold the tool point at
        `params.start_position`, pointing down.
    drawn : whether there is anything to see; what is not drawn need not be
        moved along in every step.
    touching : whether tool and surfaces can touch. A picture need not, and shows
        what Drake cannot simulate, too.

    Raises
    ------
    ScenarioError
        "scene.KEY: ...", if Drake has not what the scene has, if the model
        directives cannot be read, or a model touches with an Ellipsoid.
    ValueError
        If an argument is not what it should be.
    """
    params = copy.deepcopy(params) if params is not None else SceneParams()
    params.validate()
    if q_start is None:
        q_start = PandaModel().inverse_kinematics(params.start_position)
    q_start = np.asarray(q_start, dtype=np.float64)
    if q_start.shape != (NUM_JOINTS,):
        raise ValueError(
            f"add_panda_scene: `q_start` expected shape (7,), got {q_start.shape}"
        )
    plant: Any = MultibodyPlant(params.time_step)
    plant.set_name("panda")
    plant.set_contact_model(ContactModel.kPoint)
    plant.set_discrete_contact_approximation(
        _CONTACT_APPROXIMATIONS[params.contact_approximation]
    )
    plant.SetUseSampledOutputPorts(True)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -params.gravity])
    # Without a scene graph, the plant takes no visuals from the URDF.
    if drawn:
        _, scene_graph = AddMultibodyPlantSceneGraph(builder, plant)
        arm = _add_arm(plant, params.tool_mass)
    else:
        arm = _add_arm(plant, params.tool_mass)
        _, scene_graph = AddMultibodyPlantSceneGraph(builder, plant)
    tool = plant.GetBodyByName("tool", arm)
    if drawn:
        _draw_tool(plant, tool, params)
    world = plant.world_body()
    if touching:
        ball, surfaces = _make_drake_scene(params)
        ball_properties = _proximity_properties(ball)
        for name, shape, p_SG in _tool_parts(params):
            plant.RegisterCollisionGeometry(
                tool, _translation(p_SG), shape, name, ball_properties
            )
        for surface in surfaces:
            plant.RegisterCollisionGeometry(
                world,
                _pose(surface),
                _shape(surface),
                surface.name,
                _proximity_properties(surface.material),
            )
    if drawn:
        for name, shape, pose, color in scene_picture(params):
            plant.RegisterVisualGeometry(world, pose, shape, name, color)
    _add_models(plant, params.model_directives)
    plant.Finalize()
    if touching:
        _check_models(plant, scene_graph.model_inspector())
    plant.SetDefaultPositions(arm, q_start)
    return PandaScene(
        plant=plant,
        scene_graph=scene_graph,
        params=params,
        arm=arm,
        tool_body=tool.index(),
        sensor_joint=int(plant.GetJointByName("ft_sensor", arm).index()),
    )


def sensor_reaction(forces: Sequence[SpatialForce], sensor_joint: int) -> Vector:
    """Returns what the wrist sensor takes: the arm's wrench on the tool.

    This has the project's sign already: pressing on a table, the arm pushes
    the tool (and the tool the table) down. It still holds the tool's weight
    and inertia, as a real sensor's reading does: in standstill it is the
    wrench of the tool on its environment minus the tool's weight.

    Parameters
    ----------
    forces : value of `PandaScene.reaction_forces_port`.
    sensor_joint : `PandaScene.sensor_joint`.

    Returns
    -------
    (6,) [force, N; moment about S's origin, N m], in S.
    """
    force = forces[sensor_joint]
    wrench = np.empty(6)
    wrench[:3] = force.translational()
    wrench[3:] = force.rotational()
    return wrench


class ContactTruth(NamedTuple):
    """What really touches, from the simulator.

    Attributes
    ----------
    force : (3,) N, in B, of the robot on its environment, friction included.
    normal : (3,) unit vector in B INTO the surface; with several surfaces the
        direction of the normal forces' sum; zero without contact.
    dimension : number of independent normals, 0..3 (normals within 10 deg of
        the others' span are not counted again).
    """

    force: Vector
    normal: Vector
    dimension: int


class RotationTruth(NamedTuple):
    """Which rotations the true contacts of the tool block.

    Attributes
    ----------
    dimension : number of directions that are blocked, 0..3: the moments without
        a force that frictionless contacts could resist. Three points on a
        plane that do not lie on a line block two, two points one.
    free_axis : (3,) unit vector in B, the axis of free rotation if there is just
        one, at dimension 2; zero otherwise.
    """

    dimension: int
    free_axis: Vector


_NO_CONTACT = _constant(np.zeros(14))


def read_contacts(
    results: ContactResults, tool_body: BodyIndex, places: bool = False
) -> Vector:
    """Reads the tool's contacts from the plant's contact results.

    Touching without force counts as no contact. What it means is calculated by
    the C++ library (systems/simulation/contact_truth.h).

    Parameters
    ----------
    results : value of `PandaScene.contact_results_port`.
    tool_body : `PandaScene.tool_body`.
    places : whether the places of the contacts are of interest, too.

    Returns
    -------
    (14,) force 3, normal 3, dimension 1, as in `ContactTruth`, axis of free
        motion 3; with `places` dimension 1, free axis 3, as in `RotationTruth`,
        else zero.
    """
    count = results.num_point_pair_contacts()
    if count == 0:
        return _NO_CONTACT
    if count == 1 and not places:
        # By far the most frequent case, in every control period.
        info: Any = results.point_pair_contact_info(0)
        on_tool = info.bodyB_index() == tool_body
        if on_tool or info.bodyA_index() == tool_body:
            return _single_contact_truth(
                info.contact_force(), info.point_pair().nhat_BA_W, on_tool
            )
    truth = _ContactTruth()
    for i in range(count):
        info = results.point_pair_contact_info(i)
        # Drake gives the force on body B and the normal from B into A.
        force = info.contact_force()
        normal = info.point_pair().nhat_BA_W
        if info.bodyB_index() == tool_body:
            force = -force
        elif info.bodyA_index() == tool_body:
            normal = -normal
        else:
            continue
        truth.add(force, normal, info.contact_point() if places else None)
    return truth.to_vector()


def contact_truth(results: ContactResults, tool_body: BodyIndex) -> ContactTruth:
    """Reads what touches; the arguments are those of `read_contacts`."""
    values = read_contacts(results, tool_body)
    return ContactTruth(values[:3], values[3:6], int(values[6]))


def rotation_truth(results: ContactResults, tool_body: BodyIndex) -> RotationTruth:
    """Reads which rotations are blocked; the arguments are those of
    `read_contacts`."""
    values = read_contacts(results, tool_body, places=True)
    return RotationTruth(int(values[10]), values[11:])


class PandaTerms(NamedTuple):
    """Model terms of one joint state, for the operational-space controller.

    Attributes
    ----------
    p_BE : (3,) m, tool point in B.
    R_BE : (3, 3), orientation of E in B.
    J_BE : (6, 7), rows [linear; angular]: twist of E in B = J_BE v.
    mass : (7, 7) kg m^2, joint-space mass matrix A.
    bias : (7,) N m, Coriolis and centrifugal torque, without gravity.
    gravity : (7,) N m, torque that gravity exerts (as Drake's
        CalcGravityGeneralizedForces): a controller adds its negative.
    Jdot_v : (6,) m/s^2 and rad/s^2, [linear; angular]: acceleration of E in B
        = J_BE dv/dt + Jdot_v.
    """

    p_BE: Vector
    R_BE: Vector
    J_BE: Vector
    mass: Vector
    bias: Vector
    gravity: Vector
    Jdot_v: Vector


def _arm_model_params(plant: Any, tool_point: Any) -> ArmModelParams:
    """Reads the arm's numbers from its plant.

    A link is what its joint moves and all that is welded to it.

    Parameters
    ----------
    plant : finalized; its base is welded to the world.
    tool_point : frame E.
    """
    context = plant.CreateDefaultContext()
    plant.SetPositions(context, np.zeros(NUM_JOINTS))
    joints = sorted(
        (
            joint
            for joint in map(plant.get_joint, plant.GetJointIndices())
            if joint.num_positions() == 1
        ),
        key=lambda joint: joint.position_start(),
    )
    parent = plant.world_frame()
    poses = []
    inertias = []
    for joint in joints:
        assert np.array_equal(joint.revolute_axis(), [0.0, 0.0, 1.0])
        frame = joint.frame_on_child()
        link = plant.GetBodiesWeldedTo(joint.child_body())
        poses.append(frame.CalcPose(context, parent))
        inertias.append(
            plant.CalcSpatialInertia(context, frame, [body.index() for body in link])
        )
        parent = frame
    coms = [inertia.get_com() for inertia in inertias]
    X_LE = tool_point.CalcPose(context, parent)
    return ArmModelParams(
        p_PJ=np.transpose([X_PJ.translation() for X_PJ in poses]),
        R_PJ=[X_PJ.rotation().matrix() for X_PJ in poses],
        mass=[inertia.get_mass() for inertia in inertias],
        com=np.transpose(coms),
        inertia=[
            inertia.Shift(com).CalcRotationalInertia().CopyToFullMatrix3()
            for inertia, com in zip(inertias, coms, strict=True)
        ],
        p_LE=X_LE.translation(),
        R_LE=X_LE.rotation().matrix(),
        gravity=plant.gravity_field().gravity_vector(),
    )


class PandaModel:
    """The controller's model of the Panda: terms from (q, v), and IK.

    It owns a plant, made from the arm's URDF, and a scratch context. The
    plant gives its numbers to an `ArmModel`, which calculates the terms and
    solves the inverse kinematics without Drake. What is returned depends on the
    arguments alone and is newly allocated, so one model may serve several
    systems and a diagram that holds it may be cloned; it is not for use from
    several threads at once.

    Parameters
    ----------
    tool_mass : kg, > 0, of all that is beyond the flange.
    gravity : m/s^2, >= 0, along -z of B.
    """

    def __init__(self, tool_mass: float = TOOL_MASS, gravity: float = 9.81) -> None:
        checked = SceneParams(tool_mass=tool_mass, gravity=gravity)
        self._tool_mass = checked.tool_mass
        # Time step 0: the model has no solver of its own to set up.
        plant: Any = MultibodyPlant(0.0)
        self._plant = plant
        plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -checked.gravity])
        _add_arm(plant, checked.tool_mass)
        plant.Finalize()
        self._tool_point = plant.GetFrameByName("tool_point")
        self._context = plant.CreateDefaultContext()
        self._arm = ArmModel(_arm_model_params(plant, self._tool_point))

    @property
    def arm_params(self) -> ArmModelParams:
        """The arm's numbers, as `ArmModel` takes them."""
        return self._arm.params

    @property
    def tool_mass(self) -> float:
        """Mass beyond the flange, kg."""
        return self._tool_mass

    def calc(self, q: ArrayLike, v: ArrayLike) -> PandaTerms:
        """Returns the model terms at joint positions and velocities.

        One native call, meant for every control period.

        Parameters
        ----------
        q : (7,) rad.
        v : (7,) rad/s.
        """
        return PandaTerms(*self._arm.calc(q, v))

    def forward_kinematics(self, q: ArrayLike) -> RigidTransform:
        """Returns X_BE at joint positions q, (7,) rad."""
        self._plant.SetPositions(self._context, np.asarray(q, dtype=np.float64))
        X_BE: RigidTransform = self._tool_point.CalcPoseInWorld(self._context)
        return X_BE

    def inverse_kinematics(
        self,
        p_BE: ArrayLike,
        R_BE: ArrayLike = R_BE_DOWN,
        q_near: ArrayLike = Q_REST,
    ) -> Vector:
        """Returns the joint positions that reach a pose, nearest to a posture.

        Parameters
        ----------
        p_BE : (3,) m, tool point in B.
        R_BE : (3, 3), orientation of E in B.
        q_near : (7,) rad, the posture to stay close to, and the first guess.

        Returns
        -------
        (7,) rad, within the joint limits; the same bits on every processor.

        Raises
        ------
        ValueError
            If no such posture was found.
        """
        position = np.asarray(p_BE, dtype=np.float64)
        q = self._arm.find_posture(position, R_BE, q_near, JOINT_LOWER, JOINT_UPPER)
        if q is None:
            raise ValueError(
                f"inverse_kinematics: no posture reaches p_BE = {position.tolist()}"
            )
        return q
