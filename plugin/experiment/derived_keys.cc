// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/derived_keys.h"

namespace dual_proxy {
namespace {

constexpr DerivedKey kDerivedKeys[] = {
    {"map.p_cw", "scene.start_position"},
    {"link.period", "control_period"},
    {"robot_proxy.map", "map"},
    {"robot_proxy.limiter.period", "control_period"},
    {"robot_proxy.link", "link"},
    {"robot_proxy.period", "control_period"},
    {"controller.force_passivity.enabled", "controller.passivity"},
    {"controller.force_passivity.period", "control_period"},
    {"controller.moment_passivity.enabled", "controller.passivity"},
    {"controller.moment_passivity.period", "control_period"},
    {"controller.gravity_compensation", "scene.gravity"},
    {"controller.period", "control_period"},
    {"point_controller.force.passivity.period", "control_period"},
    {"point_controller.force.period", "control_period"},
    {"point_controller.period", "control_period"},
    {"point_mass.period", "control_period"},
    {"point_mass.substeps", "scene.time_step"},
    {"haptic_proxy.map", "map"},
    {"haptic_proxy.link", "link"},
    {"haptic_proxy.robot_stiffness", "robot_proxy.stiffness"},
    {"haptic_proxy.period", "control_period"},
    {"haptic_controller.period", "control_period"},
    {"operator_aids.period", "control_period"},
    {"gripper.period", "control_period"},
    {"device.period", "control_period"},
    {"sensor.tool_mass", "scene.tool_mass"},
    {"sensor.tool_com", "scene"},
    {"sensor.gravity", "scene.gravity"},
    {"sensor.period", "control_period"},
};

}  // namespace

std::span<const DerivedKey> DerivedKeys() { return kDerivedKeys; }

std::string_view FindSource(std::string_view key) {
  for (const DerivedKey& derived : kDerivedKeys) {
    if (!key.starts_with(derived.key)) continue;
    const std::string_view rest = key.substr(derived.key.size());
    if (rest.empty() || rest.front() == '.') return derived.source;
  }
  return {};
}

}  // namespace dual_proxy
