// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "drag_solver.h"

namespace LAMMPS_NS {

inline constexpr char WHO[] = "Fix overdamped";    // begins all messages of a flow
// Codes in the messages of flows without an answer, by which Python tells them from wrong settings
inline constexpr char FLOW_SINGULAR[] = "[flow-singular]", FLOW_STUCK[] = "[flow-stuck]",
                      FLOW_SLIPS[] = "[flow-slips]", FLOW_CROSSES[] = "[flow-crosses]";

/* What the command fix overdamped says, read and checked. */
struct FlowSettings {
  enum Drive { NONE, RATE, OSCILLATE, STRESS } drive = NONE;
  double rate = 0.0, amplitude = 0.0, omega = 0.0, stress = 0.0;
  double tolerance = 1e-3;    // relative error of velocities that a step may make
  double longest = 0.0;       // step, 0: no limit
  double interval = 0.0;      // of time, after which a run ends; 0: never
  double fluid = 0.0;         // viscosity of the fluid around the particles
  DragSolver::Settings solver;
  DragLaw droplet_law = {0.0, 0.0, 1.0};    // that of disks is in their pair style
  bool droplet_law_given = false;
  int fixed_bit = 0;     // of the group of atoms that do not move; 0: there is none
  bool walls = false;    // they are two, which move with the edges of the box

  FlowSettings(class LAMMPS *, int narg, char **arg);
  bool free_rate() const { return drive == STRESS; }

 private:
  int read(LAMMPS *, int words, char **arg);
};

}    // namespace LAMMPS_NS
