// This is Monte Carlo of soft disks by the rule of Metropolis: moves of one disk, and swaps of the
// sizes of two, as A. Ninarello, L. Berthier and D. Coslovich have them, Phys. Rev. X 7, 021039
// (2017). Random numbers are those of a generator of numpy, which the caller holds.

#include "disk_law.h"
#include "kernel.h"
#include "periodic_neighbors.h"

#include <limits>

using jamlab::Image;
using jamlab::Vector;
using std::int64_t;

namespace {

// Lists of neighbors reach so many mean diameters beyond contact, and so many longest moves.
constexpr double SKIN = 0.4, MOVES = 4.0;
constexpr double MOST_COPIES = 2e7;

struct Random {
  double (*next)(void *);
  void *state;

  double operator()() const { return next(state); }
  int64_t below(std::size_t m) const
  {
    return static_cast<int64_t>((*this)() * static_cast<double>(m));
  }
};

// Flat walls are two lines along x; disks stay between them.
struct Planes {
  bool there;
  double low, high, height;  // of the box
};

// Disk j in an image, moved by a vector.
struct Near {
  int64_t j;
  Vector shift;
};

struct Counts {
  int64_t moves = 0, moved = 0, swaps = 0, swapped = 0;
};

class Disks {
 public:
  Disks(int64_t n, double *positions, double *diameters, const int64_t *fixed, const double *box,
        Planes planes, Law law, double step)
      : n(n), x(positions), d(diameters), lattice(box), planes(planes), law(law), step(step),
        first(n + 1), built(n)
  {
    for (int64_t i = 0; i < n; ++i) {
      if (!fixed[i]) loose.push_back(i);
      largest = std::max(largest, d[i]);
      skin += SKIN * d[i] / static_cast<double>(n);
    }
    skin = std::max(skin, MOVES * std::sqrt(2.0) * step);
  }

  // Lists all neighbors anew. Returns 0, or a Refusal.
  int64_t list()
  {
    const std::vector<double> reach(n, 0.5 * (largest + skin));
    const jamlab::Reaching all{n, x, reach.data()};
    std::vector<std::pair<int64_t, Near>> found;
    double search[5];
    const auto keep = [&](const jamlab::Neighbor &pair) {
      const Vector shift = lattice.translation(pair.shift);
      found.push_back({pair.i, {pair.j, shift}});
      if (pair.i != pair.j) found.push_back({pair.j, {pair.i, Vector{0, 0} - shift}});
    };
    const int64_t refused =
        visit_neighbors(all, all, lattice, true, MOST_COPIES, search, keep);
    if (refused) return refused;
    std::fill(first.begin(), first.end(), 0);
    for (const auto &[i, _] : found) ++first[i + 1];
    std::partial_sum(first.begin(), first.end(), first.begin());
    std::vector<int64_t> next(first.begin(), first.end() - 1);
    near.resize(found.size());
    for (const auto &[i, other] : found) near[next[i]++] = other;
    for (int64_t i = 0; i < n; ++i) built[i] = jamlab::point(x, i);
    return 0;
  }

  // One sweep: as many trials as disks that are free. Adds the change of the energy. Returns 0, or
  // a Refusal.
  int64_t sweep(const Random &random, double temperature, double swap_share, Counts &counts,
                double &energy)
  {
    for (std::size_t trial = 0; trial < loose.size(); ++trial) {
      if (random() < swap_share) {
        ++counts.swaps;
        const int64_t i = loose[random.below(loose.size())], j = loose[random.below(loose.size())];
        if (d[i] == d[j]) continue;
        const double work = swap_work(i, j);
        if (!accepts(work, temperature, random)) continue;
        std::swap(d[i], d[j]);
        energy += work;
        ++counts.swapped;
        continue;
      }
      ++counts.moves;
      const int64_t i = loose[random.below(loose.size())];
      const double along = step * (2 * random() - 1), up = step * (2 * random() - 1);
      const Vector at = jamlab::point(x, i), to = at + Vector{along, up};
      if (size(to - built[i]) > 0.5 * skin)
        if (const int64_t refused = list()) return refused;
      const double work = energy_at(i, to, d[i]) - energy_at(i, at, d[i]);
      if (!accepts(work, temperature, random)) continue;
      jamlab::put(x, i, to);
      energy += work;
      ++counts.moved;
    }
    return 0;
  }

