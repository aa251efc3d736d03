// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

namespace LAMMPS_NS {

class LAMMPS;

/* Values of the variables that are texts, for those names: all but formulas, and variables that
   print or run them. */
std::map<std::string, std::string>
texts_of_variables(LAMMPS *lmp, const std::function<bool(const std::string &)> &wanted);

/* Ends LAMMPS with code 1, as decks do, if rank 0 has found anything wrong: each on the screen, in
   the log and in the file `table`, if that variable exists. */
void end_if_refused(LAMMPS *lmp, const std::vector<std::string> &wrong);

}    // namespace LAMMPS_NS
