// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "block_assembly.h"
#include "droplet_stiffness.h"
#include "fix.h"
#include "polygon_rings.h"

#include <vector>

namespace LAMMPS_NS {

/* The base class of energies of outlines: what fixes for one law of the outline share. The forces
   on all vertices of a polygon add up to zero. A law finds forces, and the product of its Hessian
   and a displacement, as DropletStiffness does. */
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

  // At the positions of now, of this rank's vertices.
  virtual void take() = 0;
  virtual void add_product(const Field &p, double strain, double factor, Field &out,
                           Virial &) const = 0;
  virtual void assemble(double factor, BlockAssembly<2> &) const = 0;
  virtual double scale() const = 0;    // of its line tension, for times and rounding

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
