// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "contact_law.h"

namespace LAMMPS_NS {

/* These functions check what pair style circuloline takes for granted; `who` names it in errors. */

// Collective, after each neighbor build: every atom that the style moves is what its type says, a
// vertex of a ring, a vertex of a wall or a disk, and stays in the plane. Every edge is short
// enough for the neighbor cutoff, has one law, and lies in the image that the bond between its ends
// takes. All ranks stop together with the worst case.
void check_outlines(class LAMMPS *, const char *who, const class FixPolygonOutline &,
                    const class NeighList *, const ContactLaws &);

// Each rank checks that no factor of special_bonds would have to weaken a contact with an edge.
void check_special_bonds(class LAMMPS *, const char *who, const ContactLaws &);

// Collective: no compute may take the neighbors of a vertex for its contacts without a word. LAMMPS
// itself refuses computes that call single().
void refuse_computes(class LAMMPS *, const char *who);

}    // namespace LAMMPS_NS
