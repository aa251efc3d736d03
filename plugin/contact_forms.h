// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_CONTACT_FORMS_H
#define JAMLAB_CONTACT_FORMS_H

#include "edge_geometry.h"
#include "polygon_facings.h"

namespace LAMMPS_NS {

/* Each form below calls touch(vertex, edge, foot, law) for every vertex (or disk) that is
   closer than the width of their contact to an edge that it meets.

   outline: every vertex meets every other outline once, at its closest point. */

template <class Touch>
void outline_contacts(const PolygonFacings &facings, const Position *x, const int *type,
                      const PairLaws &laws, Touch touch)
{
  const EdgeFrame *frames = facings.frames().data();
  const PolygonFacings::Edge *edges = facings.edges().data();
  const int *near = facings.near();
  for (const auto &facing : facings) {
    const double px = x[facing.i][0], py = x[facing.i][1];
    const PairLaw &law = laws(type[facing.i], type[edges[near[facing.begin]].tail]);
    Foot nearest = {0.0, 0.0, law.widthsq, 0.0};
    int found = -1;
    for (int n = facing.begin; n < facing.end; n++) {
      const Foot foot = foot_on_edge(px, py, frames[near[n]]);
      if (foot.rsq < nearest.rsq) {
        nearest = foot;
        found = near[n];
      }
    }
    if (found >= 0) touch(facing.i, edges[found], nearest, law);
  }
}

/* segment/smooth: every pair of edges has half the energy of each of the four
   distances from an end of one to the other. A vertex ends two edges, so it meets
   every edge of other outlines once, with its full energy. */

template <class Touch>
void smooth_segment_contacts(const PolygonFacings &facings, const Position *x, const int *type,
                             const PairLaws &laws, Touch touch)
{
  const EdgeFrame *frames = facings.frames().data();
  const PolygonFacings::Edge *edges = facings.edges().data();
  const int *near = facings.near();
  for (const auto &facing : facings) {
    const double px = x[facing.i][0], py = x[facing.i][1];
    const PairLaw &law = laws(type[facing.i], type[edges[near[facing.begin]].tail]);
    for (int n = facing.begin; n < facing.end; n++) {
      const Foot foot = foot_on_edge(px, py, frames[near[n]]);
      if (foot.rsq < law.widthsq) touch(facing.i, edges[near[n]], foot, law);
    }
  }
}

/* segment: Boromand et al. eq 8 to the letter: every pair of edges meets once, at
   its smallest distance. That is one of the four distances of an end to the other
   edge, or 0 if they cross. */

template <class Touch>
void segment_contacts(const PolygonFacings &facings, const Position *x, const int *type,
                      const PairLaws &laws, Touch touch)
{
  using Edge = PolygonFacings::Edge;
  for (const auto &facing : facings) {
    const Edge a = {facing.i, facing.j};
    for (int n = facing.begin; n < facing.end; n++) {
      const Edge b = facings.edges()[facings.near()[n]];
      const int vertex[4] = {a.tail, a.head, b.tail, b.head};
      const Edge edge[4] = {b, b, a, a};

      const PairLaw &law = laws(type[a.tail], type[b.tail]);
      Foot nearest = {0.0, 0.0, law.widthsq, 0.0};
      int found = -1;
      for (int k = 0; k < 4; k++) {
        const Foot foot = foot_on_edge(x[vertex[k]], x[edge[k].tail], x[edge[k].head]);
        if (foot.rsq < nearest.rsq) {
          nearest = foot;
          found = k;
        }
      }
      if (edges_cross(x[a.tail], x[a.head], x[b.tail], x[b.head]))
        touch(a.tail, b, Foot{0.0, 0.0, 0.0, 0.0}, law);
      else if (found >= 0)
        touch(vertex[found], edge[found], nearest, law);
    }
  }
}

template <class Touch>
void for_each_contact(ContactForm form, const PolygonFacings &facings, const Position *x, const int *type,
                      const PairLaws &laws, Touch touch)
{
  switch (form) {
    case SEGMENT:
      return segment_contacts(facings, x, type, laws, touch);
    case OUTLINE:
      return outline_contacts(facings, x, type, laws, touch);
    case SEGMENT_SMOOTH:
      return smooth_segment_contacts(facings, x, type, laws, touch);
  }
}

}    // namespace LAMMPS_NS

#endif
