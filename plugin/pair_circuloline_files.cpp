// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

/* What pair style circuloline writes into restart and data files, and reads back. */

#include "pair_circuloline.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "utils.h"

#include <algorithm>
#include <iterator>

using namespace LAMMPS_NS;

// stands where files of version 0.1.0 have delta, which is positive
static constexpr double LAYOUT = -2.0;

// number of each form in restart files, whose list began with segment
static constexpr int STORED[NUMBER_OF_CONTACT_FORMS] = {1, 0, 2};

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_restart(FILE *fp)
{
  write_restart_settings(fp);
  for (int i = 1; i <= atom->ntypes; i++) {
    fwrite(&laws.role[i], sizeof(Role), 1, fp);
    for (int j = i; j <= atom->ntypes; j++) {
      fwrite(&setflag[i][j], sizeof(int), 1, fp);
      if (!setflag[i][j]) continue;
      const double values[2] = {laws.eps[i][j], i == j ? laws.width[i][j] : given_width[i][j]};
      fwrite(values, sizeof(double), 2, fp);
      fwrite(&STORED[laws.form[i][j]], sizeof(int), 1, fp);
    }
  }
}

/* ---------------------------------------------------------------------- */

template <class Value> void PairCirculoline::read_everywhere(FILE *fp, Value *values, int count)
{
  if (comm->me == 0) utils::sfread(FLERR, values, sizeof(Value), count, fp, nullptr, error);
  MPI_Bcast(values, static_cast<int>(count * sizeof(Value)), MPI_BYTE, 0, world);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  allocate();

  for (int i = 1; i <= atom->ntypes; i++) {
    if (!old_restart) read_everywhere(fp, &laws.role[i], 1);
    for (int j = i; j <= atom->ntypes; j++) {
      read_everywhere(fp, &setflag[i][j], 1);
      if (!setflag[i][j]) continue;
      double values[2] = {0.0, -1.0};
      read_everywhere(fp, values, old_restart ? 1 : 2);
      int number = STORED[form];
      if (!old_restart) read_everywhere(fp, &number, 1);
      set(i, j, values[0], values[1], checked_form(number));
    }
  }
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_restart_settings(FILE *fp)
{
  const double values[3] = {LAYOUT, delta, laws.longest_edge};
  fwrite(values, sizeof(double), 3, fp);
  fwrite(&STORED[form], sizeof(int), 1, fp);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::read_restart_settings(FILE *fp)
{
  read_everywhere(fp, &delta, 1);
  old_restart = delta > 0.0;
  if (!old_restart) {
    if (delta != LAYOUT)
      error->all(FLERR, "Pair style circuloline: this plugin does not know layout {} of the restart file", -delta);
    read_everywhere(fp, &delta, 1);
  }
  read_everywhere(fp, &laws.longest_edge, 1);
  int number = 0;
  read_everywhere(fp, &number, 1);
  form = checked_form(number);
}

/* ---------------------------------------------------------------------- */

ContactForm PairCirculoline::checked_form(int number) const
{
  const int *found = std::find(std::begin(STORED), std::end(STORED), number);
  if (found == std::end(STORED))
    error->all(FLERR, "Pair style circuloline: contact form {} in the restart file is unknown to this plugin", number);
  return static_cast<ContactForm>(found - STORED);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    fprintf(fp, "%d %.17g %.17g %s\n", i, laws.eps[i][i], laws.width[i][i], CONTACT_FORMS[laws.form[i][i]]);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_data_all(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      fprintf(fp, "%d %d %.17g %.17g %s\n", i, j, laws.eps[i][j], laws.width[i][j], CONTACT_FORMS[laws.form[i][j]]);
}
