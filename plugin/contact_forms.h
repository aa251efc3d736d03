// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "contact_candidates.h"

namespace LAMMPS_NS {

/* A contact is a vertex or disk within the reach of the law that it has with an edge. */
struct Contact {
  int vertex, tail, head;
  int law;      // number in PairLaws
  jamlab::Foot foot;    // of crossing edges all 0
};

/* A candidate of a row that touches its point. */
struct Touch {
  int row, edge;    // of the last measured block
};

/* Each form below appends what touches. That cannot be predicted, so no branch depends on it: a
   touch is written first, and counted if it is one.

   outline: each vertex has at most one contact with each other outline, at its closest point. */
inline std::size_t outline_touches(const ContactCandidates &candidates,
                                   const ContactCandidates::Block &block, const PairLaws &laws,
                                   Touch *touches)
{
  const ContactCandidates::Near *const near = candidates.near();
  const double *const squares = candidates.squares();
  std::size_t count = 0;
  for (int k = block.begin; k < block.end; k++) {
    const ContactCandidates::CandidateRow &row = candidates.rows()[k];
    double least = laws[row.law].reachsq;
    int nearest = -1;
    for (int n = row.begin; n < row.end; n++) {
      nearest = squares[n] < least ? near[n].edge : nearest;
      least = squares[n] < least ? squares[n] : least;
    }
    touches[count] = {k, nearest};
    count += nearest >= 0;
  }
  return count;
}

/* segment/smooth: each pair of edges has half the energy of each of the four distances from an end
   of one to the other. A vertex ends two edges, so it has one contact with each edge of other
   outlines, with the full energy. */
inline std::size_t smooth_segment_touches(const ContactCandidates &candidates,
                                          const ContactCandidates::Block &block,
                                          const PairLaws &laws, Touch *touches)
{
  const ContactCandidates::Near *const near = candidates.near();
  const double *const squares = candidates.squares();
  std::size_t count = 0;
  for (int k = block.begin; k < block.end; k++) {
    const ContactCandidates::CandidateRow &row = candidates.rows()[k];
    for (int n = row.begin; n < row.end; n++) {
      touches[count] = {k, near[n].edge};
      count += squares[n] < laws[row.law].reachsq;
    }
  }
  return count;
}

inline std::size_t find_touches(ContactForm form, const ContactCandidates &candidates,
                                const ContactCandidates::Block &block, const PairLaws &laws,
                                Touch *touches)
{
  return form == OUTLINE ? outline_touches(candidates, block, laws, touches)
                         : smooth_segment_touches(candidates, block, laws, touches);
}

inline Contact contact_of(const Touch &touch, const ContactCandidates &candidates,
                          const ContactCandidates::Block &block, const Position *x)
{
  const ContactCandidates::CandidateRow &row = candidates.rows()[touch.row];
  const auto [tail, head] = candidates.edges(block)[touch.edge];
  return {row.i, tail, head, row.law, foot_on_edge(x[row.i], candidates.frames()[touch.edge])};
}

}    // namespace LAMMPS_NS
