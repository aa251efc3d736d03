// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

namespace LAMMPS_NS {

/* LAMMPS prints the memory usage of styles: this is what vectors hold. */
template <class... Vectors> double bytes(const Vectors &...vectors)
{
  return (0.0 + ... + (vectors.capacity() * sizeof(typename Vectors::value_type)));
}

}    // namespace LAMMPS_NS
