// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/contact_history.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include "dual_proxy/common/random.h"
#include "dual_proxy/perception/force_space_particle_filter.h"
#include "no_alloc.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

double AngleDeg(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b)) * 180 / std::numbers::pi;
}

/** `axis` turned by `deg` towards `to`. */
Vector3d Turned(const Vector3d& axis, const Vector3d& to, double deg) {
  const double angle = deg * std::numbers::pi / 180;
  return std::cos(angle) * axis + std::sin(angle) * to;
}

class ContactHistoryTest : public ::testing::Test {
 protected:
  void Note(const Vector3d& position, const Matrix3Xd& normals) {
    EXPECT_EQ(dut_.Update(position, normals, &state_), HistoryStatus::kOk);
  }

  /** Goes off without contact, for `time` s. */
  void Leave(double time = 3) {
    for (int i = 0; i < std::lround(15 * time); ++i) Note(far_, none_);
  }

  RememberedContacts Lookup(const Vector3d& position) const {
    return dut_.Lookup(position, state_);
  }

  ContactHistory dut_;
  ContactHistoryState state_{dut_.MakeState()};
  const Vector3d down_{-Vector3d::UnitZ()};
  const Vector3d side_{Vector3d::UnitX()};
  const Vector3d here_{0.405, 0.105, 0.015};  // Not in the middle of its cell.
  const Vector3d far_{0.1, -0.4, 0.3};
  const Matrix3Xd none_{Matrix3Xd(3, 0)};
};

TEST_F(ContactHistoryTest, KnowsNothingAtFirst) {
  const RememberedContacts prior = Lookup(here_);
  EXPECT_EQ(prior.normals.cols(), 0);
  EXPECT_EQ(prior.std, 0.1);
}

TEST_F(ContactHistoryTest, SecondVisitOfAPlaceFindsItsNormal) {
  Note(here_, 3 * down_);  // Of any length.
  Leave();
  const RememberedContacts prior = Lookup(here_);
  ASSERT_EQ(prior.normals.cols(), 1);
  EXPECT_EQ(prior.normals.col(0), down_);
  EXPECT_EQ(prior.std, 0.1);
  EXPECT_EQ(Lookup(far_).normals.cols(), 0);
}

TEST_F(ContactHistoryTest, UncertaintyGrowsWithTheDistanceUntilNothingIsKnown) {
  Note(here_, down_);
  Leave();
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, -1, 0),
                               Vector3d(0, 0, 1), Vector3d(-0.6, 0.8, 0)}) {
    for (const double distance : {0.004, 0.012, 0.0199}) {
      const RememberedContacts prior = Lookup(here_ + distance * axis);
      ASSERT_EQ(prior.normals.cols(), 1) << axis << " at " << distance;
      // Rounding of positions of 0.4 m.
      EXPECT_NEAR(prior.std, 0.1 + 10 * distance, 1e-14);
    }
    EXPECT_EQ(Lookup(here_ + 0.0201 * axis).normals.cols(), 0);
  }
}

// With what it has just noted it would confirm itself.
TEST_F(ContactHistoryTest, AVisitGivesNoPriorToItself) {
  Note(here_, down_);
  for (int i = 0; i < 100; ++i) {
    Note(here_, down_);
    ASSERT_EQ(Lookup(here_).normals.cols(), 0);
  }
  // The cell next to it, right after.
  const Vector3d next = here_ + Vector3d(0.018, 0, 0);
  Note(next, down_);
  EXPECT_EQ(Lookup(next).normals.cols(), 0);
  // Left 30 updates, 2 s, ago.
  for (int i = 0; i < 29; ++i) Note(far_, none_);
  EXPECT_EQ(Lookup(here_).normals.cols(), 0);
  Note(far_, none_);
  EXPECT_EQ(Lookup(here_).normals.cols(), 1);
  // And all through the second visit.
  for (int i = 0; i < 100; ++i) {
    Note(here_, side_);
    const RememberedContacts prior = Lookup(here_);
    ASSERT_EQ(prior.normals.cols(), 1);
    EXPECT_EQ(prior.normals.col(0), down_);
  }
}

