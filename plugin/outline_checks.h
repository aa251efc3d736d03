// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "contact_law.h"

namespace LAMMPS_NS {

/* Collective, after each neighbor build: every atom that pair style circuloline moves
   is what its type says (vertex of a ring, of a wall, or a disk), every edge is short
   enough for the neighbor cutoff, of one law, and in the image that the bond between
   its ends takes. All ranks stop together with the worst case. */
void check_outlines(class LAMMPS *, const class FixPolygonOutline &, const class NeighList *,
                    const ContactLaws &);

// of one rank: no factor of special_bonds would have to weaken a contact with an edge
void check_special_bonds(class LAMMPS *, const ContactLaws &);

}    // namespace LAMMPS_NS
