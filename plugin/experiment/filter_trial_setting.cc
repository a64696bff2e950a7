// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/filter_trial_setting.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kStep = kFilterTrialStep;
constexpr double kDegree = std::numbers::pi / 180;

/** The intended positions of the tool, one for every control period. */
class Path {
 public:
  explicit Path(const Vector3d& start) : points_{start} {}

  const std::vector<Vector3d>& points() const { return points_; }
  const Vector3d& end() const { return points_.back(); }

  /** Minimum jerk to `goal`, `speed` on average. */
  void MoveTo(const Vector3d& goal, double speed) {
    const Vector3d start = end();
    MoveAlong((goal - start).norm(), speed, [&](double u) -> Vector3d {
      return start + u * u * u * (10 + u * (6 * u - 15)) * (goal - start);
    });
  }

  void Hold(double time) {
    const auto steps = static_cast<std::size_t>(time / kStep);
    points_.insert(points_.end(), steps, Vector3d(end()));
  }

  /** Along the circle of `radius` about the x axis, from the angle where the
  path is to `goal` (rad, from z), moving `along` (m) in x. */
  void Turn(double radius, double goal, double along, double speed) {
    const Vector3d start = end();
    const double begin = std::atan2(start.y(), start.z());
    MoveAlong(std::hypot((goal - begin) * radius, along), speed, [&](double u) {
      const double s = u * u * (3 - 2 * u);
      const double angle = begin + s * (goal - begin);
      return Vector3d(start.x() + s * along, radius * std::sin(angle),
                      radius * std::cos(angle));
    });
  }

  /** By a quarter of a circle about `centre`, over its edge along y: from -x
  of it to +z. */
  void TurnOverEdge(const Vector3d& centre, double speed) {
    const double radius = (end() - centre).norm();
    constexpr double kQuarter = std::numbers::pi / 2;
    MoveAlong(kQuarter * radius, speed, [&](double u) -> Vector3d {
      return centre + radius * Vector3d(-std::cos(kQuarter * u), 0,
                                        std::sin(kQuarter * u));
    });
  }

 private:
  /** `point(u)` for u from 0 to 1 in as many steps as `length` (m) takes. */
  template <typename Point>
  void MoveAlong(double length, double speed, Point point) {
    const int steps =
        std::max(1, static_cast<int>(std::ceil(length / speed / kStep)));
    for (int i = 1; i <= steps; ++i) {
      points_.push_back(point(static_cast<double>(i) / steps));
    }
  }

  std::vector<Vector3d> points_;
};

Matrix3d DrawRotation(RandomStream* random) {
  Eigen::Vector4d q;
  for (double& component : q) component = random->Normal();
  return Eigen::Quaterniond(q.normalized()).toRotationMatrix();
}

ContactSurfaceParams MakePlane(const Vector3d& position, const Vector3d& up) {
  ContactSurfaceParams plane;
  plane.position = position;
  plane.rotation =
      Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), up).matrix();
  return plane;
}

/** Makes the setting of a trial in the scene's own frame: z is up, the floor is
at 0. The order of the random numbers is part of what a seed means. */
class SettingMaker {
 public:
  SettingMaker(const FilterTrialParams& params, RandomStream* random)
      : params_(params),
        random_(*random),
        radius_(Uniform(0.005, 0.02)),
        approach_(Uniform(0.02, 0.06)),
        stiffness_(Uniform(3000, 20000)),
        dissipation_(Uniform(1, 5)),
        side_(Uniform(-0.01, 0.01)) {}

  /** Sets up the scene, turned by R. */
  FilterTrialSetting Make(const Matrix3d& R) {
    MakeScene();
    FilterTrialSetting setting;
    setting.scene.tool_radius = radius_;
    for (ContactSurfaceParams surface : surfaces_) {
      surface.stiffness = params_.scene == FilterTrialScene::kSoft
                              ? Uniform(400, 1500)
                              : stiffness_;
      surface.dissipation = dissipation_;
      surface.friction = params_.friction;
      surface.stiction_speed = 0.002;
      surface.position = R * surface.position;
      surface.rotation = R * surface.rotation;
      setting.scene.surfaces.push_back(surface);
    }
    setting.path.reserve(path_.points().size());
    for (const Vector3d& point : path_.points()) {
      setting.path.emplace_back(R * point);
    }
    return setting;
  }

