// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/schemes/dual_proxy/scheme.h"
#include "dual_proxy/schemes/four_channel/scheme.h"
#include "dual_proxy/schemes/model_mediated/scheme.h"
#include "dual_proxy/schemes/position_force/scheme.h"
#include "dual_proxy/schemes/position_position/scheme.h"
#include "dual_proxy/schemes/scheme_list.h"
#include "dual_proxy/schemes/tdpa/scheme.h"
#include "dual_proxy/schemes/wave_variables/scheme.h"

namespace dual_proxy {

/** Every scheme there is: add a line here and its folder. */
using Schemes = SchemeList<DualProxyScheme,         //
                           PositionForceScheme,     //
                           PositionPositionScheme,  //
                           FourChannelScheme,       //
                           TdpaScheme,              //
                           WaveVariablesScheme,     //
                           ModelMediatedScheme>;

/** A scheme's place in the list; its name in YAML and Python is its kName. */
enum class Scheme : int {};

template <>
struct EnumStrings<Scheme> {
  static constexpr auto kValues = Schemes::MakeEnumStrings<Scheme>();
};

/** The value of a scheme: SchemeOf<DualProxyScheme>. */
template <typename S>
inline constexpr Scheme SchemeOf = static_cast<Scheme>(Schemes::IndexOf<S>());

/** Whether the scheme has use for what perception finds. */
constexpr bool UsesSelections(Scheme scheme) {
  return Schemes::kUsesSelections[static_cast<int>(scheme)];
}

/** Whether the scheme's robot need not travel to where the hand is. */
constexpr bool Reclutches(Scheme scheme) {
  return Schemes::kReclutches[static_cast<int>(scheme)];
}

/** The tag of what the scheme sends to the robot or to the device. */
constexpr MessageTag ToRobotTag(Scheme scheme) {
  return Schemes::kToRobot[static_cast<int>(scheme)];
}
constexpr MessageTag ToDeviceTag(Scheme scheme) {
  return Schemes::kToDevice[static_cast<int>(scheme)];
}

/** The parameters of all schemes side by side: one file compares them. */
using SchemesParams = Schemes::Params;

/** The halves of one scheme, whichever it is. */
using RobotHalf = Schemes::RobotHalf;
using HapticHalf = Schemes::HapticHalf;

}  // namespace dual_proxy
