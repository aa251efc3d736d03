// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "drag_law.h"
#include "slip_row.h"

#include <mpi.h>

#include <vector>

namespace LAMMPS_NS {

/* The communication of LAMMPS that the solver needs. */
class GhostExchange {
 public:
  virtual void send_to_ghosts(Field &) = 0;
  virtual void add_from_ghosts(Field &) = 0;

 protected:
  ~GhostExchange() = default;
};

/* Sums over contacts, disks and vertices. The stress over contacts is the sum of T_a r_b, where the
   tension T acts on the first of two; T_x r_y is conjugate to the strain. */
struct FlowSums {
  double elastic = 0.0, viscous = 0.0, xx = 0.0, yy = 0.0;
  double energy = 0.0, dissipation = 0.0, speed = 0.0, contacts = 0.0;
  // power of body forces beside the affine flow, and where the background drag alone resists them
  double pushed = 0.0, fall = 0.0;
  double walls[4] = {0.0, 0.0, 0.0, 0.0};    // forces on the lower and the upper one
};

/* Finds the velocities u at which drag balances the elastic forces F: B u = F - rate b, with B and
   b as in jamlab.rheology.damping, and, where the stress is given, the rate as well:
   b u + c rate = A (stress - elastic stress).

   Conjugate gradients start from the last velocities. B u = F - rate b always has a solution. What
   it leaves open, the motion of disks that nothing holds, stays zero: those disks follow the affine
   flow. With a power law, the velocities minimise R - F u, which is convex. Disks take Newton's
   steps, as short as it takes to lessen the residual; droplets find their drag coefficients again
   between rounds of conjugate gradients.

   An error e of the velocities of disks is judged by its energy e B e over the dissipated power, or
   the affine flow if it is larger: neither depends on the preconditioner. Each iteration
   takes a known part of this energy away. What is left is to what was taken as the squared norm of
   the residual by the preconditioner is to the first residual. The velocities of droplets
   are judged by the residual over what drives them, both in the norm of the preconditioner, which
   is nearly the inverse of the matrix.

   Droplets look ahead: their forces hold at the end of a step, F - ahead K (u - u_initial), since a
   vertex without contact has no drag, and the forces on it balance at every instant. */
class DragSolver {
 public:
  struct Settings {
    double tolerance = 1e-6;    // root of the energy of the error over the dissipated power
    double background = 0.0;    // drag of a particle against the affine flow, force per velocity
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
    double residual;    // relative, as the tolerance
    bool positive;      // the matrix, as far as was seen
  };

  DragSolver(MPI_Comm world, GhostExchange &exchange, const Settings &settings,
             const DragLaw &law) : world(world), exchange(exchange), settings(settings), law(law) {}
  virtual ~DragSolver() = default;

  // contacts at present positions; ahead: time over which forces follow the velocities, of droplets
  virtual void update_contacts(int nlocal, int nghost, double ahead) = 0;
  Result solve(Field &force, Field &u, Load &load);    // changes the force where pairs rub
  void set_solution(Field &u, double rate);    // of an earlier run, as if it were the solution
  // owned atoms whose velocities are given, and on which no background drags; per_rate: velocities
  // that a free rate gives them, over the rate
  virtual void hold(const std::vector<char> &atoms, const Field &per_rate);
  virtual void elastic_forces(Field &) const = 0;    // of the contacts of update_contacts
  // constant forces on owned atoms: as LAMMPS adds them, and without those on atoms that are held
  void set_body_forces(const Field &all, const Field &on_free)
  {
    applied = all;
    body = on_free;
  }
  void driving_forces(Field &) const;    // elastic and body forces
  double body_work(const Field &displacement) const;    // of this rank
  // force: in, those; out, at the end of the step; net: with drag, F - B u - b rate, of owned atoms
  void net_forces(Field &force, Field &u, double rate, Field &net);

  // A elastic stress that a free rate works against, with forces on what it carries along
  double driven_moment(const Field &force) const;
  bool resists_rate() const { return inverse_flow > 0.0; }    // a free one, in the last solution

  // at the velocities of the last solution
  virtual double elastic_moment() const = 0;    // elastic shear stress times area, of all ranks
  virtual FlowSums add_up(const Field &u, double rate) = 0;    // of all ranks
  virtual double least_relaxation_time() const = 0;    // of this rank: longer steps are unstable
  virtual bool touched(int /*i*/) const { return true; }    // i drags on anything
  // sum, of this rank, of forces times places from the centers of droplets whose areas are kept
  virtual double moment_of_kept(const Field &) const { return 0.0; }
  virtual double marginal_pairs() const { return 0.0; }    // of disks, whose gap tells no state
  virtual double memory_usage() const { return 6.0 * residual.capacity() * sizeof(Vec3); }

