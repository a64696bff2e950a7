// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/experiment/recording.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <numbers>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

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
        text << 7 + 0.1 * i << ",1," << i << ",0.5" << tail << "\n";
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
  EXPECT_EQ(recording.positions.col(2), Vector3d(1, 3, 0.5));
  EXPECT_TRUE(recording.rotations.empty());
}

TEST_F(RecordingTest, ReadsRotationsRowByRowAndIgnoresOtherColumns) {
  Write(Table("t,px,py,pz,note,R11,R12,R13,R21,R22,R23,R31,R32,R33",
              ",\"free, text\",0,-1,0,1,0,0,0,0,1"));
  const Recording recording = Read();
  const Matrix3d R{{0, -1, 0}, {1, 0, 0}, {0, 0, 1}};
  ASSERT_EQ(recording.rotations.size(), 12u);
  for (const Matrix3d& rotation : recording.rotations) EXPECT_EQ(rotation, R);
}

TEST_F(RecordingTest, ColumnsMayStandInAnyOrderAndLayout) {
  std::ostringstream text;
  text << "\xEF\xBB\xBF pz , t ,\"px\",py\r\n";
  for (int i = 0; i < 12; ++i) {
    text << "\"3\", " << i << " ,+1,2e0\r\n\r\n";
  }
  Write(text.str());
  const Recording recording = Read();
  ASSERT_EQ(recording.times.size(), 12);
  EXPECT_EQ(recording.positions.col(11), Vector3d(1, 2, 3));
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
  EXPECT_EQ(error(5, "8,1,2"), ", row 5: expected 4 values, got 3");
  EXPECT_EQ(error(2, "7.1,1,2,0"),
            ", row 2, column 't': expected a time after 7.1 s, got 7.1 s");
}

TEST_F(RecordingTest, MissingAndRepeatedColumnsAreNamed) {
  EXPECT_EQ(ErrorOf(Table("t,px,py,z")), ": column 'pz' is missing");
  EXPECT_EQ(ErrorOf(Table("t,px,px,pz")),
            ": column 'px' is found more than once");
  EXPECT_EQ(ErrorOf(Table("t,px,py,pz,R11", ",1")),
            ": column 'R12' is missing");
  EXPECT_EQ(ErrorOf(""), ": column 't' is missing");
  // The header is the first line.
  EXPECT_EQ(ErrorOf("\nt,px,py,pz\n"), ": column 't' is missing");
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
            ": too long, expected at most 3600 s, got 3992.9 s");
}

TEST_F(RecordingTest, UnreadableFiles) {
  const auto error = [](const std::string& path) {
    return InvalidArgument([&] { ReadRecording(path); });
  };
  EXPECT_EQ(error("none.csv"), "none.csv: No such file or directory");
  EXPECT_EQ(error("/"), "/: Is a directory");
  EXPECT_EQ(ErrorOf("t,\xFF"),
            ": expected a CSV file: 'utf-8' codec can't decode byte 0xff in "
            "position 2: invalid start byte");
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
      PlaceRecording(recording, kStart, kContactHeight, kPressDepth, InBox);
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
  const OperatorPathParams path = PlaceRecording(
      MakeRecording(), kStart, kContactHeight, kPressDepth, InBox);
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
      PlaceRecording(recording, kStart, kContactHeight, kPressDepth, InBox);
  EXPECT_NEAR(path.points.row(2).minCoeff(), kContactHeight - kPressDepth,
              1e-12);
}

TEST(PlaceRecordingTest, TooLargeAMotionIsScaledToFit) {
  const OperatorPathParams path = PlaceRecording(
      MakeRecording(0.6), kStart, kContactHeight, kPressDepth, InBox);
  EXPECT_TRUE(InBox(path.points));
  const Vector3d extent =
      path.points.rowwise().maxCoeff() - path.points.rowwise().minCoeff();
  // The box's, to what 20 halvings leave.
  EXPECT_NEAR(extent.x(), 0.2, 1e-5);
  EXPECT_NEAR(extent.y(), extent.x(), 1e-4);
  // The height is scaled with it.
  const Matrix3Xd placed = path.points.middleCols(200, 400);
  EXPECT_NEAR(placed.row(2).maxCoeff() - placed.row(2).minCoeff(),
              0.08 * 0.1 / 0.6, 1e-4);
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
