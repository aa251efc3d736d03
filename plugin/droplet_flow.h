// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "overdamped_flow.h"

namespace LAMMPS_NS {

/* Steps of droplets, which are too stiff for those of disks, and whose vertices may have no drag at
   all: backward differences of second order with steps of any length. With q the positions and u
   their velocities beside the affine flow, r the ratio of this step dt to the last one,

     q = q_last + r^2/(1 + 2 r) (q_last - q_before) + ahead u,   ahead = dt (1 + r)/(1 + 2 r).

   Forces are evaluated at the q of the mean velocity u* of two steps, and those at the end of the
   step are F - ahead K (u - u*). An extrapolated u* would open and close a contact in turn, step
   after step. Where the correction goes too far, or K is negative, a shorter step is taken from
   q_last: a droplet that slips past others moves as fast as drag allows, at once if nothing drags
   on it. */
class DropletFlow : public OverdampedFlow {
 public:
  using OverdampedFlow::OverdampedFlow;
  void setup() override;
  void begin_step() override;
  void end_step() override;
  std::vector<Field *> fields() override
  {
    return {&velocity, &last_velocity, &displacement, &last_displacement};
  }
  void keep(RestartBytes &) override;
  const tagint *particles() const override { return atom->molecule; }

 private:
  Field last_velocity, displacement, last_displacement;    // beside the flow, in a step each
  struct Last {    // step, none if its time is 0
    double time = 0.0, time_before = 0.0, strain = 0.0, rate_before = 0.0;
  } last;
  class DropletDrag *drag = nullptr;    // the solver
  double size = 1.0, energy_unit = 1.0;    // of a droplet, of contacts or tension
  double time_unit = 1.0;                  // in which drag relaxes
  struct Load {    // stress that is held, how much more the next step adds, and all are to add
    double held = 0.0, rise = 0.0, whole = 0.0;
    bool rises() const;    // by as much as may be divided
  } load;
  double lost = 0.0;             // energy per area, by the errors of all steps
  double implicit_time = 0.0;    // ahead, of the last step
  State initial;                 // at the start of the step

  std::unique_ptr<DragSolver> make_solver() override;
  double pushed_work() const;
  double held_stress() const override { return load.held + load.rise; }
  void correct(const Field &change, double strain);
  bool balances(double gap, double dissipation_before) const;
  void step_back();
  void adapt_step();
  void find_scales();
  double first_rate() const;
  [[noreturn]] void refuse() const;
};

}    // namespace LAMMPS_NS
