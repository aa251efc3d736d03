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

struct BondLineTension::Row {    // of the bond list
  int i1, i2, type;
};

struct BondLineTension::Block {    // pull: tension over length
  double gamma[BLOCK], eta[BLOCK], ex[BLOCK], ey[BLOCK], length[BLOCK], pull[BLOCK];
};

/* An edge of zero length has no direction and pulls nowhere. The length is above zero even so. */
static double smoothed(double square, double eta)
{
  return sqrt(std::max(square + eta * eta, std::numeric_limits<double>::min()));
}

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

  Block block;
  const bool one_type = atom->nbondtypes == 1;
  std::fill_n(block.gamma, BLOCK, gamma[1]);
  std::fill_n(block.eta, BLOCK, eta[1]);
  for (int begin = 0; begin < neighbor->nbondlist; begin += BLOCK) {
    const auto rows = reinterpret_cast<const Row *>(neighbor->bondlist[begin]);
    const int count = std::min(BLOCK, neighbor->nbondlist - begin);
    for (int n = 0; !one_type && n < count; n++) {
      block.gamma[n] = gamma[rows[n].type];
      block.eta[n] = eta[rows[n].type];
    }
    measure(rows, count, block);
    add_pulls(rows, count, block);
  }
}

/* The square roots of a block do not wait for each other. */
void BondLineTension::measure(const Row *rows, int count, Block &block) const
{
  const auto x = reinterpret_cast<const Position *>(atom->x[0]);
  for (int n = 0; n < count; n++) {
    const double *const from = x[rows[n].i1], *const to = x[rows[n].i2];
    block.ex[n] = to[0] - from[0];
    block.ey[n] = to[1] - from[1];
  }
#pragma omp simd
  for (int n = 0; n < count; n++) {
    const double square = block.ex[n] * block.ex[n] + block.ey[n] * block.ey[n];
    block.length[n] = smoothed(square, block.eta[n]);
    block.pull[n] = block.gamma[n] / block.length[n];
  }
}

void BondLineTension::add_pulls(const Row *rows, int count, const Block &block)
{
  const auto f = reinterpret_cast<Position *>(atom->f[0]);
  const int nlocal = atom->nlocal, newton_bond = force->newton_bond;
  for (int n = 0; n < count; n++) {
    const int i1 = rows[n].i1, i2 = rows[n].i2;
    const double fx = block.pull[n] * block.ex[n], fy = block.pull[n] * block.ey[n];
    if (newton_bond || i1 < nlocal) {
      f[i1][0] += fx;
      f[i1][1] += fy;
    }
    if (newton_bond || i2 < nlocal) {
      f[i2][0] -= fx;
      f[i2][1] -= fy;
    }
  }
  if (!evflag) return;
  const bool whole = newton_bond && !vflag_either && !eflag_atom;
  double of_all = 0.0;
  for (int n = 0; n < count; n++) {
    const double ebond = block.gamma[n] * block.length[n];
    if (whole)
      of_all += ebond;
    else
      ev_tally(rows[n].i1, rows[n].i2, nlocal, newton_bond, ebond, -block.pull[n], block.ex[n],
               block.ey[n], 0.0);
  }
  energy += of_all;
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
