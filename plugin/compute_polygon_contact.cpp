// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "compute_polygon_contact.h"

#include "atom.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "pair_circuloline.h"
#include "update.h"

#include <algorithm>

using namespace LAMMPS_NS;

static constexpr int COLUMNS = 11;

/* ---------------------------------------------------------------------- */

ComputePolygonContact::ComputePolygonContact(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), pair(nullptr), capacity(0)
{
  if (narg != 3) error->all(FLERR, "Compute polygon/contact takes no arguments");

  local_flag = 1;
  size_local_rows = 0;
  size_local_cols = COLUMNS;
}

/* ---------------------------------------------------------------------- */

ComputePolygonContact::~ComputePolygonContact()
{
  memory->destroy(array_local);
}

/* ---------------------------------------------------------------------- */

void ComputePolygonContact::init()
{
  pair = dynamic_cast<PairCirculoline *>(force->pair_match("circuloline", 1));
  if (!pair)
    error->all(FLERR, "Compute polygon/contact needs pair_style circuloline, once");
}

/* ---------------------------------------------------------------------- */

void ComputePolygonContact::compute_local()
{
  invoked_local = update->ntimestep;
  const tagint *tag = atom->tag;
  const tagint *molecule = atom->molecule;
  const int *mask = atom->mask;

  size_local_rows = 0;
  pair->for_each_contact([&](int vertex, PolygonFacings::Edge edge, const Foot &foot,
                             const PairLaw &law) {
    if (!(mask[vertex] & mask[edge.tail] & groupbit)) return;
    if (size_local_rows == capacity) {
      capacity = std::max(64, 2 * capacity);
      memory->grow(array_local, capacity, COLUMNS, "polygon/contact:array_local");
    }
    const PairCirculoline::Push push = PairCirculoline::push_on_vertex(foot, law);
    const double row[COLUMNS] = {
        static_cast<double>(molecule[vertex]), static_cast<double>(molecule[edge.tail]),
        static_cast<double>(tag[vertex]),      static_cast<double>(tag[edge.tail]),
        push.gap,                              push.magnitude,
        push.fx,                               push.fy,
        foot.dx,                               foot.dy,
        static_cast<double>(tag[edge.head])};
    std::copy_n(row, COLUMNS, array_local[size_local_rows++]);
  });
}

/* ---------------------------------------------------------------------- */

double ComputePolygonContact::memory_usage()
{
  return static_cast<double>(capacity) * COLUMNS * sizeof(double);
}
