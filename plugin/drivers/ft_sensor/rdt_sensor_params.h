// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>
#include <utility>

#include <Eigen/Core>

#include "dual_proxy/common/possible.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Units that an RDT sensor can be set to. */
enum class ForceUnit { kN, kKN, kLbf, kKlbf, kKgf, kGf };
enum class TorqueUnit { kNm, kNmm, kKNm, kLbfIn, kLbfFt, kKgfCm };

template <>
struct EnumStrings<ForceUnit> {
  static constexpr std::pair<ForceUnit, const char*> kValues[] = {
      {ForceUnit::kN, "N"},     {ForceUnit::kKN, "kN"},
      {ForceUnit::kLbf, "lbf"}, {ForceUnit::kKlbf, "klbf"},
      {ForceUnit::kKgf, "kgf"}, {ForceUnit::kGf, "gf"}};
};

template <>
struct EnumStrings<TorqueUnit> {
  static constexpr std::pair<TorqueUnit, const char*> kValues[] = {
      {TorqueUnit::kNm, "Nm"},        {TorqueUnit::kNmm, "Nmm"},
      {TorqueUnit::kKNm, "kNm"},      {TorqueUnit::kLbfIn, "lbf-in"},
      {TorqueUnit::kLbfFt, "lbf-ft"}, {TorqueUnit::kKgfCm, "kgf-cm"}};
};

/** Whose force on whom a sensor reports. */
enum class SensedForce { kToolOnArm, kArmOnTool };

template <>
struct EnumStrings<SensedForce> {
  static constexpr std::pair<SensedForce, const char*> kValues[] = {
      {SensedForce::kToolOnArm, "tool_on_arm"},
      {SensedForce::kArmOnTool, "arm_on_tool"}};
};

/** N that are one unit. */
double InNewton(ForceUnit unit);
/** N m that are one unit. */
double InNewtonMetre(TorqueUnit unit);

/** Parameters of RdtSensor. S is the frame in which the project wants the
force (ForceTorqueAdapter); N is the one in which the sensor gives it, with the
same origin. */
struct RdtSensorParams {
  std::string host{"192.168.1.1"};
  int port{49152};
  std::string local_address{};
  int local_port{0};
  double counts_per_force{1e6};
  double counts_per_torque{1e6};
  ForceUnit force_unit{ForceUnit::kN};
  TorqueUnit torque_unit{TorqueUnit::kNm};
  SensedForce reports{SensedForce::kToolOnArm};
  Eigen::Matrix3d R_SN{Eigen::Matrix3d::Identity()};
  double max_force{500};
  double max_moment{50};
  double silence{0.1};
  double frozen_time{0.05};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    constexpr const char* kWho = "RdtSensorParams";
    a->Visit(Field("host", &host, "name or address of the sensor"));
    a->Visit(Field("port", &port, Between(1, 65535), "", "UDP, of the sensor"));
    a->Visit(Field("local_address", &local_address,
                   "of the network card that it is connected to; empty: the "
                   "system's choice"));
    a->Visit(Field("local_port", &local_port, Between(0, 65535), "",
                   "UDP, of this side; 0: any"));
    a->Visit(Field("counts_per_force", &counts_per_force, Above(0), "",
                   "counts that are one force_unit (cfgcpf)"));
    a->Visit(Field("counts_per_torque", &counts_per_torque, Above(0), "",
                   "counts that are one torque_unit (cfgcpt)"));
    VisitEnum(a, kWho, "force_unit", &force_unit, "of the sensor's forces");
    VisitEnum(a, kWho, "torque_unit", &torque_unit, "of its torques");
    VisitEnum(a, kWho, "reports", &reports,
              "whose force on whom: an ATI's is the load on the sensor, "
              "tool_on_arm");
    a->Visit(Field("R_SN", &R_SN, Rotation(), "",
                   "axes N in which the sensor reports, in S, whose axes are "
                   "E's: how it is mounted"));
    a->Visit(Field("max_force", &max_force, Between(Open(0), kMaxForce), "N",
                   "that the sensor measures, per axis: beyond it a reading "
                   "is not valid"));
    a->Visit(Field("max_moment", &max_moment, Between(Open(0), kMaxForce),
                   "N m", "likewise"));
    a->Visit(Field("silence", &silence, Between(0.01, 10), "s",
                   "without a record, after which a reading is not valid and "
                   "the stream is asked for again"));
    a->Visit(Field("frozen_time", &frozen_time, Above(0), "s",
                   "with the same values, after which they are not valid: a "
                   "sensor that works has noise"));
  }
};

}  // namespace dual_proxy
