// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "disk_drag.h"
#include "force.h"
#include "overdamped_flow.h"

#include <array>

namespace LAMMPS_NS {

/* Steps of disks: Runge and Kutta's of third order, Bogacki & Shampine, Appl. Math. Lett. 2, 321
   (1989), with stages at 0, 1/2 and 3/4 of the step, in coordinates that lean with the box.
   Contacts are held over a step, so that velocities are smooth in it. A step ends where gaps open
   or close, as soon as what is dragged too much or too little since then is an error of the size
   that the step may make. */
class DiskFlow : public OverdampedFlow {
 public:
  using OverdampedFlow::OverdampedFlow;
  void setup() override { end_step(); }
  void begin_step() override;
  void end_step() override;
  std::vector<Field *> fields() override { return {&velocity, &acceleration}; }
  void keep(RestartBytes &) override;
  const tagint *particles() const override { return atom->tag; }
  double spin_length() const override { return drag->spin_length(); }
  bool owners_count_twice() const override { return !force->newton_pair; }

 private:
  using Weights = std::array<double, 3>;    // of the three stages
  DiskDrag *drag = nullptr;                 // the solver
  std::vector<DiskDrag::MarginalContact> marginal;    // of a restart file, or of the run before
  Field acceleration;           // over the last step
  double diameter = 1.0;        // mean one
  double gap_time = 0.0;        // in which gaps of rubbing disks close: an earlier longest step
  struct Stage {
    Field velocities;    // as the box leans at the start of the step
    double rate = 0.0, stress = 0.0, dissipation = 0.0, pushed = 0.0;
    std::vector<double> thetas;
  } stages[3];
  struct Plan {    // the next step: part `time` of a whole one
    bool made = false;
    double time = 0.0, step = 0.0, next_step = 0.0, longest = 0.0;
    std::vector<DiskDrag::Change> changes;    // that happen in it
  } plan;

  std::unique_ptr<DragSolver> make_solver() override;
  void settle_contacts();
  bool fit(const DragSolver::Result &, double least_speed) const;
  void relax_ties(const std::vector<double> &parts, double least_speed);
  void make_plan(bigint last);    // of the step after the last one
  double choose_step(double allowed);
  double try_stages(double step);
  void keep_stage(int stage, const Field &u, double strain);
  double strain_after(double time, double step) const;
  std::vector<DiskDrag::Change> find_changes(double step) const;
  double up_to_changes(double step, double allowed);
  double finite_size_factor() const;
  static Weights dense_weights(double time, double step);
  static Weights ahead_weights(double part);
};

}    // namespace LAMMPS_NS
