// SPDX-License-Identifier: GPL-2.0-or-later
#include "pair_disk_drag.h"

#include "atom.h"
#include "citation.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "force.h"
#include "memory.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;

static constexpr double LAYOUT = -3.0;    // where the first restart files have beta, which is not negative

static constexpr char WHO[] = "Pair style disk/drag";
static constexpr double ROUNDING = 1e-12;    // of a mean of two diameters
static constexpr double LARGEST_EXPONENT = 10.0;    // beyond, forces of slight contacts have no digits

PairDiskDrag::PairDiskDrag(LAMMPS *lmp) : Pair(lmp), strength(nullptr), reach(nullptr)
{
  writedata = 1;
  comm_forward = 1;
  cite(lmp, CITE_CONTACT_DRAG);
}

PairDiskDrag::~PairDiskDrag()
{
  if (copymode || !allocated) return;
  memory->destroy(setflag);
  memory->destroy(cutsq);
  memory->destroy(strength);
  memory->destroy(reach);
}

void PairDiskDrag::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);
  found.clear();
  if (!sizes.empty()) {
    find_sizes();
    comm->forward_comm(this);
    if (neighbor->ago == 0) check_reach();
  }

  double **const x = atom->x, **const f = atom->f;
  const int *const type = atom->type;
  const int nlocal = atom->nlocal, newton_pair = force->newton_pair;
  double turning = 0.0;    // that virial_fdotr_compute takes for a moment of flat walls
  const auto act = [&](int i, int j, double dx, double dy, double factor) {
    const double rsq = dx * dx + dy * dy;
    const double s = contact_distance(i, j, type[i], type[j]), cutoff = s + 2.0 * shell;
    if (factor == 0.0) return;
    const double K = factor * stiffness(type[i], type[j], s);
    remember(i, j, -dx, -dy, cutoff, K);
    if (rsq >= cutoff * cutoff) return;
    if (rsq == 0.0)
      error->one(FLERR, "{}: atoms {} and {} are in one place, where their contact has no direction", WHO,
                 atom->tag[i], atom->tag[j]);

    const double r = sqrt(rsq);
    const Repulsion push = repulsion(K, cutoff - r);
    const double fpair = push.force / r;
    f[i][0] += dx * fpair;
    f[i][1] += dy * fpair;
    if (is_wall(j)) turning += (x[i][0] - x[j][0]) * dy * fpair;
    if (newton_pair || j < nlocal) {
      f[j][0] -= dx * fpair;
      f[j][1] -= dy * fpair;
    }
    if (evflag) ev_tally(i, j, nlocal, newton_pair, push.energy, 0.0, fpair, dx, dy, 0.0);
  };
  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    const int *const neighbors = list->firstneigh[i];
    for (int jj = 0; jj < list->numneigh[i]; jj++) {
      const int j = neighbors[jj] & NEIGHMASK;
      if (is_wall(i) || is_wall(j)) continue;
      act(i, j, x[i][0] - x[j][0], x[i][1] - x[j][1], force->special_lj[sbmask(neighbors[jj])]);
    }
  }
  for (int j = 0; j < nlocal; j++) {
    if (!is_wall(j)) continue;
    if (comm->nprocs > 1)
      error->one(FLERR, "{}: atom {} is a flat wall, of diameter 0: use one rank", WHO, atom->tag[j]);
    for (int i = 0; i < nlocal; i++)
      if (!is_wall(i)) act(i, j, 0.0, x[i][1] - x[j][1], 1.0);
  }
  if (vflag_fdotr) {
    virial_fdotr_compute();
    virial[3] -= turning;
  }
}

void PairDiskDrag::find_sizes()
{
  if (sizes.empty()) return;
  int is_double = 0, columns = 0;
  const int index = atom->find_custom(sizes.c_str(), is_double, columns);
  if (index < 0 || is_double != 1 || columns != 0)
    error->all(FLERR, "{}: no per-atom property d_{}: define it by fix property/atom d_{}", WHO, sizes, sizes);
  const double *const values = atom->dvector[index];
  own.assign(values, values + atom->nlocal);
  own.resize(atom->nlocal + atom->nghost);
}

