// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "polygon_facings.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "edge_geometry.h"
#include "error.h"
#include "neigh_list.h"
#include "neighbor.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

void PolygonFacings::mark()
{
  copies.resize(atom->nlocal + atom->nghost);
  for (int i = 0; i < atom->nlocal; i++) {
    const imageint image = atom->image[i];
    copies[i] = {static_cast<int>(image & IMGMASK) - IMGMAX,
                 static_cast<int>(image >> IMGBITS & IMGMASK) - IMGMAX};
  }
}

/* ----------------------------------------------------------------------
   a ghost lies pbc lattice vectors from the atom that it is a copy of
------------------------------------------------------------------------- */

int PolygonFacings::pack(int n, const int *list, double *buf, const int *pbc) const
{
  for (int k = 0; k < n; k++) {
    const Copy &copy = copies[list[k]];
    buf[2 * k] = copy.a - pbc[0];
    buf[2 * k + 1] = copy.b - pbc[1];
  }
  return 2 * n;
}

/* ---------------------------------------------------------------------- */

void PolygonFacings::unpack(int n, int first, const double *buf)
{
  for (int k = 0; k < n; k++)
    copies[first + k] = {static_cast<int>(buf[2 * k]), static_cast<int>(buf[2 * k + 1])};
}

/* ----------------------------------------------------------------------
   which edges can come within delta of which vertex (or edge) before the next
   build. Ends move by less than half the skin, so nothing farther than
   reach = delta + skin now can touch until then.
------------------------------------------------------------------------- */

void PolygonFacings::build(const NeighList *list, Grouping grouping, double reach,
                           double longest_edge)
{
  const double *const *x = atom->x;
  const tagint *tag = atom->tag;
  const tagint *molecule = atom->molecule;
  const double reachsq = reach * reach;

  find_successors();
  check_edges(longest_edge);
  found.clear();
  near.clear();

  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    if (molecule[i] == 0) continue;
    const int inext = successor[i];
    const int *jlist = list->firstneigh[i];
    const int jnum = list->numneigh[i];
    candidates.clear();

    for (int jj = 0; jj < jnum; jj++) {
      const int j = jlist[jj] & NEIGHMASK;
      const int jnext = successor[j];
      if (jnext < 0) continue;    // no vertex, or an edge whose head is beyond reach
      if (molecule[j] == molecule[i] && copies[j] == copies[i]) continue;
      if (grouping == BY_EDGE && earlier(j, i)) continue;    // the other edge has this pair

      double rsq = foot_on_edge(x[i], x[j], x[jnext]).rsq;
      if (grouping == BY_EDGE)
        rsq = std::min({rsq, foot_on_edge(x[inext], x[j], x[jnext]).rsq,
                        foot_on_edge(x[j], x[i], x[inext]).rsq,
                        foot_on_edge(x[jnext], x[i], x[inext]).rsq});
      if (rsq < reachsq ||
          (grouping == BY_EDGE && edges_cross(x[i], x[inext], x[j], x[jnext])))
        candidates.push_back({molecule[j], tag[j], copies[j], {j, jnext}});
    }

    // in an order that does not depend on where atoms are stored: sums have the same digits
    std::sort(candidates.begin(), candidates.end());
    for (std::size_t n = 0; n < candidates.size(); n++) {
      const int size = static_cast<int>(near.size());
      if (n == 0 || (grouping == BY_POLYGON && !candidates[n].same_polygon(candidates[n - 1])))
        found.push_back({i, inext, size, size});
      near.push_back(candidates[n].edge);
      found.back().end++;
    }
  }
}

/* ---------------------------------------------------------------------- */

bool PolygonFacings::Candidate::operator<(const Candidate &o) const
{
  if (molecule != o.molecule) return molecule < o.molecule;
  if (!(copy == o.copy)) return copy < o.copy;
  return tag < o.tag;
}

/* ----------------------------------------------------------------------
   one order for a pair of edges, the same whichever of their images meet
------------------------------------------------------------------------- */

bool PolygonFacings::earlier(int i, int j) const
{
  if (atom->tag[i] != atom->tag[j]) return atom->tag[i] < atom->tag[j];
  return copies[i] < copies[j];
}

/* ---------------------------------------------------------------------- */

void PolygonFacings::find_successors()
{
  const int nall = atom->nlocal + atom->nghost;
  successor.assign(nall, -1);
  for (int i = 0; i < nall; i++) {
    if (atom->molecule[i] == 0) continue;
    int j = atom->map(topology.next_tag(atom->tag[i], atom->molecule[i]));
    while (j >= 0 && !(copies[j] == copies[i])) j = atom->sametag[j];
    successor[i] = j;
  }
}

/* ----------------------------------------------------------------------
   every owned edge is whole, short enough for the neighbor cutoff, and the one
   that the bond between its ends takes. Collective: all ranks stop together.
------------------------------------------------------------------------- */

void PolygonFacings::check_edges(double longest_edge) const
{
  enum { FINE, TOO_LONG, OTHER_IMAGE, HEAD_ABSENT };
  const double *const *x = atom->x;
  struct {
    int status, rank;
  } worst = {FINE, comm->me};
  double length = 0.0;
  tagint ends[2] = {0, 0};

  for (int i = 0; i < atom->nlocal; i++) {
    if (atom->molecule[i] == 0) continue;
    const int j = successor[i];
    int status = FINE;
    double edge = 0.0;
    if (j < 0) {
      status = HEAD_ABSENT;
    } else {
      edge = std::hypot(x[i][0] - x[j][0], x[i][1] - x[j][1]);
      if (edge > longest_edge) status = TOO_LONG;
      const int bonded = domain->closest_image(i, j);
      if (!(copies[bonded] == copies[j])) status = OTHER_IMAGE;
    }
    if (status < worst.status || (status == worst.status && edge <= length)) continue;
    worst.status = status;
    length = edge;
    ends[0] = atom->tag[i];
    ends[1] = topology.next_tag(atom->tag[i], atom->molecule[i]);
  }

  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_2INT, MPI_MAXLOC, world);
  if (worst.status == FINE) return;
  MPI_Bcast(&length, 1, MPI_DOUBLE, worst.rank, world);
  MPI_Bcast(ends, 2, MPI_LMP_TAGINT, worst.rank, world);

  if (worst.status == TOO_LONG)
    error->all(FLERR, "Pair style circuloline: the edge between atoms {} and {} is {:.6g} long, "
               "more than the {:.6g} that pair_style circuloline allows: raise its second argument "
               "(neighbor cutoff now {:.6g})",
               ends[0], ends[1], length, longest_edge, neighbor->cutneighmax);
  if (worst.status == OTHER_IMAGE)
    error->all(FLERR, "Pair style circuloline: the edge between atoms {} and {} is {:.6g} long, more "
               "than half the box, so that the bond between them takes another image: use a larger "
               "box or more vertices per polygon", ends[0], ends[1], length);
  error->all(FLERR, "Pair style circuloline: vertex {} cannot see the next one, {}: the edge between "
             "them outgrew the communication cutoff {:.6g} (raise the second argument of pair_style "
             "circuloline or comm_modify cutoff), or image flags do not make the polygon whole",
             ends[0], ends[1], std::max(neighbor->cutneighmax, comm->cutghostuser));
}

/* ---------------------------------------------------------------------- */

double PolygonFacings::memory_usage() const
{
  return found.capacity() * sizeof(Facing) + near.capacity() * sizeof(Edge) +
      copies.capacity() * sizeof(Copy) + successor.capacity() * sizeof(int) +
      candidates.capacity() * sizeof(Candidate);
}