TEST_F(ContactHistoryTest, AgeOfZeroCountsWhatHasJustBeenLeft) {
  dut_ = ContactHistory({.min_age = 0});
  Note(here_, down_);
  Note(far_, none_);
  EXPECT_EQ(Lookup(here_).normals.cols(), 1);
}

TEST_F(ContactHistoryTest, AveragesWithinACellOverAllVisits) {
  Note(here_, Turned(down_, side_, 4));
  Note(here_ + Vector3d(0.01, 0, 0), Turned(down_, side_, -2));
  Leave();
  Note(here_ + Vector3d(0.002, 0, 0), Turned(down_, side_, -2));
  Leave();
  const RememberedContacts prior = Lookup(here_ + Vector3d(0.004, 0, 0));
  ASSERT_EQ(prior.normals.cols(), 1);
  // Small angles: their mean, but for 0.01 deg.
  EXPECT_LT(AngleDeg(prior.normals.col(0), down_), 0.01);
  EXPECT_NEAR(prior.std, 0.1, 1e-14);  // The mean of the positions.
}

TEST_F(ContactHistoryTest, FreeSpaceNotesAndErasesNothing) {
  Note(here_, down_);
  Leave();
  for (int i = 0; i < 50; ++i) Note(here_, none_);
  Leave();
  EXPECT_EQ(Lookup(here_).normals.cols(), 1);
  EXPECT_EQ(Lookup(far_).normals.cols(), 0);
}

TEST_F(ContactHistoryTest, SeveralContactsOfACellStayApart) {
  Matrix3Xd corner(3, 2);
  corner << down_, side_;
  for (int i = 0; i < 5; ++i) Note(here_, corner);
  Note(here_, Turned(side_, down_, 3));
  Leave();
  const RememberedContacts prior = Lookup(here_);
  ASSERT_EQ(prior.normals.cols(), 2);
  EXPECT_LT(AngleDeg(prior.normals.col(0), down_), 1e-6);
  EXPECT_NEAR(AngleDeg(prior.normals.col(1), side_), 3.0 / 6, 0.01);
}

TEST_F(ContactHistoryTest, FifthContactOfACellTakesThePlaceOfTheLeastSeen) {
  for (int i = 0; i < 4; ++i) {
    const Vector3d normal = Turned(down_, side_, 20 * i);
    for (int k = 0; k < (i == 2 ? 1 : 3); ++k) Note(here_, normal);
  }
  Note(here_, Vector3d::UnitY());
  Leave();
  const RememberedContacts prior = Lookup(here_);
  ASSERT_EQ(prior.normals.cols(), 4);
  EXPECT_EQ(prior.normals.col(2), Vector3d::UnitY());
}

TEST_F(ContactHistoryTest, NearestMemoryComesFirstAndStandsForItsLike) {
  const Vector3d there = here_ + Vector3d(0.02, 0, 0);
  Matrix3Xd normals(3, 2);
  normals << Turned(down_, side_, 8), side_;
  Note(there, normals);
  Note(here_, down_);
  Leave();
  RememberedContacts prior = Lookup(here_ + Vector3d(0.004, 0, 0));
  ASSERT_EQ(prior.normals.cols(), 2);
  EXPECT_EQ(prior.normals.col(0), down_);
  EXPECT_EQ(prior.normals.col(1), side_);
  EXPECT_NEAR(prior.std, 0.1 + 10 * 0.016, 1e-14);  // Of the wall.
  prior = Lookup(here_ + Vector3d(0.016, 0, 0));
  ASSERT_EQ(prior.normals.cols(), 2);
  EXPECT_NEAR(AngleDeg(prior.normals.col(0), down_), 8, 1e-9);
  EXPECT_NEAR(prior.std, 0.1 + 10 * 0.004, 1e-14);
}

