// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "drag_law.h"
#include "slip_row.h"

#include <mpi.h>

#include <vector>

namespace LAMMPS_NS {

/* What the solver needs of LAMMPS. */
class GhostExchange {
 public:
  virtual void send_to_ghosts(Field &) = 0;
  virtual void add_from_ghosts(Field &) = 0;

 protected:
  ~GhostExchange() = default;
};

/* Sums over contacts, disks and vertices. Stress over contacts is the sum of T_a r_b with the tension T
   that acts on the first of two; conjugate to the strain is T_x r_y. */
struct FlowSums {
  double elastic = 0.0, viscous = 0.0, xx = 0.0, yy = 0.0, energy = 0.0, dissipation = 0.0, speed = 0.0,
         contacts = 0.0;
  double walls[4] = {0.0, 0.0, 0.0, 0.0};    // x and y of the force on the lower and on the upper one
};

/* Velocities at which drag balances elastic forces at every instant: B u = F - rate b, with B and
   b as in jamlab.rheology.damping, and, where the stress is given, for the rate as well:
   b u + c rate = A (stress - elastic stress).

   Conjugate gradients over the list of contacts, from the last velocities; each atom's own block of
   B is the preconditioner. B u = F - rate b always has a solution, and what it leaves open (disks
   that nothing holds) stays zero: those disks follow the affine flow. Of a power law, the velocities are those
   where R - F u is least, which is convex: steps of disks are Newton's, as short as it takes to lessen the residual;
   of droplets, drag coefficients are found again between rounds of conjugate gradients.

   An error e of the velocities is judged by its energy e B e over the dissipated power, or that of affine flow if that
   is larger: neither depends on the preconditioner. Each iteration takes a known part of this energy away. What is
   left is to what was taken as the squared norm of the residual by the preconditioner is to that of the first one.

   Velocities of droplets are judged by the residual over what drives them, both in the norm of the preconditioner,
   which are factors of nearly the whole matrix.

   Droplets look ahead: forces are taken at the end of a step, F - ahead K (u - start), since a vertex
   without contact has no drag, and its forces balance at every instant. */
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

  DragSolver(MPI_Comm world, GhostExchange &exchange, const Settings &settings, const DragLaw &law) :
      world(world), exchange(exchange), settings(settings), law(law) {}
  virtual ~DragSolver() = default;

  // contacts at present positions; ahead: time over which forces follow the velocities, of droplets
  virtual void update_contacts(int nlocal, int nghost, double ahead) = 0;
  virtual void zero_rattler_velocities(Field &) {}    // of those that nothing holds
  Result solve(Field &force, Field &u, Load &load);    // force: changed where pairs are held
  void set_solution(Field &u, double rate);    // of a run before, as if it were the solution
  // owned atoms whose velocities stay as they are, and on which no background drags
  virtual void hold(const std::vector<char> &atoms) { given = atoms; }
  virtual void elastic_forces(Field &) const = 0;    // of contacts from update_contacts
  // force: in, of these; out, at the end of the step; net: with drag, F - B u - b rate, on owned atoms
  void net_forces(Field &force, Field &u, double rate, Field &net);

  // at the velocities of the last solution
  virtual double elastic_moment() const = 0;    // elastic shear stress times area, of all ranks
  virtual FlowSums add_up(const Field &u, double rate) = 0;    // of all ranks
  virtual double least_relaxation_time() const = 0;    // of this rank: longer steps are unstable
  virtual bool touched(int i) const { return inverse[i].xx > 0.0; }    // i drags on anything
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
  std::vector<char> given;      // owned atoms whose velocities are; empty: none
  double inverse_flow = 0.0;    // of c
  double affine_drag = 0.0;     // c, of disks
  bool factored = false;    // the preconditioner is by factors of the matrix
  Field residual, descent;    // of conjugate gradients; descent = M^-1 residual
  int last_iterations = 0;
  Field start;                // velocities that the last solution started from
  double start_rate = 0.0;
  bool needs_flow = true;       // of products: b p + c rate

  void make_room(int nlocal, int nghost);
  double sum(double) const;
  double speed_floor(double squares, double count) const;
  virtual double precondition();    // descent = M^-1 residual; returns their product, of this rank
  double precondition_free();
  struct Residual {
    double flow, dissipation;    // of a free rate; power of these velocities, or of affine flow
  };
  Residual find_residual(const Field &force, Field &u, const Load &, bool moved);
  double follow(const Field &u, double rate, Field &force);    // less ahead K (u - start)
  struct Goal {    // energy of the error: accuracy^2 of the whole, part of what is gained, or least
    double accuracy, part, least, dissipation;
  };
  struct Energies {    // taken from the error, and what is left of it; dissipation + gained
    double gained, left, whole;
    bool reached;    // the goal
  };
  Energies conjugate_gradients(Field &u, Load &, double r_flow, const Goal &, Result &);

 private:
  Field direction, product, product_of_direction;

  virtual void find_weights(const Field &u, double rate) = 0;
  virtual void find_preconditioner(bool free_rate) = 0;    // the blocks `inverse`
  // out = B p + b rate; power = (p, rate) B (p, rate); flow = b p + c rate, of all ranks, as `also`
  virtual void multiply(Field &p, double rate, Field &out, double &power, double &flow) = 0;
  // the same of B + ahead K
  virtual void multiply_ahead(Field &p, double rate, Field &out, double &power, double &flow,
                              double *also = nullptr) = 0;
  virtual bool looks_ahead() const { return false; }
  // multiply_ahead is now by the slope of the drag of a power law at these velocities; false: unknown
  virtual bool find_slopes(const Field &, double /*rate*/) { return false; }
  // hold what a linear solution leaves free; true: it has changed, and velocities are found again
  virtual bool enforce_constraints(Field &, Field &, Load &, Result &) { return false; }
  virtual std::vector<double> multipliers() const { return {}; }    // forces on each of those pairs
  virtual void set_multipliers(const std::vector<double> &) {}
  virtual double rounding() const = 0;    // energy that rounding of the forces leaves in any error

  struct State {    // of owned atoms; kept from step to step, since ghosts of a few disks are many
    Field force, u;
    double rate, moment;
    std::vector<double> held;
  };
  State before, after;    // a step of Newton's
  void keep(State &, const Field &force, const Field &u, const Load &) const;
  void take_step(double keep, double step, Field &u);
  void line_search(double rho, Field &force, Field &u, Load &);
  double norm(double r_flow);
  double driving_norm(const Field &force, const Load &);
};

}    // namespace LAMMPS_NS
