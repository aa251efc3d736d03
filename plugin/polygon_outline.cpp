// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "polygon_outline.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "edge_geometry.h"
#include "error.h"

#include <cmath>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

void PolygonOutline::init(const char *caller, int groupbit)
{
  topology.build(caller);

  std::vector<double> in_group(count() + 1, 0.0);
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->mask[i] & groupbit) in_group[atom->molecule[i]] += 1.0;
  sum(in_group);
  for (tagint m = 1; m <= count(); m++)
    if (in_group[m] > 0.0 && in_group[m] != static_cast<double>(topology.size(m)))
      error->all(FLERR, std::string(caller) + ": the group holds {:.0f} of the {} vertices of polygon {}, needs all or none",
                 in_group[m], topology.size(m), m);
}

/* ---------------------------------------------------------------------- */

void PolygonOutline::refresh(const char *caller, int groupbit)
{
  const tagint *molecule = atom->molecule;
  const int nlocal = atom->nlocal;

  owned.clear();
  origin.assign(2 * (count() + 1), 0.0);
  std::vector<double> first(origin);

  for (int i = 0; i < nlocal; i++) {
    const tagint m = molecule[i];
    if (m == 0 || !(atom->mask[i] & groupbit)) continue;
    const int prev = topology.prev(i), next = topology.next(i);
    if (prev < 0 || next < 0)
      error->one(FLERR, std::string(caller) +
                     ": vertex {} cannot see its neighbors on polygon {}: raise comm_modify cutoff",
                 atom->tag[i], m);
    const imageint image = atom->image[i];
    owned.push_back({i, prev, next, static_cast<int>(image & IMGMASK) - IMGMAX,
                     static_cast<int>(image >> IMGBITS & IMGMASK) - IMGMAX});
    if (atom->tag[i] == topology.first_tag(m)) position(owned.back(), &first[2 * m]);
  }
  origin.swap(first);
  sum(origin);
}

/* ---------------------------------------------------------------------- */

void PolygonOutline::position(const Vertex &vertex, double *r) const
{
  const double *x = atom->x[vertex.i];
  const double *from = &origin[2 * atom->molecule[vertex.i]];
  r[0] = x[0] + vertex.a * domain->xprd + vertex.b * domain->xy - from[0];
  r[1] = x[1] + vertex.b * domain->yprd - from[1];
}

/* ----------------------------------------------------------------------
   a = (1/2) sum x_i cross x_{i+1}. Any fixed origin gives the same closed sum;
   one near the polygon keeps its digits.
------------------------------------------------------------------------- */

void PolygonOutline::areas(std::vector<double> &area) const
{
  const double *const *x = atom->x;
  area.assign(count() + 1, 0.0);
  for (const auto &vertex : owned) {
    const int i = vertex.i;
    double r[2];
    position(vertex, r);
    area[atom->molecule[i]] += 0.5 * (r[0] * (x[vertex.next][1] - x[i][1]) -
                                      r[1] * (x[vertex.next][0] - x[i][0]));
  }
  sum(area);
}

/* ---------------------------------------------------------------------- */

void PolygonOutline::perimeters(std::vector<double> &perimeter) const
{
  const double *const *x = atom->x;
  perimeter.assign(count() + 1, 0.0);
  for (const auto &vertex : owned)
    perimeter[atom->molecule[vertex.i]] += std::hypot(x[vertex.next][0] - x[vertex.i][0],
                                                      x[vertex.next][1] - x[vertex.i][1]);
  sum(perimeter);
}

/* ----------------------------------------------------------------------
   pairs of edges of one polygon that pass through each other. No rank need own
   a whole polygon: all get all vertices, and share the polygons.
------------------------------------------------------------------------- */

void PolygonOutline::crossings(std::vector<double> &crossing) const
{
  std::vector<std::size_t> begin(count() + 2, 0);    // of each molecule, in vertices
  for (tagint m = 1; m <= count(); m++) begin[m + 1] = begin[m] + topology.size(m);

  std::vector<double> r(2 * begin.back(), 0.0);
  for (const auto &vertex : owned) {
    const tagint m = atom->molecule[vertex.i];
    position(vertex, &r[2 * (begin[m] + atom->tag[vertex.i] - topology.first_tag(m))]);
  }
  sum(r);

  crossing.assign(count() + 1, 0.0);
  for (tagint m = 1 + comm->me; m <= count(); m += comm->nprocs) {
    const int size = static_cast<int>(topology.size(m));
    auto vertex = [&](int k) { return &r[2 * (begin[m] + k % size)]; };
    for (int a = 0; a < size; a++)
      for (int b = a + 2; b < size; b++)
        if (edges_cross(vertex(a), vertex(a + 1), vertex(b), vertex(b + 1))) crossing[m] += 1.0;
  }
  sum(crossing);
}

/* ---------------------------------------------------------------------- */

void PolygonOutline::sum(std::vector<double> &values) const
{
  if (comm->nprocs > 1)
    MPI_Allreduce(MPI_IN_PLACE, values.data(), static_cast<int>(values.size()), MPI_DOUBLE, MPI_SUM,
                  world);
}
