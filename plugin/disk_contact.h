// SPDX-License-Identifier: GPL-2.0-or-later

#pragma once

#include <algorithm>
#include <cmath>

namespace LAMMPS_NS {

/* Of two disks that overlap: E = K overlap^exponent and its derivatives. */
struct Repulsion {
  double overlap, energy, force, stiffness;

  Repulsion(double K, double overlap, double exponent) : overlap(overlap)
  {
    const double stiffer = exponent == 2.0 ? K : K * std::pow(std::max(overlap, 0.0), exponent - 2.0);
    energy = stiffer * overlap * overlap;
    force = exponent * stiffer * overlap;
    stiffness = exponent * (exponent - 1.0) * stiffer;
  }
};

/* Two disks of the neighbor list, which may touch before the list is made anew. A pair between ranks, or
   with a periodic image, is seen by both its owners where newton is off: each then counts half of it. */
struct DiskPair {
  int i, j;             // local or ghost index
  double x, y;          // from i to j
  double reach;         // distance at which they touch
  double strength;      // K
  double radius_i, radius_j;
  double share;         // 1, or 1/2 of a pair that two ranks see

  bool flat() const { return radius_j == 0.0; }    // with a flat wall along x, whose x means nothing
};

}    // namespace LAMMPS_NS
