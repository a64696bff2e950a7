// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <vector>

#include "dual_proxy/faces/blocks.h"

namespace dual_proxy {

/** One block of each kind, the sides also with simulated hardware, with all
ports that it may have: for documentation and tests. */
std::vector<BlockPtr> MakeExampleBlocks();

}  // namespace dual_proxy