 private:
  double Uniform(double low, double high) {
    return DrawUniform(low, high, &random_);
  }

  void MakeScene() {
    switch (params_.scene) {
      case FilterTrialScene::kFree:
        return MakeFree();
      case FilterTrialScene::kPlane:
        return MakeFlat(/* slides = */ true);
      case FilterTrialScene::kCylinder:
        return MakeCylinder();
      case FilterTrialScene::kInnerCorner:
        return MakeInnerCorner();
      case FilterTrialScene::kStepEdge:
        return MakeStepEdge();
      case FilterTrialScene::kStill:
        return MakeFlat(/* slides = */ false);
      case FilterTrialScene::kGrazing:
        return MakeGrazing();
      case FilterTrialScene::kSoft:
        return MakeSoft();
    }
  }

  /** To `goal`, clear of every surface, and waits there. */
  void Leave(const Vector3d& goal) {
    path_.MoveTo(goal, approach_);
    path_.Hold(0.5);
  }

  void AddFloor() {
    surfaces_.push_back(MakePlane({0, 0, 0}, Vector3d::UnitZ()));
  }

  void MakeFree() {
    for (int i = 0; i < 30; ++i) {
      const double speed = Uniform(0.02, 0.3);
      const double x = Uniform(-0.2, 0.2);
      const double y = Uniform(-0.2, 0.2);
      path_.MoveTo({x, y, Uniform(-0.2, 0.2)}, speed);
      path_.Hold(0.2);
    }
  }

  void MakeFlat(bool slides) {
    AddFloor();
    path_.MoveTo({0, 0, low_}, approach_);
    path_.Hold(params_.hold_time);
    if (slides) {
      const double size = 1.5 * speed_;
      for (int lap = 0; lap < 2; ++lap) {
        path_.MoveTo({size, Uniform(-0.5, 0.5) * size, low_}, speed_);
        path_.MoveTo({Uniform(0.2, 0.8) * size, size, low_}, speed_);
        path_.Hold(0.3);
        path_.MoveTo({0, 0, low_}, speed_);
      }
    }
    Leave({0, 0, high_});
  }

  void MakeGrazing() {
    AddFloor();
    path_.MoveTo({0.15, 0.02, low_}, speed_);
    path_.MoveTo({0.05, 0.1, low_}, speed_);
    path_.MoveTo({-0.1, 0.1, high_}, speed_);
  }

  void MakeSoft() {
    AddFloor();
    const double sunk = low_ - params_.force / 1000;
    path_.MoveTo({0, 0, sunk}, 0.3 * approach_);
    path_.Hold(params_.hold_time);
    path_.MoveTo({2 * speed_, 0, sunk}, speed_);
    Leave({2 * speed_, 0, high_});
  }

  void MakeCylinder() {
    ContactSurfaceParams cylinder;
    cylinder.shape = SurfaceShape::kCylinder;
    cylinder.radius = 0.1;
    surfaces_.push_back(cylinder);
    // The tool's centre runs on a larger circle than its point of contact; the
    // stated speed is that of the contact.
    const double reach = cylinder.radius + low_;
    const double speed = speed_ * reach / cylinder.radius;
    path_ = Path({side_, 0, reach + 0.02});
    path_.MoveTo({side_, 0, reach}, approach_);
    path_.Hold(params_.hold_time);
    for (int lap = 0; lap < 2; ++lap) {
      const double tilt = Uniform(-0.1, 0.1);
      path_.Turn(reach, Uniform(30, 70) * kDegree, tilt, speed);
      path_.Hold(0.2);
      path_.Turn(reach, Uniform(-70, -30) * kDegree, -tilt, speed);
    }
    const Vector3d end = path_.end();
    Leave(end * (1 + 0.04 / end.norm()));
  }