  double energy() const
  {
    double twice = 0.0, own = 0.0;
    for (int64_t i = 0; i < n; ++i) {
      const Vector at = jamlab::point(x, i);
      twice += pairs_at(i, at, d[i]);
      own += alone(i, at, d[i]);
    }
    return 0.5 * twice + own;
  }

 private:
  const int64_t n;
  double *x, *d;
  const jamlab::Lattice lattice;
  const Planes planes;
  const Law law;
  const double step;
  double largest = 0.0, skin = 0.0;
  std::vector<int64_t> loose, first;
  std::vector<Near> near;
  std::vector<Vector> built;

  static bool accepts(double work, double temperature, const Random &random)
  {
    return work <= 0.0 || random() < std::exp(-work / temperature);
  }

  // Energy of a disk, of some diameter and place, with all others but one.
  double pairs_at(int64_t i, const Vector &at, double diameter, int64_t without = -1) const
  {
    double sum = 0.0;
    for (int64_t k = first[i]; k < first[i + 1]; ++k) {
      const auto &[j, shift] = near[k];
      if (j == i || j == without) continue;
      const Vector apart = jamlab::point(x, j) + shift - at;
      const double reach = 0.5 * (diameter + d[j]), squared = dot(apart, apart);
      if (squared < reach * reach) sum += law.energy(reach, std::sqrt(squared));
    }
    return sum;
  }

  // Energy of a disk with its own images, and with flat walls; infinite behind one.
  double alone(int64_t i, const Vector &at, double diameter) const
  {
    double sum = 0.0;
    for (int64_t k = first[i]; k < first[i + 1]; ++k)
      if (near[k].j == i) sum += law.energy(diameter, size(near[k].shift));
    if (!planes.there) return sum;
    const double y = at.y - std::floor(at.y / planes.height) * planes.height;
    if (!(planes.low < y && y < planes.high)) return std::numeric_limits<double>::infinity();
    return sum + law.energy(0.5 * diameter, y - planes.low) +
           law.energy(0.5 * diameter, planes.high - y);
  }

  double energy_at(int64_t i, const Vector &at, double diameter, int64_t without = -1) const
  {
    return pairs_at(i, at, diameter, without) + alone(i, at, diameter);
  }

  // The distance at which two disks touch does not change with their swap.
  double swap_work(int64_t i, int64_t j) const
  {
    const Vector at = jamlab::point(x, i), other = jamlab::point(x, j);
    return energy_at(i, at, d[j], j) + energy_at(j, other, d[i], i) - energy_at(i, at, d[i], j) -
           energy_at(j, other, d[j], i);
  }
};

}  // namespace

// Take sweeps of Metropolis trials at a temperature: with a probability `swap_share` a swap of the
// sizes of two free disks, else a move of one by up to `step` along both axes.
//   positions (n, 2) and diameters (n) in and out; fixed (n): 1 for disks that stay
//   box (2, 2), rows; planes (2): heights of flat walls, if `walls`
//   strength, relative (0 or 1) and exponent of the law, see Law
//   next, state: a generator of numpy, `next_double` of its C interface
//   counts (4) out: trials to move, accepted, trials to swap, accepted
//   energies (sweeps + 1) out: at the start and after each sweep
// Returns 0; or -1: too many images, -2: positions too far away.
JAMLAB_KERNEL swap_disks(int64_t n, double *positions, double *diameters, const int64_t *fixed,
                         const double *box, int64_t walls, const double *planes, double strength,
                         int64_t relative, double exponent, double temperature, double step,
                         double swap_share, int64_t sweeps, double (*next)(void *), void *state,
                         int64_t *counts, double *energies)
try {
  const Planes flat{walls != 0, planes[0], planes[1], box[3]};
  Disks disks(n, positions, diameters, fixed, box, flat, {strength, relative != 0, exponent}, step);
  if (const int64_t refused = disks.list()) return refused;
  const Random random{next, state};
  Counts total;
  double energy = energies[0] = disks.energy();
  for (int64_t k = 0; k < sweeps; ++k) {
    if (const int64_t refused = disks.sweep(random, temperature, swap_share, total, energy))
      return refused;
    energies[k + 1] = energy;
  }
  const int64_t found[4] = {total.moves, total.moved, total.swaps, total.swapped};
  std::copy(found, found + 4, counts);
  return 0;
}
JAMLAB_OR_NO_MEMORY
