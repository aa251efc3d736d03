// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "command.h"

namespace LAMMPS_NS {

/* The command jamlab/order puts atoms in the order of their IDs, at rest and at time step 0, as a
   data file leaves them. LAMMPS sorts atoms in space as it runs, from the order that they have:
   without this command, the last digits of sums depend on all that it ran before. */
class CommandOrder : public Command {
 public:
  CommandOrder(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;
};

}    // namespace LAMMPS_NS
