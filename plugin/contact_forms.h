// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "contact_candidates.h"

namespace LAMMPS_NS {

/* A contact is a vertex or disk that is closer to an edge than the width of their law. */
struct Contact {
  int vertex, tail, head;
  int law;      // number in PairLaws
  jamlab::Foot foot;    // of crossing edges all 0
};

/* Each form below appends its contacts. Which edge is nearest and what touches cannot be predicted,
   so no branch depends on it: a contact is written first, and counted if it is one.

   outline: each vertex has at most one contact with each other outline, at its closest point. */
inline std::size_t outline_contacts(const ContactCandidates &candidates,
                                    ContactCandidates::Block block, const Position *x,
                                    const PairLaws &laws, Contact *contacts)
{
  const EdgeFrame *frames = candidates.frames();
  const ContactCandidates::Edge *edges = candidates.edges(block);
  const int *near = candidates.near();
  std::size_t count = 0;
  for (int k = block.begin; k < block.end; k++) {
    const ContactCandidates::CandidateRow &row = candidates.rows()[k];
    NearestEdge nearest(x[row.i], laws[row.law].widthsq);
    for (int n = row.begin; n < row.end; n++) nearest.meet(frames[near[n]], near[n]);
    contacts[count].vertex = k;
    contacts[count].tail = nearest.number();
    count += nearest.touches();
  }
  for (Contact *contact = contacts; contact < contacts + count; contact++) {
    const ContactCandidates::CandidateRow &row = candidates.rows()[contact->vertex];
    const EdgeFrame &frame = frames[contact->tail];
    const auto [tail, head] = edges[contact->tail];
    *contact = {row.i, tail, head, row.law, foot_on_edge(x[row.i], frame)};
  }
  return count;
}

/* segment/smooth: each pair of edges has half the energy of each of the four distances from an end
   of one to the other. A vertex ends two edges, so it has one contact with each edge of other
   outlines, with the full energy. */
inline std::size_t smooth_segment_contacts(const ContactCandidates &candidates,
                                           ContactCandidates::Block block, const Position *x,
                                           const PairLaws &laws, Contact *contacts)
{
  const EdgeFrame *frames = candidates.frames();
  const ContactCandidates::Edge *edges = candidates.edges(block);
  const int *near = candidates.near();
  std::size_t count = 0;
  for (int k = block.begin; k < block.end; k++) {
    const ContactCandidates::CandidateRow &row = candidates.rows()[k];
    const double reachsq = laws[row.law].widthsq;
    for (int n = row.begin; n < row.end; n++) {
      const jamlab::Foot foot = foot_on_edge(x[row.i], frames[near[n]]);
      contacts[count] = {row.i, edges[near[n]].tail, edges[near[n]].head, row.law, foot};
      count += foot.rsq < reachsq;
    }
  }
  return count;
}

inline std::size_t find_contacts(ContactForm form, const ContactCandidates &candidates,
                                 ContactCandidates::Block block, const Position *x,
                                 const PairLaws &laws, Contact *contacts)
{
  return form == OUTLINE ? outline_contacts(candidates, block, x, laws, contacts)
                         : smooth_segment_contacts(candidates, block, x, laws, contacts);
}

}    // namespace LAMMPS_NS
