// SPDX-License-Identifier: GPL-2.0-or-later
#include "command_order.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "update.h"

#include <algorithm>
#include <array>
#include <vector>

using namespace LAMMPS_NS;

/* The sort of LAMMPS keeps the order of atoms in one bin. By opposite corners of the box as bins,
   one sort orders by one bit of the ID, from the lowest to the highest. A box of one bin is never
   sorted, and needs no order. */
void CommandOrder::command(int narg, char ** /*arg*/)
{
  if (narg) error->all(FLERR, "jamlab/order takes no arguments");
  if (comm->nprocs > 1) error->all(FLERR, "jamlab/order runs on one rank");
  if (!atom->tag_consecutive())
    error->all(FLERR, "jamlab/order needs atom IDs from 1 to the number of atoms");
  const int nlocal = atom->nlocal;
  std::vector<std::array<double, 3>> at(nlocal);    // by ID
  for (int i = 0; i < nlocal; i++) std::copy_n(atom->x[i], 3, at[atom->tag[i] - 1].begin());

  atom->nghost = 0;
  const bool sorted = update->first_update && atom->sortfreq > 0;    // by an earlier run, if at all
  double low[3] = {0.0, 0.0, 0.0}, high[3] = {1.0, 1.0, 1.0}, corners[2][3];
  domain->lamda2x(low, corners[0]);
  domain->lamda2x(high, corners[1]);
  for (int bit = 0; sorted && (nlocal - 1) >> bit; bit++) {
    for (int i = 0; i < nlocal; i++)
      std::copy_n(corners[((atom->tag[i] - 1) >> bit) & 1], 3, atom->x[i]);
    atom->sort();
  }
  for (int i = 0; i < nlocal; i++) std::copy_n(at[atom->tag[i] - 1].begin(), 3, atom->x[i]);
  if (nlocal) std::fill_n(atom->v[0], 3 * nlocal, 0.0);
  atom->map_clear();
  atom->map_set();
  update->reset_timestep(0, true);
}