TEST_F(ContactHistoryTest, NoMoreThanEightNormals) {
  for (int x = 0; x < 3; ++x) {
    Matrix3Xd normals(3, 4);
    for (int i = 0; i < 4; ++i) {
      normals.col(i) = Turned(down_, side_, 15 * (4 * x + i));
    }
    Note(here_ + Vector3d(0.009 * x, 0, 0.009 * x), normals);
  }
  Leave();
  const RememberedContacts prior = Lookup(here_ + Vector3d(0.009, 0, 0.009));
  EXPECT_EQ(prior.normals.cols(), 8);
  EXPECT_NEAR(AngleDeg(prior.normals.col(0), down_), 60, 1e-9);
}

TEST_F(ContactHistoryTest, OldestCellIsOverwritten) {
  // With so few places every cell may have any of them.
  dut_ = ContactHistory({.capacity = 8, .radius = 0.005});
  state_ = dut_.MakeState();
  const auto place = [](int i) { return Vector3d(0.03 * i, 0.01, 0.01); };
  for (int i = 0; i < 8; ++i) Note(place(i), down_);
  Note(place(0), down_);  // Again, so it is no longer the oldest.
  for (int i = 8; i < 11; ++i) Note(place(i), down_);
  Leave();
  for (int i = 0; i < 11; ++i) {
    EXPECT_EQ(Lookup(place(i)).normals.cols(), i == 0 || i >= 4) << i;
  }
}

// Against all that was noted, kept in a list.
TEST_F(ContactHistoryTest, SweepAgreesWithAListOfAllVisits) {
  dut_ = ContactHistory({.capacity = 4096, .radius = 0.03, .min_age = 0});
  state_ = dut_.MakeState();
  RandomStream random(7);
  const auto draw = [&random] {
    return Vector3d(0.2 * random.Uniform() - 0.1, 0.2 * random.Uniform() - 0.1,
                    0.2 * random.Uniform() - 0.1);
  };
  std::vector<std::pair<Vector3d, Vector3d>> noted;
  for (int i = 0; i < 300; ++i) {
    const Vector3d position = draw();
    const auto cell = [](const Vector3d& p) -> Eigen::Array3d {
      return (p.array() / 0.02).floor();
    };
    bool is_new = true;
    for (const auto& [other, normal] : noted) {
      is_new = is_new && (cell(other) != cell(position)).any();
    }
    if (!is_new) continue;  // So that there is nothing to average.
    noted.emplace_back(position, draw().normalized());
    Note(position, noted.back().second);
  }
  Note(far_, none_);
  ASSERT_GT(std::ssize(noted), 200);
  int found = 0;
  for (int i = 0; i < 2000; ++i) {
    const Vector3d position = draw();
    std::vector<std::pair<double, Vector3d>> expected;
    for (const auto& [other, normal] : noted) {
      expected.emplace_back((other - position).norm(), normal);
    }
    std::ranges::sort(expected, {},
                      [](const auto& pair) { return pair.first; });
    std::vector<Vector3d> normals;
    double std = 0.1;
    for (const auto& [distance, normal] : expected) {
      if (distance > 0.03 || std::ssize(normals) == 8) break;
      bool is_merged = false;
      for (const Vector3d& other : normals) {
        is_merged = is_merged || other.dot(normal) >= std::cos(0.175);
      }
      if (is_merged) continue;
      normals.push_back(normal);
      std = 0.1 + 10 * distance;
    }
    const RememberedContacts prior = Lookup(position);
    ASSERT_EQ(prior.normals.cols(), std::ssize(normals)) << "at " << i;
    EXPECT_NEAR(prior.std, std, 1e-12);
    for (std::size_t k = 0; k < normals.size(); ++k) {
      EXPECT_LT((prior.normals.col(k) - normals[k]).norm(), 1e-14);
    }
    found += normals.size() > 1;
  }
  EXPECT_GT(found, 100);
}

TEST_F(ContactHistoryTest, NegativeCoordinatesHaveCellsOfTheirOwn) {
  const Vector3d p(-0.001, -0.001, -0.001);
  Note(p, down_);
  Note(-p, side_);
  Leave();
  const RememberedContacts prior = Lookup(p);
  ASSERT_EQ(prior.normals.cols(), 2);
  EXPECT_EQ(prior.normals.col(0), down_);
}

