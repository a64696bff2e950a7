// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/common/enum_strings.h"
#include "dual_proxy/simulation/operator.h"

namespace dual_proxy {

/** @file
Recorded human motion as the operator's path.

A recording is a CSV file as kRecordingFormat says: `t` in s, increasing from
any value, and `px`, `py`, `pz` in m, in any frame whose z is up. `qw`, `qx`,
`qy`, `qz`, a unit quaternion in the same frame, are followed; `R11` to `R33`, a
rotation matrix row by row, are read only. The order of the columns is free,
others are ignored. Blank lines and lines that begin with # are skipped.

It was made in another place, above another surface, so PlaceRecording moves it:
the height at which the person worked becomes a pressing depth below the table's
top, and the first orientation becomes the tool's at home. */

/** What a recording looks like: for errors, help and pages. */
inline constexpr const char* kRecordingFormat =
    "columns t (s), px, py, pz (m), separated by commas, their names in the "
    "first line; optional: qw, qx, qy, qz (orientation); at least 10 rows and "
    "1 s";

/** The first lines of one. */
inline constexpr const char* kRecordingExample =
    "t,px,py,pz\n"
    "0.00,0.450,0.010,0.200\n"
    "0.01,0.451,0.010,0.199\n";

/** In which a recording's positions are. */
enum class LengthUnit { kMetre, kCentimetre, kMillimetre };

template <>
struct EnumStrings<LengthUnit> {
  static constexpr std::pair<LengthUnit, const char*> kValues[] = {
      {LengthUnit::kMetre, "m"},
      {LengthUnit::kCentimetre, "cm"},
      {LengthUnit::kMillimetre, "mm"}};
};

/** A motion as it was recorded, n samples. */
struct Recording {
  Eigen::VectorXd times;  ///< s, from 0, strictly increasing.
  /** m, in the recording's frame, by `scale` smaller or larger than recorded.
   */
  Eigen::Matrix3Xd positions;
  /** One per sample, or none if the file has no orientation. */
  std::vector<Eigen::Matrix3d> rotations;
  /** Whether the operator is to follow them. */
  bool follow_rotations{false};
  /** Columns that look like an orientation, but are not followed. */
  std::vector<std::string> ignored;
  double scale{1};  ///< What was asked for.
};

/** A recording as the operator's path. */
struct PlacedRecording {
  OperatorPathParams path;  ///< In B, from time 0, densely sampled.
  double scale{1};          ///< Lengths in `path` per length recorded.
  /** One line for people: how long, how large, what was scaled, what ignored.
   */
  std::string note;
};

/** Time for the move to a recording's first point, and for the one back, s. */
inline constexpr double kRecordingMoveTime = 2.0;

/** Reads a recording from a CSV file (see CsvReader).
@param unit of the positions in the file.
@param scale  > 0, by which all lengths are multiplied.
@throws std::invalid_argument if the file cannot be read or is not of
kRecordingFormat, has a value that is not a finite number, a matrix or
quaternion that is no rotation, fewer than 10 rows, a length beyond 1 to 3600 s;
or if, once scaled, no hand moves so: a time that does not increase, fewer than
5 or more than 10 000 samples per second, a gap of more than 0.5 s, a speed over
3 m/s or 20 rad/s, a jump. The message names file, row (1 is the first below the
header), column and remedy. */
Recording ReadRecording(const std::string& path,
                        LengthUnit unit = LengthUnit::kMetre, double scale = 1);

/** Places a recording above the table and leads into and out of it.

The recording's contact height (the 1 % quantile of its height: the lowest place
where the hand stayed) goes to `press_depth` below first touch, and nothing goes
deeper. Horizontally the middle of its extent goes above `start`. If that leaves
what is reachable, all its lengths are scaled down by the same factor, at least
0.5, until it fits; time is never scaled. Orientations are taken from the first.
A minimum-jerk move of kRecordingMoveTime leads from `start` to its first point,
another back from its last.

@param recording of at least one sample.
@param start where the robot's tool is at time 0, m, in B.
@param contact_height of the tool point when the tool touches the table, m, in
  B.
@param press_depth below `contact_height`, m.
@param reachable tells whether all of some points, one per column, m, in B, can
  be reached; the set of those that can is convex.
@throws std::invalid_argument if the motion is more than twice as large as what
can be reached, or the pressing depth itself is out of reach. */
PlacedRecording PlaceRecording(
    const Recording& recording, const Eigen::Vector3d& start,
    double contact_height, double press_depth,
    const std::function<bool(const Eigen::Matrix3Xd&)>& reachable);

}  // namespace dual_proxy
