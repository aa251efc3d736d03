// Edges of polygons, counter-clockwise, and whether two of them cross.
#pragma once

#include "periodic_grid.h"

namespace jamlab {

struct RimEdge {
  int64_t particle, before, after;  // the edges that end at the tail and begin at the head
  Vector tail, along, normal;       // unit vectors; the normal points outwards
  double length, turn;              // turn: exterior angle at the tail, positive at convex corners
};

// A rectangle along the axes.
struct Bounds {
  Vector low{INFINITY, INFINITY}, high{-INFINITY, -INFINITY};
  void include(const Vector &p)
  {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  Bounds moved(const Vector &by) const { return {low + by, high + by}; }
  Bounds wider(double by) const { return {low - Vector{by, by}, high + Vector{by, by}}; }
  Bounds common(const Bounds &other) const
  {
    return {{std::max(low.x, other.low.x), std::max(low.y, other.low.y)},
            {std::min(high.x, other.high.x), std::min(high.y, other.high.y)}};
  }
  bool meets(const Bounds &other) const
  {
    return low.x <= other.high.x && other.low.x <= high.x && low.y <= other.high.y &&
           other.low.y <= high.y;
  }
  bool holds(const Bounds &other, double rounding) const
  {
    const Bounds with = wider(rounding);
    return with.low.x <= other.low.x && other.high.x <= with.high.x &&
           with.low.y <= other.low.y && other.high.y <= with.high.y;
  }
};

// How two outlines meet: `DOUBTFUL` if they touch within rounding.
enum Meeting : int64_t { APART, DOUBTFUL, INSIDE, CROSSING };

class EdgeRings {
 public:
  const int64_t n;             // polygons
  std::vector<RimEdge> edges;  // those shorter than 1e-12 of the perimeter are left out
  std::vector<int64_t> first;  // (n + 1), edges of each polygon; flat walls have none
  std::vector<Bounds> around;  // (n), of vertices
  std::vector<char> dented;    // (n), whether a corner is reflex

  // offsets (n + 1), x (vertices, 2)
  EdgeRings(int64_t n, const int64_t *offsets, const double *x);

  const Vector &head(const RimEdge &edge) const { return edges[edge.after].tail; }

 private:
  void add(int64_t polygon, int64_t low, int64_t high, const double *x);
};

// Judges whether edges cross; `tail`, `head`: of b, from the tail of a; `rounding`: of either.
Meeting judge_edges(const RimEdge &a, const RimEdge &b, const Vector &tail, const Vector &head,
                    double rounding);

// The error of the distance of two vertices with coordinates up to the largest one.
inline double rounding_of_distance(double largest) { return 4e-15 * largest; }

}  // namespace jamlab
