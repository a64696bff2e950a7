// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/perception/contact_history.h"

#include <algorithm>
#include <cmath>

#include "dual_proxy/common/elementary.h"
#include "dual_proxy/common/random.h"

namespace dual_proxy {
namespace {

using Cell = RememberedCell;

constexpr int kNumPlaces = 8;  // Of a cell in the hash table.
constexpr int kMaxReach = 2;   // radius over cell_size.
constexpr double kMinLength = 1e-6;
// Of a cell from B's origin, along each axis, so that its key has 63 bits.
constexpr double kMaxIndex = 1e6;
constexpr int kIndexBits = 21;

std::int64_t CalcKey(const Eigen::Matrix<std::int64_t, 3, 1>& index) noexcept {
  std::int64_t key = 0;
  for (const std::int64_t i : index) {
    key = (key << kIndexBits) + i + (std::int64_t{1} << (kIndexBits - 1));
  }
  return key;
}

/** The place of `key`, or where to put it: an empty one, or else the one that
was left longest ago. */
std::size_t CalcPlace(std::int64_t key,
                      const std::vector<Cell>& cells) noexcept {
  const std::size_t home =
      SplitSeed(static_cast<std::uint64_t>(key), 0) % cells.size();
  std::size_t oldest = home;
  for (int i = 0; i < kNumPlaces; ++i) {
    const std::size_t place = (home + i) % cells.size();
    // Places are never emptied, so the key is not behind an empty one.
    if (cells[place].key == key || cells[place].key < 0) return place;
    if (cells[place].left_at < cells[oldest].left_at) oldest = place;
  }
  return oldest;
}

}  // namespace

void ContactHistoryParams::Validate() const {
  ValidateFields("ContactHistoryParams", *this);
}

ContactHistory::ContactHistory(const Params& params) : params_(params) {
  params_.Validate();
  cos_merge_ = CalcSinCos(params_.merge_angle).cos;
  // Rounding must not add an update.
  min_age_updates_ = std::ceil(params_.min_age / params_.period - 1e-6);
  reach_ =
      std::min(kMaxReach,
               static_cast<int>(std::ceil(params_.radius / params_.cell_size)));
}

ContactHistoryState ContactHistory::MakeState() const {
  State state;
  state.cells.resize(params_.capacity);
  return state;
}

bool ContactHistory::IsCompatible(const State& state) const noexcept {
  return std::ssize(state.cells) == params_.capacity;
}

bool ContactHistory::CalcIndex(const Eigen::Vector3d& position,
                               Index* index) const noexcept {
  const Eigen::Array3d cells = (position.array() / params_.cell_size).floor();
  // Comparisons with what is not a number are false.
  if (!(cells.abs() <= kMaxIndex).all()) return false;
  *index = cells.cast<std::int64_t>();
  return true;
}

HistoryStatus ContactHistory::Update(
    const Eigen::Vector3d& position,
    const Eigen::Ref<const Eigen::Matrix3Xd>& normals,
    State* state) const noexcept {
  Index index;
  bool is_ok = CalcIndex(position, &index) &&
               normals.cols() <= RememberedContacts::kMaxNormals &&
               IsCompatible(*state);
  for (int i = 0; is_ok && i < normals.cols(); ++i) {
    const double norm = normals.col(i).norm();
    is_ok = std::isfinite(norm) && norm > kMinLength;
  }
  if (!is_ok) {
    ++state->bad_inputs;
    return HistoryStatus::kBadInput;
  }
  ++state->updates;
  const std::int64_t key = CalcKey(index);
  Cell& visit = state->visit;
  if (visit.key != key) {
    if (visit.count > 0) KeepVisit(state);
    visit = Cell{.key = key};
  }
  if (normals.cols() == 0) return HistoryStatus::kOk;
  ++visit.count;
  visit.position_sum += position;
  for (int i = 0; i < normals.cols(); ++i) {
    AddContact(normals.col(i).normalized(), &visit);
  }
  return HistoryStatus::kOk;
}

HistoryStatus ContactHistory::UpdateFromSelection(
    const Eigen::Vector3d& position, const Eigen::Matrix3d& force_selection,
    const Eigen::Vector3d& force_direction, State* state) const noexcept {
  RememberedContacts::Normals normals(3, 0);
  if (!force_selection.allFinite() || !force_direction.allFinite()) {
    ++state->bad_inputs;
    return HistoryStatus::kBadInput;
  }
  if (force_direction.norm() > kMinLength) {
    const Eigen::Vector3d U1 = force_direction.normalized();
    const Eigen::Matrix3d across = force_selection - U1 * U1.transpose();
    // What is left of the rank of Omega_f, a projection, is its trace.
    if (std::lround(across.trace()) == 1) {
      int column{};
      across.colwise().squaredNorm().maxCoeff(&column);
      normals.resize(3, 3);
      normals.col(1) = across.col(column).normalized();
      normals.col(2) = -normals.col(1);
    } else {
      normals.resize(3, 1);
    }
    normals.col(0) = U1;
  }
  return Update(position, normals, state);
}

void ContactHistory::AddContact(const Eigen::Vector3d& normal_sum,
                                Cell* cell) const noexcept {
  int nearest = 0;
  int least_seen = 0;
  double cosine = -1;
  for (int i = 0; i < cell->num_contacts; ++i) {
    const Eigen::Vector3d& other = cell->normal_sums[i];
    const double c = other.dot(normal_sum) / (other.norm() * normal_sum.norm());
    if (c > cosine) {
      nearest = i;
      cosine = c;
    }
    if (other.norm() < cell->normal_sums[least_seen].norm()) least_seen = i;
  }
  if (cosine >= cos_merge_) {
    cell->normal_sums[nearest] += normal_sum;
  } else if (cell->num_contacts < Cell::kMaxContacts) {
    cell->normal_sums[cell->num_contacts++] = normal_sum;
  } else {
    cell->normal_sums[least_seen] = normal_sum;
  }
}

void ContactHistory::KeepVisit(State* state) const noexcept {
  const Cell& visit = state->visit;
  Cell& cell = state->cells[CalcPlace(visit.key, state->cells)];
  if (cell.key != visit.key) cell = Cell{.key = visit.key};
  cell.left_at = state->updates;
  cell.count += visit.count;
  cell.position_sum += visit.position_sum;
  for (int i = 0; i < visit.num_contacts; ++i) {
    AddContact(visit.normal_sums[i], &cell);
  }
}

const Cell* ContactHistory::Find(std::int64_t key,
                                 const State& state) const noexcept {
  const Cell& cell = state.cells[CalcPlace(key, state.cells)];
  const auto age = static_cast<double>(state.updates - cell.left_at);
  return cell.key == key && age >= min_age_updates_ ? &cell : nullptr;
}

RememberedContacts ContactHistory::Lookup(const Eigen::Vector3d& position,
                                          const State& state) const noexcept {
  RememberedContacts prior;
  prior.std = params_.std_base;
  Index index;
  if (!IsCompatible(state) || !CalcIndex(position, &index)) return prior;

  struct Memory {
    double distance{0};
    const Cell* cell{nullptr};
  };
  constexpr int kSide = 2 * kMaxReach + 1;
  std::array<Memory, kSide * kSide * kSide> memories;
  int count = 0;
  for (int x = -reach_; x <= reach_; ++x) {
    for (int y = -reach_; y <= reach_; ++y) {
      for (int z = -reach_; z <= reach_; ++z) {
        const Cell* cell = Find(CalcKey(index + Index(x, y, z)), state);
        if (cell == nullptr) continue;
        const double distance =
            (cell->position_sum / cell->count - position).norm();
        if (distance > params_.radius) continue;
        // In order of distance; of equal ones the first found comes first.
        int i = count++;
        for (; i > 0 && memories[i - 1].distance > distance; --i) {
          memories[i] = memories[i - 1];
        }
        memories[i] = {distance, cell};
      }
    }
  }
  for (int i = 0; i < count; ++i) {
    const Cell& cell = *memories[i].cell;
    for (int k = 0; k < cell.num_contacts; ++k) {
      const Eigen::Vector3d normal = cell.normal_sums[k].normalized();
      const auto num = prior.normals.cols();
      if (num == RememberedContacts::kMaxNormals) return prior;
      if (((prior.normals.transpose() * normal).array() >= cos_merge_).any()) {
        continue;
      }
      prior.normals.conservativeResize(3, num + 1);
      prior.normals.col(num) = normal;
      prior.std = params_.std_base + params_.std_growth * memories[i].distance;
    }
  }
  return prior;
}

}  // namespace dual_proxy
