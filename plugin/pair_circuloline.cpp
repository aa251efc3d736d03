// SPDX-License-Identifier: GPL-2.0-or-later
#include "pair_circuloline.h"

#include "atom.h"
#include "citation.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix_polygon_outline.h"
#include "force.h"
#include "memory.h"
#include "neigh_list.h"
#include "neighbor.h"
#include "outline_checks.h"
#include "restart_values.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

using namespace LAMMPS_NS;

// of restart files; the first layout has delta here, and -7 has no adhesion
static constexpr double LAYOUT = -8.0, WITHOUT_ADHESION = -7.0;

// These are the keywords of pair_style, by Role; `contact` is that of vertices.
static const std::string ROLES[] = {"contact", "walls", "disks", "flat"};

static ContactForm contact_form(LAMMPS *lmp, const char *name)
{
  for (int k = 0; k < NUMBER_OF_CONTACT_FORMS; k++)
    if (strcmp(name, CONTACT_FORMS[k]) == 0) return static_cast<ContactForm>(k);
  lmp->error->all(FLERR, "{}: unknown contact form {}, use one of {}",
                  PairCirculoline::WHO, name, contact_form_names(", "));
  return OUTLINE;
}

PairCirculoline::PairCirculoline(LAMMPS *lmp) :
    Pair(lmp), in_use(), outline(nullptr),
    candidates(NUMBER_OF_CONTACT_FORMS, ContactCandidates(lmp)), own_contacts(lmp),
    flat_walls(lmp), candidates_for(-1, -1), user_cutoff(0.0), raised_cutoff(-1.0)
{
  single_enable = 0;    // a contact is more than two atoms
  restartinfo = 1;
  writedata = 1;
  manybody_flag = 1;
  no_virial_fdotr_compute = 1;    // the virial is summed contact by contact, newton on or off
  centroidstressflag = CENTROID_NOTAVAIL;
  // here: LAMMPS sizes its buffers by them before init_style(), and comm_style tiled of 22Jul2025
  // asks for the first of them even if newton is off
  comm_reverse = comm_reverse_off = RETURNED;
  delta = 0.0;
  form = OUTLINE;
  cite(lmp, CITE_CIRCULOLINE);
}

PairCirculoline::~PairCirculoline()
{
  if (copymode) return;
  if (comm) lower_ghost_cutoff();
  if (allocated) {
    memory->destroy(setflag);
    memory->destroy(cutsq);
    memory->destroy(laws.eps);
    memory->destroy(laws.width);
    memory->destroy(laws.adhesion);
    memory->destroy(laws.range);
    memory->destroy(laws.initial_width);
    memory->destroy(laws.initial_reach);
    memory->destroy(laws.form);
  }
}

void PairCirculoline::allocate()
{
  allocated = 1;
  const int np1 = atom->ntypes + 1;
  memory->create(setflag, np1, np1, "pair:setflag");
  memory->create(cutsq, np1, np1, "pair:cutsq");
  memory->create(laws.eps, np1, np1, "pair:eps");
  memory->create(laws.width, np1, np1, "pair:delta");
  memory->create(laws.adhesion, np1, np1, "pair:adhesion");
  memory->create(laws.range, np1, np1, "pair:range");
  memory->create(laws.initial_width, np1, np1, "pair:initial_width");
  memory->create(laws.initial_reach, np1, np1, "pair:initial_reach");
  memory->create(laws.form, np1, np1, "pair:form");
  given_coeffs.assign(np1 * np1, Given());
  std::fill_n(setflag[0], np1 * np1, 0);
  std::fill_n(laws.eps[0], np1 * np1, 0.0);
  std::fill_n(laws.width[0], np1 * np1, -1.0);
  std::fill_n(laws.adhesion[0], np1 * np1, 0.0);
  std::fill_n(laws.range[0], np1 * np1, 0.0);
  std::fill_n(laws.initial_width[0], np1 * np1, -1.0);
  std::fill_n(laws.initial_reach[0], np1 * np1, -1.0);
  std::fill_n(laws.form[0], np1 * np1, form);
  read_roles();
}

/* The command is: pair_style circuloline delta longest_edge, and then contact form, walls types,
   disks types, flat types or self range. */
