// Rigid regular polygons relax to a minimum by Levenberg-Marquardt steps with the exact second
// derivatives: D. W. Marquardt, J. SIAM 11, 431 (1963); trust regions: Nocedal & Wright, Numerical
// Optimization, algorithm 4.1.

#include "kernel.h"
#include "rigid_polygons.h"

#include <algorithm>
#include <cstring>
#include <numeric>

using namespace jamlab;

namespace {

struct Settings {  // in the order of `RigidDescent` of Python
  double relative, absolute, loose;
  double reach, first_shift, least_shift, last_shift;
  double accepted, good, poor, shrink, grow, definite, searches, slack;
};

constexpr double ENERGY_DIGITS = 1e-12;  // a change of the energy below this part of it is rounding
constexpr double FOLLOWED = 0.05;        // longest move by linear response
constexpr double GIVING_WAY = 1e-3;      // curvature of a saddle over the largest contact force
constexpr int BISECTIONS = 8, ITERATIONS = 12;

double largest(const std::vector<double> &values)
{
  double most = 0.0;
  for (const double value : values) most = std::max(most, std::fabs(value));
  return most;
}

double product(const std::vector<double> &a, const std::vector<double> &b)
{
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

class Relaxation {
 public:
  Relaxation(RigidPolygons &polygons, const Settings &settings) :
      polygons(polygons), settings(settings) {}

  // Scales box and centres. Contacts respond linearly where they are stable.
  void follow(double factor)
  {
    polygons.evaluate(true);
    std::vector<double> u;
    if (polygons.energy > 0 && polygons.factorise(settings.least_shift)) {
      u = polygons.forces_of_scaling();
      for (double &value : u) value *= factor - 1;
      polygons.solve(u);
      if (!(largest(u) <= FOLLOWED)) u.clear();
    }
    polygons.scale(factor);
    if (!u.empty()) polygons.move(u, 1.0);
  }

  // Descends to a minimum, or until contacts are lost, and returns the number of steps.
  int64_t descend(int64_t steps)
  {
    double shift = settings.first_shift;
    polygons.evaluate(true);
    int64_t taken = 0;
    for (; taken < steps && !ended() && shift <= settings.last_shift; ++taken)
      if (!step(shift)) break;
    return taken;
  }

  bool loose() const { return polygons.energy <= settings.loose; }

  // Leaves a saddle downhill along its mode until the energy rises; returns false at a minimum.
  bool leave_saddle()
  {
    const double force = polygons.contact_force;
    if (loose() || polygons.crossed || polygons.factorise(GIVING_WAY * force, true)) return false;
    double low = GIVING_WAY * force, high = 2 * low;
    for (; !polygons.factorise(high, true); high *= 2)
      if (!(high < settings.last_shift)) return false;
    for (int k = 0; k < BISECTIONS; ++k)
      (polygons.factorise(0.5 * (low + high), true) ? high : low) = 0.5 * (low + high);
    polygons.factorise(high, true);
    std::vector<double> mode(polygons.forces.size());
    // a vector without the symmetry of the packing
    for (std::size_t k = 0; k < mode.size(); ++k) mode[k] = std::sin(1.0 + 12.9898 * k);
    for (int k = 0; k < ITERATIONS; ++k) {
      polygons.solve(mode);
      const double most = largest(mode);
      for (double &value : mode) value /= most;
    }
    slide(mode, product(polygons.forces, mode) < 0 ? -1.0 : 1.0);
    return true;
  }

 private:
  RigidPolygons &polygons;
  const Settings &settings;

  bool ended() const
  {
    const double least = std::max(settings.relative * polygons.contact_force, settings.absolute);
    return polygons.crossed || loose() || polygons.largest_force() <= least;
  }

  bool step(double &shift)
  {
    while (!polygons.factorise(shift)) {
      shift = std::max(shift * settings.definite, settings.least_shift);
      if (!(shift <= settings.last_shift)) return false;
    }
    std::vector<double> u = polygons.forces;
    polygons.solve(u);
    const double factor = std::min(1.0, settings.reach / largest(u));
    const double slope = product(polygons.forces, u), square = product(u, u);
    const double predicted = factor * slope - 0.5 * factor * factor * (slope - shift * square);
    polygons.keep();
    const double part = predicted > 0 ? gained_along(u, factor) / predicted : -1.0;
    const bool accepted = part > settings.accepted;
    if (part > settings.good) shift = std::max(settings.shrink * shift, settings.least_shift);
    if (!accepted && predicted > 0 && shortened(u, factor)) return true;
    if (!accepted) polygons.go_back();
    if (!(part >= settings.poor)) shift *= settings.grow;
    return true;
  }

  // Returns the fall of the energy from the kept state, which is negative where polygons cross.
  double gained_along(const std::vector<double> &u, double factor)
  {
    const RigidState &before = polygons.kept();
    polygons.move(u, factor);
    polygons.evaluate(true);
    if (polygons.crossed) return -1.0;
    const double gained = before.energy - polygons.energy;
    if (std::fabs(gained) >= ENERGY_DIGITS * before.energy) return gained;
    // the energy has no digits left, so the work of the forces counts
    return 0.5 * factor * (product(before.forces, u) + product(polygons.forces, u));
  }

  // Cuts a step that leads uphill short, behind the contacts that stop it, by regula falsi on the
  // force along the step.
  bool shortened(const std::vector<double> &u, double factor)
  {
    const double slope = product(polygons.kept().forces, u);
    double low = 0.0, high = factor, along_low = slope, along_high = product(polygons.forces, u);
    for (int k = 0; k < settings.searches; ++k) {
      const bool halve = polygons.crossed || along_high >= 0;
      const double zero = along_low / (along_low - along_high);
      const double part = halve ? 0.5 : std::clamp(zero, 0.03, 0.97);
      const double middle = low + part * (high - low);
      polygons.go_back();
      polygons.keep();
      const bool lower = gained_along(u, middle) > 0;
      const double along = product(polygons.forces, u);
      if (lower && along <= settings.slack * slope) return true;
      if (!polygons.crossed && along > 0) {
        low = middle;
        along_low = along;
        along_high *= 0.5;
      } else {
        high = middle;
        along_high = along;
        along_low *= 0.5;
      }
    }
    return false;
  }

  // Takes longer and longer steps while the energy falls, and one that ends in what stops it.
  void slide(const std::vector<double> &mode, double sign)
  {
    double length = 0.0, next = 0.002 * settings.reach;
    bool downhill = true;
    while (downhill && length < settings.reach) {
      polygons.keep();
      polygons.move(mode, sign * next);
      polygons.evaluate(true);
      downhill = !polygons.crossed && polygons.energy <= polygons.kept().energy;
      length += next;
      next *= 2;
    }
    if (polygons.crossed) polygons.go_back();
  }
};

}  // namespace

// Minimises the energy of rigid polygons, over the shears of the box as well if they are given.
//   counts, radii (n); shears: 0 or 1; box (2, 2), coordinates (n, 3): in and out; factor: scales
//   box and centres first; numbers (15): `Settings`; steps, saddles: at most; out (4): energy,
//   largest force, sum of force times distance, largest contact force.
// Returns the number of steps, or -1 if polygons cross.
JAMLAB_KERNEL relax_rigid_polygons(int64_t n, const int64_t *counts, const double *radii,
                                   double eps, double delta, int64_t shears, double *box,
                                   double *coordinates, double factor, const double *numbers,
                                   int64_t steps, int64_t saddles, double *out)
try {
  Settings settings;
  static_assert(sizeof(Settings) == 15 * sizeof(double), "numbers are copied");
  std::memcpy(&settings, numbers, sizeof(settings));
  RigidPolygons polygons(n, counts, radii, eps, delta, box, coordinates, shears != 0);
  Relaxation relaxation(polygons, settings);
  if (factor != 1.0) relaxation.follow(factor);
  int64_t taken = relaxation.descend(steps);
  for (int64_t k = 0; k < saddles && taken < steps && relaxation.leave_saddle(); ++k)
    taken += relaxation.descend(steps - taken);
  std::copy(polygons.q.begin(), polygons.q.end(), coordinates);
  box[0] = polygons.width;
  box[2] = polygons.tilt;
  box[3] = polygons.height;
  out[0] = polygons.energy;
  out[1] = polygons.largest_force();
  out[2] = polygons.virial;
  out[3] = polygons.contact_force;
  return polygons.crossed ? -1 : taken;
}
JAMLAB_OR_NO_MEMORY

// Finds the energy and its derivatives: forces (m) and stiffness (m, m) out, with m = 3 (n +
// shears). Returns 0, or -1 if polygons cross.
JAMLAB_KERNEL evaluate_rigid_polygons(int64_t n, const int64_t *counts, const double *radii,
                                      double eps, double delta, int64_t shears, const double *box,
                                      const double *coordinates, double *energy, double *forces,
                                      double *stiffness)
try {
  RigidPolygons polygons(n, counts, radii, eps, delta, box, coordinates, shears != 0);
  polygons.evaluate(true);
  *energy = polygons.energy;
  std::copy(polygons.forces.begin(), polygons.forces.end(), forces);
  polygons.write_stiffness(stiffness);
  return polygons.crossed ? -1 : 0;
}
JAMLAB_OR_NO_MEMORY
