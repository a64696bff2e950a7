// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <bit>
#include <cstdint>

#include "dual_proxy/common/per_instruction_set.h"

// Elementary functions for the bodies of PerInstructionSet: IEEE additions,
// multiplications, divisions and bits, without a branch, so that loops over
// them are vectorised and results are the same bits everywhere. The polynomials
// interpolate at Chebyshev's points; what they are off by is a small part of
// the rounding.

namespace dual_proxy {

/** (exp(r) - 1 - r) / r^2 for |r| <= ln 2 / 2. */
DUAL_PROXY_INLINE double ExpSeries(double r) noexcept {
  double p = 0x1.af38a9b0ec855p-26;
  p = p * r + 0x1.289185613a3d6p-22;
  p = p * r + 0x1.71de0dae63bb3p-19;
  p = p * r + 0x1.a019b90d2ae7ap-16;
  p = p * r + 0x1.a01a01a7c41d5p-13;
  p = p * r + 0x1.6c16c1788bd90p-10;
  p = p * r + 0x1.11111111109b3p-7;
  p = p * r + 0x1.5555555553d63p-5;
  p = p * r + 0x1.5555555555556p-3;
  return p * r + 0x1.0000000000001p-1;
}

/** exp(x) for x <= 0, to 2 units in the last place; 0 below -700. */
DUAL_PROXY_INLINE double ExpOfNonPositive(double x) noexcept {
  // x = k ln 2 + r, |r| <= ln 2 / 2. The shift rounds to an integer, and leaves
  // k in the low bits of the sum; ln 2 is split so that k times its first part
  // is exact.
  constexpr double kShift = 0x1.8p52;
  const double shifted = x * 0x1.71547652b82fep0 + kShift;
  const double k = shifted - kShift;
  const double r = (x - k * 0x1.62e42feep-1) - k * 0x1.a39ef35793c76p-33;
  const double p = 1 + (r + r * r * ExpSeries(r));
  const double result =
      std::bit_cast<double>(std::bit_cast<std::uint64_t>(p) +
                            (std::bit_cast<std::uint64_t>(shifted) << 52));
  return x < -700 ? 0 : result;
}

/** log(x) for normal, finite x > 0, to 2 units in the last place. */
DUAL_PROXY_INLINE double LogOfPositive(double x) noexcept {
  // x = 2^k m, sqrt(1/2) <= m < sqrt(2).
  constexpr std::uint64_t kOne = 0x3ff0000000000000;
  constexpr std::uint64_t kSqrtHalf = 0x3fe6a09e667f3bcd;
  constexpr std::uint64_t kMantissa = 0x000fffffffffffff;
  const std::uint64_t bits =
      std::bit_cast<std::uint64_t>(x) + (kOne - kSqrtHalf);
  const double m = std::bit_cast<double>((bits & kMantissa) + kSqrtHalf);
  // The exponent as the low bits of 2^52, as there is no conversion of 64-bit
  // integers before AVX-512DQ.
  const double k = std::bit_cast<double>((bits >> 52) |
                                         std::bit_cast<std::uint64_t>(0x1p52)) -
                   (0x1p52 + 1023);
  // log(1 + f) = 2 artanh(s), s = f / (2 + f), and 2 s = f - s f.
  const double f = m - 1;
  const double s = f / (2 + f);
  const double z = s * s;
  const double zz = z * z;
  const double high = (0x1.7462b51cb66b1p-3 + 0x1.39fe51a7c18f9p-3 * z) +
                      0x1.2b5900de53b32p-3 * zz;
  const double low = (0x1.5555555555558p-1 + 0x1.99999999952d7p-2 * z) +
                     (0x1.2492492df281ap-2 + 0x1.c71c62e3f11e6p-3 * z) * zz;
  const double p = low + high * (zz * zz);
  return k * 0x1.62e42feep-1 +
         (f - (s * (f - z * p) - k * 0x1.a39ef35793c76p-33));
}

/** sin and cos of pi/2 t for |t| <= 1/2, to 2 units in the last place. */
DUAL_PROXY_INLINE void SinCosOfQuarterTurns(double t, double* sin,
                                            double* cos) noexcept {
  const double z = t * t;
  double p = 0x1.e3f38399551bfp-25;
  p = p * z - 0x1.e30071afc3e59p-19;
  p = p * z + 0x1.50782fda12d96p-13;
  p = p * z - 0x1.32d2cce2e5b19p-8;
  p = p * z + 0x1.466bc677587f8p-4;
  p = p * z - 0x1.4abbce625be41p-1;
  *sin = t * (p * z + 0x1.921fb54442d18p0);
  double q = -0x1.b2f3eb054afcdp-28;
  q = q * z + 0x1.f9ce245cada0bp-22;
  q = q * z - 0x1.a6d1eef479be1p-16;
  q = q * z + 0x1.e1f5068688d5bp-11;
  q = q * z - 0x1.55d3c7e3cb241p-6;
  q = q * z + 0x1.03c1f081b5ac0p-2;
  q = q * z - 0x1.3bd3cc9be45dep0;
  *cos = 1 + z * q;
}

}  // namespace dual_proxy