/* neighbor lists reach as far as the s of two types */
void PairDiskDrag::check_reach() const
{
  std::vector<double> largest(atom->ntypes + 1, 0.0);
  for (int i = 0; i < atom->nlocal; i++) largest[atom->type[i]] = std::max(largest[atom->type[i]], own[i]);
  MPI_Allreduce(MPI_IN_PLACE, largest.data(), atom->ntypes + 1, MPI_DOUBLE, MPI_MAX, world);
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      const double s = 0.5 * (largest[i] + largest[j]);
      if (s > (1.0 + ROUNDING) * reach[i][j])
        error->all(FLERR,
                   "{}: disks of types {} and {} touch at {}, with diameters up to {} and {}, and pair_coeff lets "
                   "their neighbor lists reach {} only: raise its s",
                   WHO, i, j, s, largest[i], largest[j], reach[i][j]);
    }
}

int PairDiskDrag::pack_forward_comm(int n, int *list, double *buf, int /*pbc_flag*/, int * /*pbc*/)
{
  for (int k = 0; k < n; k++) buf[k] = own[list[k]];
  return n;
}

void PairDiskDrag::unpack_forward_comm(int n, int first, double *buf)
{
  std::copy_n(buf, n, own.begin() + first);
}

double PairDiskDrag::stiffness(int itype, int jtype, double s) const
{
  const double K = strength[itype][jtype];
  return power != 0.0 ? K * pow(s, power) : K;
}

void PairDiskDrag::remember(int i, int j, double x, double y, double cutoff, double K)
{
  const double share = force->newton_pair || j < atom->nlocal ? 1.0 : 0.5;
  const double di = diameter(i, atom->type[i]), dj = diameter(j, atom->type[j]);
  found.push_back({i, j, x, y, cutoff, K, 0.5 * di, 0.5 * dj, share});
}

double PairDiskDrag::mean_diameter()
{
  find_sizes();
  double total = 0.0;
  for (int i = 0; i < atom->nlocal; i++) total += diameter(i, atom->type[i]);
  MPI_Allreduce(MPI_IN_PLACE, &total, 1, MPI_DOUBLE, MPI_SUM, world);
  return atom->natoms > 0 ? total / static_cast<double>(atom->natoms) : 1.0;
}

void PairDiskDrag::allocate()
{
  allocated = 1;
  const int np1 = atom->ntypes + 1;
  memory->create(setflag, np1, np1, "pair:setflag");
  memory->create(cutsq, np1, np1, "pair:cutsq");
  memory->create(strength, np1, np1, "pair:strength");
  memory->create(reach, np1, np1, "pair:reach");
  for (int i = 0; i < np1; i++) std::fill_n(setflag[i], np1, 0);
}

/* pair_style disk/drag tau beta [alpha value] [arms radius|contact] [exponent value] [shell value] [sizes d_name]
   [power value] */
