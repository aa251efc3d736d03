// Rigid regular polygons relax to a minimum by LbfgsDescent, and leave saddles.

#include "kernel.h"
#include "lbfgs_descent.h"
#include "rigid_polygons.h"

#include <cstring>

using namespace jamlab;

namespace {

struct Settings {  // in the order of `RigidSearch` in Python
  double relative, absolute, loose;
  LbfgsNumbers descent;
};

constexpr double FOLLOWED = 0.05;    // longest move by linear response
constexpr double GIVING_WAY = 1e-3;  // curvature of a saddle over the largest contact force
constexpr double HIGHEST = 6;        // over the stiffness of a contact: nothing gives way so much
constexpr double ROUNDED = 1e-14;    // of coordinates, over the width of the box
constexpr int BISECTIONS = 8, ITERATIONS = 12;

class Relaxation {
 public:
  Relaxation(RigidPolygons &polygons, const Settings &settings) :
      polygons(polygons), settings(settings) {}

  // Scales box and centres. Contacts respond linearly where they are stable.
  void follow(double factor)
  {
    polygons.evaluate(0.0);
    polygons.assemble();
    Values u;
    if (polygons.energy > 0 && polygons.factorise(settings.descent.least_shift)) {
      u = polygons.forces_of_scaling();
      for (double &value : u) value *= factor - 1;
      polygons.solve(u);
    }
    polygons.scale(factor);
    if (u.empty() || !(longest_part(u) <= FOLLOWED)) return;
    mark();
    polygons.move(u, 1.0);
  }

  // Descends to a minimum, or until contacts are lost, and returns the number of steps.
  int64_t descend(int64_t steps)
  {
    polygons.evaluate(0.0);
    LbfgsDescent<Relaxation> descent(*this, settings.descent);
    descent.run(static_cast<double>(steps));
    return static_cast<int64_t>(descent.counts.steps);
  }

  bool loose() const { return polygons.energy <= settings.loose; }

  // Leaves a saddle downhill along its mode until the energy rises; returns false at a minimum.
  bool leave_saddle()
  {
    const double force = polygons.contact_force;
    if (loose() || polygons.crossed) return false;
    assemble(0.0);
    if (polygons.factorise(GIVING_WAY * force, true)) return false;
    double low = GIVING_WAY * force, high = 2 * low;
    for (; !polygons.factorise(high, true); high *= 2)
      if (!(high < HIGHEST * stiffness())) return false;
    for (int k = 0; k < BISECTIONS; ++k)
      (polygons.factorise(0.5 * (low + high), true) ? high : low) = 0.5 * (low + high);
    polygons.factorise(high, true);
    Values mode(polygons.forces.size());
    // a vector without the symmetry of the packing
    for (std::size_t k = 0; k < mode.size(); ++k) mode[k] = std::sin(1.0 + 12.9898 * k);
    for (int k = 0; k < ITERATIONS; ++k) {
      polygons.solve(mode);
      const double most = longest_part(mode);
      for (double &value : mode) value /= most;
    }
    slide(mode, dot(polygons.forces, mode) < 0 ? -1.0 : 1.0);
    return true;
  }

  // as a model of LbfgsDescent
  bool ended() const
  {
    const double least = std::max(settings.relative * polygons.contact_force, settings.absolute);
    return polygons.crossed || loose() || polygons.largest_force() <= least;
  }
  double energy() const { return polygons.crossed ? INFINITY : polygons.energy; }
  double largest_force() const { return polygons.largest_force(); }
  const Values &forces() const { return polygons.forces; }
  // Near onset contacts that move by the rounding of coordinates change the energy by more digits.
  double rounding(double digits) const
  {
    return digits * polygons.energy + ROUNDED * polygons.width * polygons.contact_force;
  }
  void mark() { polygons.keep(); }
  void back() { polygons.go_back(); }
  void go(const Values &step, double length)
  {
    polygons.move(step, length);
    polygons.evaluate(0.0);
    change = step;
    for (double &value : change) value *= length;
  }
  void moved(Values &by) const { by = change; }
  bool assemble(double beyond)
  {
    polygons.evaluate(beyond);
    polygons.assemble();
    return !polygons.crossed;
  }
  double stiffness() const { return polygons.spring(); }
  bool factorise(double shift) { return polygons.factorise(shift); }
  void solve(const Values &force, Values &step, bool roughly)
  {
    step = force;
    polygons.solve(step, roughly);
  }

 private:
  RigidPolygons &polygons;
  const Settings &settings;
  Values change;  // from the marked place

  // Takes longer and longer steps while the energy falls, and one that ends in what stops it.
  void slide(const Values &mode, double sign)
  {
    const double reach = settings.descent.reach;
    double length = 0.0, ahead = 0.002 * reach;
    bool downhill = true;
    while (downhill && length < reach) {
      mark();
      go(mode, sign * ahead);
      downhill = energy() <= polygons.kept().energy;
      length += ahead;
      ahead *= 2;
    }
    if (polygons.crossed) back();
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
