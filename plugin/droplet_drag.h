// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "drag_system.h"
#include "droplet_stiffness.h"

namespace LAMMPS_NS {

/* Drag of droplets, by the laws of ContactDamping and StokesDrag in jamlab.rheology.damping.

   Contact drag acts on the velocity of a vertex past the point of the edge that it meets, less what
   both outlines take back by rotating, each with half the distance for a lever: a rigid rotation
   dissipates nothing. An outline rotates at a vertex as fits its two edges e best,
   w = sum e x e'/sum e^2; between two vertices w is interpolated. The vertices of a droplet share
   its background drag.

   Drag leaves most motion of vertices free, and K is stiff along some of it and soft along other:
   the preconditioner is the Cholesky factor of B + ahead K, of what each rank owns, and serves as
   many steps as it makes conjugate gradients short. */
class DropletDrag : public DragSystem<DropletRow> {
 public:
  DropletDrag(class LAMMPS *, GhostExchange &, const Settings &, const DragLaw &);
  void update_contacts(int nlocal, int nghost, double ahead) override;
  void elastic_forces(Field &) const override;
  double elastic_moment() const override { return -evaluated.xy; }
  FlowSums add_up(const Field &u, double rate) override;
  double least_relaxation_time() const override { return HUGE_VAL; }    // none is unstable
  double moment_of_kept(const Field &) const override;
  struct Scales {    // of this packing: mean root of the rest areas; of contacts, or of tension
    double length, energy;
  };
  Scales scales();    // before velocities are found

 private:
  class LAMMPS *lmp;
  class PairCirculoline *pair;
  class FixPolygonArea *area;
  // Energy and virial of the last evaluation of forces, of all ranks, in units of energy. LAMMPS
  // finds them in steps that its own computes want.
  struct Evaluated {
    double energy = 0.0, xx = 0.0, yy = 0.0, xy = 0.0;
  } evaluated;
  class Compute *wanted[2];
  double size = 0.0;    // of droplets, the length of Scales, on all ranks
  DropletStiffness stiffness;
  std::vector<DropletMeeting> meetings;
  Field work, still;
  bool outdated = true;    // the factors, by the time ahead or the drag coefficients
  double factors_ahead = -1.0, mean_diagonal = 0.0;
  struct Turn {    // of the outline at an owned vertex: edges in and out, over the sum of squares
    int prev, next;
    jamlab::Vector in, out;
    double per_square;
  };
  std::vector<Turn> turns;

  void want_sums(bigint step);
  void read_sums();
  void read_outlines();
  void factorise();
  void find_preconditioner(bool free_rate) override;
  double rounding() const override;

  void find_spins(Field &p, double rate) override;
  double turn_back(Field &out, FlowSums *) override;
  double add_forces_ahead(const Field &p, double rate, Field &out) override
  {
    return stiffness.add_product(p, rate, ahead, out).xy;
  }
  void find_parts(std::size_t k, std::vector<Part> &) const override;
  void project(Field &) const override;
};

}    // namespace LAMMPS_NS
