// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

/* Updates 1 and 2 of LAMMPS 22 Jul 2025 do not install this header, which their atom.h
   includes for the type of one argument. */

#ifndef JAMLAB_JSON_FWD_H
#define JAMLAB_JSON_FWD_H

namespace LAMMPS_NS {
class json;
}

#endif
