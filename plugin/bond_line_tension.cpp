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

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

using namespace LAMMPS_NS;

static constexpr int BLOCK = 128;    // bonds

namespace {

struct Row {    // of the bond list
  int i1, i2, type;
};

/* An edge of zero length has no direction and pulls nowhere: its length is over zero all the same. */
double smoothed(double square, double eta)
{
  return sqrt(std::max(square + eta * eta, std::numeric_limits<double>::min()));
}

}    // namespace

BondLineTension::BondLineTension(LAMMPS *_lmp) :
    Bond(_lmp), gamma(nullptr), eta(nullptr)
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

  for (int begin = 0; begin < neighbor->nbondlist; begin += BLOCK)
    add_pulls(begin, std::min(BLOCK, neighbor->nbondlist - begin));
}

/* The roots of a block of bonds are taken side by side. */
void BondLineTension::add_pulls(int begin, int count)
{
  const auto bonds = reinterpret_cast<const Row *>(neighbor->bondlist[begin]);
  const auto x = reinterpret_cast<const Position *>(atom->x[0]);
  const auto f = reinterpret_cast<Position *>(atom->f[0]);
  const int nlocal = atom->nlocal, newton_bond = force->newton_bond;
  double ex[BLOCK], ey[BLOCK], length[BLOCK], pull[BLOCK];    // pull: over the length

  for (int n = 0; n < count; n++) {
    const double *const from = x[bonds[n].i1], *const to = x[bonds[n].i2];
    ex[n] = to[0] - from[0];
    ey[n] = to[1] - from[1];
    pull[n] = gamma[bonds[n].type];
    length[n] = eta[bonds[n].type];
  }
#pragma omp simd
  for (int n = 0; n < count; n++) {
    length[n] = smoothed(ex[n] * ex[n] + ey[n] * ey[n], length[n]);
    pull[n] /= length[n];
  }
  for (int n = 0; n < count; n++) {
    const auto [i1, i2, type] = bonds[n];
    const double fx = pull[n] * ex[n], fy = pull[n] * ey[n];
    if (newton_bond || i1 < nlocal) {
      f[i1][0] += fx;
      f[i1][1] += fy;
    }
    if (newton_bond || i2 < nlocal) {
      f[i2][0] -= fx;
      f[i2][1] -= fy;
    }
    if (evflag)
      ev_tally(i1, i2, nlocal, newton_bond, gamma[type] * length[n], -pull[n], ex[n], ey[n], 0.0);
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

double BondLineTension::single(int type, double rsq, int /*i*/, int /*j*/, double &fforce)
{
  const double length = smoothed(rsq, eta[type]);
  fforce = -gamma[type] / length;
  return gamma[type] * length;
}

void *BondLineTension::extract(const char *str, int &dim)
{
  dim = 1;
  if (strcmp(str, "gamma") == 0) return gamma;
  if (strcmp(str, "eta") == 0) return eta;
  return nullptr;
}
