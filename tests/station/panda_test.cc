// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/station/panda.h"
#include "dual_proxy/faces/systems.h"

#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <drake/multibody/math/spatial_algebra.h>
#include <drake/systems/analysis/simulator.h>
#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "dual_proxy/common/arm_limits.h"
#include "dual_proxy/common/random.h"
#include "dual_proxy/station/contact_truth_system.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using drake::geometry::Role;
using drake::multibody::BodyIndex;
using drake::multibody::ContactResults;
using drake::multibody::JointActuatorIndex;
using drake::multibody::JointIndex;
using drake::multibody::MultibodyPlant;
using drake::multibody::PointPairContactInfo;
using drake::multibody::SpatialForce;
using drake::systems::Context;
using drake::systems::Diagram;
using drake::systems::DiagramBuilder;
using drake::systems::PortDataType;
using drake::systems::Simulator;
using drake::systems::System;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Vector10 = Eigen::Matrix<double, 10, 1>;
using Vector14 = Eigen::Matrix<double, 14, 1>;

const double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kGravity = 9.81;
const ArmLimits<7> kLimits;

Vector7 RandomBetween(const Vector7& low, const Vector7& high,
                      RandomStream* random) {
  Vector7 result;
  for (int i = 0; i < 7; ++i) {
    result(i) = low(i) + (high(i) - low(i)) * random->Uniform();
  }
  return result;
}

// A simulated arm with what reads its contacts.
class Bench {
 public:
  Bench(const SceneParams& params, const Vector7& q_start, bool drawn = false)
      : model_(PandaModel(params.tool_mass, params.gravity).arm_params()) {
    DiagramBuilder<double> builder;
    scene_ = AddPandaScene(&builder, params, q_start, drawn);
    reaction_ = builder.AddSystem<SensorReactionSystem>(scene_.sensor_joint);
    truth_ = builder.AddSystem<ContactTruthSystem>(scene_.tool_body);
    builder.Connect(scene_.get_reaction_forces_output_port(),
                    reaction_->GetInputPort("reaction_forces"));
    builder.Connect(scene_.get_contact_results_output_port(),
                    truth_->get_contact_results_input_port());
    builder.ExportInput(scene_.get_actuation_input_port(), "torque");
    diagram_ = builder.Build();
    simulator_ = std::make_unique<Simulator<double>>(*diagram_);
    SetTorque(Vector7::Zero());
  }

  void SetTorque(const Vector7& torque) {
    diagram_->get_input_port().FixValue(&simulator_->get_mutable_context(),
                                        torque);
  }

  void AdvanceTo(double time) { simulator_->AdvanceTo(time); }

  // Pulls the tool point towards `target(time)`, pointing down.
  void Pull(double duration, const std::function<Vector3d(double)>& target) {
    const int num_steps =
        static_cast<int>(std::lround(duration / scene_.params.time_step));
    for (int k = 0; k < num_steps; ++k) {
      Update();
      const double time = simulator_->get_context().get_time();
      const Matrix3d S = kToolPointingDown * X_BE.R.transpose();
      const Vector3d turn = 0.5 * Vector3d(S(2, 1) - S(1, 2), S(0, 2) - S(2, 0),
                                           S(1, 0) - S(0, 1));
      const Vector6 twist = terms_.J_BE * v_;
      Vector6 pull;
      pull << 1000 * (target(time) - X_BE.p) - 80 * twist.head<3>(),
          50 * turn - 3 * twist.tail<3>();
      SetTorque(terms_.J_BE.transpose() * pull - 0.5 * v_ + terms_.bias -
                terms_.gravity);
      AdvanceTo(time + scene_.params.time_step);
    }
    Update();
  }

  Vector14 state() const { return Eval(scene_.get_state_output_port()); }
  Vector6 reaction() const { return Eval(reaction_->get_output_port()); }
  Eigen::Matrix<double, 7, 1> truth() const {
    return Eval(truth_->get_output_port()).head<7>();
  }
  int num_contacts() const {
    const auto& port = scene_.get_contact_results_output_port();
    return port
        .Eval<ContactResults<double>>(
            port.get_system().GetMyContextFromRoot(simulator_->get_context()))
        .num_point_pair_contacts();
  }
  const PandaScene& scene() const { return scene_; }

  Pose X_BE;  // Of the end of the last Pull().

 private:
  VectorXd Eval(const drake::systems::OutputPort<double>& port) const {
    return port.Eval(
        port.get_system().GetMyContextFromRoot(simulator_->get_context()));
  }

