// SPDX-License-Identifier: GPL-2.0-or-later

/* Updates 1 and 2 of LAMMPS 22 Jul 2025 do not install this header, which their atom.h
   includes for the type of one argument. */

#pragma once

namespace LAMMPS_NS {
class json;
}
