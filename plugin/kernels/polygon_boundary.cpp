// What capsules around edges leave free of the outlines of polygons with rims: straight pieces and arcs.

#include "kernel.h"
#include "periodic_grid.h"

#include <limits>

using namespace jamlab;

namespace {

constexpr double TURN = 6.283185307179586, NEAR = 1e-9, INFINITE = std::numeric_limits<double>::infinity();

struct Edges {
  int64_t count;
  const int64_t *particle;
  const double *tail, *length, *along, *normal;
  const int64_t *before, *after;
  const double *turn;
  double rim;

  Vector edge(int64_t e) const { return point(along, e) * length[e]; }
  double normal_angle(int64_t e) const { return std::atan2(normal[2 * e + 1], normal[2 * e]); }
};

struct Interval {
  double low, high;
  bool operator<(const Interval &other) const { return low < other.low; }
};

// What is covered of an element from 0 to its extent.
struct Cover {
  double extent;
  bool whole;
  std::vector<Interval> parts;

  void clear(double length)
  {
    extent = length;
    whole = !(length > 0);
    parts.clear();
  }
  void add(double low, double high)
  {
    low = std::max(low, 0.0);
    high = std::min(high, extent);
    if (!(low < high)) return;
    if (low == 0 && high == extent) whole = true;
    parts.push_back({low, high});
  }
};

struct Part {
  int64_t edge;
  double begin, end;
};

void keep_free_parts(int64_t edge, Cover &cover, std::vector<Part> &free)
{
  if (cover.whole) return;
  std::sort(cover.parts.begin(), cover.parts.end());
  double reached = 0.0;
  for (const Interval &part : cover.parts) {
    if (part.low > reached) free.push_back({edge, reached, part.low});
    reached = std::max(reached, part.high);
  }
  if (cover.extent > reached) free.push_back({edge, reached, cover.extent});
}

// Interval of s with lower < x + slope s < upper.
Interval cross_slab(double x, double slope, double lower, double upper)
{
  if (slope == 0) {
    const bool always = lower < x && x < upper;
    return {always ? -INFINITE : INFINITE, always ? INFINITE : -INFINITE};
  }
  const double a = (lower - x) / slope, b = (upper - x) / slope;
  return {std::min(a, b), std::max(a, b)};
}

// Part of the moved edge i in the capsule around edge j, whose tail lies at r from that of edge i: the capsule is the
// union of two disks around its ends and of a rectangle, and the part of a line in it is one interval.
void cut_line(const Edges &edges, int64_t i, int64_t j, const Vector &from_tail, Cover &cover)
{
  const double w = edges.rim, extent = edges.length[j];
  const Vector u = point(edges.along, i), v = point(edges.along, j);
  const Vector r = from_tail - point(edges.normal, i) * w;  // from the beginning of the moved edge
  const Vector ends[2] = {r, r + v * extent};
  const double place[2] = {dot(ends[0], u), dot(ends[1], u)}, aside[2] = {cross(u, ends[0]), cross(u, ends[1])};
  if ((aside[0] >= w && aside[1] >= w) || (aside[0] <= -w && aside[1] <= -w)) return;
  if ((place[0] <= -w && place[1] <= -w) || std::min(place[0], place[1]) >= edges.length[i] + w) return;
  double low = INFINITE, high = -INFINITE;
  for (int k = 0; k < 2; ++k) {
    const double half = std::sqrt(std::max((w - aside[k]) * (w + aside[k]), 0.0));
    if (!(half > 0)) continue;
    low = std::min(low, place[k] - half);
    high = std::max(high, place[k] + half);
  }
  const Interval x = cross_slab(-dot(r, v), dot(u, v), 0.0, extent), y = cross_slab(-cross(v, r), cross(v, u), -w, w);
  const double enter = std::max(x.low, y.low), leave = std::min(x.high, y.high);
  if (enter < leave) {
    low = std::min(low, enter);
    high = std::max(high, leave);
  }
  cover.add(low, high);
}

// Direction of the middle of the arc around the tail of edge i, and how far its ends are from there, in rims.
struct Arc {
  Vector middle;
  double chord;
  bool narrow;
};

Arc find_arc(const Edges &edges, int64_t i)
{
  const Vector sum = point(edges.normal, i) + point(edges.normal, edges.before[i]);
  const double cosine = 0.5 * size(sum);  // of half the turn
  if (!(cosine > 0.1)) return {sum, 2.0, false};
  return {sum * (0.5 / cosine), std::sqrt(std::max(2 - 2 * cosine, 0.0)), true};
}

// Part of the arc around the tail of edge i in the capsule around edge j.
//
// In the frame of the capsule, x along it, y >= 0 the distance of the corner from its line, and the angle psi counted
// from the direction straight at the line: the circle crosses the far side y = w of the capsule at +-beta,
// cos(beta) = y/w - 1, if it does so between its ends, else it crosses the disk around that end.
void cut_arc(const Edges &edges, int64_t i, int64_t j, const Vector &r, const Arc &arc, Cover &cover)
{
  const double w = edges.rim, length = edges.length[j];
  const Vector v = point(edges.along, j);
  if (arc.narrow) {  // most arcs lie in the capsule or outside as a whole
    const Vector middle = arc.middle * w - r;
    const double along = dot(middle, v), aside = cross(v, middle);
    const double beyond = along - std::min(std::max(along, 0.0), length), square = beyond * beyond + aside * aside;
    const double outer = w * (1 + arc.chord) * (1 + NEAR), inner = w * (1 - arc.chord) * (1 - NEAR);
    if (square > outer * outer) return;
    if (inner > 0 && square < inner * inner) return cover.add(0.0, cover.extent);
  }
  const double x = -dot(r, v), across = -cross(v, r), y = std::fabs(across);  // of the corner
  const double closest = std::min(std::max(x, 0.0), length);
  if (!(std::hypot(x - closest, y) < 2 * w)) return;
  const double side = across >= 0 ? 1.0 : -1.0, beta = std::acos(std::min(std::max(y / w - 1, -1.0), 1.0));
  double end[2];
  for (int k = 0; k < 2; ++k) {
    const double sign = k ? 1.0 : -1.0, crossing = x + sign * w * std::sin(beta);
    if (crossing >= 0 && crossing <= length) {
      end[k] = sign * beta;
      continue;
    }
    const double cap = crossing > length ? length : 0.0;
    end[k] = std::atan2(cap - x, y) + sign * std::acos(std::min(0.5 * std::hypot(cap - x, y) / w, 1.0));
  }
  const double low = side > 0 ? end[0] : -end[1], width = end[1] - end[0];
  const double zero = std::atan2(v.y, v.x) - 0.25 * TURN * side;
  double begin = std::fmod(zero + low - edges.normal_angle(edges.before[i]), TURN);
  if (begin < 0) begin += TURN;
  cover.add(begin, begin + width);  // an interval that runs through the beginning of the arc shows at both ends
  cover.add(begin - TURN, begin - TURN + width);
}

// Edges cut into segments of moderate length and sorted into bins: one long edge does not widen every search.
class EdgeGrid {
 public:
  int64_t refusal = 0;