  void Update() {
    const Vector14 x = state();
    v_ = x.tail<7>();
    model_.Calc(x.head<7>(), v_, &X_BE, &terms_);
  }

  ArmModel<7> model_;
  PandaScene scene_;
  const SensorReactionSystem* reaction_{};
  const ContactTruthSystem* truth_{};
  std::unique_ptr<Diagram<double>> diagram_;
  std::unique_ptr<Simulator<double>> simulator_;
  Vector7 v_;
  ModelTerms<7> terms_;
};

SurfaceParams MakeBox(const char* name, const Vector3d& center,
                      const Vector3d& size) {
  return {.name = name,
          .shape = SurfaceShape::kBox,
          .position = center,
          .size = size};
}

std::string SceneError(const SceneParams& params,
                       const Vector7& q_start = kPandaQRest) {
  return InvalidArgument([&] {
    DiagramBuilder<double> builder;
    AddPandaScene(&builder, params, q_start, false);
  });
}

bool Contains(const std::string& text, const char* part) {
  return text.find(part) != std::string::npos;
}

// --- The model ---------------------------------------------------------------

TEST(PandaModelTest, TermsEqualThePlants) {
  for (const double tool_mass : {kToolMass, 2.3}) {
    SceneParams params;
    params.tool_mass = tool_mass;
    DiagramBuilder<double> builder;
    const MultibodyPlant<double>& plant =
        *AddPandaScene(&builder, params, kPandaQRest, false).plant;
    const ArmModel<7> dut(PandaModel(tool_mass).arm_params());
    const auto context = plant.CreateDefaultContext();
    const auto& world = plant.world_frame();
    const auto& tool_point = plant.GetFrameByName("tool_point");
    // Drake's order is [angular; linear].
    const auto swap = [](const auto& rows) {
      auto result = rows.eval();
      result.topRows(3) = rows.bottomRows(3);
      result.bottomRows(3) = rows.topRows(3);
      return result;
    };
    RandomStream random(11);
    for (int k = 0; k < 200; ++k) {
      const Vector7 q =
          RandomBetween(kLimits.joint_lower, kLimits.joint_upper, &random);
      const Vector7 v =
          RandomBetween(-kLimits.joint_speed, kLimits.joint_speed, &random);
      plant.SetPositions(context.get(), q);
      plant.SetVelocities(context.get(), v);
      Pose X_BE;
      ModelTerms<7> terms;
      dut.Calc(q, v, &X_BE, &terms);

      // Relative to the value's size.
      const auto expect_near = [](const auto& value, const auto& expected,
                                  const char* name) {
        EXPECT_LT((value - expected).norm(), 1e-10 * expected.norm()) << name;
      };
      const auto X = tool_point.CalcPoseInWorld(*context);
      expect_near(X_BE.p, X.translation(), "p_BE");
      expect_near(X_BE.R, X.rotation().matrix(), "R_BE");
      Matrix67 J;
      plant.CalcJacobianSpatialVelocity(
          *context, drake::multibody::JacobianWrtVariable::kV, tool_point,
          Vector3d::Zero(), world, world, &J);
      expect_near(terms.J_BE, swap(J), "J_BE");
      const Vector6 acceleration =
          plant
              .CalcBiasSpatialAcceleration(
                  *context, drake::multibody::JacobianWrtVariable::kV,
                  tool_point, Vector3d::Zero(), world, world)
              .get_coeffs();
      expect_near(terms.Jdot_v, swap(acceleration), "Jdot_v");
      Matrix7 mass;
      plant.CalcMassMatrix(*context, &mass);
      expect_near(terms.mass, mass, "mass");
      VectorXd bias(7);
      plant.CalcBiasTerm(*context, &bias);
      expect_near(terms.bias, bias, "bias");
      expect_near(terms.gravity, plant.CalcGravityGeneralizedForces(*context),
                  "gravity");
    }
  }
}

TEST(PandaModelTest, ToolMassAndGravityReachTheModel) {
  const ArmModelParams<7> normal = PandaModel().arm_params();
  const ArmModelParams<7> heavy = PandaModel(kToolMass + 1, 0).arm_params();
  EXPECT_EQ(normal.gravity, Vector3d(0, 0, -kGravity));
  EXPECT_EQ(heavy.gravity, Vector3d::Zero());
  EXPECT_EQ(heavy.mass.head<6>(), normal.mass.head<6>());
  EXPECT_NEAR(heavy.mass(6), normal.mass(6) + 1, 1e-14);
  // The kilogram is at the tool's centre of mass, 0.107 m from panda_link7.
  const Vector3d p_JCom = Vector3d(0, 0, 0.107) + kToolCom;
  EXPECT_LT((heavy.mass(6) * heavy.com.col(6) -
             normal.mass(6) * normal.com.col(6) - p_JCom)
                .norm(),
            1e-14);
}

