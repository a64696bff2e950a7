// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/recording.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/common/rotation.h"
#include "validation_error.h"

namespace dual_proxy {
namespace {

using Eigen::Matrix3d;
using Eigen::Matrix3Xd;
using Eigen::Vector3d;

constexpr double kContactHeight = 0.41;
constexpr double kPressDepth = 0.04;

class RecordingTest : public testing::Test {
 protected:
  std::string ErrorOf(const std::string& text) const {
    Write(text);
    const std::string message = InvalidArgument([this] { Read(); });
    EXPECT_EQ(message.find('\n'), std::string::npos);
    EXPECT_TRUE(message.starts_with(path_)) << message;
    return message.substr(std::min(path_.size(), message.size()));
  }

  void Write(const std::string& text) const {
    std::ofstream(path_, std::ios::binary) << text;
  }

  Recording Read() const { return ReadRecording(path_); }

  /** Twelve rows, 0.1 s apart, below `header`, each ended by `tail`; row
  `changed` (1 is the first) is replaced by `by`. */
  static std::string Table(const std::string& header = "t,px,py,pz",
                           const std::string& tail = "", int changed = 0,
                           const std::string& by = "") {
    std::ostringstream text;
    text << header << "\n";
    for (int i = 1; i <= 12; ++i) {
      if (i == changed) {
        text << by << "\n";
      } else {
        text << 7 + 0.1 * i << ",1,0." << i / 10 << i % 10 << ",0.5" << tail
             << "\n";
      }
    }
    return text.str();
  }

  const std::string path_{
      testing::TempDir() + "recording_test_" +
      testing::UnitTest::GetInstance()->current_test_info()->name() + ".csv"};
};

TEST_F(RecordingTest, ReadsPositionsAndStartsAtZero) {
  Write(Table());
  const Recording recording = Read();
  ASSERT_EQ(recording.times.size(), 12);
  EXPECT_EQ(recording.times(0), 0);
  EXPECT_NEAR(recording.times(11), 1.1, 1e-12);
  EXPECT_EQ(recording.positions.cols(), 12);
  EXPECT_EQ(recording.positions.col(2), Vector3d(1, 0.03, 0.5));
  EXPECT_TRUE(recording.rotations.empty());
}

TEST_F(RecordingTest, ReadsMatricesRowByRowButFollowsThemNot) {
  Write(Table("t,px,py,pz,note,R11,R12,R13,R21,R22,R23,R31,R32,R33,yaw",
              ",\"free, text\",0,-1,0,1,0,0,0,0,1,3"));
  const Recording recording = Read();
  const Matrix3d R{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}};
  ASSERT_EQ(recording.rotations.size(), 12u);
  for (const Matrix3d& rotation : recording.rotations) EXPECT_EQ(rotation, R);
  EXPECT_FALSE(recording.follow_rotations);
  const std::vector<std::string> ignored = {"R11", "R12", "R13", "R21", "R22",
                                            "R23", "R31", "R32", "R33", "yaw"};
  EXPECT_EQ(recording.ignored, ignored);
}

TEST_F(RecordingTest, FollowsQuaternionsByTheirNames) {
  // A quarter turn about z, not quite of length 1, with either sign.
  for (const char* tail : {",0,0.709,0,0.709", ",0,-0.709,0,-0.709"}) {
    Write(Table("t,px,py,pz,qx,qz,qy,qw", tail));
    const Recording recording = Read();
    ASSERT_EQ(recording.rotations.size(), 12u);
    const Matrix3d R{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}};
    EXPECT_NEAR((recording.rotations[3] - R).norm(), 0, 1e-14);
    EXPECT_TRUE(recording.follow_rotations);
    EXPECT_TRUE(recording.ignored.empty());
  }
  EXPECT_EQ(ErrorOf(Table("t,px,py,pz,qw,qx,qy,qz", ",0.98,0,0,0")),
            ", row 1, columns 'qw' to 'qz': expected length 1, got 0.98");
  EXPECT_EQ(ErrorOf(Table("t,px,py,pz,qw,qx,qy,qz", ",1,0,0,0", 5,
                          "7.5,1,0.05,0.5,0,1,0,0")),
            ", row 5: the hand turns by 3.142 rad in 0.1 s, expected at most "
            "20 rad/s: remove the row if it is wrong");
}

