// SPDX-License-Identifier: GPL-2.0-or-later

/* What pair style circuloline writes into restart and data files, and reads back. */

#include "pair_circuloline.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "utils.h"

using namespace LAMMPS_NS;

static constexpr double LAYOUT = -5.0;    // stands where the first versions have delta, which is positive

template <class Value> static void write(FILE *fp, const Value &value)
{
  fwrite(&value, sizeof(Value), 1, fp);
}

template <class Value> void PairCirculoline::read_everywhere(FILE *fp, Value *values, int count)
{
  if (comm->me == 0) utils::sfread(FLERR, values, sizeof(Value), count, fp, nullptr, error);
  MPI_Bcast(values, static_cast<int>(count * sizeof(Value)), MPI_BYTE, 0, world);
}

void PairCirculoline::write_restart(FILE *fp)
{
  write_restart_settings(fp);
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      write(fp, setflag[i][j]);
      if (!setflag[i][j]) continue;
      write(fp, laws.eps[i][j]);
      write(fp, given(i, j));
    }
}

void PairCirculoline::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  allocate();
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      read_everywhere(fp, &setflag[i][j], 1);
      if (!setflag[i][j]) continue;
      double eps;
      Given own;
      read_everywhere(fp, &eps, 1);
      read_everywhere(fp, &own, 1);
      set(i, j, eps, own.width, own.form);
    }
}

/* these alone are kept of a style in pair_style hybrid */
void PairCirculoline::write_restart_settings(FILE *fp)
{
  write(fp, LAYOUT);
  write(fp, delta);
  write(fp, laws.longest_edge);
  write(fp, form);
  write(fp, mix_flag);
  for (const auto &types : role_types) {
    const int size = static_cast<int>(types.size());
    write(fp, size);
    fwrite(types.data(), 1, size, fp);
  }
}

void PairCirculoline::read_restart_settings(FILE *fp)
{
  double layout;
  read_everywhere(fp, &layout, 1);
  if (layout != LAYOUT)
    error->all(FLERR, "Pair style circuloline: the restart file was written by another version of this plugin: start "
               "from a data file");
  read_everywhere(fp, &delta, 1);
  read_everywhere(fp, &laws.longest_edge, 1);
  read_everywhere(fp, &form, 1);
  read_everywhere(fp, &mix_flag, 1);
  for (auto &types : role_types) {
    int size;
    read_everywhere(fp, &size, 1);
    types.resize(size);
    read_everywhere(fp, types.data(), size);
  }
}

void PairCirculoline::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    fprintf(fp, "%d %.17g %.17g %s\n", i, laws.eps[i][i], laws.width[i][i], CONTACT_FORMS[laws.form[i][i]]);
}

void PairCirculoline::write_data_all(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++)
      fprintf(fp, "%d %d %.17g %.17g %s\n", i, j, laws.eps[i][j], laws.width[i][j], CONTACT_FORMS[laws.form[i][j]]);
}
