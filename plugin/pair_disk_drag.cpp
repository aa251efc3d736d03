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
#include "restart_values.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;

static constexpr double LAYOUT = -4.0;    // the first restart files have beta, >= 0, in its place

static constexpr char WHO[] = "Pair style disk/drag";
static constexpr double ROUNDING = 1e-12;    // of a mean of two diameters
static constexpr double LARGEST_EXPONENT = 10.0;    // beyond, slight contacts have no digits
// Of the cutoff: steps of the force from which a stiffness follows, to 1e-11 of it where the force
// has six derivatives (Lennard-Jones), and the depth at which the last force is asked
static constexpr double STEP = 1e-4, EDGE = 1e-9;

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
  double turning = 0.0;    // what virial_fdotr_compute takes for a moment of flat walls
  const auto act = [&](int i, int j, double dx, double dy, double factor) {
    const double rsq = dx * dx + dy * dy;
    if (factor == 0.0) return;
    const double s = contact_distance(i, j, type[i], type[j]), cutoff = s + 2.0 * shell;
    const double K = factor * stiffness(type[i], type[j], s);
    found.push_back({i, j, -dx, -dy, cutoff, K, 0.5 * diameter(i, type[i]),
                     0.5 * diameter(j, type[j]), newton_pair || j < nlocal ? 1.0 : 0.5});
    if (rsq >= cutoff * cutoff) return;
    if (rsq == 0.0)
      error->one(FLERR, "{}: atoms {} and {} are in one place: their contact has no direction", WHO,
                 atom->tag[i], atom->tag[j]);

    if (!elastic) return;
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
      error->one(FLERR, "{}: atom {} is a flat wall, of diameter 0: use one rank", WHO,
                 atom->tag[j]);
    for (int i = 0; i < nlocal; i++)
      if (!is_wall(i)) act(i, j, 0.0, x[i][1] - x[j][1], 1.0);
  }
  if (vflag_fdotr) {
    virial_fdotr_compute();
    virial[3] -= turning;
  }
}

/* Beyond the cutoff the force goes on as a spring, as that of this style does, so that velocities
   change smoothly within a step in which disks part. The stiffness is a difference of forces on the
   inner side alone, of fourth order. */
Repulsion PairDiskDrag::push_of_others(const DiskPair &p, double depth) const
{
  const int itype = atom->type[p.i], jtype = atom->type[p.j];
  double energy = 0.0;
  const auto force_at = [&](double r, double &energy) {
    double over_distance = 0.0;
    energy = force->pair->single(p.i, p.j, itype, jtype, r * r, 1.0, 1.0, over_distance);
    return over_distance * r;
  };
  const double inner = std::max(depth, EDGE * p.reach), r = p.reach - inner, h = STEP * p.reach;
  const double push = force_at(r, energy);
  double unused, slope = 25.0 * push;
  const double coefficients[4] = {-48.0, 36.0, -16.0, 3.0};
  for (int k = 0; k < 4; k++) slope += coefficients[k] * force_at(r - (k + 1) * h, unused);
  const double stiffness = -slope / (12.0 * h), beyond = inner - depth;
  return {depth - 2.0 * shell, energy - beyond * (push - 0.5 * stiffness * beyond),
          push - stiffness * beyond, stiffness};
}

void PairDiskDrag::find_sizes()
{
  if (sizes.empty()) return;
  int is_double = 0, columns = 0;
  const int index = atom->find_custom(sizes.c_str(), is_double, columns);
  if (index < 0 || is_double != 1 || columns != 0)
    error->all(FLERR, "{}: no per-atom property d_{}: define it by fix property/atom d_{}", WHO,
               sizes, sizes);
  const double *const values = atom->dvector[index];
  own.assign(values, values + atom->nlocal);
  own.resize(atom->nlocal + atom->nghost);
}

