// SPDX-License-Identifier: GPL-2.0-or-later

/* Arguments of pair_style circuloline and of its pair_coeff, in restart and data files too. */

#include "pair_circuloline.h"

#include "atom.h"
#include "error.h"
#include "memory.h"
#include "restart_values.h"

#include <algorithm>
#include <cstring>
#include <sstream>

using namespace LAMMPS_NS;

static constexpr char STYLE[] = "Pair style circuloline";
static constexpr double LAYOUT = -6.0;    // of restart files; the first layout has delta here

// keywords of pair_style, by Role; vertices have the contact form
static const std::string ROLES[] = {"contact", "walls", "disks", "flat"};

static ContactForm contact_form(LAMMPS *lmp, const char *name)
{
  for (int k = 0; k < NUMBER_OF_CONTACT_FORMS; k++)
    if (strcmp(name, CONTACT_FORMS[k]) == 0) return static_cast<ContactForm>(k);
  lmp->error->all(FLERR, "{}: unknown contact form {}, use one of {}", STYLE, name,
                  contact_form_names(", "));
  return OUTLINE;
}

void PairCirculoline::allocate()
{
  allocated = 1;
  const int np1 = atom->ntypes + 1;
  memory->create(setflag, np1, np1, "pair:setflag");
  memory->create(cutsq, np1, np1, "pair:cutsq");
  memory->create(laws.eps, np1, np1, "pair:eps");
  memory->create(laws.width, np1, np1, "pair:delta");
  memory->create(laws.start, np1, np1, "pair:start");
  memory->create(laws.form, np1, np1, "pair:form");
  given_coeffs.assign(static_cast<std::size_t>(np1) * np1, Given());
  for (int i = 0; i < np1; i++)
    for (int j = 0; j < np1; j++) {
      setflag[i][j] = 0;
      laws.eps[i][j] = 0.0;
      laws.width[i][j] = laws.start[i][j] = -1.0;
      laws.form[i][j] = form;
    }
  read_roles();
}

/* pair_style circuloline delta longest_edge keyword value ...
     contact form, walls types, disks types, flat types */
void PairCirculoline::settings(int narg, char **arg)
{
  if (narg < 2 || narg % 2)
    error->all(FLERR, "{} needs: delta longest_edge [contact {}] [walls types] [disks types] [flat "
               "types]", STYLE, contact_form_names("|"));

  delta = utils::numeric(FLERR, arg[0], false, lmp);
  laws.longest_edge = utils::numeric(FLERR, arg[1], false, lmp);
  if (delta <= 0.0) error->all(FLERR, "{}: delta {} must be positive", STYLE, arg[0]);
  if (laws.longest_edge <= 0.0)
    error->all(FLERR, "{}: longest edge {} must be positive", STYLE, arg[1]);

  form = OUTLINE;
  for (auto &types : role_types) types.clear();
  for (int k = 2; k < narg; k += 2) {
    const auto role = std::find(ROLES, ROLES + FLAT + 1, std::string(arg[k])) - ROLES;
    if (role == VERTEX)
      form = contact_form(lmp, arg[k + 1]);
    else if (role <= FLAT)
      role_types[role] = arg[k + 1];
    else
      error->all(FLERR, "{}: unknown keyword {}, expected contact, walls, disks or flat", STYLE,
                 arg[k]);
  }

  // If the style is given again, types without a width or a form of their own take the new one.
  if (!allocated) return;
  read_roles();
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      if (setflag[i][j]) set(i, j, laws.eps[i][j], given(i, j).width, given(i, j).form);
}

/* reads types as LAMMPS writes them, several with commas: 2 or 2*4 or 2,5* */
void PairCirculoline::read_roles()
{
  laws.role.assign(atom->ntypes + 1, VERTEX);
  for (const Role role : {WALL, DISK, FLAT}) {
    std::istringstream ranges(role_types[role]);
    for (std::string range; std::getline(ranges, range, ',');) {
      int low, high;
      utils::bounds(FLERR, range, 1, atom->ntypes, low, high, error);
      std::fill(laws.role.begin() + low, laws.role.begin() + high + 1, role);
    }
  }
}

