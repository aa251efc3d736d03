// Which outlines of polygons are simple beyond doubt: no two of their edges cross or touch.

#include "kernel.h"
#include "vector.h"

#include <algorithm>
#include <vector>

using namespace jamlab;

namespace {

constexpr double DOUBT = 1e-13;  // of the squared size: cross products are certain to a hundredth of that
constexpr int64_t MOST_VERTICES = 2000;  // of an outline that is tested edge by edge

struct Ring {
  std::vector<Vector> corner, edge;
  double doubt;

  void read(const double *x, int64_t low, int64_t high)
  {
    corner.clear();
    edge.clear();
    Vector least = point(x, low), most = least;
    for (int64_t v = low; v < high; ++v) {
      corner.push_back(point(x, v));
      edge.push_back(point(x, v + 1 < high ? v + 1 : low) - corner.back());
      least = {std::min(least.x, corner.back().x), std::min(least.y, corner.back().y)};
      most = {std::max(most.x, corner.back().x), std::max(most.y, corner.back().y)};
    }
    doubt = DOUBT * dot(most - least, most - least);
  }
};

// Every corner turns to the left, and all together once around.
bool convex(const Ring &ring)
{
  const std::size_t v = ring.edge.size();
  int rounds = 0;
  for (std::size_t k = 0; k < v; ++k) {
    const Vector &edge = ring.edge[k], &next = ring.edge[k + 1 < v ? k + 1 : 0];
    if (!(cross(edge, next) > ring.doubt)) return false;
    rounds += edge.y < 0 && next.y >= 0;
  }
  return rounds == 1;
}

// Whether both ends of a segment lie on one side of a line, for certain.
bool beside(const Vector &from, const Vector &along, const Vector &a, const Vector &b, double doubt)
{
  const double one = cross(along, a - from), two = cross(along, b - from);
  return (one > doubt && two > doubt) || (one < -doubt && two < -doubt);
}

bool simple(const Ring &ring)
{
  const std::size_t v = ring.edge.size();
  for (std::size_t k = 0; k < v; ++k) {
    const Vector &edge = ring.edge[k], &next = ring.edge[k + 1 < v ? k + 1 : 0];
    if (!(std::fabs(cross(edge, next)) > ring.doubt || dot(edge, next) > ring.doubt)) return false;
  }
  for (std::size_t k = 0; k < v; ++k) {
    const Vector a = ring.corner[k], b = ring.corner[k + 1 < v ? k + 1 : 0];
    const double left = std::min(a.x, b.x), right = std::max(a.x, b.x);
    const double low = std::min(a.y, b.y), high = std::max(a.y, b.y);
    for (std::size_t m = k + 2; m < v - (k == 0); ++m) {
      const Vector &c = ring.corner[m], &d = ring.corner[m + 1 < v ? m + 1 : 0];
      if (std::max(c.x, d.x) < left || std::min(c.x, d.x) > right) continue;
      if (std::max(c.y, d.y) < low || std::min(c.y, d.y) > high) continue;
      if (beside(a, ring.edge[k], c, d, ring.doubt) || beside(c, ring.edge[m], a, b, ring.doubt)) continue;
      return false;
    }
  }
  return true;
}

}  // namespace

// Polygons that may cross or touch themselves, or that have edges too short to tell.
//   offsets (polygons + 1), x (vertices, 2); doubtful (polygons) out.
// Returns their number.
JAMLAB_KERNEL doubtful_outlines(int64_t polygons, const int64_t *offsets, const double *x, bool *doubtful)
try {
  int64_t count = 0;
  Ring ring;
  for (int64_t p = 0; p < polygons; ++p) {
    doubtful[p] = offsets[p + 1] - offsets[p] > MOST_VERTICES;
    if (!doubtful[p]) {
      ring.read(x, offsets[p], offsets[p + 1]);
      doubtful[p] = !convex(ring) && !simple(ring);
    }
    count += doubtful[p];
  }
  return count;
}
JAMLAB_OR_NO_MEMORY
