// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dense_solver.h"

#include <cstddef>
#include <vector>

namespace LAMMPS_NS {

/* Finds which part theta of its drag acts on each of m pairs with a gap of zero, each of which
   decides on the others. Partings v and slips s answer linearly to two forces on each pair beside a
   part `base` of the drag, (v, s) = still + answers (theta - base) (w v, beta w s). Drag that sets
   in over a thin layer of the gap follows d theta/d time = -v between 0 and 1. It comes to rest
   where pairs at 0 part, those at 1 meet and others rub. */
struct MarginalContactSolver {
  std::size_t m;
  double base;
  std::vector<double> still, answers;    // 2 m, 2 m by 2 m: partings, then slips
  std::vector<double> weights;           // 2 m: w, then beta w
  std::vector<double> back;              // m: to be added to partings, of gaps not quite zero

  bool relax(std::vector<double> &thetas) const;    // true: they have come to rest

 private:
  struct Found {
    DenseSolver velocities;
    std::vector<double> partings, slips;    // m, m
  };
  Found find(const std::vector<double> &thetas) const;
  // of the partings of some pairs by their thetas, as many rows as columns
  std::vector<double> slopes(const Found &, const std::vector<std::size_t> &free) const;
  bool take_step(const std::vector<std::size_t> &free, const std::vector<double> &slopes,
                 double time, double allowed, std::vector<double> &thetas, Found &now) const;
};

}    // namespace LAMMPS_NS
