// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fix_outline_energy.h"
#include "polygon_parameter.h"

namespace LAMMPS_NS {

/* The elasticity of perimeters and edges of the closed rings of a group has the energy E = sum over
   rings (kp/2)(p - P)^2 + (kl nv/2) sum over edges (l - P/nv)^2, with P = p0 sqrt(a0) and a
   preferred shape index p0. See jamlab/outline_laws/perimeter.py, which has the same formulas. */
class FixPolygonPerimeter : public FixOutlineEnergy {
 public:
  FixPolygonPerimeter(class LAMMPS *, int, char **);
  void init() override;
  std::vector<Corner> corners() override;
  double stiffness_of_sum() const override { return kp; }
  double scale(double size) const override { return (kp + kl) * size; }

 protected:
  void add_forces() override;

 private:
  double kp, kl, index;
  PolygonParameter rest_area;
  std::vector<double> a0, excess, rest;    // of each polygon; rest length of its edges
  bigint parameters_of = -1;
  struct Side {    // edges in and out of an owned vertex
    int prev, i, next, polygon;
    Edge in, out;
    jamlab::Vector slope;    // dp/dx
    double spring;           // of each edge
    double pull_in, pull_out;
  };
  std::vector<Side> sides;

  void find_parameters();
  void find_sides();
  double pull(int polygon, double length) const;
};

}    // namespace LAMMPS_NS