TEST(PandaModelTest, RefusesWhatIsOutOfRange) {
  const auto error = [](double tool_mass, double gravity) {
    return InvalidArgument([&] { PandaModel(tool_mass, gravity); });
  };
  for (const double bad : {-1.0, kNan, 1e9}) {
    EXPECT_TRUE(Contains(error(bad, kGravity), "`tool_mass`"));
    EXPECT_TRUE(Contains(error(kToolMass, bad), "`gravity`"));
  }
}

// --- Inverse kinematics ------------------------------------------------------

class PandaInverseKinematicsTest : public ::testing::Test {
 protected:
  Pose CalcPose(const Vector7& q) const {
    Pose X_BE;
    ModelTerms<7> terms;
    ArmModel<7>(dut_.arm_params()).Calc(q, Vector7::Zero(), &X_BE, &terms);
    return X_BE;
  }

  const PandaModel dut_;
};

TEST_F(PandaInverseKinematicsTest, EqualsPydrakes) {
  // What dual_proxy.panda.PandaModel().inverse_kinematics(p_BE) prints.
  const std::pair<Vector3d, Vector7> cases[] = {
      {{0.45, 0, 0.18},
       Vector7{{0.0, -0.0338630949407355, 0.0, -2.5555180459184426, 0.0,
                2.521654950977707, 0.0}}},
      {{0.592, 0.154, 0.259},
       Vector7{{0.17332678227531084, 0.26158722832982756, 0.08674239640537118,
                -1.9164835880197402, -0.027264952596659897, 2.1769572666596626,
                0.27266819834603745}}},
      {{0.436, -0.223, 0.221},
       Vector7{{-0.23255323328848848, -0.015155648164457455,
                -0.24023817457786126, -2.398406618747071, -0.00524568338833937,
                2.3836792878618174, -0.46895505774144775}}}};
  for (const auto& [p_BE, expected] : cases) {
    EXPECT_LT((dut_.SolveInverseKinematics(p_BE) - expected).norm(), 1e-12);
  }
}

TEST_F(PandaInverseKinematicsTest, ReachesPosesOverTheTable) {
  RandomStream random(3);
  for (int k = 0; k < 20; ++k) {
    const Vector3d p_BE(0.35 + 0.3 * random.Uniform(),
                        -0.25 + 0.5 * random.Uniform(),
                        0.11 + 0.29 * random.Uniform());
    const Vector7 q = dut_.SolveInverseKinematics(p_BE);
    const Pose X_BE = CalcPose(q);
    EXPECT_LT((X_BE.p - p_BE).norm(), 1e-8);
    EXPECT_LT((X_BE.R - kToolPointingDown).norm(), 1e-8);
    EXPECT_TRUE((q.array() >= kLimits.joint_lower.array()).all());
    EXPECT_TRUE((q.array() <= kLimits.joint_upper.array()).all());
  }
}

TEST_F(PandaInverseKinematicsTest, TheRestPostureIsItsOwnSolution) {
  const Pose X_BE = CalcPose(kPandaQRest);
  EXPECT_LT((X_BE.p - Vector3d(0.45, 0, 0.18)).norm(), 1e-4);
  EXPECT_LT((X_BE.R - kToolPointingDown).norm(), 1e-9);
  EXPECT_LT(
      (dut_.SolveInverseKinematics(X_BE.p, X_BE.R, kPandaQRest) - kPandaQRest)
          .norm(),
      1e-6);
  const Vector7 margin = (kPandaQRest - kLimits.joint_lower)
                             .cwiseMin(kLimits.joint_upper - kPandaQRest);
  EXPECT_GT(margin.minCoeff(), 0.5);
}

TEST_F(PandaInverseKinematicsTest, TakesARotationAsPreciseAsPeopleWriteIt) {
  const double half = 0.70710678;
  Matrix3d R_BE;  // About a vertical axis by 45 deg, pointing down.
  R_BE << half, half, 0, half, -half, 0, 0, 0, -1;
  const Vector7 q =
      dut_.SolveInverseKinematics(Vector3d(0.45, 0, 0.18), R_BE, kPandaQRest);
  EXPECT_LT((CalcPose(q).R - R_BE).norm(), 2e-4);
}

