// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/derived_keys.h"

namespace dual_proxy {
namespace {

constexpr DerivedKey kDerivedKeys[] = {
    {"map.p_cw", "scene.start_position"},
    {"link.period", "scene.time_step"},
    {"robot_proxy.map", "map"},
    {"robot_proxy.limiter.period", "scene.time_step"},
    {"robot_proxy.link", "link"},
    {"robot_proxy.period", "scene.time_step"},
    {"controller.force_passivity.enabled", "controller.passivity"},
    {"controller.force_passivity.period", "scene.time_step"},
    {"controller.moment_passivity.enabled", "controller.passivity"},
    {"controller.moment_passivity.period", "scene.time_step"},
    {"controller.period", "scene.time_step"},
    {"haptic_proxy.map", "map"},
    {"haptic_proxy.link", "link"},
    {"haptic_proxy.robot_stiffness", "robot_proxy.stiffness"},
    {"haptic_proxy.period", "scene.time_step"},
    {"haptic_controller.period", "scene.time_step"},
    {"position_force.map", "map"},
    {"position_force.link", "link"},
    {"device.period", "scene.time_step"},
    {"sensor.tool_mass", "scene.tool_mass"},
    {"sensor.tool_com", "scene"},
    {"sensor.gravity", "scene.gravity"},
    {"sensor.period", "scene.time_step"},
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
