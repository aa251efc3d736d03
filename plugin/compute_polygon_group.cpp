// SPDX-License-Identifier: GPL-2.0-or-later

#include "compute_polygon_group.h"

#include "atom.h"
#include "error.h"
#include "force.h"
#include "group.h"
#include "pair_circuloline.h"
#include "update.h"

using namespace LAMMPS_NS;

ComputePolygonGroup::ComputePolygonGroup(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), pair(nullptr), energy(0.0)
{
  if (narg != 4) error->all(FLERR, "Compute polygon/group/group needs one more group: compute ID group1 "
                            "polygon/group/group group2");
  const int other = group->find(arg[3]);
  if (other < 0) error->all(FLERR, "Compute polygon/group/group: there is no group {}", arg[3]);
  otherbit = group->bitmask[other];

  scalar_flag = vector_flag = 1;
  size_vector = 3;
  extscalar = extvector = 1;
  vector = new double[3]();
}

ComputePolygonGroup::~ComputePolygonGroup()
{
  delete[] vector;
}

void ComputePolygonGroup::init()
{
  pair = dynamic_cast<PairCirculoline *>(force->pair_match("circuloline", 1));
  if (!pair) error->all(FLERR, "Compute polygon/group/group needs pair_style circuloline, once");
}

double ComputePolygonGroup::compute_scalar()
{
  invoked_scalar = update->ntimestep;
  sum();
  return scalar = energy;
}

void ComputePolygonGroup::compute_vector()
{
  invoked_vector = update->ntimestep;
  sum();
}

void ComputePolygonGroup::sum()
{
  const int *mask = atom->mask;
  double sums[3] = {0.0, 0.0, 0.0};
  for (const Contact &contact : pair->present_contacts()) {
    const bool pushed = (mask[contact.vertex] & groupbit) && (mask[contact.tail] & otherbit);
    const bool pushes = (mask[contact.vertex] & otherbit) && (mask[contact.tail] & groupbit);
    if (!pushed && !pushes) continue;
    const PairCirculoline::ContactForce push = pair->contact_force(contact);
    const double sign = (pushed ? 1.0 : 0.0) - (pushes ? 1.0 : 0.0);
    sums[0] += push.energy;
    sums[1] += sign * push.fx;
    sums[2] += sign * push.fy;
  }
  MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE, MPI_SUM, world);
  energy = sums[0];
  vector[0] = sums[1];
  vector[1] = sums[2];
}