TEST_F(PandaInverseKinematicsTest, SaysWhatIsWrong) {
  const Vector3d p(0.45, 0, 0.18);
  const auto error = [this](const Vector3d& p_BE, const Matrix3d& R_BE,
                            const Vector7& q_near) {
    return InvalidArgument(
        [&] { dut_.SolveInverseKinematics(p_BE, R_BE, q_near); });
  };
  EXPECT_EQ(error({2, 0, 0.2}, kToolPointingDown, kPandaQRest),
            "SolveInverseKinematics: no posture reaches p_BE = [2, 0, "
            "0.2]");
  EXPECT_TRUE(Contains(error({0.4, kNan, 0}, kToolPointingDown, kPandaQRest),
                       "`p_BE`"));
  EXPECT_TRUE(Contains(error(p, Matrix3d::Zero(), kPandaQRest), "`R_BE`"));
  EXPECT_TRUE(Contains(error(p, kToolPointingDown, Vector7::Constant(kNan)),
                       "`q_near`"));
}

// --- The scene ---------------------------------------------------------------

TEST(PandaSceneTest, Limits) {
  DiagramBuilder<double> builder;
  const PandaScene scene =
      AddPandaScene(&builder, SceneParams{}, kPandaQRest, false);
  const MultibodyPlant<double>& plant = *scene.plant;
  EXPECT_EQ(plant.GetPositionLowerLimits(), kLimits.joint_lower);
  EXPECT_EQ(plant.GetPositionUpperLimits(), kLimits.joint_upper);
  EXPECT_EQ(plant.GetVelocityLowerLimits(), -kLimits.joint_speed);
  EXPECT_EQ(plant.GetVelocityUpperLimits(), kLimits.joint_speed);
  EXPECT_EQ(plant.GetEffortUpperLimits(), kLimits.torque);
  EXPECT_EQ(plant.GetPositions(*plant.CreateDefaultContext()), kPandaQRest);
  EXPECT_EQ(scene.get_actuation_input_port().size(), 7);
  EXPECT_EQ(scene.get_state_output_port().size(), 14);
}

TEST(PandaSceneTest, ThePlantIsAsTheParamsSay) {
  using drake::multibody::DiscreteContactApproximation;
  SceneParams params;
  params.time_step = 0.002;
  params.gravity = 1.5;
  params.tool_mass = 0.7;
  for (const auto& [ours, drakes] :
       {std::pair(ContactApproximation::kLagged,
                  DiscreteContactApproximation::kLagged),
        std::pair(ContactApproximation::kSimilar,
                  DiscreteContactApproximation::kSimilar),
        std::pair(ContactApproximation::kSap,
                  DiscreteContactApproximation::kSap)}) {
    params.contact_approximation = ours;
    DiagramBuilder<double> builder;
    const PandaScene scene =
        AddPandaScene(&builder, params, kPandaQRest, false);
    const MultibodyPlant<double>& plant = *scene.plant;
    EXPECT_EQ(plant.get_discrete_contact_approximation(), drakes);
    EXPECT_EQ(plant.get_contact_model(),
              drake::multibody::ContactModel::kPoint);
    EXPECT_TRUE(plant.has_sampled_output_ports());
    EXPECT_EQ(plant.time_step(), 0.002);
    EXPECT_EQ(plant.gravity_field().gravity_vector(), Vector3d(0, 0, -1.5));
    EXPECT_EQ(plant.get_body(scene.tool_body).default_mass(), 0.7);
    EXPECT_EQ(scene.params.contact_approximation, ours);
  }
}

TEST(PandaSceneTest, WhatIsNotDrawnHasNoVisuals) {
  SceneParams params;
  params.surfaces = {MakeBox("wall", {0.6, 0, 0.2}, {0.1, 0.1, 0.2})};
  for (const bool drawn : {true, false}) {
    DiagramBuilder<double> builder;
    const PandaScene scene =
        AddPandaScene(&builder, params, kPandaQRest, drawn);
    const auto& inspector = scene.scene_graph->model_inspector();
    std::set<std::string> bodies;
    for (const auto& id : inspector.GetAllGeometryIds(Role::kIllustration)) {
      bodies.insert(
          scene.plant->GetBodyFromFrameId(inspector.GetFrameId(id))->name());
    }
    // Eight links, the tool, the world.
    EXPECT_EQ(bodies.size(), drawn ? 10 : 0);
    EXPECT_EQ(inspector.num_frames(), 10);
    // The tip, the table, the wall.
    EXPECT_EQ(inspector.NumGeometriesWithRole(Role::kProximity), 3);
    const auto& tips = scene.plant->GetCollisionGeometriesForBody(
        scene.plant->get_body(scene.tool_body));
    ASSERT_EQ(tips.size(), 1);
    EXPECT_EQ(inspector.GetPoseInFrame(tips[0]).translation(),
              kSensorToToolPoint);
  }
}

