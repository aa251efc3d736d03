// Points that are neighbors in a periodic parallelogram, in every image.

#include "kernel.h"
#include "periodic_grid.h"

using namespace jamlab;

namespace {

struct Neighbor {
  int64_t j;
  Image shift;
  Vector r;
  bool operator<(const Neighbor &other) const { return j != other.j ? j < other.j : shift < other.shift; }
};

// Whether |r| < limit as `hypot` says it, which only matters within rounding of the limit.
bool nearer(const Vector &r, double limit)
{
  const double square = dot(r, r), bound = limit * limit;
  if (square > bound * (1 + 1e-14)) return false;
  return square < bound * (1 - 1e-14) || std::hypot(r.x, r.y) < limit;
}

}  // namespace

// Points of b, in every image, nearer to points of a than the sum of the reaches of both; sorted by i, j and shift.
//   a (n_a, 2), reach_a (n_a), b (n_b, 2), reach_b (n_b), box (2, 2); once: a and b are the same, list every pair once.
//   i, j (room), r (room, 2), shift (room, 2) out; search (5) out: reach of the search and reduced cell.
// Returns the number of neighbors, of which the first `room` are written, or why there are none.
JAMLAB_KERNEL periodic_neighbors(int64_t n_a, const double *a, const double *reach_a, int64_t n_b, const double *b,
                                 const double *reach_b, const double *box, int64_t once, double most_copies,
                                 int64_t room, int64_t *i, int64_t *j, double *r, int64_t *shift, double *search)
try {
  if (!n_a || !n_b) return 0;
  const Lattice lattice(box);
  const double rounding = 1e-14 * (largest_coordinate(n_a, a) + largest_coordinate(n_b, b) + lattice.longest);
  const double furthest = *std::max_element(reach_a, reach_a + n_a) + *std::max_element(reach_b, reach_b + n_b);
  lattice.report(furthest + rounding, search);
  if (lattice.too_many_images(furthest + rounding, n_b, most_copies)) return TOO_MANY_IMAGES;
  std::vector<Place> places_a, places_b;
  if (!locate_all(lattice, n_b, b, places_b)) return TOO_FAR;
  if (!once && !locate_all(lattice, n_a, a, places_a)) return TOO_FAR;
  const std::vector<Place> &from = once ? places_b : places_a;
  const PeriodicGrid<int64_t> grid(lattice, places_b, count_up(n_b), furthest + rounding);
  const double most_b = *std::max_element(reach_b, reach_b + n_b);

  std::vector<Neighbor> near;
  int64_t count = 0;
  for (int64_t k = 0; k < n_a; ++k) {
    const Place &place = from[k];
    const double reach = reach_a[k] + most_b + rounding;
    double low[2], high[2];
    for (int axis = 0; axis < 2; ++axis) {
      low[axis] = place.f[axis] - lattice.margin(reach, axis);
      high[axis] = place.f[axis] + lattice.margin(reach, axis);
    }
    near.clear();
    grid.search(low, high, [&](const PeriodicGrid<int64_t>::Entry &entry, const Image &image) {
      if (once && entry.item < k) return;
      const Vector apart = lattice.cell[0] * (entry.f[0] + image.first - place.f[0]) +
                           lattice.cell[1] * (entry.f[1] + image.second - place.f[1]);
      if (dot(apart, apart) > reach * reach * (1 + 1e-14)) return;
      const Image moved = lattice.in_box(image + place.wrap - places_b[entry.item].wrap);
      if (once && entry.item == k && !moved.positive()) return;
      const Vector vector = point(b, entry.item) - point(a, k) + lattice.translation(moved);
      if (nearer(vector, reach_a[k] + reach_b[entry.item])) near.push_back({entry.item, moved, vector});
    });
    std::sort(near.begin(), near.end());
    for (const Neighbor &found : near) {
      if (count < room) {
        i[count] = k;
        j[count] = found.j;
        put(r, count, found.r);
        shift[2 * count] = found.shift.first;
        shift[2 * count + 1] = found.shift.second;
      }
      ++count;
    }
  }
  return count;
}
JAMLAB_OR_NO_MEMORY
