// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/recording.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <memory>
#include <numbers>
#include <ranges>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <utility>

#include <Eigen/Geometry>
#include <Eigen/LU>

#include "dual_proxy/common/rotation.h"
#include "dual_proxy/common/validate.h"
#include "dual_proxy/experiment/csv.h"
#include "dual_proxy/experiment/line_text.h"
#include "dual_proxy/experiment/number_text.h"
#include "dual_proxy/experiment/quantile.h"

namespace dual_proxy {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using Row = std::vector<std::string>;

constexpr Index kMinRows = 10;
constexpr double kMinLength = 1;         // s
constexpr double kMaxLength = 3600;      // s
constexpr double kMinInterval = 1e-4;    // s, between rows.
constexpr double kMaxInterval = 0.2;     // s
constexpr double kMaxGap = 0.5;          // s
constexpr double kMaxSpeed = 3;          // m/s
constexpr double kMaxTurnRate = 20;      // rad/s
constexpr double kMaxAcceleration = 50;  // m/s^2; see CheckMotion.
constexpr double kMaxSpeedChange = 1;    // m/s
constexpr double kMinJump = 0.005;       // m; less is noise.
constexpr double kMaxCoordinate = 1e9;   // m
constexpr double kMinShrinking = 0.5;
constexpr double kRotationTolerance = 1e-3;
constexpr double kQuaternionTolerance = 1e-2;
constexpr double kContactShare = 0.01;
/** Samples per second of the moves into and out of a recording. */
constexpr int kMoveRate = 100;
constexpr std::size_t kMaxShown = 60;  // Bytes of a text in a message.
constexpr std::string_view kSpaces = " \t\n\r\f\v";

const Row kNeeded = {"t", "px", "py", "pz"};
const Row kQuaternion = {"qw", "qx", "qy", "qz"};
const Row kMatrix = {"R11", "R12", "R13", "R21", "R22",
                     "R23", "R31", "R32", "R33"};

constexpr const char* kUnitRemedy =
    "give the unit if it is not m (--recording-units mm or cm; "
    "operator.recording_units)";

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

/** In quotes, on one line, as Python shows a string; of a long one the start.
 */
std::string Quote(std::string_view whole) {
  const std::string_view text = StartOf(whole, kMaxShown);
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
  quoted += mark;
  return text.size() < whole.size() ? quoted + "..." : quoted;
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

/** A number for people: four digits. */
std::string Rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%.4g", value);
  return text;
}

std::string Lower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

std::string Join(const Row& names) {
  std::string text;
  for (const std::string& name : names) {
    text.append(text.empty() ? "" : ", ").append(name);
  }
  return text;
}

bool Contains(const Row& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

bool ContainsAll(const Row& names, const Row& wanted) {
  return std::ranges::all_of(
      wanted, [&](const std::string& name) { return Contains(names, name); });
}

/** Whether a column says by its name that it is part of an orientation. */
bool LooksLikeOrientation(const std::string& name) {
  static const Row kNames = {"rx",  "ry",  "rz",  "rw",  "ox",  "oy",  "oz",
                             "ow",  "q_w", "q_x", "q_y", "q_z", "qw",  "qx",
                             "qy",  "qz",  "r11", "r12", "r13", "r21", "r22",
                             "r23", "r31", "r32", "r33"};
  const std::string lower = Lower(name);
  if (Contains(kNames, lower)) return true;
  for (const char* start :
       {"roll", "pitch", "yaw", "quat", "euler", "orient", "rot"}) {
    if (lower.starts_with(start)) return true;
  }
  return false;
}

Row Split(std::string_view text, char separator) {
  Row parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.emplace_back(Trim(text.substr(begin, end - begin)));
    begin = end + 1;
  }
  return parts;
}

/** What is wrong with the text of a file whose first line that is neither blank
nor a comment is `line`, not a header of a recording. */
std::string DescribeNoHeader(std::string_view line) {
  char separator = ',';
  const char* separated = "";
  for (const auto& [mark, name] :
       {std::pair{';', "semicolons"}, {'\t', "tabs"}, {'|', "bars"}}) {
    if (line.find(mark) == std::string_view::npos) continue;
    separator = mark;
    separated = name;
    break;
  }
  if (separator == ',' && line.find(',') == std::string_view::npos &&
      line.find(' ') != std::string_view::npos) {
    separator = ' ';
    separated = "spaces";
  }
  std::string found = Quote(line);
  if (separator != ',') found.append(", separated by ").append(separated);

  const Row fields = Split(line, separator);
  const bool numbers = std::ranges::all_of(fields, [](std::string field) {
    if (field.empty()) return true;
    std::ranges::replace(field, ',', '.');
    return std::isfinite(ParseNumber(field));
  });
  if (numbers) return found + ", without names";
  Row lower;
  for (const std::string& field : fields) lower.push_back(Lower(field));
  Row missing;
  bool other_case = false;
  for (const std::string& name : kNeeded) {
    if (Contains(fields, name)) continue;
    missing.push_back(name);
    other_case = other_case || Contains(lower, name);
  }
  if (other_case) return found + ", in upper case";
  if (!missing.empty()) found.append(", without ").append(Join(missing));
  return found;
}

/** The line at the start of `text` that is neither blank nor a comment. */
std::string_view FirstLine(std::string_view text) {
  if (text.starts_with(kByteOrderMark)) {
    text.remove_prefix(kByteOrderMark.size());
  }
  while (!text.empty()) {
    const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
    const std::string_view line = Trim(text.substr(0, end));
    if (!line.empty() && !line.starts_with('#')) return line;
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return {};
}

[[noreturn]] void ThrowNoRecording(const std::string& path,
                                   const std::string& found) {
  Throw(path, ": expected ", kRecordingFormat, "; found ", found);
}

bool IsBlank(const Row& row) {
  return std::ranges::all_of(
      row, [](const std::string& field) { return Trim(field).empty(); });
}

bool IsComment(const Row& row) {
  return !row.empty() && Trim(row[0]).starts_with('#');
}

/** The numbers of some columns, and what else the header names. */
struct Table {
  Row header;
  Row columns;                 // Those that are read.
  std::vector<double> values;  // Row by row.

  auto matrix() const {
    using RowMajor =
        Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    const auto width = static_cast<Index>(columns.size());
    return Eigen::Map<const RowMajor>(
        values.data(), static_cast<Index>(values.size()) / width, width);
  }
};

/** Reads up to the header, which may be a comment. */
Row ReadHeader(const std::string& path, std::string_view text,
               CsvReader* reader) {
  Row row;
  while (reader->Next(&row)) {
    if (IsBlank(row)) continue;
    const bool comment = IsComment(row);
    Row header;
    for (const std::string& name : row) header.emplace_back(Trim(name));
    if (comment) header[0] = Trim(std::string_view(header[0]).substr(1));
    while (!header.empty() && header.back().empty()) header.pop_back();
    if (ContainsAll(header, kNeeded)) return header;
    if (!comment) ThrowNoRecording(path, DescribeNoHeader(FirstLine(text)));
  }
  ThrowNoRecording(path, FirstLine(text).empty() ? "no line in the file"
                                                 : "no line of names");
}

Row ChooseColumns(const std::string& path, const Row& header) {
  Row columns = kNeeded;
  for (const Row* orientation : {&kQuaternion, &kMatrix}) {
    if (!ContainsAll(header, *orientation)) continue;
    columns.insert(columns.end(), orientation->begin(), orientation->end());
    break;
  }
  for (const std::string& name : columns) {
    if (std::ranges::count(header, name) > 1) {
      ThrowNoRecording(path, Quote(name) + " more than once");
    }
  }
  return columns;
}

Table ReadTable(const std::string& path, std::string_view text) {
  CsvReader reader(text);
  Table table;
  table.header = ReadHeader(path, text, &reader);
  const Row& header = table.header;
  table.columns = ChooseColumns(path, header);
  std::vector<std::size_t> places;
  for (const std::string& name : table.columns) {
    places.push_back(std::ranges::find(header, name) - header.begin());
  }
  Index number = 0;
  Row row;
  while (reader.Next(&row)) {
    if (IsBlank(row) || IsComment(row)) continue;
    ++number;
    while (row.size() > header.size() && Trim(row.back()).empty()) {
      row.pop_back();
    }
    if (row.size() < header.size()) {
      Throw(path, ", row ", number, ": expected ", header.size(),
            " values, got ", row.size(), ", none for column ",
            Quote(header[row.size()]));
    }
    if (row.size() > header.size()) {
      Throw(path, ", row ", number, ": expected ", header.size(),
            " values, got ", row.size(), ", ", Quote(row[header.size()]),
            " beyond column ", Quote(header.back()),
            row.size() == 2 * header.size() ? " (decimal commas?)" : "");
    }
    for (std::size_t k = 0; k < places.size(); ++k) {
      const std::string& field = row[places[k]];
      const double value = ParseNumber(field);
      if (!std::isfinite(value)) {
        Throw(path, ", row ", number, ", column ", Quote(table.columns[k]),
              ": expected a finite number, got ", Quote(field));
      }
      table.values.push_back(value);
    }
  }
  return table;
}

Table ReadTable(const std::string& path) {
  const std::string text = ReadFile(path);
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    ThrowNoRecording(path, "UTF-16 text; save it as CSV in UTF-8");
  }
  if (text.find('\0') != std::string::npos) {
    ThrowNoRecording(path, "a binary file");
  }
  try {
    return ReadTable(path, text);
  } catch (const InvalidCsv& error) {
    ThrowNoRecording(path, error.what());
  }
}

/** What a row does wrong, and what helps. */
template <typename... Parts>
[[noreturn]] void ThrowAtRow(const std::string& path, Index row,
                             const Parts&... parts) {
  Throw(path, ", row ", row + 1, parts...);
}

void CheckTimes(const std::string& path, const VectorXd& times) {
  const Index n = times.size();
  const double length = n > 0 ? times(n - 1) - times(0) : 0;
  const auto throw_too_short = [&] {
    Throw(path, ": too short, expected at least ", kMinRows, " rows and ",
          kMinLength, " s, got ", n, " rows and ", Rounded(length), " s");
  };
  if (n < kMinRows) throw_too_short();
  const VectorXd intervals = times.tail(n - 1) - times.head(n - 1);
  for (Index i = 1; i < n; ++i) {
    if (intervals(i - 1) > 0) continue;
    ThrowAtRow(path, i, ", column 't': expected a time after ",
               NumberText(times(i - 1)), " s, got ", NumberText(times(i)),
               " s: remove rows that are there twice, sort the rest");
  }
  const double interval = CalcQuantile(intervals, 0.5);
  // Times that are written in decimals are a little off.
  constexpr double kDust = 1 + 1e-6;
  if (interval * kDust < kMinInterval || interval > kMaxInterval * kDust) {
    const char* remedy = interval < kMinInterval ? "leave rows out"
                         : interval < 1 ? "sample it faster"
                                        : "times must be in s, not in ms";
    Throw(path, ", row 2, column 't': rows are ", Rounded(interval),
          " s apart (median), expected ", kMinInterval, " to ", kMaxInterval,
          " s (10 kHz to 5 Hz): ", remedy);
  }
  if (length < kMinLength) throw_too_short();
  if (length > kMaxLength) {
    Throw(path, ": too long, expected at most ", kMaxLength, " s, got ",
          Rounded(length), " s");
  }
  for (Index i = 1; i < n; ++i) {
    if (intervals(i - 1) <= kMaxGap) continue;
    ThrowAtRow(path, i, ", column 't': a gap of ", Rounded(intervals(i - 1)),
               " s, expected at most ", kMaxGap,
               " s: fill it, or cut the recording there");
  }
}

/** No hand moves faster, and none is at once at speed: over a step of kMinJump
or more the velocity changes by no more than kMaxAcceleration brings, or
kMaxSpeedChange, which is noise in short intervals. */
void CheckMotion(const std::string& path, const VectorXd& t,
                 const Matrix3Xd& p) {
  struct Step {
    double interval{INFINITY};  // The motion may begin at speed.
    double distance{0};
    Vector3d velocity{Vector3d::Zero()};
  };
  const std::string remedy =
      std::string(" m/s: remove the row if it is wrong, or ") + kUnitRemedy;
  Step last;
  for (Index i = 1; i < t.size(); ++i) {
    const Vector3d d = p.col(i) - p.col(i - 1);
    const double interval = t(i) - t(i - 1);
    const Step step{interval, d.norm(), d / interval};
    const double speed = step.velocity.norm();
    if (speed > kMaxSpeed) {
      ThrowAtRow(path, i, ": the hand moves by ", Rounded(step.distance),
                 " m in ", Rounded(interval), " s (", Rounded(speed),
                 " m/s), expected at most ", kMaxSpeed, remedy);
    }
    const double change = (step.velocity - last.velocity).norm();
    const double allowed = std::max(
        kMaxSpeedChange, kMaxAcceleration * (interval + last.interval) / 2);
    const bool here = step.distance >= last.distance;
    const Step& larger = here ? step : last;
    if (larger.distance >= kMinJump && change > allowed) {
      ThrowAtRow(path, here ? i : i - 1, ": the hand jumps by ",
                 Rounded(larger.distance), " m in ", Rounded(larger.interval),
                 " s (its velocity changes by ", Rounded(change),
                 " m/s), expected at most ", Rounded(allowed), remedy);
    }
    last = step;
  }
}

void CheckRotations(const std::string& path, const VectorXd& t,
                    const std::vector<Matrix3d>& R) {
  for (std::size_t i = 1; i < R.size(); ++i) {
    const auto row = static_cast<Index>(i);
    const double interval = t(row) - t(row - 1);
    const double angle = LogRotation(R[i] * R[i - 1].transpose()).norm();
    if (angle <= kMaxTurnRate * interval) continue;
    ThrowAtRow(path, row, ": the hand turns by ", Rounded(angle), " rad in ",
               Rounded(interval), " s, expected at most ", kMaxTurnRate,
               " rad/s: remove the row if it is wrong");
  }
}

bool IsRotation(const Matrix3d& R) {
  const Matrix3d deviation = R * R.transpose() - Matrix3d::Identity();
  return deviation.cwiseAbs().maxCoeff() <= kRotationTolerance &&
         R.determinant() >= 0;
}

std::vector<Matrix3d> ReadRotations(const std::string& path,
                                    const Table& table) {
  const auto values = table.matrix();
  std::vector<Matrix3d> rotations;
  if (values.cols() == 4) return rotations;
  rotations.reserve(values.rows());
  for (Index i = 0; i < values.rows(); ++i) {
    if (values.cols() == 8) {
      const Eigen::Vector4d q = values.row(i).tail<4>();
      const double length = q.norm();
      if (!(std::abs(length - 1) <= kQuaternionTolerance)) {
        ThrowAtRow(path, i, ", columns 'qw' to 'qz': expected length 1, got ",
                   Rounded(length));
      }
      rotations.push_back(Eigen::Quaterniond(q(0), q(1), q(2), q(3))
                              .normalized()
                              .toRotationMatrix());
      continue;
    }
    const Matrix3d transposed = values.row(i).tail<9>().reshaped(3, 3);
    if (!IsRotation(transposed)) {
      ThrowAtRow(path, i,
                 ", columns 'R11' to 'R33': expected a rotation matrix");
    }
    rotations.push_back(transposed.transpose());
  }
  return rotations;
}

double MetresPer(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::kMetre:
      return 1;
    case LengthUnit::kCentimetre:
      return 0.01;
    case LengthUnit::kMillimetre:
      return 0.001;
  }
  return NAN;
}