  EdgeGrid(const Edges &all, const Lattice &space, double most_copies, double *search) : edges(all), lattice(space)
  {
    const int64_t m = edges.count;
    double longest = 0.0, sum = 0.0;
    for (int64_t e = 0; e < m; ++e) {
      longest = std::max(longest, edges.length[e]);
      sum += edges.length[e];
    }
    reach = 2 * edges.rim + 1e-14 * (2 * largest_coordinate(m, edges.tail) + lattice.longest);
    lattice.report(reach + longest, search);
    if (lattice.too_many_images(reach + longest, m, most_copies)) {
      refusal = TOO_MANY_IMAGES;
      return;
    }
    if (!locate_all(lattice, m, edges.tail, tails)) refusal = TOO_FAR;
    const double size = std::max(reach, sum / std::max<double>(m, 1));
    for (int64_t e = 0; e < m && !refusal; ++e) {
      const int64_t pieces = 1 + static_cast<int64_t>(edges.length[e] / size);
      for (int64_t k = 0; k < pieces; ++k) {
        Place place;
        const double middle = (k + 0.5) / pieces;
        if (!lattice.locate(point(edges.tail, e) + edges.edge(e) * middle, place)) refusal = TOO_FAR;
        segments.push_back({e, k, pieces});
        places.push_back(place);
      }
    }
    half = 0.5 * size;
    if (!refusal) grid.emplace_back(lattice, places, reach);
  }

