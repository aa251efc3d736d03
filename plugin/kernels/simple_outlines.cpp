// This file tells which polygons may cross their own outline: almost all surely do not.

#include "kernel.h"
#include "nearest_foot.h"

#include <algorithm>
#include <vector>

using namespace jamlab;

namespace {

constexpr double SLACK = 1e-9;  // over the extent: what is nearer may touch

// Whether all vertices are seen from the middle one after the other, once around.
bool is_star(const std::vector<Vector> &ring)
{
  int around = 0;
  for (std::size_t i = 0; i < ring.size(); ++i) {
    const Vector &a = ring[i], &b = ring[i + 1 < ring.size() ? i + 1 : 0];
    const double turn = cross(a, b);
    if (!(turn > 0 && turn * turn > SLACK * SLACK * dot(a, a) * dot(b, b))) return false;
    around += a.y < 0 && b.y >= 0;
  }
  return around == 1;
}

bool is_near(const Vector &p, const Vector &a, const Vector &b, double slack)
{
  return !(foot_on_edge(p - a, b - a).rsq > slack * slack);
}

bool may_touch(const Vector &a, const Vector &b, const Vector &c, const Vector &d, double slack)
{
  return edges_cross(a, b, c, d) || is_near(a, c, d, slack) || is_near(b, c, d, slack) ||
         is_near(c, a, b, slack) || is_near(d, a, b, slack);
}

// Whether any two edges that share no vertex may touch, or an edge may lie upon the next.
bool is_suspect(const std::vector<Vector> &ring)
{
  const std::size_t n = ring.size();
  double extent = 0.0;
  for (const Vector &r : ring) extent = std::max(extent, size(r));
  const auto at = [&](std::size_t i) { return ring[i < n ? i : i - n]; };
  for (std::size_t i = 0; i < n; ++i) {
    const Vector a = at(i), b = at(i + 1), edge = b - a, next = at(i + 2) - b;
    const double turn = cross(edge, next), along = dot(edge, next);
    if (!(along > 0) && !(turn * turn > SLACK * SLACK * dot(edge, edge) * dot(next, next)))
      return true;
    for (std::size_t j = i + 2; j < n && j + 1 < n + i; ++j)
      if (may_touch(a, b, at(j), at(j + 1), SLACK * extent)) return true;
  }
  return false;
}

}  // namespace

// Polygons that may cross their own outline, or touch it, in ascending order: a few that do not,
// within rounding, are among them. Single points are none.
//   offsets (n + 1), x (vertices, 2); suspects (n) out.
// Returns their number.
JAMLAB_KERNEL suspect_outlines(int64_t n, const int64_t *offsets, const double *x,
                               int64_t *suspects)
try {
  int64_t count = 0;
  std::vector<Vector> ring;
  for (int64_t p = 0; p < n; ++p) {
    const int64_t first = offsets[p], vertices = offsets[p + 1] - first;
    if (vertices == 1) continue;
    ring.clear();
    Vector middle{0.0, 0.0};
    for (int64_t v = first; v < first + vertices; ++v) {
      ring.push_back(point(x, v) - point(x, first));
      middle += ring.back();
    }
    for (Vector &r : ring) r -= middle * (1.0 / static_cast<double>(vertices));
    if (!is_star(ring) && (vertices < 3 || is_suspect(ring))) suspects[count++] = p;
  }
  return count;
}
JAMLAB_OR_NO_MEMORY