void CheckCoordinates(const std::string& path, const Matrix3Xd& positions) {
  Index axis = 0;
  Index row = 0;
  const double largest = positions.cwiseAbs().maxCoeff(&axis, &row);
  if (largest <= kMaxCoordinate) return;
  ThrowAtRow(path, row, ", column ", Quote(kNeeded[axis + 1]),
             ": expected a position within ", kMaxCoordinate, " m, got ",
             Rounded(positions(axis, row)), " m");
}

/** "35 x 20 x 20 mm", or in m from 1 m on. */
std::string ShowExtent(const Vector3d& size) {
  const bool metres = size.maxCoeff() >= 1;
  const Vector3d shown = metres ? size : 1000 * size;
  return Rounded(shown.x()) + " x " + Rounded(shown.y()) + " x " +
         Rounded(shown.z()) + (metres ? " m" : " mm");
}

/** Not larger than `value`, > 0. */
std::string FloorTo2Digits(double value) {
  const double step = std::pow(10, std::floor(std::log10(value)) - 1);
  return Rounded(std::floor(value / step) * step);
}

std::string DescribePlaced(const Recording& recording, double shrinking) {
  const Matrix3Xd& p = recording.positions;
  const Index n = p.cols();
  const double length = recording.times(n - 1);
  const Vector3d size = p.rowwise().maxCoeff() - p.rowwise().minCoeff();
  std::ostringstream note;
  note << n << " samples in " << Rounded(length) << " s, "
       << ShowExtent(shrinking * size);
  if (recording.scale != 1) {
    note << ", scaled by " << Rounded(recording.scale) << " as asked for";
  }
  if (shrinking != 1) {
    note << ", shrunk to " << Rounded(shrinking)
         << " to fit the device's workspace";
  }
  if (recording.scale == 1 && shrinking == 1) note << ", not scaled";
  note << (recording.follow_rotations ? "; orientation followed"
                                      : "; orientation not followed");
  if (!recording.ignored.empty()) {
    note << ", ignored: " << LineText(Join(recording.ignored), 200);
  }
  return note.str();
}

