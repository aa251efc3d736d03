// SPDX-License-Identifier: GPL-2.0-or-later
#include "bond_line_tension.h"

#include "atom.h"
#include "domain.h"
#include "edge_geometry.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "neighbor.h"
#include "restart_values.h"

#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;

BondLineTension::BondLineTension(LAMMPS *_lmp) :
    Bond(_lmp), rings(nullptr), gamma(nullptr), eta(nullptr)
{
  writedata = 1;
}

BondLineTension::~BondLineTension()
{
  if (allocated && !copymode) {
    memory->destroy(setflag);
    memory->destroy(gamma);
    memory->destroy(eta);
  }
}

void BondLineTension::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);

  const bool only_energy = !vflag_either && !eflag_atom;
  if (rings && only_energy && rings->add_tension_too(gamma[1], eta[1], energy)) return;
  if (neighbor->nbondlist == 0) return;
  const auto x = reinterpret_cast<const Position *>(atom->x[0]);
  const auto f = reinterpret_cast<Position *>(atom->f[0]);
  const int nlocal = atom->nlocal, newton_bond = force->newton_bond;

  for (int n = 0; n < neighbor->nbondlist; n++) {
    const int *const bond = neighbor->bondlist[n], i1 = bond[0], i2 = bond[1];
    const double delx = x[i1][0] - x[i2][0], dely = x[i1][1] - x[i2][1];
    double fbond;
    const double ebond = single(bond[2], delx * delx + dely * dely, i1, i2, fbond);
    if (newton_bond || i1 < nlocal) {
      f[i1][0] += delx * fbond;
      f[i1][1] += dely * fbond;
    }
    if (newton_bond || i2 < nlocal) {
      f[i2][0] -= delx * fbond;
      f[i2][1] -= dely * fbond;
    }
    if (evflag) ev_tally(i1, i2, nlocal, newton_bond, ebond, fbond, delx, dely, 0.0);
  }
}

void BondLineTension::init_style()
{
  if (domain->dimension != 2) error->all(FLERR, "Bond style line/tension requires a 2d simulation");
}

void BondLineTension::allocate()
{
  allocated = 1;
  const int np1 = atom->nbondtypes + 1;

  memory->create(gamma, np1, "bond:gamma");
  memory->create(eta, np1, "bond:eta");
  memory->create(setflag, np1, "bond:setflag");
  std::fill_n(setflag, np1, 0);
}

void BondLineTension::coeff(int narg, char **arg)
{
  if (narg < 2 || narg > 3)
    error->all(FLERR, "Bond style line/tension needs: bond_coeff type gamma [eta]");
  if (!allocated) allocate();

  int ilo, ihi;
  utils::bounds(FLERR, arg[0], 1, atom->nbondtypes, ilo, ihi, error);
  const double gamma_one = utils::numeric(FLERR, arg[1], false, lmp);
  const double eta_one = narg == 3 ? utils::numeric(FLERR, arg[2], false, lmp) : 0.0;
  if (gamma_one < 0.0) error->all(FLERR, "Bond style line/tension: gamma must not be negative");
  if (eta_one < 0.0) error->all(FLERR, "Bond style line/tension: eta must not be negative");

  for (int i = ilo; i <= ihi; i++) {
    gamma[i] = gamma_one;
    eta[i] = eta_one;
    setflag[i] = 1;
  }
}

void BondLineTension::write_restart(FILE *fp)
{
  fwrite(&gamma[1], sizeof(double), atom->nbondtypes, fp);
  fwrite(&eta[1], sizeof(double), atom->nbondtypes, fp);
}

void BondLineTension::read_restart(FILE *fp)
{
  allocate();
  read_everywhere(lmp, fp, &gamma[1], atom->nbondtypes);
  read_everywhere(lmp, fp, &eta[1], atom->nbondtypes);
  std::fill_n(&setflag[1], atom->nbondtypes, 1);
}

void BondLineTension::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->nbondtypes; i++)
    fprintf(fp, "%d %.17g %.17g\n", i, gamma[i], eta[i]);
}

/* An edge of zero length has no direction and pulls nowhere. */
double BondLineTension::single(int type, double rsq, int /*i*/, int /*j*/, double &fforce)
{
  const double length = sqrt(rsq + eta[type] * eta[type]);
  fforce = length > 0.0 ? -gamma[type] / length : 0.0;
  return gamma[type] * length;
}

void *BondLineTension::extract(const char *str, int &dim)
{
  dim = 1;
  if (strcmp(str, "gamma") == 0) return gamma;
  if (strcmp(str, "eta") == 0) return eta;
  return nullptr;
}
