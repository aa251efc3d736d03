// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_POLYGON_TOPOLOGY_H
#define JAMLAB_POLYGON_TOPOLOGY_H

#include "lmptype.h"
#include "pointers.h"

#include <vector>

namespace LAMMPS_NS {

/* Which vertex follows which. A polygon is one molecule; its vertices carry
   consecutive atom IDs in counter-clockwise order, as `create_atoms ... mol`
   and jamlab's data files number them. Molecule 0 holds atoms that belong to
   no polygon. */

class PolygonTopology : protected Pointers {
 public:
  PolygonTopology(class LAMMPS *lmp) : Pointers(lmp) {}

  // collective: reads the ID range of every polygon, refuses broken ones
  void build(const char *caller);

  tagint count() const { return static_cast<tagint>(first.size()) - 1; }
  tagint size(tagint mol) const { return last[mol] < first[mol] ? 0 : last[mol] - first[mol] + 1; }
  tagint first_tag(tagint mol) const { return first[mol]; }
  tagint next_tag(tagint tag, tagint mol) const { return tag == last[mol] ? first[mol] : tag + 1; }
  tagint prev_tag(tagint tag, tagint mol) const { return tag == first[mol] ? last[mol] : tag - 1; }

  // local or ghost index of the next/previous vertex, in the image nearest to i; -1 if absent
  int next(int i) const;
  int prev(int i) const;

 private:
  std::vector<tagint> first, last;    // lowest and highest atom ID of each molecule

  int nearest(int i, tagint tag) const;
};

}    // namespace LAMMPS_NS

#endif