/** Each rotation vector near the one before: it may pass pi. */
Matrix3Xd CalcTurns(const std::vector<Matrix3d>& R) {
  Matrix3Xd turns(3, R.size());
  Vector3d last = Vector3d::Zero();
  for (std::size_t i = 0; i < R.size(); ++i) {
    Vector3d turn = LogRotation(R[i] * R[0].transpose());
    const double angle = turn.norm();
    if (angle > 0) {
      const Vector3d round = 2 * std::numbers::pi / angle * turn;
      turn +=
          std::round((last - turn).dot(round) / round.squaredNorm()) * round;
    }
    turns.col(static_cast<Index>(i)) = last = turn;
  }
  return turns;
}

}  // namespace

Recording ReadRecording(const std::string& path, LengthUnit unit,
                        double scale) {
  ThrowUnlessIn("ReadRecording", "scale", scale, Above(0));
  const Table table = ReadTable(path);
  const auto values = table.matrix();
  Recording recording;
  recording.scale = scale;
  recording.times = values.col(0);
  CheckTimes(path, recording.times);
  recording.times.array() -= values(0, 0);
  recording.positions =
      MetresPer(unit) * scale * values.middleCols<3>(1).transpose();
  CheckCoordinates(path, recording.positions);
  CheckMotion(path, recording.times, recording.positions);
  recording.rotations = ReadRotations(path, table);
  recording.follow_rotations = Contains(table.columns, "qw");
  if (recording.follow_rotations) {
    CheckRotations(path, recording.times, recording.rotations);
  }
  for (const std::string& name : table.header) {
    const bool followed =
        recording.follow_rotations && Contains(kQuaternion, name);
    if (!followed && LooksLikeOrientation(name)) {
      recording.ignored.push_back(name);
    }
  }
  return recording;
}

