// Edges of polygons with rims, and which of them come near each other on the torus.
#pragma once

#include "periodic_grid.h"

#include <vector>

namespace jamlab {

constexpr double NEAR = 1e-9;  // of a length or a fraction: beyond rounding, and without meaning

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

}  // namespace jamlab