  void MakeInnerCorner() {
    const double lean = Uniform(-20, 20) * kDegree;
    const Vector3d wall_up{-std::cos(lean), 0, std::sin(lean)};
    AddFloor();
    surfaces_.push_back(MakePlane({0.08, 0, 0}, wall_up));
    // Where the tool's centre is with both depths.
    const double x = 0.08 + low_ * (1 - wall_up.z()) / wall_up.x();
    path_.MoveTo({0, 0, low_}, approach_);
    path_.Hold(params_.hold_time);
    path_.MoveTo({x - 0.04, 0.01, low_}, speed_);
    path_.MoveTo({x, 0.02, low_}, speed_);
    path_.Hold(params_.hold_time);
    path_.MoveTo({x, 0.02 + 1.5 * speed_, low_}, speed_);
    path_.Hold(0.3);
    path_.MoveTo({x, 0.02, low_}, speed_);
    if (Uniform(0, 1) < 0.5) {
      path_.MoveTo({x - 0.05, 0, low_}, speed_);
      path_.Hold(0.3);
      Leave({x - 0.05, 0, high_});
    } else {
      // Up the wall, keeping its depth.
      const Vector3d up{wall_up.z(), 0, -wall_up.x()};
      const Vector3d top = path_.end() + 0.06 * up;
      path_.MoveTo(top, speed_);
      path_.Hold(0.3);
      Leave(top + 0.04 * wall_up);
    }
  }

  void MakeStepEdge() {
    const double height = 0.05;
    ContactSurfaceParams box;
    box.shape = SurfaceShape::kBox;
    box.half_size = {0.1, 0.5, 0.5 * height};
    box.position = {0.16, 0, 0.5 * height};
    AddFloor();
    surfaces_.push_back(box);
    const double x = 0.06 - low_;
    path_.MoveTo({0, 0, low_}, approach_);
    path_.Hold(params_.hold_time);
    path_.MoveTo({x, 0.02, low_}, speed_);
    path_.Hold(0.5 * params_.hold_time);
    path_.MoveTo({x, 0.02 + speed_, low_}, speed_);
    path_.MoveTo({x, 0.02, low_}, speed_);
    // The tool rolls over the edge, and does not snap over it, if the intended
    // position is less deep than its radius.
    const Vector3d edge{0.06, 0.02, height};
    path_.MoveTo(edge - Vector3d(std::max(low_, 0.5 * radius_), 0, 0), speed_);
    path_.TurnOverEdge(edge, 0.5 * speed_);
    // Up once more, for the robot that friction has left behind.
    path_.MoveTo(path_.end() + Vector3d(0, 0, 0.03), speed_);
    path_.Hold(0.3);
    path_.MoveTo({x + 0.08, 0.04, height + low_}, speed_);
    path_.Hold(0.3);
    Leave({x + 0.08, 0.04, height + high_});
  }

  const FilterTrialParams params_;
  RandomStream& random_;
  const double radius_;       // m: of the tool.
  const double approach_;     // m/s: of touching and lifting.
  const double stiffness_;    // N/m: of the surfaces.
  const double dissipation_;  // s/m
  const double side_;         // m: the tool begins aside.
  const double speed_{params_.speed};
  // m: the centre's intended height when pressing, and clear of the floor.
  const double low_{radius_ - params_.force / kFilterTrialStiffness};
  const double high_{radius_ + 0.02};
  std::vector<ContactSurfaceParams> surfaces_;
  Path path_{Vector3d(side_, 0, high_)};
};

}  // namespace

double DrawUniform(double low, double high, RandomStream* random) {
  return low + (high - low) * random->Uniform();
}

Vector3d DrawNormal3(RandomStream* random) {
  const double x = random->Normal();
  const double y = random->Normal();
  return {x, y, random->Normal()};
}

FilterTrialSetting MakeFilterTrialSetting(const FilterTrialParams& params,
                                          RandomStream* random) {
  const Matrix3d R = DrawRotation(random);
  return SettingMaker(params, random).Make(R);
}

}  // namespace dual_proxy