TEST(PandaSceneTest, ThePhysicsAreTheSameDrawnOrNot) {
  SceneParams params;
  params.table_height = 0.16;
  Bench drawn(params, kPandaQRest, true);
  Bench not_drawn(params, kPandaQRest, false);
  drawn.AdvanceTo(0.3);
  not_drawn.AdvanceTo(0.3);
  EXPECT_EQ(drawn.truth()(6), 1);
  EXPECT_EQ(drawn.state(), not_drawn.state());
  EXPECT_EQ(drawn.reaction(), not_drawn.reaction());
  EXPECT_EQ(drawn.truth(), not_drawn.truth());
}

// The arm falls without torque, and the tool hits a table 10 mm below it. The
// numbers are what dual_proxy.panda gives.
TEST(PandaSceneTest, ADropOntoTheTableEqualsPydrakes) {
  SceneParams params;
  params.table_height = 0.16;
  params.tool_mass = 0.5;
  Bench dut(params, kPandaQRest);
  EXPECT_EQ(dut.reaction(), Vector6::Zero());
  EXPECT_EQ(dut.truth(), Vector7::Zero());
  dut.AdvanceTo(0.1);
  Vector14 state;
  state << -0.0014995165421098431, -0.020952416339540918, 0.003556380373719975,
      -2.5971237594662657, -0.01672745865564897, 2.6133555732159013,
      0.02775472028604793, -0.0290279308859542, -0.30097471496927336,
      0.07661085158050158, -0.4980688333249668, -0.7382739453121886,
      0.907425575027296, 0.8532331439534903;
  EXPECT_LT((dut.state() - state).norm(), 1e-9);
  const Vector6 reaction{{13.546907977162437, 0.7895287483143725,
                          52.172121248106, -0.09591995464947611,
                          1.504121710305055, 0.0009444243179825441}};
  EXPECT_LT((dut.reaction() - reaction).norm(), 1e-6);
  const Vector7 truth{{15.77146714, -1.47139353, -56.30133323, 0, 0, -1, 1}};
  EXPECT_LT((dut.truth() - truth).norm(), 1e-6);
}

TEST(PandaSceneTest, InTheAirTheSensorTakesTheToolsWeight) {
  SceneParams params;
  params.tool_mass = 0.5;
  const Vector3d p_BE(0.45, 0, 0.18);
  Bench dut(params, PandaModel().SolveInverseKinematics(p_BE));
  dut.Pull(1.5, [&](double) { return p_BE; });
  // The arm holds the tool up; S points down.
  const Vector6 expected{{0, 0, -0.5 * kGravity, 0, 0, 0}};
  EXPECT_LT((dut.reaction() - expected).norm(), 2e-3);
  EXPECT_EQ(dut.truth(), Vector7::Zero());
}

TEST(PandaSceneTest, PressingReadsIntoTheSurface) {
  for (const auto approximation :
       {ContactApproximation::kLagged, ContactApproximation::kSimilar,
        ContactApproximation::kSap}) {
    SceneParams params;
    params.contact_approximation = approximation;
    const Vector3d target(0.45, 0.02, params.contact_height() - 0.008);
    Bench dut(params, PandaModel().SolveInverseKinematics(target));
    dut.Pull(1.5, [&](double) { return target; });
    const Vector7 truth = dut.truth();
    const Vector3d force = truth.head<3>();
    EXPECT_GT(-force.z(), 6);
    EXPECT_LT(-force.z(), 9);
    EXPECT_LT((truth.segment<3>(3) + Vector3d::UnitZ()).norm(), 1e-9);
    EXPECT_EQ(truth(6), 1);
    // The series stiffness of tool and table.
    const double depth = params.contact_height() - dut.X_BE.p.z();
    EXPECT_NEAR(-force.z(), params.contact_stiffness * depth,
                0.02 * params.contact_stiffness * depth);
    // In standstill the arm's force on the tool is the contact force minus the
    // tool's weight.
    const Vector6 reaction = dut.reaction();
    const Vector3d weight(0, 0, -params.tool_mass * kGravity);
    EXPECT_LT((dut.X_BE.R * reaction.head<3>() + weight - force).norm(),
              0.02 * force.norm());
    // Its moment about S: the force acts where the sphere touches.
    const Vector3d p_SC =
        dut.X_BE.R * kSensorToToolPoint - kTipRadius * Vector3d::UnitZ();
    const Vector3d moment =
        dut.X_BE.R * reaction.tail<3>() + (dut.X_BE.R * kToolCom).cross(weight);
    EXPECT_LT((moment - p_SC.cross(force)).norm(), 0.02 * force.norm() * 0.11);
  }
}

