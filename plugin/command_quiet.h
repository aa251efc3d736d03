// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_COMMAND_QUIET_H
#define JAMLAB_COMMAND_QUIET_H

#include "command.h"

namespace LAMMPS_NS {

/* jamlab/quiet COMMAND: run a command of LAMMPS without its output on the
   screen. The log file keeps everything, warnings are shown, and an error
   shows all that was withheld. */

class CommandQuiet : public Command {
 public:
  CommandQuiet(class LAMMPS *lmp) : Command(lmp) {}
  void command(int, char **) override;
};

}    // namespace LAMMPS_NS

#endif
