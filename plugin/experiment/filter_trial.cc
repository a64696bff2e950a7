// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/filter_trial.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "dual_proxy/common/random.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/simulation/point_robot.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kStep = 0.001;
constexpr double kProxyStiffness = 500;  // N/m: k_vir of the robot side.
constexpr double kContactForce = 0.5;    // N: contact counts from here.
constexpr double kDegree = std::numbers::pi / 180;

/** Numbers of the trial that its seed decides. */
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  double Uniform(double low, double high) {
    return low + (high - low) * random_.Uniform();
  }
  Vector3d Normal3() {
    const double x = random_.Normal();
    const double y = random_.Normal();
    return {x, y, random_.Normal()};
  }
  Matrix3d Rotation() {
    Eigen::Vector4d q;
    for (double& component : q) component = random_.Normal();
    return Eigen::Quaterniond(q.normalized()).toRotationMatrix();
  }

 private:
  RandomStream random_;
};

/** The intended positions of the tool, one for every control period. */
class Path {
 public:
  explicit Path(const Vector3d& start) : points_{start} {}

  /** Minimum jerk to `goal`, `speed` on average. */
  void MoveTo(const Vector3d& goal, double speed) {
    const Vector3d start = points_.back();
    const double distance = (goal - start).norm();
    const int steps =
        std::max(1, static_cast<int>(std::ceil(distance / speed / kStep)));
    for (int i = 1; i <= steps; ++i) {
      const double s = static_cast<double>(i) / steps;
      points_.emplace_back(start + s * s * s * (10 + s * (6 * s - 15)) *
                                       (goal - start));
    }
  }
  void Hold(double time) {
    points_.insert(points_.end(), static_cast<std::size_t>(time / kStep),
                   points_.back());
  }
  /** Along the circle of `radius` about the x axis, from the angle where the
  path is to `end` (rad, from z), moving `along` (m) in x. */
  void Turn(double radius, double end, double along, double speed) {
    const Vector3d start = points_.back();
    const double begin = std::atan2(start.y(), start.z());
    const double length = std::hypot((end - begin) * radius, along);
    const int steps =
        std::max(1, static_cast<int>(std::ceil(length / speed / kStep)));
    for (int i = 1; i <= steps; ++i) {
      const double u = static_cast<double>(i) / steps;
      const double s = u * u * (3 - 2 * u);
      const double angle = begin + s * (end - begin);
      points_.emplace_back(start.x() + s * along, radius * std::sin(angle),
                           radius * std::cos(angle));
    }
  }
  const std::vector<Vector3d>& points() const { return points_; }

 private:
  std::vector<Vector3d> points_;
};

struct Setting {
  ContactSceneParams scene;
  std::vector<Vector3d> path;
  Matrix3d R;  // Turns the scene's own frame into B.
};

ContactSurfaceParams MakePlane(const Vector3d& position, const Vector3d& up) {
  ContactSurfaceParams plane;
  plane.position = position;
  plane.rotation =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), up).matrix();
  return plane;
}

