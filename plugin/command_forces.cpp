// SPDX-License-Identifier: GPL-2.0-or-later
#include "command_forces.h"

#include "atom.h"
#include "bond.h"
#include "comm.h"
#include "compute.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "modify.h"
#include "neighbor.h"
#include "pair.h"
#include "update.h"

#include <algorithm>

using namespace LAMMPS_NS;

/* The command does what a step of Verlet does to forces, without a virial. */
void CommandForces::command(int narg, char ** /*arg*/)
{
  if (narg) error->all(FLERR, "jamlab/forces takes no arguments");
  next_forces();
}

/* With stress, thermo keywords of the energy and of the pressure are current, as after a run. */
double CommandForces::next_forces(bool with_stress)
{
  if (update->first_update == 0)
    error->all(FLERR, "jamlab/forces continues a run: use run 0 first");
  if (force->angle || force->dihedral || force->improper || force->kspace || atom->torque_flag ||
      domain->box_change)
    error->all(FLERR, "jamlab/forces knows forces of pair and bond styles and of fixes alone, in a "
               "box that stays: use run 0, or remove angles, dihedrals, impropers, kspace, torques "
               "and fixes that change the box");

  update->ntimestep++;
  if (neighbor->decide())
    renew_neighbors();
  else
    comm->forward_comm();

  const int virial = !with_stress ? VIRIAL_NONE : force->newton_pair ? VIRIAL_FDOTR : VIRIAL_PAIR;
  modify->pre_force(virial);
  const int filled = atom->nlocal + (force->newton ? atom->nghost : 0);
  if (filled) std::fill_n(atom->f[0], 3 * filled, 0.0);
  if (force->pair) force->pair->compute(ENERGY_GLOBAL, virial);
  if (force->bond) force->bond->compute(ENERGY_GLOBAL, virial);
  modify->pre_reverse(ENERGY_GLOBAL, virial);
  if (force->newton) comm->reverse_comm();
  modify->post_force(virial);

  update->eflag_global = update->ntimestep;
  if (with_stress) {
    update->vflag_global = update->ntimestep;
    for (Compute *const pressure : modify->get_compute_by_style("^pressure$")) {
      pressure->compute_scalar();
      pressure->compute_vector();
    }
  }
  return modify->get_compute_by_id("thermo_pe")->compute_scalar();
}

void CommandForces::renew_neighbors()
{
  modify->pre_exchange();
  if (domain->triclinic) domain->x2lamda(atom->nlocal);
  domain->pbc();
  comm->exchange();
  if (atom->sortfreq > 0 && update->ntimestep >= atom->nextsort) atom->sort();
  comm->borders();
  if (domain->triclinic) domain->lamda2x(atom->nlocal + atom->nghost);
  modify->pre_neighbor();
  neighbor->build(1);
  modify->post_neighbor();
}
