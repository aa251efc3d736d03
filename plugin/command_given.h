// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "command.h"

namespace LAMMPS_NS {

/* The command jamlab/given refuses what `lmp -var` gives and the decks of jamlab do not take:
   LAMMPS itself defines any variable and says nothing of one that nobody reads. */
class CommandGiven : public Command {
 public:
  CommandGiven(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;
};

}    // namespace LAMMPS_NS
