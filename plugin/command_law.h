// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "command.h"

namespace LAMMPS_NS {

/* The command `jamlab/law MODEL FILE` sets the variables of decks that a data file of jamlab says
   in its comment: the force law, and the sizes of disks. What `lmp -var` gives must agree. */
class CommandLaw : public Command {
 public:
  CommandLaw(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;
};

}    // namespace LAMMPS_NS
