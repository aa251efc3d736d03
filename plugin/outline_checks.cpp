// SPDX-License-Identifier: GPL-2.0-or-later
#include "outline_checks.h"

#include "atom.h"
#include "comm.h"
#include "compute.h"
#include "domain.h"
#include "error.h"
#include "fix_polygon_outline.h"
#include "force.h"
#include "gather_records.h"
#include "lammps.h"
#include "modify.h"
#include "neigh_list.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>

using namespace LAMMPS_NS;

namespace {

enum Fault {    // the last is the worst
  NONE,
  OTHER_IMAGE,
  OTHER_LAW,
  TOO_LONG,
  NOT_AN_OUTLINE,
  OUT_OF_PLANE
};

constexpr double ROUNDING = 1e-6;    // of z over the longest edge, of vz over the speed

struct Finding {
  int fault = NONE;
  double length = 0.0;    // of the edge that starts at the atom; 1e300: no rank sees both its ends
  double z = 0.0, vz = 0.0;
  tagint ends[2] = {0, 0}, molecule = 0;
  int type = 0, kind = 0;

  bool operator<(const Finding &o) const
  {
    return std::tie(fault, length) < std::tie(o.fault, o.length);
  }
};

bool same_law(const ContactLaws &laws, int ntypes, int a, int b)
{
  if (a == b) return true;
  for (int k = 1; k <= ntypes; k++)
    if (!laws.same(a, b, k)) return false;
  return laws.role[a] == laws.role[b];
}

/* Outlines lie in the plane: their forces have no part along z, which neighbor lists count. */
bool leaves_plane(const Atom *atom, const ContactLaws &laws, int i)
{
  const double *const v = atom->v[i];
  const double speed = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  return std::fabs(atom->x[i][2]) > ROUNDING * laws.longest_edge ||
      std::fabs(v[2]) > ROUNDING * speed;
}

Finding fault_of(LAMMPS *lmp, const FixPolygonOutline &outline, const ContactLaws &laws, int i)
{
  Atom *const atom = lmp->atom;
  const int type = atom->type[i];
  const OutlineLink &link = outline.link(i);
  Finding found{NONE, 0.0, atom->x[i][2], atom->v[i][2], {atom->tag[i], link.next},
                atom->molecule[i], type, link.kind};
  if (leaves_plane(atom, laws, i)) found.fault = OUT_OF_PLANE;
  if (found.fault || laws.disk(type)) return found;
  if (link.kind != RING && !(link.kind == CHAIN && laws.role[type] == WALL))
    found.fault = NOT_AN_OUTLINE;
  if (found.fault || !link.next) return found;    // the end of a chain

  const int j = outline.next(i), some = atom->map(link.next);    // in the same copy; any image
  found.length = 1e300;
  if (some >= 0) {
    const ImageOffset apart = outline.image_of(some) - outline.image_of(i);
    found.length = size(apart.unwrapped(atom->x[some], lmp->domain) - jamlab::point(atom->x[i], 0));
  }
  if (j < 0 || found.length > laws.longest_edge)
    found.fault = TOO_LONG;
  else if (!same_law(laws, atom->ntypes, type, atom->type[j]))
    found.fault = OTHER_LAW;
  else if (!(outline.image_of(lmp->domain->closest_image(i, j)) == outline.image_of(j)))
    found.fault = OTHER_IMAGE;
  return found;
}

}    // namespace