/* Neighbor lists reach as far as the s of two types. */
void PairDiskDrag::check_reach() const
{
  std::vector<double> largest(atom->ntypes + 1, 0.0);
  for (int i = 0; i < atom->nlocal; i++) {
    double &most = largest[atom->type[i]];
    most = std::max(most, own[i]);
  }
  MPI_Allreduce(MPI_IN_PLACE, largest.data(), atom->ntypes + 1, MPI_DOUBLE, MPI_MAX, world);
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      const double s = 0.5 * (largest[i] + largest[j]);
      if (s > (1.0 + ROUNDING) * reach[i][j])
        error->all(FLERR, "{}: disks of types {} and {} touch at {}, with diameters up to {}, {}, "
                   "and pair_coeff lets neighbor lists reach {} only: raise its s", WHO, i, j, s,
                   largest[i], largest[j], reach[i][j]);
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

double PairDiskDrag::mean_diameter(bool with_walls)
{
  find_sizes();
  double sums[2] = {0.0, 0.0};
  for (int i = 0; i < atom->nlocal; i++) {
    if (!with_walls && is_wall(i)) continue;
    sums[0] += diameter(i, atom->type[i]);
    sums[1] += 1.0;
  }
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, world);
  return sums[1] > 0.0 ? sums[0] / sums[1] : 1.0;
}

/* In single precision the mean does not depend on the order of the sum, and is 1 for packings in
   that unit. */
double PairDiskDrag::unit_length()
{
  return static_cast<float>(mean_diameter(false));
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

void PairDiskDrag::settings(int narg, char **arg)
{
  if (narg < 2 || narg % 2)
    error->all(FLERR, "{} needs: tau beta [alpha value] [arms radius|contact|none] [even value] "
               "[elastic on|off] [exponent value] [shell value] [sizes d_name] [power value]", WHO);

  law = DragLaw();
  exponent = 2.0;
  elastic = true;
  power = shell = 0.0;
  sizes.clear();
  law.tau = utils::numeric(FLERR, arg[0], false, lmp);
  law.beta = utils::numeric(FLERR, arg[1], false, lmp);
  for (int k = 2; k < narg; k += 2) {
    const std::string word = arg[k], choice = arg[k + 1];
    double *const value = word == "alpha" ? &law.alpha
        : word == "even"                  ? &law.even
        : word == "exponent"              ? &exponent
        : word == "shell"                 ? &shell
        : word == "power"                 ? &power
                                          : nullptr;
    if (value)
      *value = utils::numeric(FLERR, arg[k + 1], false, lmp);
    else if (word == "sizes" && utils::strmatch(choice, "^d_"))
      sizes = choice.substr(2);
    else if (word == "arms" && (choice == "radius" || choice == "contact" || choice == "none"))
      law.arms = choice == "radius" ? DragLaw::RADIUS
          : choice == "contact"     ? DragLaw::CONTACT
                                    : DragLaw::NONE;
    else if (word == "elastic" && (choice == "on" || choice == "off"))
      elastic = choice == "on";
    else
      error->all(FLERR, "{}: {} {} is not one of: alpha value, arms radius, arms contact, "
                 "arms none, even value, elastic on, elastic off, exponent value, shell value, "
                 "sizes d_name, power value", WHO, word, choice);
  }

  law.check(error, WHO);
  if (power != 0.0 && sizes.empty())
    error->all(FLERR, "{}: power {} is for disks with sizes d_name", WHO, power);
  if (!(exponent >= 2.0 && exponent <= LARGEST_EXPONENT))
    error->all(FLERR, "{}: exponent {} must lie between 2 (springs) and {}; Hertz: 2.5", WHO,
               exponent, LARGEST_EXPONENT);
  if (!elastic && (exponent != 2.0 || !sizes.empty()))
    error->all(FLERR, "{}: elastic off leaves energies to other styles: give neither exponent nor "
               "sizes", WHO);
  if (!(shell >= 0.0) || (shell > 0.0 && exponent != 2.0))
    error->all(FLERR, "{}: shell {} must be a length, 0 for disks that do not attract, and needs "
               "exponent 2", WHO, shell);
}

void PairDiskDrag::coeff(int narg, char **arg)
{
  if (elastic && narg != 4)
    error->all(FLERR, "{} needs: pair_coeff i j K s, E = K (s - r)^exponent", WHO);
  if (!elastic && narg != 3)
    error->all(FLERR, "{}: with elastic off it needs: pair_coeff i j s", WHO);
  if (!allocated) allocate();

  int ilo, ihi, jlo, jhi;
  utils::bounds(FLERR, arg[0], 1, atom->ntypes, ilo, ihi, error);
  utils::bounds(FLERR, arg[1], 1, atom->ntypes, jlo, jhi, error);
  const double K = elastic ? utils::numeric(FLERR, arg[2], false, lmp) : 0.0;
  const double s = utils::numeric(FLERR, arg[narg - 1], false, lmp);
  if (elastic && !(K > 0.0)) error->all(FLERR, "{}: K {} must be positive", WHO, arg[2]);
  if (!(s >= 0.0))
    error->all(FLERR, "{}: s {}, the sum of two radii, is negative; 0 is that of flat walls", WHO,
               arg[narg - 1]);
  if (!elastic && s == 0.0)
    error->all(FLERR, "{}: s 0 is that of flat walls, which need elastic on", WHO);

  int count = 0;
  for (int i = ilo; i <= ihi; i++)
    for (int j = std::max(jlo, i); j <= jhi; j++) {
      setflag[i][j] = 1;
      strength[i][j] = strength[j][i] = K;
      reach[i][j] = reach[j][i] = s;
      count++;
    }
  if (count == 0)
    error->all(FLERR, "{}: pair_coeff {} {} names no pair", WHO, arg[0], arg[1]);
}

void PairDiskDrag::init_style()
{
  if (domain->dimension != 2) error->all(FLERR, "{}: disks need dimension 2", WHO);
  find_sizes();
  neighbor->add_request(this);
}

/* Nothing is mixed: the radius of a type is half its own s. */
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
      write_value(fp, setflag[i][j]);
      write_value(fp, strength[i][j]);
      write_value(fp, reach[i][j]);
    }
}

