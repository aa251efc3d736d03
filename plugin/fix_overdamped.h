// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "disk_drag.h"
#include "fix.h"

#include <array>
#include <memory>
#include <string>

namespace LAMMPS_NS {

/* Simple shear of disks or droplets without mass: at every step drag balances the other forces. The
   fix finds the velocities, moves disks and vertices, and strains the box along x, which it flips
   when it leans too far. The step is as long as accuracy allows. What drives the flow is a rate, an
   oscillating strain or a stress.

   Steps of disks are of third order and end where contacts open or close. Droplets are too stiff
   for them, and vertices without contact may have no drag at all: theirs are backward differences
   of second order, linearised where their prediction ends. */

// Codes in the messages of flows without an answer, by which Python tells them from wrong settings
inline constexpr char FLOW_SINGULAR[] = "[flow-singular]", FLOW_STUCK[] = "[flow-stuck]", FLOW_SLIPS[] = "[flow-slips]",
                      FLOW_CROSSES[] = "[flow-crosses]";

class FixOverdamped : public Fix, private GhostExchange {
 public:
  FixOverdamped(class LAMMPS *, int, char **);
  ~FixOverdamped() override;
  int setmask() override;
  void post_constructor() override;
  void init() override;
  void setup(int) override;
  void initial_integrate(int) override;
  void pre_exchange() override;
  void final_integrate() override;
  void post_run() override;
  double compute_vector(int) override;
  void write_restart(FILE *) override;
  void restart(char *) override;
  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;
  int pack_reverse_comm(int, int, double *) override;
  void unpack_reverse_comm(int, int *, double *) override;
  void grow_arrays(int) override;
  void copy_arrays(int, int, int) override;
  void set_arrays(int) override;
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;
  int pack_restart(int, double *) override;
  void unpack_restart(int, int) override;
  int size_restart(int) override { return PER_ATOM + 1; }
  int maxsize_restart() override { return PER_ATOM + 1; }
  double memory_usage() override;

 private:
  static constexpr int PER_ATOM = 12;    // numbers of four motions, which travel with an atom
  enum Drive { NONE, RATE, OSCILLATE, STRESS } drive = NONE;
  double wanted_rate = 0.0, amplitude = 0.0, omega = 0.0, wanted_stress = 0.0;
  double tolerance = 1e-3;    // relative error of velocities that a step may make
  double longest = 0.0;       // step, 0: no limit
  double interval = 0.0;      // of time, after which a run ends; 0: never
  double fluid = 0.0;         // viscosity of the fluid around the particles
  DragSolver::Settings settings;
  DragLaw droplet_law;        // that of disks is in their pair style
  bool droplet_law_given = false;
  int fixed_bit = 0;          // of the group of atoms that do not move; 0: there is none
  bool walls = false;         // they are two, which move with the edges of the box

  bool droplets = false;
  std::unique_ptr<DragSolver> solver;
  DiskDrag *disks = nullptr;    // the solver, of disks
  std::vector<DiskDrag::MarginalContact> restored;    // from a restart file
  double length_unit = 1.0;     // mean diameter of disks
  double approached = 0.0;      // by two disks or vertices at most, since neighbors were found
  double user_time_step = 0.0;  // that the fix changes
  bool stopped = false;         // this run, at the end of an interval
  class Compute *virial = nullptr, *energy = nullptr;    // of the forces on droplets
  bigint last_timestep = -1;    // of the last run, at which the velocities of droplets hold
  Field velocity, last_velocity;    // of this step, and, of droplets, of the last one
  Field displacement, last_displacement;    // droplets: beside the flow, in the last two steps
  Field &acceleration() { return last_velocity; }    // of disks, over the last step
  std::array<Field *, 4> fields() { return {&velocity, &last_velocity, &displacement, &last_displacement}; }
  Field forces;             // on every atom, but for the drag
  Field *traveling = nullptr;
  double implicit_time = 0.0;    // droplets: in which a new velocity counts in the last step
  int flip = 0;

  struct State {    // what a restart file keeps: numbers alone
    double time = 0.0, strain = 0.0, rate = 0.0, rate_before = 0.0, strain_step = 0.0;
    double step = 0.0;         // that the error allows next; 0: nothing has moved yet
    double last_step = 0.0, step_before = 0.0;
    double end = 0.0;          // of the present interval
    double work = 0.0, dissipated = 0.0;    // energies per area
    double iterations = 0.0;
    double unsettled = 0.0;    // times that no states of several pairs with a gap of zero fitted
    double gap_time = 0.0;     // in which gaps of rubbing disks close: an earlier longest step
    double gap = 0.0;          // energy per area that steps of droplets have lost, by their errors
    FlowSums sums;
  } state;
  static constexpr int KEPT = sizeof(State) / sizeof(double);
  static constexpr double LAYOUT = -KEPT;    // of a restart file; up to 0.2.0 there is a time

  using Weights = std::array<double, 3>;
  struct Stage {    // of a step of disks
    Field velocities;    // as the box leans at the start of the step
    double rate = 0.0, stress = 0.0, dissipation = 0.0;
    std::vector<double> thetas;
  } stages[3];
  struct Plan {     // the next step of disks: part `time` of a whole one
    bool made = false;
    double time = 0.0, step = 0.0, strain = 0.0, work = 0.0, dissipated = 0.0, next_step = 0.0, longest = 0.0;
    Field displacement, extrapolated;
    std::vector<DiskDrag::Change> changes;    // that happen in it
  } plan;

  State at_start;    // of the step
  int last_iterations = 0;

  void read_arguments(int narg, char **arg);
  void read_droplet_law(char **arg);
  double number(const char *keyword, const char *text) const;
  void check() const;
  void check_forces() const;
  void forget_velocities();

  void make_solver();
  DragSolver::Result find_velocities(bool with_forces = true);
  void start_droplets();
  void start_disks();
  bool fit(const DragSolver::Result &, double least_speed) const;
  void relax_ties(const std::vector<double> &parts, double least_speed);
  void plan_disks();
  void move_disks();
  double try_stages(double step);
  double strain_after(double time, double step) const;
  double up_to_changes(double step, double allowed);
  void keep_neighbors(double farthest, double strain);
  void end_interval();
  double finite_size_factor() const;
  static Weights dense_weights(double part);
  static Weights ahead_weights(double part);
  void predict_droplets(double dt, double strain_step);
  bool correct_droplets(const Field &predicted, double predicted_rate, const DragSolver::Result &);
  void step_back();
  double droplet_error() const;
  bool balances(double gap, double dissipation_before) const;
  static double repeated(double ratio);
  double droplet_strain_step(double dt) const;
  [[noreturn]] void refuse(const DragSolver::Result &) const;
  std::string more_background() const;
  void remove_drift();
  double to_edge(int i) const;
  void hold_fixed();
  bool rides(int i) const { return walls && drive != RATE && (atom->mask[i] & fixed_bit); }
  void add_walls();
  void add_up();
  void lean(double strain);
  double driven_rate() const;
  void move_back();
  double typical_rate() const { return drive == OSCILLATE ? amplitude * omega : fabs(state.rate); }
  double time_unit() const;    // of droplets
  double next_strain_step(double dt) const;
  void adapt_step();
  double up_to_end(double step) const;
  void set_time_step(double dt);
  double longest_step() const;
  double area() const;
  double stress() const { return (state.sums.elastic + state.sums.viscous) / area(); }
  double dissipation() const { return state.sums.dissipation / area(); }    // per time and area

  void send_to_ghosts(Field &) override;
  void add_from_ghosts(Field &) override;
};

}    // namespace LAMMPS_NS
