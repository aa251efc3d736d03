// SPDX-License-Identifier: GPL-2.0-or-later
#include "contact_candidates.h"

#include "atom.h"
#include "neigh_list.h"
#include "neighbor.h"

#include <algorithm>

using namespace LAMMPS_NS;

static constexpr int BLOCK = 512;    // rows: some 40 kB with their edges and contacts

// Close candidates pay if they live for some evaluations; finding them takes as long as two.
static constexpr int SHORT_LIFE = 16, LONG_LIFE = 128;
static constexpr double LEAST = 1.0 / 32.0;    // of the skin: their margin
static constexpr double HALF = 0.499;          // and a little for rounding

void ContactCandidates::List::clear()
{
  rows.clear();
  near.clear();
  blocks.clear();
  edges.clear();
}

/* Finds what can come within reach of a contact before the next build. Ends move by less than half
   the skin, so whatever is farther than reach + skin now cannot touch until then. */
void ContactCandidates::build(const FixPolygonOutline *fix, const NeighList *list,
                              const ContactLaws &contact_laws, ContactForm form)
{
  outline = fix;
  laws = &contact_laws;
  all.clear();
  edge_from.assign(atom->nlocal + atom->nghost, -1);
  find_edges();

  for (int ii = 0; ii < list->inum; ii++) {
    const int i = list->ilist[ii];
    if (laws->flat(atom->type[i])) continue;
    of_point.clear();
    find_near_point(i, list, form);
    keep(i);
    end_block(all, BLOCK);
  }
  end_block(all, 1);
  movers.clear();
  places.clear();
}

/* Ends a block that has this many rows. */
void ContactCandidates::end_block(List &list, std::size_t least)
{
  const Block last = list.last_block();
  if (list.rows.size() < last.end + least) return;
  const Block block = {last.end, static_cast<int>(list.rows.size()), last.edge_end,
                       static_cast<int>(list.edges.size())};
  for (int n = block.edge_begin; n < block.edge_end; n++) edge_from[list.edges[n].tail] = -1;
  frame_list.resize(std::max<std::size_t>(frame_list.size(), block.edge_end - block.edge_begin));
  const std::size_t size = list.near.size() - list.rows[block.begin].begin;
  square_list.resize(std::max(square_list.size(), size));
  list.blocks.push_back(block);
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
  const double *const reaches = laws->initial_reach[type[i]];    // negative: another style's pair
  auto try_edge = [&](int tail, int special = 0) {
    const double own_reach = reaches[type[tail]], reach = own_reach + neighbor->skin;
    if (own_reach < 0.0 || foot_on_edge(atom->x[i], all_frames[tail]).rsq >= reach * reach) return;
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
    if (n == 0 || all.rows.back().law != candidate.law || !candidate.same_outline(of_point[n - 1]))
      begin_row(all, i, candidate.law);
    add_to_row(all, candidate.edge);
  }
}

void ContactCandidates::begin_row(List &list, int i, int law)
{
  const int size = static_cast<int>(list.near.size());
  list.rows.push_back({i, law, size, size});
}

void ContactCandidates::add_to_row(List &list, const Edge &edge)
{
  int &number = edge_from[edge.tail];
  if (number < 0) {
    number = static_cast<int>(list.edges.size()) - list.last_block().edge_end;
    list.edges.push_back(edge);
  }
  list.near.push_back({list.rows.back().i, number});
  list.rows.back().end++;
}

/* Two edges or disks have the same order whichever of their images meet. */
bool ContactCandidates::earlier(int i, int j) const
{
  if (atom->tag[i] != atom->tag[j]) return atom->tag[i] < atom->tag[j];
  return ImageOffset() < outline->image_of(j) - outline->image_of(i);
}

void ContactCandidates::choose(double beyond)
{
  use_close = false;
  if (beyond > 0.0 || neighbor->skin == 0.0) return;
  evaluations++;
  if (part > MOST) {
    if (evaluations <= LONG_LIFE) return;
    part = MOST;
    places.clear();
  }
  if (places.empty() || moved()) {
    if (!places.empty()) adapt_margin();
    evaluations = 0;
    if (part > MOST) return;
    find_close();
  }
  use_close = true;
}

/* A margin that atoms cross within few evaluations grows. Beyond MOST of the skin it does not pay,
   and all candidates are used for a while. */
void ContactCandidates::adapt_margin()
{
  if (evaluations < SHORT_LIFE) part *= 2.0;
  if (evaluations > LONG_LIFE) part = std::max(0.5 * part, LEAST);
}

/* Finds the atoms on whose places close candidates depend. */
void ContactCandidates::find_movers()
{
  std::vector<char> moves(edge_from.size(), 0);
  for (const CandidateRow &row : all.rows) moves[row.i] = 1;
  for (const Edge &edge : all.edges) moves[edge.tail] = moves[edge.head] = 1;
  for (std::size_t i = 0; i < moves.size(); i++)
    if (moves[i]) movers.push_back(static_cast<int>(i));
}

/* Two atoms come closer by at most twice what each has moved. */
bool ContactCandidates::moved() const
{
  const auto x = reinterpret_cast<const Position *>(atom->x[0]);
  const double most = HALF * part * neighbor->skin, limit = most * most;
  for (std::size_t k = 0; k < movers.size(); k++) {
    const double *const here = x[movers[k]];
    const double dx = here[0] - places[k].x, dy = here[1] - places[k].y;
    if (!(dx * dx + dy * dy <= limit)) return true;
  }
  return false;
}

/* Keeps what can come within reach of a contact before an atom has moved by half the margin. */
void ContactCandidates::find_close()
{
  const int *const type = atom->type;
  close.clear();
  for (const Block &block : all.blocks) {
    measure(block);
    const Edge *const of_block = edges(block);
    for (int k = block.begin; k < block.end; k++) {
      const CandidateRow &row = all.rows[k];
      const int tail = of_block[near()[row.begin].edge].tail;    // all have one law
      const double reach = laws->initial_reach[type[row.i]][type[tail]] + part * neighbor->skin;
      bool begun = false;
      for (int n = row.begin; n < row.end; n++) {
        if (squares()[n] >= reach * reach) continue;
        if (!begun) begin_row(close, row.i, row.law);
        begun = true;
        add_to_row(close, of_block[near()[n].edge]);
      }
      end_block(close, BLOCK);
    }
  }
  end_block(close, 1);

  if (movers.empty()) find_movers();
  places.clear();
  for (const int i : movers) places.push_back({atom->x[i][0], atom->x[i][1]});
}

void ContactCandidates::measure(const Block &block)
{
  const auto x = reinterpret_cast<const Position *>(atom->x[0]);
  const Edge *const edge = edges(block);
  EdgeFrame *const frame = frame_list.data();
  for (int n = 0; n < block.edge_end - block.edge_begin; n++)
    frame[n] = edge_frame(x[edge[n].tail], x[edge[n].head]);

  first_square = rows()[block.begin].begin;
  const int count = rows()[block.end - 1].end - first_square;
  const Near *const pair = near() + first_square;
  double *const square = square_list.data();
  for (int n = 0; n < count; n++)
    square[n] = foot_on_edge(x[pair[n].point], frame[pair[n].edge]).rsq;
}
