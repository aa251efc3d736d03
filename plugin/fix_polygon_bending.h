// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fix_outline_energy.h"

namespace LAMMPS_NS {

/* The bending of the closed rings of a group has the energy E = (kappa/2) sum (theta - theta_0)^2/l
   of turning angles, with half the length l of the two edges at a vertex and theta_0 = theta0 2
   pi/nv. See jamlab/outline_laws/bending.py, which has the same formulas. */
class FixPolygonBending : public FixOutlineEnergy {
 public:
  FixPolygonBending(class LAMMPS *, int, char **);
  std::vector<Corner> corners() override;
  double scale(double size) const override { return kappa / (size * size); }

 protected:
  void add_forces() override;

 private:
  double kappa, theta0;
  struct Turn {    // at an owned vertex; derivatives by the components of the edges in and out
    jamlab::Vector in, out;
    double energy, slope[4], second[4][4];
  };

  Turn turn_at(const PolygonRings::Vertex &, bool with_second) const;
};

}    // namespace LAMMPS_NS
