// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "error.h"

#include <algorithm>
#include <cmath>

namespace LAMMPS_NS {

/* The law of drag on the relative velocity at a contact, Baumgarten & Tighe eqs 5, 6 and 9. With
   the approach v_n and the slip v_t, its dissipation function is, with lengths in simulation units,
   R = sum k tau^alpha/(alpha + 1) (v_n^2 + beta v_t^2)^((alpha + 1)/2). With `even` above 0 that is
   k of every contact, instead of its stiffness. */
struct DragLaw {
  // Below it, the drag of the slowest contacts grows beyond all others and no solver converges.
  static constexpr double LEAST_ALPHA = 0.4;
  // Flows with 1e5 balance energy to the tolerance; flows with 1e6 lose 5 % and more by rounding.
  static constexpr double LARGEST_BETA = 1e5;
  double beta = 1.0, tau = 1.0, alpha = 1.0;
  enum Arms : int { RADIUS, CONTACT, NONE } arms = RADIUS;    // of disks: levers of rotation end at
                                                             // the rim, in mid-overlap, or are 0
  double even = 0.0;

  bool is_linear() const { return alpha == 1.0; }

  // the square of the velocity of which the drag is a power
  double square(double approach, double slide) const
  {
    return tau * tau * (approach * approach + beta * slide * slide);
  }

  // the ratio of drag and velocity at a contact of unit stiffness; both arguments are such squares
  double weight(double square, double slowest) const
  {
    return is_linear() ? tau : tau * std::pow(square + slowest, 0.5 * (alpha - 1.0));
  }

  double stiffness(double elastic) const { return even > 0.0 ? even : std::max(elastic, 0.0); }

  void check(Error *error, const char *who) const
  {
    if (!(tau >= 0.0))
      error->all(FLERR, "{}: tau {} must be a time, 0 for no drag at contacts", who, tau);
    if (!(even >= 0.0))
      error->all(FLERR, "{}: even {} must be a stiffness, 0 for that of each contact", who, even);
    if (!(beta >= 0.0 && beta <= LARGEST_BETA))
      error->all(FLERR, "{}: beta {} must lie between 0 and {}", who, beta, LARGEST_BETA);
    if (!(alpha >= LEAST_ALPHA && alpha <= 1.0))
      error->all(FLERR, "{}: alpha {} must lie between {} and 1 (linear)", who, alpha, LEAST_ALPHA);
  }
};

}    // namespace LAMMPS_NS