void PairCirculoline::settings(int narg, char **arg)
{
  if (narg < 2 || narg % 2)
    error->all(FLERR, "{} needs: delta longest_edge [contact {}] [walls types] [disks types] [flat "
               "types] [self range]", WHO, contact_form_names("|"));

  delta = utils::numeric(FLERR, arg[0], false, lmp);
  laws.longest_edge = utils::numeric(FLERR, arg[1], false, lmp);
  if (delta <= 0.0) error->all(FLERR, "{}: delta {} must be positive", WHO, arg[0]);
  if (laws.longest_edge <= 0.0)
    error->all(FLERR, "{}: longest edge {} must be positive", WHO, arg[1]);

  form = OUTLINE;
  laws.near = 0.0;
  for (auto &types : role_types) types.clear();
  for (int k = 2; k < narg; k += 2) {
    const auto role = std::find(ROLES, ROLES + FLAT + 1, std::string(arg[k])) - ROLES;
    if (role == VERTEX)
      form = contact_form(lmp, arg[k + 1]);
    else if (role <= FLAT)
      role_types[role] = arg[k + 1];
    else if (strcmp(arg[k], "self") == 0) {
      laws.near = utils::numeric(FLERR, arg[k + 1], false, lmp);
      if (laws.near < 0.0) error->all(FLERR, "{}: self {} must not be negative", WHO, arg[k + 1]);
    } else
      error->all(FLERR, "{}: unknown keyword {}, expected contact, walls, disks, flat or self", WHO,
                 arg[k]);
  }

  // if the style is given again, types without a width or a form of their own take the new one
  if (!allocated) return;
  read_roles();
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (setflag[i][j])
        set(i, j, laws.eps[i][j], given(i, j).width, given(i, j).form,
            {laws.adhesion[i][j], laws.range[i][j]});
}

/* Types are read as LAMMPS writes them, several of them with commas: 2 or 2*4 or 2,5* or wall. They
   become numbers, which restart files keep, since labels may change. */
void PairCirculoline::read_roles()
{
  laws.role.assign(atom->ntypes + 1, VERTEX);
  for (const Role role : {WALL, DISK, FLAT}) {
    const std::string words = role_types[role];
    std::string &numbers = role_types[role] = "";
    for (std::size_t from = 0, to; from < words.size(); from = to + 1) {
      to = std::min(words.find(',', from), words.size());
      std::string range = words.substr(from, to - from);
      const std::unique_ptr<char[]> number(utils::expand_type(FLERR, range, Atom::ATOM, lmp));
      if (number) range = number.get();
      int low, high;
      utils::bounds(FLERR, range, 1, atom->ntypes, low, high, error);
      std::fill(laws.role.begin() + low, laws.role.begin() + high + 1, role);
      numbers += (numbers.empty() ? "" : ",") + range;
    }
  }
}

/* The command is: pair_coeff i j eps [delta [contact form]] [adhesion pull range]. For disks delta
   is the diameter. Without delta a type has that of pair_style, and two types the mean of both. */
void PairCirculoline::coeff(int narg, char **arg)
{
  const bool adheres = narg > 5 && strcmp(arg[narg - 3], "adhesion") == 0;
  const Adhesion adhesion = adheres ? read_adhesion(arg + narg - 2) : Adhesion();
  if (adheres) narg -= 3;
  if (narg < 3 || narg > 5)
    error->all(FLERR, "{} needs: pair_coeff i j eps [delta [contact form]] [adhesion pull range]",
               WHO);
  if (!allocated) allocate();

  int ilo, ihi, jlo, jhi;
  utils::bounds(FLERR, arg[0], 1, atom->ntypes, ilo, ihi, error);
  utils::bounds(FLERR, arg[1], 1, atom->ntypes, jlo, jhi, error);
  const double eps = utils::numeric(FLERR, arg[2], false, lmp);
  if (eps < 0.0) error->all(FLERR, "{}: eps {} must not be negative", WHO, arg[2]);
  const double width = narg > 3 ? utils::numeric(FLERR, arg[3], false, lmp) : -1.0;
  if (narg > 3 && width <= 0.0) error->all(FLERR, "{}: delta {} must be positive", WHO, arg[3]);
  const int of_pair = narg > 4 ? contact_form(lmp, arg[4]) : -1;

  int count = 0;
  for (int i = ilo; i <= ihi; i++)
    for (int j = std::max(jlo, i); j <= jhi; j++) {
      set(i, j, eps, width, of_pair, adhesion);
      count++;
    }
  if (count == 0) error->all(FLERR, "{}: pair_coeff {} {} names no pair", WHO, arg[0], arg[1]);
}

PairCirculoline::Adhesion PairCirculoline::read_adhesion(char **arg) const
{
  const double pull = utils::numeric(FLERR, arg[0], false, lmp);
  const double range = utils::numeric(FLERR, arg[1], false, lmp);
  if (pull < 0.0) error->all(FLERR, "{}: adhesion {} must not be negative", WHO, pull);
  if (range < pull || (pull > 0.0 && range == pull))
    error->all(FLERR, "{}: adhesion {} needs a range beyond it, not {}", WHO, pull, range);
  return {pull, range};
}

