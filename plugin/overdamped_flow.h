// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "atom.h"
#include "body_forces.h"
#include "domain.h"
#include "flow_settings.h"
#include "neighbor.h"
#include "pointers.h"
#include "restart_values.h"
#include "update.h"

#include <memory>
#include <string>

namespace LAMMPS_NS {

/* Overdamped simple shear: at every step drag balances the other forces. A rate, an
   oscillating strain or a stress drives the flow. What disks and droplets share stands here: the
   velocities at one instant, the numbers of the flow, and what limits a step. How they step from
   one instant to the next is in disk_flow.h and droplet_flow.h. */
class OverdampedFlow : protected Pointers {
 public:
  OverdampedFlow(LAMMPS *lmp, const FlowSettings &settings, GhostExchange &exchange) :
      Pointers(lmp), settings(settings), exchange(exchange), bodies(lmp) {}

  // A run calls init and setup, and, at each step, begin_step before forces and end_step after them
  void init(const std::vector<class Fix *> &pushes);    // fixes whose forces are body forces
  void find_body_forces();    // before others are added
  void check_held() const;    // the group of what does not move
  virtual void setup() = 0;
  virtual void begin_step() = 0;    // particles and box go to the end of the step
  virtual void end_step() = 0;      // finds the velocities there, and how long the next step is
  void forget_velocities();         // since something else has moved the particles
  // Particles may meet that the neighbor list does not know, whatever neigh_modify says. Half the
  // skin is left to the corrections of droplets, which come after.
  bool outran_neighbors() const { return approached > 0.5 * neighbor->skin; }
  bool begin_interval();    // where one has ended, or the flow begins; false: neither
  void set_time_step(double dt) { set_time_step(dt, update->ntimestep); }
  void set_time_step(double dt, bigint last);    // of steps after the last one

  virtual std::vector<Field *> fields() = 0;                  // that travel with atoms
  virtual void keep(RestartBytes &);        // in a restart file
  virtual const tagint *particles() const = 0;    // of which particle an atom is
  virtual bool owners_count_twice() const { return false; }    // both owners see a contact
  double column(int n) const;    // of the output, as in the manual
  const Field &velocities() const { return velocity; }    // beside the affine flow
  virtual double spin_length() const { return 1.0; }    // distance at which a spin is a velocity
  double memory_usage();

  static constexpr int COLUMNS = 22;

 protected:
  struct State {    // numbers alone
    double time = 0.0, strain = 0.0, rate = 0.0;
    double step = 0.0;    // that the error allows next; 0: nothing has moved yet
    double end = 0.0;     // of the present interval
    double work = 0.0, dissipated = 0.0;    // energies per area
    double unsettled = 0.0;    // times that no states of several pairs with a gap of zero fitted
    FlowSums sums;
  } state;
  FlowSettings settings;
  GhostExchange &exchange;
  std::unique_ptr<DragSolver> solver;
  Field velocity;              // beside the affine flow
  double approached = 0.0;     // by two particles at most, since neighbors were found
  double iterations = 0.0, last_iterations = 0.0;    // since the start, of the last solution

  virtual std::unique_ptr<DragSolver> make_solver() = 0;
  virtual double held_stress() const { return settings.stress; }
  void update_contacts(double ahead);
  DragSolver::Result find_velocities(bool with_forces = true);
  void add_up();

  // A step moves each atom, and then the box with the clock; the farthest displacement of all
  void move(int i, double dx, double dy, double strain);
  void advance(double strain, double farthest);
  void lean(double strain);
  double up_to_end(double step) const;
  bool interval_ended() const { return settings.interval > 0.0 && state.end <= state.time; }
  // length: that disks travel; phase: of an oscillation; rest: the step if nothing moves
  double longest_step(double length, double phase, double rest) const;

  double area() const { return domain->xprd * domain->yprd; }
  double stress() const { return (state.sums.elastic + state.sums.viscous) / area(); }
  double pushed() const { return state.sums.pushed / area(); }    // power, per area
  double dissipation() const { return state.sums.dissipation / area(); }    // per time and area
  double driven_rate() const;
  double typical_rate() const;
  double falling_speed() const;
  double given_strain(double time) const;    // that passes within it, if no stress is given
  double edge(int i) const;    // height of the edge of the box next to an atom
  double to_edge(int i) const { return edge(i) - (atom->x[i][1] - domain->boxlo[1]); }
  bool rides(int i) const;    // atom i, with a wall whose rate changes
  double over_ranks(double value, MPI_Op operation) const;
  std::string more_background() const;
  [[noreturn]] void refuse_velocities(const DragSolver::Result &) const;

 private:
  BodyForces bodies;
  Field forces;    // on every atom, but for the drag

  void hold_fixed();
  void remove_drift();
  void add_walls();
};

}    // namespace LAMMPS_NS