  // Call visit(j, shift) for every edge j in an image that may come nearer to edge i than two rims; a few come twice.
  template <class Visit> void search(int64_t i, Visit &&visit) const
  {
    const Fractions own = in_cell(i);
    double low[2], high[2], wide_low[2], wide_high[2];
    for (int k = 0; k < 2; ++k) {
      low[k] = tails[i].f[k] + std::min(own.f[k], 0.0) - lattice.margin(reach, k);
      high[k] = tails[i].f[k] + std::max(own.f[k], 0.0) + lattice.margin(reach, k);
      wide_low[k] = low[k] - lattice.margin(half, k);
      wide_high[k] = high[k] + lattice.margin(half, k);
    }
    grid[0].search(wide_low, wide_high, [&](const PeriodicGrid::Entry &entry, const Image &image) {
      const Segment &segment = segments[entry.index];
      const double at[2] = {entry.f[0] + image.first, entry.f[1] + image.second};
      bool meets = true;
      for (int k = 0; k < 2; ++k) meets = meets && at[k] > wide_low[k] && at[k] < wide_high[k];
      if (!meets) return;
      const Fractions whole = in_cell(segment.edge);
      bool earlier = segment.number > 0;  // the segment before comes near as well: the edge comes with that
      for (int k = 0; k < 2; ++k) {
        const double step = whole.f[k] / segment.of, extent = 0.5 * std::fabs(step);
        meets = meets && at[k] + extent > low[k] && at[k] - extent < high[k];
        earlier = earlier && at[k] - step + extent > low[k] + NEAR && at[k] - step - extent < high[k] - NEAR;
      }
      if (meets && !earlier) visit(segment.edge, lattice.in_box(image + tails[i].wrap - places[entry.index].wrap));
    });
  }

 private:
  struct Segment {
    int64_t edge, number, of;
  };
  struct Fractions {
    double f[2];
  };

  const Edges &edges;
  const Lattice &lattice;
  double reach, half;
  std::vector<Place> tails, places;
  std::vector<Segment> segments;
  std::vector<PeriodicGrid> grid;  // one, or none

  Fractions in_cell(int64_t e) const
  {
    const Vector edge = edges.edge(e);
    return {{cross(edge, lattice.cell[1]) / lattice.determinant, cross(lattice.cell[0], edge) / lattice.determinant}};
  }
};

// Cut all edges and arcs; the polygons that cross, if any do.
bool cut_elements(const Edges &edges, const Lattice &lattice, const EdgeGrid &grid, const std::vector<char> &dented,
                  std::vector<Part> &lines, std::vector<Part> &arcs, int64_t *crossing)
{
  Cover line, arc;
  bool crossed = false;
  for (int64_t i = 0; i < edges.count && !crossed; ++i) {
    const Vector a = edges.edge(i);
    const Arc around = find_arc(edges, i);
    line.clear(edges.length[i]);
    arc.clear(edges.turn[i]);
    grid.search(i, [&](int64_t j, const Image &shift) {
      const bool own = edges.particle[i] == edges.particle[j] && shift.home();
      if (own && (i == j || !dented[edges.particle[i]])) return;
      const Vector r = point(edges.tail, j) - point(edges.tail, i) + lattice.translation(shift);
      const Vector b = edges.edge(j);
      if (!own && cross(a, r) * cross(a, r + b) < 0 && cross(b, r * -1.0) * cross(b, a - r) < 0) {
        crossed = true;
        crossing[0] = edges.particle[i];
        crossing[1] = edges.particle[j];
      }
      // neighbors on one polygon hide each other only at reflex corners; on an image of it they are like any others
      const bool before = own && j == edges.before[i], after = own && j == edges.after[i];
      const bool beside = (after && edges.turn[j] >= 0) || (before && edges.turn[i] >= 0);
      if (!line.whole && !beside) cut_line(edges, i, j, r, line);
      if (!arc.whole && !before) cut_arc(edges, i, j, r, around, arc);
    });
    keep_free_parts(i, line, lines);
    keep_free_parts(i, arc, arcs);
  }
  return crossed;
}

struct Drawn {
  Vector start, end, centre;
  double radius, begin, angle;
};

Drawn draw_line(const Edges &edges, const Part &part)
{
  const Vector tail = point(edges.tail, part.edge), along = point(edges.along, part.edge);
  const Vector aside = point(edges.normal, part.edge) * edges.rim;
  const Vector start = tail + (along * part.begin + aside), end = tail + (along * part.end + aside);
  return {start, end, (start + end) * 0.5, 0.0, 0.0, 0.0};
}

Drawn draw_arc(const Edges &edges, const Part &part)
{
  const Vector tail = point(edges.tail, part.edge);
  const double angle = edges.normal_angle(edges.before[part.edge]), w = edges.rim;
  const double from = angle + part.begin, to = angle + part.end;
  return {tail + Vector{std::cos(from), std::sin(from)} * w, tail + Vector{std::cos(to), std::sin(to)} * w, tail, w,
          from, part.end - part.begin};
}

}  // namespace

