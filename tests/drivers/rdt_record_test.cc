// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/ft_sensor/rdt_record.h"

#include <limits>
#include <vector>

#include <gtest/gtest.h>

#include "dual_proxy/drivers/ft_sensor/rdt_sequence.h"
#include "rdt_datagram.h"

namespace dual_proxy {
namespace {

TEST(RdtRecordTest, Requests) {
  const std::array<std::uint8_t, 8> stop{0x12, 0x34, 0, 0, 0, 0, 0, 0};
  const std::array<std::uint8_t, 8> stream{0x12, 0x34, 0, 2, 0, 0, 0, 0};
  EXPECT_EQ(EncodeRdtRequest(RdtCommand::kStop), stop);
  EXPECT_EQ(EncodeRdtRequest(RdtCommand::kStream), stream);
}

TEST(RdtRecordTest, Decodes) {
  constexpr std::int32_t kLowest = std::numeric_limits<std::int32_t>::min();
  constexpr std::int32_t kHighest = std::numeric_limits<std::int32_t>::max();
  const RdtDatagram sent{.sequence = 0xfedcba98,
                         .sample = 0x01020304,
                         .status = 0x80000004,
                         .counts = {0, -1, 256, kLowest, kHighest, -70000}};
  RdtRecord record;
  ASSERT_TRUE(DecodeRdtRecord(sent.Bytes(), &record));
  EXPECT_EQ(record.sequence, 0xfedcba98);
  EXPECT_EQ(record.sample, 0x01020304u);
  EXPECT_EQ(record.status, 0x80000004);
  EXPECT_EQ(record.counts, sent.counts);
}

TEST(RdtRecordTest, OtherLengthsAreRefused) {
  for (std::size_t size = 0; size < 100; ++size) {
    if (size == kRdtRecordSize) continue;
    RdtRecord record{.sequence = 7};
    const std::vector<std::uint8_t> datagram(size, 0xff);
    EXPECT_FALSE(DecodeRdtRecord(datagram, &record)) << size;
    EXPECT_EQ(record.sequence, 7u);
  }
}

TEST(RdtRecordTest, Status) {
  EXPECT_FALSE(IsRdtFault(0));
  for (int bit = 0; bit < 32; ++bit) {
    EXPECT_EQ(IsRdtFault(1u << bit), bit != 16) << bit;
  }
  EXPECT_TRUE(IsRdtFault(0x80010000));
  EXPECT_EQ(DescribeRdtStatus(0x80000000), "0x80000000");
  EXPECT_EQ(DescribeRdtStatus(0xc0000004),
            "0xc0000004: broken gage, force or torque out of range");
}

TEST(RdtSequenceTest, CountsWhatIsMissingRepeatedAndLate) {
  RdtSequence sequence;
  RdtCounts counts;
  for (const std::uint32_t number : {5u, 6u, 9u, 9u, 8u, 10u}) {
    sequence.Take(number, &counts);
  }
  EXPECT_EQ(counts.taken, 4);
  EXPECT_EQ(counts.lost, 2);
  EXPECT_EQ(counts.repeated, 1);
  EXPECT_EQ(counts.late, 1);
  EXPECT_EQ(counts.restarts, 0);
  EXPECT_EQ(sequence.position(), 6);
}

TEST(RdtSequenceTest, WrapsAround) {
  RdtSequence sequence;
  RdtCounts counts;
  EXPECT_TRUE(sequence.Take(0xfffffffe, &counts));
  EXPECT_TRUE(sequence.Take(0xffffffff, &counts));
  EXPECT_TRUE(sequence.Take(1, &counts));
  EXPECT_FALSE(sequence.Take(0xffffffff, &counts));
  EXPECT_EQ(counts.lost, 1);
  EXPECT_EQ(counts.late, 1);
  EXPECT_EQ(counts.restarts, 0);
  EXPECT_EQ(sequence.position(), 4);
}

TEST(RdtSequenceTest, LongJumpIsARestart) {
  for (const std::int64_t jump : {-1001, 1001, 1 << 30, -(1 << 30)}) {
    RdtSequence sequence;
    RdtCounts counts;
    sequence.Take(5000, &counts);
    EXPECT_TRUE(
        sequence.Take(static_cast<std::uint32_t>(5000 + jump), &counts));
    EXPECT_EQ(counts.restarts, 1) << jump;
    EXPECT_EQ(counts.lost, 0) << jump;
    EXPECT_EQ(sequence.position(), 2) << jump;
  }
  RdtSequence sequence;
  RdtCounts counts;
  sequence.Take(5000, &counts);
  EXPECT_FALSE(sequence.Take(4000, &counts));
  EXPECT_TRUE(sequence.Take(6000, &counts));
  EXPECT_EQ(counts.restarts, 0);
  EXPECT_EQ(counts.lost, 999);
}

// A stream that is asked for again begins with 1, perhaps not far below.
TEST(RdtSequenceTest, NewStreamBeginsAnywhere) {
  RdtSequence sequence;
  RdtCounts counts;
  sequence.Take(300, &counts);
  EXPECT_FALSE(sequence.Take(1, &counts));
  sequence.Restart();
  EXPECT_TRUE(sequence.Take(1, &counts));
  EXPECT_TRUE(sequence.Take(2, &counts));
  EXPECT_EQ(counts.lost, 0);
  EXPECT_EQ(sequence.position(), 3);
}

}  // namespace
}  // namespace dual_proxy
