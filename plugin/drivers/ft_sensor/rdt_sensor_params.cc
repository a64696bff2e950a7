// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/ft_sensor/rdt_sensor_params.h"

namespace dual_proxy {
namespace {

// Both by definition.
constexpr double kGravity = 9.80665;
constexpr double kPound = 0.45359237 * kGravity;
constexpr double kInch = 0.0254;

}  // namespace

double InNewton(ForceUnit unit) {
  switch (unit) {
    case ForceUnit::kN:
      return 1;
    case ForceUnit::kKN:
      return 1e3;
    case ForceUnit::kLbf:
      return kPound;
    case ForceUnit::kKlbf:
      return 1e3 * kPound;
    case ForceUnit::kKgf:
      return kGravity;
    default:
      return 1e-3 * kGravity;
  }
}

double InNewtonMetre(TorqueUnit unit) {
  switch (unit) {
    case TorqueUnit::kNm:
      return 1;
    case TorqueUnit::kNmm:
      return 1e-3;
    case TorqueUnit::kKNm:
      return 1e3;
    case TorqueUnit::kLbfIn:
      return kPound * kInch;
    case TorqueUnit::kLbfFt:
      return kPound * 12 * kInch;
    default:
      return kGravity * 0.01;
  }
}

void RdtSensorParams::Validate() const {
  constexpr const char* kWho = "RdtSensorParams";
  ValidateFields(kWho, *this);
  if (host.empty()) {
    throw InvalidField(kWho, "host", "expected a name or address, got \"\"");
  }
}

}  // namespace dual_proxy