 protected:
  MPI_Comm world;
  GhostExchange &exchange;
  const Settings settings;
  const DragLaw law;
  int nlocal = 0, nghost = 0;
  double ahead = 0.0;
  Field applied, body;          // body forces; empty: none
  std::vector<char> given;      // marks owned atoms whose velocities are given; empty: none
  Field carried;                // velocities over the free rate that gives them; empty: none
  double inverse_flow = 0.0;    // inverse of c
  double affine_drag = 0.0;     // c, of disks
  bool factored = false;        // the preconditioner has factors of the matrix
  Field residual, descent;      // of conjugate gradients; descent = M^-1 residual
  int last_iterations = 0;
  Field initial_velocity;       // that the last solution started from
  double initial_rate = 0.0;
  bool needs_flow = true;       // of products: b p + c rate

  bool looks_ahead() const { return ahead > 0.0; }
  void make_room(int nlocal, int nghost);
  double sum(double) const;
  struct Residual {
    double flow, dissipation;    // of a free rate; power of these velocities, or of affine flow
  };
  Residual find_residual(const Field &force, Field &u, const Load &, bool moved);
  struct Goal {    // energy of the error: accuracy^2 of the whole, part of what is gained, or least
    double accuracy, part, least, dissipation;
  };
  struct Energies {    // taken from the error, and what is left of it; dissipation + gained
    double gained, left, whole;
    bool reached;    // the goal
  };
  Energies conjugate_gradients(Field &u, Load &, double r_flow, const Goal &, Result &);
  struct Descent {    // conjugate gradients so far; r_flow: residual of a free rate
    Goal goal;
    double r_flow;
    Energies found;
    int taken = 0;
    double rho_first = 0.0, rho_before = 0.0, gain = 0.0, step = 0.0;
    double p_flow = 0.0, product_flow = 0.0;
  };
  Descent begin_descent(const Goal &goal, double r_flow) const
  {
    return {goal, r_flow, {0.0, 0.0, goal.dissipation, false}};
  }
  bool goes_on(const Descent &d, const Result &result) const
  {
    return !d.found.reached && result.iterations < settings.iterations;
  }
  // an iteration; rho: descent . residual, of this rank; false: the last one
  bool iterate(Descent &, double rho, Field &u, Load &, Result &);
  Field direction, product_of_direction;    // of conjugate gradients

  enum Matrix { DRAG, TANGENT };    // B; B + ahead K, with the tangent of a power law if known
  // (p, rate) B (p, rate) and b p + c rate, of all ranks; flow: with the drag on what is carried
  struct Product {
    double power, flow, affine_flow;
  };
  // out = B p + b rate; also: another number of each rank to be summed
  virtual Product multiply(Field &p, double rate, Matrix, Field &out, double *also = nullptr,
                           FlowSums *drag = nullptr) = 0;
  virtual double precondition() = 0;    // descent; returns descent . residual, of this rank
  double precondition_free();           // the same, without atoms whose velocities are given

 private:
  Field product;

  virtual void find_weights(const Field &u, double rate) = 0;
  virtual void find_preconditioner(bool free_rate) = 0;
  virtual bool find_tangent(const Field &, double /*rate*/) { return false; }    // false: none
  // true: forces that keep rubbing pairs together have changed, and velocities are found again
  virtual bool enforce_constraints(Field &, Field &, Load &, Result &) { return false; }
  virtual std::vector<double> multipliers() const { return {}; }    // forces on each of those pairs
  virtual void set_multipliers(const std::vector<double> &) {}
  virtual double rounding() const = 0;    // energy that rounding of the forces leaves in any error

  struct State {    // of owned atoms, before or after a Newton step
    Field force, u;
    Load load;
    std::vector<double> held;
  };
  State state(const Field &force, const Field &u, const Load &) const;
  void line_search(const State &before, double rho, Field &force, Field &u, Load &load);
  double advance_forces(const Field &u, double rate, Field &force);
  // squared norm of the residual by the preconditioner: of two residuals it tells the smaller one
  double norm(double r_flow)
  {
    return sum(precondition_free()) + inverse_flow * r_flow * r_flow;
  }
  double driving_norm(const Field &force, const Load &);
};

}    // namespace LAMMPS_NS