TEST_F(RecordingTest, AnOrientationThatIsNotWholeIsNamedAndNotFollowed) {
  Write(Table("t,px,py,pz,qw,qx,qy,rz,R11,q1,wx,vx", ",7,8,9,0,1,2,3,4"));
  const Recording recording = Read();
  EXPECT_TRUE(recording.rotations.empty());
  const std::vector<std::string> ignored = {"qw", "qx", "qy", "rz", "R11"};
  EXPECT_EQ(recording.ignored, ignored);
}

TEST_F(RecordingTest, ColumnsMayStandInAnyOrderAndLayout) {
  std::ostringstream text;
  text << "\xEF\xBB\xBF\r\n# made by hand\r\n pz , t ,\"px\",py,\r\n";
  for (int i = 0; i < 12; ++i) {
    text << "\"3\", " << 0.1 * i << " ,+1,2e0" << (i % 2 ? "" : ",,")
         << "\r\n\r\n# so far\r\n,,,\r\n";
  }
  Write(text.str());
  const Recording recording = Read();
  ASSERT_EQ(recording.times.size(), 12);
  EXPECT_EQ(recording.positions.col(11), Vector3d(1, 2, 3));
  // As numpy.savetxt writes a header.
  Write(Table("# t,px,py,pz"));
  EXPECT_EQ(Read().times.size(), 12);
}

TEST_F(RecordingTest, WrongValuesAreNamedWithRowAndColumn) {
  const auto error = [this](int row, const std::string& text) {
    return ErrorOf(Table("t,px,py,pz", "", row, text));
  };
  EXPECT_EQ(error(7, "8,1,nan,0"),
            ", row 7, column 'py': expected a finite number, got 'nan'");
  EXPECT_EQ(error(9, "8,1,2,-inf"),
            ", row 9, column 'pz': expected a finite number, got '-inf'");
  EXPECT_EQ(error(1, "8,1e400,2,0"),
            ", row 1, column 'px': expected a finite number, got '1e400'");
  EXPECT_EQ(error(3, "8,\"a\nb'\",2,0"),
            ", row 3, column 'px': expected a finite number, got \"a\\nb'\"");
  EXPECT_EQ(error(3, "8,,2,0"),
            ", row 3, column 'px': expected a finite number, got ''");
  EXPECT_EQ(error(3, "8,0x1,2,0"),
            ", row 3, column 'px': expected a finite number, got '0x1'");
  EXPECT_EQ(error(3, "8,1 2,2,0"),
            ", row 3, column 'px': expected a finite number, got '1 2'");
  EXPECT_EQ(error(1, "7.1,1,1e308,0"),
            ", row 1, column 'py': expected a position within 1e+09 m, got "
            "1e+308 m");
  EXPECT_EQ(error(5, "8,1,2"),
            ", row 5: expected 4 values, got 3, none for column 'pz'");
  EXPECT_EQ(error(5, "8,1,2,3,4"),
            ", row 5: expected 4 values, got 5, '4' beyond column 'pz'");
  EXPECT_EQ(error(5, "8,0,1,0,2,0,3,0"),
            ", row 5: expected 4 values, got 8, '2' beyond column 'pz' "
            "(decimal commas?)");
  EXPECT_EQ(error(2, "7.1,1,2,0"),
            ", row 2, column 't': expected a time after 7.1 s, got 7.1 s: "
            "remove rows that are there twice, sort the rest");
}

