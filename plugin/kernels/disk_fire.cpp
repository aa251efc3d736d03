// This is FIRE for soft disks, step for step as `min_style fire` of LAMMPS takes it with the
// settings of decks. It finds the same states to rounding, in less than half the time, unless disks
// are HEAVY: E. Bitzek et al., Phys. Rev. Lett. 97, 170201 (2006); J. Guenole et al., Comput.
// Mater. Sci. 175, 109584 (2020).
//
// Disks do not take LbfgsDescent: from random starts of 256 to 4096 disks, down to a largest force
// of 1e-8, its factors and solutions alone take 1.4 to 9 times the time of FIRE, and it ends in
// other minima.

#include "../wide_vectors.h"
#include "disk_law.h"
#include "disk_neighbors.h"
#include "kernel.h"
#include "thread_team.h"

#include <atomic>
#include <limits>

using std::int64_t;

namespace {

constexpr int64_t BOX_TOO_SMALL = -1, NOT_FINITE = -2, NO_THREADS = -4;

// A share has so many disks. Pairs across shares, 5 % of all, are computed twice.
constexpr int64_t SHARE = 4096, MOST_SHARES = 64;

struct Fire {
  double timestep, tmax, dmax, tmin, dtgrow, dtshrink, alpha0, alphashrink;
  int64_t delay, most_uphill;
};

// The box may take these strains, upper triangles, against a pressure outside.
struct BoxStrains {
  int count;
  Triangle strain[3];
  double pressure, inertia, size;  // inertia: of a strain; force = stress * size, of a disk

  static constexpr double LESS = 0.1;  // longest strain over the longest move
};

// One pass over all disks finds these sums.
struct Sums {
  double power = 0, velocity2 = 0, force2 = 0;  // v . f, m v . v, f . f / m
  double fastest = 0, strongest = 0;            // largest components of v and of f / m
  double largest2 = 0;                          // largest f . f
  double xx = 0, xy = 0, yy = 0;                // sum of force times distance
  char unused[56] = {};                             // shares are written side by side
};

// Each thread has its own box; all of them compute the same.
struct Cell {
  Triangle box, since{1, 0, 1};  // since the neighbors were listed
  double velocity[3] = {}, force[3] = {};
};

constexpr double NEARLY_TOGETHER = 1e-100;  // centres have no direction

// A batch is some pairs: their distance vectors, contact distances and forces.
struct Batch {
  static constexpr int MOST = 128;
  double x[MOST], y[MOST], reach[MOST], force_x[MOST], force_y[MOST];
};

JAMLAB_WIDE_VECTORS void repel(Batch &pairs, int count, Law law)
{
  // divisions are made where nothing touches as well: a loop without branches runs on four pairs at
  // a time
  for (int p = 0; p < count; ++p) {
    const double x = pairs.x[p], y = pairs.y[p], reach = pairs.reach[p];
    const double r = std::sqrt(x * x + y * y), overlap = std::max(reach - r, 0.0),
                 unit = law.relative ? reach * reach : 1.0;
    const double slope = law.strength * overlap / (unit * std::max(r, NEARLY_TOGETHER));
    pairs.force_x[p] = slope * x;
    pairs.force_y[p] = slope * y;
  }
  if (law.exponent == 2.0) return;
  // the force is x^(exponent - 2) times that of springs
  for (int p = 0; p < count; ++p) {
    const double reach = pairs.reach[p], r = size(Vector{pairs.x[p], pairs.y[p]});
    if (r >= reach) continue;
    const double x = (reach - r) / reach;
    const double stiffer = law.exponent == 2.5 ? std::sqrt(x) : std::pow(x, law.exponent - 2.0);
    pairs.force_x[p] *= stiffer;
    pairs.force_y[p] *= stiffer;
  }
}

class Minimizer {
 public:
  Minimizer(DiskNeighbors &all, Law law, Fire fire, BoxStrains strains, int threads, double skin)
      : all(all), law(law), fire(fire), box_strains(strains), team(threads),
        force(all.disks.size()), sums(all.shares.size()), far(all.shares.size()), skin(skin)
  {
  }

  int64_t run(double tolerance, int64_t steps)
  {
    int64_t taken = 0;
    const auto work = [&](int k) noexcept {
      const int64_t found = descend(k, tolerance, steps);
      if (k == 0) taken = found;
    };
    return team.run(work) ? taken : NO_THREADS;
  }

  double at_last() const { return last_force; }