constexpr int64_t OUTLINES_CROSS = -3;

// Free pieces of the outlines of polygons grown by `rim`, first all straight ones, then all arcs.
//   particle to turn (m): see EdgeRings; box (2, 2); from owner to angle (room) out: see Pieces; following (room) out:
//   the piece that comes next on the same outline, -1 where another particle begins; crossing (2) out: polygons that
//   cross; search (5) out: see periodic_neighbors.
// Returns the number of pieces, written if there is room for all, or why there are none.
JAMLAB_KERNEL free_outlines(int64_t m, int64_t particles, const int64_t *particle, const double *tail,
                            const double *length, const double *along, const double *normal, const int64_t *before,
                            const int64_t *after, const double *turn, double rim, const double *box,
                            double most_copies, int64_t room, int64_t *owner, double *start, double *end,
                            double *centre, double *radius, double *begin, double *angle, int64_t *following,
                            int64_t *crossing, double *search)
{
  const Edges edges = {m, particle, tail, length, along, normal, before, after, turn, rim};
  const Lattice lattice(box);
  const EdgeGrid grid(edges, lattice, most_copies, search);
  if (grid.refusal) return grid.refusal;
  std::vector<char> dented(particles, 0);
  for (int64_t e = 0; e < m; ++e)
    if (turn[e] < 0) dented[particle[e]] = 1;
  std::vector<Part> lines, arcs;
  if (cut_elements(edges, lattice, grid, dented, lines, arcs, crossing)) return OUTLINES_CROSS;

  const int64_t straight = static_cast<int64_t>(lines.size()), count = straight + static_cast<int64_t>(arcs.size());
  if (count > room) return count;
  std::vector<int64_t> line_at_start(m, -1), arc_at_start(m, -1);
  for (int64_t k = 0; k < count; ++k) {
    const bool round = k >= straight;
    const Part &part = round ? arcs[k - straight] : lines[k];
    if (part.begin == 0) (round ? arc_at_start : line_at_start)[part.edge] = k;
    const Drawn drawn = round ? draw_arc(edges, part) : draw_line(edges, part);
    owner[k] = particle[part.edge];
    put(start, k, drawn.start);
    put(end, k, drawn.end);
    put(centre, k, drawn.centre);
    radius[k] = drawn.radius;
    begin[k] = drawn.begin;
    angle[k] = drawn.angle;
  }
  for (int64_t k = 0; k < count; ++k) {
    const bool round = k >= straight;
    const Part &part = round ? arcs[k - straight] : lines[k];
    const int64_t next = after[part.edge];
    following[k] = -1;
    if (part.end != (round ? turn : length)[part.edge]) continue;
    following[k] = round ? line_at_start[part.edge] : (turn[next] > 0 ? arc_at_start : line_at_start)[next];
  }
  return count;
}
