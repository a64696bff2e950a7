// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/common/serialize.h"

namespace dual_proxy {

/** Parameters of ContactHistory. */
struct ContactHistoryParams {
  double period{1.0 / 15.0};
  double cell_size{0.02};
  /** At 152 bytes each. The default is for 0.4 m^2 of surface. */
  int capacity{1024};
  double radius{0.02};
  double merge_angle{0.175};
  /** What is believed now must not come back as its own confirmation. */
  double min_age{2};
  double std_base{0.1};
  double std_growth{10};

  /** @throws std::invalid_argument naming the field, its range and value. */
  void Validate() const;

  /** Visits every field by name; see common/serialize.h. */
  template <typename Archive>
  void Serialize(Archive* a) {
    a->Visit(Field("period", &period, Above(0), "s",
                   "between updates; the caller keeps it"));
    a->Visit(
        Field("cell_size", &cell_size, Between(1e-4, 1), "m",
              "edge of the cubic cells in which normals are averaged; smaller "
              "tells closer surfaces apart, but remembers less area"));
    a->Visit(Field("capacity", &capacity, Between(1, 1000000), "cells",
                   "how many are remembered"));
    a->Visit(Field("radius", &radius,
                   Between(0, {2 * cell_size, "2 cell_size"}), "m",
                   "how near a memory must be to count"));
    a->Visit(Field("merge_angle", &merge_angle, Between(0.01, 1.5), "rad",
                   "normals within it are one contact"));
    a->Visit(Field("min_age", &min_age, AtLeast(0), "s",
                   "a cell that was left more recently does not count"));
    a->Visit(Field("std_base", &std_base, Above(0), "rad",
                   "how uncertain a memory of this very point is"));
    a->Visit(Field("std_growth", &std_growth, AtLeast(0), "rad/m",
                   "what is added per distance from the memory: the curvature "
                   "up to which a surface is allowed for"));
  }
};

/** What an update came to. */
enum class HistoryStatus {
  kOk,
  kBadInput,  ///< Refused: not finite, out of range, or of the wrong shape.
};

template <>
struct EnumStrings<HistoryStatus> {
  static constexpr std::pair<HistoryStatus, const char*> kValues[] = {
      {HistoryStatus::kOk, "ok"}, {HistoryStatus::kBadInput, "bad_input"}};
};

/** What was believed in one cell. */
struct RememberedCell {
  static constexpr int kMaxContacts = 4;

  /** Which cell; negative: none. */
  std::int64_t key{-1};
  /** Number of the update in which the tool left it. */
  std::int64_t left_at{0};
  /** Updates with contact, and the sum of the positions in them, m, in B. */
  double count{0};
  Eigen::Vector3d position_sum{Eigen::Vector3d::Zero()};
  /** Sums of unit normals, in B, of the first `num_contacts`. */
  std::array<Eigen::Vector3d, kMaxContacts> normal_sums{
      Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
      Eigen::Vector3d::Zero()};
  int num_contacts{0};
};

/** What the history remembers. Made by MakeState(); copyable. */
struct ContactHistoryState {
  /** Earlier visits: a hash table. */
  std::vector<RememberedCell> cells;
  /** The visit of the cell in which the tool is. */
  RememberedCell visit;
  /** Updates carried out, and refused. */
  std::int64_t updates{0};
  std::int64_t bad_inputs{0};
};

/** What was believed near a place. */
struct RememberedContacts {
  /** The largest number of normals. */
  static constexpr int kMaxNormals = 8;
  /** Without heap. */
  using Normals =
      Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, kMaxNormals>;

  /** Unit normals in B, into the surface, 3 x k, 0 <= k <= kMaxNormals; of the
  nearest memory first. */
  Normals normals = Normals(3, 0);
  /** rad: standard deviation of the least sure of them; std_base at k = 0. */
  double std{0};
};

/** Remembers which contact normals were believed where, so that a place visited
again gives them as a prior: the Force-Space Particle Filter's "prior based on
the particle filter output last time a certain position was visited" (section
IV.C of the paper), for surroundings that stand still.

Space is divided into cubic cells. While the tool is in one, its position and
the normals believed are summed up; once it has gone on to another they are
added to what earlier visits of the cell left. A contact is the mean of the
normals within merge_angle of each other; of a fifth one in a cell the least
seen gives way. So one visit counts as one, and gives its prior to the next, not
to itself: a normal that is believed is no evidence for that same normal. For
this, too, cells that were left less than min_age ago do not count.

A place is remembered from contact alone: passing it in free space notes and
erases nothing, as the tool may be a hair above the surface. A memory that is no
longer true stays, until it is overwritten; the filter weighs a prior by what it
senses.

The cells are in a hash table of fixed size, of which a cell has eight places;
if all are taken, the one that was left longest ago is overwritten. */
class ContactHistory {
 public:
  using Params = ContactHistoryParams;
  using State = ContactHistoryState;

  /** @throws std::invalid_argument if `params` is invalid. */
  explicit ContactHistory(const Params& params = {});

  const Params& params() const { return params_; }

  /** Nothing remembered. Allocates. */
  State MakeState() const;

  /** True if `state` was made by MakeState() of a history with the same
  capacity. */
  bool IsCompatible(const State& state) const noexcept;

  /** Notes what is believed here.
  @param position  p_BE, 3-vector, m, in B: where the tool point is, less than
    a million cells from B's origin.
  @param normals  3 x d, 0 <= d <= kMaxNormals, in B, into the surface;
  normalised here. d = 0: no contact.
  @param[in,out] state  but for its count unchanged if kBadInput is returned.
  @returns kOk, or kBadInput (also for a normal that is not finite or shorter
    than 1e-6, and a state that is not compatible).
  Cost O(1). No heap, no throw. */
  HistoryStatus Update(const Eigen::Vector3d& position,
                       const Eigen::Ref<const Eigen::Matrix3Xd>& normals,
                       State* state) const noexcept;

  /** The same from what the ports of the filter say: notes U1, and where
  Omega_f is of rank 2 also both directions across U1 in force space, as on
  which side of U1 the second contact is cannot be seen from these.
  @param force_selection  Omega_f, in B.
  @param force_direction  U1, in B; zero: no contact. */
  HistoryStatus UpdateFromSelection(const Eigen::Vector3d& position,
                                    const Eigen::Matrix3d& force_selection,
                                    const Eigen::Vector3d& force_direction,
                                    State* state) const noexcept;

  /** What was believed near `position` (p_BE, m, in B) on earlier visits:
  nothing for a place that Update() would refuse, or a state that is not
  compatible. Of normals within merge_angle of each other the nearest memory's
  stands for all. Cost O(1): at most 125 cells are looked at. No heap, no throw.
  */
  RememberedContacts Lookup(const Eigen::Vector3d& position,
                            const State& state) const noexcept;

 private:
  using Index = Eigen::Matrix<std::int64_t, 3, 1>;

  bool CalcIndex(const Eigen::Vector3d& position, Index* index) const noexcept;
  void AddContact(const Eigen::Vector3d& normal_sum,
                  RememberedCell* cell) const noexcept;
  void KeepVisit(State* state) const noexcept;
  const RememberedCell* Find(std::int64_t key,
                             const State& state) const noexcept;

  Params params_;
  double cos_merge_{};
  double min_age_updates_{};
  int reach_{};  // Cells in each direction within which memories may count.
};

}  // namespace dual_proxy
