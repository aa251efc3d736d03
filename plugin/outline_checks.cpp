// SPDX-License-Identifier: GPL-2.0-or-later

#include "outline_checks.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix_polygon_outline.h"
#include "force.h"
#include "lammps.h"
#include "neigh_list.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr char STYLE[] = "Pair style circuloline";
static constexpr double BIG = 1.0e300;

namespace {

enum Fault { NONE, OTHER_IMAGE, OTHER_LAW, TOO_LONG, NOT_AN_OUTLINE };    // the last is the worst

struct Finding {
  Fault fault = NONE;
  double length = 0.0;
  int i = -1;
};

bool same_law(const ContactLaws &laws, int ntypes, int a, int b)
{
  if (a == b) return true;
  for (int k = 1; k <= ntypes; k++)
    if (laws.eps[a][k] != laws.eps[b][k] || laws.width[a][k] != laws.width[b][k] || laws.form[a][k] != laws.form[b][k])
      return false;
  return laws.role[a] == laws.role[b];
}

Finding fault_of(LAMMPS *lmp, const FixPolygonOutline &outline, const ContactLaws &laws, int i)
{
  const Atom *const atom = lmp->atom;
  const int type = atom->type[i];
  const int kind = outline.link(i).kind;
  if (laws.disk(type)) return {};
  if (kind != RING && !(kind == CHAIN && laws.role[type] == WALL)) return {NOT_AN_OUTLINE, BIG, i};
  if (!outline.link(i).next) return {};    // the end of a chain

  const int j = outline.next(i);
  const double *const *x = atom->x;
  const double length = j < 0 ? BIG : std::hypot(x[i][0] - x[j][0], x[i][1] - x[j][1]);
  if (length > laws.longest_edge) return {TOO_LONG, length, i};
  if (!same_law(laws, atom->ntypes, type, atom->type[j])) return {OTHER_LAW, length, i};
  if (!(outline.image(lmp->domain->closest_image(i, j)) == outline.image(j))) return {OTHER_IMAGE, length, i};
  return {};
}

/* what the rank that has found the worst knows of it; the head of an edge may be owned far away */
struct Report {
  tagint ends[2], molecule;
  int type, kind;
};

double length_of_edge(LAMMPS *lmp, const tagint *ends)
{
  const Atom *const atom = lmp->atom;
  const Domain *const domain = lmp->domain;
  double r[2][4] = {};    // x and y in the box, image
  for (int k = 0; k < 2; k++) {
    const int i = lmp->atom->map(ends[k]);
    if (i < 0 || i >= atom->nlocal) continue;
    const ImageOffset image(atom->image[i]);
    const double own[4] = {atom->x[i][0], atom->x[i][1], static_cast<double>(image.a), static_cast<double>(image.b)};
    std::copy_n(own, 4, r[k]);
  }
  MPI_Allreduce(MPI_IN_PLACE, r[0], 8, MPI_DOUBLE, MPI_SUM, lmp->world);
  const auto image = [&](int k) { return ImageOffset(static_cast<int>(r[k][2]), static_cast<int>(r[k][3])); };
  const ImageOffset apart = image(1) - image(0);
  return std::hypot(r[1][0] - r[0][0] + apart.a * domain->xprd + apart.b * domain->xy,
                    r[1][1] - r[0][1] + apart.b * domain->yprd);
}

void refuse_bonds(LAMMPS *lmp, const Report &report)
{
  Error *const error = lmp->error;
  const tagint tag = report.ends[0], molecule = report.molecule;
  if (report.kind == CHAIN)
    error->all(FLERR, "{}: the bonds of molecule {} (atom {}) make an open chain and no closed ring: add the missing "
               "bond, or name type {} in walls of pair_style circuloline", STYLE, molecule, tag, report.type);
  if (report.kind == TANGLE)
    error->all(FLERR, "{}: the bonds of molecule {} (atom {}) branch, or are more than one ring: an outline is one "
               "ring of bonds, with two at each vertex, and has a molecule ID of its own", STYLE, molecule, tag);
  error->all(FLERR, "{}: atom {} of type {} has no bonds to be the vertex of an outline: name type {} in disks of "
             "pair_style circuloline, or leave it to another style of pair_style hybrid", STYLE, tag, report.type,
             report.type);
}

}    // namespace