 private:
  DiskNeighbors &all;
  static constexpr int64_t LONG = 200;  // steps
  static constexpr double TIGHTEST = 0.02;
  const Law law;
  const Fire fire;
  const BoxStrains box_strains;
  ThreadTeam team;
  std::vector<Vector> force;
  std::vector<Sums> sums;
  std::vector<double> far;
  std::atomic<int64_t> failure{0};
  double skin;
  int64_t built_at = 0;
  double last_force = 0.0;

  // Does something with each share of one thread.
  template <class Work> void each(int k, Work work)
  {
    const int shares = static_cast<int>(all.shares.size());
    for (int s = shares * k / team.members; s < shares * (k + 1) / team.members; ++s) work(s);
  }

  int64_t descend(int k, double tolerance, int64_t steps) noexcept
  {
    double dt = fire.timestep, alpha = fire.alpha0;
    const double longest = fire.tmax * dt, shortest = fire.tmin * dt;
    int64_t last_negative = 0, uphill = 0;
    double travelled = 0.0;  // at most, since the neighbors were listed
    Cell cell;
    cell.box = all.box;
    rebuild(k, 0);
    if (failure) return failure;
    Sums now = forces(k, cell);
    for (int64_t step = 1; step <= steps; ++step) {
      double keep = 1.0, steer = 0.0;
      bool at_rest = step == 1;
      if (now.power > 0) {
        uphill = 0;
        keep = 1.0 - alpha;
        if (now.force2 > 1e-20) steer = alpha * std::sqrt(now.velocity2 / now.force2);
        if (step - last_negative > fire.delay) {
          dt = std::min(dt * fire.dtgrow, longest);
          alpha *= fire.alphashrink;
        }
      } else {
        last_negative = step;
        if (step >= fire.delay) {
          alpha = fire.alpha0;
          if (dt * fire.dtshrink >= shortest) dt *= fire.dtshrink;
        }
        if (++uphill > fire.most_uphill) return finish(k, now, step);
        at_rest = true;
        const double back = 0.5 * dt;
        const Triangle map = strain(k, cell, -back);
        step_back(k, back, map);
        for (double &v : cell.velocity) v = 0.0;
        travelled += 1.5 * back * now.fastest + all.strained(map, skin);
        relist(k, step, cell, travelled);
        if (failure) return failure;
        now = forces(k, cell);
      }
      const double fastest = at_rest ? dt * now.strongest : now.fastest;
      const double dtv = dt * fastest > fire.dmax ? fire.dmax / fastest : dt;
      for (int a = 0; a < box_strains.count; ++a)
        cell.velocity[a] = keep * (cell.velocity[a] + dtv * cell.force[a]) + steer * cell.force[a];
      const Triangle map = strain(k, cell, dtv);
      advance(k, dtv, keep, steer, map);
      travelled += 1.5 * dtv * (keep * (now.fastest + dtv * now.strongest) + steer * now.strongest);
      travelled += all.strained(map, skin);
      relist(k, step, cell, travelled);
      if (failure) return failure;
      now = forces(k, cell);
      if (now.largest2 < tolerance * tolerance) return finish(k, now, step);
    }
    return finish(k, now, steps);
  }

  int64_t finish(int k, const Sums &now, int64_t step)
  {
    if (k == 0) last_force = std::sqrt(now.largest2);
    return step;
  }

  // Strains the box for a time, and returns the map that positions have to follow.
  Triangle strain(int k, Cell &cell, double time)
  {
    if (!box_strains.count) return {1, 0, 1};
    Triangle sum{0, 0, 0};
    for (int a = 0; a < box_strains.count; ++a) {
      const double amount = time * cell.velocity[a] / std::sqrt(box_strains.inertia);
      sum.xx += amount * box_strains.strain[a].xx;
      sum.xy += amount * box_strains.strain[a].xy;
      sum.yy += amount * box_strains.strain[a].yy;
    }
    const double half = 0.5 * (sum.xx - sum.yy), middle = std::exp(0.5 * (sum.xx + sum.yy));
    const double shear = sum.xy * middle * (half != 0 ? std::sinh(half) / half : 1.0);
    const Triangle map{std::exp(sum.xx), shear, std::exp(sum.yy)};
    cell.box = cell.box.after(map);
    cell.since = cell.since.after(map);
    if (k == 0) all.set_box(cell.box);  // nobody looks at it before all have met
    return map;
  }

  // Goes back half a step, where the power has turned negative, and stops.
  void step_back(int k, double time, const Triangle &map)
  {
    each(k, [&](int s) {
      for (int64_t i = all.shares[s].first; i < all.shares[s].last; ++i) {
        all.disks[i].at = map(all.disks[i].at) - all.velocity[i] * time;
        all.velocity[i] = force[i] = {0.0, 0.0};
      }
    });
  }

