// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/recording.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>

#include <Eigen/LU>

#include "dual_proxy/common/validate.h"
#include "dual_proxy/experiment/csv.h"
#include "dual_proxy/experiment/number_text.h"
#include "dual_proxy/experiment/quantile.h"

namespace dual_proxy {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Row = std::vector<std::string>;

constexpr Index kMinRows = 10;
constexpr double kMinLength = 1;     // s
constexpr double kMaxLength = 3600;  // s
constexpr double kRotationTolerance = 1e-3;
constexpr double kContactShare = 0.01;
/** Samples per second of the moves into and out of a recording. */
constexpr int kMoveRate = 100;
constexpr std::string_view kSpaces = " \t\n\r\f\v";

template <typename... Parts>
[[noreturn]] void Throw(const Parts&... parts) {
  std::ostringstream message;
  (message << ... << parts);
  throw std::invalid_argument(message.str());
}

std::string_view Trim(std::string_view text) {
  const std::size_t first = text.find_first_not_of(kSpaces);
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(kSpaces) + 1 - first);
}

/** In quotes, on one line, as Python shows a string. */
std::string Quote(std::string_view text) {
  const bool apostrophe = text.find('\'') != std::string_view::npos &&
                          text.find('"') == std::string_view::npos;
  const char mark = apostrophe ? '"' : '\'';
  std::string quoted(1, mark);
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == mark || c == '\\') {
      quoted += {'\\', c};
    } else if (c == '\n') {
      quoted += "\\n";
    } else if (c == '\r') {
      quoted += "\\r";
    } else if (c == '\t') {
      quoted += "\\t";
    } else if (byte < 0x20 || byte == 0x7F) {
      char escape[5];
      std::snprintf(escape, sizeof(escape), "\\x%02x", byte);
      quoted += escape;
    } else {
      quoted += c;
    }
  }
  return quoted + mark;
}

std::string ReadFile(const std::string& path) {
  const auto close = [](std::FILE* file) { std::fclose(file); };
  std::unique_ptr<std::FILE, decltype(close)> file(
      std::fopen(path.c_str(), "rb"), close);
  std::string text;
  if (file) {
    std::array<char, 65536> buffer;
    std::size_t count = 0;
    errno = 0;
    while ((count = std::fread(buffer.data(), 1, buffer.size(), file.get()))) {
      text.append(buffer.data(), count);
    }
  }
  if (!file || std::ferror(file.get())) {
    Throw(path, ": ", std::generic_category().message(errno));
  }
  return text;
}

std::vector<Row> ReadRows(const std::string& path) {
  const std::string text = ReadFile(path);
  try {
    return ParseCsv(text);
  } catch (const std::invalid_argument& error) {
    Throw(path, ": expected a CSV file: ", error.what());
  }
}

/** A finite number, or NaN. */
double ParseNumber(std::string_view text) {
  text = Trim(text);
  if (text.starts_with('+') && !text.starts_with("+-")) text.remove_prefix(1);
  double value{};
  const auto [end, error] =
      std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return NAN;
  return value;
}

/** One row of `columns` per row of the file below its header. */
MatrixXd ReadTable(const std::string& path, const std::vector<Row>& rows,
                   const Row& header, const Row& columns) {
  std::vector<std::size_t> places;
  for (const std::string& name : columns) {
    places.push_back(std::find(header.begin(), header.end(), name) -
                     header.begin());
  }
  MatrixXd table(rows.size(), columns.size());
  Index number = 0;
  for (std::size_t i = 1; i < rows.size(); ++i) {
    const Row& row = rows[i];
    if (row.empty()) continue;
    ++number;
    if (row.size() != header.size()) {
      Throw(path, ", row ", number, ": expected ", header.size(),
            " values, got ", row.size());
    }
    for (std::size_t k = 0; k < columns.size(); ++k) {
      const std::string& text = row[places[k]];
      const double value = ParseNumber(text);
      if (!std::isfinite(value)) {
        Throw(path, ", row ", number, ", column ", Quote(columns[k]),
              ": expected a finite number, got ", Quote(text));
      }
      table(number - 1, static_cast<Index>(k)) = value;
    }
  }
  return table.topRows(number);
}

void CheckTimes(const std::string& path, const VectorXd& times) {
  const Index n = times.size();
  const double length = n > 0 ? times(n - 1) - times(0) : 0;
  if (n < kMinRows || length < kMinLength) {
    Throw(path, ": too short, expected at least ", kMinRows, " rows and ",
          kMinLength, " s, got ", n, " rows and ", length, " s");
  }
  if (length > kMaxLength) {
    Throw(path, ": too long, expected at most ", kMaxLength, " s, got ", length,
          " s");
  }
  for (Index i = 1; i < n; ++i) {
    if (times(i) <= times(i - 1)) {
      Throw(path, ", row ", i + 1, ", column 't': expected a time after ",
            times(i - 1), " s, got ", times(i), " s");
    }
  }
}