/* pair_coeff i j eps [delta [contact form]]. Of a disk, delta is the diameter. Without
   it, a type has that of pair_style, and two types the mean of both. */
void PairCirculoline::coeff(int narg, char **arg)
{
  if (narg < 3 || narg > 5)
    error->all(FLERR, "{} needs: pair_coeff i j eps [delta [contact form]]", STYLE);
  if (!allocated) allocate();

  int ilo, ihi, jlo, jhi;
  utils::bounds(FLERR, arg[0], 1, atom->ntypes, ilo, ihi, error);
  utils::bounds(FLERR, arg[1], 1, atom->ntypes, jlo, jhi, error);
  const double eps = utils::numeric(FLERR, arg[2], false, lmp);
  if (eps < 0.0) error->all(FLERR, "{}: eps {} must not be negative", STYLE, arg[2]);
  const double width = narg > 3 ? utils::numeric(FLERR, arg[3], false, lmp) : -1.0;
  if (narg > 3 && width <= 0.0) error->all(FLERR, "{}: delta {} must be positive", STYLE, arg[3]);
  const int of_pair = narg > 4 ? contact_form(lmp, arg[4]) : -1;

  int count = 0;
  for (int i = ilo; i <= ihi; i++)
    for (int j = std::max(jlo, i); j <= jhi; j++) {
      set(i, j, eps, width, of_pair);
      count++;
    }
  if (count == 0) error->all(FLERR, "{}: pair_coeff {} {} names no pair", STYLE, arg[0], arg[1]);
}

void PairCirculoline::set(int i, int j, double eps, double width, int of_pair)
{
  setflag[i][j] = 1;
  laws.eps[i][j] = laws.eps[j][i] = eps;
  given(i, j) = given(j, i) = {width, -1.0, of_pair};
  laws.width[i][j] = laws.width[j][i] = width < 0.0 && i == j ? delta : width;
  laws.form[i][j] = laws.form[j][i] = of_pair < 0 ? form : of_pair;
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
      read_everywhere(lmp, fp, &eps);
      read_everywhere(lmp, fp, &own);
      set(i, j, eps, own.width, own.form);
    }
}

/* Of a style in pair_style hybrid, LAMMPS keeps these alone. */
void PairCirculoline::write_restart_settings(FILE *fp)
{
  write_value(fp, LAYOUT);
  write_value(fp, delta);
  write_value(fp, laws.longest_edge);
  write_value(fp, form);
  write_value(fp, mix_flag);
  write_value(fp, user_cutoff);
  write_value(fp, raised_cutoff);    // comm_modify of the file has it
  for (const auto &types : role_types) write_value(fp, types);
}

void PairCirculoline::read_restart_settings(FILE *fp)
{
  double layout;
  read_everywhere(lmp, fp, &layout);
  if (layout != LAYOUT)
    error->all(FLERR, "{}: the restart file was written by another version of this plugin: start "
               "from a data file", STYLE);
  read_everywhere(lmp, fp, &delta);
  read_everywhere(lmp, fp, &laws.longest_edge);
  read_everywhere(lmp, fp, &form);
  read_everywhere(lmp, fp, &mix_flag);
  read_everywhere(lmp, fp, &user_cutoff);
  read_everywhere(lmp, fp, &raised_cutoff);
  for (auto &types : role_types) read_everywhere(lmp, fp, &types);
}

void PairCirculoline::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    fprintf(fp, "%d %.17g %.17g %s\n", i, laws.eps[i][i], laws.width[i][i],
            CONTACT_FORMS[laws.form[i][i]]);
}

void PairCirculoline::write_data_all(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      fprintf(fp, "%d %d %.17g %.17g %s\n", i, j, laws.eps[i][j], laws.width[i][j],
              CONTACT_FORMS[laws.form[i][j]]);
}