void PairDiskDrag::settings(int narg, char **arg)
{
  if (narg < 2 || narg % 2)
    error->all(FLERR,
               "{} needs: tau beta [alpha value] [arms radius|contact] [exponent value] [shell value] [sizes d_name] "
               "[power value]",
               WHO);

  law = DragLaw();
  exponent = 2.0;
  power = shell = 0.0;
  sizes.clear();
  law.tau = utils::numeric(FLERR, arg[0], false, lmp);
  law.beta = utils::numeric(FLERR, arg[1], false, lmp);
  for (int k = 2; k < narg; k += 2) {
    if (strcmp(arg[k], "alpha") == 0)
      law.alpha = utils::numeric(FLERR, arg[k + 1], false, lmp);
    else if (strcmp(arg[k], "exponent") == 0)
      exponent = utils::numeric(FLERR, arg[k + 1], false, lmp);
    else if (strcmp(arg[k], "shell") == 0)
      shell = utils::numeric(FLERR, arg[k + 1], false, lmp);
    else if (strcmp(arg[k], "power") == 0)
      power = utils::numeric(FLERR, arg[k + 1], false, lmp);
    else if (strcmp(arg[k], "sizes") == 0 && utils::strmatch(arg[k + 1], "^d_"))
      sizes = arg[k + 1] + 2;
    else if (strcmp(arg[k], "arms") == 0 && strcmp(arg[k + 1], "radius") == 0)
      law.arms_to_contact = false;
    else if (strcmp(arg[k], "arms") == 0 && strcmp(arg[k + 1], "contact") == 0)
      law.arms_to_contact = true;
    else
      error->all(
          FLERR,
          "{}: {} {} is not one of: alpha value, arms radius, arms contact, exponent value, shell value, sizes d_name, "
          "power value",
          WHO, arg[k], arg[k + 1]);
  }

  if (!(law.tau >= 0.0)) error->all(FLERR, "{}: tau {} must be a time, 0 for disks without contact drag", WHO, law.tau);
  if (!(law.beta >= 0.0 && law.beta <= LARGEST_BETA))
    error->all(FLERR, "{}: beta {} must lie between 0 and {}", WHO, law.beta, LARGEST_BETA);
  if (!(law.alpha >= LEAST_ALPHA && law.alpha <= 1.0))
    error->all(FLERR, "{}: alpha {} must lie between {} and 1 (linear); of the drag of thin films, it is 1/2 or 2/3",
               WHO, law.alpha, LEAST_ALPHA);
  if (power != 0.0 && sizes.empty()) error->all(FLERR, "{}: power {} is for disks with sizes d_name", WHO, power);
  if (!(exponent >= 2.0 && exponent <= LARGEST_EXPONENT))
    error->all(FLERR, "{}: exponent {} must lie between 2 (springs) and {}; Hertz: 2.5", WHO, exponent,
               LARGEST_EXPONENT);
  if (!(shell >= 0.0) || (shell > 0.0 && exponent != 2.0))
    error->all(FLERR, "{}: shell {} must be a length, 0 for disks that do not attract, and goes with exponent 2", WHO,
               shell);
}

/* pair_coeff i j K s, as of harmonic/cut where the exponent is 2 */
void PairDiskDrag::coeff(int narg, char **arg)
{
  if (narg != 4) error->all(FLERR, "{} needs: pair_coeff i j K s, E = K (s - r)^exponent", WHO);
  if (!allocated) allocate();

  int ilo, ihi, jlo, jhi;
  utils::bounds(FLERR, arg[0], 1, atom->ntypes, ilo, ihi, error);
  utils::bounds(FLERR, arg[1], 1, atom->ntypes, jlo, jhi, error);
  const double K = utils::numeric(FLERR, arg[2], false, lmp), s = utils::numeric(FLERR, arg[3], false, lmp);
  if (!(K > 0.0)) error->all(FLERR, "{}: K {} must be positive", WHO, arg[2]);
  if (!(s >= 0.0))
    error->all(FLERR, "{}: s {}, the sum of two radii, is negative; 0 is that of flat walls", WHO, arg[3]);

  int count = 0;
  for (int i = ilo; i <= ihi; i++)
    for (int j = std::max(jlo, i); j <= jhi; j++) {
      setflag[i][j] = 1;
      strength[i][j] = strength[j][i] = K;
      reach[i][j] = reach[j][i] = s;
      count++;
    }
  if (count == 0) error->all(FLERR, "{}: pair_coeff {} {} names no pair", WHO, arg[0], arg[1]);
}

void PairDiskDrag::init_style()
{
  if (domain->dimension != 2) error->all(FLERR, "{}: disks need dimension 2", WHO);
  find_sizes();
  neighbor->add_request(this);
}

