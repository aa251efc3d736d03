// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "kernels/vector.h"
#include "lmptype.h"

#include <algorithm>
#include <vector>

namespace LAMMPS_NS {

/* The bonds of a molecule make one of these of each of its atoms. */
enum OutlineKind {
  UNKNOWN,    // not yet looked at: the atom came during a run
  LONE,       // no bond within the molecule
  RING,       // vertex of a closed ring, in counter-clockwise order
  CHAIN,      // vertex of an open chain
  TANGLE      // branched, or a ring or chain beside another of the same molecule
};

struct OutlineLink {
  tagint next = 0, prev = 0;    // atom IDs, 0 where there is none
  int kind = UNKNOWN;           // OutlineKind
  int size = 0;                 // atoms of the ring or chain
  int first = 0;                // 1 on the vertex of the lowest ID of each ring or chain
  int crossings = 0;            // of a ring: pairs of its edges that pass through each other
  int bonds = 0;        // sum over the bonds that the atom itself lists, which may change in a run
  int place = 0;        // number of the vertex along the ring or chain, from 0
};

// Edges along a ring between a vertex and the edge that starts at `tail`, the shorter way round; 0
// if the vertex ends the edge.
inline int edges_between(const OutlineLink &vertex, const OutlineLink &tail)
{
  const int ahead = (tail.place - vertex.place + vertex.size) % vertex.size;
  return std::min(ahead, vertex.size - 1 - ahead);
}

struct OutlineAtom {
  tagint tag;
  jamlab::Vector r;    // unwrapped
};

struct OutlineBond {
  tagint a, b;
};

/* Finds the links of the atoms of one molecule, in the order of `atoms`, which are sorted by ID.
   Bonds to atoms of other molecules do not count, nor does a second listing of a bond. The area of
   the ring decides which way is counter-clockwise: the order of the IDs is free. */
std::vector<OutlineLink> outline_links(const std::vector<OutlineAtom> &atoms,
                                       const std::vector<OutlineBond> &bonds);

}    // namespace LAMMPS_NS
