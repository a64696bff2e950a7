// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/proxy/haptic_side_proxy.h"

#include <cmath>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/proxy/unilateral.h"

namespace dual_proxy {
namespace {

VirtualSpringParams ForceSpring(const HapticSideProxyParams& params) {
  VirtualSpringParams spring;
  spring.stiffness = params.stiffness > 0.0
                         ? params.stiffness
                         : params.map.scale * params.robot_stiffness;
  spring.max_force = params.max_force;
  spring.rate = params.force_rate;
  spring.handover = Handover::kPrinted;
  spring.period = params.period;
  return spring;
}

VirtualSpringParams LostForceSpring(const HapticSideProxyParams& params) {
  VirtualSpringParams spring = ForceSpring(params);
  spring.rate = params.lost_force_rate;
  return spring;
}

VirtualSpringParams MomentSpring(const HapticSideProxyParams& params) {
  VirtualSpringParams spring = ForceSpring(params);
  spring.stiffness = params.rotational_stiffness;
  spring.max_force = params.max_moment;
  spring.rate = params.moment_rate;
  return spring;
}

const HapticSideProxyParams& Validated(const HapticSideProxyParams& params) {
  params.Validate();
  return params;
}

}  // namespace

void HapticSideProxyParams::Validate() const {
  ValidateFields("HapticSideProxyParams", *this);
}

HapticSideProxy::HapticSideProxy(HapticSideProxyParams params)
    : params_(Validated(params)),
      map_(params_.map),
      monitor_(params_.link),
      force_spring_(ForceSpring(params_)),
      lost_force_spring_(LostForceSpring(params_)),
      moment_spring_(MomentSpring(params_)) {}

void HapticSideProxy::Update(double time, const HapticSideProxyInput& input,
                             HapticSideProxyState* state) const noexcept {
  const PoseMessage& message = input.message;
  HapticSideProxyOutput& output = state->output;
  const bool fresh = monitor_.Update(time, message, &state->link);
  if (fresh) {
    output.proxy_pose = map_.HapticProxy(message.pose.p, message.pose.R);
    output.force_selection = map_.HapticSelection(message.force_selection);
    output.moment_selection = map_.HapticSelection(message.moment_selection);
    if (params_.unilateral) {
      output.contact_normals = params_.map.R_DB * message.contact_normals;
    }
  }
  const bool lost = state->link.status == LinkStatus::kLost;
  if (lost) {
    output.force_selection.setZero();
    output.moment_selection.setZero();
    output.contact_normals.setZero();
  }
  output.link_status = state->link.status;
  output.link_age = state->link.age;

  const bool pose_valid = IsValidPose(input.X_DH);
  const bool valid = std::isfinite(time) && pose_valid;
  if (!valid) ++state->bad_inputs;
  Eigen::Vector3d dx = Eigen::Vector3d::Zero();
  Eigen::Vector3d dphi = Eigen::Vector3d::Zero();
  if (pose_valid) {
    if (state->link.status == LinkStatus::kWaiting) {
      output.proxy_pose = input.X_DH;
    }
    dx = input.X_DH.p - output.proxy_pose.p;
    dphi = LogRotation(input.X_DH.R * output.proxy_pose.R.transpose());
  }

  const bool active = valid && state->link.status == LinkStatus::kConnected;
  const Eigen::Vector3d stretch = output.force_selection * dx;
  const VirtualSpring& spring = lost ? lost_force_spring_ : force_spring_;
  spring.Update(-RemovePull(-stretch, output.contact_normals),
                output.force_selection, nullptr, active, &state->force);
  moment_spring_.Update(dphi, output.moment_selection, nullptr, active,
                        &state->moment);
  output.reference_force = state->force.reference;
  output.reference_moment = state->moment.reference;
}

}  // namespace dual_proxy
