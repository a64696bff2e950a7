// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <functional>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "dual_proxy/simulation/operator.h"

namespace dual_proxy {

/** @file
Recorded human motion as the operator's path.

A recording is a CSV file with a header and the columns `t` (s), `px`, `py`,
`pz` (m, any frame whose z is up) and, if there, `R11` to `R33` (orientation,
row by row); other columns are ignored. It was made in another place, above
another surface, so PlaceRecording moves it: the height at which the person
worked becomes a pressing depth below the table's top. The operator follows the
positions; the tool keeps its orientation. */

/** A motion as it was recorded, n samples. */
struct Recording {
  Eigen::VectorXd times;       ///< s, from 0, strictly increasing.
  Eigen::Matrix3Xd positions;  ///< m, in the recording's frame.
  /** One per sample, or none if the file has no orientation. */
  std::vector<Eigen::Matrix3d> rotations;
};

/** Time for the move to a recording's first point, and for the one back, s. */
inline constexpr double kRecordingMoveTime = 2.0;

/** Reads a recording from a CSV file (see ParseCsv).
@throws std::invalid_argument if the file cannot be read, lacks a column, has a
value that is not a finite number, a time that does not increase, a matrix that
is not a rotation, or is shorter than 10 rows or 1 s or longer than 3600 s. The
message names file, row (1 is the first below the header) and column. */
Recording ReadRecording(const std::string& path);

/** Places a recording above the table and leads into and out of it.

The recording's contact height (the 1 % quantile of its height: the lowest place
where the hand stayed) goes to `press_depth` below first touch, and nothing goes
deeper. Horizontally the middle of its extent goes above `start`. If that leaves
what is reachable, all its lengths are scaled down by the same factor until it
fits; time is never scaled. A minimum-jerk move of kRecordingMoveTime leads from
`start` to its first point, another back from its last.

@param recording of at least one sample.
@param start where the robot's tool is at time 0, m, in B.
@param contact_height of the tool point when the tool touches the table, m, in
  B.
@param press_depth below `contact_height`, m.
@param reachable tells whether all of some points, one per column, m, in B, can
  be reached; the set of those that can is convex.
@returns the tool's path in B, from time 0, densely sampled.
@throws std::invalid_argument if the pressing depth itself is out of reach. */
OperatorPathParams PlaceRecording(
    const Recording& recording, const Eigen::Vector3d& start,
    double contact_height, double press_depth,
    const std::function<bool(const Eigen::Matrix3Xd&)>& reachable);

}  // namespace dual_proxy
