// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "contact_forms.h"

namespace LAMMPS_NS {

/* OwnContacts are contacts of polygons with themselves: of a vertex with the edges of its own
   outline, in its own image, but for the two that it ends. The range of near edges grows with the
   number of edges between, as ContactLaws says; each of them counts, or a vertex between two that
   are equally near would have no smooth energy. Of the rest, form outline takes the closest one. */
class OwnContacts : protected Pointers {
 public:
  OwnContacts(class LAMMPS *lmp) : Pointers(lmp) {}

  // At the start of each run: refuses what would hide these contacts.
  void init(const char *who, const ContactLaws &);
  // Collective, after each neighbor build: finds the edges that each vertex can touch.
  void build(const char *who, const FixPolygonOutline &, const class NeighList *,
             const ContactLaws &);
  // The list is valid until the next call.
  const std::vector<Contact> &find(const Position *x, const PairLaws &);
  double memory_usage() const { return bytes(rows, edges, of_vertex, found); }

 private:
  struct Edge {
    tagint tag;    // of the tail: the order
    int tail, head, law;
    int whole;    // law of edges farther along the outline, with the full width
    bool operator<(const Edge &o) const { return tag < o.tag; }
    bool operator==(const Edge &o) const { return tag == o.tag; }
  };
  struct Row {
    int i, begin, end;    // vertex, range in edges
    bool outline;         // its contact form
  };

  bool begins = true;    // a run
  std::vector<Row> rows;
  std::vector<Edge> edges, of_vertex;
  std::vector<Contact> found;

  void try_edge(const FixPolygonOutline &, const ContactLaws &, int i, int tail);
  void warn_of_short_edges(const char *who, const FixPolygonOutline &, const NeighList *,
                           const ContactLaws &) const;
};

}    // namespace LAMMPS_NS
