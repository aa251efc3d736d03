// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "command.h"

namespace LAMMPS_NS {

/* The command jamlab/quiet keeps the output of LAMMPS from the screen, but for warnings, errors,
   refusals and what the command print says. The log file has all of it. LAMMPS has no such command:
   a deck could not be quiet, only its user by -screen none. */
class CommandQuiet : public Command {
 public:
  CommandQuiet(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;
};

}    // namespace LAMMPS_NS
