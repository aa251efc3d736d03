// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "polygon_topology.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"

#include <algorithm>
#include <string>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

void PolygonTopology::build(const char *caller)
{
  const std::string who(caller);
  if (domain->dimension != 2) error->all(FLERR, who + " requires a 2d simulation");
  if (!atom->molecule_flag) error->all(FLERR, who + " requires atoms with molecule IDs");
  if (atom->map_style == Atom::MAP_NONE)
    error->all(FLERR, who + " requires an atom map: use atom_modify map array");

  const tagint *tag = atom->tag;
  const tagint *molecule = atom->molecule;
  const int nlocal = atom->nlocal;

  tagint highest = 0, nmolecules;
  for (int i = 0; i < nlocal; i++) {
    if (molecule[i] < 0)
      error->one(FLERR, who + ": molecule ID of atom " + std::to_string(tag[i]) + " is negative");
    highest = std::max(highest, molecule[i]);
  }
  MPI_Allreduce(&highest, &nmolecules, 1, MPI_LMP_TAGINT, MPI_MAX, world);

  std::vector<tagint> low(nmolecules + 1, MAXTAGINT), high(nmolecules + 1, 0), size(nmolecules + 1, 0);
  for (int i = 0; i < nlocal; i++) {
    const tagint m = molecule[i];
    low[m] = std::min(low[m], tag[i]);
    high[m] = std::max(high[m], tag[i]);
    size[m]++;
  }

  first.resize(nmolecules + 1);
  last.resize(nmolecules + 1);
  std::vector<tagint> total(nmolecules + 1);
  MPI_Allreduce(low.data(), first.data(), nmolecules + 1, MPI_LMP_TAGINT, MPI_MIN, world);
  MPI_Allreduce(high.data(), last.data(), nmolecules + 1, MPI_LMP_TAGINT, MPI_MAX, world);
  MPI_Allreduce(size.data(), total.data(), nmolecules + 1, MPI_LMP_TAGINT, MPI_SUM, world);

  for (tagint m = 1; m <= nmolecules; m++) {
    if (total[m] == 0) continue;
    if (total[m] < 3)
      error->all(FLERR, who + ": polygon " + std::to_string(m) + " has " + std::to_string(total[m]) +
                     " vertices, needs at least 3");
    if (last[m] - first[m] + 1 != total[m])
      error->all(FLERR, who + ": vertices of polygon " + std::to_string(m) +
                     " must carry consecutive atom IDs in counter-clockwise order");
  }
}

/* ---------------------------------------------------------------------- */

int PolygonTopology::nearest(int i, tagint tag) const
{
  const int j = atom->map(tag);
  return j < 0 ? -1 : domain->closest_image(i, j);
}

int PolygonTopology::next(int i) const
{
  return nearest(i, next_tag(atom->tag[i], atom->molecule[i]));
}

int PolygonTopology::prev(int i) const
{
  return nearest(i, prev_tag(atom->tag[i], atom->molecule[i]));
}
