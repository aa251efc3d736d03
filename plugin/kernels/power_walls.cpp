// This file cuts the periodic plane into power cells of points.
//
// The cell of a point starts as the Voronoi cell of the lattice, since images of the point bound
// it, and is cut by the radical lines of the nearest points, then of all that can reach the rest.
//
// Points without radius that follow each other counter-clockwise around an outline make a ring.
// Inside a ring every place is nearest to one of its points if each point of another owner is
// outside, and further from the points of the ring than these are from each other; walls between
// its points do not matter. So only the outer parts of the cells of a ring are cut, on the outer
// side of the line through the middles between a point and the two beside it.

#include "kernel.h"
#include "edge_rings.h"

#include <memory>

using namespace jamlab;

namespace {

constexpr double CLOSED = 1e-9;  // of the box: rounding leaves 1e-15, a ring left out more

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

// The points of one owner, in order.
struct Ring {
  int64_t begin, end;
  int64_t before(int64_t a) const { return a > begin ? a - 1 : end - 1; }
  int64_t after(int64_t a) const { return a + 1 < end ? a + 1 : begin; }
};

class PowerCells {
 public:
  PowerCells(int64_t n, const double *x, const double *radius, const int64_t *owner,
             const double *box)
    : n(n), x(x), radius(radius), owner(owner), lattice(box)
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
    find_rings();
    return true;
  }

  // The points of one owner, counter-clockwise around an outline, or none.
  const std::vector<Ring> &outlines() const { return rings; }

  bool own(int64_t a, const Neighbor &by) const { return own(a, by.j, by.shift); }

  // Cuts what lies outside of a ring of the cell of one of its points. Returns false if points
  // are too near to know that the walls of its owner all lie there.
  bool cut_outer_part(int64_t a, const Ring &ring, double most_copies)
  {
    const Vector p = point(x, ring.before(a)) - point(x, a);
    const Vector q = point(x, ring.after(a)) - point(x, a);
    const double length = size(q - p);
    if (!(length > 0)) return false;
    const Vector out = Vector{(q - p).y, (p - q).x} * (1 / length);
    const double lowest = std::min({0.0, 0.5 * dot(p, out), 0.5 * dot(q, out)}) - 1e-3 * gap[a];
    start(a);
    const int64_t inner = static_cast<int64_t>(neighbors.size());
    if (cell.cut({a, {0, 0}, out * -1.0, 1.0, -lowest}, inner))
      neighbors.push_back({a, {0, 0}, out * -1.0, 1.0, -lowest});
    cut(a, ring.before(a), {0, 0});
    cut(a, ring.after(a), {0, 0});
    const double reach = std::max(spread, largest_gap * (1 + 1e-6));
    if (!cut_by_nearest(a, {{-reach, -reach}, {reach, reach}}, &ring)) return false;
    if (!cut_the_rest(a, reach, most_copies)) return false;
    const std::size_t m = cell.corners.size();
    for (std::size_t k = 0; k < m; ++k) {
      const int64_t side = cell.corners[k].side, next = cell.corners[k + 1 < m ? k + 1 : 0].side;
      if (side == inner && !own(a, neighbors[next])) return false;
      if (next == inner && !own(a, neighbors[side])) return false;
    }
    return true;
  }

  // Cuts the cell of a point. Returns false if that takes too many images.
  bool cut_cell(int64_t a, double most_copies)
  {
    start(a);
    cut_by_nearest(a, {{-spread, -spread}, {spread, spread}}, nullptr);
    return cut_the_rest(a, spread, most_copies);
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
    Image shift;
    bool operator<(const Candidate &other) const
    {
      if (square != other.square) return square < other.square;
      return b != other.b ? b < other.b : shift < other.shift;
    }
  };
  const int64_t n;
  const double *x, *radius;
  const int64_t *owner;
  const Lattice lattice;
  double largest = 0.0, spread = 0.0;  // of radii; mean distance of points
  std::vector<Place> places;
  std::unique_ptr<PeriodicGrid> grid;
  Cell of_lattice;                // of a point that only its images bound
  std::vector<Neighbor> images;   // these
  std::vector<Candidate> nearby;
  std::vector<Ring> rings;
  std::vector<double> gap;   // (n), from each point of a ring to the farther one beside it
  double largest_gap = 0.0;

  // Points make rings if each owner has its points in a row, four or more, without radius.
  void find_rings()
  {
    for (int64_t begin = 0, end = 0; begin < n; begin = end) {
      while (end < n && owner[end] == owner[begin]) ++end;
      if (end < n && owner[end] < owner[begin]) return rings.clear();
      rings.push_back({begin, end});
    }
    gap.resize(n);
    for (const Ring &ring : rings) {
      double twice = 0.0;
      for (int64_t a = ring.begin; a < ring.end; ++a) {
        const Vector after = point(x, ring.after(a)) - point(x, a);
        gap[a] = std::max(size(after), size(point(x, ring.before(a)) - point(x, a)));
        largest_gap = std::max(largest_gap, gap[a]);
        twice += cross(point(x, a) - point(x, ring.begin), after);
        if (radius[a] != 0) return rings.clear();
      }
      if (ring.end - ring.begin < 4 || !(twice > 0)) return rings.clear();
    }
  }

  bool own(int64_t a, int64_t b, const Image &shift) const
  {
    return owner[a] == owner[b] && shift.home();
  }

  // Whether a point is so near to one of a ring that it may have walls with it inside.
  bool too_near(int64_t a, const Ring &ring, int64_t b, const Image &shift, double square) const
  {
    double most = largest_gap;
    if (own(a, b, shift)) {
      if (b == ring.before(a) || b == ring.after(a)) return false;
      most = std::max(gap[b], 0.5 * (gap[a] + gap[b]));
    }
    return square < most * most * (1 + 1e-9);
  }

