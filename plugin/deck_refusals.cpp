// SPDX-License-Identifier: GPL-2.0-or-later
#include "deck_refusals.h"

#include "comm.h"
#include "error.h"
#include "input_members.h"
#include "lammps.h"
#include "utils.h"
#include "variable.h"

#include <fstream>

using namespace LAMMPS_NS;

std::map<std::string, std::string>
LAMMPS_NS::texts_of_variables(LAMMPS *lmp, const std::function<bool(const std::string &)> &wanted)
{
  Variable *const variable = lmp->input->variable;
  std::map<std::string, std::string> found;
  for (int i = 0; i < variable->nvar; i++) {
    if (!wanted(variable->names[i])) continue;
    const int style = styles_of(*variable)[i];
    const bool formula = style == Variable::ATOMFILE || style == Variable::INTERNAL ||
                         (style >= Variable::FORMAT && style <= Variable::PYTHON);
    const char *text = formula ? nullptr : variable->retrieve(variable->names[i]);
    if (text) found[variable->names[i]] = text;
  }
  return found;
}

void LAMMPS_NS::end_if_refused(LAMMPS *lmp, const std::vector<std::string> &wrong)
{
  int refused = !wrong.empty();
  if (lmp->comm->me == 0 && refused) {
    std::ofstream table;
    if (lmp->input->variable->find("table") >= 0)
      table.open(lmp->input->variable->retrieve("table"), std::ios::app);
    for (const auto &words : wrong) {
      utils::logmesg(lmp, "REFUSED: " + words + "\n");
      if (table.is_open()) table << "REFUSED: " << words << '\n';
    }
  }
  MPI_Bcast(&refused, 1, MPI_INT, 0, lmp->world);
  if (refused) lmp->error->done(1);
}
