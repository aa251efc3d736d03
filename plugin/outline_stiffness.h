// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "block_assembly.h"
#include "fix_outline_energy.h"
#include "slip_row.h"

#include <vector>

namespace LAMMPS_NS {

/* OutlineStiffness multiplies displacements by the Hessian of all laws of outlines, which give
   their second derivatives by corners. It is a part of DropletStiffness. */
class OutlineStiffness {
 public:
  explicit OutlineStiffness(class LAMMPS *lmp) : lmp(lmp) {}

  void take();    // at the present positions, for which laws have found forces
  void add_product(const Field &p, double strain, double factor, Field &out, Virial &) const;
  void assemble(double factor, BlockAssembly<2> &) const;

 private:
  class LAMMPS *lmp;
  using Corner = FixOutlineEnergy::Corner;
  struct Law {
    FixOutlineEnergy *fix;
    std::vector<Corner> corners;
  };
  std::vector<Law> laws;

  static void add_sums(const Law &, const Field &p, double strain, double factor, Field &out,
                       Virial &);
  static void assemble_sums(const Law &, double factor, BlockAssembly<2> &);
};

}    // namespace LAMMPS_NS