void PairCirculoline::set(int i, int j, double eps, double width, int of_pair,
                          const Adhesion &adhesion)
{
  laws.adhesion[i][j] = laws.adhesion[j][i] = adhesion.pull;
  laws.range[i][j] = laws.range[j][i] = adhesion.range;
  setflag[i][j] = 1;
  laws.eps[i][j] = laws.eps[j][i] = eps;
  given(i, j) = given(j, i) = {width, -1.0, of_pair};
  laws.width[i][j] = laws.width[j][i] = width < 0.0 && i == j ? delta : width;
  laws.form[i][j] = laws.form[j][i] = of_pair < 0 ? form : of_pair;
}

void PairCirculoline::init_style()
{
  refuse_computes(lmp, WHO);
  own_contacts.init(WHO, laws);
  lower_ghost_cutoff();
  outline = FixPolygonOutline::shared(lmp, WHO);
  const bool images = domain->xperiodic || domain->yperiodic;
  for (int k = 0; k < neighbor->nex_mol; k++)
    if (neighbor->ex_mol_intra[k] && images && comm->me == 0)
      error->warning(FLERR, "{}: neigh_modify exclude molecule/intra hides the contacts of a "
                     "polygon with its own periodic images", WHO);
  std::fill_n(in_use, NUMBER_OF_CONTACT_FORMS, false);
  for (double **const initial : {laws.initial_width, laws.initial_reach})
    std::fill_n(initial[0], (atom->ntypes + 1) * (atom->ntypes + 1), -1.0);
  neighbor->add_request(this, NeighConst::REQ_FULL);
}

/* The ghost cutoff of comm_modify returns, unless another command has changed it since. */
void PairCirculoline::lower_ghost_cutoff()
{
  if (comm->cutghostuser == raised_cutoff) comm->cutghostuser = user_cutoff;
  raised_cutoff = -1.0;
  user_cutoff = comm->cutghostuser;
}

/* Neighbor lists hold what may touch. Ghosts must include the far end of an edge that touches. Fix
   adapt calls this function again during a run. */
double PairCirculoline::init_one(int i, int j)
{
  const bool unknown = !setflag[i][j] && !(setflag[i][i] && setflag[j][j]);
  if (unknown && force->pair != this) return 0.0;    // left to other styles of pair_style hybrid
  if (!setflag[i][j]) mix(i, j);
  if (i != j && given(i, j).width < 0.0) mix_widths(i, j);
  laws.eps[j][i] = laws.eps[i][j];
  laws.width[j][i] = laws.width[i][j];
  laws.form[j][i] = laws.form[i][j];
  laws.adhesion[j][i] = laws.adhesion[i][j];
  laws.range[j][i] = laws.range[i][j];
  check_adhesion(i, j);
  in_use[laws.form[i][j]] = true;

  hold_initial("delta", laws.initial_width, i, j, laws.width[i][j]);
  hold_initial("reach", laws.initial_reach, i, j, laws.reach(i, j));

  const double cutoff = laws.cutoff(i, j);
  const bool disks = laws.disk(i) && laws.disk(j);
  const double reach = laws.initial_reach[i][j];
  const double ghosts = disks ? cutoff : std::max(cutoff, reach + laws.longest_edge);
  if (comm->mode != Comm::SINGLE) return ghosts;    // each type has the ghosts of its own cutoff
  comm->cutghostuser = raised_cutoff = std::max(comm->cutghostuser, ghosts + neighbor->skin);
  return cutoff;
}

/* Fix adapt may have changed them. */
void PairCirculoline::check_adhesion(int i, int j) const
{
  const double pull = laws.adhesion[i][j], range = laws.range[i][j];
  if (pull < 0.0 || range < pull || (pull > 0.0 && range == pull))
    error->all(FLERR, "{}: adhesion {} of types {} and {} must be from 0 to less than the range {}",
               WHO, pull, i, j, range);
}

void PairCirculoline::hold_initial(const char *name, double **initial, int i, int j, double value)
{
  if (initial[i][j] < 0.0)
    initial[i][j] = initial[j][i] = value;
  else if (value > initial[i][j])
    error->all(FLERR, "{}: {} of types {} and {} grew to {} from {} at the start of the run, "
               "for which the neighbor lists are made: start with the largest value", WHO, name, i,
               j, value, initial[i][j]);
}

/* Two types that no pair_coeff names have a mixed contact. */
void PairCirculoline::mix(int i, int j)
{
  if (!setflag[i][i] || !setflag[j][j])
    error->all(FLERR, "{}: no pair_coeff for types {} and {} (a data file has it if written with "
               "write_data ... pair ij)", WHO, i, j);
  if (laws.form[i][i] != laws.form[j][j])
    error->all(FLERR, "{}: types {} and {} have the contact forms {} and {}: give pair_coeff {} {} "
               "eps delta form", WHO, i, j, CONTACT_FORMS[laws.form[i][i]],
               CONTACT_FORMS[laws.form[j][j]], i, j);
  laws.eps[i][j] = mix_energy(laws.eps[i][i], laws.eps[j][j], laws.width[i][i], laws.width[j][j]);
  laws.form[i][j] = laws.form[i][i];
  // the pull is the geometric mean, whatever pair_modify says; a range beyond both is beyond it
  laws.adhesion[i][j] = std::sqrt(laws.adhesion[i][i] * laws.adhesion[j][j]);
  laws.range[i][j] =
      laws.adhesion[i][j] > 0.0 ? 0.5 * (laws.range[i][i] + laws.range[j][j]) : 0.0;
}