// Its corners share the stiffness.
TEST(PandaSceneTest, AFlatToolPressesAsASphereDoes) {
  SceneParams params;
  params.tool = Tool::kFlat;
  const Vector3d target(0.45, 0.02, params.contact_height() - 0.008);
  Bench dut(params, PandaModel().SolveInverseKinematics(target), true);
  dut.Pull(1.5, [&](double) { return target; });
  EXPECT_EQ(dut.num_contacts(), 4);
  const double force = -dut.truth()(2);
  EXPECT_GT(force, 6);
  EXPECT_LT(force, 9);
  EXPECT_EQ(dut.truth()(6), 1);
  const double depth = params.contact_height() - dut.X_BE.p.z();
  EXPECT_NEAR(force, params.contact_stiffness * depth, 0.02 * force);
}

TEST(PandaSceneTest, AnEdgeHasTwoNormals) {
  SceneParams params;
  params.surfaces = {MakeBox("wall", {0.6, 0, 0.2}, {0.1, 0.4, 0.2})};
  params.friction = 0;
  const auto target = [](double time) {
    const double share = std::min(time / 0.6, 1.0);
    return Vector3d(0.51 + 0.036 * share, 0, 0.14 - 0.036 * share);
  };
  Bench dut(params, PandaModel().SolveInverseKinematics(target(0)));
  dut.Pull(1.5, target);
  const Vector7 truth = dut.truth();
  const Vector3d force = truth.head<3>();
  EXPECT_EQ(truth(6), 2);
  EXPECT_GT(force.x(), 3);
  EXPECT_LT(force.z(), -3);
  // Without friction the normal forces' sum is all there is.
  EXPECT_LT((truth.segment<3>(3) - force.normalized()).norm(), 1e-9);
}

TEST(PandaSceneTest, TwoBoxesOfOneHeightAreOneNormal) {
  SceneParams params;
  params.surfaces = {MakeBox("step", {0.5, 0, 0.05}, {0.2, 0.2, 0.1})};
  const Vector3d target(0.45, 0, 0.102);
  Bench dut(params, PandaModel().SolveInverseKinematics(target));
  dut.Pull(1, [&](double) { return target; });
  EXPECT_EQ(dut.num_contacts(), 2);
  const Vector7 truth = dut.truth();
  EXPECT_EQ(truth(6), 1);
  EXPECT_LT((truth.segment<3>(3) + Vector3d::UnitZ()).norm(), 1e-9);
  const Vector3d weight(0, 0, -kToolMass * kGravity);
  EXPECT_LT(
      (dut.X_BE.R * dut.reaction().head<3>() + weight - truth.head<3>()).norm(),
      0.02 * truth.head<3>().norm());
}

TEST(PandaSceneTest, ABoxIsTurnedByItsRotation) {
  // A beam along y, turned by 90 deg, lies under the tool.
  SceneParams params;
  params.surfaces = {MakeBox("beam", {0.6, 0, 0.13}, {0.02, 0.6, 0.06})};
  for (const double yaw : {0.0, M_PI / 2}) {
    params.surfaces[0].rotation.z() = yaw;
    const Vector3d target(0.45, 0, 0.16);
    Bench dut(params, PandaModel().SolveInverseKinematics(target));
    dut.Pull(0.2, [&](double) { return target; });
    EXPECT_EQ(dut.truth()(6), yaw == 0 ? 0 : 1);
  }
}

