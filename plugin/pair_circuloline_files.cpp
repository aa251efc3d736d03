// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

/* What pair style circuloline writes into restart and data files, and reads back. */

#include "pair_circuloline.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "utils.h"

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_restart(FILE *fp)
{
  write_restart_settings(fp);
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      fwrite(&setflag[i][j], sizeof(int), 1, fp);
      if (setflag[i][j]) fwrite(&eps[i][j], sizeof(double), 1, fp);
    }
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::read_restart(FILE *fp)
{
  read_restart_settings(fp);
  allocate();

  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) {
      if (comm->me == 0) utils::sfread(FLERR, &setflag[i][j], sizeof(int), 1, fp, nullptr, error);
      MPI_Bcast(&setflag[i][j], 1, MPI_INT, 0, world);
      if (setflag[i][j]) {
        if (comm->me == 0) utils::sfread(FLERR, &eps[i][j], sizeof(double), 1, fp, nullptr, error);
        MPI_Bcast(&eps[i][j], 1, MPI_DOUBLE, 0, world);
      }
    }
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_restart_settings(FILE *fp)
{
  const int number = form;
  fwrite(&delta, sizeof(double), 1, fp);
  fwrite(&longest_edge, sizeof(double), 1, fp);
  fwrite(&number, sizeof(int), 1, fp);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::read_restart_settings(FILE *fp)
{
  int number = OUTLINE;
  if (comm->me == 0) {
    utils::sfread(FLERR, &delta, sizeof(double), 1, fp, nullptr, error);
    utils::sfread(FLERR, &longest_edge, sizeof(double), 1, fp, nullptr, error);
    utils::sfread(FLERR, &number, sizeof(int), 1, fp, nullptr, error);
  }
  MPI_Bcast(&delta, 1, MPI_DOUBLE, 0, world);
  MPI_Bcast(&longest_edge, 1, MPI_DOUBLE, 0, world);
  MPI_Bcast(&number, 1, MPI_INT, 0, world);
  if (number < 0 || number >= NUMBER_OF_CONTACT_FORMS)
    error->all(FLERR, "Pair style circuloline: contact form {} in the restart file is unknown to this plugin",
               number);
  form = static_cast<ContactForm>(number);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_data(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++) fprintf(fp, "%d %.17g\n", i, eps[i][i]);
}

/* ---------------------------------------------------------------------- */

void PairCirculoline::write_data_all(FILE *fp)
{
  for (int i = 1; i <= atom->ntypes; i++)
    for (int j = i; j <= atom->ntypes; j++) fprintf(fp, "%d %d %.17g\n", i, j, eps[i][j]);
}
