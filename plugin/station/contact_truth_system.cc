// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/station/contact_truth_system.h"

#include <drake/common/value.h>
#include <Eigen/Geometry>

namespace dual_proxy {

using drake::multibody::BodyIndex;
using drake::multibody::ContactResults;
using Eigen::Vector3d;

namespace {

// Normals closer together than this count as one direction: sin(10 deg).
constexpr double kSinIndependent = 0.17364817766693033;

// Calls visit(normal force, force of the tool on its environment, normal into
// the surface, place) for each of the tool's contacts that has a force.
template <typename Visit>
void VisitPushing(const ContactResults<double>& results, BodyIndex tool_body,
                  const Visit& visit) {
  for (int i = 0; i < results.num_point_pair_contacts(); ++i) {
    const auto& info = results.point_pair_contact_info(i);
    // Drake gives the force on body B and the normal from B into A.
    double sign{};
    if (info.bodyB_index() == tool_body) {
      sign = -1;
    } else if (info.bodyA_index() == tool_body) {
      sign = 1;
    } else {
      continue;
    }
    const Vector3d force = sign * info.contact_force();
    const Vector3d normal = -sign * info.point_pair().nhat_BA_W;
    const double normal_force = force.dot(normal);
    if (normal_force > 0) {
      visit(normal_force, force, normal, info.contact_point());
    }
  }
}

}  // namespace

ContactTruth CalcContactTruth(const ContactResults<double>& results,
                              BodyIndex tool_body) {
  ContactTruth truth;
  Vector3d push = Vector3d::Zero();  // The normal forces' sum.
  Eigen::Matrix3d basis;  // Its first `dimension` columns are in use.
  int count = 0;
  const auto visit = [&](double normal_force, const Vector3d& force,
                         const Vector3d& normal, const Vector3d&) {
    truth.force += force;
    push += normal_force * normal;
    Vector3d rest = normal;
    for (int j = 0; j < truth.dimension; ++j) {
      rest -= basis.col(j).dot(rest) * basis.col(j);
    }
    const double size = rest.norm();
    if (size > kSinIndependent) basis.col(truth.dimension++) = rest / size;
    truth.normal = normal;
    ++count;
  };
  VisitPushing(results, tool_body, visit);
  if (count > 1) truth.normal = push.normalized();
  return truth;
}

RotationTruth CalcRotationTruth(const ContactResults<double>& results,
                                BodyIndex tool_body) {
  RotationTruth truth;
  VisitPushing(results, tool_body,
               [&truth](double, const Vector3d&, const Vector3d& normal,
                        const Vector3d& p) { truth.Add(p, normal); });
  return truth;
}

ContactTruthSystem::ContactTruthSystem(BodyIndex tool_body, bool rotations)
    : tool_body_(tool_body), rotations_(rotations) {
  const auto& input = DeclareAbstractInputPort(
      "contact_results", drake::Value<ContactResults<double>>());
  DeclareVectorOutputPort("truth", rotations ? 11 : 7,
                          &ContactTruthSystem::CalcTruth, {input.ticket()});
}

void ContactTruthSystem::CalcTruth(
    const drake::systems::Context<double>& context,
    drake::systems::BasicVector<double>* output) const {
  const auto& results =
      get_contact_results_input_port().Eval<ContactResults<double>>(context);
  auto values = output->get_mutable_value();
  const ContactTruth truth = CalcContactTruth(results, tool_body_);
  values.head<7>() << truth.force, truth.normal, truth.dimension;
  if (rotations_) {
    const RotationTruth blocked = CalcRotationTruth(results, tool_body_);
    values.tail<4>() << blocked.dimension(), blocked.CalcFreeAxis();
  }
}

}  // namespace dual_proxy
