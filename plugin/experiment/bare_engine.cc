// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/bare_engine.h"

#include <cmath>

#include "dual_proxy/experiment/teleop_loop_params.h"
#include "dual_proxy/loop/loop_signals.h"

namespace dual_proxy {
namespace {

// Rows that go into the log at a time.
constexpr Eigen::Index kBlock = 1000;

using Vector11 = Eigen::Matrix<double, 11, 1>;

std::vector<SignalSlice> MakeLogLayout(const TeleopLoop& loop, bool rotations) {
  std::vector<SignalSlice> layout = loop.layout();
  const int begin = SizeOf(layout);
  for (SignalSlice signal : MakeLayout([rotations](SignalSink* sink) {
         VisitContactTruth(Vector11::Zero(), rotations, sink);
         VisitHand(Eigen::Vector3d::Zero(), sink);
       })) {
    signal.start += begin;
    layout.push_back(std::move(signal));
  }
  return layout;
}

}  // namespace

ContactSceneParams MakeContactSceneParams(const Scenario& scenario) {
  const SceneParams& scene = scenario.scene;
  if (scene.contact_approximation == ContactApproximation::kSap) {
    throw ScenarioError(
        scenario.name +
        ".scene.contact_approximation: expected one of \"lagged\", \"similar\" "
        "with engine bare, whose contacts are Hunt and Crossley's, got "
        "\"sap\"");
  }
  if (!scene.model_directives.empty()) {
    throw ScenarioError(scenario.name +
                        ".scene.model_directives: expected none with engine "
                        "bare, as they need Drake, got \"" +
                        scene.model_directives + "\"");
  }
  ContactSceneParams params{
      .surfaces = scene.ContactSurfaces(),
      .tool_radius = scene.tool == Tool::kSphere ? kTipRadius : kCornerRadius};
  if (params.surfaces.size() > ContactScene::kMaxSurfaces) {
    const int most = ContactScene::kMaxSurfaces - (scene.table ? 1 : 0);
    throw ScenarioError(scenario.name + ".scene.surfaces: expected at most " +
                        std::to_string(most) + " with engine bare, got " +
                        std::to_string(scene.surfaces.size()));
  }
  return params;
}

SimulatedArmParams MakeSimulatedArmParams(const Scenario& scenario) {
  const SceneParams& scene = scenario.scene;
  SimulatedArmParams params{.period = scenario.control_period,
                            .time_step = scene.time_step,
                            .p_SE = kSensorToToolPoint,
                            .tool_mass = scene.tool_mass,
                            .tool_com = kToolCom};
  if (scene.tool == Tool::kFlat) {
    const std::vector<Eigen::Vector3d> corners = scene.Corners();
    params.p_EBall.resize(3, static_cast<Eigen::Index>(corners.size()));
    for (Eigen::Index i = 0; i < params.p_EBall.cols(); ++i) {
      params.p_EBall.col(i) = corners[i];
    }
  }
  params.tool_inertia =
      scene.tool_mass / kToolMass * kToolMoments.asDiagonal().toDenseMatrix();
  return params;
}

BareEngine::BareEngine(const Scenario& scenario, const ArmModelParams& arm,
                       const Vector7& q_start, double duration)
    : loop_(MakeTeleopLoopParams(scenario, arm)),
      arm_(MakeSimulatedArmParams(scenario), arm,
           MakeContactSceneParams(scenario)),
      path_(CalcHandlePath(scenario)),
      loop_state_(loop_.MakeState()),
      arm_state_(arm_.MakeState(q_start)),
      rotations_(scenario.has_angular_filter()),
      period_(loop_.period()),
      layout_(MakeLogLayout(loop_, rotations_)),
      log_(std::make_shared<RunLogStore>(
          SizeOf(layout_),
          static_cast<Eigen::Index>(std::ceil(duration / period_)) + 1)),
      times_(kBlock),
      rows_(SizeOf(layout_), kBlock) {}

void BareEngine::AdvanceTo(double end) {
  const Eigen::Index size = SizeOf(loop_.layout());
  while (time() < end - 1e-9 * period_) {
    loop_.Update(time(),
                 {.q = arm_state_.q,
                  .v = arm_state_.v,
                  .reaction = arm_state_.reaction,
                  .has_reaction = num_periods_ > 0},
                 &loop_state_);
    arm_.Update(loop_state_.torque(), &arm_state_);
    ++num_periods_;
    auto row = rows_.col(num_rows_);
    times_(num_rows_) = time();
    loop_.WriteSignals(loop_state_, row.head(size));
    Eigen::Ref<Eigen::VectorXd> rest = row.tail(row.size() - size);
    SignalSink sink(&rest);
    VisitContactTruth(arm_state_.truth.ToVector(), rotations_, &sink);
    VisitHand(path_.Calc(time()).position, &sink);
    if (++num_rows_ == kBlock) Flush();
  }
  Flush();
}

void BareEngine::Flush() {
  if (num_rows_ == 0) return;
  log_->Append(times_.head(num_rows_), rows_.leftCols(num_rows_));
  num_rows_ = 0;
}

}  // namespace dual_proxy
