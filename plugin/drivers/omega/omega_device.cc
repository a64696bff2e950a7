// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/omega/omega_device.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>

#include "dual_proxy/drivers/omega/force_dimension_sdk.h"

namespace dual_proxy {
namespace {

// Of what the SDK returns.
constexpr int kOn = 1;
constexpr int kForceStatus = 5;
constexpr int kForceOffCause = 14;
constexpr int kForceOffByWatchdog = 3;
// More than any version of the SDK fills, which is 17 in 3.17.
constexpr int kMostStatus = 64;

// s: unit of the device's own watchdog.
constexpr double kWatchdogUnit = 125e-6;

// rad: a gripper that is the clutch opens by this before it is none.
constexpr double kClutchHysteresis = 0.02;

bool IsLeftHanded(int system_type) {
  constexpr std::array kLeft{36, 37, 105, 109, 132};
  return std::find(kLeft.begin(), kLeft.end(), system_type) != kLeft.end();
}

const char* ForceOffText(int cause) {
  constexpr std::array kTexts{
      "its forces are off",
      "its forces are off, by its button: press that again",
      "its forces are off, as it moved too fast: close and open it again",
      "its forces are off, as no command reached it in time",
      "its forces are off, by another program: close and open it again",
      "its forces are off, as it was unplugged: close and open it again",
      "its forces are off, as nobody held it"};
  const bool is_known = cause >= 0 && cause < static_cast<int>(kTexts.size());
  return kTexts[is_known ? cause : 0];
}

class OmegaHardware final : public HapticHardware {
 public:
  explicit OmegaHardware(const OmegaDeviceParams& params) : params_(params) {}

  void Open() override {
    if (!sdk_) sdk_ = LoadForceDimensionSdk(params_.library);
    OpenConnection();
    try {
      Prepare();
    } catch (...) {
      Close();
      throw;
    }
  }

  void Close() noexcept override {
    // Brakes in place of forces, so that the handle does not drop.
    sdk_->dhdStop(id_);
    sdk_->drdClose(id_);
  }

  bool Read(HandleState* state) noexcept override {
    Eigen::Vector3d& p = state->X_DH.p;
    Vector6& v = state->velocity;
    bool ok = IsOk(sdk_->dhdGetPosition(&p[0], &p[1], &p[2], id_)) &&
              IsOk(sdk_->dhdGetLinearVelocity(&v[0], &v[1], &v[2], id_));
    if (has_wrist_) {
      double rows[9]{};
      ok = ok && IsOk(sdk_->dhdGetOrientationFrame(rows, id_)) &&
           IsOk(sdk_->dhdGetAngularVelocityRad(&v[3], &v[4], &v[5], id_));
      state->X_DH.R =
          Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(rows);
    }
    if (has_gripper_) {
      ok = ok && IsOk(sdk_->dhdGetGripperGap(&state->gripper_opening, id_));
      state->gripper_opening = std::abs(state->gripper_opening);
    }
    return ok && ReadClutch(&state->buttons);
  }

  bool Write(const Vector6& wrench, double gripper_force) noexcept override {
    return IsOk(sdk_->dhdSetForceAndTorqueAndGripperForce(
        wrench[0], wrench[1], wrench[2], wrench[3], wrench[4], wrench[5],
        gripper_sign_ * gripper_force, id_));
  }

  std::string name() const override { return name_; }

  std::string GetLastError() override {
    const char* const text = sdk_->dhdErrorGetLastStr();
    return text != nullptr ? text : "";
  }

  HapticTrouble GetTrouble() override {
    std::array<int, kMostStatus> status{};
    if (!IsOk(sdk_->dhdGetStatus(status.data(), id_))) return {};
    if (status[kForceStatus] == kOn) return {};
    const int cause = status[kForceOffCause];
    // As commands come again the force may, as with the thread's watchdog.
    if (cause == kForceOffByWatchdog && IsOk(sdk_->dhdEnableForce(kOn, id_))) {
      return {.was_watchdog = true};
    }
    return {.text = ForceOffText(cause)};
  }

 private:
  static bool IsOk(int result) { return result >= 0; }