/* Outlines touch where their rims do: the width is the arithmetic mean, whatever pair_modify says,
   unless fix adapt has put another value in its place. */
void PairCirculoline::mix_widths(int i, int j)
{
  Given &pair = given(i, j);
  if (laws.initial_width[i][j] >= 0.0 && laws.width[i][j] != pair.mixed) return;
  if (laws.width[i][i] <= 0.0 || laws.width[j][j] <= 0.0)
    error->all(FLERR, "{}: types {} and {} have no widths of their own to mix: give pair_coeff {} "
               "{} eps delta", WHO, i, j, i, j);
  laws.width[i][j] = pair.mixed = 0.5 * (laws.width[i][i] + laws.width[j][j]);
}

void *PairCirculoline::extract(const char *str, int &dim)
{
  dim = 0;
  if (strcmp(str, "longest_edge") == 0) return &laws.longest_edge;
  dim = 2;
  if (strcmp(str, "delta") == 0) return laws.width;
  if (strcmp(str, "eps") == 0) return laws.eps;
  if (strcmp(str, "adhesion") == 0) return laws.adhesion;
  if (strcmp(str, "range") == 0) return laws.range;
  return nullptr;
}

double PairCirculoline::memory_usage()
{
  double total = Pair::memory_usage() + bytes(ghosts, found, all_found, tags);
  total += own_contacts.memory_usage() + flat_walls.memory_usage();
  for (const auto &of_form : candidates) total += of_form.memory_usage();
  return total;
}

void PairCirculoline::write_restart(FILE *fp)
{
  write_restart_settings(fp);
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      write_value(fp, setflag[i][j]);
      if (!setflag[i][j]) continue;
      write_value(fp, laws.eps[i][j]);
      write_value(fp, given(i, j));
      write_value(fp, Adhesion{laws.adhesion[i][j], laws.range[i][j]});
    }
}

void PairCirculoline::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  allocate();
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      read_everywhere(lmp, fp, &setflag[i][j]);
      if (!setflag[i][j]) continue;
      double eps;
      Given own;
      Adhesion adhesion;
      read_everywhere(lmp, fp, &eps);
      read_everywhere(lmp, fp, &own);
      if (layout == LAYOUT) read_everywhere(lmp, fp, &adhesion);
      set(i, j, eps, own.width, own.form, adhesion);
    }
}

/* LAMMPS keeps these values alone for a style in pair_style hybrid. */
void PairCirculoline::write_restart_settings(FILE *fp)
{
  write_value(fp, LAYOUT);
  write_value(fp, delta);
  write_value(fp, laws.longest_edge);
  write_value(fp, laws.near);
  write_value(fp, form);
  write_value(fp, mix_flag);
  write_value(fp, user_cutoff);
  write_value(fp, raised_cutoff);    // comm_modify of the file has it
  for (const auto &types : role_types) write_value(fp, types);
}

void PairCirculoline::read_restart_settings(FILE *fp)
{
  read_everywhere(lmp, fp, &layout);
  if (layout != LAYOUT && layout != WITHOUT_ADHESION)
    error->all(FLERR, "{}: the restart file was written by another version of this plugin: start "
               "from a data file", WHO);
  read_everywhere(lmp, fp, &delta);
  read_everywhere(lmp, fp, &laws.longest_edge);
  read_everywhere(lmp, fp, &laws.near);
  read_everywhere(lmp, fp, &form);
  read_everywhere(lmp, fp, &mix_flag);
  read_everywhere(lmp, fp, &user_cutoff);
  read_everywhere(lmp, fp, &raised_cutoff);
  for (auto &types : role_types) read_everywhere(lmp, fp, &types);
}

std::string PairCirculoline::coefficients(int i, int j) const
{
  const double pull = laws.adhesion[i][j], range = laws.range[i][j];
  std::string words = fmt::format("{:.17g} {:.17g} {}", laws.eps[i][j], laws.width[i][j],
                                  CONTACT_FORMS[laws.form[i][j]]);
  return range > 0.0 ? words + fmt::format(" adhesion {:.17g} {:.17g}", pull, range) : words;
}

void PairCirculoline::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++) fprintf(fp, "%d %s\n", i, coefficients(i, i).c_str());
}

void PairCirculoline::write_data_all(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      fprintf(fp, "%d %d %s\n", i, j, coefficients(i, j).c_str());
}