void PairDiskDrag::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  allocate();
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      read_everywhere(lmp, fp, &setflag[i][j]);
      read_everywhere(lmp, fp, &strength[i][j]);
      read_everywhere(lmp, fp, &reach[i][j]);
    }
}

void PairDiskDrag::write_restart_settings(FILE *fp)
{
  const double arms = law.arms, own = elastic ? 1.0 : 0.0;
  for (const double value :
       {LAYOUT, law.beta, law.tau, law.alpha, law.even, arms, own, exponent, power, shell})
    write_value(fp, value);
  write_value(fp, sizes);
}

void PairDiskDrag::read_restart_settings(FILE *fp)
{
  double layout, arms, own;
  read_everywhere(lmp, fp, &layout);
  if (layout != LAYOUT)
    error->all(FLERR, "{}: the restart file was written by another version of this plugin: start "
               "from a data file", WHO);
  for (double *const value :
       {&law.beta, &law.tau, &law.alpha, &law.even, &arms, &own, &exponent, &power, &shell})
    read_everywhere(lmp, fp, value);
  law.arms = static_cast<DragLaw::Arms>(arms);
  elastic = own != 0.0;
  read_everywhere(lmp, fp, &sizes);
}

void PairDiskDrag::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++) {
    fprintf(fp, "%d", i);
    if (elastic) fprintf(fp, " %.17g", strength[i][i]);
    fprintf(fp, " %.17g\n", reach[i][i]);
  }
}

void PairDiskDrag::write_data_all(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      fprintf(fp, "%d %d", i, j);
      if (elastic) fprintf(fp, " %.17g", strength[i][j]);
      fprintf(fp, " %.17g\n", reach[i][j]);
    }
}

double PairDiskDrag::single(int i, int j, int itype, int jtype, double rsq, double, double factor,
                            double &fforce)
{
  const double s = contact_distance(i, j, itype, jtype);
  const double r = sqrt(rsq), depth = s + 2.0 * shell - r;
  fforce = 0.0;
  if (depth <= 0.0 || !elastic) return 0.0;
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
