// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "comm.h"
#include "error.h"
#include "lammps.h"
#include "utils.h"

#include <cstdio>
#include <string>

namespace LAMMPS_NS {

/* Restart files hold values as bytes. One rank reads them for all. */
template <class Value>
void read_everywhere(LAMMPS *lmp, FILE *fp, Value *values, std::size_t count = 1)
{
  const std::size_t size = sizeof(Value);
  if (lmp->comm->me == 0) utils::sfread(FLERR, values, size, count, fp, nullptr, lmp->error);
  MPI_Bcast(values, static_cast<int>(count * size), MPI_BYTE, 0, lmp->world);
}

inline void read_everywhere(LAMMPS *lmp, FILE *fp, std::string *text)
{
  int size;
  read_everywhere(lmp, fp, &size);
  text->resize(size);
  read_everywhere(lmp, fp, text->data(), size);
}

template <class Value> void write_value(FILE *fp, const Value &value)
{
  fwrite(&value, sizeof(Value), 1, fp);
}

inline void write_value(FILE *fp, const std::string &text)
{
  write_value(fp, static_cast<int>(text.size()));
  fwrite(text.data(), 1, text.size(), fp);
}

}    // namespace LAMMPS_NS
