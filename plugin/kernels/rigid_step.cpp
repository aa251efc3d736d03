#include "rigid_step.h"

#include <numeric>

using namespace jamlab;

namespace {

constexpr double FLAT = 1e-3, FLATTER = 1e-2;  // slope over the first at the end of a line search
constexpr int SEARCHES = 30;

double product(const std::vector<double> &a, const std::vector<double> &b)
{
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

}  // namespace

bool RigidStep::find(double shift)
{
  polygons.find_curvature();
  return take_sets(shift, true) || take_sets(shift, false);
}

double RigidStep::fall(double factor) const
{
  double fallen = -0.5 * factor * factor * product(u, u_bent);
  for (std::size_t m = 0; m < overlap.size(); ++m) {
    const double before = std::max(0.0, overlap_before[m]);
    const double change = overlap[m] - overlap_before[m];
    const double after = std::max(0.0, overlap_before[m] + factor * change);
    fallen += 0.5 * polygons.spring() * (before - after) * (before + after);
  }
  return fallen;
}

bool RigidStep::take_sets(double shift, bool curved)
{
  overlap_before = overlap = polygons.overlaps();
  active.assign(overlap.size(), 0);
  force = polygons.forces;
  u.assign(force.size(), 0.0);
  u_bent = u;
  const double enough = rest * rest * product(force, force);
  for (int k = 0; k < sets && (see_active() || k == 0); ++k) {
    polygons.assemble(active, curved);
    if (!polygons.factorise(shift)) return false;
    Numbers d = force;
    polygons.solve(d);
    const Numbers change = polygons.closing(d);
    const Numbers d_bent = curved ? polygons.curvature_times(d) : Numbers(d.size(), 0.0);
    const double slope = product(u_bent, d) + shift * product(u, d);
    const double bend = product(d_bent, d) + shift * product(d, d);
    go(length_along(change, slope, bend), d, d_bent, change, shift);
    if (product(force, force) <= enough) break;
  }
  return true;
}

// Returns whether contacts became active, or ceased to be.
bool RigidStep::see_active()
{
  bool changed = false;
  for (std::size_t m = 0; m < overlap.size(); ++m) {
    const char now = overlap[m] > 0;
    changed = changed || now != active[m];
    active[m] = now;
  }
  return changed;
}

// Where the slope of the model, piecewise linear, ends along a direction, by regula falsi; at most
// the whole of it. slope, bend: of what is quadratic.
double RigidStep::length_along(const Numbers &change, double slope, double bend) const
{
  const auto along = [&](double length) {
    double sum = 0.0;
    for (std::size_t m = 0; m < overlap.size(); ++m)
      sum += std::max(0.0, overlap[m] + length * change[m]) * change[m];
    return polygons.spring() * sum + slope + length * bend;
  };
  const double first = along(0.0), least = FLATTER * std::fabs(first);
  double low = 0.0, high = 1.0, at_low = first, at_high = along(1.0), length = 1.0;
  if (at_high <= FLAT * std::fabs(first)) return length;
  for (int k = 0; k < SEARCHES; ++k) {
    length = low + (high - low) * std::clamp(at_low / (at_low - at_high), 0.02, 0.98);
    const double here = along(length);
    if (std::fabs(here) <= least) break;
    (here < 0 ? low : high) = length;
    (here < 0 ? at_low : at_high) = here;
    (here < 0 ? at_high : at_low) *= 0.5;
  }
  return length;
}

void RigidStep::go(double length, const Numbers &d, const Numbers &d_bent, const Numbers &change,
                   double shift)
{
  push.resize(overlap.size());
  for (std::size_t m = 0; m < overlap.size(); ++m) {
    overlap[m] += length * change[m];
    push[m] = polygons.spring() * std::max(0.0, overlap[m]);
  }
  for (std::size_t a = 0; a < u.size(); ++a) {
    u[a] += length * d[a];
    u_bent[a] += length * d_bent[a];
    force[a] = -shift * u[a] - u_bent[a];
  }
  polygons.add_forces(push, force);
}
