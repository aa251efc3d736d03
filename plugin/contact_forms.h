// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_CONTACT_FORMS_H
#define JAMLAB_CONTACT_FORMS_H

#include "edge_geometry.h"
#include "polygon_facings.h"

#include <string>

namespace LAMMPS_NS {

/* The contact forms: who meets whom. This list is the only one in C++. The
   numbers stand in restart files: append only. jamlab.packing.packing lists the
   same names for Python, and a test compares the two. */

enum ContactForm { SEGMENT, OUTLINE, SEGMENT_SMOOTH };

struct ContactFormEntry {
  const char *name;
  PolygonFacings::Grouping grouping;
  int edges;    // a contact reaches delta and this many edge lengths, see PairCirculoline::init_one
};

inline constexpr ContactFormEntry CONTACT_FORMS[] = {
    {"segment", PolygonFacings::BY_EDGE, 2},
    {"outline", PolygonFacings::BY_POLYGON, 1},
    {"segment/smooth", PolygonFacings::BY_VERTEX, 1},
};
inline constexpr int NUMBER_OF_CONTACT_FORMS = sizeof(CONTACT_FORMS) / sizeof(CONTACT_FORMS[0]);
static_assert(NUMBER_OF_CONTACT_FORMS == SEGMENT_SMOOTH + 1, "one entry for each ContactForm");

inline std::string contact_form_names(const char *separator)
{
  std::string names;
  for (const auto &form : CONTACT_FORMS) names += (names.empty() ? "" : separator) + std::string(form.name);
  return names;
}

/* Each form below calls touch(owner, vertex, edge, foot) for every vertex that is
   closer than delta to an edge that it meets. The energy of this contact is
   (eps/2)(1 - d/delta)^2 with their distance d; the rank of `owner` tallies it. */

/* Every vertex meets every other polygon once, at the closest point of its outline. */

template <class Touch>
void outline_contacts(const PolygonFacings &facings, const double *const *x, double delta, Touch touch)
{
  const PolygonFacings::Edge *edges = facings.edges().data();
  for (const auto &facing : facings) {
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
void smooth_segment_contacts(const PolygonFacings &facings, const double *const *x, double delta,
                             Touch touch)
{
  const PolygonFacings::Edge *edges = facings.edges().data();
  const double deltasq = delta * delta;
  for (const auto &facing : facings) {
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
void segment_contacts(const PolygonFacings &facings, const double *const *x, double delta, Touch touch)
{
  using Edge = PolygonFacings::Edge;
  const Edge *edges = facings.edges().data();
  for (const auto &facing : facings) {
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

template <class Touch>
void for_each_contact(ContactForm form, const PolygonFacings &facings, const double *const *x,
                      double delta, Touch touch)
{
  switch (form) {
    case SEGMENT:
      return segment_contacts(facings, x, delta, touch);
    case OUTLINE:
      return outline_contacts(facings, x, delta, touch);
    case SEGMENT_SMOOTH:
      return smooth_segment_contacts(facings, x, delta, touch);
  }
}

}    // namespace LAMMPS_NS

#endif