TEST_F(ContactHistoryTest, BadInputIsRefusedAndCounted) {
  Note(here_, down_);
  const auto expect_refused = [this](const Vector3d& position,
                                     const Matrix3Xd& normals) {
    const ContactHistoryState before = state_;
    EXPECT_EQ(dut_.Update(position, normals, &state_),
              HistoryStatus::kBadInput);
    EXPECT_EQ(state_.bad_inputs, before.bad_inputs + 1);
    EXPECT_EQ(state_.updates, before.updates);
    EXPECT_EQ(state_.visit.key, before.visit.key);
    EXPECT_EQ(state_.visit.count, before.visit.count);
  };
  for (const double bad : {kNan, kInfinity, -kInfinity, 1e5, -1e300}) {
    expect_refused(Vector3d(0, bad, 0), down_);
    EXPECT_EQ(Lookup(Vector3d(0, bad, 0)).normals.cols(), 0);
  }
  for (const double bad : {kNan, kInfinity, 1e200}) {
    expect_refused(here_, Vector3d(bad, 0, 1));
  }
  expect_refused(here_, Vector3d(0, 0, 1e-7));
  expect_refused(here_, Matrix3Xd::Ones(3, 9));
  ContactHistoryState other = ContactHistory({.capacity = 7}).MakeState();
  EXPECT_EQ(dut_.Update(here_, down_, &other), HistoryStatus::kBadInput);
  EXPECT_EQ(dut_.Lookup(here_, other).normals.cols(), 0);
  for (const double bad : {kNan, kInfinity}) {
    EXPECT_EQ(dut_.UpdateFromSelection(here_, Matrix3d::Constant(bad), down_,
                                       &state_),
              HistoryStatus::kBadInput);
    EXPECT_EQ(dut_.UpdateFromSelection(here_, Matrix3d::Identity(),
                                       Vector3d(0, bad, 1), &state_),
              HistoryStatus::kBadInput);
  }
  Leave();
  EXPECT_EQ(Lookup(here_).normals.cols(), 1);
}

TEST_F(ContactHistoryTest, SelectionAndDirectionSayTheNormals) {
  const Vector3d U1 = Turned(down_, side_, 30);
  const Vector3d U2 = Turned(side_, -down_, 30);  // Across it.
  const auto normals = [&](const Matrix3d& selection,
                           const Vector3d& direction) {
    state_ = dut_.MakeState();
    EXPECT_EQ(dut_.UpdateFromSelection(here_, selection, direction, &state_),
              HistoryStatus::kOk);
    Leave();
    return Lookup(here_).normals;
  };
  EXPECT_EQ(normals(Matrix3d::Zero(), Vector3d::Zero()).cols(), 0);
  auto found = normals(U1 * U1.transpose(), U1);
  ASSERT_EQ(found.cols(), 1);
  EXPECT_LT(AngleDeg(found.col(0), U1), 1e-6);
  found = normals(U1 * U1.transpose() + U2 * U2.transpose(), U1);
  ASSERT_EQ(found.cols(), 3);
  EXPECT_LT(AngleDeg(found.col(0), U1), 1e-6);
  EXPECT_EQ(found.col(2), -found.col(1));
  EXPECT_NEAR(std::abs(found.col(1).dot(U2)), 1, 1e-14);
  found = normals(Matrix3d::Identity(), U1);
  ASSERT_EQ(found.cols(), 1);
  EXPECT_LT(AngleDeg(found.col(0), U1), 1e-6);
}

TEST_F(ContactHistoryTest, CopiesAreIndependentAndContinueAlike) {
  Note(here_, down_);
  Leave();
  ContactHistoryState copy = state_;
  Note(here_ + Vector3d(0.001, 0, 0), side_);
  Leave();
  EXPECT_EQ(dut_.Lookup(here_, copy).normals.cols(), 1);
  EXPECT_EQ(Lookup(here_).normals.cols(), 2);
  state_.cells.swap(copy.cells);
  EXPECT_EQ(Lookup(here_).normals.cols(), 1);
}