void LAMMPS_NS::check_outlines(LAMMPS *lmp, const FixPolygonOutline &outline, const NeighList *list,
                               const ContactLaws &laws)
{
  const Atom *const atom = lmp->atom;
  Error *const error = lmp->error;
  Finding worst;
  for (int ii = 0; ii < list->inum; ii++) {
    const Finding found = fault_of(lmp, outline, laws, list->ilist[ii]);
    if (found.fault > worst.fault || (found.fault == worst.fault && found.length > worst.length)) worst = found;
  }

  const int nprocs = lmp->comm->nprocs, me = lmp->comm->me;
  int first = worst.fault * nprocs + (nprocs - 1 - me);    // the worst fault, of the lowest rank that has it
  MPI_Allreduce(MPI_IN_PLACE, &first, 1, MPI_INT, MPI_MAX, lmp->world);
  const int fault = first / nprocs, rank = nprocs - 1 - first % nprocs;
  if (fault == NONE) return;

  Report report = {};
  if (me == rank) {
    const OutlineLink &link = outline.link(worst.i);
    report = {{atom->tag[worst.i], link.next}, atom->molecule[worst.i], atom->type[worst.i], link.kind};
  }
  MPI_Bcast(&report, sizeof(Report), MPI_BYTE, rank, lmp->world);
  if (fault == NOT_AN_OUTLINE) refuse_bonds(lmp, report);

  const double length = length_of_edge(lmp, report.ends);
  if (fault == OTHER_LAW)
    error->all(FLERR, "{}: atoms {} and {} of one outline have types with different coefficients: give the vertices of "
               "an outline one type, or their types the same pair_coeff", STYLE, report.ends[0], report.ends[1]);
  if (fault == TOO_LONG)
    error->all(FLERR, "{}: the edge between atoms {} and {} is {:.6g} long, more than the {:.6g} that pair_style "
               "circuloline allows: raise its second argument (that raises the ghost cutoff, now {:.6g}), or check "
               "the image flags, which must make the polygon whole", STYLE, report.ends[0], report.ends[1], length,
               laws.longest_edge, lmp->comm->cutghostuser);
  error->all(FLERR, "{}: the edge between atoms {} and {} is {:.6g} long, more than half the box, so that the bond "
             "between them takes another image: use a larger box or more vertices per polygon", STYLE,
             report.ends[0], report.ends[1], length);
}

/* factors of special_bonds belong to pairs of atoms, so to pairs of disks: an edge has two ends */
void LAMMPS_NS::check_special_bonds(LAMMPS *lmp, const ContactLaws &laws)
{
  const double *const factors = lmp->force->special_lj;
  if (std::count(factors + 1, factors + 4, 1.0) == 3) return;
  Atom *const atom = lmp->atom;
  for (int i = 0; i < atom->nlocal; i++)
    for (int k = 0, level = 1; k < atom->nspecial[i][2]; k++) {
      while (k >= atom->nspecial[i][level - 1]) level++;
      const int j = atom->map(atom->special[i][k]);
      if (j < 0 || factors[level] == 1.0 || laws.start[atom->type[i]][atom->type[j]] < 0.0) continue;
      const bool idisk = laws.disk(atom->type[i]), jdisk = laws.disk(atom->type[j]);
      if ((idisk && jdisk) || (!idisk && !jdisk && atom->molecule[i] == atom->molecule[j])) continue;
      lmp->error->one(FLERR,
                      "{}: bonds join atoms {} and {}, of which one is on an outline, so that special_bonds cannot "
                      "weaken their contacts: use special_bonds lj/coul 1 1 1",
                      STYLE, atom->tag[i], atom->special[i][k]);
    }
}