/** Scene and path in the scene's own frame: z is up, the floor at 0. */
Setting MakeSetting(const FilterTrialParams& params, Dice* dice) {
  Setting setting;
  setting.R = dice->Rotation();
  const double depth = params.force / kProxyStiffness;
  const double v = params.speed;
  const double radius = dice->Uniform(0.005, 0.02);
  setting.scene.tool_radius = radius;
  const double approach = dice->Uniform(0.02, 0.06);
  const double stiffness = dice->Uniform(3000, 20000);
  const double dissipation = dice->Uniform(1, 5);
  const double hold = params.hold_time;
  auto& surfaces = setting.scene.surfaces;
  const double side = dice->Uniform(-0.01, 0.01);
  const double low = radius - depth;
  const double high = radius + 0.02;
  Path path({side, 0, high});
  switch (params.scene) {
    case FilterTrialScene::kFree:
      for (int i = 0; i < 30; ++i) {
        path.MoveTo({dice->Uniform(-0.2, 0.2), dice->Uniform(-0.2, 0.2),
                     dice->Uniform(-0.2, 0.2)},
                    dice->Uniform(0.02, 0.3));
        path.Hold(0.2);
      }
      break;
    case FilterTrialScene::kPlane:
    case FilterTrialScene::kStill:
    case FilterTrialScene::kGrazing: {
      surfaces.push_back(MakePlane({0, 0, 0}, Vector3d::UnitZ()));
      if (params.scene == FilterTrialScene::kGrazing) {
        path.MoveTo({0.15, 0.02, low}, v);
        path.MoveTo({0.05, 0.1, low}, v);
        path.MoveTo({-0.1, 0.1, high}, v);
        break;
      }
      path.MoveTo({0, 0, low}, approach);
      path.Hold(hold);
      if (params.scene == FilterTrialScene::kPlane) {
        const double size = 1.5 * v;
        for (int lap = 0; lap < 2; ++lap) {
          path.MoveTo({size, dice->Uniform(-0.5, 0.5) * size, low}, v);
          path.MoveTo({dice->Uniform(0.2, 0.8) * size, size, low}, v);
          path.Hold(0.3);
          path.MoveTo({0, 0, low}, v);
        }
      }
      path.MoveTo({0, 0, high}, approach);
      path.Hold(0.5);
      break;
    }
    case FilterTrialScene::kSoft:
      surfaces.push_back(MakePlane({0, 0, 0}, Vector3d::UnitZ()));
      path.MoveTo({0, 0, low - params.force / 1000}, 0.3 * approach);
      path.Hold(hold);
      path.MoveTo({2 * v, 0, low - params.force / 1000}, v);
      path.MoveTo({2 * v, 0, high}, approach);
      path.Hold(0.5);
      break;
    case FilterTrialScene::kCylinder: {
      ContactSurfaceParams cylinder;
      cylinder.shape = SurfaceShape::kCylinder;
      cylinder.radius = 0.1;
      surfaces.push_back(cylinder);
      // The tool's centre runs on a larger circle than its point of contact;
      // the stated speed is that of the contact.
      const double reach = 0.1 + radius - depth;
      const double fast = v * reach / 0.1;
      path = Path({side, 0, reach + 0.02});
      path.MoveTo({side, 0, reach}, approach);
      path.Hold(hold);
      for (int lap = 0; lap < 2; ++lap) {
        const double tilt = dice->Uniform(-0.1, 0.1);
        path.Turn(reach, dice->Uniform(30, 70) * kDegree, tilt, fast);
        path.Hold(0.2);
        path.Turn(reach, dice->Uniform(-70, -30) * kDegree, -tilt, fast);
      }
      const Vector3d end = path.points().back();
      path.MoveTo(end * (1 + 0.04 / end.norm()), approach);
      path.Hold(0.5);
      break;
    }
    case FilterTrialScene::kInnerCorner: {
      const double lean = dice->Uniform(-20, 20) * kDegree;
      const Vector3d wall_up{-std::cos(lean), 0, std::sin(lean)};
      surfaces.push_back(MakePlane({0, 0, 0}, Vector3d::UnitZ()));
      surfaces.push_back(MakePlane({0.08, 0, 0}, wall_up));
      // Where the tool's centre is with both depths.
      const double x = 0.08 + low * (1 - wall_up.z()) / wall_up.x();
      path.MoveTo({0, 0, low}, approach);
      path.Hold(hold);
      path.MoveTo({x - 0.04, 0.01, low}, v);
      path.MoveTo({x, 0.02, low}, v);
      path.Hold(hold);
      path.MoveTo({x, 0.02 + 1.5 * v, low}, v);
      path.Hold(0.3);
      path.MoveTo({x, 0.02, low}, v);
      if (dice->Uniform(0, 1) < 0.5) {
        path.MoveTo({x - 0.05, 0, low}, v);
        path.Hold(0.3);
        path.MoveTo({x - 0.05, 0, high}, approach);
      } else {
        // Up the wall, keeping its depth.
        const Vector3d up{wall_up.z(), 0, -wall_up.x()};
        const Vector3d start = path.points().back();
        path.MoveTo(start + 0.06 * up, v);
        path.Hold(0.3);
        path.MoveTo(start + 0.06 * up + 0.04 * wall_up, approach);
      }
      path.Hold(0.5);
      break;
    }
    case FilterTrialScene::kStepEdge: {
      const double height = 0.05;
      ContactSurfaceParams box;
      box.shape = SurfaceShape::kBox;
      box.half_size = {0.1, 0.5, 0.5 * height};
      box.position = {0.16, 0, 0.5 * height};
      surfaces.push_back(MakePlane({0, 0, 0}, Vector3d::UnitZ()));
      surfaces.push_back(box);
      const double x = 0.06 - low;
      path.MoveTo({0, 0, low}, approach);
      path.Hold(hold);
      path.MoveTo({x, 0.02, low}, v);
      path.Hold(0.5 * hold);
      path.MoveTo({x, 0.02 + v, low}, v);
      path.MoveTo({x, 0.02, low}, v);
      path.MoveTo({x, 0.02, height + low}, v);
      path.MoveTo({x + 0.08, 0.04, height + low}, v);
      path.Hold(0.3);
      path.MoveTo({x + 0.08, 0.04, height + high}, approach);
      path.Hold(0.5);
      break;
    }
  }
  for (ContactSurfaceParams& surface : surfaces) {
    surface.stiffness = params.scene == FilterTrialScene::kSoft
                            ? dice->Uniform(400, 1500)
                            : stiffness;
    surface.dissipation = dissipation;
    surface.friction = params.friction;
    surface.stiction_speed = 0.002;
    surface.position = setting.R * surface.position;
    surface.rotation = setting.R * surface.rotation;
  }
  setting.path.reserve(path.points().size());
  for (const Vector3d& point : path.points()) {
    setting.path.emplace_back(setting.R * point);
  }
  return setting;
}

