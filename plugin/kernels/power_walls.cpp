// This file cuts the periodic plane into power cells of points.
//
// The cell of a point starts as the Voronoi cell of the lattice, since images of the point bound
// it, and is cut by the radical lines of the nearest points, then of all that can reach the rest.

#include "kernel.h"
#include "edge_rings.h"

#include <memory>

using namespace jamlab;

namespace {

struct Neighbor {
  int64_t j;
  Image shift;
  Vector r;       // from the point
  double square;  // r^2
  double limit;   // the cell lies where x . r < limit
};

// A convex cell around a point; side k runs from corner k to the next.
class Cell {
 public:
  struct Corner {
    Vector at;
    int64_t side;  // number of the neighbor beyond the side that begins here
  };
  std::vector<Corner> corners;

  void start(double half)
  {
    corners = {{{-half, -half}, -1}, {{half, -half}, -1}, {{half, half}, -1}, {{-half, half}, -1}};
  }

  // Keeps what lies on this side of the radical line to a neighbor. Returns whether that cuts.
  bool cut(const Neighbor &by, int64_t number)
  {
    const std::size_t n = corners.size();
    if (beyond.size() < n + 1) beyond.resize(2 * n + 2);
    bool any = false;
    for (std::size_t k = 0; k < n; ++k) {
      beyond[k] = dot(corners[k].at, by.r) - by.limit;
      any |= beyond[k] > 0;
    }
    if (!any) return false;
    beyond[n] = beyond[0];
    kept.resize(n + 1);
    std::size_t count = 0;
    for (std::size_t k = 0; k < n; ++k) {
      const bool within = beyond[k] <= 0;
      const Corner &a = corners[k];
      if (within) kept[count++] = a;
      if (within == (beyond[k + 1] <= 0)) continue;
      const Vector &end = corners[k + 1 < n ? k + 1 : 0].at;
      const Vector at = a.at + (end - a.at) * (beyond[k] / (beyond[k] - beyond[k + 1]));
      kept[count++] = {at, within ? number : a.side};
    }
    kept.resize(count);
    corners.swap(kept);
    return true;
  }

 private:
  std::vector<Corner> kept;
  std::vector<double> beyond;
};

class PowerCells {
 public:
  PowerCells(int64_t n, const double *x, const double *radius, const double *box)
    : n(n), x(x), radius(radius), lattice(box)
  {}

  bool locate()
  {
    if (!locate_all(lattice, n, x, places)) return false;
    grid = std::make_unique<PeriodicGrid>(lattice, places, 0.0);
    largest = *std::max_element(radius, radius + n);
    of_lattice.start(size(lattice.cell[0]) + size(lattice.cell[1]));
    for (int64_t first = -1; first <= 1; ++first)
      for (int64_t second = -1; second <= 1; ++second) {
        if (!first && !second) continue;
        const Image shift = lattice.in_box({first, second});
        const Vector r = lattice.translation(shift);
        images.push_back({0, shift, r, dot(r, r), 0.5 * dot(r, r)});
        of_lattice.cut(images.back(), static_cast<int64_t>(images.size()) - 1);
      }
    spread = std::sqrt(std::fabs(cross(lattice.cell[0], lattice.cell[1])) / static_cast<double>(n));
    return true;
  }

  // Cuts the cell of a point. Returns false if that takes too many images.
  bool cut_cell(int64_t a, double most_copies)
  {
    neighbors = images;
    cell.corners = of_lattice.corners;
    for (Neighbor &image : neighbors) image.j = a;
    cut_by_nearest(a, {{-spread, -spread}, {spread, spread}});
    if (cell.corners.empty()) return true;
    for (double reach = 3 * spread; !cell.corners.empty(); reach *= 3) {
      const Bounds all = bounds_of_cutting(a), near{{-reach, -reach}, {reach, reach}};
      const Bounds some = all.common(near);
      if (lattice.too_many_images(size(some.high - some.low), 1, most_copies)) return false;
      cut_by_all(a, some);
      if (near.holds(all, 0.0)) break;
    }
    return true;
  }

  // The corner in which two sides meet, from the radical lines of their neighbors.
  Vector corner(std::size_t k) const
  {
    const std::size_t m = cell.corners.size();
    const Neighbor &b = neighbors[cell.corners[k ? k - 1 : m - 1].side];
    const Neighbor &c = neighbors[cell.corners[k].side];
    const double det = cross(b.r, c.r);
    if (!(det > 1e-14 * std::sqrt(b.square * c.square))) return cell.corners[k].at;
    return (Vector{c.r.y, -c.r.x} * b.limit + Vector{-b.r.y, b.r.x} * c.limit) * (1 / det);
  }

  Cell cell;
  std::vector<Neighbor> neighbors;

 private:
  struct Candidate {
    double square;
    int64_t b;
    Image image;
    bool operator<(const Candidate &other) const
    {
      if (square != other.square) return square < other.square;
      return b != other.b ? b < other.b : image < other.image;
    }
  };
  const int64_t n;
  const double *x, *radius;
  const Lattice lattice;
  double largest = 0.0, spread = 0.0;  // of radii; mean distance of points
  std::vector<Place> places;
  std::unique_ptr<PeriodicGrid> grid;
  Cell of_lattice;                // of a point that only its images bound
  std::vector<Neighbor> images;   // these
  std::vector<Candidate> nearby;