TEST(PandaSceneTest, RefusesBadParams) {
  EXPECT_EQ(SceneError({}), "no exception");
  const auto error = [](auto&& change) {
    SceneParams params;
    change(&params);
    return SceneError(params);
  };
  using P = SceneParams;
  EXPECT_TRUE(Contains(error([](P* p) { p->friction = -0.1; }), "`friction`"));
  EXPECT_TRUE(Contains(error([](P* p) { p->time_step = 0; }), "`time_step`"));
  EXPECT_TRUE(
      Contains(error([](P* p) { p->tool_mass = kNan; }), "`tool_mass`"));
  EXPECT_TRUE(Contains(error([](P* p) { p->gravity = -9.81; }), "`gravity`"));
  EXPECT_TRUE(Contains(error([](P* p) {
                         p->surfaces = {MakeBox("table", {0, 0, 0}, {1, 1, 1})};
                       }),
                       "`surfaces`"));
  EXPECT_TRUE(Contains(error([](P* p) {
                         p->contact_approximation =
                             static_cast<ContactApproximation>(7);
                       }),
                       "`contact_approximation`"));
  EXPECT_TRUE(Contains(SceneError({}, Vector7::Constant(kNan)), "`q_start`"));
}

// --- The systems that read the simulator -------------------------------------

// Names and sizes of all ports; -1 for abstract ones.
std::string Ports(const System<double>& system) {
  std::string result;
  const auto add = [&](const auto& port) {
    const bool is_vector = port.get_data_type() == PortDataType::kVectorValued;
    result += " " + port.get_name() + " " +
              std::to_string(is_vector ? port.size() : -1);
  };
  for (int i = 0; i < system.num_input_ports(); ++i) {
    add(system.get_input_port(i));
  }
  result += " ->";
  for (int i = 0; i < system.num_output_ports(); ++i) {
    add(system.get_output_port(i));
  }
  return result;
}

// Evaluates the output anew and expects that nothing is allocated.
VectorXd EvalWithoutAllocation(const System<double>& system,
                               const Context<double>& context) {
  const auto& port = system.get_output_port();
  port.Eval(context);
  context.SetAllCacheEntriesOutOfDate();
  const ScopedNoAlloc guard;
  const VectorXd& value = port.Eval(context);
  EXPECT_EQ(guard.count(), 0);
  return value;
}

TEST(SensorReactionSystemTest, GivesTheJointsForce) {
  const SensorReactionSystem dut{JointIndex(2)};
  EXPECT_EQ(Ports(dut), " reaction_forces -1 -> reaction 6");
  EXPECT_TRUE(dut.HasAnyDirectFeedthrough());
  std::vector<SpatialForce<double>> forces(4, SpatialForce<double>::Zero());
  forces[2] = SpatialForce<double>(Vector3d(4, 5, 6), Vector3d(1, 2, 3));
  const auto context = dut.CreateDefaultContext();
  dut.get_input_port().FixValue(context.get(), forces);
  EXPECT_EQ(dut.get_output_port().Eval(*context), Vector6::Zero())
      << "before the plant's first step";
  context->SetTime(0.001);
  EXPECT_EQ(EvalWithoutAllocation(dut, *context),
            (Vector6{{1, 2, 3, 4, 5, 6}}));
}

class ContactTruthSystemTest : public ::testing::Test {
 protected:
  // What the tool pushes with on something else, in Drake's terms. `normal`
  // points into the other.
  void AddContact(const Vector3d& force, const Vector3d& normal,
                  bool tool_is_body_A = false) {
    AddContactOf(tool_is_body_A ? kTool : kWorld,
                 tool_is_body_A ? kWorld : kTool,
                 tool_is_body_A ? force : Vector3d(-force),
                 tool_is_body_A ? Vector3d(-normal) : normal);
  }

  void AddContactOf(BodyIndex A, BodyIndex B, const Vector3d& f_B,
                    const Vector3d& nhat_BA,
                    const Vector3d& p_WC = Vector3d::Zero()) {
    drake::geometry::PenetrationAsPointPair<double> pair;
    pair.nhat_BA_W = nhat_BA;
    contacts_.emplace_back(A, B, f_B, p_WC, 0, 0, pair);
  }

  Vector10 Truth() {
    auto contacts = contacts_;
    context_ = dut_.CreateDefaultContext();
    dut_.get_contact_results_input_port().FixValue(
        context_.get(), ContactResults<double>(std::move(contacts)));
    return EvalWithoutAllocation(dut_, *context_);
  }

  const BodyIndex kWorld{0};
  const BodyIndex kOther{4};
  const BodyIndex kTool{9};
  ContactTruthSystem dut_{kTool};
  std::unique_ptr<Context<double>> context_;
  std::vector<PointPairContactInfo<double>> contacts_;
};

