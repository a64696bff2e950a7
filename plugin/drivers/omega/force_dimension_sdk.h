// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <string>

namespace dual_proxy {

// What is used of the SDK's C interface: result, name, arguments. An id is a
// signed char. The result is an error if, and only if, it is negative: 1 is
// "asked again too soon, these are the values of before", 2 is "more force than
// the motors have".
#define DUAL_PROXY_FORCE_DIMENSION_FUNCTIONS(X)                              \
  X(const char*, dhdErrorGetLastStr, ())                                     \
  X(void, dhdGetSDKVersion, (int*, int*, int*, int*))                        \
  X(int, dhdGetDeviceCount, ())                                              \
  X(int, dhdOpenSerial, (int))                                               \
  X(int, drdOpenID, (signed char))                                           \
  X(int, drdClose, (signed char))                                            \
  X(int, dhdGetSystemType, (signed char))                                    \
  X(const char*, dhdGetSystemName, (signed char))                            \
  X(int, dhdGetSerialNumber, (unsigned short*, signed char))                 \
  X(bool, dhdHasWrist, (signed char))                                        \
  X(bool, dhdHasGripper, (signed char))                                      \
  X(bool, drdIsInitialized, (signed char))                                   \
  X(int, drdAutoInit, (signed char))                                         \
  X(int, drdStop, (bool, signed char))                                       \
  X(int, dhdSetGravityCompensation, (int, signed char))                      \
  X(int, dhdEmulateButton, (unsigned char, signed char))                     \
  X(int, dhdEnableForce, (unsigned char, signed char))                       \
  X(int, dhdStop, (signed char))                                             \
  X(int, dhdEnableExpertMode, ())                                            \
  X(int, dhdDisableExpertMode, ())                                           \
  X(int, dhdSetWatchdog, (unsigned char, signed char))                       \
  X(int, dhdGetStatus, (int*, signed char))                                  \
  X(int, dhdGetPosition, (double*, double*, double*, signed char))           \
  X(int, dhdGetOrientationFrame, (double*, signed char))                     \
  X(int, dhdGetLinearVelocity, (double*, double*, double*, signed char))     \
  X(int, dhdGetAngularVelocityRad, (double*, double*, double*, signed char)) \
  X(int, dhdGetGripperGap, (double*, signed char))                           \
  X(int, dhdGetGripperAngleRad, (double*, signed char))                      \
  X(int, dhdGetButton, (int, signed char))                                   \
  X(int, dhdSetForceAndTorqueAndGripperForce,                                \
    (double, double, double, double, double, double, double, signed char))

/** The Force Dimension SDK, which may not be passed on and so is loaded where
it is installed (forcedimension.com has it). The members are its C functions, by
their own names. */
struct ForceDimensionSdk {
#define DUAL_PROXY_DECLARE(result, name, arguments) \
  result(*name) arguments{nullptr};
  DUAL_PROXY_FORCE_DIMENSION_FUNCTIONS(DUAL_PROXY_DECLARE)
#undef DUAL_PROXY_DECLARE

  std::string path;     ///< Of the library that was loaded.
  std::string version;  ///< "3.17.5.0".
};

/** Loads the SDK's library libdrd, which stays loaded: it has threads of its
own.
@param library  the file, or the SDK's folder. Empty: what the environment
  variable FDSDK says, the same; if that is not set, libdrd of the loader's
  folders, /usr/local/lib or ~/.local/lib, or else libdhd.
@throws DriverError that says what was tried. */
ForceDimensionSdk LoadForceDimensionSdk(const std::string& library);

}  // namespace dual_proxy