  void advance(int k, double dt, double keep, double steer, const Triangle &map)
  {
    each(k, [&](int s) {
      for (int64_t i = all.shares[s].first; i < all.shares[s].last; ++i) {
        Vector &v = all.velocity[i];
        const Vector f = force[i];
        const double light = all.disks[i].lightness;
        v = (v + f * dt * light) * keep + f * steer * light;
        all.disks[i].at = map(all.disks[i].at) + v * dt;
        force[i] = {0.0, 0.0};
      }
    });
  }

  // Lists neighbors anew when a disk has moved half the skin, or nearer ones where lists last long.
  // `travelled` is an upper bound, which spares looking at every disk in every step.
  void relist(int k, int64_t step, Cell &cell, double &travelled)
  {
    const bool lasts = step - built_at == LONG && skin > TIGHTEST;
    if (!(travelled >= 0.5 * skin) && !lasts) return;
    each(k, [&](int s) { far[s] = all.moved(all.shares[s], cell.since, skin); });
    team.meet();
    travelled = *std::max_element(far.begin(), far.end());
    team.meet();
    if (travelled < 0.5 * skin && !lasts) return;
    rebuild(k, step);
    travelled = 0.0;
    cell.since = {1, 0, 1};
  }

  void rebuild(int k, int64_t step)
  {
    team.meet();
    try {
      if (k == 0) {
        // lists that last long may be tight; lists that are soon out of date reach farther
        const double wider = std::min(1.5 * skin, 0.3);
        const int64_t life = step - built_at;
        if (step > 0 && life < 20 && all.fits(wider)) skin = wider;
        else if (life >= LONG) skin = std::max(0.5 * skin, TIGHTEST);
        built_at = step;
        if (!all.fits(skin)) failure = BOX_TOO_SMALL;
        else if (!all.sort()) failure = NOT_FINITE;
      }
    } catch (...) {  // length_error too
      failure = jamlab::NO_MEMORY;
    }
    team.meet();
    if (failure) return;
    try {
      each(k, [&](int s) { all.list(all.shares[s], skin); });
    } catch (...) {  // length_error too
      failure = jamlab::NO_MEMORY;
    }
    team.meet();
  }

  Sums forces(int k, Cell &cell)
  {
    team.meet();  // all have moved
    each(k, [&](int s) { sums[s] = forces_of(all.shares[s]); });
    team.meet();
    Sums total;
    for (const Sums &part : sums) {
      total.power += part.power;
      total.velocity2 += part.velocity2;
      total.force2 += part.force2;
      total.fastest = std::max(total.fastest, part.fastest);
      total.strongest = std::max(total.strongest, part.strongest);
      total.largest2 = std::max(total.largest2, part.largest2);
      total.xx += part.xx;
      total.xy += part.xy;
      total.yy += part.yy;
    }
    add_strains(cell, total);
    return total;
  }

  // Adds the strains of the box, which are coordinates like the positions.
  void add_strains(Cell &cell, Sums &total) const
  {
    const double area = cell.box.xx * cell.box.yy, scale = 1.0 / std::sqrt(box_strains.inertia);
    for (int a = 0; a < box_strains.count; ++a) {
      const Triangle &m = box_strains.strain[a];
      const double work = total.xx * m.xx + total.xy * m.xy + total.yy * m.yy -
                          box_strains.pressure * area * (m.xx + m.yy);
      const double f = cell.force[a] = work * scale, v = cell.velocity[a];
      total.power += v * f;
      total.velocity2 += v * v;
      total.force2 += f * f;
      total.fastest = std::max(total.fastest, std::fabs(v) * scale / BoxStrains::LESS);
      total.strongest = std::max(total.strongest, std::fabs(f) * scale / BoxStrains::LESS);
      const double stress = work * box_strains.size / area;
      const double norm2 = m.xx * m.xx + m.xy * m.xy + m.yy * m.yy;
      total.largest2 = std::max(total.largest2, stress * stress / norm2);
    }
  }

  // Finds the forces of a share, which are 0 before, and their sums.
  Sums forces_of(const Share &share)
  {
    Sums found;
    if (box_strains.count) {
      add_pair_forces<true, true>(share.disk, share.neighbor, found);
      add_pair_forces<false, true>(share.outer_disk, share.outer_neighbor, found);
    } else {
      add_pair_forces<true, false>(share.disk, share.neighbor, found);
      add_pair_forces<false, false>(share.outer_disk, share.outer_neighbor, found);
    }
    for (int64_t i = share.first; i < share.last; ++i) {
      const Vector v = all.velocity[i], f = force[i];
      const double squared = dot(f, f), light = all.disks[i].lightness;
      found.power += dot(v, f);
      found.velocity2 += dot(v, v) / light;
      found.force2 += squared * light;
      found.fastest = std::max(found.fastest, std::max(std::fabs(v.x), std::fabs(v.y)));
      found.strongest =
          std::max(found.strongest, light * std::max(std::fabs(f.x), std::fabs(f.y)));
      found.largest2 = std::max(found.largest2, squared);
    }
    return found;
  }

