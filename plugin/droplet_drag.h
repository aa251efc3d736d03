// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_DROPLET_DRAG_H
#define JAMLAB_DROPLET_DRAG_H

#include "block_cholesky.h"
#include "drag_solver.h"
#include "droplet_stiffness.h"

namespace LAMMPS_NS {

/* Drag of droplets, the law of ContactDamping and StokesDrag in jamlab.rheology.damping.

   Contact drag acts on the velocity of a vertex past the point of the edge that it meets, less what
   both outlines take back by rotating, each with half the distance for a lever: a rigid rotation
   dissipates nothing. An outline rotates at a vertex as fits its two edges e best,
   w = sum e x e'/sum e^2; between two vertices w is interpolated. Background drag of a droplet is
   shared by its vertices.

   Drag leaves most motion of vertices free, and K is stiff along some of it and soft along other: the
   preconditioner is the Cholesky factor of B + ahead K, of what each rank owns, and serves as many steps
   as it makes conjugate gradients short. */

class DropletDrag : public DragSolver {
 public:
  DropletDrag(class LAMMPS *, GhostExchange &, const Settings &, const DragLaw &, class Compute &virial,
              Compute &energy);
  void take(int nlocal, int nghost, double ahead) override;
  double elastic_moment() const override;
  FlowSums add_up(const Motions &u, double rate) override;
  double least_relaxation_time() const override;
  bool touched(int /*i*/) const override { return true; }
  double memory_usage() const override;

 private:
  class LAMMPS *lmp;
  class PairCirculoline *pair;
  class FixPolygonArea *area;
  Compute &virial, &energy;
  DropletStiffness stiffness;
  double ahead = 0.0;
  std::vector<DropletMeeting> meetings;
  std::vector<double> weights;    // drag over velocity of approach
  Motions work, still;
  BlockCholesky<2> factors;
  bool stale = true, atoms_moved_between_ranks = true;
  double factors_ahead = -1.0, mean_diagonal = 0.0;
  std::vector<double> column;
  struct Turn {    // of the outline at an owned vertex: edges in and out over the sum of their squares
    int prev, next;
    double in_x, in_y, out_x, out_y, per_square, drag;    // drag: share of the background
  };
  std::vector<Turn> turns;

  void read_outlines();
  void remove_mean(Motions &) const;
  void factorise();
  void assemble_drag(class BlockAssembly &) const;
  void find_weights(const Motions &u, double rate) override;
  void find_preconditioner(bool free_rate) override;
  double precondition(double r_flow, double &z_flow) override;
  void multiply(Motions &p, double rate, Motions &out, double &power, double &flow) override;
  void multiply_ahead(Motions &p, double rate, Motions &out, double &power, double &flow) override;
  bool looks_ahead() const override { return ahead > 0.0; }
  double rounding() const override;

  void apply(Motions &p, double rate, double ahead, Motions &out, double &power, double &flow, FlowSums *);
  void find_spins(Motions &p, double rate);
  double turn_back(Motions &out, FlowSums *);
  void slip(const DropletMeeting &, const Motions &p, double rate, double &approach, double &slide) const;
};

}    // namespace LAMMPS_NS

#endif
