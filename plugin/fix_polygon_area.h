// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fix.h"
#include "polygon_parameter.h"
#include "polygon_rings.h"

#include <vector>

namespace LAMMPS_NS {

/* The area elasticity of the closed rings of a group is the second term of Boromand et al. eq 7: E
   = sum_m (ka_m/2) (a_m - a0_m)^2. The vertices of a polygon share its energy and virial; the
   virial is taken about its center. */
class FixPolygonArea : public Fix {
 public:
  FixPolygonArea(class LAMMPS *, int, char **);
  int setmask() override;
  void post_constructor() override;
  void init() override;
  void setup(int vflag) override;
  void min_setup(int vflag) override { post_force(vflag); }
  void post_force(int) override;
  void min_post_force(int vflag) override { post_force(vflag); }
  void setup_pre_force_respa(int vflag, int at) override { pre_force_respa(vflag, at, 0); }
  void pre_force_respa(int vflag, int at, int loop) override;
  double compute_scalar() override;
  double memory_usage() override { return bytes(ka, a0, shape) + polygon_rings.memory_usage(); }

  // These values belong to the last evaluation of forces.
  const PolygonRings &rings() const { return polygon_rings; }
  double stiffness_of(int polygon) const { return ka[polygon]; }
  double rest_area_of(int polygon) const { return a0[polygon]; }
  double excess_of(int polygon) const { return shape[3 * polygon] - a0[polygon]; }

 private:
  PolygonRings polygon_rings;
  PolygonParameter stiffness, rest_area;
  std::vector<double> ka, a0, shape;    // of each polygon; shape: area and center
  double energy;                        // of this rank's share
  int level;                            // of respa
  bigint parameters_of;                 // refresh for which all ranks agreed on ka and a0

  void find_parameters();
  void add_area_force(const PolygonRings::RingSegment &);
  void tally(const PolygonRings::Vertex &, double share, const jamlab::Vector &force);
};

}    // namespace LAMMPS_NS