TEST_F(RecordingTest, AnotherFileIsToldWhatWasExpectedAndFound) {
  const auto found = [this](const std::string& text) {
    const std::string expected =
        ": expected " + std::string(kRecordingFormat) + "; found ";
    const std::string error = ErrorOf(text);
    EXPECT_TRUE(error.starts_with(expected)) << error;
    return error.substr(std::min(expected.size(), error.size()));
  };
  EXPECT_EQ(found(Table("time,x,y,z")), "'time,x,y,z', without t, px, py, pz");
  EXPECT_EQ(found(Table("t,px,py,z")), "'t,px,py,z', without pz");
  EXPECT_EQ(found(Table("T,PX,PY,PZ")), "'T,PX,PY,PZ', in upper case");
  EXPECT_EQ(found("t;px;py;pz\n0,1;0;0;0\n"),
            "'t;px;py;pz', separated by semicolons");
  EXPECT_EQ(found("t\tpx\tpy\tpz\n"), "'t\\tpx\\tpy\\tpz', separated by tabs");
  EXPECT_EQ(found("# made by hand\nt px py pz\n"),
            "'t px py pz', separated by spaces");
  EXPECT_EQ(found("time;x;y;z\n"),
            "'time;x;y;z', separated by semicolons, without t, px, py, pz");
  EXPECT_EQ(found("0.00,1,-2.5e-3,3\n"), "'0.00,1,-2.5e-3,3', without names");
  EXPECT_EQ(found("0,00;1;2,5;3\n"),
            "'0,00;1;2,5;3', separated by semicolons, without names");
  EXPECT_EQ(found(Table("t,px,py,pz,px", ",1")), "'px' more than once");
  EXPECT_EQ(found(""), "no line in the file");
  EXPECT_EQ(found("\xEF\xBB\xBF \n\n"), "no line in the file");
  EXPECT_EQ(found(std::string("PK\3\4\0\0", 6)), "a binary file");
  EXPECT_EQ(found("\xFF\xFEt"), "UTF-16 text; save it as CSV in UTF-8");
  EXPECT_EQ(found("t,\xFF"),
            "text that is not UTF-8 (byte 0xff in position 2: invalid start "
            "byte)");
  EXPECT_EQ(found(std::string(1000, 'x')),
            "'" + std::string(60, 'x') + "'..., without t, px, py, pz");
}

TEST_F(RecordingTest, TheExampleIsARecordingsStart) {
  EXPECT_NE(ErrorOf(kRecordingExample).find("too short"), std::string::npos);
}

TEST_F(RecordingTest, WrongRotationsAreNamed) {
  const std::string header = "t,px,py,pz,R11,R12,R13,R21,R22,R23,R31,R32,R33";
  for (const char* tail :
       {",1,0,0,0,1,0,0,0,-1", ",1,0,0,0,1,0,0,0.01,1", ",0,0,0,0,0,0,0,0,0"}) {
    EXPECT_EQ(ErrorOf(Table(header, tail)),
              ", row 1, columns 'R11' to 'R33': expected a rotation matrix");
  }
}

TEST_F(RecordingTest, LengthIsLimited) {
  const std::string header = "t,px,py,pz\n";
  EXPECT_EQ(ErrorOf(header),
            ": too short, expected at least 10 rows and 1 s, got 0 rows and "
            "0 s");
  EXPECT_EQ(ErrorOf(header + "0,1,1,1\n0.25,1,1,1\n"),
            ": too short, expected at least 10 rows and 1 s, got 2 rows and "
            "0.25 s");
  EXPECT_EQ(ErrorOf(Table() + "4000,1,1,1\n"),
            ": too long, expected at most 3600 s, got 3993 s");
}

/** `count` rows of a hand that rests, `interval` apart, with one at `row` moved
by `jump` along x. */
std::string Rest(int count, double interval, int row = 0, double jump = 0) {
  std::ostringstream text;
  text.precision(12);
  text << "t,px,py,pz\n";
  for (int i = 1; i <= count; ++i) {
    text << interval * i << "," << (i == row ? 0.3 + jump : 0.3) << ",0,0.5\n";
  }
  return text.str();
}

