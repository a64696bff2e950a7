// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/filter_trial_setting.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Geometry>

#include "dual_proxy/experiment/filter_trial_path.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kBreathingRate = 2 * std::numbers::pi * 0.3;  // rad/s
constexpr double kPlay = 0.001;  // m: by which slot and bore are wider.

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
    setting.stiction = params_.stiction;
    for (ContactSurfaceParams surface : surfaces_) {
      surface.stiffness = params_.scene == FilterTrialScene::kSoft
                              ? Uniform(400, 1500)
                              : stiffness_;
      surface.stiffness = params_.stiffness.value_or(surface.stiffness);
      surface.dissipation = dissipation_;
      surface.friction = params_.friction;
      surface.stiction_speed = 0.002;
      surface.position = R * surface.position;
      surface.rotation = R * surface.rotation;
      setting.scene.surfaces.push_back(surface);
    }
    setting.path.reserve(path_.points().size());
    setting.frame_velocity.reserve(path_.points().size());
    double time = 0;
    for (const Vector3d& point : path_.points()) {
      // The surfaces' way along y and z, and its derivative.
      const double phase = kBreathingRate * time;
      const Vector3d way{0, params_.surface_speed * time,
                         params_.breathing * std::sin(phase)};
      setting.path.emplace_back(R * point - R * way);
      setting.frame_velocity.emplace_back(
          R * Vector3d(0, params_.surface_speed,
                       params_.breathing * kBreathingRate * std::cos(phase)));
      time += kFilterTrialStep;
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
      case FilterTrialScene::kPulled:
        return MakePulled();
      case FilterTrialScene::kPressedCorner:
        return MakePressedCorner();
      case FilterTrialScene::kWallAtRest:
        return MakeWallAtRest();
      case FilterTrialScene::kGroove:
        return MakeGroove();
      case FilterTrialScene::kSlot:
        return MakeSlot();
      case FilterTrialScene::kBore:
        return MakeBore();
      case FilterTrialScene::kChamfer:
        return MakeChamfer();
    }
  }

  /** To `goal`, clear of every surface, and waits there. */
  void Leave(const Vector3d& goal) {
    path_.MoveTo(goal, approach_);
    path_.Hold(0.5);
  }

  void AddFloor() { AddPlane({0, 0, 0}, Vector3d::UnitZ()); }

  void AddPlane(const Vector3d& position, const Vector3d& up) {
    surfaces_.push_back(MakePlane(position, up));
  }

  /** Depth of the intended position, m, that presses with `force`, N. */
  static double Depth(double force) { return force / kFilterTrialStiffness; }

  /** Where the tool's centre is, at y = 0, if it is at `left` and `right` (m)
  from the planes through the origin's line along y with these normals. */
  static Vector3d Beside(const Vector3d& left_up, double left,
                         const Vector3d& right_up, double right) {
    Eigen::Matrix2d normals;
    normals << left_up.x(), left_up.z(), right_up.x(), right_up.z();
    const Eigen::Vector2d p = normals.inverse() * Eigen::Vector2d(left, right);
    return {p.x(), 0, p.y()};
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
    cylinder.radius = params_.radius;
    surfaces_.push_back(cylinder);
    // The tool's centre runs on a larger circle than its point of contact; the
    // stated speed is that of the contact.
    const double reach = cylinder.radius + low_;
    const double speed = speed_ * reach / cylinder.radius;
    path_ = FilterTrialPath({side_, 0, reach + 0.02});
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

  void MakePulled() {
    AddFloor();
    path_ = FilterTrialPath({0, 0, high_});
    path_.MoveTo({0, 0, low_}, approach_);
    path_.Hold(params_.hold_time);
    for (int i = 0; i < 8; ++i) {
      const double angle = Uniform(-1, 1) * std::numbers::pi;
      const double pull = Uniform(0, 0.8) * params_.friction * params_.force;
      const double x = Depth(pull) * std::cos(angle);
      path_.MoveIn({x, Depth(pull) * std::sin(angle), low_}, Uniform(0.2, 1));
      path_.Hold(0.3);
    }
    Leave({path_.end().x(), path_.end().y(), high_});
  }

  void MakePressedCorner() {
    const double lean = Uniform(-20, 20) * kDegree;
    const Vector3d wall_up{-std::cos(lean), 0, std::sin(lean)};
    const Vector3d foot{0.08, 0, 0};
    AddFloor();
    AddPlane(foot, wall_up);
    const auto pressing = [&](double floor, double wall) -> Vector3d {
      return foot + Vector3d(0, 0.02, 0) +
             Beside(Vector3d::UnitZ(), radius_ - Depth(floor), wall_up,
                    radius_ - Depth(wall));
    };
    const Vector3d corner = pressing(params_.force, params_.force);
    path_.MoveTo({0, 0, low_}, approach_);
    path_.Hold(params_.hold_time);
    path_.MoveTo({corner.x() - 0.04, 0.01, low_}, speed_);
    path_.MoveTo(corner, speed_);
    path_.Hold(0.3);
    for (int i = 0; i < 4; ++i) {
      const double floor = Uniform(4, 18);
      const double wall = Uniform(4, 18);
      path_.MoveIn(pressing(floor, wall), Uniform(0.15, 0.35));
      path_.Hold(Uniform(0.05, 0.3));
    }
    path_.MoveIn(corner, 0.3);
    path_.Hold(0.3);
    path_.MoveTo(corner + Vector3d(0, 1.5 * speed_, 0), speed_);
    path_.Hold(0.2);
    path_.MoveTo(corner, speed_);
    path_.MoveTo({corner.x() - 0.05, 0, low_}, speed_);
    path_.Hold(0.3);
    Leave({corner.x() - 0.05, 0, high_});
  }

  void MakeWallAtRest() {
    AddFloor();
    AddPlane({0.08, 0, 0}, -Vector3d::UnitX());
    // All but touching the wall. Along it, so that friction has pulled aside
    // what it holds back.
    const double x = 0.08 - radius_ - 1e-4;
    const double y = 0.02 + 1.5 * speed_;
    path_.MoveTo({0, 0, low_}, approach_);
    path_.Hold(params_.hold_time);
    path_.MoveTo({-speed_, Uniform(0.2, 0.8) * speed_, low_}, speed_);
    path_.MoveTo({Uniform(-0.5, 0) * speed_, -0.5 * speed_, low_}, speed_);
    path_.MoveTo({x, 0, low_}, speed_);
    path_.MoveTo({x, y, low_}, speed_);
    path_.Hold(params_.hold_time);
    const double pressed = x + Depth(Uniform(6, 12));
    path_.MoveIn({pressed, y, low_}, Uniform(0.3, 1.5));
    path_.Hold(1);
    path_.MoveTo({pressed, 0, low_}, speed_);
    path_.Hold(0.3);
    path_.MoveTo({x - 0.05, 0, low_}, speed_);
    Leave({x - 0.05, 0, high_});
  }

  void MakeGroove() {
    const double half = Uniform(30, 45) * kDegree;
    const Vector3d right_up{-std::cos(half), 0, std::sin(half)};
    const Vector3d left_up{std::cos(half), 0, std::sin(half)};
    AddPlane({0, 0, 0}, right_up);
    AddPlane({0, 0, 0}, left_up);
    const Vector3d side = Beside(left_up, radius_ + 0.03, right_up, low_);
    const Vector3d bottom = Beside(left_up, low_, right_up, low_);
    const Vector3d along{0, 1.5 * speed_, 0};
    path_ = FilterTrialPath(side + 0.03 * right_up);
    path_.MoveTo(side, approach_);
    path_.Hold(params_.hold_time);
    path_.MoveTo(bottom, speed_);
    path_.Hold(0.3);
    for (int lap = 0; lap < 2; ++lap) {
      path_.MoveTo(bottom + along, speed_);
      path_.Hold(0.2);
      path_.MoveTo(bottom, speed_);
    }
    Leave(bottom + Vector3d(0, 0, 0.1));
  }

  void MakeSlot() {
    AddFloor();
    for (const double side : {-1.0, 1.0}) {
      AddPlane({side * (radius_ + 0.5 * kPlay), 0, 0},
               -side * Vector3d::UnitX());
    }
    path_ = FilterTrialPath({0, 0, high_});
    path_.MoveTo({0, 0, low_}, approach_);
    path_.Hold(params_.hold_time);
    path_.MoveTo({0, speed_, low_}, speed_);
    const double depth = 0.5 * kPlay + Depth(params_.force);
    for (const double x : {depth, -depth, depth, -depth}) {
      path_.MoveTo({x, path_.end().y(), low_}, speed_);
      path_.Hold(0.2);
      path_.MoveTo({x, speed_ - path_.end().y(), low_}, speed_);
    }
    path_.MoveTo({0, path_.end().y(), low_}, speed_);
    Leave({0, path_.end().y(), high_});
  }

  void MakeBore() {
    ContactSurfaceParams bore;
    bore.shape = SurfaceShape::kCylinder;
    bore.hollow = true;
    bore.radius = radius_ + 0.5 * kPlay;
    bore.rotation =
        Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitX(), Vector3d::UnitY())
            .matrix();
    surfaces_.push_back(bore);
    const double depth = 0.5 * kPlay + Depth(params_.force);
    double angle = Uniform(-1, 1) * std::numbers::pi;
    const auto pressing = [&](double y) -> Vector3d {
      return {depth * std::cos(angle), y, depth * std::sin(angle)};
    };
    path_ = FilterTrialPath({0, 0, 0});
    path_.Hold(0.5);
    path_.MoveTo(pressing(0), approach_);
    path_.Hold(params_.hold_time);
    for (const double y : {1.0, 0.0, 1.0, 0.0}) {
      path_.MoveTo(pressing(y * speed_), speed_);
      path_.Hold(0.2);
      angle += Uniform(30, 90) * kDegree;
      path_.MoveTo(pressing(0.5 * speed_), speed_);
    }
    Leave({0, path_.end().y(), 0});
  }

  void MakeChamfer() {
    const double slope = Uniform(30, 45) * kDegree;
    const Vector3d up{-std::sin(slope), 0, std::cos(slope)};
    const Vector3d foot{0.06, 0, 0};
    AddFloor();
    AddPlane(foot, up);
    const Vector3d corner = foot + Beside(Vector3d::UnitZ(), low_, up, low_);
    const Vector3d along{0, speed_, 0};
    const Vector3d top =
        corner + along + 0.06 * Vector3d(std::cos(slope), 0, std::sin(slope));
    path_.MoveTo({0, 0, low_}, approach_);
    path_.Hold(params_.hold_time);
    path_.MoveTo(corner, speed_);
    path_.Hold(0.3);
    path_.MoveTo(corner + along, speed_);
    path_.MoveTo(top, speed_);
    path_.Hold(0.3);
    path_.MoveTo(corner + along, speed_);
    path_.MoveTo({0, speed_, low_}, speed_);
    path_.Hold(0.3);
    Leave({0, speed_, high_});
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
  FilterTrialPath path_{Vector3d(side_, 0, high_)};
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
