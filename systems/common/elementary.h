// SPDX-License-Identifier: BSD-3-Clause
#pragma once

namespace dual_proxy {

// Elementary functions of IEEE additions, multiplications, divisions and bits
// alone: the same bits on every processor. The C library's are not: it takes
// other ones where there is a fused multiply-add, which differ in the last
// place, and a draw of a particle filter makes that visible. What is logged is
// to be made with these; sqrt(), fmod(), floor() and their like are exact
// everywhere. All take any finite argument, and give NaN for what is not.
// Vectors of them: vector_math.h.

/** Both of an angle. */
struct SinCos {
  double sin{0};
  double cos{1};
};

/** Of `angle`, rad, to less than a unit in the last place; beyond 1e6 of what
is left of it after whole turns of the double next to 2 pi. */
SinCos CalcSinCos(double angle) noexcept;

/** The angle of (x, y), rad, in [-pi, pi], to a unit in the last place; 0 or pi
of the origin, by x's sign. */
double Atan2(double y, double x) noexcept;

/** exp(x), to a unit in the last place; 0 below -700, infinite above 700. */
double Exp(double x) noexcept;

/** exp(x) - 1, likewise, to two units in the last place, near 0 as well. */
double ExpMinusOne(double x) noexcept;

}  // namespace dual_proxy