/** What one control period of a trial came to. */
struct Tick {
  Vector3d velocity;
  Vector3d sensed_force;
  Vector3d motion_force;
  Vector3d contact_force;
  SceneContact contact;
};

/** The point robot of the paper, section V.C, with its unified controller. */
class DynamicPlant {
 public:
  DynamicPlant(const Setting& setting, Dice* dice)
      : robot_({}, setting.scene),
        state_(robot_.MakeState(setting.path.front())),
        last_goal_(setting.path.front()),
        stiffness_(std::pow(10, dice->Uniform(2, 3.3))),
        damping_(2 * std::sqrt(stiffness_)) {}

  const SceneContact& contact() const { return state_.contact; }

  Tick Update(const Vector3d& goal, const Matrix3d& Omega_f) {
    const Matrix3d Omega_m = Matrix3d::Identity() - Omega_f;
    const Vector3d goal_velocity = (goal - last_goal_) / kStep;
    last_goal_ = goal;
    const Vector3d pull = Omega_f * (kProxyStiffness * (goal - state_.position));
    if ((Omega_f - Omega_f_).norm() > 1e-9) {
      // Bumpless: what is new in force space starts at the sensed force.
      const bool is_new = Omega_f.trace() > Omega_f_.trace() + 0.5;
      reference_ = Omega_f * (is_new ? state_.contact.force : reference_);
      Omega_f_ = Omega_f;
    }
    const Vector3d change = pull - reference_;
    constexpr double kRate = 50 * kStep;
    reference_ += change * std::min(1.0, kRate / std::max(change.norm(), 1e-12));
    Tick tick;
    tick.motion_force =
        Omega_m * (stiffness_ * (goal - state_.position) -
                   damping_ * (state_.velocity - goal_velocity));
    tick.contact_force = reference_ - Omega_f * (60 * state_.velocity);
    robot_.Update(tick.motion_force + tick.contact_force, &state_);
    tick.velocity = state_.velocity;
    tick.sensed_force = state_.contact.force;
    tick.contact = state_.contact;
    return tick;
  }

 private:
  PointRobot robot_;
  PointRobotState state_;
  Vector3d last_goal_;
  double stiffness_;
  double damping_;
  Matrix3d Omega_f_{Matrix3d::Zero()};
  Vector3d reference_{Vector3d::Zero()};
};

/** A tool without dynamics: where the path runs inside a surface, the tool is on
it, and presses as the spring to the path does. */
class KinematicPlant {
 public:
  explicit KinematicPlant(const Setting& setting)
      : tool_radius_(setting.scene.tool_radius),
        position_(setting.path.front()) {
    for (const ContactSurfaceParams& surface : setting.scene.surfaces) {
      surfaces_.emplace_back(surface);
      friction_ = surface.friction;
    }
  }

