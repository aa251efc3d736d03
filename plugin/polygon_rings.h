// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "atom.h"
#include "image_offset.h"
#include "pointers.h"
#include "vector_bytes.h"

#include <unordered_map>
#include <vector>

namespace LAMMPS_NS {

/* PolygonRings are the closed rings of a group, as far as this rank owns their vertices. It sums
   over whole polygons wherever the periodic boundary or the sub-domains cut them. */
class PolygonRings : protected Pointers {
 public:
  PolygonRings(class LAMMPS *lmp, const char *caller) : Pointers(lmp), who(caller) {}

  struct Vertex {
    int i, prev, next;    // local or ghost indices
    int polygon;
    ImageOffset image;    // relative to the first vertex of its polygon
  };
  struct RingSegment {    // owned vertices that follow each other on a polygon
    int polygon, begin, end;
  };
  struct Polygon {
    tagint molecule;
    int size;            // vertices, also those of other ranks
    int owned;           // vertices of this rank
    double origin[2];    // where its first vertex was in the box at the last refresh
    int first;           // local index of that vertex, -1 on other ranks
  };

  // Collective: finds the rings of the group from the bonds, and refuses a group that cuts a
  // polygon.
  void init(int groupbit);
  void refresh(int groupbit);    // collective, before use after a neighbor build
  bigint refreshed() const { return outline_refresh; }

  const std::vector<Polygon> &polygons() const { return polygon_list; }
  const std::vector<RingSegment> &segments() const { return segment_list; }
  const std::vector<Vertex> &vertices() const { return vertex_list; }

  // Collective: values[width * polygon + k] becomes its sum over the ranks that share the polygon.
  void sum(std::vector<double> &values, int width) const;

  // Collective: finds three values for each polygon, its area and, where centers are wanted, the
  // sums of x and y from the origin. act(segment) is called when they are known, which is at once
  // where this rank owns the whole polygon.
  template <class Act> void areas_and_centers(std::vector<double> &values, bool centers, Act act)
  {
    values.assign(3 * polygon_list.size(), 0.0);
    for (const RingSegment &segment : segment_list) {
      measure(segment, centers, &values[3 * segment.polygon]);
      if (whole(segment)) act(segment);
    }
    sum(values, 3);
    for (const RingSegment &segment : segment_list)
      if (!whole(segment)) act(segment);
  }

  // These are the edges when act(segment) is called, from the one that ends at the first vertex of
  // the segment to the one that starts at its last.
  struct Edges {
    const double *x, *y;    // one more than the segment has vertices
  };
  Edges edges(const RingSegment &segment) const
  {
    return {&edge_x[first_edge(segment)], &edge_y[first_edge(segment)]};
  }

  // The unwrapped position is counted from the origin of the polygon.
  jamlab::Vector position(const Vertex &vertex) const
  {
    const double *const origin = polygon_list[vertex.polygon].origin;
    return vertex.image.unwrapped(atom->x[vertex.i], domain) - jamlab::point(origin, 0);
  }

  // Collective: put(i, numbers) writes `width` numbers of each polygon on the rank that owns its
  // first vertex i, and all ranks that share the polygon get them.
  template <class Put> std::vector<double> of_first(int width, Put put) const
  {
    std::vector<double> values(width * polygon_list.size(), 0.0);
    for (std::size_t k = 0; k < polygon_list.size(); k++)
      if (polygon_list[k].first >= 0) put(polygon_list[k].first, &values[width * k]);
    sum(values, width);
    return values;
  }

  std::vector<tagint> molecules() const;    // collective: of all polygons, in order
  double memory_usage() const
  {
    return bytes(polygon_list, segment_list, vertex_list, edge_x, edge_y, place_x, place_y);
  }

 private:
  struct Shared {    // a polygon of which other ranks own vertices too; its place among all those
    int polygon, place;
  };

  const char *who;
  class FixPolygonOutline *outline = nullptr;
  bigint outline_refresh = -1;
  std::vector<Polygon> polygon_list;
  std::unordered_map<tagint, int> number;    // of the polygon of a molecule
  std::vector<RingSegment> segment_list;
  std::vector<Vertex> vertex_list;
  std::vector<Shared> shared;
  std::size_t all_shared = 0;    // polygons, of all ranks
  std::vector<double> edge_x, edge_y, place_x, place_y;

  std::size_t first_edge(const RingSegment &segment) const
  {
    return segment.begin + (&segment - segment_list.data());
  }
  bool whole(const RingSegment &segment) const
  {
    return segment.end - segment.begin == polygon_list[segment.polygon].size;
  }
  void measure(const RingSegment &, bool centers, double *);
  bool takes_part(int i, int groupbit) const;
  void clear();
  int count(int i);
  void walk(int start, int groupbit, std::vector<char> &seen);
  void find_shared();
  void refuse_other_bonds(int groupbit) const;
  void refuse_cut_polygons() const;
  void find_origins();
};

}    // namespace LAMMPS_NS
