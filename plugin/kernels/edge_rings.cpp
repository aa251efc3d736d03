// Rings of edges around polygons, without edges of zero length.

#include "kernel.h"
#include "vector.h"

using namespace jamlab;

// Edges longer than `shortest` of the perimeter, of polygons in turn; see EdgeRings for what is written.
//   offsets (polygons + 1), x (vertices, 2); the arrays out have room for as many edges as vertices.
// Returns the number of edges.
JAMLAB_KERNEL edge_rings(int64_t polygons, const int64_t *offsets, const double *x, double shortest, int64_t *particle,
                         double *tail, double *length, double *along, double *normal, int64_t *before, int64_t *after,
                         double *turn)
try {
  int64_t m = 0;
  for (int64_t p = 0; p < polygons; ++p) {
    const int64_t low = offsets[p], high = offsets[p + 1], first = m;
    double perimeter = 0.0;
    for (int64_t v = low; v < high; ++v) perimeter += size(point(x, v + 1 < high ? v + 1 : low) - point(x, v));
    for (int64_t v = low; v < high; ++v) {
      const Vector here = point(x, v);
      if (!(size(point(x, v + 1 < high ? v + 1 : low) - here) > shortest * perimeter)) continue;
      particle[m] = p;
      put(tail, m, here);
      before[m] = m - 1;
      after[m] = m + 1;
      ++m;
    }
    if (m == first) continue;
    before[first] = m - 1;
    after[m - 1] = first;
    for (int64_t e = first; e < m; ++e) {
      const Vector edge = point(tail, after[e]) - point(tail, e);
      length[e] = size(edge);
      const Vector unit = {edge.x / length[e], edge.y / length[e]};
      put(along, e, unit);
      put(normal, e, {unit.y, -unit.x});
    }
    for (int64_t e = first; e < m; ++e) {
      const Vector arriving = point(along, before[e]), leaving = point(along, e);
      turn[e] = std::atan2(cross(arriving, leaving), dot(arriving, leaving));
    }
  }
  return m;
}
JAMLAB_OR_NO_MEMORY
