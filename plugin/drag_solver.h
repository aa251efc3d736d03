// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_DRAG_SOLVER_H
#define JAMLAB_DRAG_SOLVER_H

#include "disk_contact.h"

#include <mpi.h>

#include <vector>

namespace LAMMPS_NS {

struct Motion {    // of a disk, beside the affine flow; or a force on it and a torque
  double x = 0.0, y = 0.0, spin = 0.0;
};
using Motions = std::vector<Motion>;    // of owned disks, then of ghosts

/* What the solver needs of LAMMPS. */

class GhostExchange {
 public:
  virtual void send_to_ghosts(Motions &) = 0;
  virtual void add_from_ghosts(Motions &) = 0;

 protected:
  ~GhostExchange() = default;
};

/* Velocities at which drag balances elastic forces at every instant: B u = F - rate b, with B and
   b as in jamlab.rheology.damping, and, where the stress is given, for the rate as well:
   b u + c rate = A (stress - elastic stress).

   Conjugate gradients over the list of contacts, from the last velocities; each disk's own block of
   B is the preconditioner. B u = F - rate b always has a solution, and what it leaves open (disks
   that nothing holds) stays zero: those disks follow the affine flow. Of a power law, the drag
   coefficients are found again between rounds of conjugate gradients, which lowers the dissipation
   function in every round. */

class DragSolver {
 public:
  struct Settings {
    double tolerance = 1e-6;    // residual over the driving force, both in the norm of the preconditioner
    double background = 0.0;    // drag of every disk against the affine flow, a force per velocity
    int iterations = 10000;     // at most, of one solution
  };
  struct Load {
    double rate, moment;    // moment: A (stress - elastic stress), where the rate is free
    bool free_rate;
  };
  struct Result {
    int iterations;
    bool converged;
    double residual;    // relative
  };

  DragSolver(MPI_Comm world, GhostExchange &exchange) : world(world), exchange(exchange) {}
  Settings settings;

  void take(const std::vector<DiskContact> &, const DragLaw &, int nlocal, int nghost);
  void let_go_of_loose_disks(Motions &u);
  Result solve(const Motions &force, Motions &u, Load &load);

  // at the velocities of the last solution
  double weight(std::size_t contact) const { return weights[contact]; }    // drag over velocity of approach
  void slip(const DiskContact &, const Motions &u, double rate, double &approach, double &slide) const;
  bool touched(int i) const { return inverse[i].xx > 0.0; }    // disk i drags on another one, or on the background
  double least_relaxation_time() const;    // of this rank
  double memory_usage() const;

 private:
  MPI_Comm world;
  GhostExchange &exchange;
  const std::vector<DiskContact> *contacts = nullptr;
  DragLaw law;
  int nlocal = 0, nghost = 0;
  std::vector<double> weights;
  struct Block {    // symmetric, of one disk: xx xy yy xs ys ss
    double xx, xy, yy, xs, ys, ss;
  };
  std::vector<Block> inverse;
  double inverse_flow = 0.0;    // of c
  Motions residual, direction, product, blocks[2];

  void find_weights(const Motions &u, double rate);
  void find_preconditioner(bool free_rate);
  void multiply(Motions &p, double rate, Motions &out, double &power, double &flow);
  double precondition(const Motions &r, double r_flow, Motions &z, double &z_flow);
  double rounding() const;
  double sum(double) const;
};

}    // namespace LAMMPS_NS

#endif