TEST_F(RecordingTest, WhatNoHandDoesIsRefused) {
  const std::string unit =
      ": remove the row if it is wrong, or give the unit if it is not m "
      "(--recording-units mm or cm; operator.recording_units)";
  EXPECT_EQ(ErrorOf(Rest(100, 0.02, 57, 5)),
            ", row 57: the hand moves by 5 m in 0.02 s (250 m/s), expected at "
            "most 3 m/s" +
                unit);
  EXPECT_EQ(
      ErrorOf(Rest(200, 0.01, 57, 0.015)),
      ", row 57: the hand jumps by 0.015 m in 0.01 s (its velocity changes "
      "by 1.5 m/s), expected at most 1 m/s" +
          unit);
  // The first row may be what is wrong.
  EXPECT_EQ(ErrorOf(Rest(200, 0.01, 1, 0.015)).substr(0, 28),
            ", row 2: the hand jumps by 0");
  // Less is noise.
  Write(Rest(2000, 0.001, 57, 0.0025));
  EXPECT_NO_THROW(Read());
  EXPECT_EQ(ErrorOf(Rest(100, 20)),
            ", row 2, column 't': rows are 20 s apart (median), expected "
            "0.0001 to 0.2 s (10 kHz to 5 Hz): times must be in s, not in ms");
  EXPECT_EQ(ErrorOf(Rest(20000, 0.9e-4)),
            ", row 2, column 't': rows are 9e-05 s apart (median), expected "
            "0.0001 to 0.2 s (10 kHz to 5 Hz): leave rows out");
  EXPECT_NE(ErrorOf(Rest(100, 0.25)).find(": sample it faster"),
            std::string::npos);
  Write(Rest(100, 0.2));
  EXPECT_NO_THROW(Read());
  EXPECT_EQ(ErrorOf(Table("t,px,py,pz", "", 12, "8.65,1,0.12,0.5")),
            ", row 12, column 't': a gap of 0.55 s, expected at most 0.5 s: "
            "fill it, or cut the recording there");
  for (const double interval : {0.199, 1.01e-4}) {
    Write(Rest(15000, interval));
    EXPECT_NO_THROW(Read());
  }
}

TEST_F(RecordingTest, UnitsAndScaleComeBeforeWhatIsPlausible) {
  // Moves at 10 m/s if that were metres.
  std::string text = "t,px,py,pz\n";
  for (int i = 0; i < 20; ++i) {
    text += std::to_string(0.1 * i) + "," + std::to_string(i) + ",7,500\n";
  }
  Write(text);
  EXPECT_THROW(Read(), std::invalid_argument);
  const Recording mm = ReadRecording(path_, LengthUnit::kMillimetre);
  EXPECT_NEAR((mm.positions.col(3) - Vector3d(0.003, 0.007, 0.5)).norm(), 0,
              1e-15);
  EXPECT_EQ(mm.scale, 1);
  const Recording cm = ReadRecording(path_, LengthUnit::kCentimetre, 0.5);
  EXPECT_NEAR(cm.positions(2, 3), 2.5, 1e-12);
  EXPECT_EQ(cm.scale, 0.5);
  EXPECT_THROW(ReadRecording(path_, LengthUnit::kMetre, 0),
               std::invalid_argument);
}

TEST_F(RecordingTest, UnreadableFiles) {
  const auto error = [](const std::string& path) {
    return InvalidArgument([&] { ReadRecording(path); });
  };
  EXPECT_EQ(error("none.csv"), "none.csv: No such file or directory");
  EXPECT_EQ(error("/"), "/: Is a directory");
}

/** A hand that comes down onto a board, circles on it and leaves. */
Recording MakeRecording(double size = 0.05) {
  constexpr int kCount = 400;
  Recording recording;
  recording.times = Eigen::VectorXd::LinSpaced(kCount, 0, 3.99);
  recording.positions.resize(3, kCount);
  for (int i = 0; i < kCount; ++i) {
    const double t = recording.times(i);
    const double phase = 2 * std::numbers::pi * t / 3.99;
    recording.positions.col(i) =
        Vector3d(1 + size * std::cos(phase), -2 + size * std::sin(phase),
                 t > 1 && t < 3 ? 0.3 : 0.38);
  }
  return recording;
}