/* nothing is mixed: the radius of a type is half its own s */
double PairDiskDrag::init_one(int i, int j)
{
  if (!setflag[i][j] || !setflag[i][i] || !setflag[j][j])
    error->all(FLERR, "{}: give pair_coeff {} {}, and those of each type with itself", WHO, i, j);
  strength[j][i] = strength[i][j];
  reach[j][i] = reach[i][j];
  return reach[i][j] + 2.0 * shell;
}

void PairDiskDrag::write_restart(FILE *fp)
{
  write_restart_settings(fp);
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      fwrite(&setflag[i][j], sizeof(int), 1, fp);
      fwrite(&strength[i][j], sizeof(double), 1, fp);
      fwrite(&reach[i][j], sizeof(double), 1, fp);
    }
}

void PairDiskDrag::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  allocate();
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      if (comm->me == 0) {
        utils::sfread(FLERR, &setflag[i][j], sizeof(int), 1, fp, nullptr, error);
        utils::sfread(FLERR, &strength[i][j], sizeof(double), 1, fp, nullptr, error);
        utils::sfread(FLERR, &reach[i][j], sizeof(double), 1, fp, nullptr, error);
      }
      MPI_Bcast(&setflag[i][j], 1, MPI_INT, 0, world);
      MPI_Bcast(&strength[i][j], 1, MPI_DOUBLE, 0, world);
      MPI_Bcast(&reach[i][j], 1, MPI_DOUBLE, 0, world);
    }
}

void PairDiskDrag::write_restart_settings(FILE *fp)
{
  const double values[] = {LAYOUT, law.beta, law.tau, law.alpha, law.arms_to_contact ? 1.0 : 0.0, exponent, power,
                           shell};
  const int size = static_cast<int>(sizes.size());
  fwrite(values, sizeof(double), 8, fp);
  fwrite(&size, sizeof(int), 1, fp);
  fwrite(sizes.data(), 1, size, fp);
}

void PairDiskDrag::read_restart_settings(FILE *fp)
{
  const auto read = [&](void *to, int size) {
    if (comm->me == 0) utils::sfread(FLERR, to, 1, size, fp, nullptr, error);
    MPI_Bcast(to, size, MPI_BYTE, 0, world);
  };
  double values[8];
  read(values, sizeof(values));
  if (values[0] != LAYOUT)
    error->all(FLERR, "Pair style disk/drag: the restart file was written by another version of this plugin: start "
               "from a data file");
  law = {values[1], values[2], values[3], values[4] != 0.0};
  exponent = values[5];
  power = values[6];
  shell = values[7];
  int size;
  read(&size, sizeof(int));
  sizes.resize(size);
  read(sizes.data(), size);
}

void PairDiskDrag::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++) fprintf(fp, "%d %.17g %.17g\n", i, strength[i][i], reach[i][i]);
}

void PairDiskDrag::write_data_all(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) fprintf(fp, "%d %d %.17g %.17g\n", i, j, strength[i][j], reach[i][j]);
}

double PairDiskDrag::single(int i, int j, int itype, int jtype, double rsq, double, double factor, double &fforce)
{
  const double s = contact_distance(i, j, itype, jtype);
  const double r = sqrt(rsq), depth = s + 2.0 * shell - r;
  fforce = 0.0;
  if (depth <= 0.0) return 0.0;
  const Repulsion push = repulsion(factor * stiffness(itype, jtype, s), depth);
  fforce = push.force / r;
  return push.energy;
}

void *PairDiskDrag::extract(const char *str, int &dim)
{
  dim = 2;
  if (strcmp(str, "k") == 0) return strength;
  if (strcmp(str, "cut") == 0) return reach;
  return nullptr;
}

double PairDiskDrag::memory_usage()
{
  return Pair::memory_usage() + found.capacity() * sizeof(DiskPair);
}
