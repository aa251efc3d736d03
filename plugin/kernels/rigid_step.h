// A step of rigid polygons down the energy that contacts would have with distances linear in the
// coordinates,
//
//     sum of (k/2) max(0, overlap + change)^2 + (1/2) u (curvature + shift) u.
//
// Gaps that the step u closes are in it, contacts that it opens are not. Newton steps from one set
// of active contacts to the next go to its minimum: Nocedal & Wright, Numerical Optimization, 16.5.
// The curvature is left out where the matrix would not be positive definite.
#pragma once

#include "rigid_polygons.h"

namespace jamlab {

class RigidStep {
 public:
  using Numbers = RigidPolygons::Numbers;

  RigidStep(RigidPolygons &polygons, int sets, double rest) :
      polygons(polygons), sets(sets), rest(rest) {}

  // Finds the step, by at most `sets` sets of contacts, until `rest` of the force is left; false if
  // no matrix is positive definite.
  bool find(double shift);
  const Numbers &step() const { return u; }
  double fall(double factor) const;  // of the energy, foretold for a part of the step

 private:
  RigidPolygons &polygons;
  int sets;
  double rest;
  Numbers u, u_bent, force;               // the step, curvature times it, what is left to balance
  Numbers overlap_before, overlap, push;  // of contacts and gaps
  std::vector<char> active;

  bool take_sets(double shift, bool curved);
  bool see_active();
  double length_along(const Numbers &change, double slope, double bend) const;
  void go(double length, const Numbers &d, const Numbers &d_bent, const Numbers &change,
          double shift);
};

}  // namespace jamlab
