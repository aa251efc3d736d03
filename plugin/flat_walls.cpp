// SPDX-License-Identifier: GPL-2.0-or-later
#include "flat_walls.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "gather_records.h"
#include "neigh_list.h"
#include "neighbor.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

bool FlatWalls::shared() const
{
  return comm->nprocs > 1 && !walls.empty();
}

/* The lowest image along y at this height above a wall, or higher. */
int FlatWalls::image_above(double height) const
{
  return static_cast<int>(std::ceil(height / domain->yprd));
}

void FlatWalls::build(const NeighList *list, const ContactLaws &laws)
{
  std::vector<Wall> own;
  for (int i = 0; i < atom->nlocal; i++)
    if (laws.flat(atom->type[i]))
      own.push_back({atom->tag[i], atom->molecule[i], atom->type[i], atom->mask[i], comm->me, i,
                     atom->x[i][1]});
  walls = gather_records(own, world);
  std::sort(walls.begin(), walls.end());

  rows.clear();
  for (int ii = 0; ii < list->inum && !walls.empty(); ii++) {
    const int i = list->ilist[ii], type = atom->type[i];
    if (laws.disk(type)) continue;
    for (std::size_t w = 0; w < walls.size(); w++) {
      const double own = laws.initial_reach[type][walls[w].type];    // negative: another style's
      if (own < 0.0) continue;
      const double reach = own + neighbor->skin, above = atom->x[i][1] - walls[w].y;
      const int law = PairLaws::number(atom->ntypes, type, walls[w].type, 0);
      const int lowest = image_above(above - reach), highest = image_above(above + reach) - 1;
      if (!domain->yperiodic && std::fabs(above) < reach)
        rows.push_back({i, static_cast<int>(w), law, 0});
      for (int image = lowest; domain->yperiodic && image <= highest; image++)
        rows.push_back({i, static_cast<int>(w), law, image});
    }
  }
}

void FlatWalls::update()
{
  std::vector<double> heights(walls.size(), 0.0);
  for (std::size_t w = 0; w < walls.size(); w++)
    if (walls[w].rank == comm->me) heights[w] = atom->x[walls[w].index][1];
  if (shared())
    MPI_Allreduce(MPI_IN_PLACE, heights.data(), extra(), MPI_DOUBLE, MPI_SUM, world);
  for (std::size_t w = 0; w < walls.size(); w++) walls[w].y = heights[w];
}

const std::vector<Contact> &FlatWalls::find(const Position *x, const PairLaws &laws)
{
  const int nall = atom->nlocal + atom->nghost;
  found.clear();
  for (const Row &row : rows) {
    const double r = x[row.i][1] - walls[row.wall].y - row.image * domain->yprd;
    if (r * r >= laws[row.law].reachsq) continue;
    const int end = shared() ? nall + row.wall : walls[row.wall].index;
    found.push_back({row.i, end, end, row.law, {{0.0, r}, r * r, 0.0}});
  }
  return found;
}
