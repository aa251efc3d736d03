// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_POLYGON_OUTLINE_H
#define JAMLAB_POLYGON_OUTLINE_H

#include "pointers.h"
#include "polygon_topology.h"

#include <vector>

namespace LAMMPS_NS {

/* Area, perimeter and self-crossings of whole polygons, wherever the periodic
   boundary or the sub-domain boundaries cut them. */

class PolygonOutline : protected Pointers {
 public:
  PolygonOutline(class LAMMPS *lmp) : Pointers(lmp), topology(lmp) {}

  struct Vertex {
    int i, prev, next;    // local or ghost indices
    int a, b;             // image flags: lattice vectors from the box to the unwrapped place
  };

  void init(const char *caller, int groupbit);       // collective, refuses a group that cuts a polygon
  void refresh(const char *caller, int groupbit);    // collective, after each neighbor build
  void areas(std::vector<double> &) const;           // collective, indexed by molecule ID
  void perimeters(std::vector<double> &) const;      // collective, indexed by molecule ID
  void crossings(std::vector<double> &) const;       // collective, indexed by molecule ID: pairs of edges
  void position(const Vertex &, double *) const;     // unwrapped, from the origin of its polygon
  tagint count() const { return topology.count(); }
  const std::vector<Vertex> &vertices() const { return owned; }

 private:
  PolygonTopology topology;
  std::vector<Vertex> owned;
  std::vector<double> origin;    // per molecule: where its first vertex was at the last refresh

  void sum(std::vector<double> &) const;
};

}    // namespace LAMMPS_NS

#endif
