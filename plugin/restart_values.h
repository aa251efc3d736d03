// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "comm.h"
#include "error.h"
#include "lammps.h"
#include "utils.h"

#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

namespace LAMMPS_NS {

inline constexpr int LONGEST_TEXT = 65536;    // names of properties

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
  if (size < 0 || size > LONGEST_TEXT)
    lmp->error->all(FLERR, "The restart file is damaged: a text of the jamlab plugin has {} bytes",
                    size);
  text->resize(size);
  read_everywhere(lmp, fp, text->data(), size);
}

/* What a fix keeps, value by value in one order: written, or read back as far as the record
   goes. */
class RestartBytes {
 public:
  RestartBytes() = default;    // to be written
  RestartBytes(const char *record, std::size_t size) : next(record), left(size) {}

  template <class Value> void operator()(Value &value)
  {
    if (!next)
      bytes.append(reinterpret_cast<const char *>(&value), sizeof(Value));
    else if (take(sizeof(Value)))
      memcpy(&value, next - sizeof(Value), sizeof(Value));
  }
  template <class Value> void operator()(std::vector<Value> &values)
  {
    std::size_t size = values.size();
    (*this)(size);
    if (next && size > left / sizeof(Value)) fits = false;
    if (!fits) return;
    values.resize(size);
    for (Value &each : values) (*this)(each);
  }
  const std::string &written() const { return bytes; }
  bool complete() const { return fits && left == 0; }    // read to the end, and not beyond

 private:
  std::string bytes;
  const char *next = nullptr;
  std::size_t left = 0;
  bool fits = true;

  bool take(std::size_t size)
  {
    fits = fits && size <= left;
    if (!fits) return false;
    next += size;
    left -= size;
    return true;
  }
};

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
