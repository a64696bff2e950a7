// SPDX-License-Identifier: BSD-3-Clause
// Any text as a recording: an error of one line, or a motion of a hand.
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <exception>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/experiment/csv.h"
#include "dual_proxy/experiment/recording.h"
#include "fuzz_tools.h"

namespace dual_proxy {
namespace {

using Eigen::Index;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Rows = std::vector<std::vector<std::string>>;

constexpr double kContactHeight = 0.11;
constexpr double kPressDepth = 0.04;
constexpr double kReach = 0.2;  // m
const Vector3d kStart(0.45, 0, 0.18);

bool IsReachable(const Matrix3Xd& points) {
  return ((points.colwise() - kStart).colwise().norm().array() <= kReach).all();
}

Rows ParseCsv(std::string_view text) {
  CsvReader reader(text);
  Rows rows;
  std::vector<std::string> row;
  while (reader.Next(&row)) rows.push_back(row);
  return rows;
}

// What people are shown: a line of UTF-8, not endless.
void RequireLine(std::string_view text) {
  Require(!text.empty() && text.size() < 2000, "a text of a sensible length");
  for (const char c : text) {
    Require(static_cast<unsigned char>(c) >= 0x20 && c != 0x7F,
            "a line without control characters");
  }
  try {
    CsvReader reader(text);
  } catch (const InvalidCsv&) {
    Require(false, "a text in UTF-8");
  }
}

void CheckCsv(std::string_view text) {
  Rows rows;
  try {
    rows = ParseCsv(text);
  } catch (const InvalidCsv& error) {
    RequireLine(error.what());
    return;
  }
  Require(rows.size() <= text.size(), "no more rows than bytes");
  std::size_t size = 0;
  for (const auto& row : rows) {
    for (const std::string& field : row) size += field.size();
  }
  Require(size <= text.size(), "no more in the fields than in the text");
  if (!text.starts_with(kByteOrderMark)) {
    Require(ParseCsv(std::string(kByteOrderMark) + std::string(text)) == rows,
            "a byte order mark makes no difference");
  }
  if (text.find_first_of("\"\r") == std::string_view::npos) {
    std::string other;
    for (const char c : text) other += c == '\n' ? "\r\n" : std::string(1, c);
    Require(ParseCsv(other) == rows, "nor does how lines end");
  }
}

void CheckRecording(const Recording& recording) {
  const Index n = recording.times.size();
  Require(n >= 10 && recording.times(0) == 0, "10 rows or more, from 0");
  Require(recording.times.allFinite() && recording.positions.allFinite() &&
              recording.positions.cols() == n,
          "finite times and positions");
  Require((recording.times.tail(n - 1).array() >
           recording.times.head(n - 1).array())
              .all(),
          "increasing times");
  Require(recording.times(n - 1) >= 1 && recording.times(n - 1) <= 3600,
          "from 1 s to an hour");
  Require(recording.rotations.empty() ||
              recording.rotations.size() == static_cast<std::size_t>(n),
          "an orientation for each row, or none");
  Require(!recording.follow_rotations || !recording.rotations.empty(),
          "something to follow");
  for (const Eigen::Matrix3d& R : recording.rotations) {
    Require(IsValidPose({.p = Vector3d::Zero(), .R = R}), "rotations");
  }
  for (Index i = 1; i < n; ++i) {
    const double step =
        (recording.positions.col(i) - recording.positions.col(i - 1)).norm();
    const double interval = recording.times(i) - recording.times(i - 1);
    Require(step <= 3.001 * interval + 1e-6, "a hand's speed");
  }
}

void CheckPlaced(const PlacedRecording& placed) {
  const OperatorPathParams& params = placed.path;
  RequireLine(placed.note);
  Require(placed.scale > 0 && std::isfinite(placed.scale), "a scale");
  Require(
      params.points.row(2).minCoeff() >= kContactHeight - kPressDepth - 1e-9,
      "no deeper than the pressing depth");
  Require(IsReachable(params.points), "within reach");
  const Index last = params.times.size() - 1;
  Require((params.points.col(0) - kStart).norm() < 1e-9 &&
              (params.points.col(last) - kStart).norm() < 1e-9,
          "from the start, and back");
  const OperatorPath path(params);
  const double end = params.times(last);
  for (int i = -1; i <= 101; ++i) {
    const OperatorPathSample sample = path.Calc(0.01 * i * end);
    Require(sample.position.allFinite() && sample.velocity.allFinite() &&
                IsValidPose({.p = sample.position, .R = sample.rotation}),
            "a finite path");
  }
}

// Of a text that is in the file `path`.
void CheckFile(const std::string& path, LengthUnit unit, double scale) {
  try {
    const Recording recording = ReadRecording(path, unit, scale);
    CheckRecording(recording);
    CheckPlaced(PlaceRecording(recording, kStart, kContactHeight, kPressDepth,
                               IsReachable));
  } catch (const std::invalid_argument& error) {
    RequireLine(error.what());
    Require(std::string_view(error.what()).find(": ") != std::string::npos,
            "where, and what");
  } catch (const std::exception& error) {
    RequireNoOther(error);
  }
}

}  // namespace
}  // namespace dual_proxy

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data,
                                      std::size_t size) {
  using dual_proxy::LengthUnit;
  static std::FILE* const file = std::tmpfile();
  static const std::string path =
      "/proc/self/fd/" + std::to_string(fileno(file));
  const bool written =
      ftruncate(fileno(file), 0) == 0 &&
      pwrite(fileno(file), data, size, 0) == static_cast<ssize_t>(size);
  dual_proxy::Require(written, "the file can be written");
  dual_proxy::CheckCsv({reinterpret_cast<const char*>(data), size});
  dual_proxy::CheckFile(path, LengthUnit::kMetre, 1);
  dual_proxy::CheckFile(path, LengthUnit::kMillimetre, 0.3);
  return 0;
}
