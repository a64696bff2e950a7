// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/drivers/latest_value.h"

#include <array>
#include <cstdint>
#include <thread>

#include <gtest/gtest.h>

namespace dual_proxy {
namespace {

TEST(LatestValueTest, IsTheNewest) {
  LatestValue<int> latest(3);
  EXPECT_EQ(latest.Get(), 3);
  latest.Set(4);
  latest.Set(5);
  EXPECT_EQ(latest.Get(), 5);
  EXPECT_EQ(latest.Get(), 5);
  latest.Set(6);
  EXPECT_EQ(latest.Get(), 6);
}

// The thread sanitizer sees races here, too.
TEST(LatestValueTest, IsNeverTornAndNeverOlder) {
  using Block = std::array<std::int64_t, 64>;
  constexpr std::int64_t kLast = 200000;
  LatestValue<Block> latest;
  std::thread writer([&latest] {
    Block block;
    for (std::int64_t i = 1; i <= kLast; ++i) {
      block.fill(i);
      latest.Set(block);
    }
  });
  std::int64_t torn = 0;
  std::int64_t older = 0;
  for (std::int64_t last = 0; last < kLast;) {
    const Block& block = latest.Get();
    for (const std::int64_t value : block) torn += value != block[0];
    older += block[0] < last;
    last = block[0];
  }
  writer.join();
  EXPECT_EQ(torn, 0);
  EXPECT_EQ(older, 0);
}

}  // namespace
}  // namespace dual_proxy