  void start(int64_t a)
  {
    neighbors = images;
    cell.corners = of_lattice.corners;
    for (Neighbor &image : neighbors) image.j = a;
  }

  // Cuts by all points beyond a rectangle. Returns false if that takes too many images.
  bool cut_the_rest(int64_t a, double reach, double most_copies)
  {
    while (!cell.corners.empty()) {
      const Bounds all = bounds_of_cutting(a);
      if (Bounds{{-reach, -reach}, {reach, reach}}.holds(all, 0.0)) break;
      reach *= 3;
      const Bounds some = all.common({{-reach, -reach}, {reach, reach}});
      if (lattice.too_many_images(size(some.high - some.low), 1, most_copies)) return false;
      cut_by_all(a, some);
    }
    return true;
  }

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

  // Returns false if one is too near to a point of a ring.
  bool cut_by_nearest(int64_t a, const Bounds &around, const Ring *ring)
  {
    nearby.clear();
    bool free = true;
    search(a, around, [&](int64_t b, const Image &image, const Vector &apart) {
      if (b == a && image.home()) return;
      const double square = dot(apart, apart);
      const Image shift = shift_of(a, b, image);
      if (ring) {
        free &= !too_near(a, *ring, b, shift, square);
        if (own(a, b, shift) && (b == ring->before(a) || b == ring->after(a))) return;
      }
      if (b != a) nearby.push_back({square, b, shift});
    });
    if (!free) return false;
    std::sort(nearby.begin(), nearby.end());
    for (const Candidate &near : nearby) cut(a, near.b, near.shift);
    return true;
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

// Walls, as they are written out.
class Walls {
 public:
  const int64_t room;
  int64_t *i, *j, *shift;
  double *height, *length, *ends;
  int64_t count = 0;

  void add(int64_t a, const Neighbor &by, double high, double wall, const Vector &p,
           const Vector &q)
  {
    if (count < room) {
      i[count] = a;
      j[count] = by.j;
      shift[2 * count] = by.shift.first;
      shift[2 * count + 1] = by.shift.second;
      height[count] = high;
      length[count] = wall;
      put(ends, 2 * count, p);
      put(ends, 2 * count + 1, q);
    }
    ++count;
  }
};

// Adds the walls of the cell of a point but for those with its owner. Returns its area; of a part
// outside of a ring, what the walls give to the area within them about a place.
double add_walls(const PowerCells &cells, int64_t a, const Vector &at, const Vector *about,
                 Walls &walls)
{
  const std::size_t m = cells.cell.corners.size();
  double area = 0.0;
  for (std::size_t k = 0; k < m; ++k) {
    const Neighbor &by = cells.neighbors[cells.cell.corners[k].side];
    const bool own = cells.own(a, by);
    if (own && about) continue;
    const Vector p = cells.corner(k), q = cells.corner(k + 1 < m ? k + 1 : 0);
    const double distance = std::sqrt(by.square), wall = cross(by.r, q - p) / distance;
    const double high = by.limit / distance;
    area += about ? 0.5 * cross(at - *about + p, q - p) : 0.5 * high * wall;
    if (!own) walls.add(a, by, high, wall, at + p, at + q);
  }
  return area;
}

}  // namespace

// Walls between the power cells of points in a periodic box.
//   x (n, 2), radius (n), box (2, 2); owner (n): walls between points of one owner are left out;
//   area (n) out: of cells, or parts whose sum over the points of an owner is that of its cells;
//   i, j (room), shift (room, 2), height, length (room), ends (room, 2, 2) out: walls seen from i,
//   with j beyond, where ends lie beside i.
// Returns the number of walls, of which the first `room` are written, or why there are none.
JAMLAB_KERNEL power_walls(int64_t n, const double *x, const double *radius, const int64_t *owner,
                          const double *box, double most_copies, int64_t room, double *area,
                          int64_t *i, int64_t *j, int64_t *shift, double *height, double *length,
                          double *ends, double *search)
try {
  PowerCells cells(n, x, radius, owner, box);
  Walls walls{room, i, j, shift, height, length, ends};
  Lattice(box).report(0.0, search);
  if (!cells.locate()) return TOO_FAR;
  const auto whole = [&](int64_t begin, int64_t end) {
    for (int64_t a = begin; a < end; ++a) {
      if (!cells.cut_cell(a, most_copies)) return false;
      area[a] = add_walls(cells, a, point(x, a), nullptr, walls);
    }
    return true;
  };
  const auto outer = [&](const Ring &ring) {
    const Vector about = point(x, ring.begin);
    for (int64_t a = ring.begin; a < ring.end; ++a) {
      if (!cells.cut_outer_part(a, ring, most_copies)) return false;
      area[a] = add_walls(cells, a, point(x, a), &about, walls);
    }
    return true;
  };
  for (const Ring &ring : cells.outlines()) {
    const int64_t before = walls.count;
    if (outer(ring)) continue;
    walls.count = before;
    if (!whole(ring.begin, ring.end)) return TOO_MANY_IMAGES;
  }
  // rings inside others have walls that are known from one side alone
  const double box_area = std::fabs(cross(point(box, 0), point(box, 1)));
  const double found = cells.outlines().empty() ? 0.0 : std::accumulate(area, area + n, 0.0);
  if (std::fabs(found - box_area) <= CLOSED * box_area) return walls.count;
  walls.count = 0;
  return whole(0, n) ? walls.count : TOO_MANY_IMAGES;
}
JAMLAB_OR_NO_MEMORY
