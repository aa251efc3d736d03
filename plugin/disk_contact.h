// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <algorithm>
#include <cmath>

namespace LAMMPS_NS {

/* Of two disks that overlap: E = K overlap^exponent and its derivatives. */
struct Repulsion {
  double overlap, energy, force, stiffness;

  Repulsion(double overlap, double energy, double force, double stiffness) :
      overlap(overlap), energy(energy), force(force), stiffness(stiffness) {}
  Repulsion(double K, double overlap, double exponent) : overlap(overlap)
  {
    double stiffer = K;
    if (exponent != 2.0) stiffer *= std::pow(std::max(overlap, 0.0), exponent - 2.0);
    energy = stiffer * overlap * overlap;
    force = exponent * stiffer * overlap;
    stiffness = exponent * (exponent - 1.0) * stiffer;
  }
};

/* Two disks that may touch before the neighbor list is made anew. Where newton is off, both owners
   see a pair between ranks or with a periodic image, and each counts half of it. */
struct DiskPair {
  int i, j;             // local or ghost index
  double x, y;          // from i to j
  double reach;         // distance at which they touch
  double strength;      // K
  double radius_i, radius_j;
  double share;         // 1, or 1/2 of a pair that two ranks see

  bool flat() const { return radius_j == 0.0; }    // j is a flat wall along x, at any x
};

}    // namespace LAMMPS_NS
