// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <mpi.h>

#include <type_traits>
#include <vector>

namespace LAMMPS_NS {

/* Every rank gets the records of all ranks, in the order of the ranks. */
template <class Record> std::vector<Record> gather_records(std::vector<Record> own, MPI_Comm world)
{
  static_assert(std::is_trivially_copyable<Record>::value, "records travel as bytes");
  int ranks, size = static_cast<int>(own.size() * sizeof(Record));
  MPI_Comm_size(world, &ranks);
  if (ranks == 1) return own;
  std::vector<int> sizes(ranks), starts(ranks, 0);
  MPI_Allgather(&size, 1, MPI_INT, sizes.data(), 1, MPI_INT, world);
  for (int r = 1; r < ranks; r++) starts[r] = starts[r - 1] + sizes[r - 1];
  std::vector<Record> all((starts.back() + sizes.back()) / sizeof(Record));
  MPI_Allgatherv(own.data(), size, MPI_BYTE, all.data(), sizes.data(), starts.data(), MPI_BYTE,
                 world);
  return all;
}

}    // namespace LAMMPS_NS
