// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "bond_line_tension.h"
#include "fix.h"
#include "polygon_parameter.h"
#include "polygon_rings.h"

#include <vector>

namespace LAMMPS_NS {

/* The area elasticity of the closed rings of a group is the second term of Boromand et al. eq 7: E
   = sum_m (ka_m/2) (a_m - a0_m)^2. The vertices of a polygon share its energy and virial; the
   virial is taken about its center. */
class FixPolygonArea : public Fix, public TensionCarrier {
 public:
  FixPolygonArea(class LAMMPS *, int, char **);
  ~FixPolygonArea() override;
  int setmask() override { return OWN_MASK; }
  void post_constructor() override;
  void init() override;
  void setup(int vflag) override { post_force(vflag); }
  void min_setup(int vflag) override { post_force(vflag); }
  void setup_pre_reverse(int eflag, int vflag) override { pre_reverse(eflag, vflag); }
  // post_force is not told this flag
  void pre_reverse(int eflag, int /*vflag*/) override { eflag_caller = eflag; }
  void min_pre_reverse(int eflag, int vflag) override { pre_reverse(eflag, vflag); }
  void post_force(int) override;
  void min_post_force(int vflag) override { post_force(vflag); }
  double compute_scalar() override;
  double memory_usage() override { return bytes(ka, a0, pulls) + polygon_rings.memory_usage(); }
  bool add_tension_too(double gamma, double eta, double &energy_of_edges) override;

  // These values are those of the last evaluation of forces.
  const PolygonRings &rings() const { return polygon_rings; }
  double stiffness_of(int polygon) const { return ka[polygon]; }
  double excess_of(int polygon) const { return shape[3 * polygon] - a0[polygon]; }

 private:
  static constexpr int OWN_MASK = FixConst::PRE_REVERSE | FixConst::MIN_PRE_REVERSE |
      FixConst::POST_FORCE | FixConst::MIN_POST_FORCE;
  PolygonRings polygon_rings;
  PolygonParameter stiffness, rest_area;
  std::vector<double> ka, a0, shape;    // of each polygon; shape: area and center
  double energy;                        // of this rank's share
  int eflag_caller;
  bigint parameters_of;                 // refresh for which ka and a0 were found
  std::vector<double> pulls;
  bool done;                            // by the bond style, in this evaluation of forces

  void find_parameters();
  double add_forces(double gamma, double eta);
  double add_area_force(const PolygonRings::RingSegment &, double gamma, double eta);
  bool first_to_add();
  void tally(const PolygonRings::Vertex &, double share, const jamlab::Vector &force);
};

}    // namespace LAMMPS_NS
