// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "kernels/vector.h"

namespace LAMMPS_NS {

/* The virial of forces f between points r apart is the sums of f_x r_y, f_x r_x and f_y r_y. */
struct Virial {
  double xy = 0.0, xx = 0.0, yy = 0.0;

  void add(const jamlab::Vector &f, const jamlab::Vector &r)
  {
    xy += f.x * r.y;
    xx += f.x * r.x;
    yy += f.y * r.y;
  }
};

}    // namespace LAMMPS_NS
