// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

namespace LAMMPS_NS {

/* Memory that vectors hold, for the memory usage that LAMMPS prints. */
template <class... Vectors> double bytes(const Vectors &...vectors)
{
  return (0.0 + ... + (vectors.capacity() * sizeof(typename Vectors::value_type)));
}

}    // namespace LAMMPS_NS
