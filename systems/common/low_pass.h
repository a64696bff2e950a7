// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "dual_proxy/common/validate.h"

namespace dual_proxy {

/** Hz: what is slower than this low-pass says nothing of a touch in time. */
inline constexpr double kMinCutoff = 0.01;

/** What a cutoff frequency may be, Hz, where 0 means "no filter". */
constexpr Range CutoffOrNone() { return OrZero(AtLeast(kMinCutoff)); }

/** Gain g of the first-order low-pass y += g (x - y) with the given cutoff
frequency (Hz) and sample period (s): g = 1 - exp(-2 pi cutoff period), the
exact discretisation for input held over a sample. A cutoff of 0 means "no
filter": g = 1. */
double LowPassGain(double cutoff_hz, double period) noexcept;

}  // namespace dual_proxy