const Vector3d kStart(0.45, 0.02, 0.48);

/** A box about the start, down to 0.3 m. */
bool InBox(const Matrix3Xd& points) {
  const auto aside = (points.topRows<2>().colwise() - kStart.head<2>()).array();
  return (aside.abs() <= 0.1).all() && (points.row(2).array() >= 0.3).all();
}

TEST(PlaceRecordingTest, PressesWhereTheHandWorked) {
  const Recording recording = MakeRecording();
  const OperatorPathParams path =
      PlaceRecording(recording, kStart, kContactHeight, kPressDepth, InBox)
          .path;
  path.Validate();
  EXPECT_EQ(path.interpolation, PathInterpolation::kCubic);
  ASSERT_EQ(path.times.size(), 200 + 400 + 200);
  EXPECT_EQ(path.times(0), 0);
  EXPECT_EQ(path.times(200), kRecordingMoveTime);
  EXPECT_NEAR(path.times(799), 3.99 + 2 * kRecordingMoveTime, 1e-12);
  EXPECT_EQ(path.points.col(0), kStart);
  EXPECT_NEAR((path.points.col(799) - kStart).norm(), 0, 1e-12);

  const Matrix3Xd placed = path.points.middleCols(200, 400);
  EXPECT_NEAR(placed.row(2).minCoeff(), kContactHeight - kPressDepth, 1e-12);
  EXPECT_NEAR(placed.row(2).maxCoeff(), kContactHeight + 0.04, 1e-12);
  const Vector3d middle =
      (placed.rowwise().minCoeff() + placed.rowwise().maxCoeff()) / 2;
  EXPECT_NEAR((middle - kStart).head<2>().norm(), 0, 1e-12);
  // Not scaled.
  const Matrix3Xd moved = placed.colwise() - placed.col(0);
  const Matrix3Xd recorded =
      recording.positions.colwise() - recording.positions.col(0);
  EXPECT_NEAR((moved - recorded).norm(), 0, 1e-12);
}

TEST(PlaceRecordingTest, LeadsInAndOutWithoutAJerk) {
  const OperatorPathParams path =
      PlaceRecording(MakeRecording(), kStart, kContactHeight, kPressDepth,
                     InBox)
          .path;
  const Vector3d first = path.points.col(200);
  // Half of the way in half of the time, nearly at rest at both ends.
  EXPECT_NEAR((path.points.col(100) - (kStart + first) / 2).norm(), 0, 1e-12);
  EXPECT_LT((path.points.col(1) - kStart).norm(), 1e-5 * first.norm());
  EXPECT_LT((path.points.col(199) - first).norm(), 1e-5 * first.norm());
  EXPECT_LT((path.points.col(798) - kStart).norm(), 1e-5 * first.norm());
}

TEST(PlaceRecordingTest, NothingGoesDeeperThanTheContactHeight) {
  Recording recording = MakeRecording();
  recording.positions(2, 200) = 0.1;  // One of 400: below the 1 % quantile.
  const OperatorPathParams path =
      PlaceRecording(recording, kStart, kContactHeight, kPressDepth, InBox)
          .path;
  EXPECT_NEAR(path.points.row(2).minCoeff(), kContactHeight - kPressDepth,
              1e-12);
}

TEST(PlaceRecordingTest, AMotionUpToTwiceTooLargeIsShrunkAndSaysSo) {
  const PlacedRecording placed = PlaceRecording(
      MakeRecording(0.16), kStart, kContactHeight, kPressDepth, InBox);
  const Matrix3Xd& points = placed.path.points;
  EXPECT_TRUE(InBox(points));
  const Vector3d extent =
      points.rowwise().maxCoeff() - points.rowwise().minCoeff();
  // The box's, to what 20 halvings leave.
  EXPECT_NEAR(extent.x(), 0.2, 1e-5);
  EXPECT_NEAR(extent.y(), extent.x(), 1e-4);
  EXPECT_NEAR(placed.scale, 0.1 / 0.16, 1e-5);
  EXPECT_EQ(placed.note,
            "400 samples in 3.99 s, 200 x 200 x 50 mm, shrunk to 0.625 to fit "
            "the device's workspace; orientation not followed");
  // The height is scaled with it.
  const Matrix3Xd inner = points.middleCols(200, 400);
  EXPECT_NEAR(inner.row(2).maxCoeff() - inner.row(2).minCoeff(),
              0.08 * placed.scale, 1e-12);
}

