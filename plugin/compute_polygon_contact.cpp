// SPDX-License-Identifier: GPL-2.0-or-later
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

ComputePolygonContact::ComputePolygonContact(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), pair(nullptr), capacity(0)
{
  if (narg != 3) error->all(FLERR, "Compute polygon/contact takes no arguments");

  local_flag = 1;
  size_local_rows = 0;
  size_local_cols = COLUMNS;
}

ComputePolygonContact::~ComputePolygonContact()
{
  memory->destroy(array_local);
}

void ComputePolygonContact::init()
{
  pair = dynamic_cast<PairCirculoline *>(force->pair_match("circuloline", 1));
  if (!pair)
    error->all(FLERR, "Compute polygon/contact needs pair_style circuloline, once");
}

void ComputePolygonContact::compute_local()
{
  invoked_local = update->ntimestep;
  const tagint *tag = atom->tag;
  const tagint *molecule = atom->molecule;
  const int *mask = atom->mask;

  size_local_rows = 0;
  for (const Contact &contact : pair->present_contacts()) {
    const PairCirculoline::End tail = pair->end(contact.tail), head = pair->end(contact.head);
    if (!(mask[contact.vertex] & tail.mask & groupbit)) continue;
    if (size_local_rows == capacity) {
      capacity = std::max(64, 2 * capacity);
      memory->grow(array_local, capacity, COLUMNS, "polygon/contact:array_local");
    }
    const auto [gap, energy, magnitude, f] = pair->contact_force(contact);
    const tagint ids[] = {molecule[contact.vertex], tail.molecule, tag[contact.vertex],
                          tail.tag};
    const jamlab::Vector &r = contact.foot.r;
    const double numbers[] = {gap, magnitude, f.x, f.y, r.x, r.y};
    double *const row = std::copy_n(ids, 4, array_local[size_local_rows++]);
    *std::copy_n(numbers, 6, row) = static_cast<double>(head.tag);
  }
}