  void OpenConnection() {
    int id = params_.index;
    if (params_.serial > 0) id = sdk_->dhdOpenSerial(params_.serial);
    if (IsOk(id)) id = sdk_->drdOpenID(static_cast<signed char>(id));
    if (IsOk(id)) {
      id_ = static_cast<signed char>(id);
      return;
    }
    const std::string which = params_.serial > 0
                                  ? "serial " + std::to_string(params_.serial)
                                  : "index " + std::to_string(params_.index);
    throw DriverError(
        "No haptic device of " + which + " could be opened: " + GetLastError() +
        " (SDK " + sdk_->version + ", " + sdk_->path + ", sees " +
        std::to_string(sdk_->dhdGetDeviceCount()) +
        "). Is it plugged in and switched on, does no other program have it, "
        "and may you use its USB port (docs/omega.md)?");
  }

  void Prepare() {
    const int type = Check("dhdGetSystemType", sdk_->dhdGetSystemType(id_));
    const char* const model = sdk_->dhdGetSystemName(id_);
    name_ = model != nullptr ? model : "device";
    unsigned short serial = 0;
    if (IsOk(sdk_->dhdGetSerialNumber(&serial, id_))) {
      name_ += ", serial " + std::to_string(serial);
    }
    gripper_sign_ = IsLeftHanded(type) ? -1 : 1;
    has_wrist_ = sdk_->dhdHasWrist(id_);
    has_gripper_ = sdk_->dhdHasGripper(id_);
    if (params_.clutch == HandleClutch::kGripper && !has_gripper_) {
      throw DriverError(name_ + ": has no gripper that could be the clutch");
    }
    Home();
    Check("dhdSetGravityCompensation",
          sdk_->dhdSetGravityCompensation(kOn, id_));
    if (params_.clutch == HandleClutch::kButton && has_gripper_) {
      Check("dhdEmulateButton", sdk_->dhdEmulateButton(kOn, id_));
    }
    clutch_ = false;
    // Before and after, as what was commanded last might act.
    Write(Vector6::Zero(), 0);
    Check("dhdEnableForce", sdk_->dhdEnableForce(kOn, id_));
    Check("dhdSetForceAndTorqueAndGripperForce",
          Write(Vector6::Zero(), 0) ? 0 : -1);
    SetDeviceWatchdog();
  }

  void Home() {
    if (sdk_->drdIsInitialized(id_)) return;
    if (!params_.homing) {
      throw DriverError(
          name_ +
          ": was not homed since it was switched on. Home it by hand as its "
          "manual says, or let go of it and allow `homing`: it then moves by "
          "itself");
    }
    Check("drdAutoInit", sdk_->drdAutoInit(id_));
    // Its regulation goes on otherwise, against every other command.
    Check("drdStop", sdk_->drdStop(true, id_));
  }

  // Not every controller has one; without it the thread's is all.
  void SetDeviceWatchdog() {
    const double units = 1.5 * params_.thread.watchdog / kWatchdogUnit;
    sdk_->dhdEnableExpertMode();
    if (!IsOk(sdk_->dhdSetWatchdog(
            static_cast<unsigned char>(std::clamp(units, 1.0, 255.0)), id_))) {
      name_ += ", without a watchdog of its own";
    }
    sdk_->dhdDisableExpertMode();
  }

  bool ReadClutch(OperatorButtons* buttons) noexcept {
    if (params_.clutch == HandleClutch::kButton) {
      const int pressed = sdk_->dhdGetButton(params_.button, id_);
      if (!IsOk(pressed)) return false;
      clutch_ = pressed == kOn;
    } else if (params_.clutch == HandleClutch::kGripper) {
      double angle = 0;
      if (!IsOk(sdk_->dhdGetGripperAngleRad(&angle, id_))) return false;
      const double release = clutch_ ? kClutchHysteresis : 0;
      clutch_ = gripper_sign_ * angle < params_.gripper_angle + release;
    }
    buttons->clutch = clutch_;
    return true;
  }

  int Check(const char* what, int result) {
    if (IsOk(result)) return result;
    throw DriverError(name_ + ": " + what + " failed: " + GetLastError());
  }

  OmegaDeviceParams params_;
  std::optional<ForceDimensionSdk> sdk_;
  signed char id_{-1};
  std::string name_;
  double gripper_sign_{1};
  bool has_wrist_{false};
  bool has_gripper_{false};
  bool clutch_{false};
};

OmegaDeviceParams Validated(const OmegaDeviceParams& params) {
  params.Validate();
  return params;
}

}  // namespace

void OmegaDeviceParams::Validate() const {
  ValidateFields("OmegaDeviceParams", *this);
}

OmegaDevice::OmegaDevice(const OmegaDeviceParams& params)
    : HapticDeviceThread(params.thread,
                         std::make_unique<OmegaHardware>(Validated(params))) {}

}  // namespace dual_proxy
