// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/common/window_mean.h"
#include "dual_proxy/faces/blocks.h"
#include "dual_proxy/faces/shared_ports.h"

namespace dual_proxy {

namespace {

struct FilterBlockInput {
  FilterInput means;
  std::optional<Eigen::Matrix3Xd> prior;
};

class ForceSpaceParticleFilterBlock final
    : public BlockOf<FilterBlockInput, ForceSpaceParticleFilterState> {
 public:
  ForceSpaceParticleFilterBlock(const ForceSpaceParticleFilterParams& params,
                                std::uint64_t seed)
      : BlockOf("ForceSpaceParticleFilter", {.period = params.period}),
        filter_(params) {
    set_start(filter_.MakeState(seed));
  }

 private:
  void ReadInputs(InputPorts* ports, FilterBlockInput* input) const override {
    FilterInput& means = input->means;
    ports->GetVector({"sensed_force", "F_s, N, mean over the last period"},
                     &means.sensed);
    ports->GetVector({"velocity", "of the tool point, m/s, likewise"},
                     &means.velocity);
    ports->GetVector({"motion_force", "F_m, N, likewise"}, &means.motion);
    ports->GetVector({"contact_force", "F_f, N, likewise"}, &means.contact);
    Eigen::Matrix3Xd prior;
    if (ports->GetNormals(
            {"prior",
             "k <= 8 columns: normals that are expected. One that is not as it "
             "should be leaves the one before in force"},
            &prior)) {
      input->prior = std::move(prior);
    }
  }

  void Update(double, const FilterBlockInput& input,
              ForceSpaceParticleFilterState* state) const override {
    if (input.prior) filter_.SetPrior(*input.prior, state);
    filter_.Update(input.means.sensed, input.means.velocity, input.means.motion,
                   input.means.contact, state);
  }

  void WriteOutputs(double, const ForceSpaceParticleFilterState& state,
                    InputPorts*, OutputPorts* ports) const override {
    ports->PutMatrix({"force_selection", "Omega_f"}, state.force_selection);
    ports->PutScalar({"dimension", "0 to 3"}, state.dimension);
    ports->PutVector({"particles", "one after the other"},
                     static_cast<int>(state.particles.size()),
                     [&](OutputPorts::VectorRef vector) {
                       vector.reshaped(3, state.particles.cols()) =
                           state.particles;
                     });
    ports->PutVector(
        {"force_direction", "U1, the main direction; zero at dimension 0"},
        state.force_direction());
    ports->PutScalar({"direction_uncertainty",
                      "rad: the true direction is within this angle with 95 %"},
                     state.direction_uncertainty);
    ports->PutScalar(
        {"dimension_confidence", "the probability that the dimension is right"},
        state.dimension_confidence);
    ports->PutCounts(
        {"counters", "updates refused, updates in which nothing was likely"},
        {state.bad_inputs, state.all_weights_zero});
    ports->PutMatrix(kContactNormals, state.contact_normals);
  }

  ForceSpaceParticleFilter filter_;
};

struct HistoryInput {
  Pose X_BE;
  Eigen::Matrix3d force_selection{Eigen::Matrix3d::Zero()};
  Eigen::Vector3d force_direction{Eigen::Vector3d::Zero()};
};

struct HistoryMemory {
  ContactHistoryState state;
  RememberedContacts prior;
};

class ContactHistoryBlock final : public BlockOf<HistoryInput, HistoryMemory> {
 public:
  explicit ContactHistoryBlock(const ContactHistoryParams& params)
      : BlockOf("ContactHistory", {.period = params.period}), history_(params) {
    set_start({.state = history_.MakeState(), .prior = {}});
  }

 private:
  void ReadInputs(InputPorts* ports, HistoryInput* input) const override {
    ports->GetPose({"robot_pose", "X_BE"}, &input->X_BE);
    ports->GetVector(
        {"force_selection",
         "Omega_f of the filter; without it there is one direction"},
        &input->force_selection);
    ports->GetVector(
        {"force_direction", "U1 of the filter; without it nothing is noted"},
        &input->force_direction);
  }

  void Update(double, const HistoryInput& input,
              HistoryMemory* memory) const override {
    history_.UpdateFromSelection(input.X_BE.p, input.force_selection,
                                 input.force_direction, &memory->state);
    memory->prior = history_.Lookup(input.X_BE.p, memory->state);
  }

  void WriteOutputs(double, const HistoryMemory& memory, InputPorts*,
                    OutputPorts* ports) const override {
    ports->PutNormals({"prior",
                       "k <= 8 unit normals into the surface, believed here on "
                       "earlier visits; none before the first step"},
                      memory.prior.normals);
  }

  ContactHistory history_;
};

class WindowMeanBlock final
    : public BlockOf<Eigen::Vector3d, WindowMeanState<3>> {
 public:
  WindowMeanBlock(double window, double period)
      : BlockOf("WindowMean", {.period = Checked(period)}), mean_(window) {
    set_start(mean_.MakeState());
  }

 private:
  static double Checked(double period) {
    ThrowUnlessIn("WindowMean", "period", period, Between(Open(0), kMaxTime));
    return period;
  }

  void ReadInputs(InputPorts* ports, Eigen::Vector3d* value) const override {
    ports->GetVector({"value", "of any unit and frame"}, value,
                     Need::kRequired);
  }

  void Update(double time, const Eigen::Vector3d& value,
              WindowMeanState<3>* state) const override {
    mean_.Update(time, value, state);
  }

  void WriteOutputs(double, const WindowMeanState<3>& state, InputPorts*,
                    OutputPorts* ports) const override {
    ports->PutVector({"mean", "of the same unit and frame"}, state.mean);
  }

  WindowMean<3> mean_;
};

}  // namespace

BlockPtr MakeForceSpaceParticleFilterBlock(
    const ForceSpaceParticleFilterParams& params, std::uint64_t seed) {
  return std::make_shared<ForceSpaceParticleFilterBlock>(params, seed);
}

BlockPtr MakeContactHistoryBlock(const ContactHistoryParams& params) {
  return std::make_shared<ContactHistoryBlock>(params);
}

BlockPtr MakeWindowMeanBlock(double window, double period) {
  return std::make_shared<WindowMeanBlock>(window, period);
}

}  // namespace dual_proxy
