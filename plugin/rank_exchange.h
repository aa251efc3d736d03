// SPDX-License-Identifier: GPL-2.0-or-later

#pragma once

#include <mpi.h>

#include <type_traits>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

/* Records sent from every rank to every other. received[r] holds what rank r has
   sent, in its order; so an answer to each record finds its way back. */
template <class Record>
std::vector<std::vector<Record>> exchange_records(const std::vector<std::vector<Record>> &sent, MPI_Comm world)
{
  static_assert(std::is_trivially_copyable<Record>::value, "records travel as bytes");
  const int nprocs = static_cast<int>(sent.size());
  if (nprocs == 1) return sent;

  std::vector<int> out(nprocs), in(nprocs), out_begin(nprocs + 1, 0), in_begin(nprocs + 1, 0);
  for (int r = 0; r < nprocs; r++) out[r] = static_cast<int>(sent[r].size() * sizeof(Record));
  MPI_Alltoall(out.data(), 1, MPI_INT, in.data(), 1, MPI_INT, world);
  for (int r = 0; r < nprocs; r++) {
    out_begin[r + 1] = out_begin[r] + out[r];
    in_begin[r + 1] = in_begin[r] + in[r];
  }

  std::vector<Record> outgoing, incoming(in_begin[nprocs] / sizeof(Record));
  for (const auto &part : sent) outgoing.insert(outgoing.end(), part.begin(), part.end());
  MPI_Alltoallv(outgoing.data(), out.data(), out_begin.data(), MPI_BYTE, incoming.data(), in.data(),
                in_begin.data(), MPI_BYTE, world);

  std::vector<std::vector<Record>> received(nprocs);
  for (int r = 0; r < nprocs; r++)
    received[r].assign(incoming.begin() + in_begin[r] / sizeof(Record),
                       incoming.begin() + in_begin[r + 1] / sizeof(Record));
  return received;
}

}    // namespace LAMMPS_NS
