// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_DRAG_SOLVER_H
#define JAMLAB_DRAG_SOLVER_H

#include "drag_law.h"

#include <mpi.h>

#include <vector>

namespace LAMMPS_NS {

struct Motion {    // of a disk or a vertex, beside the affine flow; or a force on it and a torque
  double x = 0.0, y = 0.0, spin = 0.0;
};
using Motions = std::vector<Motion>;    // of owned atoms, then of ghosts

/* What the solver needs of LAMMPS. */

class GhostExchange {
 public:
  virtual void send_to_ghosts(Motions &) = 0;
  virtual void add_from_ghosts(Motions &) = 0;

 protected:
  ~GhostExchange() = default;
};

/* Sums over contacts, disks and vertices. Stress over contacts is the sum of T_a r_b with the tension T
   that acts on the first of two; conjugate to the strain is T_x r_y. */

struct FlowSums {
  double elastic = 0.0, viscous = 0.0, xx = 0.0, yy = 0.0, energy = 0.0, dissipation = 0.0, speed = 0.0,
         contacts = 0.0;
};

/* Velocities at which drag balances elastic forces at every instant: B u = F - rate b, with B and
   b as in jamlab.rheology.damping, and, where the stress is given, for the rate as well:
   b u + c rate = A (stress - elastic stress).

   Conjugate gradients over the list of contacts, from the last velocities; each atom's own block of
   B is the preconditioner. B u = F - rate b always has a solution, and what it leaves open (disks
   that nothing holds) stays zero: those disks follow the affine flow. Of a power law, the velocities are those
   where R - F u is least, which is convex: steps of disks are Newton's, as short as it takes to lessen the residual;
   of droplets, drag coefficients are found again between rounds of conjugate gradients.

   Droplets look ahead: forces are those of the end of a step, F - ahead K (u - start), since a vertex
   without contact has no drag, and its forces balance at every instant. */

class DragSolver {
 public:
  struct Settings {
    double tolerance = 1e-6;    // residual over the driving force, both in the norm of the preconditioner
    double background = 0.0;    // drag of every particle against the affine flow, a force per velocity
    double fluid = 0.0;         // viscosity of the fluid times the area of the box: adds to c
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
    bool positive;      // the matrix, as far as was seen
  };

  DragSolver(MPI_Comm world, GhostExchange &exchange, const Settings &settings, const DragLaw &law) :
      world(world), exchange(exchange), settings(settings), law(law) {}
  virtual ~DragSolver() = default;

  // contacts at present positions; ahead: time over which forces follow the velocities, of droplets
  virtual void take(int nlocal, int nghost, double ahead) = 0;
  virtual void let_go_of_loose(Motions &) {}    // what nothing holds keeps no velocity from the last step
  Result solve(Motions &force, Motions &u, Load &load);    // force: changed where pairs are held
  void accept(Motions &u, double rate);    // velocities of a run before, as if they were the solution

  // at the velocities of the last solution
  virtual double elastic_moment() const = 0;    // elastic shear stress times area, of all ranks
  virtual FlowSums add_up(const Motions &u, double rate) = 0;    // of all ranks
  virtual double least_relaxation_time() const = 0;    // of this rank: longer steps than that are unstable
  virtual bool touched(int i) const { return inverse[i].xx > 0.0; }    // i drags on others, or on the background
  virtual double memory_usage() const;

 protected:
  MPI_Comm world;
  GhostExchange &exchange;
  const Settings settings;
  const DragLaw law;
  int nlocal = 0, nghost = 0;
  struct Block {    // symmetric, of one atom: xx xy yy xs ys ss
    double xx, xy, yy, xs, ys, ss;
  };
  std::vector<Block> inverse;
  double inverse_flow = 0.0;    // of c
  Motions residual, descent;    // of conjugate gradients; descent = M^-1 residual
  int last_iterations = 0;
  Motions start;                // velocities that the last solution started from
  double start_rate = 0.0;

  void make_room(int nlocal, int nghost);
  double sum(double) const;
  double speed_floor(double squares, double count) const;
  virtual double precondition(double r_flow, double &z_flow);    // residual descent over all ranks
  double descend(Motions &u, Load &, double r_flow, double enough, Result &);
  double driving(const Motions &force, const Load &);
  double find_residual(const Motions &force, Motions &u, const Load &, bool moved);

 private:
  Motions direction, product;

  virtual void find_weights(const Motions &u, double rate) = 0;
  virtual void find_preconditioner(bool free_rate) = 0;    // the blocks `inverse`
  // out = B p + b rate; power = (p, rate) B (p, rate); flow = b p + c rate, of all ranks
  virtual void multiply(Motions &p, double rate, Motions &out, double &power, double &flow) = 0;
  // the same of B + ahead K
  virtual void multiply_ahead(Motions &p, double rate, Motions &out, double &power, double &flow)
  {
    multiply(p, rate, out, power, flow);
  }
  virtual bool looks_ahead() const { return false; }
  // from here on multiply_ahead is by the slope of the drag of a power law at these velocities; false: it is not known
  virtual bool find_slopes(const Motions &, double /*rate*/) { return false; }
  // hold what a linear solution leaves free; true: it has changed, and velocities are found again
  virtual bool hold(Motions &, Motions &, Load &, Result &) { return false; }
  virtual std::vector<double> held() const { return {}; }    // forces on each of those pairs
  virtual void hold_at(const std::vector<double> &) {}
  virtual double rounding() const = 0;    // squared norm that rounding of the forces leaves in any residual

  void subtract(const Motions &, double factor = 1.0);
  struct State {    // of owned atoms; kept from step to step, since ghosts of a few disks are many
    Motions force, u;
    double rate, moment;
    std::vector<double> held;
  };
  State before, after;    // a step of Newton's
  void keep(State &, const Motions &force, const Motions &u, const Load &) const;
  void shorten(double rho, Motions &force, Motions &u, Load &);
};

}    // namespace LAMMPS_NS

#endif
