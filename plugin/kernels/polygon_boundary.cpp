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

// The arc around the tail of edge i: direction of its middle, and how far its ends are from there, in rims.
struct Arc {
  Vector first, middle;
  double chord;
  bool narrow;
};

Arc find_arc(const Edges &edges, int64_t i)
{
  const Vector first = point(edges.normal, edges.before[i]), sum = point(edges.normal, i) + first;
  const double cosine = 0.5 * size(sum);  // of half the turn
  if (!(cosine > 0.1)) return {first, sum, 2.0, false};
  return {first, sum * (0.5 / cosine), std::sqrt(std::max(2 - 2 * cosine, 0.0)), true};
}

double sine_to(double cosine) { return std::sqrt(std::max((1 - cosine) * (1 + cosine), 0.0)); }

// Direction in which the circle of radius w around the corner leaves the capsule, towards the end of sign * x.
//
// In the frame of the capsule, x along it and y >= 0 the distance of the corner from its line, directions are counted
// from the one straight at the line, (sine, cosine): the circle crosses the near side y = w of the capsule at +-beta,
// cos(beta) = y/w - 1, if it does so between its ends, else it crosses the disk around that end.
Vector leave_capsule(double x, double y, double length, double w, double sign)
{
  const double cosine = std::min(std::max(y / w - 1, -1.0), 1.0), sine = sine_to(cosine);
  const double crossing = x + sign * w * sine;
  if (crossing >= 0 && crossing <= length) return {sign * sine, cosine};
  const double aside = (crossing > length ? length : 0.0) - x, apart = std::sqrt(aside * aside + y * y);
  const Vector toward = apart > 0 ? Vector{aside / apart, y / apart} : Vector{0.0, 1.0};
  const double c = std::min(0.5 * apart / w, 1.0), s = sign * sine_to(c);
  return {toward.x * c + toward.y * s, toward.y * c - toward.x * s};
}

// Part of the arc around the tail of edge i in the capsule around edge j.
void cut_arc(const Edges &edges, int64_t j, const Vector &r, const Arc &arc, Cover &cover)
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
  const double beyond = x - std::min(std::max(x, 0.0), length), distance = std::sqrt(beyond * beyond + y * y);
  if (!(distance < 2 * w)) return;
  const double side = across >= 0 ? 1.0 : -1.0;
  const Vector down = {side * v.y, -side * v.x};
  double end[2];  // of the interval, counter-clockwise from the beginning of the arc
  for (int k = 0; k < 2; ++k) {
    const Vector local = leave_capsule(x, y, length, w, side * (k ? 1.0 : -1.0));
    const Vector direction = v * local.x + down * local.y;
    end[k] = std::atan2(cross(arc.first, direction), dot(arc.first, direction));
  }
  // the interval spans more than 2 pi/3 from nearer than w/2, and less than 4 pi/3 from further away
  double width = end[1] - end[0];
  if (width < (distance < 0.5 * w ? 1.0 : -1.0)) width += TURN;
  const double begin = end[0] < 0 ? end[0] + TURN : end[0];
  cover.add(begin, begin + width);  // an interval that runs through the beginning of the arc shows at both ends
  cover.add(begin - TURN, begin - TURN + width);
}

// An edge near a run of others, in the image that is near, and the box around it.
struct NearEdge {
  Vector low, high, shift;
  int64_t edge;
  bool own;  // of the same polygon, not of an image of it
};

// Edges cut into segments of moderate length and sorted into bins: one long edge does not widen every search.
class EdgeGrid {
 public:
  int64_t refusal = 0;
  double reach;  // two rims, and rounding

  EdgeGrid(const Edges &all, int64_t particles, const Lattice &space, double most_copies, double *search)
    : edges(all), lattice(space), dented(particles, 0)
  {
    double longest = 0.0, sum = 0.0;
    for (int64_t e = 0; e < edges.count; ++e) {
      longest = std::max(longest, edges.length[e]);
      sum += edges.length[e];
      if (edges.turn[e] < 0) dented[edges.particle[e]] = 1;
    }
    reach = 2 * edges.rim + 1e-14 * (2 * largest_coordinate(edges.count, edges.tail) + lattice.longest);
    lattice.report(reach + longest, search);
    if (lattice.too_many_images(reach + longest, edges.count, most_copies)) {
      refusal = TOO_MANY_IMAGES;
      return;
    }
    segment_size = std::max(reach, sum / std::max<double>(edges.count, 1));
    if (!place_segments()) refusal = TOO_FAR;
  }

