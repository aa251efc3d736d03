// Rigid regular polygons relax to a minimum by Levenberg-Marquardt steps, of which each knows the
// contacts that it opens and closes: D. W. Marquardt, J. SIAM 11, 431 (1963); trust regions:
// Nocedal & Wright, Numerical Optimization, algorithm 4.1.

#include "kernel.h"
#include "rigid_step.h"

#include <algorithm>
#include <cstring>
#include <numeric>

using namespace jamlab;

namespace {

struct Settings {  // in the order of `RigidDescent` of Python
  double relative, absolute, loose;
  double reach, first_shift, least_shift, last_shift;
  double accepted, good, poor, shrink, grow, definite, sets, rest;
};

constexpr double ENERGY_DIGITS = 1e-12;  // a change of the energy below this part is rounding
// Gaps up to this many times the longest move of a step are known to the next one, and at most up
// to this many times the reach of a step.
constexpr double NEXT = 8, WIDEST = 2;
// A shift that shrank too fast shrinks by the square root of its factor next time, up to this one,
// and by the factor to this power after a step that fared well.
constexpr double SLOWEST = 0.8, FASTER = 1.4;
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
      polygons(polygons), settings(settings),
      next(polygons, static_cast<int>(settings.sets), settings.rest) {}

  // Scales box and centres. Contacts respond linearly where they are stable.
  void follow(double factor)
  {
    polygons.evaluate(0.0);
    polygons.assemble();
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
    shift = settings.first_shift;
    shrink = settings.shrink;
    polygons.evaluate(WIDEST * settings.reach);
    int64_t taken = 0;
    while (taken < steps && !ended() && shift <= settings.last_shift && step()) ++taken;
    return taken;
  }

  bool loose() const { return polygons.energy <= settings.loose; }

  // Leaves a saddle downhill along its mode until the energy rises; returns false at a minimum.
  bool leave_saddle()
  {
    const double force = polygons.contact_force;
    if (loose() || polygons.crossed) return false;
    polygons.assemble();
    if (polygons.factorise(GIVING_WAY * force, true)) return false;
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
  RigidStep next;
  double shift = 0.0, shrink = 0.0;  // added to the diagonal, and its factor after a good step

  bool ended() const
  {
    const double least = std::max(settings.relative * polygons.contact_force, settings.absolute);
    return polygons.crossed || loose() || polygons.largest_force() <= least;
  }

  bool step()
  {
    while (!next.find(shift)) {
      shift = std::max(shift * settings.definite, settings.least_shift);
      if (!(shift <= settings.last_shift)) return false;
    }
    const double factor = std::min(1.0, settings.reach / largest(next.step()));
    const double predicted = next.fall(factor);
    polygons.keep();
    const double part = predicted > 0 ? gained_along(next.step(), factor) / predicted : -1.0;
    if (part > settings.good) {
      shift = std::max(shrink * shift, settings.least_shift);
      shrink = std::max(settings.shrink, std::pow(shrink, FASTER));
    }
    if (!(part >= settings.poor)) shift *= settings.grow;
    if (part > settings.accepted) return true;
    polygons.go_back();
    shrink = std::min(SLOWEST, std::sqrt(shrink));
    return true;
  }

  // Returns the fall of the energy from the kept state, which is negative where polygons cross.
  double gained_along(const std::vector<double> &u, double factor)
  {
    const RigidState &before = polygons.kept();
    polygons.move(u, factor);
    polygons.evaluate(std::min(WIDEST * settings.reach, NEXT * factor * largest(u)));
    if (polygons.crossed) return -1.0;
    const double gained = before.energy - polygons.energy;
    if (std::fabs(gained) >= ENERGY_DIGITS * before.energy) return gained;
    // the energy has no digits left, so the work of the forces counts
    return 0.5 * factor * (product(before.forces, u) + product(polygons.forces, u));
  }

  // Takes longer and longer steps while the energy falls, and one that ends in what stops it.
  void slide(const std::vector<double> &mode, double sign)
  {
    double length = 0.0, ahead = 0.002 * settings.reach;
    bool downhill = true;
    while (downhill && length < settings.reach) {
      polygons.keep();
      polygons.move(mode, sign * ahead);
      polygons.evaluate(0.0);
      downhill = !polygons.crossed && polygons.energy <= polygons.kept().energy;
      length += ahead;
      ahead *= 2;
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
  polygons.evaluate(0.0);
  polygons.assemble();
  *energy = polygons.energy;
  std::copy(polygons.forces.begin(), polygons.forces.end(), forces);
  polygons.write_stiffness(stiffness);
  return polygons.crossed ? -1 : 0;
}
JAMLAB_OR_NO_MEMORY