TEST_F(ContactHistoryTest, NeitherUpdateNorLookupAllocates) {
  Matrix3Xd normals(3, 4);
  normals << down_, side_, Vector3d::UnitY(), -Vector3d::UnitY();
  const Matrix3d two = Matrix3d::Identity() - side_ * side_.transpose();
  Eigen::Index found = 0;
  ScopedNoAlloc guard;
  for (int i = 0; i < 3000; ++i) {
    const Vector3d position(0.3 * std::sin(0.01 * i), 0.3 * std::cos(0.01 * i),
                            0);
    dut_.Update(position, normals, &state_);
    dut_.UpdateFromSelection(position, two, down_, &state_);
    found += dut_.Lookup(position, state_).normals.cols();
  }
  EXPECT_EQ(guard.count(), 0);
  EXPECT_GT(found, 4000);
}

TEST(ContactHistoryParamsTest, ErrorsNameFieldRangeAndValue) {
  using Params = ContactHistoryParams;
  EXPECT_EQ(ValidationError(Params{}), "no exception");
  const auto expect = [](const Params& params, const std::string& message) {
    const std::string error = ValidationError(params);
    EXPECT_EQ(error.substr(0, message.size()), message);
    EXPECT_EQ(InvalidArgument([&] { ContactHistory dut(params); }), error);
  };
  const std::string who = "ContactHistoryParams: field ";
  expect({.period = 0}, who + "`period` expected");
  expect({.cell_size = 1e-5},
         who + "`cell_size` expected a number in [0.0001, 1], got 1e-05");
  expect({.capacity = 0},
         who + "`capacity` expected a number in [1, 1e+06], got 0");
  expect(
      {.radius = 0.05},
      who + "`radius` expected a number in [0, 2 cell_size = 0.04], got 0.05");
  expect({.merge_angle = 0}, who + "`merge_angle` expected");
  expect({.min_age = -1}, who + "`min_age` expected");
  expect({.std_base = 0}, who + "`std_base` expected");
  expect({.std_growth = kNan}, who + "`std_growth` expected");
}

/** A tool on a table, 15 updates a second: the filter's results go to the
history, whose prior goes to the filter. */
class TableVisitTest : public ContactHistoryTest,
                       public ::testing::WithParamInterface<Likelihood> {
 protected:
  /** Comes down from 3 cm above `place`, presses still, dragged by friction,
  and slides on for 5 cm; then leaves. Returns what the filter's normal is wrong
  by while the tool presses, deg, on average. */
  double Visit(const Vector3d& place, bool with_prior) {
    ForceSpaceParticleFilterState state = filter_.MakeState(++seed_);
    double error = 0;
    int num_known = 0;
    for (int i = 0; i < 75; ++i) {
      const bool presses = i >= 15 && i < 30;
      const bool slides = i >= 30;
      Vector3d position = place - 0.002 * std::max(0, 15 - i) * table_;
      Vector3d velocity = -0.03 * table_;
      Vector3d force = Vector3d::Zero();
      if (presses || slides) {
        force = 6 * table_ + 1.8 * along_;
        position = place + 0.05 / 45 * std::max(0, i - 30) * along_;
        velocity = presses ? 0 * along_ : Vector3d(0.05 / 3 * along_);
      }
      for (double& f : force) f += 0.2 * random_.Normal();
      const RememberedContacts prior = Lookup(position);
      num_priors_ += prior.normals.cols();
      if (with_prior) filter_.SetPrior(prior.normals, prior.std, &state);
      const bool knows = state.dimension > 0;
      filter_.Update(force, velocity, knows ? Vector3d(2 * along_) : force,
                     knows ? Vector3d(6 * state.singular_vectors.col(0))
                           : Vector3d::Zero().eval(),
                     &state);
      Vector3d normal = Vector3d::Zero();
      if (state.dimension > 0) normal = state.singular_vectors.col(0);
      dut_.UpdateFromSelection(position, state.force_selection, normal,
                               &state_);
      if (presses && state.dimension > 0) {
        error += AngleDeg(normal, table_);
        ++num_known;
      }
    }
    Leave();
    return error / num_known;
  }

  ForceSpaceParticleFilter filter_{[] {
    ForceSpaceParticleFilterParams params;
    params.likelihood = GetParam();
    return params;
  }()};
  const Vector3d table_{Turned(down_, side_, 10)};
  const Vector3d along_{Vector3d::UnitY()};
  RandomStream random_{5};
  std::uint64_t seed_{0};
  Eigen::Index num_priors_{0};
};