  // Edges that may come nearer than two rims to those from `first` to `last` of one polygon; a few are listed twice.
  // Of the polygon itself only if it has dents, where alone one edge hides the outline of another.
  void find_near(int64_t first, int64_t last, std::vector<NearEdge> &near) const
  {
    const Place &origin = tails[first];
    double low[2], high[2], wide_low[2], wide_high[2];
    for (int k = 0; k < 2; ++k) {
      low[k] = high[k] = origin.f[k];
      for (int64_t i = first; i < last; ++i) {
        const Image moved = tails[i].wrap - origin.wrap;
        const Vector whole = lattice.fraction(edges.edge(i));
        const double tail = tails[i].f[k] + (k ? moved.second : moved.first), head = tail + (k ? whole.y : whole.x);
        low[k] = std::min(low[k], std::min(tail, head));
        high[k] = std::max(high[k], std::max(tail, head));
      }
      low[k] -= lattice.margin(reach, k);
      high[k] += lattice.margin(reach, k);
      wide_low[k] = low[k] - lattice.margin(0.5 * segment_size, k);
      wide_high[k] = high[k] + lattice.margin(0.5 * segment_size, k);
    }
    near.clear();
    const int64_t particle = edges.particle[first];
    grid[0].search(wide_low, wide_high, [&](const PeriodicGrid<Segment>::Entry &entry, const Image &image) {
      const Segment &segment = entry.item;
      const Image shift = image + origin.wrap - segment.wrap;
      const bool own = edges.particle[segment.edge] == particle && shift.home();
      if (own && !dented[particle]) return;
      const double at[2] = {entry.f[0] + image.first, entry.f[1] + image.second};
      for (int k = 0; k < 2; ++k)
        if (at[k] < wide_low[k] || at[k] > wide_high[k]) return;
      const Vector edge = edges.edge(segment.edge), step = lattice.fraction(edge) * (1.0 / segment.of);
      bool meets = true, earlier = segment.number > 0;  // the segment before comes near too: the edge comes with that
      for (int k = 0; k < 2; ++k) {
        const double along = k ? step.y : step.x, extent = 0.5 * std::fabs(along);
        meets = meets && at[k] + extent > low[k] && at[k] - extent < high[k];
        earlier = earlier && at[k] - along + extent > low[k] + NEAR && at[k] - along - extent < high[k] - NEAR;
      }
      if (!meets || earlier) return;
      const Vector moved = lattice.translation(lattice.in_box(shift)), tail = point(edges.tail, segment.edge) + moved;
      near.push_back({tail + Vector{std::min(edge.x, 0.0), std::min(edge.y, 0.0)},
                      tail + Vector{std::max(edge.x, 0.0), std::max(edge.y, 0.0)}, moved, segment.edge, own});
    });
  }

 private:
  struct Segment {
    int64_t edge;
    int32_t number, of;
    Image wrap;
  };

  const Edges &edges;
  const Lattice &lattice;
  std::vector<char> dented;
  double segment_size;
  std::vector<Place> tails;
  std::vector<PeriodicGrid<Segment>> grid;  // one, or none

  bool place_segments()
  {
    if (!locate_all(lattice, edges.count, edges.tail, tails)) return false;
    std::vector<Place> places;
    std::vector<Segment> segments;
    places.reserve(2 * edges.count);
    segments.reserve(2 * edges.count);
    for (int64_t e = 0; e < edges.count; ++e) {
      const int32_t pieces = 1 + static_cast<int32_t>(edges.length[e] / segment_size);
      for (int32_t k = 0; k < pieces; ++k) {
        Place place;
        if (!lattice.locate(point(edges.tail, e) + edges.edge(e) * ((k + 0.5) / pieces), place)) return false;
        segments.push_back({e, k, pieces, place.wrap});
        places.push_back(place);
      }
    }
    grid.emplace_back(lattice, places, segments, reach);
    return true;
  }
};

// Cut all edges and arcs; the polygons that cross, if any do.
bool cut_elements(const Edges &edges, const EdgeGrid &grid, std::vector<Part> &lines, std::vector<Part> &arcs,
                  int64_t *crossing)
{
  constexpr int64_t RUN = 32;  // edges in a row that are searched together
  std::vector<NearEdge> near;
  Cover line, arc;
  for (int64_t first = 0, last; first < edges.count; first = last) {
    for (last = first + 1; last < edges.count && last < first + RUN && edges.particle[last] == edges.particle[first];)
      ++last;
    grid.find_near(first, last, near);
    for (int64_t i = first; i < last; ++i) {
      const Vector tail = point(edges.tail, i), a = edges.edge(i);
      const Vector low = {std::min(a.x, 0.0) - grid.reach, std::min(a.y, 0.0) - grid.reach};
      const Vector high = {std::max(a.x, 0.0) + grid.reach, std::max(a.y, 0.0) + grid.reach};
      const Vector below = tail + low, above = tail + high;
      const Arc around = find_arc(edges, i);
      line.clear(edges.length[i]);
      arc.clear(edges.turn[i]);
      for (const NearEdge &other : near) {
        if (other.high.x < below.x || other.low.x > above.x || other.high.y < below.y || other.low.y > above.y) continue;
        const int64_t j = other.edge;
        if (other.own && i == j) continue;
        const Vector r = point(edges.tail, j) - tail + other.shift, b = edges.edge(j);
        if (!other.own && cross(a, r) * cross(a, r + b) < 0 && cross(b, r * -1.0) * cross(b, a - r) < 0) {
          crossing[0] = edges.particle[i];
          crossing[1] = edges.particle[j];
          return true;
        }
        // neighbors on one polygon hide each other only at reflex corners; on an image of it they are like any others
        const bool before = other.own && j == edges.before[i], after = other.own && j == edges.after[i];
        const bool beside = (after && edges.turn[j] >= 0) || (before && edges.turn[i] >= 0);
        if (!line.whole && !beside) cut_line(edges, i, j, r, line);
        if (!arc.whole && !before) cut_arc(edges, j, r, around, arc);
      }
      keep_free_parts(i, line, lines);
      keep_free_parts(i, arc, arcs);
    }
  }
  return false;
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
  const EdgeGrid grid(edges, particles, lattice, most_copies, search);
  if (grid.refusal) return grid.refusal;
  std::vector<Part> lines, arcs;
  lines.reserve(m);
  arcs.reserve(m);
  if (cut_elements(edges, grid, lines, arcs, crossing)) return OUTLINES_CROSS;

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