void LAMMPS_NS::check_outlines(LAMMPS *lmp, const char *who, const FixPolygonOutline &outline,
                               const NeighList *list, const ContactLaws &laws)
{
  Finding own;
  for (int ii = 0; ii < list->inum; ii++)
    own = std::max(own, fault_of(lmp, outline, laws, list->ilist[ii]));
  const std::vector<Finding> all = gather_records(std::vector<Finding>{own}, lmp->world);
  const Finding &worst = *std::max_element(all.begin(), all.end());
  if (worst.fault == NONE) return;

  const auto [fault, length, z, vz, ends, molecule, type, kind] = worst;
  const auto stop = [&](const std::string &what) { lmp->error->all(FLERR, "{}: {}", who, what); };
  if (fault == OUT_OF_PLANE)
    stop(fmt::format("atom {} leaves the plane, with z {:.6g} and vz {:.6g}: use fix enforce2d, "
                     "after all fixes that add forces, regions from 0 to 0 along z for fix deposit "
                     "and create_atoms, or set group all z 0", ends[0], z, vz));
  const std::string edge = fmt::format(
      "the edge between atoms {} and {} is {:.6g} long, more than ", ends[0], ends[1], length);
  if (fault == NOT_AN_OUTLINE && kind == CHAIN)
    stop(fmt::format("the bonds of molecule {} (atom {}) make an open chain and no closed ring: "
                     "add the missing bond, or name type {} in walls of pair_style circuloline",
                     molecule, ends[0], type));
  if (fault == NOT_AN_OUTLINE && kind == TANGLE)
    stop(fmt::format("the bonds of molecule {} (atom {}) branch, or are more than one ring: an "
                     "outline is one ring of bonds, with two at each vertex, and has a molecule ID "
                     "of its own", molecule, ends[0]));
  if (fault == NOT_AN_OUTLINE)
    stop(fmt::format("atom {} of type {} has no bonds to be the vertex of an outline: name type {} "
                     "in disks of pair_style circuloline, or leave it to another style of "
                     "pair_style hybrid", ends[0], type, type));
  if (fault == OTHER_LAW)
    stop(fmt::format("atoms {} and {} of one outline have types with different coefficients: give "
                     "the vertices of an outline one type, or their types the same pair_coeff",
                     ends[0], ends[1]));
  if (fault == TOO_LONG)
    stop(edge + fmt::format("the {:.6g} that pair_style circuloline allows: raise its second "
                            "argument (that raises the ghost cutoff, now {:.6g}), correct "
                            "image flags, which must make the polygon whole, or, if the edge "
                            "has grown in this run, use a smaller timestep or weaker forces",
                            laws.longest_edge,
                            lmp->comm->cutghostuser));
  stop(edge + "half the box, so that the bond between them takes another image: use a larger box "
              "or more vertices per polygon");
}

/* Factors of special_bonds belong to pairs of atoms, so to pairs of disks: an edge has two ends. */
void LAMMPS_NS::check_special_bonds(LAMMPS *lmp, const char *who, const ContactLaws &laws)
{
  const double *const factors = lmp->force->special_lj;
  if (std::count(factors + 1, factors + 4, 1.0) == 3) return;
  Atom *const atom = lmp->atom;
  for (int i = 0; i < atom->nlocal; i++)
    for (int k = 0, level = 1; k < atom->nspecial[i][2]; k++) {
      while (k >= atom->nspecial[i][level - 1]) level++;
      const int j = atom->map(atom->special[i][k]);
      if (j < 0 || factors[level] == 1.0) continue;
      const int itype = atom->type[i], jtype = atom->type[j];
      const bool idisk = laws.disk(itype), jdisk = laws.disk(jtype);
      const bool one_outline = !idisk && !jdisk && atom->molecule[i] == atom->molecule[j];
      if (laws.initial_width[itype][jtype] < 0.0 || (idisk && jdisk) || one_outline) continue;
      lmp->error->one(FLERR, "{}: bonds join atoms {} and {}, of which one is on an outline, so "
                      "that special_bonds cannot weaken their contacts: use special_bonds lj/coul "
                      "1 1 1", who, atom->tag[i], atom->special[i][k]);
    }
}

void LAMMPS_NS::refuse_computes(LAMMPS *lmp, const char *who)
{
  Atom *const atom = lmp->atom;
  for (const char *style : {"^pair/local", "/tally$"})
    for (const Compute *compute : lmp->modify->get_compute_by_style(style)) {
      int vertices = 0;
      for (int i = 0; i < atom->nlocal; i++)
        if (atom->molecule[i] && (atom->mask[i] & compute->groupbit)) vertices = 1;
      MPI_Allreduce(MPI_IN_PLACE, &vertices, 1, MPI_INT, MPI_MAX, lmp->world);
      if (vertices)
        lmp->error->all(FLERR,
                        "{}: compute {} of style {} knows pairs of atoms only, and a contact is a "
                        "vertex and an edge: use compute polygon/contact, or a group without "
                        "polygons", who, compute->id, compute->style);
    }
}
