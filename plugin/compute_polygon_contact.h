// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "compute.h"

namespace LAMMPS_NS {

/* The local array has one row for each contact of pair style circuloline: a vertex and an edge of
   another polygon, or of an image of its own, that are closer than delta. A disk replaces the
   vertex, and against another disk the edge too:

   1, 2    molecule IDs of the vertex and of the edge
   3, 4    atom IDs of the vertex and of the edge's first vertex
   5       gap d - delta, negative while the rims overlap
   6-8     force: magnitude, x and y component of the force on the vertex
   9, 10   vector from the closest point of the edge to the vertex
   11      atom ID of the edge's second vertex

   The rows of a pair of polygons add up to the force between them. The sum of force times vector
   over all rows is the contact virial. A group keeps the contacts of which it holds both the
   vertex and the edge's first vertex. */
class ComputePolygonContact : public Compute {
 public:
  ComputePolygonContact(class LAMMPS *, int, char **);
  ~ComputePolygonContact() override;
  void init() override;
  void compute_local() override;
  double memory_usage() override { return 8.0 * capacity * size_local_cols; }

 private:
  class PairCirculoline *pair;
  int capacity;    // rows that array_local has room for
};

}    // namespace LAMMPS_NS
