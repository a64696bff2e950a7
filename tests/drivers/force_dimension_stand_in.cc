// SPDX-License-Identifier: BSD-3-Clause

/** @file
A library that takes the place of Force Dimension's libdrd: the functions of its
C interface, by their names, types and return values, over a simulated Omega.7
in a simulated hand. It knows nothing of who calls it. What a device and its
user would do is told by the functions standIn...() at its end, or, where a
process is started, by environment variables that are read at first use:

  STAND_IN_PATH          where the hand goes, as standInSetPath()
  STAND_IN_GO            a file; the hand waits for it at its path's beginning
  STAND_IN_TYPE          the device's system type, 35
  STAND_IN_HOMED         0: it was not homed since it was switched on
  STAND_IN_UNPLUG_AFTER  calls after which it is unplugged

Hand and handle are a mass that a spring and a damper pull to the path. It lives
in real time: each call catches up. What is not simulated fails with "not
implemented". */

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <cstring>

#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <limits>
#include <map>
#include <mutex>
#include <sstream>
#include <string>
#include <thread>
#include <vector>

#define EXPORT extern "C" __attribute__((visibility("default")))

namespace {

using Id = signed char;
using Vector = std::array<double, 3>;

enum Error {
  kNone = 0,
  kCommunication = 2,
  kNoDevice = 5,
  kNotAvailable = 6,
  kTimeout = 7,
  kExpertModeDisabled = 9,
  kNotImplemented = 10,
  kNotReady = 12,
};

enum ForceOff { kNotOff = 0, kByWatchdog = 3, kBySoftware = 4, kUnplugged = 5 };

constexpr double kMass = 0.75;           // kg, hand and handle.
constexpr double kStiffness = 600;       // N/m
constexpr double kDamping = 30;          // N s/m
constexpr double kWeight = 0.25 * 9.81;  // N, of the handle.
constexpr double kStep = 1e-4;           // s
constexpr double kMostSteps = 20000;
constexpr double kMaxForce = 12;         // N
constexpr double kGripperLength = 0.09;  // m: opening per rad.
constexpr int kWindow = 200;             // Steps over which velocity is taken.
constexpr int kFirstVelocities = 3;      // That time out after opening.
constexpr Id kOnlyDevice = 0;
constexpr int kSerial = 1234;

double Now() {
  return std::chrono::duration<double>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

struct Waypoint {
  double time;
  Vector position;
};

class Device {
 public:
  Device() { Reset(); }

  void Reset() {
    *this = Device(0);
    const auto number = [](const char* name, int value) {
      const char* const text = std::getenv(name);
      return text != nullptr ? std::atoi(text) : value;
    };
    type = number("STAND_IN_TYPE", 35);
    homed = number("STAND_IN_HOMED", 1) != 0;
    calls_left = number("STAND_IN_UNPLUG_AFTER", -1);
    if (const char* text = std::getenv("STAND_IN_PATH")) SetPath(text);
    if (const char* text = std::getenv("STAND_IN_GO")) go = text;
  }

  void SetPath(const std::string& text) {
    std::istringstream stream(text);
    std::vector<Waypoint> read;
    for (std::string part; std::getline(stream, part, ';');) {
      std::istringstream numbers(part);
      Waypoint w{};
      numbers >> w.time >> w.position[0] >> w.position[1] >> w.position[2];
      if (numbers) read.push_back(w);
    }
    Advance();
    path = read;
    path_start = time;
  }

  Vector PathAt(double t) const {
    if (path.empty()) return {};
    if (t <= path.front().time) return path.front().position;
    for (std::size_t i = 1; i < path.size(); ++i) {
      const Waypoint& a = path[i - 1];
      const Waypoint& b = path[i];
      if (t > b.time) continue;
      const double s = (t - a.time) / (b.time - a.time);
      Vector result{};
      for (int k = 0; k < 3; ++k) {
        result[k] = a.position[k] + s * (b.position[k] - a.position[k]);
      }
      return result;
    }
    return path.back().position;
  }

  // N, on the hand.
  Vector ActingForce() const {
    if (!force_on) return {0, 0, gravity_compensated ? 0 : -kWeight};
    const double size = std::hypot(commanded[0], commanded[1], commanded[2]);
    const double scale = size > kMaxForce ? kMaxForce / size : 1;
    return {scale * commanded[0], scale * commanded[1],
            scale * commanded[2] - (gravity_compensated ? 0 : kWeight)};
  }

  void Advance() {
    const double now = Now();
    if (now - time > kMostSteps * kStep) time = now - kMostSteps * kStep;
    if (!go.empty()) {
      path_start = time;
      if (std::filesystem::exists(go)) go.clear();
    }
    for (; time + kStep <= now; time += kStep) {
      if (watchdog > 0 && force_on && time - command_time > watchdog * 125e-6) {
        TurnForceOff(kByWatchdog);
      }
      const Vector force = ActingForce();
      const Vector goal = PathAt(time - path_start);
      for (int k = 0; k < 3; ++k) {
        v[k] += kStep / kMass *
                (kStiffness * (goal[k] - p[k]) - kDamping * v[k] + force[k]);
        p[k] += kStep * v[k];
      }
      history[++steps % kWindow] = p;
    }
  }

  void TurnForceOff(ForceOff cause) {
    force_on = false;
    force_off_cause = cause;
    commanded = {};
    gripper_force = 0;
  }

  void Unplug() {
    unplugged = true;
    opened = false;
    TurnForceOff(kUnplugged);
  }

  void Command(const double* force, double gripper) {
    command_time = Now();
    if (!force_on) return;
    std::copy_n(force, 6, commanded.begin());
    gripper_force = gripper;
  }

  Vector WindowVelocity() const {
    const Vector& before = history[(steps + 1) % kWindow];
    Vector result{};
    for (int k = 0; k < 3; ++k) {
      result[k] = (p[k] - before[k]) / ((kWindow - 1) * kStep);
    }
    return result;
  }

  Vector ReadPosition() const {
    if (corruption == 1) {
      return {p[0], std::numeric_limits<double>::quiet_NaN(), p[2]};
    }
    if (corruption == 2) return {p[0], p[1], 1e6};
    return p;
  }

  bool left() const {
    return type == 36 || type == 37 || type == 105 || type == 109;
  }
  bool has_wrist() const { return type != 33 && type != 63 && type != 206; }
  bool has_gripper() const {
    return type == 35 || type == 37 || type == 104 || type == 105 ||
           type == 108 || type == 109;
  }
  bool has_active_wrist() const { return has_gripper() && type > 100; }

  double GripperAngle() const { return left() ? -gripper : gripper; }

  // By rows: about z.
  std::array<double, 9> Rotation() const {
    const double c = std::cos(yaw);
    const double s = std::sin(yaw);
    return {c, -s, 0, s, c, 0, 0, 0, 1};
  }

  // The device.
  int type{35};
  bool unplugged{false};
  long calls_left{-1};  // Until it is unplugged, if >= 0.
  bool opened{false};
  bool homed{true};
  bool force_on{false};
  int force_off_cause{kNotOff};
  bool gravity_compensated{false};
  bool emulates_button{false};
  bool expert{false};
  unsigned char watchdog{0};
  int velocities_to_fail{0};
  double command_time{0};
  std::array<double, 6> commanded{};
  double gripper_force{0};

  // The hand.
  double time{Now()};
  double path_start{Now()};
  std::vector<Waypoint> path;
  std::string go;
  Vector p{};
  Vector v{};
  double gripper{0.3};
  double yaw{0};
  bool button{false};
  std::array<Vector, kWindow> history{};
  long steps{0};

  // What goes wrong.
  int corruption{0};
  double delay{0};  // s, of the next call.
  std::map<std::string, int> failures;
  std::map<std::string, long> counts;

 private:
  explicit Device(int) {}
};

std::mutex& Mutex() {
  static auto& mutex = *new std::mutex();
  return mutex;
}

Device& TheDevice() {
  static auto& device = *new Device();
  return device;
}

thread_local int last_error = kNone;

int Fail(Error error) {
  last_error = error;
  return -1;
}

// One call of the library: caught up, counted, and held until it returns.
class Call {
 public:
  explicit Call(const char* name) {
    double delay = 0;
    {
      const std::lock_guard lock(Mutex());
      std::swap(delay, TheDevice().delay);
    }
    if (delay > 0) {
      std::this_thread::sleep_for(std::chrono::duration<double>(delay));
    }
    lock_ = std::unique_lock(Mutex());
    ++d.counts[name];
    d.Advance();
    const auto failure = d.failures.find(name);
    if (failure != d.failures.end() && failure->second != 0) {
      if (failure->second > 0) --failure->second;
      fails_ = true;
    }
  }

  // Of the device, which has to be there.
  Call(const char* name, Id id) : Call(name) {
    if (d.calls_left > 0) --d.calls_left;
    if (d.calls_left == 0) d.Unplug();
    if (d.unplugged || fails_) {
      Fail(kCommunication);
      fails_ = true;
    } else if (!d.opened || (id != kOnlyDevice && id != -1)) {
      Fail(kNoDevice);
      fails_ = true;
    }
  }

  bool fails() const { return fails_; }

  Device& d{TheDevice()};

 private:
  std::unique_lock<std::mutex> lock_;
  bool fails_{false};
};

int Open(const char* name, bool is_this_one) {
  Call call(name);
  Device& d = call.d;
  if (call.fails() || d.unplugged || !is_this_one) return Fail(kNoDevice);
  if (!d.opened) {
    d.opened = true;
    d.velocities_to_fail = kFirstVelocities;
    d.path_start = d.time;
    d.watchdog = 0;
    d.gravity_compensated = false;
    d.emulates_button = false;
    d.TurnForceOff(kBySoftware);
  }
  return kOnlyDevice;
}

int Close(const char* name, Id id) {
  Call call(name, id);
  if (call.fails()) return -1;
  call.d.TurnForceOff(kBySoftware);
  call.d.opened = false;
  return 0;
}

int Command(const char* name, Id id, const std::array<double, 6>& force,
            double gripper_force) {
  Call call(name, id);
  if (call.fails()) return -1;
  call.d.Command(force.data(), gripper_force);
  return 0;
}

int NotImplemented(const char* name) {
  const Call call(name);
  return Fail(kNotImplemented);
}

const char* ErrorText(int error) {
  switch (error) {
    case kNone:
      return "no error";
    case kCommunication:
      return "communication error";
    case kNoDevice:
      return "no device found";
    case kNotAvailable:
      return "feature not available";
    case kTimeout:
      return "timeout";
    case kExpertModeDisabled:
      return "expert mode is disabled";
    case kNotImplemented:
      return "not implemented";
    case kNotReady:
      return "device not ready";
    default:
      return "error";
  }
}

}  // namespace

// A call of the device; without it the function fails.
#define DEVICE_CALL()          \
  Call call(__func__, id);     \
  if (call.fails()) return -1; \
  [[maybe_unused]] Device& d = call.d

#define DEVICE_QUESTION(name, answer)          \
  EXPORT bool name(Id id) {                    \
    Call call(__func__, id);                   \
    [[maybe_unused]] const Device& d = call.d; \
    return !call.fails() && (answer);          \
  }

// Errors, version, time.

EXPORT int dhdErrorGetLast() { return last_error; }
EXPORT const char* dhdErrorGetLastStr() { return ErrorText(last_error); }
EXPORT const char* dhdErrorGetStr(int error) { return ErrorText(error); }

EXPORT void dhdGetSDKVersion(int* major, int* minor, int* release,
                             int* revision) {
  *major = 3;
  *minor = 17;
  *release = 5;
  *revision = 0;
}

EXPORT double dhdGetTime() { return Now(); }
EXPORT void dhdSleep(double seconds) {
  std::this_thread::sleep_for(std::chrono::duration<double>(seconds));
}
EXPORT bool dhdKbHit() { return false; }
EXPORT char dhdKbGet() { return 0; }

// Which devices there are.

EXPORT void dhdEnableSimulator(bool) {}
EXPORT int dhdGetDeviceCount() {
  const Call call(__func__);
  return call.d.unplugged ? 0 : 1;
}
EXPORT int dhdGetAvailableCount() {
  const Call call(__func__);
  return call.d.unplugged || call.d.opened ? 0 : 1;
}
EXPORT int dhdOpen() { return Open(__func__, true); }
EXPORT int dhdOpenID(Id id) { return Open(__func__, id == kOnlyDevice); }
EXPORT int dhdOpenType(int type) {
  return Open(__func__, type == TheDevice().type);
}
EXPORT int dhdOpenSerial(int serial) {
  return Open(__func__, serial == kSerial);
}
EXPORT int drdOpen() { return Open(__func__, true); }
EXPORT int drdOpenID(Id id) { return Open(__func__, id == kOnlyDevice); }
EXPORT int dhdClose(Id id) { return Close(__func__, id); }
EXPORT int drdClose(Id id) { return Close(__func__, id); }
EXPORT int dhdSetDevice(Id id) {
  DEVICE_CALL();
  return 0;
}
EXPORT int drdSetDevice(Id id) {
  DEVICE_CALL();
  return 0;
}
EXPORT int dhdGetDeviceID() { return kOnlyDevice; }
EXPORT int drdGetDeviceID() { return kOnlyDevice; }

EXPORT int dhdGetSystemType(Id id) {
  DEVICE_CALL();
  return d.type;
}
EXPORT int dhdGetSystemRev(Id id) {
  DEVICE_CALL();
  return 1;
}
EXPORT const char* dhdGetSystemName(Id id) {
  const Call call(__func__, id);
  if (call.fails()) return nullptr;
  switch (call.d.type) {
    case 33:
      return "omega.3";
    case 34:
      return "omega.6";
    case 36:
      return "omega.6 left-handed";
    case 37:
      return "omega.7 left-handed";
    case 104:
      return "sigma.7";
    default:
      return "omega.7";
  }
}
EXPORT int dhdGetSerialNumber(unsigned short* serial, Id id) {
  DEVICE_CALL();
  *serial = kSerial;
  return 0;
}
EXPORT int dhdGetVersion(double* version, Id id) {
  DEVICE_CALL();
  *version = 3.1;
  return 0;
}
EXPORT int dhdGetComMode(Id id) {
  DEVICE_CALL();
  return 1;
}
DEVICE_QUESTION(dhdIsLeftHanded, d.left())
DEVICE_QUESTION(dhdHasBase, true)
DEVICE_QUESTION(dhdHasWrist, d.has_wrist())
DEVICE_QUESTION(dhdHasActiveWrist, d.has_active_wrist())
DEVICE_QUESTION(dhdHasGripper, d.has_gripper())
DEVICE_QUESTION(dhdHasActiveGripper, d.has_gripper())
DEVICE_QUESTION(drdIsSupported, true)
DEVICE_QUESTION(drdIsRunning, false)
DEVICE_QUESTION(drdIsMoving, false)
DEVICE_QUESTION(drdIsFiltering, false)
DEVICE_QUESTION(drdIsInitialized, d.homed)

// Modes.

EXPORT int dhdStop(Id id) {
  DEVICE_CALL();
  d.TurnForceOff(kBySoftware);
  return 0;
}
EXPORT int dhdEnableForce(unsigned char on, Id id) {
  DEVICE_CALL();
  if (on == 0) {
    d.TurnForceOff(kBySoftware);
  } else {
    d.force_on = true;
    d.force_off_cause = kNotOff;
    d.command_time = Now();
  }
  return 0;
}
EXPORT int dhdSetBrakes(int on, Id id) {
  DEVICE_CALL();
  if (on != 0) d.TurnForceOff(kBySoftware);
  return 0;
}
EXPORT int dhdSetGravityCompensation(int on, Id id) {
  DEVICE_CALL();
  d.gravity_compensated = on != 0;
  return 0;
}
EXPORT int dhdEmulateButton(unsigned char on, Id id) {
  DEVICE_CALL();
  if (!d.has_gripper()) return Fail(kNotAvailable);
  d.emulates_button = on != 0;
  return 0;
}
EXPORT int dhdReset(Id id) {
  DEVICE_CALL();
  d.homed = false;
  return 0;
}
EXPORT int dhdGetStatus(int* status, Id id) {
  DEVICE_CALL();
  std::fill_n(status, 17, 0);
  status[0] = status[1] = status[2] = 1;
  status[3] = d.homed;
  status[5] = d.force_on;
  status[6] = !d.force_on;
  status[8] = d.has_wrist();
  status[10] = d.gravity_compensated;
  status[14] = d.force_off_cause;
  return 0;
}
EXPORT int dhdConfigLinearVelocity(int, int, Id id) {
  DEVICE_CALL();
  return 0;
}
EXPORT int dhdEnableExpertMode() {
  Call(__func__).d.expert = true;
  return 0;
}
EXPORT int dhdDisableExpertMode() {
  Call(__func__).d.expert = false;
  return 0;
}
EXPORT int dhdSetVelocityThreshold(unsigned int, Id id) {
  DEVICE_CALL();
  return d.expert ? 0 : Fail(kExpertModeDisabled);
}
EXPORT int dhdSetWatchdog(unsigned char value, Id id) {
  DEVICE_CALL();
  if (!d.expert) return Fail(kExpertModeDisabled);
  d.watchdog = value;
  return 0;
}
EXPORT int dhdGetWatchdog(unsigned char* value, Id id) {
  DEVICE_CALL();
  *value = d.watchdog;
  return 0;
}

int Home(const char* name, Id id) {
  {
    Call call(name, id);
    if (call.fails()) return -1;
    call.d.homed = true;
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  return 0;
}
EXPORT int drdAutoInit(Id id) { return Home(__func__, id); }
EXPORT int drdCheckInit(Id id) { return Home(__func__, id); }
EXPORT int drdPrecisionInit(Id id) { return Home(__func__, id); }
EXPORT int drdStart(Id id) {
  DEVICE_CALL();
  return d.homed ? 0 : Fail(kNotReady);
}
EXPORT int drdStop(bool force, Id id) {
  DEVICE_CALL();
  if (force) {
    d.force_on = true;
    d.force_off_cause = kNotOff;
    d.command_time = Now();
  } else {
    d.TurnForceOff(kBySoftware);
  }
  return 0;
}
EXPORT void drdWaitForTick(Id) {
  std::this_thread::sleep_for(std::chrono::microseconds(250));
}

// What is read.

EXPORT int dhdGetButton(int index, Id id) {
  DEVICE_CALL();
  if (index != 0) return 0;
  if (!d.has_gripper()) return d.button;
  return d.emulates_button && (d.button || d.gripper < 0.02);
}
EXPORT unsigned int dhdGetButtonMask(Id id) {
  const Call call(__func__, id);
  const Device& d = call.d;
  if (call.fails()) return 0;
  if (!d.has_gripper()) return d.button;
  return d.emulates_button && (d.button || d.gripper < 0.02);
}
EXPORT int dhdGetPosition(double* x, double* y, double* z, Id id) {
  DEVICE_CALL();
  const Vector p = d.ReadPosition();
  *x = p[0];
  *y = p[1];
  *z = p[2];
  return 0;
}
EXPORT int dhdGetOrientationFrame(double* rows, Id id) {
  DEVICE_CALL();
  const std::array<double, 9> r = d.Rotation();
  std::copy(r.begin(), r.end(), rows);
  return 0;
}
EXPORT int dhdGetPositionAndOrientationFrame(double* x, double* y, double* z,
                                             double* rows, Id id) {
  if (dhdGetPosition(x, y, z, id) < 0) return -1;
  return dhdGetOrientationFrame(rows, id);
}
EXPORT int dhdGetLinearVelocity(double* x, double* y, double* z, Id id) {
  DEVICE_CALL();
  if (d.velocities_to_fail > 0) {
    --d.velocities_to_fail;
    return Fail(kTimeout);
  }
  const Vector v = d.WindowVelocity();
  *x = v[0];
  *y = v[1];
  *z = v[2];
  return 0;
}
EXPORT int dhdGetAngularVelocityRad(double* x, double* y, double* z, Id id) {
  DEVICE_CALL();
  *x = *y = *z = 0;
  return 0;
}
EXPORT int dhdGetGripperAngleRad(double* angle, Id id) {
  DEVICE_CALL();
  if (!d.has_gripper()) return Fail(kNotAvailable);
  *angle = d.GripperAngle();
  return 0;
}
EXPORT int dhdGetGripperAngleDeg(double* angle, Id id) {
  const int result = dhdGetGripperAngleRad(angle, id);
  *angle *= 180 / M_PI;
  return result;
}
EXPORT int dhdGetGripperGap(double* gap, Id id) {
  DEVICE_CALL();
  if (!d.has_gripper()) return Fail(kNotAvailable);
  *gap = kGripperLength * d.GripperAngle();
  return 0;
}
EXPORT int drdGetPositionAndOrientation(double* x, double* y, double* z,
                                        double* a, double* b, double* c,
                                        double* gap, double* rows, Id id) {
  *a = *b = *c = 0;
  *gap = 0;
  return dhdGetPositionAndOrientationFrame(x, y, z, rows, id);
}
EXPORT int drdGetVelocity(double* x, double* y, double* z, double* a, double* b,
                          double* c, double* gap, Id id) {
  *a = *b = *c = 0;
  *gap = 0;
  return dhdGetLinearVelocity(x, y, z, id);
}
EXPORT int dhdGetForceAndTorqueAndGripperForce(double* fx, double* fy,
                                               double* fz, double* tx,
                                               double* ty, double* tz,
                                               double* gripper, Id id) {
  DEVICE_CALL();
  const std::array<double*, 6> to{fx, fy, fz, tx, ty, tz};
  for (int i = 0; i < 6; ++i) *to[i] = d.commanded[i];
  *gripper = d.gripper_force;
  return 0;
}
EXPORT int dhdGetForceAndTorque(double* fx, double* fy, double* fz, double* tx,
                                double* ty, double* tz, Id id) {
  double gripper = 0;
  return dhdGetForceAndTorqueAndGripperForce(fx, fy, fz, tx, ty, tz, &gripper,
                                             id);
}
EXPORT int dhdGetForce(double* fx, double* fy, double* fz, Id id) {
  double t[3];
  return dhdGetForceAndTorque(fx, fy, fz, &t[0], &t[1], &t[2], id);
}

// What is commanded.

EXPORT int dhdSetForce(double fx, double fy, double fz, Id id) {
  return Command(__func__, id, {fx, fy, fz, 0, 0, 0}, 0);
}
EXPORT int dhdSetForceAndGripperForce(double fx, double fy, double fz,
                                      double gripper, Id id) {
  return Command(__func__, id, {fx, fy, fz, 0, 0, 0}, gripper);
}
EXPORT int dhdSetForceAndTorque(double fx, double fy, double fz, double tx,
                                double ty, double tz, Id id) {
  return Command(__func__, id, {fx, fy, fz, tx, ty, tz}, 0);
}
EXPORT int dhdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz,
                                               double tx, double ty, double tz,
                                               double gripper, Id id) {
  return Command(__func__, id, {fx, fy, fz, tx, ty, tz}, gripper);
}
EXPORT int drdSetForceAndTorqueAndGripperForce(double fx, double fy, double fz,
                                               double tx, double ty, double tz,
                                               double gripper, Id id) {
  return Command(__func__, id, {fx, fy, fz, tx, ty, tz}, gripper);
}

// The rest of the interface.

#define STUB(result, name, arguments) \
  EXPORT result name arguments { return NotImplemented(__func__); }

STUB(int, dhdCheckControllerMemory, (Id))
STUB(int, dhdConfigAngularVelocity, (int, int, Id))
STUB(int, dhdConfigGripperVelocity, (int, int, Id))
STUB(int, dhdControllerSetDevice, (int, Id))
STUB(int, dhdDeltaEncoderToPosition,
     (int, int, int, double*, double*, double*, Id))
STUB(int, dhdDeltaEncodersToJointAngles,
     (int, int, int, double*, double*, double*, Id))
STUB(int, dhdDeltaForceToMotor,
     (double, double, double, int, int, int, unsigned short*, unsigned short*,
      unsigned short*, Id))
STUB(int, dhdDeltaGravityJointTorques,
     (double, double, double, double*, double*, double*, Id))
STUB(int, dhdDeltaJointAnglesToEncoders,
     (double, double, double, int*, int*, int*, Id))
STUB(int, dhdDeltaJointAnglesToJacobian, (double, double, double, double*, Id))
STUB(int, dhdDeltaJointTorquesExtrema,
     (double, double, double, double*, double*, Id))
STUB(int, dhdDeltaMotorToForce,
     (unsigned short, unsigned short, unsigned short, int, int, int, double*,
      double*, double*, Id))
STUB(int, dhdDeltaPositionToEncoder,
     (double, double, double, int*, int*, int*, Id))
STUB(int, dhdEnableGripperForce, (unsigned char, Id))
STUB(int, dhdGetAngularVelocityDeg, (double*, double*, double*, Id))
STUB(int, dhdGetBaseAngleXDeg, (double*, Id))
STUB(int, dhdGetBaseAngleXRad, (double*, Id))
STUB(int, dhdGetBaseAngleZDeg, (double*, Id))
STUB(int, dhdGetBaseAngleZRad, (double*, Id))
STUB(int, dhdGetComponentVersionStr, (uint32_t, char*, size_t, Id))
STUB(int, dhdGetDeltaEncoders, (int*, int*, int*, Id))
STUB(int, dhdGetDeltaJacobian, (double*, Id))
STUB(int, dhdGetDeltaJointAngles, (double*, double*, double*, Id))
STUB(int, dhdGetDeviceAngleDeg, (double*, Id))
STUB(int, dhdGetDeviceAngleRad, (double*, Id))
STUB(int, dhdGetEffectorMass, (double*, Id))
STUB(int, dhdGetEnc, (int*, unsigned char, Id))
STUB(int, dhdGetEncRange, (int*, int*, Id))
STUB(int, dhdGetEncVelocities, (double*, Id))
STUB(int, dhdGetEncoder, (int, Id))
STUB(int, dhdGetGripperAngularVelocityDeg, (double*, Id))
STUB(int, dhdGetGripperAngularVelocityRad, (double*, Id))
STUB(int, dhdGetGripperEncoder, (int*, Id))
STUB(int, dhdGetGripperFingerPos, (double*, double*, double*, Id))
STUB(int, dhdGetGripperLinearVelocity, (double*, Id))
STUB(int, dhdGetGripperThumbPos, (double*, double*, double*, Id))
STUB(int, dhdGetJointAngleRange, (double*, double*, Id))
STUB(int, dhdGetJointAngles, (double*, Id))
STUB(int, dhdGetJointVelocities, (double*, Id))
STUB(int, dhdGetOrientationDeg, (double*, double*, double*, Id))
STUB(int, dhdGetOrientationRad, (double*, double*, double*, Id))
STUB(int, dhdGetPositionAndOrientationDeg,
     (double*, double*, double*, double*, double*, double*, Id))
STUB(int, dhdGetPositionAndOrientationRad,
     (double*, double*, double*, double*, double*, double*, Id))
STUB(int, dhdGetVelocityThreshold, (unsigned int*, Id))
STUB(int, dhdGetWristEncoders, (int*, int*, int*, Id))
STUB(int, dhdGetWristJacobian, (double*, Id))
STUB(int, dhdGetWristJointAngles, (double*, double*, double*, Id))
STUB(int, dhdGripperAngleRadToEncoder, (double, int*, Id))
STUB(int, dhdGripperEncoderToAngleRad, (int, double*, Id))
STUB(int, dhdGripperEncoderToGap, (int, double*, Id))
STUB(int, dhdGripperForceToMotor, (double, unsigned short*, int*, Id))
STUB(int, dhdGripperGapToEncoder, (double, int*, Id))
STUB(int, dhdGripperMotorToForce, (unsigned short, double*, int*, Id))
STUB(int, dhdJointAnglesToGravityJointTorques,
     (double*, double*, unsigned char, Id))
STUB(int, dhdJointAnglesToInertiaMatrix, (double*, double*, Id))
STUB(int, dhdPreloadMot, (unsigned short*, unsigned char, Id))
STUB(int, dhdPreset, (int*, unsigned char, Id))
STUB(int, dhdReadConfigFromFile, (char*, Id))
STUB(int, dhdSetBaseAngleXDeg, (double, Id))
STUB(int, dhdSetBaseAngleXRad, (double, Id))
STUB(int, dhdSetBaseAngleZDeg, (double, Id))
STUB(int, dhdSetBaseAngleZRad, (double, Id))
STUB(int, dhdSetBrk, (unsigned char, Id))
STUB(int, dhdSetComMode, (int, Id))
STUB(int, dhdSetDeltaJointTorques, (double, double, double, Id))
STUB(int, dhdSetDeltaMotor,
     (unsigned short, unsigned short, unsigned short, Id))
STUB(int, dhdSetDeviceAngleDeg, (double, Id))
STUB(int, dhdSetDeviceAngleRad, (double, Id))
STUB(int, dhdSetEffectorMass, (double, Id))
STUB(int, dhdSetForceAndWristJointTorques,
     (double, double, double, double, double, double, Id))
STUB(int, dhdSetForceAndWristJointTorquesAndGripperForce,
     (double, double, double, double, double, double, double, Id))
STUB(int, dhdSetGripperMotor, (unsigned short, Id))
STUB(int, dhdSetJointTorques, (double*, unsigned char, Id))
STUB(int, dhdSetMaxForce, (double, Id))
STUB(int, dhdSetMaxGripperForce, (double, Id))
STUB(int, dhdSetMaxTorque, (double, Id))
STUB(int, dhdSetMot, (unsigned short*, unsigned char, Id))
STUB(int, dhdSetMotor, (int, unsigned short, Id))
STUB(int, dhdSetOutput, (unsigned int, Id))
STUB(int, dhdSetStandardGravity, (double, Id))
STUB(int, dhdSetTimeGuard, (int, Id))
STUB(int, dhdSetVibration, (double, double, int, Id))
STUB(int, dhdSetWristJointTorques, (double, double, double, Id))
STUB(int, dhdSetWristMotor,
     (unsigned short, unsigned short, unsigned short, Id))
STUB(int, dhdUpdateEncoders, (Id))
STUB(int, dhdWaitForReset, (int, Id))
STUB(int, dhdWristEncoderToOrientation,
     (int, int, int, double*, double*, double*, Id))
STUB(int, dhdWristEncodersToJointAngles,
     (int, int, int, double*, double*, double*, Id))
STUB(int, dhdWristGravityJointTorques,
     (double, double, double, double*, double*, double*, Id))
STUB(int, dhdWristJointAnglesToEncoders,
     (double, double, double, int*, int*, int*, Id))
STUB(int, dhdWristJointAnglesToJacobian, (double, double, double, double*, Id))
STUB(int, dhdWristJointTorquesExtrema,
     (double, double, double, double*, double*, Id))
STUB(int, dhdWristMotorToTorque,
     (unsigned short, unsigned short, unsigned short, int, int, int, double*,
      double*, double*, Id))
STUB(int, dhdWristOrientationToEncoder,
     (double, double, double, int*, int*, int*, Id))
STUB(int, dhdWristTorqueToMotor,
     (double, double, double, int, int, int, unsigned short*, unsigned short*,
      unsigned short*, Id))
STUB(int, drdEnableFilter, (bool, Id))
STUB(int, drdGetEncMoveParam, (double*, double*, double*, Id))
STUB(int, drdGetEncTrackParam, (double*, double*, double*, Id))
STUB(int, drdGetGripMoveParam, (double*, double*, double*, Id))
STUB(int, drdGetGripTrackParam, (double*, double*, double*, Id))
STUB(int, drdGetPosMoveParam, (double*, double*, double*, Id))
STUB(int, drdGetPosTrackParam, (double*, double*, double*, Id))
STUB(int, drdGetPriorities, (int*, int*, Id))
STUB(int, drdGetRotMoveParam, (double*, double*, double*, Id))
STUB(int, drdGetRotTrackParam, (double*, double*, double*, Id))
STUB(int, drdHold, (Id))
STUB(int, drdLock, (unsigned char, bool, Id))
STUB(int, drdMoveTo, (double*, bool, Id))
STUB(int, drdMoveToAllEnc, (int*, bool, Id))
STUB(int, drdMoveToEnc, (int, int, int, bool, Id))
STUB(int, drdMoveToGrip, (double, bool, Id))
STUB(int, drdMoveToPos, (double, double, double, bool, Id))
STUB(int, drdMoveToRot, (double, double, double, bool, Id))
STUB(int, drdRegulateGrip, (bool, Id))
STUB(int, drdRegulatePos, (bool, Id))
STUB(int, drdRegulateRot, (bool, Id))
STUB(int, drdSetEncDGain, (double, Id))
STUB(int, drdSetEncIGain, (double, Id))
STUB(int, drdSetEncMoveParam, (double, double, double, Id))
STUB(int, drdSetEncPGain, (double, Id))
STUB(int, drdSetEncTrackParam, (double, double, double, Id))
STUB(int, drdSetForceAndWristJointTorquesAndGripperForce,
     (double, double, double, double, double, double, double, Id))
STUB(int, drdSetGripMoveParam, (double, double, double, Id))
STUB(int, drdSetGripTrackParam, (double, double, double, Id))
STUB(int, drdSetMotRatioMax, (double, Id))
STUB(int, drdSetPosMoveParam, (double, double, double, Id))
STUB(int, drdSetPosTrackParam, (double, double, double, Id))
STUB(int, drdSetPriorities, (int, int, Id))
STUB(int, drdSetRotMoveParam, (double, double, double, Id))
STUB(int, drdSetRotTrackParam, (double, double, double, Id))
STUB(int, drdTrack, (double*, Id))
STUB(int, drdTrackAllEnc, (int*, Id))
STUB(int, drdTrackEnc, (int, int, int, Id))
STUB(int, drdTrackGrip, (double, Id))
STUB(int, drdTrackPos, (double, double, double, Id))
STUB(int, drdTrackRot, (double, double, double, Id))
STUB(double, dhdGetComFreq, (Id))
STUB(double, dhdGetMaxForce, (Id))
STUB(double, dhdGetMaxGripperForce, (Id))
STUB(double, dhdGetMaxTorque, (Id))
STUB(double, drdGetCtrlFreq, (Id))
STUB(double, drdGetEncDGain, (Id))
STUB(double, drdGetEncIGain, (Id))
STUB(double, drdGetEncPGain, (Id))
STUB(double, drdGetMotRatioMax, (Id))

// For tests. As a device and its user would.

EXPORT void standInReset() {
  const std::lock_guard lock(Mutex());
  TheDevice().Reset();
}

/** `calls` of the device from now on it is unplugged; 0: now; -1: plugged in.
 */
EXPORT void standInUnplugAfter(long calls) {
  const std::lock_guard lock(Mutex());
  TheDevice().calls_left = calls;
  TheDevice().unplugged = false;
  if (calls == 0) TheDevice().Unplug();
}

/** "t x y z; t x y z; ...", s since opening or this call, and m; in between it
is linear. */
EXPORT void standInSetPath(const char* path) {
  const std::lock_guard lock(Mutex());
  TheDevice().SetPath(path);
}

EXPORT void standInSetYaw(double angle) {
  const std::lock_guard lock(Mutex());
  TheDevice().yaw = angle;
}

EXPORT void standInSetGripper(double angle) {
  const std::lock_guard lock(Mutex());
  TheDevice().gripper = angle;
}

EXPORT void standInPressButton(int pressed) {
  const std::lock_guard lock(Mutex());
  TheDevice().button = pressed != 0;
}

EXPORT void standInSetType(int type) {
  const std::lock_guard lock(Mutex());
  TheDevice().type = type;
}

EXPORT void standInSetHomed(int homed) {
  const std::lock_guard lock(Mutex());
  TheDevice().homed = homed != 0;
}

/** The next `times` calls of a function fail; -1: all. */
EXPORT void standInFail(const char* function, int times) {
  const std::lock_guard lock(Mutex());
  TheDevice().failures[function] = times;
}

/** Positions are read as 1: not a number, 2: far away, 0: what they are. */
EXPORT void standInCorrupt(int kind) {
  const std::lock_guard lock(Mutex());
  TheDevice().corruption = kind;
}

/** The next call takes so long, s. */
EXPORT void standInDelay(double seconds) {
  const std::lock_guard lock(Mutex());
  TheDevice().delay = seconds;
}

/** What acts on the hand: force and moment, N and N m, and force between the
fingers, N. */
EXPORT void standInGetForce(double* force) {
  const std::lock_guard lock(Mutex());
  Device& d = TheDevice();
  d.Advance();
  const Vector acting = d.ActingForce();
  std::copy(acting.begin(), acting.end(), force);
  std::copy(d.commanded.begin() + 3, d.commanded.end(), force + 3);
  force[6] = d.gripper_force;
}

/** How often a function was called. */
EXPORT long standInCount(const char* function) {
  const std::lock_guard lock(Mutex());
  return TheDevice().counts[function];
}
