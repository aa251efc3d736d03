// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_POLYGON_FACINGS_H
#define JAMLAB_POLYGON_FACINGS_H

#include "pointers.h"
#include "polygon_topology.h"

#include <vector>

namespace LAMMPS_NS {

/* Which edges can touch which vertex (or edge) until the next neighbor build.

   A polygon and its periodic images are different copies. The image flags say
   to which copy an atom or ghost belongs: two atoms of one molecule that need
   the same lattice translation to their unwrapped place are of one copy. So a
   polygon may be wider than half the box, and it meets its own images as it
   meets other polygons. */

class PolygonFacings : protected Pointers {
 public:
  PolygonFacings(class LAMMPS *lmp) : Pointers(lmp), topology(lmp) {}

  struct Edge {
    int tail, head;
  };
  struct Facing {    // a vertex (or an edge) and the edges near it
    int i, j;        // the vertex; the edge from i to j
    int begin, end;  // range in edges()
  };
  enum Grouping {
    BY_POLYGON,    // one facing for each vertex and copy of a polygon near it
    BY_VERTEX,     // one facing for each vertex
    BY_EDGE        // one facing for each edge; every pair of edges once
  };

  void init(const char *caller) { topology.build(caller); }

  // collective, after each neighbor build: mark owned atoms, forward the marks to ghosts, build
  void mark();
  int pack(int, const int *, double *, const int *) const;
  void unpack(int, int, const double *);
  void build(const class NeighList *, Grouping, double reach, double longest_edge);

  std::vector<Facing>::const_iterator begin() const { return facing_list.begin(); }
  std::vector<Facing>::const_iterator end() const { return facing_list.end(); }
  const std::vector<Edge> &edges() const { return edge_list; }
  bool fit_atoms() const;    // local and ghost atoms are as many as at the last build
  double memory_usage() const;

 private:
  struct Copy {    // lattice vectors to add to get the unwrapped position
    int a, b;
    bool operator==(const Copy &o) const { return a == o.a && b == o.b; }
    bool operator<(const Copy &o) const { return a < o.a || (a == o.a && b < o.b); }
  };
  struct Candidate {
    tagint molecule, tag;
    Copy copy;
    Edge edge;
    bool same_polygon(const Candidate &o) const { return molecule == o.molecule && copy == o.copy; }
    bool operator<(const Candidate &) const;
  };

  PolygonTopology topology;
  std::vector<Facing> facing_list;
  std::vector<Edge> edge_list;
  std::vector<Copy> copies;            // of every local and ghost atom
  int nlocal = 0, nghost = 0;          // at the last build
  std::vector<int> successor;          // next vertex of each atom in the same copy, -1 if absent
  std::vector<Candidate> candidates;   // of one vertex

  void find_successors();
  void check_edges(double) const;
  bool earlier(int, int) const;
};

}    // namespace LAMMPS_NS

#endif
