// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace dual_proxy {

/** s: of a clock that never goes back and that all processes of this machine
share, Python's time.monotonic() among them. */
double MonotonicTime() noexcept;

}  // namespace dual_proxy
