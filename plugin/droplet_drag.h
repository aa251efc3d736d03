// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "drag_system.h"
#include "droplet_stiffness.h"

namespace LAMMPS_NS {

/* Drag of droplets, the law of ContactDamping and StokesDrag in jamlab.rheology.damping.

   Contact drag acts on the velocity of a vertex past the point of the edge that it meets, less what
   both outlines take back by rotating, each with half the distance for a lever: a rigid rotation
   dissipates nothing. An outline rotates at a vertex as fits its two edges e best,
   w = sum e x e'/sum e^2; between two vertices w is interpolated. Background drag of a droplet is
   shared by its vertices.

   Drag leaves most motion of vertices free, and K is stiff along some of it and soft along other:
   the preconditioner is the Cholesky factor of B + ahead K, of what each rank owns, and serves as many
   steps as it makes conjugate gradients short. */
class DropletDrag : public DragSystem<DropletRow> {
 public:
  DropletDrag(class LAMMPS *, GhostExchange &, const Settings &, const DragLaw &, class Compute &virial,
              Compute &energy);
  void update_contacts(int nlocal, int nghost, double ahead) override;
  void elastic_forces(Field &) const override;
  double elastic_moment() const override;
  FlowSums add_up(const Field &u, double rate) override;
  double least_relaxation_time() const override { return HUGE_VAL; }    // none is unstable
  bool touched(int /*i*/) const override { return true; }

 private:
  class LAMMPS *lmp;
  class PairCirculoline *pair;
  class FixPolygonArea *area;
  Compute &virial, &energy;
  DropletStiffness stiffness;
  double ahead = 0.0;
  std::vector<DropletMeeting> meetings;
  Field work, still;
  bool stale = true, moved_between_ranks = true;
  double factors_ahead = -1.0, mean_diagonal = 0.0;
  struct Turn {    // of the outline at an owned vertex: edges in and out, over the sum of squares
    int prev, next;
    double in_x, in_y, out_x, out_y, per_square;
  };
  std::vector<Turn> turns;

  void read_outlines();
  void factorise();
  void find_preconditioner(bool free_rate) override;
  void multiply_ahead(Field &p, double rate, Field &out, double &power, double &flow, double *also) override
  {
    apply(p, rate, ahead, false, out, power, flow, also);
  }
  bool looks_ahead() const override { return ahead > 0.0; }
  double rounding() const override;

  void find_spins(Field &p, double rate) override;
  double turn_back(Field &out, FlowSums *) override;
  double add_forces_ahead(const Field &p, double rate, double time, Field &out) override
  {
    return time > 0.0 ? stiffness.add_product(p, rate, time, out).xy : 0.0;
  }
  void find_parts(std::size_t k, std::vector<Part> &) const override;
  void project(Field &) const override;
};

}    // namespace LAMMPS_NS
