// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "domain.h"
#include "kernels/vector.h"
#include "lmptype.h"

namespace LAMMPS_NS {

/* An ImageOffset counts the lattice vectors from the box to the unwrapped place of an atom, which
   the image flags of LAMMPS give along x and y. Flags begin anew after 2 IMGMAX boxes, and so do
   these: only their differences count. */
struct ImageOffset {
  int a = 0, b = 0;

  ImageOffset() = default;
  ImageOffset(int a, int b) : a(wrapped(a)), b(wrapped(b)) {}
  explicit ImageOffset(imageint image) :
      ImageOffset(static_cast<int>(image & IMGMASK) - IMGMAX,
                  static_cast<int>(image >> IMGBITS & IMGMASK) - IMGMAX)
  {
  }
  ImageOffset operator-(const ImageOffset &o) const { return {a - o.a, b - o.b}; }
  bool operator==(const ImageOffset &o) const { return a == o.a && b == o.b; }
  bool operator<(const ImageOffset &o) const { return a < o.a || (a == o.a && b < o.b); }

  jamlab::Vector unwrapped(const double *x, const Domain *box) const
  {
    return jamlab::Vector{x[0] + a * box->xprd, x[1]} + jamlab::Vector{b * box->xy, b * box->yprd};
  }

 private:
  static int wrapped(int n) { return ((n + IMGMAX) & IMGMASK) - IMGMAX; }
};

}    // namespace LAMMPS_NS
