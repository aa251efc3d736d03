// What capsules around edges leave free of the outlines of polygons with rims: straight pieces and arcs.

#include "capsule_cuts.h"
#include "edge_grid.h"
#include "kernel.h"

#include <algorithm>
#include <vector>

using namespace jamlab;

namespace {

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
        if (other.high.x < below.x || other.low.x > above.x || other.high.y < below.y || other.low.y > above.y)
          continue;
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
try {
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
JAMLAB_OR_NO_MEMORY