PlacedRecording PlaceRecording(
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
  double shrinking = 1;
  if (!reachable(points)) {
    // The set is convex and holds `middle`, so bisection finds its border.
    double too_large = 1;
    shrinking = 0;
    for (int i = 0; i < 20; ++i) {
      const double trial = (shrinking + too_large) / 2;
      (reachable(scaled(trial)) ? shrinking : too_large) = trial;
    }
    points = scaled(shrinking);
  }
  if (shrinking < kMinShrinking) {
    Index farthest = 0;
    offsets.colwise().squaredNorm().maxCoeff(&farthest);
    Throw("operator.recording: row ", farthest + 1, ": a motion of ",
          ShowExtent(high - low),
          " reaches farthest there and would be shrunk to ", Rounded(shrinking),
          " of its size to fit the device's workspace, "
          "expected at least ",
          kMinShrinking, ": scale it ", "(--recording-scale ",
          FloorTo2Digits(recording.scale * shrinking),
          "; operator.recording_scale), or ", kUnitRemedy);
  }

  constexpr int kSteps = static_cast<int>(kRecordingMoveTime * kMoveRate);
  const Index n = points.cols();
  const Vector3d first = points.col(0);
  const Vector3d last = points.col(n - 1);
  PlacedRecording placed;
  placed.scale = recording.scale * shrinking;
  OperatorPathParams& path = placed.path;
  path.interpolation = PathInterpolation::kCubic;
  path.times.resize(kSteps + n + kSteps);
  path.points.resize(3, kSteps + n + kSteps);
  path.times.segment(kSteps, n) = recording.times.array() + kRecordingMoveTime;
  path.points.middleCols(kSteps, n) = points;
  const double end = path.times(kSteps + n - 1);
  Vector3d last_turn = Vector3d::Zero();
  if (recording.follow_rotations) {
    path.rotations.setZero(3, kSteps + n + kSteps);
    path.rotations.middleCols(kSteps, n) = CalcTurns(recording.rotations);
    last_turn = path.rotations.col(kSteps + n - 1);
  }
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
      if (recording.follow_rotations) {
        path.rotations.col(kSteps + n - 1 + i) = (1 - share) * last_turn;
      }
    }
  }
  placed.note = DescribePlaced(recording, shrinking);
  return placed;
}

}  // namespace dual_proxy
