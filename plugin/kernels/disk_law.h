// The repulsion of soft disks by a power of their overlap.
#pragma once

#include <cmath>

// An overlap x = 1 - r/s has the energy (strength/exponent) x^exponent, times s^2 unless
// `relative`: the strength is an energy, or else a stiffness; see jamlab/laws/power.py.
struct Law {
  double strength;
  bool relative;
  double exponent;

  double energy(double reach, double r) const
  {
    if (r >= reach) return 0.0;
    const double x = (reach - r) / reach;
    const double power = exponent == 2.0 ? x * x : std::pow(x, exponent);
    return strength / exponent * power * (relative ? 1.0 : reach * reach);
  }
};