bool IsRotation(const Matrix3d& R) {
  const Matrix3d deviation = R * R.transpose() - Matrix3d::Identity();
  return deviation.cwiseAbs().maxCoeff() <= kRotationTolerance &&
         R.determinant() >= 0;
}

}  // namespace

Recording ReadRecording(const std::string& path) {
  const std::vector<Row> rows = ReadRows(path);
  Row header;
  if (!rows.empty()) {
    for (const std::string& name : rows[0]) header.emplace_back(Trim(name));
  }
  const Row rotation = {"R11", "R12", "R13", "R21", "R22",
                        "R23", "R31", "R32", "R33"};
  Row columns = {"t", "px", "py", "pz"};
  if (std::find_first_of(header.begin(), header.end(), rotation.begin(),
                         rotation.end()) != header.end()) {
    columns.insert(columns.end(), rotation.begin(), rotation.end());
  }
  for (const std::string& name : columns) {
    const auto count = std::count(header.begin(), header.end(), name);
    if (count != 1) {
      Throw(path, ": column ", Quote(name), " is ",
            count == 0 ? "missing" : "found more than once");
    }
  }
  const MatrixXd table = ReadTable(path, rows, header, columns);
  CheckTimes(path, table.col(0));
  Recording recording;
  recording.times = table.col(0).array() - table(0, 0);
  recording.positions = table.middleCols<3>(1).transpose();
  if (table.cols() == 4) return recording;
  for (Index i = 0; i < table.rows(); ++i) {
    const Matrix3d transposed = table.row(i).tail<9>().reshaped(3, 3);
    if (!IsRotation(transposed)) {
      Throw(path, ", row ", i + 1,
            ", columns 'R11' to 'R33': expected a rotation matrix");
    }
    recording.rotations.push_back(transposed.transpose());
  }
  return recording;
}

OperatorPathParams PlaceRecording(
    const Recording& recording, const Vector3d& start, double contact_height,
    double press_depth,
    const std::function<bool(const Matrix3Xd&)>& reachable) {
  const Matrix3Xd& recorded = recording.positions;
  if (recorded.cols() < 1 || recorded.cols() != recording.times.size()) {
    ThrowInvalidField("Recording", "positions", "one column per time, n >= 1",
                      static_cast<double>(recorded.cols()));
  }
  const Vector3d low = recorded.rowwise().minCoeff();
  const Vector3d high = recorded.rowwise().maxCoeff();
  Vector3d origin = (low + high) / 2;
  origin.z() = CalcQuantile(recorded.row(2), kContactShare);
  Matrix3Xd offsets = recorded.colwise() - origin;
  offsets.row(2) = offsets.row(2).cwiseMax(0);
  const Vector3d middle(start.x(), start.y(), contact_height - press_depth);
  if (!reachable(middle)) {
    Throw(
        "operator.press_depth: expected a depth that the device reaches below "
        "scene.start_position, got ",
        ShortestText(press_depth));
  }
  const auto scaled = [&](double scale) -> Matrix3Xd {
    return (scale * offsets).colwise() + middle;
  };
  Matrix3Xd points = scaled(1);
  if (!reachable(points)) {
    // The set is convex and holds `middle`, so bisection finds its border.
    double scale = 0;
    double too_large = 1;
    for (int i = 0; i < 20; ++i) {
      const double trial = (scale + too_large) / 2;
      (reachable(scaled(trial)) ? scale : too_large) = trial;
    }
    points = scaled(scale);
  }

  constexpr int kSteps = static_cast<int>(kRecordingMoveTime * kMoveRate);
  const Index n = points.cols();
  const Vector3d first = points.col(0);
  const Vector3d last = points.col(n - 1);
  OperatorPathParams path;
  path.interpolation = PathInterpolation::kCubic;
  path.times.resize(kSteps + n + kSteps);
  path.points.resize(3, kSteps + n + kSteps);
  path.times.segment(kSteps, n) = recording.times.array() + kRecordingMoveTime;
  path.points.middleCols(kSteps, n) = points;
  const double end = path.times(kSteps + n - 1);
  for (int i = 0; i <= kSteps; ++i) {
    const double s = i == kSteps ? 1 : i * (1.0 / kSteps);
    const double share = s * s * s * (10 - 15 * s + 6 * (s * s));
    if (i < kSteps) {
      path.times(i) = s * kRecordingMoveTime;
      path.points.col(i) = start + share * (first - start);
    }
    if (i > 0) {
      path.times(kSteps + n - 1 + i) = end + s * kRecordingMoveTime;
      path.points.col(kSteps + n - 1 + i) = last + share * (start - last);
    }
  }
  return path;
}

}  // namespace dual_proxy
