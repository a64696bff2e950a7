// SPDX-License-Identifier: BSD-3-Clause
#include "dual_proxy/common/elementary.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

#include "dual_proxy/common/vector_math.h"

namespace dual_proxy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kShift = 0x1.8p52;  // A sum with it is rounded to an integer.

/** 1 + r + r^2 ExpSeries(r), times 2^k, is exp(x). */
struct ExpParts {
  explicit ExpParts(double x) noexcept {
    const double shifted = x * 0x1.71547652b82fep0 + kShift;
    k = shifted - kShift;
    const double high = x - k * 0x1.62e42feep-1;
    const double low = k * 0x1.a39ef35793c76p-33;
    const double r = high - low;
    // With what was rounded off r.
    rest = high + (r * r * ExpSeries(r) - low);
    scale =
        std::bit_cast<double>(std::bit_cast<std::uint64_t>(1.0) +
                              (std::bit_cast<std::uint64_t>(shifted) << 52));
  }

  double k;
  double rest;
  double scale;  ///< 2^k.
};

/** The first 26 bits. */
double UpperHalf(double x) noexcept {
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(x) &
                               0xfffffffff8000000);
}

}  // namespace

SinCos CalcSinCos(double angle) noexcept {
  // angle = n pi/2 + r + tail, |r| <= pi/4. The first two parts of pi/2 have 33
  // bits, so that their products with n are exact.
  if (!(std::abs(angle) <= 1e6)) angle = std::fmod(angle, 0x1.921fb54442d18p2);
  const double shifted = angle * 0x1.45f306dc9c883p-1 + kShift;
  const double n = shifted - kShift;
  const double a = angle - n * 0x1.921fb544p0;
  const double b = n * 0x1.0b4611a6p-34;
  const double c = n * 0x1.3198a2e037073p-69;
  const double a_b = a - b;
  const double b_back = a - a_b;
  const double rounded_off = (a - (a_b + b_back)) + (b_back - b);
  const double r = a_b - c;
  const double tail = ((a_b - r) - c) + rounded_off;

  const double z = r * r;
  double p = -0x1.ab17bdcbd3414p-41;
  p = p * z + 0x1.61217ee5cca1bp-33;
  p = p * z - 0x1.ae64541295cdfp-26;
  p = p * z + 0x1.71de3a54607a5p-19;
  p = p * z - 0x1.a01a01a019937p-13;
  p = p * z + 0x1.1111111111110p-7;
  p = p * z - 0x1.5555555555555p-3;
  const double half = 0.5 * z;
  const double sin = r + (r * z * p + tail * (1 - half));
  double q = 0x1.ab78473be59d7p-45;
  q = q * z - 0x1.9394b9eb4d56dp-37;
  q = q * z + 0x1.1eed8deb82809p-29;
  q = q * z - 0x1.27e4fb7712ca2p-22;
  q = q * z + 0x1.a01a01a019d0ap-16;
  q = q * z - 0x1.6c16c16c16c16p-10;
  q = q * z + 0x1.5555555555555p-5;
  const double whole = 1 - half;
  const double cos = whole + (((1 - whole) - half) + (z * z * q - r * tail));

  switch (std::bit_cast<std::uint64_t>(shifted) & 3) {
    case 0:
      return {sin, cos};
    case 1:
      return {cos, -sin};
    case 2:
      return {-sin, -cos};
    default:
      return {-cos, sin};
  }
}

double Atan2(double y, double x) noexcept {
  // Angles whose tangent is 0, 1/2, 1, 2, infinite, and pi minus those:
  // rounded, and what was rounded off.
  static constexpr double kAngles[9][2] = {
      {0, 0},
      {0x1.dac670561bb4fp-2, 0x1.a2b7f222f65e2p-56},
      {0x1.921fb54442d18p-1, 0x1.1a62633145c07p-55},
      {0x1.1b6e192ebbe44p0, 0x1.b1b466a88828ep-54},
      {0x1.921fb54442d18p0, 0x1.1a62633145c07p-54},
      {0x1.0468a8ace4df6p1, 0x1.0620bf7406affp-55},
      {0x1.2d97c7f3321d2p1, 0x1.a79394c9e8a0ap-54},
      {0x1.56c6e7397f5aep1, 0x1.660b64ece6f4bp-53},
      {0x1.921fb54442d18p1, 0x1.1a62633145c07p-53}};
  if (!std::isfinite(x) || !std::isfinite(y)) return kNan;
  // To a tangent of at most 1, and from there to one of at most 7/16.
  double along = std::abs(x);
  double across = std::abs(y);
  const bool steep = across > along;
  if (steep) std::swap(along, across);
  int index = 0;
  if (across > 0.75 * along) {
    index = 2;
  } else if (across > 0.4375 * along) {
    index = 1;
  }
  const double tangent = 0.5 * index;
  double u = 0;
  double left = 0;  // What the division rounded off.
  if (along > 0) {
    const double above = across - tangent * along;
    const double below = along + tangent * across;
    u = above / below;
    // By halves, whose products are exact.
    const double u_high = UpperHalf(u);
    const double u_low = u - u_high;
    const double below_high = UpperHalf(below);
    const double below_low = below - below_high;
    left = (((above - u_high * below_high) - u_high * below_low) -
            u_low * below_high - u_low * below_low) /
           below;
  }
  if (steep) {
    index = 4 - index;
    u = -u;
    left = -left;
  }
  if (std::signbit(x)) {
    index = 8 - index;
    u = -u;
    left = -left;
  }
  const double z = u * u;
  double p = -0x1.e4167464d3de8p-7;
  p = p * z + 0x1.0f62bba6a2558p-5;
  p = p * z - 0x1.7001816fd063fp-5;
  p = p * z + 0x1.ab59b417b2d3fp-5;
  p = p * z - 0x1.e170800a46210p-5;
  p = p * z + 0x1.110c9ce7b0572p-4;
  p = p * z - 0x1.3b1375ce5bdc6p-4;
  p = p * z + 0x1.745d154c84f7ap-4;
  p = p * z - 0x1.c71c71bd2b8bcp-4;
  p = p * z + 0x1.2492492485503p-3;
  p = p * z - 0x1.99999999998c5p-3;
  p = p * z + 0x1.5555555555555p-2;
  const auto& [angle, rounded_off] = kAngles[index];
  return std::copysign(angle + (u + ((left + rounded_off) - u * z * p)), y);
}

double Exp(double x) noexcept {
  if (std::isnan(x)) return x;
  if (x < -700) return 0;
  if (x > 700) return std::numeric_limits<double>::infinity();
  const ExpParts parts(x);
  return (1 + parts.rest) * parts.scale;
}

double ExpMinusOne(double x) noexcept {
  if (std::isnan(x)) return x;
  if (x < -700) return -1;
  if (x > 700) return std::numeric_limits<double>::infinity();
  const ExpParts parts(x);
  if (parts.k == 0) return parts.rest;
  return parts.rest * parts.scale + (parts.scale - 1);
}

}  // namespace dual_proxy
