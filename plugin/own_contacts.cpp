// SPDX-License-Identifier: GPL-2.0-or-later
#include "own_contacts.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "force.h"
#include "neigh_list.h"
#include "neighbor.h"

#include <algorithm>
#include <cmath>
#include <iterator>

using namespace LAMMPS_NS;

static constexpr int MOST_STEPS = 100;    // of the range, up to its full width

void OwnContacts::init(const char *who, const ContactLaws &laws)
{
  begins = true;
  if (laws.near == 0.0) return;
  for (int k = 0; k < neighbor->nex_mol; k++)
    if (neighbor->ex_mol_intra[k])
      error->all(FLERR, "{}: neigh_modify exclude molecule/intra hides the contacts of a polygon "
                 "with itself: remove it, or self {}", who, laws.near);
  for (int k = 1; k <= 3; k++)
    if (force->special_lj[k] != 1.0)
      error->all(FLERR, "{}: special_bonds weakens contacts of a polygon with itself: use "
                 "special_bonds lj/coul 1 1 1, or remove self {}", who, laws.near);
}

void OwnContacts::build(const char *who, const FixPolygonOutline &outline, const NeighList *list,
                        const ContactLaws &laws)
{
  rows.clear();
  edges.clear();
  if (laws.near == 0.0) return;
  if (begins && laws.steps > MOST_STEPS)
    error->all(FLERR, "{}: self {} is less than 1/{} of the range of a contact", who, laws.near,
               MOST_STEPS);
  if (begins) warn_of_short_edges(who, outline, list, laws);
  begins = false;

  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii], type = atom->type[i];
    if (laws.role[type] != VERTEX) continue;
    of_vertex.clear();
    for (int n = 0; n < list->numneigh[i]; n++) {
      const int j = list->firstneigh[i][n] & NEIGHMASK;
      if (atom->molecule[j] != atom->molecule[i] || laws.role[atom->type[j]] != VERTEX ||
          !(outline.image_of(j) == outline.image_of(i)))
        continue;
      try_edge(outline, laws, i, j);
      if (outline.prev(j) >= 0) try_edge(outline, laws, i, outline.prev(j));
    }
    if (of_vertex.empty()) continue;
    std::sort(of_vertex.begin(), of_vertex.end());
    const int begin = static_cast<int>(edges.size());
    std::unique_copy(of_vertex.begin(), of_vertex.end(), std::back_inserter(edges));
    rows.push_back({i, begin, static_cast<int>(edges.size()), laws.form[type][type] == OUTLINE});
  }
}

/* Keeps the edge if it can come within its range before the next build. */
void OwnContacts::try_edge(const FixPolygonOutline &outline, const ContactLaws &laws, int i,
                           int tail)
{
  const int head = outline.next(tail), *const type = atom->type;
  const int between = edges_between(outline.link(i), outline.link(tail));
  const double width = laws.initial_width[type[i]][type[tail]];    // negative: of another style
  if (head < 0 || between == 0 || width < 0.0) return;
  const bool near = between * laws.near < width;
  const double reach = (near ? between * laws.near : width) + neighbor->skin;
  const EdgeFrame frame = edge_frame(atom->x[tail], atom->x[head]);
  if (foot_on_edge(atom->x[i], frame).rsq >= reach * reach) return;
  const auto law_of = [&](int special) {
    return PairLaws::number(atom->ntypes, type[i], type[tail], special);
  };
  const int whole = law_of(PairLaws::special_of(laws.steps));    // which only repels
  of_vertex.push_back(
      {atom->tag[tail], tail, head, near ? law_of(PairLaws::special_of(between)) : whole, whole});
}

const std::vector<Contact> &OwnContacts::find(const Position *x, const PairLaws &laws)
{
  found.clear();
  for (const Row &row : rows) {
    Contact closest;
    closest.foot.rsq = HUGE_VAL;
    for (int n = row.begin; n < row.end; n++) {
      const Edge &edge = edges[n];
      const jamlab::Foot foot = foot_on_edge(x[row.i], edge_frame(x[edge.tail], x[edge.head]));
      if (foot.rsq >= laws[edge.law].reachsq) continue;
      const Contact contact = {row.i, edge.tail, edge.head, edge.law, foot};
      const bool near = laws[edge.law].width < laws[edge.whole].width;
      if (near || !row.outline)
        found.push_back(contact);
      else if (foot.rsq < closest.foot.rsq)
        closest = contact;
    }
    if (closest.foot.rsq < HUGE_VAL) found.push_back(closest);
  }
  return found;
}

/* Ends of an edge meet each other's edges as soon as the edge is shorter than the range with one
   edge between, however straight the outline is. */
void OwnContacts::warn_of_short_edges(const char *who, const FixPolygonOutline &outline,
                                      const NeighList *list, const ContactLaws &laws) const
{
  int count = 0, all = 0;
  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii], next = outline.next(i);
    if (next < 0 || laws.role[atom->type[i]] != VERTEX) continue;
    const double dx = atom->x[next][0] - atom->x[i][0], dy = atom->x[next][1] - atom->x[i][1];
    if (dx * dx + dy * dy < laws.near * laws.near) count++;
  }
  MPI_Allreduce(&count, &all, 1, MPI_INT, MPI_SUM, world);
  if (all && comm->me == 0)
    error->warning(FLERR, "{}: {} edges are shorter than self {}, so that their ends repel each "
                   "other: use a smaller number, or longer edges", who, all, laws.near);
}
