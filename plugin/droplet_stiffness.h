// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "block_assembly.h"
#include "kernels/vector.h"
#include "outline_stiffness.h"
#include "slip_row.h"
#include "virial.h"

#include <vector>

namespace LAMMPS_NS {

/* A vertex meets an edge at the point (1 - t) tail + t head. */
struct DropletMeeting {
  int vertex, tail, head;
  double t;
  jamlab::Vector normal;    // unit vector from the edge to the vertex
  double distance;
  double stiffness, force;    // second and minus the first derivative of the energy by the distance
  double drag;                // stiffness in the coefficient of its drag
  jamlab::Vector along;       // direction of the edge
  double length;              // of the edge; 0: the vertex meets a corner of it
};

// Finds contacts of this rank at its positions, and gaps up to `beyond` more, which bear no force.
// Returns false if outlines cross, where a contact has no direction.
bool find_meetings(class PairCirculoline &, const double *const *x, std::vector<DropletMeeting> &,
                   double beyond = 0.0);

/* DropletStiffness multiplies displacements by the Hessian K of the energy of droplets, with the
   terms and formulas of jamlab.mechanics.energy_terms. Displacements are relative to an affine
   shear, which is given separately. */
class DropletStiffness {
 public:
  DropletStiffness(class LAMMPS *lmp, class FixPolygonArea *area) :
      lmp(lmp), area(area), outlines(lmp)
  {
  }

  void take(const std::vector<DropletMeeting> &);

  // Adds factor K (p, strain) to `out`, also for ghosts, and returns this rank's virial of these
  // forces.
  Virial add_product(const Field &p, double strain, double factor, Field &out);

  void assemble(double factor, BlockAssembly<2> &) const;    // factor K

  double largest_tension(double size) const;    // of droplets whose areas have this root

 private:
  class LAMMPS *lmp;
  class FixPolygonArea *area;
  const std::vector<DropletMeeting> *meetings = nullptr;
  struct Edge {    // block of its line tension
    int i, j;
    jamlab::Vector r;
    double xx, xy, yy;
    bool own_i, own_j;    // this rank adds the force on that vertex
    double share;
  };
  std::vector<Edge> edges;
  struct Vertex {    // of an area
    int i, prev, next, polygon;
    jamlab::Vector slope, r;    // da/dx; place
  };
  std::vector<Vertex> vertices;
  std::vector<double> stretch;
  OutlineStiffness outlines;

  void assemble_contacts(double factor, BlockAssembly<2> &) const;
  void assemble_areas(double factor, BlockAssembly<2> &) const;
  void add_contacts(const Field &p, double strain, double factor, Field &out, Virial &) const;
  void add_tension(const Field &p, double strain, double factor, Field &out, Virial &) const;
  void add_areas(const Field &p, double strain, double factor, Field &out, Virial &);
};

}    // namespace LAMMPS_NS
