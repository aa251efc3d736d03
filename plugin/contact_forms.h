// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_CONTACT_FORMS_H
#define JAMLAB_CONTACT_FORMS_H

#include "edge_geometry.h"
#include "polygon_facings.h"

namespace LAMMPS_NS {

/* The contact forms: who meets whom. Each calls touch(owner, vertex, edge, foot)
   for every meeting closer than delta of a vertex with an edge; its energy is
   (eps/2)(1 - d/delta)^2 of their distance d, and the rank of `owner` has it. */

/* Every vertex meets every other polygon once, at the closest point of its outline. */

template <class Touch>
void outline_contacts(const PolygonFacings &near, const double *const *x, double delta, Touch touch)
{
  const PolygonFacings::Edge *edges = near.edges().data();
  for (const auto &facing : near.facings()) {
    const double *vertex = x[facing.i];
    Foot nearest = {0.0, 0.0, delta * delta, 0.0};
    int found = -1;
    for (int n = facing.begin; n < facing.end; n++) {
      const Foot foot = foot_on_edge(vertex, x[edges[n].tail], x[edges[n].head]);
      if (foot.rsq < nearest.rsq) {
        nearest = foot;
        found = n;
      }
    }
    if (found >= 0) touch(facing.i, facing.i, edges[found], nearest);
  }
}

/* Every pair of edges has half the energy of each of the four distances from an
   end of one to the other. A vertex ends two edges, so it meets every edge of
   other polygons once, with its full energy. */

template <class Touch>
void smooth_segment_contacts(const PolygonFacings &near, const double *const *x, double delta,
                             Touch touch)
{
  const PolygonFacings::Edge *edges = near.edges().data();
  const double deltasq = delta * delta;
  for (const auto &facing : near.facings()) {
    const double *vertex = x[facing.i];
    for (int n = facing.begin; n < facing.end; n++) {
      const Foot foot = foot_on_edge(vertex, x[edges[n].tail], x[edges[n].head]);
      if (foot.rsq < deltasq) touch(facing.i, facing.i, edges[n], foot);
    }
  }
}

/* Boromand et al. eq 8 to the letter: every pair of edges meets once, at its
   smallest distance. That is one of the four distances of an end to the other
   edge, or 0 if they cross. */

template <class Touch>
void segment_contacts(const PolygonFacings &near, const double *const *x, double delta, Touch touch)
{
  using Edge = PolygonFacings::Edge;
  const Edge *edges = near.edges().data();
  for (const auto &facing : near.facings()) {
    const Edge a = {facing.i, facing.j};
    for (int n = facing.begin; n < facing.end; n++) {
      const Edge b = edges[n];
      const int vertex[4] = {a.tail, a.head, b.tail, b.head};
      const Edge edge[4] = {b, b, a, a};

      Foot nearest = {0.0, 0.0, delta * delta, 0.0};
      int found = -1;
      for (int k = 0; k < 4; k++) {
        const Foot foot = foot_on_edge(x[vertex[k]], x[edge[k].tail], x[edge[k].head]);
        if (foot.rsq < nearest.rsq) {
          nearest = foot;
          found = k;
        }
      }
      if (edges_cross(x[a.tail], x[a.head], x[b.tail], x[b.head]))
        touch(a.tail, a.tail, b, Foot{0.0, 0.0, 0.0, 0.0});
      else if (found >= 0)
        touch(a.tail, vertex[found], edge[found], nearest);
    }
  }
}

}    // namespace LAMMPS_NS

#endif