TEST(PlaceRecordingTest, AMotionThatIsLargerIsRefusedWithAScaleThatFits) {
  const auto error = [](const Recording& recording) {
    return InvalidArgument([&] {
      PlaceRecording(recording, kStart, kContactHeight, kPressDepth, InBox);
    });
  };
  EXPECT_EQ(error(MakeRecording(0.19)), "no exception");
  EXPECT_EQ(
      error(MakeRecording(0.325)),
      "operator.recording: row 101: a motion of 650 x 650 x 80 mm reaches "
      "farthest there and would be shrunk to 0.3077 of its size to fit "
      "the device's workspace, expected at least 0.5: scale it "
      "(--recording-scale 0.3; operator.recording_scale), or give the "
      "unit if it is not m (--recording-units mm or cm; "
      "operator.recording_units)");
  // What a reader does that was asked for the scale.
  Recording scaled = MakeRecording(0.325);
  scaled.scale = 0.3;
  scaled.positions *= 0.3;
  const PlacedRecording placed =
      PlaceRecording(scaled, kStart, kContactHeight, kPressDepth, InBox);
  EXPECT_EQ(placed.scale, 0.3);
  EXPECT_NE(placed.note.find("scaled by 0.3 as asked for;"), std::string::npos);
}

TEST(PlaceRecordingTest, TurnsFromTheFirstOrientationAndBack) {
  Recording recording = MakeRecording();
  recording.follow_rotations = true;
  // From any first orientation by 200 deg about z, beyond pi, of which the
  // rotation vector is to know.
  const Matrix3d first = ExpRotation(Vector3d(1, -2, 0.5));
  for (int i = 0; i < 400; ++i) {
    const double angle = 200 * std::numbers::pi / 180 * i / 399;
    recording.rotations.emplace_back(ExpRotation(Vector3d(0, 0, angle)) *
                                     first);
  }
  const OperatorPathParams path =
      PlaceRecording(recording, kStart, kContactHeight, kPressDepth, InBox)
          .path;
  path.Validate();
  ASSERT_EQ(path.rotations.cols(), 800);
  EXPECT_EQ(path.rotations.leftCols(200).norm(), 0);
  for (int i = 0; i < 400; ++i) {
    const double angle = 200 * std::numbers::pi / 180 * i / 399;
    EXPECT_NEAR((path.rotations.col(200 + i) - Vector3d(0, 0, angle)).norm(), 0,
                1e-9);
  }
  EXPECT_EQ(path.rotations.col(799).norm(), 0);
  // Half of the way back in half of the time.
  EXPECT_NEAR(path.rotations(2, 599 + 100), 100 * std::numbers::pi / 180, 1e-9);

  recording.follow_rotations = false;
  EXPECT_EQ(
      PlaceRecording(recording, kStart, kContactHeight, kPressDepth, InBox)
          .path.rotations.cols(),
      0);
}

TEST(PlaceRecordingTest, DepthOutOfReachIsRefused) {
  const auto error = [](const Recording& recording, double depth) {
    return InvalidArgument([&] {
      PlaceRecording(recording, kStart, kContactHeight, depth, InBox);
    });
  };
  EXPECT_EQ(error(MakeRecording(), 0.2),
            "operator.press_depth: expected a depth that the device reaches "
            "below scene.start_position, got 0.2");
  EXPECT_EQ(error({}, kPressDepth),
            "Recording: field `positions` expected one column per time, n >= "
            "1, got 0");
}

}  // namespace
}  // namespace dual_proxy
