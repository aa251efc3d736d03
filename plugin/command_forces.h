// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "command.h"

namespace LAMMPS_NS {

/* The command jamlab/forces finds the energy and forces at positions that were changed since the
   last run. It counts as a step, but sets nothing up and prints nothing, which takes a third of the
   time of "run 1 pre no post no" for some thousand atoms. */
class CommandForces : public Command {
 public:
  CommandForces(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;

 protected:
  double next_forces(bool with_stress = false);    // energy

 private:
  void renew_neighbors();
};

}    // namespace LAMMPS_NS
