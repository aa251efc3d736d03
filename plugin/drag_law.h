// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <cmath>

namespace LAMMPS_NS {

/* Drag on the relative velocity at a contact, Baumgarten & Tighe eqs 5, 6 and 9: with the approach
   v_n and the slip v_t, the dissipation function is
   R = sum k tau^alpha/(alpha + 1) (v_n^2 + beta v_t^2)^((alpha + 1)/2), in units of length. */
struct DragLaw {
  double beta = 1.0, tau = 1.0, alpha = 1.0;
  bool arms_to_contact = false;    // of disks: to the middle of the overlap, not the radius

  double square(double approach, double slide) const
  {
    return tau * tau * (approach * approach + beta * slide * slide);
  }

  // drag over velocity of a contact of unit stiffness; both squares as above
  double weight(double square, double slowest) const
  {
    return alpha == 1.0 ? tau : tau * std::pow(square + slowest, 0.5 * (alpha - 1.0));
  }
};

// Below, the drag of the contacts that move least grows beyond all others and no solver converges
inline constexpr double LEAST_ALPHA = 0.4;
// Flows at 1e5 balance energy to the tolerance; at 1e6 all lose 5 % and more, in rounding
inline constexpr double LARGEST_BETA = 1e5;

}    // namespace LAMMPS_NS
