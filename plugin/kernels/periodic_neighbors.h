// This is the search for points that are neighbors in a periodic parallelogram, in every image.
#pragma once

#include "periodic_grid.h"

namespace jamlab {

// Point j in the image `shift` lies at the vector r from point i.
struct Neighbor {
  int64_t i, j;
  Image shift;
  Vector r;
  bool operator<(const Neighbor &other) const
  {
    return j != other.j ? j < other.j : shift < other.shift;
  }
};

// Each of these points (n, 2) reaches some way (n).
struct Reaching {
  int64_t n;
  const double *points, *reach;
  double furthest() const { return *std::max_element(reach, reach + n); }
  double mean() const { return std::accumulate(reach, reach + n, 0.0) / static_cast<double>(n); }
};

// Returns whether |r| < limit by `hypot`, which only matters within rounding of the limit.
inline bool nearer(const Vector &r, double limit)
{
  const double square = dot(r, r), bound = limit * limit;
  if (square > bound * (1 + 1e-14)) return false;
  return square < bound * (1 - 1e-14) || std::hypot(r.x, r.y) < limit;
}

// Calls act(neighbor) for all points of b that are nearer to points of a than the sum of both
// reaches, sorted by i, j and shift. `once`: a and b are the same, and every pair is listed once.
// search (5) returns the reach of the search and the reduced cell. Returns 0, or a Refusal.
template <class Act>
int64_t visit_neighbors(const Reaching &a, const Reaching &b, const Lattice &lattice, bool once,
                        double most_copies, double *search, Act act)
{
  const double rounding = 1e-14 * (largest_coordinate(a.n, a.points) +
                                   largest_coordinate(b.n, b.points) + lattice.longest);
  const double most_b = b.furthest(), furthest = a.furthest() + most_b + rounding;
  lattice.report(furthest, search);
  if (lattice.too_many_images(furthest, b.n, most_copies)) return TOO_MANY_IMAGES;
  std::vector<Place> places_a, places_b;
  if (!locate_all(lattice, b.n, b.points, places_b)) return TOO_FAR;
  if (!once && !locate_all(lattice, a.n, a.points, places_a)) return TOO_FAR;
  const PeriodicGrid grid(lattice, places_b, a.mean() + most_b);

  std::vector<Neighbor> near;
  for (int64_t k = 0; k < a.n; ++k) {
    const Place &place = (once ? places_b : places_a)[k];
    const double reach = a.reach[k] + most_b + rounding;
    double low[2], high[2];
    for (int axis = 0; axis < 2; ++axis) {
      low[axis] = place.f[axis] - lattice.margin(reach, axis);
      high[axis] = place.f[axis] + lattice.margin(reach, axis);
    }
    near.clear();
    grid.search(low, high, [&](const PeriodicGrid::Entry &entry, const Image &image) {
      const int64_t j = entry.number;
      if (once && j < k) return;
      const Vector apart = lattice.cell[0] * (entry.f[0] + image.first - place.f[0]) +
                           lattice.cell[1] * (entry.f[1] + image.second - place.f[1]);
      if (dot(apart, apart) > reach * reach * (1 + 1e-14)) return;
      const Image moved = lattice.in_box(image + place.wrap - places_b[j].wrap);
      if (once && j == k && !moved.positive()) return;
      const Vector r = point(b.points, j) - point(a.points, k) + lattice.translation(moved);
      if (nearer(r, a.reach[k] + b.reach[j])) near.push_back({k, j, moved, r});
    });
    std::sort(near.begin(), near.end());
    for (const Neighbor &found : near) act(found);
  }
  return 0;
}

}  // namespace jamlab
