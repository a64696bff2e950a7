// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/chai3d/chai3d_device.h"

#include <memory>
#include <string>

#include <devices/CHapticDeviceHandler.h>

namespace dual_proxy {
namespace {

chai3d::cVector3d ToChai3d(const Eigen::Vector3d& v) {
  return {v.x(), v.y(), v.z()};
}

Eigen::Vector3d FromChai3d(const chai3d::cVector3d& v) {
  return {v.x(), v.y(), v.z()};
}

class Chai3dHardware final : public HapticHardware {
 public:
  explicit Chai3dHardware(const Chai3dDeviceParams& params) : params_(params) {}

  void Open() override {
    // It looks for devices once, so that a new one sees what is plugged in now.
    handler_ = std::make_unique<chai3d::cHapticDeviceHandler>();
    if (!handler_->getDevice(device_, params_.index)) {
      throw DriverError(
          "CHAI3D has no haptic device of index " +
          std::to_string(params_.index) + ", it finds " +
          std::to_string(handler_->getNumDevices()) +
          ". Is it plugged in and switched on, and is its vendor's library "
          "installed?");
    }
    const chai3d::cHapticDeviceInfo& info = device_->m_specifications;
    name_ = info.m_manufacturerName + " " + info.m_modelName;
    CheckLimit("max_force", params_.thread.max_force, info.m_maxLinearForce);
    CheckLimit("max_moment", params_.thread.max_moment,
               info.m_maxAngularTorque);
    if (info.m_actuatedGripper) {
      CheckLimit("max_gripper_force", params_.thread.max_gripper_force,
                 info.m_maxGripperForce);
    }
    if (!device_->open()) throw DriverError(name_ + ": cannot be opened");
    if ((params_.homing && !device_->calibrate()) ||
        !Write(Vector6::Zero(), 0) || !device_->enableForces(true)) {
      device_->close();
      throw DriverError(name_ + ": cannot be calibrated, or takes no force");
    }
  }

  void Close() noexcept override { device_->close(); }

  bool Read(HandleState* state) noexcept override {
    const chai3d::cHapticDeviceInfo& info = device_->m_specifications;
    chai3d::cVector3d position;
    chai3d::cVector3d velocity;
    bool ok =
        device_->getPosition(position) && device_->getLinearVelocity(velocity);
    state->X_DH.p = FromChai3d(position);
    state->velocity.head<3>() = FromChai3d(velocity);
    if (info.m_sensedRotation) {
      chai3d::cMatrix3d rotation;
      ok = ok && device_->getRotation(rotation) &&
           device_->getAngularVelocity(velocity);
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) state->X_DH.R(i, j) = rotation(i, j);
      }
      state->velocity.tail<3>() = FromChai3d(velocity);
    }
    if (info.m_sensedGripper) {
      double angle = 0;
      ok = ok && device_->getGripperAngleRad(angle);
      state->gripper_opening = params_.gripper_length * angle;
    }
    if (params_.clutch) {
      ok = ok && device_->getUserSwitch(params_.button, state->buttons.clutch);
    }
    return ok;
  }

  bool Write(const Vector6& wrench, double gripper_force) noexcept override {
    return device_->setForceAndTorqueAndGripperForce(
        ToChai3d(wrench.head<3>()), ToChai3d(wrench.tail<3>()), gripper_force);
  }

  std::string name() const override { return name_; }
  std::string GetLastError() override { return {}; }
  HapticTrouble GetTrouble() override { return {}; }

 private:
  void CheckLimit(const char* field, double value, double most) const {
    if (value <= most) return;
    throw DriverError(name_ + ": field `" + field + "` expected at most " +
                      NumberText(most) + ", which the device has, got " +
                      NumberText(value));
  }

  Chai3dDeviceParams params_;
  std::unique_ptr<chai3d::cHapticDeviceHandler> handler_;
  chai3d::cGenericHapticDevicePtr device_;
  std::string name_;
};

Chai3dDeviceParams Validated(const Chai3dDeviceParams& params) {
  params.Validate();
  return params;
}

}  // namespace

void Chai3dDeviceParams::Validate() const {
  ValidateFields("Chai3dDeviceParams", *this);
}

Chai3dDevice::Chai3dDevice(const Chai3dDeviceParams& params)
    : HapticDeviceThread(params.thread,
                         std::make_unique<Chai3dHardware>(Validated(params))) {}

}  // namespace dual_proxy