  // Adds the forces of pairs to both of their disks, or to the first disk alone. Batches spare
  // branches that cannot be predicted.
  template <bool BOTH, bool STRESS>
  void add_pair_forces(const std::vector<std::uint32_t> &first,
                       const std::vector<std::uint32_t> &neighbor, Sums &found)
  {
    const double weight = BOTH ? 1.0 : 0.5;
    const Disk *disks = all.disks.data();
    Vector *f = force.data();
    Batch pairs;
    for (std::size_t from = 0; from < first.size(); from += Batch::MOST) {
      const int count = static_cast<int>(std::min<std::size_t>(Batch::MOST, first.size() - from));
      const std::uint32_t *i = first.data() + from, *j = neighbor.data() + from;
      for (int p = 0; p < count; ++p) {
        const Disk &own = disks[i[p]], &other = disks[j[p] & DiskNeighbors::NUMBER];
        const Vector apart = own.at - other.at - all.shift[j[p] >> DiskNeighbors::IMAGE];
        pairs.x[p] = apart.x;
        pairs.y[p] = apart.y;
        pairs.reach[p] = own.radius + other.radius;
      }
      repel(pairs, count, law);
      for (int p = 0; p < count; ++p) {
        const double x = pairs.force_x[p], y = pairs.force_y[p];
        f[i[p]] += {x, y};
        if (BOTH) f[j[p] & DiskNeighbors::NUMBER] -= {x, y};
        if (STRESS) {
          found.xx += weight * x * pairs.x[p];
          found.xy += weight * x * pairs.y[p];
          found.yy += weight * y * pairs.y[p];
        }
      }
    }
  }
};

}  // namespace

// Minimise the energy of soft disks, or their enthalpy, until the largest force is below a
// tolerance.
//   positions (n, 2) in and out, unwrapped; diameters (n); box (3) in and out: xx, xy, yy
//   strength, relative (0 or 1) and exponent of the law, see Law
//   fire (8): timestep, tmax, dmax, tmin, dtgrow, dtshrink, alpha0, alphashrink
//   strains (m, 3), m at most 3: of the box, as upper triangles xx, xy, yy; pressure outside
//   largest (1) out: the residual force, or stress times mean diameter
// Returns the steps taken; or, nothing changed, -1: the box is too small for bins, -2: positions
// that are not finite, -4: no threads.
JAMLAB_KERNEL fire_disks(int64_t n, double *positions, const double *diameters, double *box,
                         double strength, int64_t relative, double exponent, double tolerance,
                         int64_t steps, int64_t threads, double skin, const double *fire,
                         int64_t delay, int64_t most_uphill, int64_t m, const double *strains,
                         double pressure, double *largest)
try {
  if (n < 1 || n > DiskNeighbors::MOST || threads < 1 || threads > 4096 || m < 0 || m > 3)
    return BOX_TOO_SMALL;
  // The number of shares does not depend on the threads, so that sums are made in one order.
  const int shares = static_cast<int>(std::clamp<int64_t>(n / SHARE, 1, MOST_SHARES));
  const int members = static_cast<int>(std::min<int64_t>(threads, shares));
  DiskNeighbors all(n, positions, diameters, {box[0], box[1], box[2]}, shares);
  if (!all.fits(skin)) return BOX_TOO_SMALL;
  const Fire settings{fire[0], fire[1], fire[2], fire[3], fire[4],
                      fire[5], fire[6], fire[7], delay,   most_uphill};
  double size = 0.0;
  for (int64_t i = 0; i < n; ++i) size += diameters[i] / static_cast<double>(n);
  const double inertia = static_cast<double>(n) * size * size;
  BoxStrains box_strains{static_cast<int>(m), {}, pressure, inertia, size};
  for (int64_t a = 0; a < m; ++a)
    box_strains.strain[a] = {strains[3 * a], strains[3 * a + 1], strains[3 * a + 2]};
  const Law law{strength, relative != 0, exponent};
  Minimizer minimizer(all, law, settings, box_strains, members, skin);
  const int64_t taken = minimizer.run(tolerance, steps);
  if (taken < 0) return taken;
  all.unwrapped(positions);
  box[0] = all.box.xx;
  box[1] = all.box.xy;
  box[2] = all.box.yy;
  largest[0] = minimizer.at_last();
  return taken;
}
JAMLAB_OR_NO_MEMORY
