// Outlines of droplets: polygons that have grown by a rim, cut where they cover each other.
//
// A grown polygon is the union of the polygon and of a capsule around every edge: the points within
// the width w of the rim. Its outline consists of elements: edges moved outwards by w, and arcs of
// radius w around convex corners. A capsule is convex and covers one interval of an element. Where
// polygons cross or hold each other, their insides cover elements as well.
//
// Neighbors in any direction see the same places where their outlines cross: both sides calculate
// them from the same numbers, so that outlines that nearly touch or coincide are cut alike.
#pragma once

#include "edge_rings.h"
#include "periodic_neighbors.h"

namespace jamlab {

// An edge beside another: its ends from the tail of that one.
struct NearEdge {
  int64_t j;
  Image shift;  // of its polygon
  Vector tail, head;
  bool own;    // of the same polygon, and not of an image of it
  bool later;  // than the other edge, in an order on which both sides agree
};

// A polygon, in some image, beside another one.
struct NearPolygon {
  int64_t particle;
  Image shift;
  bool operator==(const NearPolygon &other) const
  {
    return particle == other.particle && shift == other.shift;
  }
  bool operator<(const NearPolygon &other) const
  {
    return particle != other.particle ? particle < other.particle : shift < other.shift;
  }
};

class DropletOutlines : public EdgeRings {
 public:
  const double w;                   // width of the rim
  const Lattice lattice;
  const double rounding;            // of the distance of two vertices
  std::vector<int64_t> near_first;    // (edges + 1)
  std::vector<NearEdge> near;         // edges that may cover parts of an edge or of its arc
  std::vector<std::vector<NearPolygon>> entangled;  // (n), those whose inside may cover a polygon
  Meeting meeting = APART;            // of outlines without rims: the worst that two of them do
  int64_t met[2] = {-1, -1};          // the two

  DropletOutlines(int64_t n, const int64_t *offsets, const double *x, const double *box, double w);

  // Finds the edges near each other, and how outlines meet. Returns 0, or a Refusal.
  int64_t find_near(double most_copies, double *search);

  Vector translation(const Image &shift) const { return lattice.translation(shift); }
  const Vector &home(int64_t particle) const { return edges[first[particle]].tail; }
  bool holds(int64_t particle, const Vector &place) const;

  // Returns the direction in which the arc around the tail of an edge begins.
  double start_of_arc(int64_t edge) const
  {
    const Vector &normal = edges[edges[edge].before].normal;
    return std::atan2(normal.y, normal.x);
  }

 private:
  struct Found {
    int64_t i, j;
    Image shift;
    bool own;
  };
  struct Extent {
    double low, high;
    int64_t edge;
  };
  std::vector<Found> found;  // each pair once
  std::vector<Extent> near_p, near_q;

  void collect(int64_t particle, const Bounds &place, bool upright,
               std::vector<Extent> &list) const;
  void join(int64_t p, int64_t q, const Image &shift);
  void add_pair(int64_t i, int64_t j, const Image &shift, const Vector &move, bool own);
  void note(Meeting how, int64_t i, int64_t j, const Image &shift);
  void sort_by_edge();
};

// A part of an element that nothing of its own polygon covers, and the other polygons that do.
struct OutlinePart {
  int64_t edge;
  bool arc;           // around the tail of the edge
  double begin, end;  // along the edge, or angles from the beginning of the arc
  Vector from, to;
  const std::vector<NearPolygon> &covers;
};

// Cuts elements into parts, and bare edges into contacts.
class OutlineCutter {
 public:
  explicit OutlineCutter(const DropletOutlines &of) : outlines(of) {}

  // Calls act(part) for the parts of the edge moved outwards, in order.
  template <class Act> void cut_edge(int64_t edge, Act act)
  {
    const RimEdge &e = outlines.edges[edge];
    const Vector start = e.tail + e.normal * outlines.w;
    collect_along(edge);
    merge(edge, false, e.length);
    split(e.length, [&](double begin, double end) {
      act(OutlinePart{edge, false, begin, end, start + e.along * begin, start + e.along * end,
                      covers});
    });
  }

  // Calls act(part) for the parts of the arc around the tail of the edge, if there is one.
  template <class Act> void cut_corner(int64_t edge, Act act)
  {
    const RimEdge &e = outlines.edges[edge];
    if (!(e.turn > 0)) return;
    collect_around(edge);
    merge(edge, true, e.turn);
    const Vector &start = outlines.edges[e.before].normal;
    const auto at = [&](double turned) {
      if (turned == 0) return e.tail + start * outlines.w;
      if (turned == e.turn) return e.tail + e.normal * outlines.w;
      const double c = std::cos(turned), s = std::sin(turned);
      return e.tail + Vector{start.x * c - start.y * s, start.x * s + start.y * c} * outlines.w;
    };
    split(e.turn, [&](double begin, double end) {
      act(OutlinePart{edge, true, begin, end, at(begin), at(end), covers});
    });
  }

  // Calls act(polygon, begin, end) for the parts of the edge, without its rim, that lie nearer than
  // 2 w to the edges of another polygon.
  template <class Act> void find_contacts(int64_t edge, Act act)
  {
    collect_contacts(edge);
    unite(outlines.edges[edge].length);
    for (const Interval &one : merged) act(one.by, one.low, one.high);
  }

 private:
  struct Interval {
    NearPolygon by;
    bool own;
    double low, high;
    bool same(const Interval &other) const { return own == other.own && by == other.by; }
  };
  struct End {
    double place;
    int64_t interval;
    bool opens;
  };
  const DropletOutlines &outlines;
  std::vector<Interval> found, merged;
  std::vector<End> ends;
  std::vector<int64_t> open;
  std::vector<NearPolygon> covers;

  void collect_along(int64_t edge);
  void collect_around(int64_t edge);
  void collect_contacts(int64_t edge);
  void unite(double extent);
  void merge(int64_t edge, bool arc, double extent);
  void fill_insides(int64_t edge, bool arc, double extent);
  void sort_ends(double extent);

  // Calls act(begin, end) for every part that is not covered by its own polygon, with its covers.
  template <class Act> void split(double extent, Act act)
  {
    double begin = 0.0;
    int64_t own = 0;
    open.clear();
    const auto pass = [&](double end) {
      if (!own && begin < end) {
        covers.clear();
        for (const int64_t k : open) covers.push_back(merged[k].by);
        act(begin, end);
      }
      begin = end;
    };
    for (const End &end : ends) {
      if (end.place > begin) pass(end.place);
      if (merged[end.interval].own)
        own += end.opens ? 1 : -1;
      else if (end.opens)
        open.push_back(end.interval);
      else
        open.erase(std::find(open.begin(), open.end(), end.interval));
    }
    pass(extent);
  }
};

}  // namespace jamlab