  Tick Update(const Vector3d& goal) {
    Vector3d position = goal;
    for (int i = 0; i < 20; ++i) {
      for (const ContactSurface& surface : surfaces_) {
        const SurfaceContact touch =
            surface.Calc(position, Vector3d::Zero(), tool_radius_);
        position -= std::max(0.0, touch.penetration) * touch.normal;
      }
    }
    Tick tick;
    tick.velocity = (position - position_) / kStep;
    position_ = position;
    const Vector3d push = kProxyStiffness * (goal - position);
    tick.contact = {};
    // Share the push among what the tool touches.
    Eigen::Matrix<double, 3, 8> normals;
    int count = 0;
    for (const ContactSurface& surface : surfaces_) {
      const SurfaceContact touch =
          surface.Calc(position + 1e-6 * push, Vector3d::Zero(), tool_radius_);
      if (touch.penetration > -1e-6 && touch.normal.dot(push) > 0) {
        normals.col(count++) = touch.normal;
      }
    }
    Vector3d rest = push;
    double total = 0;
    if (count > 0 && push.norm() > 1e-6) {
      Eigen::Matrix<double, 8, 1> share = Eigen::Matrix<double, 8, 1>::Zero();
      for (int sweep = 0; sweep < 100; ++sweep) {
        for (int i = 0; i < count; ++i) {
          const double more =
              std::max(-share(i), normals.col(i).dot(rest));
          share(i) += more;
          rest -= more * normals.col(i);
        }
      }
      for (int i = 0; i < count; ++i) {
        if (!(share(i) > 1e-3)) continue;
        tick.contact.normals.col(tick.contact.count) = normals.col(i);
        tick.contact.normal_forces(tick.contact.count) = share(i);
        ++tick.contact.count;
        tick.contact.normal += share(i) * normals.col(i);
        total += share(i);
      }
      tick.contact.dimension = std::min(tick.contact.count, 3);
    }
    const Vector3d friction = friction_ * total * tick.velocity /
                              std::max(tick.velocity.norm(), 0.002);
    tick.contact.force = tick.contact.normal + friction;
    if (total > 0) tick.contact.normal.normalize();
    tick.sensed_force = tick.contact.force;
    tick.motion_force = friction + 2 * tick.velocity;
    tick.contact_force = tick.contact.force - friction;
    return tick;
  }

 private:
  std::vector<ContactSurface> surfaces_;
  double tool_radius_{0};
  double friction_{0};
  Vector3d position_;
};

/** The free axis (dimension 2), the normal (1), or zero. */
Vector3d CalcTrueAxis(const SceneContact& contact) {
  if (contact.dimension == 1) return contact.normal;
  if (contact.dimension != 2) return Vector3d::Zero();
  for (int i = 1; i < contact.count; ++i) {
    const Vector3d axis =
        Vector3d(contact.normals.col(0)).cross(Vector3d(contact.normals.col(i)));
    if (axis.norm() > 0.1) return axis.normalized();
  }
  return Vector3d::Zero();
}

Matrix3d CalcTrueSelection(const SceneContact& contact) {
  const Vector3d axis = CalcTrueAxis(contact);
  switch (contact.dimension) {
    case 0:
      return Matrix3d::Zero();
    case 1:
      return axis * axis.transpose();
    case 2:
      return Matrix3d::Identity() - axis * axis.transpose();
    default:
      return Matrix3d::Identity();
  }
}

double CalcDirectionError(const FilterTrialSample& sample,
                          const Matrix3d& force_selection) {
  if (sample.dimension == 0 || sample.true_dimension == 0) {
    return std::numeric_limits<double>::quiet_NaN();
  }
  const Matrix3d& U = sample.singular_vectors;
  double cosine = 0;
  if (sample.dimension == sample.true_dimension && sample.dimension < 3) {
    const Vector3d axis = sample.dimension == 1 ? U.col(0) : U.col(2);
    cosine = std::abs(axis.dot(sample.true_axis));
  } else {
    cosine = (force_selection * sample.true_normal).norm();
  }
  return std::acos(std::min(1.0, cosine));
}

}  // namespace

void FilterTrialParams::Validate() const {
  constexpr const char* kWho = "FilterTrialParams";
  ThrowUnlessInRange(kWho, "friction", friction, 0, 2);
  ThrowUnlessPositive(kWho, "speed", speed);
  ThrowUnlessPositive(kWho, "force", force);
  ThrowUnlessNonNegative(kWho, "force_noise", force_noise);
  ThrowUnlessNonNegative(kWho, "velocity_noise", velocity_noise);
  ThrowUnlessNonNegative(kWho, "hold_time", hold_time);
}

