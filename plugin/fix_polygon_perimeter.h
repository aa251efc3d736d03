// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fix_outline_energy.h"
#include "polygon_parameter.h"

namespace LAMMPS_NS {

/* The perimeter elasticity of the closed rings of a group has the energy E = (kp/2) sum_m (p_m - p0
   sqrt(a0_m))^2, with a preferred shape index p0. See jamlab/outline_laws/perimeter.py, which has
   the same formulas. */
class FixPolygonPerimeter : public FixOutlineEnergy {
 public:
  FixPolygonPerimeter(class LAMMPS *, int, char **);
  void init() override;
  void take() override;
  void add_product(const Field &p, double strain, double factor, Field &out,
                   Virial &) const override;
  void assemble(double factor, BlockAssembly<2> &) const override;
  double scale() const override { return kp * largest_side; }

 protected:
  void add_forces() override;

 private:
  double kp, index;
  PolygonParameter rest_area;
  std::vector<double> a0, excess;    // of each polygon
  double largest_side = 1.0;         // root of a rest area, of this rank
  bigint parameters_of = -1;
  struct Side {    // edges in and out of an owned vertex, as unit vectors, with lengths
    int prev, i, next, polygon;
    Edge in, out;
    jamlab::Vector slope;    // dp/dx
  };
  std::vector<Side> sides;

  void find_parameters();
  void find_sides();
};

}    // namespace LAMMPS_NS
