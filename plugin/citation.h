// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "citeme.h"
#include "lammps.h"

namespace LAMMPS_NS {

static constexpr char CITE_CIRCULOLINE[] =
    "pair_style circuloline: https://doi.org/10.1039/C9SM00775J\n\n"
    "@Article{Boromand2019,\n"
    " author =  {Boromand, A. and Signoriello, A. and Lowensohn, J. and Orellana, C. S. and\n"
    "            Weeks, E. R. and Ye, F. and Shattuck, M. D. and O'Hern, C. S.},\n"
    " title =   {The role of deformability in determining the structural and mechanical\n"
    "            properties of bubbles and emulsions},\n"
    " journal = {Soft Matter},\n"
    " year =    2019,\n"
    " volume =  15,\n"
    " pages =   5854,\n"
    " doi =     {10.1039/C9SM00775J}\n"
    "}\n\n";

static constexpr char CITE_CONTACT_DRAG[] =
    "pair_style disk/drag: https://doi.org/10.1039/C7SM01619K\n\n"
    "@Article{Baumgarten2017,\n"
    " author =  {Baumgarten, K. and Tighe, B. P.},\n"
    " title =   {Viscous forces and bulk viscoelasticity near jamming},\n"
    " journal = {Soft Matter},\n"
    " year =    2017,\n"
    " volume =  13,\n"
    " pages =   8368,\n"
    " doi =     {10.1039/C7SM01619K}\n"
    "}\n\n";

/* Asks users of a pair style to cite its paper. LAMMPS lists the paper once, however often this is
   called, and not at all with -nocite. */
inline void cite(LAMMPS *lmp, const char *paper)
{
  if (lmp->citeme) lmp->citeme->add(paper);
}

}    // namespace LAMMPS_NS