std::vector<FilterTrialSample> RunFilterTrial(
    const FilterTrialParams& params, const ForceSpaceParticleFilter& filter,
    std::uint64_t filter_seed) {
  params.Validate();
  Dice dice(params.seed);
  const Setting setting = MakeSetting(params, &dice);
  DynamicPlant dynamic(setting, &dice);
  KinematicPlant kinematic(setting);
  Dice noise(SplitSeed(params.seed, 1));
  ForceSpaceParticleFilterState state = filter.MakeState(filter_seed);
  const double period = filter.params().period;
  std::vector<Matrix3d> true_selections;
  std::vector<FilterTrialSample> samples;
  FilterTrialSample sum{};
  const auto reset = [&sum]() {
    sum.sensed_force.setZero();
    sum.velocity.setZero();
    sum.motion_force.setZero();
    sum.contact_force.setZero();
  };
  reset();
  int count = 0;
  const double phase = dice.Uniform(0, 1);
  double next = period * phase;
  for (std::size_t i = 0; i < setting.path.size(); ++i) {
    Tick tick;
    if (params.drive == FilterTrialDrive::kKinematic) {
      tick = kinematic.Update(setting.path[i]);
    } else {
      constexpr int kLate = 20;
      true_selections.push_back(CalcTrueSelection(dynamic.contact()));
      const Matrix3d Omega_f =
          params.drive == FilterTrialDrive::kClosedLoop ? state.force_selection
          : i < kLate                                   ? Matrix3d::Zero()
                                                        : true_selections[i - kLate];
      tick = dynamic.Update(setting.path[i], Omega_f);
    }
    sum.sensed_force += tick.sensed_force;
    sum.velocity += tick.velocity;
    sum.motion_force += tick.motion_force;
    sum.contact_force += tick.contact_force;
    ++count;
    const double time = static_cast<double>(i + 1) * kStep;
    if (time < next - 0.5 * kStep) continue;
    next += period;
    FilterTrialSample sample = sum;
    sample.time = time;
    sample.sensed_force =
        sum.sensed_force / count + params.force_noise * noise.Normal3();
    sample.velocity = sum.velocity / count + params.velocity_noise * noise.Normal3();
    sample.motion_force /= count;
    sample.contact_force /= count;
    reset();
    count = 0;
    filter.Update(sample.sensed_force, sample.velocity, sample.motion_force,
                  sample.contact_force, &state);
    sample.dimension = state.dimension;
    sample.singular_vectors = state.singular_vectors;
    sample.true_dimension = tick.contact.dimension;
    sample.true_force = tick.contact.force;
    sample.true_normal = tick.contact.normal;
    sample.true_axis = CalcTrueAxis(tick.contact);
    sample.direction_error = CalcDirectionError(sample, state.force_selection);
    samples.push_back(sample);
  }
  return samples;
}

void FilterTrialMetrics::Add(const std::vector<FilterTrialSample>& trial,
                             double period) {
  bool touched = false;
  bool was_contact = false;
  // Times since what the filter has yet to find; negative: nothing.
  double since_onset = -1;
  double since_end = -1;
  double since_second = -1;
  int last_true_dimension = 0;
  for (const FilterTrialSample& sample : trial) {
    const bool contact = sample.true_force.norm() > kContactForce;
    if (contact) {
      ++contact_samples;
      right_dimension_samples += sample.dimension == sample.true_dimension;
      if (std::isfinite(sample.direction_error)) {
        const double degrees = sample.direction_error / kDegree;
        direction_error.push_back(degrees);
        if (sample.dimension == 2 && sample.true_dimension == 2) {
          axis_error.push_back(degrees);
        }
      }
    }
    touched = touched || sample.true_force.norm() > 0;
    if (!touched) false_contact_samples += sample.dimension > 0;
    ++samples;

    if (contact && !was_contact) since_onset = 0;
    if (!contact && was_contact) since_end = 0;
    if (contact && sample.true_dimension == 2 && last_true_dimension == 1) {
      since_second = 0;
    }
    if (sample.true_dimension < 2) since_second = -1;
    const auto check = [period](bool done, double* since,
                                std::vector<double>* list) {
      if (*since < 0) return;
      if (done) {
        list->push_back(*since);
        *since = -1;
      } else {
        *since += period;
      }
    };
    if (!contact) since_onset = -1;
    if (contact) since_end = -1;
    check(sample.dimension > 0, &since_onset, &detection_latency);
    check(sample.dimension == 0, &since_end, &loss_latency);
    check(sample.dimension == 2, &since_second, &second_latency);
    was_contact = contact;
    last_true_dimension = sample.true_dimension;
  }
}

}  // namespace dual_proxy
