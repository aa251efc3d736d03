// SPDX-License-Identifier: GPL-2.0-or-later
#include "fix_outline_energy.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "fix_polygon_outline.h"
#include "force.h"
#include "modify.h"
#include "update.h"
#include "utils.h"

#include <cmath>

using namespace LAMMPS_NS;
using jamlab::point, jamlab::Vector;

FixOutlineEnergy::FixOutlineEnergy(LAMMPS *lmp, int narg, char **arg, const char *who) :
    Fix(lmp, narg, arg), who(who), rings(lmp, who), energy(0.0)
{
  scalar_flag = 1;
  global_freq = 1;
  extscalar = 1;
  energy_global_flag = energy_peratom_flag = 1;
  virial_global_flag = virial_peratom_flag = 1;
  thermo_energy = thermo_virial = 1;
  centroidstressflag = CENTROID_NOTAVAIL;
  comm_reverse = 2;
}

int FixOutlineEnergy::setmask()
{
  return FixConst::POST_FORCE | FixConst::MIN_POST_FORCE;
}

void FixOutlineEnergy::post_constructor()
{
  FixPolygonOutline::shared(lmp, who);
}

void FixOutlineEnergy::init()
{
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "{}: works without run_style respa only", who);
  rings.init(groupbit);
}

void FixOutlineEnergy::post_force(int vflag)
{
  ev_init(update->eflag_atom == update->ntimestep ? ENERGY_ATOM : ENERGY_NONE, vflag);
  rings.refresh(groupbit);
  force.assign(atom->nlocal + atom->nghost, {0.0, 0.0});
  energy = 0.0;
  add_forces();
  comm->reverse_comm(this, 2);
  for (int i = 0; i < atom->nlocal; i++) {
    atom->f[i][0] += force[i].x;
    atom->f[i][1] += force[i].y;
  }
}

double FixOutlineEnergy::compute_scalar()
{
  double total;
  MPI_Allreduce(&energy, &total, 1, MPI_DOUBLE, MPI_SUM, world);
  return total;
}

int FixOutlineEnergy::pack_reverse_comm(int n, int first, double *buf)
{
  for (int k = 0; k < n; k++) jamlab::put(buf, k, force[first + k]);
  return 2 * n;
}

void FixOutlineEnergy::unpack_reverse_comm(int n, int *list, double *buf)
{
  for (int k = 0; k < n; k++) force[list[k]] += point(buf, k);
}

FixOutlineEnergy::Edge FixOutlineEnergy::edge(int from, int to) const
{
  const Vector r = point(atom->x[to], 0) - point(atom->x[from], 0);
  return {r, std::sqrt(dot(r, r))};
}

void FixOutlineEnergy::tally(int i, double share, const Virial &v)
{
  double six[6] = {v.xx, v.yy, 0.0, v.xy, 0.0, 0.0};
  if (vflag_either) v_tally(i, six);
  if (eflag_atom) eatom[i] += share;
}

double FixOutlineEnergy::positive(LAMMPS *lmp, const char *who, const char *what,
                                  const char *argument)
{
  const double value = utils::numeric(FLERR, argument, false, lmp);
  if (!(value >= 0.0)) lmp->error->all(FLERR, "{}: {} = {} must not be negative", who, what, value);
  return value;
}

std::vector<FixOutlineEnergy *> FixOutlineEnergy::all_of(LAMMPS *lmp)
{
  std::vector<FixOutlineEnergy *> found;
  for (Fix *const fix : lmp->modify->get_fix_by_style("^polygon/"))
    if (auto *const law = dynamic_cast<FixOutlineEnergy *>(fix)) found.push_back(law);
  return found;
}
