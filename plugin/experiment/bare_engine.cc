// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/bare_engine.h"

#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <utility>

#include "dual_proxy/common/validate.h"
#include "dual_proxy/control/arm_model.h"
#include "dual_proxy/experiment/arm_mismatch.h"
#include "dual_proxy/experiment/teleop_loop_params.h"
#include "dual_proxy/loop/loop_signals.h"

namespace dual_proxy {
namespace {

// Rows that go into the log at a time: as many as a near cache holds, or more
// where each write is a call of the system.
constexpr Eigen::Index kBlock = 64;
constexpr Eigen::Index kFileBlock = 1000;

using Vector14 = Eigen::Matrix<double, 14, 1>;

std::vector<SignalSlice> MakeLogLayout(std::vector<SignalSlice> layout,
                                       bool rotations) {
  const int begin = SizeOf(layout);
  for (SignalSlice signal : MakeLayout([rotations](SignalSink* sink) {
         VisitContactTruth(Vector14::Zero(), rotations, sink);
         VisitHand(Eigen::Vector3d::Zero(), sink);
       })) {
    signal.start += begin;
    layout.push_back(std::move(signal));
  }
  return layout;
}

// What a plant's state is to the loop, and the truth about its contacts.
template <int kJoints>
TeleopLoopInput<SerialArm<kJoints>> MakeInput(
    const SimulatedArmState<kJoints>& state) {
  return {.q = state.q, .v = state.v, .reaction = state.reaction};
}

TeleopLoopInput<PointMass> MakeInput(const PointRobotState& state) {
  TeleopLoopInput<PointMass> input{.q = state.position, .v = state.velocity};
  input.reaction.head<3>() = state.contact.force;
  return input;
}

template <int kJoints>
Vector14 MakeTruth(const SimulatedArmState<kJoints>& state) {
  return state.truth.ToVector();
}

Vector14 MakeTruth(const PointRobotState& state) {
  Vector14 truth = Vector14::Zero();
  const SceneContact& contact = state.contact;
  truth.head<7>() << contact.force, contact.normal, contact.dimension;
  ContactTruth independent;
  for (int i = 0; i < contact.count; ++i) {
    independent.Add(contact.normals.col(i), contact.normals.col(i));
  }
  truth.segment<3>(7) = independent.CalcMotionAxis();
  return truth;
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

// Pages that this thread has touched for the first time so far.
std::int64_t CountPageFaults() {
  rusage usage;
  getrusage(RUSAGE_THREAD, &usage);
  return usage.ru_minflt + usage.ru_majflt;
}

// Whether a posture is one of the arm's, at the scenario's start.
void CheckStart(const Scenario& scenario, const ArmModelParams<7>& arm,
                const Vector7& q_start) {
  const JointLimitsParams<7>& limits = scenario.controller.joint_limits;
  for (int i = 0; i < 7; ++i) {
    ThrowUnlessIn("MakeArmEngine", "q_start", q_start(i),
                  Between(limits.lower(i), limits.upper(i)));
  }
  Pose X_BE;
  ModelTerms<7> terms;
  ArmModel<7>(arm).Calc(q_start, Vector7::Zero(), &X_BE, &terms);
  const Eigen::Vector3d& start = scenario.map.p_cw;
  constexpr double kNear = 1e-3;  // m
  for (int i = 0; i < 3; ++i) {
    ThrowUnlessIn("MakeArmEngine", "tool point at q_start", X_BE.p(i),
                  Between(start(i) - kNear, start(i) + kNear));
  }
}

template <typename Plant>
BareEngine<Plant>::BareEngine(const Scenario& scenario,
                              const typename Robot::Model::Params& model,
                              Plant plant, typename Plant::State start,
                              double duration,
                              const std::optional<RunWatchParams>& watch)
    : loop_(MakeTeleopLoopParams<Robot>(scenario, model)),
      plant_(std::move(plant)),
      path_(CalcHandlePath(scenario)),
      loop_state_(loop_.MakeState()),
      plant_state_(std::move(start)),
      rotations_(scenario.has_angular_filter()),
      period_(loop_.period()),
      layout_(MakeLogLayout(loop_.layout(), rotations_)),
      log_(std::make_shared<RunLogStore>(
          SizeOf(layout_),
          watch
              ? 1
              : static_cast<Eigen::Index>(std::ceil(duration / period_)) + 1)),
      times_(log_->in_memory() && !watch ? kBlock : kFileBlock),
      rows_(SizeOf(layout_), times_.size()),
      has_faults_(!scenario.faults.empty()) {
  if (watch) watch_.emplace(*watch);
}

template <typename Plant>
void BareEngine<Plant>::PutTruth(Eigen::Ref<Eigen::VectorXd> row) const {
  const auto put = [&](const char* name, const auto& value) {
    for (const SignalSlice& signal : layout_) {
      if (signal.name != name) continue;
      row.segment(signal.start, signal.size) = value;
    }
  };
  if constexpr (Robot::kRotates) {
    put("joint_position", plant_state_.q);
    put("joint_velocity", plant_state_.v);
    put("robot_position", plant_state_.X_BE.p);
    put("robot_velocity", plant_state_.v_BE.template head<3>());
    put("robot_angular_velocity", plant_state_.v_BE.template tail<3>());
  } else {
    put("robot_position", plant_state_.position);
    put("robot_velocity", plant_state_.velocity);
  }
  put("device_position", loop_state_.device.pose.p);
  put("device_velocity", loop_state_.device.velocity);
}

template <typename Plant>
std::int64_t BareEngine<Plant>::AdvanceTo(double end,
                                          std::vector<double>* times) {
  const Eigen::Index size = SizeOf(loop_.layout());
  std::int64_t faults = 0;
  while (time() < end - 1e-9 * period_) {
    TeleopLoopInput<Robot> input = MakeInput(plant_state_);
    input.has_reaction = num_periods_ > 0;
    if (times == nullptr) {
      loop_.Update(time(), input, &loop_state_);
    } else {
      const std::int64_t faults_before = CountPageFaults();
      const auto began = std::chrono::steady_clock::now();
      loop_.Update(time(), input, &loop_state_);
      const std::chrono::duration<double> taken =
          std::chrono::steady_clock::now() - began;
      faults += CountPageFaults() - faults_before;
      times->push_back(taken.count());
    }
    plant_.Update(loop_state_.command(), &plant_state_);
    ++num_periods_;
    auto row = rows_.col(num_rows_);
    times_(num_rows_) = time();
    loop_.WriteSignals(loop_state_, row.head(size));
    Eigen::Ref<Eigen::VectorXd> rest = row.tail(row.size() - size);
    SignalSink sink(&rest);
    VisitContactTruth(MakeTruth(plant_state_), rotations_, &sink);
    VisitHand(path_.Calc(time()).position, &sink);
    if (watch_ && has_faults_) PutTruth(row);
    if (++num_rows_ == times_.size()) Flush();
  }
  Flush();
  return faults;
}

template <typename Plant>
void BareEngine<Plant>::Flush() {
  if (num_rows_ == 0) return;
  if (watch_) {
    if (num_rows_ == 1 && num_watched_ > 0) return;
    watch_->Add(RunLog::FromValues(times_.head(num_rows_), layout_,
                                   rows_.leftCols(num_rows_).transpose()));
    num_watched_ += num_rows_;
    times_(0) = times_(num_rows_ - 1);
    rows_.col(0) = rows_.col(num_rows_ - 1).eval();
    num_rows_ = 1;
    return;
  }
  log_->Append(times_.head(num_rows_), rows_.leftCols(num_rows_));
  num_rows_ = 0;
}

template class BareEngine<SimulatedArm<7>>;
template class BareEngine<PointRobot>;

BareEngine<SimulatedArm<7>> MakeArmEngine(
    const Scenario& scenario, const ArmModelParams<7>& arm,
    const Vector7& q_start, double duration,
    const std::optional<RunWatchParams>& watch) {
  CheckStart(scenario, arm, q_start);
  SimulatedArmParams params = MakeSimulatedArmParams(scenario);
  ArmModelParams<7> simulated = arm;
  ApplyMismatch(scenario.mismatch, &simulated, &params);
  const SimulatedArm<7> plant(params, simulated,
                              MakeContactSceneParams(scenario));
  return {scenario, arm, plant, plant.MakeState(q_start), duration, watch};
}

BareEngine<PointRobot> MakePointMassEngine(
    const Scenario& scenario, double duration,
    const std::optional<RunWatchParams>& watch) {
  const PointRobot plant(scenario.point_mass, MakeContactSceneParams(scenario));
  return {scenario, {.mass = scenario.point_mass.mass},
          plant,    plant.MakeState(scenario.scene.start_position),
          duration, watch};
}

RunWatchParams MakeRunWatchParams(const Scenario& scenario, double duration,
                                  double rest_time) {
  RunWatchParams watch{.device_force = scenario.haptic_controller.max_force,
                       .device_moment = scenario.haptic_controller.max_moment,
                       .control_period = scenario.control_period,
                       .rest_start = std::max(0.0, duration - rest_time),
                       .closes_force_loop = UsesSelections(scenario.scheme),
                       .map = scenario.map};
  const CommunicationChannelParams& channel = scenario.link.channel;
  for (const Eigen::Vector2d& outage : channel.outages) {
    watch.fault_end = std::max(watch.fault_end.value_or(0), outage(1));
  }
  for (const InputFault& fault : scenario.faults) {
    watch.fault_end = std::max(watch.fault_end.value_or(0), fault.end);
  }
  if (watch.fault_end) *watch.fault_end += channel.delay + channel.jitter;
  // The proxy is a message behind, and the newest message another one.
  constexpr double kLimiterLag = 0.2;
  watch.follow_lag =
      channel.delay + channel.jitter + 3 / scenario.link.rate() + kLimiterLag;
  if (scenario.scheme == SchemeOf<DualProxyScheme>) {
    const HapticSideProxyParams& proxy = scenario.haptic_proxy;
    watch.reference_force_rate =
        std::max(proxy.force_rate, proxy.lost_force_rate);
    watch.reference_moment_rate = proxy.moment_rate;
  }
  return watch;
}

}  // namespace dual_proxy
