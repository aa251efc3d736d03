// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fix.h"
#include "polygon_rings.h"
#include "virial.h"

#include <vector>

namespace LAMMPS_NS {

/* The base class of energies of outlines: what fixes for one law of the outline share. The forces
   on all vertices of a polygon add up to zero. A law finds forces, and the second derivatives of
   its energy. */
class FixOutlineEnergy : public Fix {
 public:
  FixOutlineEnergy(class LAMMPS *, int, char **, const char *who);
  int setmask() override;
  void post_constructor() override;
  void init() override;
  void setup(int vflag) override { post_force(vflag); }
  void min_setup(int vflag) override { post_force(vflag); }
  void post_force(int vflag) override;
  void min_post_force(int vflag) override { post_force(vflag); }
  double compute_scalar() override;
  int pack_reverse_comm(int, int, double *) override;
  void unpack_reverse_comm(int, int *, double *) override;
  double memory_usage() override { return bytes(force) + rings.memory_usage(); }

  /* The Hessian is that of a sum over vertices, each with an energy of the edges in and out, and of
     (k/2) S^2 where S is a sum over a polygon. */
  struct Corner {
    int prev, i, next, polygon;
    jamlab::Vector in, out;
    double second[4][4];           // derivatives of the energy by the components of both edges
    jamlab::Vector slope, part;    // derivatives of S by the vertex, and by the edge out
  };
  // At the present positions, of this rank's vertices.
  virtual std::vector<Corner> corners() = 0;
  virtual double stiffness_of_sum() const { return 0.0; }    // k
  // of its line tension, for times and rounding, on all ranks; `size`: root of an area
  virtual double scale(double size) const = 0;
  const PolygonRings &outlines() const { return rings; }

  static std::vector<FixOutlineEnergy *> all_of(class LAMMPS *);    // those that are defined

 protected:
  const char *who;
  PolygonRings rings;
  std::vector<jamlab::Vector> force;    // on owned atoms and ghosts
  double energy;                        // of this rank's share

  struct Edge {    // from one vertex to the next
    jamlab::Vector r;
    double length;
  };
  Edge edge(int from, int to) const;
  virtual void add_forces() = 0;    // fills force and energy, and tallies
  // Adds the energy and the virial of forces to the sums, at a vertex.
  void tally(int i, double share, const Virial &);
  static double positive(class LAMMPS *, const char *who, const char *what, const char *argument);
};

}    // namespace LAMMPS_NS
