// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/station/panda.h"

#include <algorithm>
#include <exception>
#include <filesystem>
#include <memory>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <drake/geometry/proximity_properties.h>
#include <drake/multibody/parsing/parser.h>
#include <drake/multibody/parsing/process_model_directives.h>
#include <drake/multibody/tree/fixed_offset_frame.h>
#include <drake/multibody/tree/revolute_joint.h>
#include <drake/multibody/tree/weld_joint.h>

#include "dual_proxy/common/arm_limits.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/control/inverse_kinematics.h"
#include "dual_proxy/experiment/drake_scene.h"
#include "dual_proxy/experiment/scenario_error.h"
#include "dual_proxy/faces/block_system.h"

namespace dual_proxy {

// The text of robots/panda/panda.urdf, the arm up to its flange; defined in
// panda_urdf.cc, which the build makes.
const char* PandaUrdf();

namespace {

using drake::geometry::Box;
using drake::geometry::Capsule;
using drake::geometry::Cylinder;
using drake::geometry::Ellipsoid;
using drake::geometry::GeometryId;
using drake::geometry::HalfSpace;
using drake::geometry::ProximityProperties;
using drake::geometry::SceneGraphInspector;
using drake::geometry::Shape;
using drake::geometry::Sphere;
using drake::math::RigidTransformd;
using drake::multibody::BodyIndex;
using drake::multibody::CoulombFriction;
using drake::multibody::DiscreteContactApproximation;
using drake::multibody::FixedOffsetFrame;
using drake::multibody::Frame;
using drake::multibody::ModelInstanceIndex;
using drake::multibody::MultibodyPlant;
using drake::multibody::RevoluteJoint;
using drake::multibody::RigidBody;
using drake::multibody::RotationalInertia;
using drake::multibody::SpatialInertia;
using drake::multibody::WeldJoint;
using drake::multibody::parsing::LoadModelDirectives;
using drake::multibody::parsing::ProcessModelDirectives;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr int kNumJoints = 7;

DiscreteContactApproximation ToDrake(ContactApproximation approximation) {
  switch (approximation) {
    case ContactApproximation::kLagged:
      return DiscreteContactApproximation::kLagged;
    case ContactApproximation::kSimilar:
      return DiscreteContactApproximation::kSimilar;
    case ContactApproximation::kSap:
      return DiscreteContactApproximation::kSap;
  }
  throw std::invalid_argument(
      "SceneParams: field `contact_approximation` is none of its enum");
}

// Adds the arm, standing on the world, with sensor and tool. Its visuals come
// along if the plant is registered with a scene graph.
ModelInstanceIndex AddArm(MultibodyPlant<double>* plant, double tool_mass) {
  const ModelInstanceIndex arm = drake::multibody::Parser(plant)
                                     .AddModelsFromString(PandaUrdf(), "urdf")
                                     .at(0);
  const Vector3d moments = kToolMoments * (tool_mass / kToolMass);
  const Frame<double>& tool =
      plant
          ->AddRigidBody("tool", arm,
                         SpatialInertia<double>::MakeFromCentralInertia(
                             tool_mass, kToolCom,
                             RotationalInertia<double>(moments(0), moments(1),
                                                       moments(2))))
          .body_frame();
  const Frame<double>& flange =
      plant->AddFrame(std::make_unique<FixedOffsetFrame<double>>(
          "flange", plant->GetFrameByName("panda_link7", arm),
          RigidTransformd(kPandaFlange)));
  plant->AddJoint(std::make_unique<WeldJoint<double>>(
      "ft_sensor", flange, tool, RigidTransformd::Identity()));
  plant->AddFrame(std::make_unique<FixedOffsetFrame<double>>(
      "tool_point", tool, RigidTransformd(kSensorToToolPoint)));
  plant->WeldFrames(plant->world_frame(),
                    plant->GetFrameByName("panda_link0", arm));
  return arm;
}

// A ball of the tool, which touches.
struct TouchingBall {
  std::string name;
  double radius{0};  // m.
  Vector3d p_SBall;  // Its centre, m, in S.
};

std::vector<TouchingBall> MakeTouchingBalls(const SceneParams& params) {
  if (params.tool == Tool::kSphere) {
    return {{"tip", kTipRadius, kSensorToToolPoint}};
  }
  std::vector<TouchingBall> balls;
  for (const Vector3d& p_ECorner : params.Corners()) {
    balls.push_back({"corner" + std::to_string(balls.size()), kCornerRadius,
                     kSensorToToolPoint + p_ECorner});
  }
  return balls;
}

// The shapes stand along z of S.
void DrawTool(MultibodyPlant<double>* plant, const RigidBody<double>& tool,
              const SceneParams& params) {
  const Vector4d dark(0.16, 0.17, 0.19, 1);
  const Vector4d steel(0.66, 0.69, 0.73, 1);
  const auto draw = [&](const std::string& name, const Shape& shape,
                        const Vector3d& p_SShape, const Vector4d& color) {
    plant->RegisterVisualGeometry(tool, RigidTransformd(p_SShape), shape, name,
                                  color);
  };
  draw("sensor", Cylinder(0.0375, 0.03), {0, 0, 0.015}, dark);
  draw("collar", Cylinder(0.03, 0.008), {0, 0, 0.034}, steel);
  draw("shaft", Cylinder(0.006, 0.062), {0, 0, 0.069}, steel);
  for (const TouchingBall& ball : MakeTouchingBalls(params)) {
    draw(ball.name, Sphere(ball.radius), ball.p_SBall, dark);
  }
  if (params.tool == Tool::kFlat) {
    const double edge = params.tool_size + 2 * kCornerRadius;
    draw("pad", Box(edge, edge, kCornerRadius),
         kSensorToToolPoint - kCornerRadius * Vector3d::UnitZ(), steel);
  }
}

ProximityProperties MakeProximityProperties(const DrakeMaterial& material) {
  ProximityProperties properties;
  drake::geometry::AddContactMaterial(
      material.dissipation, material.stiffness,
      CoulombFriction<double>(material.friction, material.friction),
      &properties);
  properties.AddProperty("material", "relaxation_time",
                         material.relaxation_time);
  return properties;
}

std::unique_ptr<Shape> MakeShape(const DrakeSurface& surface) {
  switch (surface.shape) {
    case SurfaceShape::kBox:
      return std::make_unique<Box>(surface.size);
    case SurfaceShape::kSphere:
      return std::make_unique<Sphere>(surface.radius);
    case SurfaceShape::kCylinder:
      return std::make_unique<Cylinder>(surface.radius, surface.length);
    case SurfaceShape::kCapsule:
      return std::make_unique<Capsule>(surface.radius, surface.length);
    default:
      return std::make_unique<HalfSpace>();
  }
}

// Adds the models of a file of directives, if there is one.
void AddModels(const std::string& path, MultibodyPlant<double>* plant) {
  if (path.empty()) return;
  drake::multibody::Parser parser(plant);
  const auto package =
      std::filesystem::path(path).parent_path() / "package.xml";
  try {
    if (std::filesystem::exists(package)) {
      parser.package_map().AddPackageXml(package);
    }
    ProcessModelDirectives(LoadModelDirectives(path), &parser);
  } catch (const std::exception& error) {
    std::string text = error.what();
    std::replace(text.begin(), text.end(), '\n', ' ');
    throw ScenarioError("scene.model_directives: " + path + ": " + text);
  }
}

// Throws for a geometry whose contacts would be wrong.
void CheckModels(const MultibodyPlant<double>& plant,
                 const SceneGraphInspector<double>& inspector) {
  for (const GeometryId id :
       inspector.GetAllGeometryIds(drake::geometry::Role::kProximity)) {
    if (dynamic_cast<const Ellipsoid*>(&inspector.GetShape(id)) == nullptr) {
      continue;
    }
    const RigidBody<double>& body =
        *plant.GetBodyFromFrameId(inspector.GetFrameId(id));
    throw ScenarioError(
        "scene.model_directives: " +
        EllipsoidProblem(inspector.GetName(id), body.name(),
                         plant.GetModelInstanceName(body.model_instance())));
  }
}

// Reads the numbers of a finalized plant that has no more than the arm.
ArmModelParams<7> CalcArmModelParams(const MultibodyPlant<double>& plant) {
  const auto context = plant.CreateDefaultContext();
  plant.SetPositions(context.get(), Vector7::Zero());
  ArmModelParams<7> params;
  const Frame<double>* parent = &plant.world_frame();
  for (int i = 0; i < kNumJoints; ++i) {
    const auto& joint = plant.GetJointByName<RevoluteJoint>(
        "panda_joint" + std::to_string(i + 1));
    DRAKE_DEMAND(joint.position_start() == i);
    DRAKE_DEMAND(joint.revolute_axis() == Vector3d::UnitZ());
    const Frame<double>& frame = joint.frame_on_child();
    // A link is what its joint moves and all that is welded to it.
    std::vector<BodyIndex> link;
    for (const auto* body : plant.GetBodiesWeldedTo(joint.child_body())) {
      link.push_back(body->index());
    }
    const RigidTransformd X_PJ = frame.CalcPose(*context, *parent);
    const SpatialInertia<double> inertia =
        plant.CalcSpatialInertia(*context, frame, link);
    const Vector3d com = inertia.get_com();
    params.p_PJ.col(i) = X_PJ.translation();
    params.R_PJ[i] = X_PJ.rotation().matrix();
    params.mass(i) = inertia.get_mass();
    params.com.col(i) = com;
    params.inertia[i] =
        inertia.Shift(com).CalcRotationalInertia().CopyToFullMatrix3();
    parent = &frame;
  }
  const RigidTransformd X_LE =
      plant.GetFrameByName("tool_point").CalcPose(*context, *parent);
  params.p_LE = X_LE.translation();
  params.R_LE = X_LE.rotation().matrix();
  params.gravity = plant.gravity_field().gravity_vector();
  return params;
}

}  // namespace

PandaScene AddPandaScene(drake::systems::DiagramBuilder<double>* builder,
                         const SceneParams& params, const Vector7& q_start,
                         bool drawn) {
  params.Validate();
  ThrowUnlessIn("AddPandaScene", "q_start", q_start, Finite());
  auto owned = std::make_unique<MultibodyPlant<double>>(params.time_step);
  MultibodyPlant<double>* plant = owned.get();
  plant->set_name("panda");
  plant->set_contact_model(drake::multibody::ContactModel::kPoint);
  plant->set_discrete_contact_approximation(
      ToDrake(params.contact_approximation));
  plant->SetUseSampledOutputPorts(true);
  plant->mutable_gravity_field().set_gravity_vector({0, 0, -params.gravity});

  PandaScene scene;
  scene.plant = plant;
  scene.params = params;
  // Without a scene graph, the plant takes no visuals from the URDF.
  if (!drawn) scene.arm = AddArm(plant, params.tool_mass);
  scene.scene_graph =
      &drake::multibody::AddMultibodyPlantSceneGraph(builder, std::move(owned))
           .scene_graph;
  if (drawn) scene.arm = AddArm(plant, params.tool_mass);

  const RigidBody<double>& tool = plant->GetBodyByName("tool", scene.arm);
  if (drawn) DrawTool(plant, tool, params);
  const std::vector<TouchingBall> balls = MakeTouchingBalls(params);
  const DrakeScene touching = MakeDrakeScene(params);
  const ProximityProperties ball_properties =
      MakeProximityProperties(touching.ball);
  for (const TouchingBall& ball : balls) {
    plant->RegisterCollisionGeometry(tool, RigidTransformd(ball.p_SBall),
                                     Sphere(ball.radius), ball.name,
                                     ball_properties);
  }
  const RigidBody<double>& world = plant->world_body();
  for (const DrakeSurface& surface : touching.surfaces) {
    plant->RegisterCollisionGeometry(world, ToRigidTransform(surface.X_BG),
                                     *MakeShape(surface), surface.name,
                                     MakeProximityProperties(surface.material));
  }
  if (drawn) {
    for (const DrakeSurface& surface : MakePicture(params)) {
      plant->RegisterVisualGeometry(world, ToRigidTransform(surface.X_BG),
                                    *MakeShape(surface), surface.name,
                                    surface.color);
    }
  }
  AddModels(params.model_directives, plant);
  plant->Finalize();
  CheckModels(*plant, scene.scene_graph->model_inspector());
  plant->SetDefaultPositions(scene.arm, q_start);
  scene.tool_body = tool.index();
  scene.sensor_joint = plant->GetJointByName("ft_sensor", scene.arm).index();
  return scene;
}

PandaModel::PandaModel(double tool_mass, double gravity) {
  SceneParams checked;
  checked.tool_mass = tool_mass;
  checked.gravity = gravity;
  checked.Validate();
  // Time step 0: there is no solver of the plant's own to set up.
  MultibodyPlant<double> plant(0.0);
  plant.mutable_gravity_field().set_gravity_vector({0, 0, -gravity});
  AddArm(&plant, tool_mass);
  plant.Finalize();
  arm_params_ = CalcArmModelParams(plant);
}

Vector7 PandaModel::SolveInverseKinematics(const Vector3d& p_BE,
                                           const Matrix3d& R_BE,
                                           const Vector7& q_near) const {
  constexpr const char* kWho = "SolveInverseKinematics";
  ThrowUnlessIn(kWho, "p_BE", p_BE, Finite());
  ThrowUnlessIn(kWho, "R_BE", R_BE, Rotation());
  ThrowUnlessIn(kWho, "q_near", q_near, Finite());
  const ArmLimits<7> limits;
  const std::optional<Vector7> q =
      FindPosture<7>(ArmModel<7>(arm_params_), {.p = p_BE, .R = R_BE}, q_near,
                     limits.joint_lower, limits.joint_upper);
  if (!q) {
    const Eigen::IOFormat one_line(6, Eigen::DontAlignCols, ", ", ", ");
    std::ostringstream message;
    message << kWho << ": no posture reaches p_BE = ["
            << p_BE.transpose().format(one_line) << "]";
    throw std::invalid_argument(message.str());
  }
  return *q;
}

}  // namespace dual_proxy
