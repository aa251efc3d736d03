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

static constexpr double BIG = 1.0e300;

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

  nlocal = atom->nlocal;
  nghost = atom->nghost;
  find_successors();
  check_edges(longest_edge);
  facing_list.clear();
  edge_list.clear();

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
      const int size = static_cast<int>(edge_list.size());
      if (n == 0 || (grouping == BY_POLYGON && !candidates[n].same_polygon(candidates[n - 1])))
        facing_list.push_back({i, inext, size, size});
      edge_list.push_back(candidates[n].edge);
      facing_list.back().end++;
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
   every owned edge is short enough for the neighbor cutoff, and the one that
   the bond between its ends takes. Collective: all ranks stop together.
------------------------------------------------------------------------- */

void PolygonFacings::check_edges(double longest_edge) const
{
  enum { FINE, OTHER_IMAGE, TOO_LONG };
  const double *const *x = atom->x;
  struct {
    int status, rank;
  } worst = {FINE, comm->me};
  double longest = 0.0;
  tagint ends[2] = {0, 0};

  for (int i = 0; i < atom->nlocal; i++) {
    if (atom->molecule[i] == 0) continue;
    const int j = successor[i];
    const double length = j < 0 ? BIG : std::hypot(x[i][0] - x[j][0], x[i][1] - x[j][1]);
    int status = FINE;
    if (length > longest_edge)
      status = TOO_LONG;
    else if (!(copies[domain->closest_image(i, j)] == copies[j]))
      status = OTHER_IMAGE;
    if (status == FINE || status < worst.status || (status == worst.status && length <= longest))
      continue;
    worst.status = status;
    longest = length;
    ends[0] = atom->tag[i];
    ends[1] = topology.next_tag(atom->tag[i], atom->molecule[i]);
  }

  MPI_Allreduce(MPI_IN_PLACE, &worst, 1, MPI_2INT, MPI_MAXLOC, world);
  if (worst.status == FINE) return;
  MPI_Bcast(ends, 2, MPI_LMP_TAGINT, worst.rank, world);

  // the head may be owned by a rank far away: ask all for both ends

  double r[6] = {0.0};
  for (int k = 0; k < 2; k++) {
    const int i = atom->map(ends[k]);
    if (i >= 0 && i < atom->nlocal) domain->unmap(x[i], atom->image[i], r + 3 * k);
  }
  MPI_Allreduce(MPI_IN_PLACE, r, 6, MPI_DOUBLE, MPI_SUM, world);
  const double length = std::hypot(r[3] - r[0], r[4] - r[1]);

  if (worst.status == TOO_LONG)
    error->all(FLERR, "Pair style circuloline: the edge between atoms {} and {} is {:.6g} long, "
               "more than the {:.6g} that pair_style circuloline allows: raise its second argument "
               "(that raises the neighbor cutoff, now {:.6g}), or check the image flags, which must "
               "make the polygon whole", ends[0], ends[1], length, longest_edge, neighbor->cutneighmax);
  error->all(FLERR, "Pair style circuloline: the edge between atoms {} and {} is {:.6g} long, more than "
             "half the box, so that the bond between them takes another image: use a larger box or "
             "more vertices per polygon", ends[0], ends[1], length);
}

/* ---------------------------------------------------------------------- */

bool PolygonFacings::fit_atoms() const
{
  return atom->nlocal == nlocal && atom->nghost == nghost;
}

/* ---------------------------------------------------------------------- */

double PolygonFacings::memory_usage() const
{
  return facing_list.capacity() * sizeof(Facing) + edge_list.capacity() * sizeof(Edge) +
      copies.capacity() * sizeof(Copy) + successor.capacity() * sizeof(int) +
      candidates.capacity() * sizeof(Candidate);
}
