#include "edge_rings.h"

#include "kernel.h"

namespace jamlab {

namespace {

// Of the perimeter. Rounding of the vertices (1e-16) leaves such an edge a direction to 1e-4.
constexpr double SHORTEST = 1e-12;

}  // namespace

EdgeRings::EdgeRings(int64_t count, const int64_t *offsets, const double *x)
  : n(count), around(count), dented(count, 0)
{
  edges.reserve(offsets[n]);
  for (int64_t p = 0; p < n; ++p) {
    first.push_back(static_cast<int64_t>(edges.size()));
    add(p, offsets[p], offsets[p + 1], x);
  }
  first.push_back(static_cast<int64_t>(edges.size()));
}

void EdgeRings::add(int64_t polygon, int64_t low, int64_t high, const double *x)
{
  const auto after = [&](int64_t v) { return point(x, v + 1 < high ? v + 1 : low); };
  double perimeter = 0.0;
  for (int64_t v = low; v < high; ++v) perimeter += size(after(v) - point(x, v));
  const int64_t begin = static_cast<int64_t>(edges.size());
  for (int64_t v = low; v < high; ++v)
    if (size(after(v) - point(x, v)) > SHORTEST * perimeter)
      edges.push_back({polygon, 0, 0, point(x, v), {}, {}, 0.0, 0.0});
  const int64_t end = static_cast<int64_t>(edges.size());
  for (int64_t e = begin; e < end; ++e) {
    RimEdge &edge = edges[e];
    edge.before = e > begin ? e - 1 : end - 1;
    edge.after = e + 1 < end ? e + 1 : begin;
    const Vector whole = edges[edge.after].tail - edge.tail;
    edge.length = size(whole);
    edge.along = whole * (1 / edge.length);
    edge.normal = {edge.along.y, -edge.along.x};
  }
  for (int64_t e = begin; e < end; ++e) {
    const Vector &arriving = edges[edges[e].before].along, &along = edges[e].along;
    edges[e].turn = std::atan2(cross(arriving, along), dot(arriving, along));
    if (edges[e].turn < 0) dented[polygon] = 1;
    around[polygon].include(edges[e].tail);
  }
}

Meeting judge_edges(const RimEdge &a, const RimEdge &b, const Vector &tail, const Vector &head,
                    double rounding)
{
  const Vector whole = a.along * a.length;
  const double of_b[2] = {cross(tail, a.along), cross(head, a.along)};
  const double of_a[2] = {cross(tail, b.along), cross(tail - whole, b.along)};
  const auto apart = [&](const double *values, double low, double high) {
    return std::max(values[0], values[1]) < low - rounding ||
           std::min(values[0], values[1]) > high + rounding;
  };
  if (apart(of_b, 0, 0) || apart(of_a, 0, 0)) return APART;
  const double along_a[2] = {dot(tail, a.along), dot(head, a.along)};
  const double along_b[2] = {-dot(tail, b.along), -dot(tail - whole, b.along)};
  if (apart(along_a, 0, a.length) || apart(along_b, 0, b.length)) return APART;
  const bool sure = std::min(std::fabs(of_b[0]), std::fabs(of_b[1])) > rounding &&
                    std::min(std::fabs(of_a[0]), std::fabs(of_a[1])) > rounding;
  return sure ? CROSSING : DOUBTFUL;
}

}  // namespace jamlab

using namespace jamlab;

// Edges of polygons, see RimEdge.
//   offsets (n + 1), x (vertices, 2); particle, before, turn (vertices), tail, normal (vertices, 2)
//   out.
// Returns the number of edges, of which the first are written.
JAMLAB_KERNEL edge_rings(int64_t n, const int64_t *offsets, const double *x, int64_t *particle,
                         int64_t *before, double *turn, double *tail, double *normal)
try {
  const EdgeRings rings(n, offsets, x);
  int64_t k = 0;
  for (const RimEdge &edge : rings.edges) {
    particle[k] = edge.particle;
    before[k] = edge.before;
    turn[k] = edge.turn;
    put(tail, k, edge.tail);
    put(normal, k++, edge.normal);
  }
  return k;
}
JAMLAB_OR_NO_MEMORY