TEST_F(ContactTruthSystemTest, Ports) {
  EXPECT_EQ(Ports(dut_), " contact_results -1 -> truth 10");
  EXPECT_EQ(&dut_.get_truth_output_port(), &dut_.get_output_port());
  EXPECT_TRUE(dut_.HasAnyDirectFeedthrough());
}

TEST_F(ContactTruthSystemTest, WithoutContactAllIsZero) {
  EXPECT_EQ(Truth(), Vector10::Zero());
  // Touching without force is none, nor is what does not touch the tool.
  AddContact(Vector3d::Zero(), -Vector3d::UnitZ());
  AddContactOf(kWorld, kOther, {0, 0, 70}, {0, 0, -1});
  EXPECT_EQ(Truth(), Vector10::Zero());
}

TEST_F(ContactTruthSystemTest, TheOrderOfTheBodiesDoesNotMatter) {
  const Vector3d normal(0.6, 0, -0.8);
  const Vector3d force = 5 * normal + Vector3d(0, 1, 0);
  Vector10 expected;
  expected << force, normal, 1, Vector3d::Zero();
  for (const bool tool_is_body_A : {false, true}) {
    contacts_.clear();
    AddContact(force, normal, tool_is_body_A);
    AddContactOf(kOther, kWorld, {0, 0, 70}, {0, 0, -1});
    EXPECT_EQ(Truth(), expected);
  }
}

TEST_F(ContactTruthSystemTest, CountsIndependentNormals) {
  const auto tilted = [](double degrees) {
    const double angle = degrees * M_PI / 180;
    return Vector3d(std::sin(angle), 0, -std::cos(angle));
  };
  AddContact(2 * tilted(0), tilted(0));
  AddContact(2 * tilted(9), tilted(9));
  EXPECT_EQ(Truth()(6), 1);
  EXPECT_LT((Truth().segment<3>(3) - tilted(4.5)).norm(), 1e-15);
  contacts_.pop_back();
  AddContact(2 * tilted(11), tilted(11));
  EXPECT_EQ(Truth()(6), 2);
  EXPECT_LT((Truth().tail<3>().cwiseAbs() - Vector3d::UnitY()).norm(), 1e-15);
  // In the plane of the first two.
  AddContact(2 * tilted(60), tilted(60));
  EXPECT_EQ(Truth()(6), 2);
  AddContact(Vector3d(0, 3, 0), Vector3d::UnitY());
  const Vector10 truth = Truth();
  EXPECT_EQ(truth(6), 3);
  const Vector3d sum =
      2 * (tilted(0) + tilted(11) + tilted(60)) + Vector3d(0, 3, 0);
  EXPECT_LT((truth.head<3>() - sum).norm(), 1e-14);
  EXPECT_LT((truth.segment<3>(3) - sum.normalized()).norm(), 1e-14);
  // A fourth changes the forces alone.
  AddContact(Vector3d(4, 0, 0), Vector3d::UnitX());
  EXPECT_EQ(Truth()(6), 3);
}

TEST_F(ContactTruthSystemTest, SaysOnRequestWhichRotationsAreBlocked) {
  const ContactTruthSystem dut(kTool, true);
  EXPECT_EQ(Ports(dut), " contact_results -1 -> truth 14");
  const auto context = dut.CreateDefaultContext();
  const auto truth = [&] {
    auto contacts = contacts_;
    dut.get_contact_results_input_port().FixValue(
        context.get(), ContactResults<double>(std::move(contacts)));
    return VectorXd(EvalWithoutAllocation(dut, *context));
  };
  EXPECT_EQ(truth(), VectorXd::Zero(14));
  const Vector3d up = Vector3d::UnitZ();
  AddContactOf(kWorld, kTool, 2 * up, -up, {0.5, 0, 0.4});
  AddContactOf(kTool, kWorld, -3 * up, up, {0.5, 0.06, 0.4});
  EXPECT_EQ(truth().head<10>(), Truth());
  EXPECT_EQ(truth().tail<4>(), Eigen::Vector4d(1, 0, 0, 0));
  // Not without a force, and not of another body.
  AddContactOf(kWorld, kTool, Vector3d::Zero(), -up, {0.56, 0, 0.4});
  AddContactOf(kWorld, kOther, up, -up, {0.56, 0, 0.4});
  EXPECT_EQ(truth()(10), 1);
  AddContactOf(kWorld, kTool, up, -up, {0.56, 0, 0.4});
  EXPECT_LT((truth().tail<4>() - Eigen::Vector4d(2, 0, 0, -1)).norm(), 1e-14);
}

}  // namespace
}  // namespace dual_proxy