TEST_P(TableVisitTest, SecondVisitHasThePriorOfTheFirst) {
  Visit(here_, true);
  EXPECT_EQ(num_priors_, 0);
  // Friction of 0.3 tilts the force by 17 deg, and with it what is believed at
  // first, in the cell of `here_`.
  const double limit = GetParam() == Likelihood::kPaper ? 8 : 2;
  for (double y = 0; y <= 0.05; y += 0.005) {
    const RememberedContacts prior = Lookup(here_ + y * along_);
    ASSERT_GE(prior.normals.cols(), 1) << "at " << y;
    EXPECT_LT(AngleDeg(prior.normals.col(0), table_), y < 0.025 ? 20 : limit);
  }
  EXPECT_EQ(Lookup(here_ - 0.03 * along_).normals.cols(), 0);
  EXPECT_EQ(Lookup(here_ - 0.03 * table_).normals.cols(), 0);

  // Where the first visit slid, it knew more than the second one's pressing
  // can.
  const ContactHistoryState first = state_;
  double without = 0;
  double with = 0;
  for (int i = 0; i < 20; ++i) {
    state_ = first;
    without += Visit(here_ + 0.035 * along_, false) / 20;
    state_ = first;
    with += Visit(here_ + 0.035 * along_, true) / 20;
  }
  EXPECT_GT(num_priors_, 20 * 30);
  EXPECT_LT(with, 0.8 * without);
}

INSTANTIATE_TEST_SUITE_P(Likelihoods, TableVisitTest,
                         ::testing::Values(Likelihood::kPaper,
                                           Likelihood::kFrictionCone),
                         [](const auto& info) {
                           return EnumToString(info.param);
                         });

// A table that is met again with a force rising by 1 N/s, 100 updates a second.
TEST_F(ContactHistoryTest, SecondVisitIsFoundEarlier) {
  ContactHistoryParams params;
  params.period = 0.01;
  dut_ = ContactHistory(params);
  state_ = dut_.MakeState();
  ForceSpaceParticleFilterParams filter_params;
  filter_params.period = 0.01;
  const ForceSpaceParticleFilter filter(filter_params);
  const Vector3d table = Turned(down_, side_, 10);
  RandomStream random(5);

  /* The force at which the contact is found, N. */
  const auto visit = [&](std::uint64_t seed) {
    ForceSpaceParticleFilterState state = filter.MakeState(seed);
    double found = 0;
    for (int i = 0; i < 600; ++i) {
      const double pressed = i < 300 ? 0.01 * i : 0;
      const Vector3d position = i < 300 ? here_ : far_;
      Vector3d force = pressed * table;
      for (double& f : force) f += 0.2 * random.Normal();
      const RememberedContacts prior = Lookup(position);
      filter.SetPrior(prior.normals, prior.std, &state);
      filter.Update(force, Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(),
                    &state);
      const bool is_contact = state.dimension > 0;
      if (is_contact && found == 0) found = pressed;
      dut_.UpdateFromSelection(position, state.force_selection,
                               is_contact
                                   ? Vector3d(state.singular_vectors.col(0))
                                   : Vector3d::Zero().eval(),
                               &state_);
    }
    return found;
  };
  double first = 0;
  double second = 0;
  for (std::uint64_t i = 0; i < 20; ++i) {
    state_ = dut_.MakeState();
    first += visit(2 * i) / 20;
    second += visit(2 * i + 1) / 20;
  }
  EXPECT_GT(first, 0.5);
  EXPECT_LT(second, 0.75 * first);
  EXPECT_GT(second, 0.2);
}

}  // namespace
}  // namespace dual_proxy