  void cut(int64_t a, int64_t b, const Image &shift)
  {
    const Vector r = point(x, b) - point(x, a) + lattice.translation(shift);
    const double square = dot(r, r);
    const double limit = 0.5 * (square + (radius[a] - radius[b]) * (radius[a] + radius[b]));
    if (square == 0 && limit == 0 && b < a) cell.corners.clear();  // of two in one place one stays
    const Neighbor by{b, shift, r, square, limit};
    if (cell.cut(by, static_cast<int64_t>(neighbors.size()))) neighbors.push_back(by);
  }

  // A point cuts a corner off if its power to the corner is less than that of a.
  Bounds bounds_of_cutting(int64_t a) const
  {
    Bounds all{{0.0, 0.0}, {0.0, 0.0}};
    for (const Cell::Corner &corner : cell.corners) {
      const double more = (largest - radius[a]) * (largest + radius[a]);
      const double reach = std::sqrt(std::max(dot(corner.at, corner.at) + more, 0.0));
      all.include(corner.at - Vector{reach, reach});
      all.include(corner.at + Vector{reach, reach});
    }
    return all;
  }

  bool is_cut_by(int64_t b, const Image &shift) const
  {
    return std::any_of(neighbors.begin(), neighbors.end(), [&](const Neighbor &known) {
      return known.j == b && known.shift == shift;
    });
  }

  // Calls visit(entry, image, apart) for all points in a rectangle around a.
  template <class Visit>
  void search(int64_t a, const Bounds &around, Visit visit) const
  {
    const Place &place = places[a];
    double from[2] = {INFINITY, INFINITY}, to[2] = {-INFINITY, -INFINITY};
    for (const Vector &p : {around.low, around.high, Vector{around.low.x, around.high.y},
                            Vector{around.high.x, around.low.y}}) {
      const Vector whole = lattice.fraction(p);
      const double f[2] = {whole.x, whole.y};
      for (int axis = 0; axis < 2; ++axis) {
        from[axis] = std::min(from[axis], place.f[axis] + f[axis] - 1e-9);
        to[axis] = std::max(to[axis], place.f[axis] + f[axis] + 1e-9);
      }
    }
    grid->search(from, to, [&](const PeriodicGrid::Entry &entry, const Image &image) {
      visit(entry.number, image,
            lattice.cell[0] * (entry.f[0] + static_cast<double>(image.first) - place.f[0]) +
                lattice.cell[1] * (entry.f[1] + static_cast<double>(image.second) - place.f[1]));
    });
  }

  Image shift_of(int64_t a, int64_t b, const Image &image) const
  {
    return lattice.in_box(image + places[a].wrap - places[b].wrap);
  }

  void cut_by_nearest(int64_t a, const Bounds &around)
  {
    nearby.clear();
    search(a, around, [&](int64_t b, const Image &image, const Vector &apart) {
      if (b != a) nearby.push_back({dot(apart, apart), b, image});
    });
    std::sort(nearby.begin(), nearby.end());
    for (const Candidate &near : nearby) cut(a, near.b, shift_of(a, near.b, near.image));
  }

  void cut_by_all(int64_t a, const Bounds &around)
  {
    const double slack = 1e-9 * spread * spread, own = radius[a] * radius[a];
    search(a, around, [&](int64_t b, const Image &image, const Vector &apart) {
      const double limit = 0.5 * (dot(apart, apart) + own - radius[b] * radius[b]) - slack;
      for (const Cell::Corner &corner : cell.corners) {
        if (!(dot(corner.at, apart) > limit)) continue;
        const Image shift = shift_of(a, b, image);
        if (b != a && !is_cut_by(b, shift)) cut(a, b, shift);
        return;
      }
    });
  }
};

}  // namespace

// Walls between the power cells of points in a periodic box.
//   x (n, 2), radius (n), box (2, 2); owner (n): walls between points of one owner are left out;
//   area (n) out; i, j (room), shift (room, 2), height, length (room), ends (room, 2, 2) out: walls
//   seen from i, with j beyond, where ends lie beside i.
// Returns the number of walls, of which the first `room` are written, or why there are none.
JAMLAB_KERNEL power_walls(int64_t n, const double *x, const double *radius, const int64_t *owner,
                          const double *box, double most_copies, int64_t room, double *area,
                          int64_t *i, int64_t *j, int64_t *shift, double *height, double *length,
                          double *ends, double *search)
try {
  PowerCells cells(n, x, radius, box);
  Lattice(box).report(0.0, search);
  if (!cells.locate()) return TOO_FAR;
  int64_t count = 0;
  std::vector<Vector> corners;
  for (int64_t a = 0; a < n; ++a) {
    area[a] = 0.0;
    if (!cells.cut_cell(a, most_copies)) return TOO_MANY_IMAGES;
    const std::size_t m = cells.cell.corners.size();
    corners.resize(m);
    for (std::size_t k = 0; k < m; ++k) corners[k] = cells.corner(k);
    for (std::size_t k = 0; k < m; ++k) {
      const Neighbor &by = cells.neighbors[cells.cell.corners[k].side];
      const Vector &p = corners[k], &q = corners[k + 1 < m ? k + 1 : 0];
      const double distance = std::sqrt(by.square), wall = cross(by.r, q - p) / distance;
      area[a] += 0.5 * by.limit / distance * wall;
      if (owner[a] == owner[by.j] && by.shift.home()) continue;
      if (count < room) {
        i[count] = a;
        j[count] = by.j;
        shift[2 * count] = by.shift.first;
        shift[2 * count + 1] = by.shift.second;
        height[count] = by.limit / distance;
        length[count] = wall;
        put(ends, 2 * count, point(x, a) + p);
        put(ends, 2 * count + 1, point(x, a) + q);
      }
      ++count;
    }
  }
  return count;
}
JAMLAB_OR_NO_MEMORY
