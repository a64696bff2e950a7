// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/simulation/operator.h"

#include <algorithm>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/common/validate_entries.h"

namespace dual_proxy {
namespace {

// At or after point `index`, by the share s of the `duration` until the next;
// a duration of zero is rest at the point.
struct Place {
  int index{0};
  double s{0};         // In [0, 1).
  double duration{0};  // s.
};

// At each point the slope of the parabola through it and its neighbours; zero
// at both ends.
Eigen::Matrix3Xd CalcTangents(const Eigen::VectorXd& t,
                              const Eigen::Matrix3Xd& p) {
  Eigen::Matrix3Xd tangents = Eigen::Matrix3Xd::Zero(3, t.size());
  for (int i = 1; i + 1 < t.size(); ++i) {
    const double before = t(i) - t(i - 1);
    const double after = t(i + 1) - t(i);
    const Eigen::Vector3d v_before = (p.col(i) - p.col(i - 1)) / before;
    const Eigen::Vector3d v_after = (p.col(i + 1) - p.col(i)) / after;
    tangents.col(i) = (after * v_before + before * v_after) / (before + after);
  }
  return tangents;
}

void Interpolate(PathInterpolation interpolation,
                 const Eigen::Matrix3Xd& points,
                 const Eigen::Matrix3Xd& tangents, const Place& place,
                 Eigen::Vector3d* value, Eigen::Vector3d* rate) noexcept {
  const int i = place.index;
  const double s = place.s;
  const double duration = place.duration;
  if (duration == 0) {
    *value = points.col(i);
    rate->setZero();
    return;
  }
  const Eigen::Vector3d step = points.col(i + 1) - points.col(i);
  switch (interpolation) {
    case PathInterpolation::kLinear:
      *value = points.col(i) + s * step;
      *rate = step / duration;
      break;
    case PathInterpolation::kMinimumJerk:
      *value = points.col(i) + s * s * s * (10 + s * (-15 + s * 6)) * step;
      *rate = 30 * s * s * (1 - s) * (1 - s) / duration * step;
      break;
    case PathInterpolation::kCubic: {
      const Eigen::Vector3d m0 = duration * tangents.col(i);
      const Eigen::Vector3d m1 = duration * tangents.col(i + 1);
      const Eigen::Vector3d c2 = 3 * step - 2 * m0 - m1;
      const Eigen::Vector3d c3 = m0 + m1 - 2 * step;
      *value = points.col(i) + s * (m0 + s * (c2 + s * c3));
      *rate = (m0 + s * (2 * c2 + 3 * s * c3)) / duration;
      break;
    }
  }
}

bool IsWithin(const std::vector<Eigen::Vector2d>& spans, double time) noexcept {
  for (const Eigen::Vector2d& span : spans) {
    if (time >= span(0) && time < span(1)) return true;
  }
  return false;
}

}  // namespace

void ValidateButtons(const char* who,
                     const std::vector<Eigen::Vector2d>& clutch,
                     const std::vector<Eigen::Vector2d>& home,
                     const std::vector<Eigen::Vector2d>& force_scale,
                     const std::vector<Eigen::Vector2d>& gripper) {
  ThrowUnlessSpans(who, "clutch", clutch);
  ThrowUnlessSpans(who, "home", home);
  const auto check_steps = [who](const char* name,
                                 const std::vector<Eigen::Vector2d>& steps) {
    double last = -1;
    for (std::size_t i = 0; i < steps.size(); ++i) {
      const std::string entry = EntryName(name, i);
      ThrowUnlessIn(who, entry.c_str(), steps[i], AtLeast(0));
      ThrowUnlessIn(who, EntryName(entry, 0).c_str(), steps[i](0),
                    Above({last, "the time before"}));
      last = steps[i](0);
    }
  };
  check_steps("force_scale", force_scale);
  check_steps("gripper", gripper);
}

void OperatorPathParams::Validate() const {
  constexpr const char* kWho = "OperatorPathParams";
  if (times.size() < 1) {
    ThrowInvalidField(kWho, "times", "at least one time",
                      static_cast<double>(times.size()));
  }
  ThrowUnlessIn(kWho, "times", times, Finite());
  for (int i = 1; i < times.size(); ++i) {
    if (times(i) <= times(i - 1)) {
      ThrowInvalidField(kWho, "times", "strictly increasing times", times(i));
    }
  }
  if (points.cols() != times.size()) {
    ThrowInvalidField(kWho, "points", "one column per time",
                      static_cast<double>(points.cols()));
  }
  ThrowUnlessIn(kWho, "points", points, Finite());
  if (rotations.cols() != 0 && rotations.cols() != times.size()) {
    ThrowInvalidField(kWho, "rotations", "none, or one column per time",
                      static_cast<double>(rotations.cols()));
  }
  ThrowUnlessIn(kWho, "rotations", rotations, Finite());
  ValidateButtons(kWho, clutch, home, force_scale, gripper);
  if (interpolation != PathInterpolation::kMinimumJerk &&
      interpolation != PathInterpolation::kLinear &&
      interpolation != PathInterpolation::kCubic) {
    ThrowInvalidField(kWho, "interpolation", "a PathInterpolation",
                      static_cast<int>(interpolation));
  }
}

OperatorPath::OperatorPath(const OperatorPathParams& params) : params_(params) {
  params_.Validate();
  tangents_ = CalcTangents(params_.times, params_.points);
  if (params_.rotations.cols() > 0) {
    rotation_tangents_ = CalcTangents(params_.times, params_.rotations);
  }
}

OperatorPathSample OperatorPath::Calc(double time) const noexcept {
  const Eigen::VectorXd& times = params_.times;
  const int last = static_cast<int>(times.size()) - 1;
  Place place;
  if (time >= times(last)) {
    place.index = last;
  } else if (time > times(0)) {
    const double* begin = times.data();
    place.index = static_cast<int>(
        std::upper_bound(begin, begin + last + 1, time) - begin - 1);
    place.duration = times(place.index + 1) - times(place.index);
    place.s = (time - times(place.index)) / place.duration;
  }
  OperatorPathSample sample;
  Interpolate(params_.interpolation, params_.points, tangents_, place,
              &sample.position, &sample.velocity);
  if (params_.rotations.cols() > 0) {
    Eigen::Vector3d rotation;
    Eigen::Vector3d rate;
    Interpolate(params_.interpolation, params_.rotations, rotation_tangents_,
                place, &rotation, &rate);
    sample.rotation = ExpRotation(rotation);
  }
  sample.clutch = IsWithin(params_.clutch, time);
  sample.home = IsWithin(params_.home, time);
  for (const Eigen::Vector2d& scale : params_.force_scale) {
    if (time >= scale(0)) sample.force_scale = scale(1);
  }
  for (const Eigen::Vector2d& step : params_.gripper) {
    if (time >= step(0)) sample.gripper_opening = step(1);
  }
  return sample;
}

}  // namespace dual_proxy
