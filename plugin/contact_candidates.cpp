// SPDX-License-Identifier: GPL-2.0-or-later
#include "contact_candidates.h"

#include "atom.h"
#include "neigh_list.h"
#include "neighbor.h"

#include <algorithm>

using namespace LAMMPS_NS;

static constexpr int BLOCK = 512;    // rows: some 40 kB with their edges and contacts

/* Finds what can come within the width of a contact before the next build. Ends move by less than
   half the skin, so whatever is farther than width + skin now cannot touch until then. */
void ContactCandidates::build(const FixPolygonOutline *fix, const NeighList *list,
                              const ContactLaws &contact_laws, ContactForm form)
{
  outline = fix;
  laws = &contact_laws;
  row_list.clear();
  near_list.clear();
  edge_list.clear();
  block_list.clear();
  edge_from.assign(atom->nlocal + atom->nghost, -1);
  find_edges();

  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    if (laws->flat(atom->type[i])) continue;
    of_point.clear();
    find_near_point(i, list, form);
    keep(i);
    if (static_cast<int>(row_list.size()) >= last_block().end + BLOCK) end_block();
  }
  end_block();
}

void ContactCandidates::end_block()
{
  const Block last = last_block();
  const int end = static_cast<int>(row_list.size());
  if (end == last.end) return;
  const Block block = {last.end, end, last.edge_end, static_cast<int>(edge_list.size())};
  for (int n = block.edge_begin; n < block.edge_end; n++) edge_from[edge_list[n].tail] = -1;
  frame_list.resize(std::max<std::size_t>(frame_list.size(), block.edge_end - block.edge_begin));
  block_list.push_back(block);
}

void ContactCandidates::find_edges()
{
  const int nall = atom->nlocal + atom->nghost;
  all_frames.resize(nall);
  for (int i = 0; i < nall; i++) {
    const int head = laws->disk(atom->type[i]) ? i : outline->next(i);
    if (head >= 0) all_frames[i] = edge_frame(atom->x[i], atom->x[head]);
  }
}

/* Finds edges near vertex or disk i. The neighbor list holds at least one end of each edge. Disks
   have their contacts with vertices and edges; of two disks, the earlier one has it. */
void ContactCandidates::find_near_point(int i, const NeighList *list, ContactForm form)
{
  const int *const type = atom->type, *const forms = laws->form[type[i]];
  const tagint *const molecule = atom->molecule;
  const bool idisk = laws->disk(type[i]);
  const tagint own = idisk ? 0 : molecule[i];
  const double *const widths = laws->initial_width[type[i]];    // negative: another style's pair
  auto try_edge = [&](int tail, int special = 0) {
    const double width = widths[type[tail]], reach = width + neighbor->skin;
    if (width < 0.0 || foot_on_edge(atom->x[i], all_frames[tail]).rsq >= reach * reach) return;
    const Edge edge = {tail, laws->disk(type[tail]) ? tail : outline->next(tail)};
    const int law = PairLaws::number(atom->ntypes, type[i], type[tail], special);
    of_point.push_back({molecule[tail], atom->tag[tail], outline->image_of(tail), edge, law});
  };

  for (int n = 0; n < list->numneigh[i]; n++) {
    const int listed = list->firstneigh[i][n], j = listed & NEIGHMASK;
    if (molecule[j] == own && one_outline(i, j)) continue;
    const int jtype = type[j];
    if (forms[jtype] != form || laws->flat(jtype)) continue;
    if (laws->disk(jtype)) {
      if (idisk && !earlier(j, i)) try_edge(j, listed >> SBBITS & 3);
      continue;
    }
    if (outline->next(j) >= 0) try_edge(j);
    if (outline->prev(j) >= 0) try_edge(outline->prev(j));    // the list may not hold its tail
  }
}

/* Two atoms of one outline, in one image, have no contact. */
bool ContactCandidates::one_outline(int i, int j) const
{
  return atom->molecule[i] == atom->molecule[j] && outline->image_of(i) == outline->image_of(j) &&
      !laws->disk(atom->type[i]) && !laws->disk(atom->type[j]);
}

/* Candidates are kept in an order that does not depend on where atoms are stored, so that sums have
   the same digits, with one row for each outline near a point. */
void ContactCandidates::keep(int i)
{
  std::sort(of_point.begin(), of_point.end());
  for (std::size_t n = 0; n < of_point.size(); n++) {
    const Candidate &candidate = of_point[n];
    if (n > 0 && candidate.edge.tail == of_point[n - 1].edge.tail) continue;    // found twice
    int &number = edge_from[candidate.edge.tail];
    if (number < 0) {
      number = static_cast<int>(edge_list.size()) - last_block().edge_end;
      edge_list.push_back(candidate.edge);
    }
    const int size = static_cast<int>(near_list.size());
    if (n == 0 || row_list.back().law != candidate.law || !candidate.same_outline(of_point[n - 1]))
      row_list.push_back({i, candidate.law, size, size});
    near_list.push_back(number);
    row_list.back().end++;
  }
}

/* Two edges or disks have the same order whichever of their images meet. */
bool ContactCandidates::earlier(int i, int j) const
{
  if (atom->tag[i] != atom->tag[j]) return atom->tag[i] < atom->tag[j];
  return ImageOffset() < outline->image_of(j) - outline->image_of(i);
}

void ContactCandidates::measure_edges(const Block &block)
{
  const auto x = reinterpret_cast<const Position *>(atom->x[0]);
  EdgeFrame *frame = frame_list.data();
  for (int n = block.edge_begin; n < block.edge_end; n++)
    *frame++ = edge_frame(x[edge_list[n].tail], x[edge_list[n].head]);
}
