// SPDX-License-Identifier: GPL-2.0-or-later

#include "polygon_rings.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "edge_geometry.h"
#include "error.h"
#include "fix_polygon_outline.h"
#include "rank_exchange.h"

#include <algorithm>
#include <string>
#include <unordered_map>

using namespace LAMMPS_NS;

void PolygonRings::init(int groupbit)
{
  outline = FixPolygonOutline::shared(lmp, who);
  outline->read_bonds();
  outline_refresh = -1;
  refuse_other_bonds(groupbit);

  std::unordered_map<tagint, int> number;
  polygon_list.clear();
  for (int i = 0; i < atom->nlocal; i++) {
    if (!takes_part(i, groupbit)) continue;
    const auto found = number.emplace(atom->molecule[i], static_cast<int>(polygon_list.size()));
    if (found.second) polygon_list.push_back({atom->molecule[i], outline->link(i).size, 0, {0.0, 0.0}, false});
    Polygon &polygon = polygon_list[found.first->second];
    polygon.owned++;
    polygon.first = polygon.first || outline->link(i).first;
  }
  find_partners();
  refuse_cut_polygons();
}

/* vertices of closed rings; atoms without bonds have no area and are left alone */
bool PolygonRings::takes_part(int i, int groupbit) const
{
  return (atom->mask[i] & groupbit) && outline->link(i).kind == RING;
}

/* by all ranks: the message of one rank that stops is lost now and then */
void PolygonRings::refuse_other_bonds(int groupbit) const
{
  tagint lowest = MAXTAGINT, found[2] = {0, 0};    // molecule and kind
  for (int i = 0; i < atom->nlocal; i++) {
    const int kind = outline->link(i).kind;
    if (!(atom->mask[i] & groupbit) || kind == LONE || kind == RING || atom->tag[i] >= lowest) continue;
    lowest = atom->tag[i];
    found[0] = atom->molecule[i];
    found[1] = kind;
  }
  const tagint own = lowest;
  MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPI_LMP_TAGINT, MPI_MIN, world);
  if (lowest == MAXTAGINT) return;

  if (own != lowest) found[0] = found[1] = 0;
  MPI_Allreduce(MPI_IN_PLACE, found, 2, MPI_LMP_TAGINT, MPI_MAX, world);
  error->all(FLERR, "{}: the bonds of molecule {} (atom {}) {}, and only one closed ring has an area: use a group "
             "without it, or mend its bonds", who, found[0], lowest,
             found[1] == CHAIN ? "make an open chain" : "branch or make more than one ring");
}

void PolygonRings::refresh(int groupbit)
{
  outline = FixPolygonOutline::shared(lmp, who);    // users may unfix it
  const bigint now = outline->refresh();
  if (now == outline_refresh) return;
  outline_refresh = now;
  refuse_other_bonds(groupbit);

  polygon_list.clear();
  segment_list.clear();
  vertex_list.clear();
  std::unordered_map<tagint, int> number;
  std::vector<char> seen(atom->nlocal, 0);
  int others = 0;
  for (int i = 0; i < atom->nlocal; i++) {
    others = others || (atom->num_bond[i] && !takes_part(i, groupbit));
    if (seen[i] || !takes_part(i, groupbit)) continue;
    const OutlineLink &link = outline->link(i);
    const auto found = number.emplace(atom->molecule[i], static_cast<int>(polygon_list.size()));
    if (found.second) polygon_list.push_back({atom->molecule[i], link.size, 0, {0.0, 0.0}, false});
    walk(i, found.first->second, groupbit, seen);
  }
  MPI_Allreduce(MPI_IN_PLACE, &others, 1, MPI_INT, MPI_MAX, world);
  all_bonds = !others;
  edge_x.resize(vertex_list.size() + segment_list.size());
  edge_y.resize(edge_x.size());
  place_x.resize(vertex_list.size());
  place_y.resize(vertex_list.size());
  find_partners();
  refuse_cut_polygons();
  find_origins();
}

/* from an owned vertex on along its ring, as far as this rank owns it */
void PolygonRings::walk(int start, int polygon, int groupbit, std::vector<char> &seen)
{
  const int begin = static_cast<int>(vertex_list.size());
  for (int i = start; i >= 0 && i < atom->nlocal && !seen[i] && takes_part(i, groupbit);) {
    seen[i] = 1;
    const int prev = outline->prev(i), next = outline->next(i);
    if (prev < 0 || next < 0)
      error->one(FLERR, "{}: vertex {} cannot see its neighbors on polygon {}: raise comm_modify cutoff", who,
                 atom->tag[i], atom->molecule[i]);
    vertex_list.push_back({i, prev, next, outline->image(i)});
    polygon_list[polygon].first = polygon_list[polygon].first || outline->link(i).first;
    i = atom->map(outline->link(i).next);
  }
  const int end = static_cast<int>(vertex_list.size());
  segment_list.push_back({polygon, begin, end});
  polygon_list[polygon].owned += end - begin;
}

/* which other ranks own vertices of the polygons of this one: one rank hears all
   that is said of a molecule and tells the others */
void PolygonRings::find_partners()
{
  partners.clear();
  const int nprocs = comm->nprocs;
  if (nprocs == 1) return;

  struct Share {
    tagint molecule;
    int rank;
  };
  std::unordered_map<tagint, int> number;
  std::vector<std::vector<Share>> said(nprocs), answers(nprocs);
  for (std::size_t k = 0; k < polygon_list.size(); k++) {
    const Polygon &polygon = polygon_list[k];
    if (polygon.owned == polygon.size) continue;
    number[polygon.molecule] = static_cast<int>(k);
    said[polygon.molecule % nprocs].push_back({polygon.molecule, comm->me});
  }
  std::unordered_map<tagint, std::vector<int>> sharers;
  for (const auto &part : exchange_records(said, world))
    for (const auto &share : part) sharers[share.molecule].push_back(share.rank);
  for (const auto &one : sharers)
    for (const int rank : one.second)
      for (const int other : one.second)
        if (other != rank) answers[rank].push_back({one.first, other});

  std::vector<Share> shares;
  for (const auto &part : exchange_records(answers, world)) shares.insert(shares.end(), part.begin(), part.end());
  std::sort(shares.begin(), shares.end(), [](const Share &p, const Share &q) {
    return p.rank != q.rank ? p.rank < q.rank : p.molecule < q.molecule;
  });
  for (const auto &share : shares) {
    if (partners.empty() || partners.back().rank != share.rank) partners.push_back({share.rank, {}});
    partners.back().shared.push_back(number[share.molecule]);
  }
}

void PolygonRings::refuse_cut_polygons() const
{
  std::vector<double> in_group;
  for (const auto &polygon : polygon_list) in_group.push_back(polygon.owned);
  sum(in_group, 1);
  for (std::size_t k = 0; k < polygon_list.size(); k++)
    if (in_group[k] != polygon_list[k].size)
      error->one(FLERR, "{}: the group holds {:.0f} of the {} vertices of polygon {}, needs all or none", who,
                 in_group[k], polygon_list[k].size, polygon_list[k].molecule);
}

void PolygonRings::find_origins()
{
  std::vector<double> origin(4 * polygon_list.size(), 0.0);    // x and y in the box, image
  for (const auto &segment : segment_list)
    for (int n = segment.begin; n < segment.end; n++) {
      const Vertex &vertex = vertex_list[n];
      if (!outline->link(vertex.i).first) continue;
      const double own[4] = {atom->x[vertex.i][0], atom->x[vertex.i][1], static_cast<double>(vertex.image.a),
                             static_cast<double>(vertex.image.b)};
      std::copy_n(own, 4, &origin[4 * segment.polygon]);
    }
  sum(origin, 4);
  for (std::size_t k = 0; k < polygon_list.size(); k++) std::copy_n(&origin[4 * k], 2, polygon_list[k].origin);
  for (const auto &segment : segment_list) {
    const double *const own = &origin[4 * segment.polygon];
    const ImageOffset first(static_cast<int>(own[2]), static_cast<int>(own[3]));
    for (int n = segment.begin; n < segment.end; n++) vertex_list[n].image = vertex_list[n].image - first;
  }
}

void PolygonRings::position(const Vertex &vertex, const Polygon &polygon, double *r) const
{
  const double *x = atom->x[vertex.i];
  r[0] = x[0] + vertex.image.a * domain->xprd + vertex.image.b * domain->xy - polygon.origin[0];
  r[1] = x[1] + vertex.image.b * domain->yprd - polygon.origin[1];
}

/* parts are added in the order of ranks, so that all ranks get the same digits */
void PolygonRings::sum(std::vector<double> &values, int width) const
{
  if (partners.empty()) return;
  static constexpr int TAG = 4711;
  std::vector<std::vector<double>> sent(partners.size()), received(partners.size());
  std::vector<MPI_Request> requests(2 * partners.size());

  for (std::size_t p = 0; p < partners.size(); p++) {
    const Partner &partner = partners[p];
    const int count = static_cast<int>(width * partner.shared.size());
    received[p].resize(count);
    for (const int polygon : partner.shared)
      sent[p].insert(sent[p].end(), &values[width * polygon], &values[width * polygon] + width);
    MPI_Irecv(received[p].data(), count, MPI_DOUBLE, partner.rank, TAG, world, &requests[2 * p]);
    MPI_Isend(sent[p].data(), count, MPI_DOUBLE, partner.rank, TAG, world, &requests[2 * p + 1]);
  }
  for (auto &request : requests) MPI_Wait(&request, MPI_STATUS_IGNORE);

  const std::vector<double> own = values;
  for (const auto &partner : partners)
    for (const int polygon : partner.shared) std::fill_n(&values[width * polygon], width, 0.0);
  auto add = [&](const Partner &partner, const double *part) {
    for (const int polygon : partner.shared)
      for (int k = 0; k < width; k++) values[width * polygon + k] += *part++;
  };
  std::vector<char> added(polygon_list.size(), 0);
  auto add_own = [&](int before) {    // where this rank stands among those that share the polygon
    for (const auto &partner : partners)
      for (const int polygon : partner.shared)
        if (!added[polygon] && comm->me < before) {
          for (int k = 0; k < width; k++) values[width * polygon + k] += own[width * polygon + k];
          added[polygon] = 1;
        }
  };
  for (std::size_t p = 0; p < partners.size(); p++) {
    add_own(partners[p].rank);
    add(partners[p], received[p].data());
  }
  add_own(comm->nprocs);
}

/* a = (1/2) sum x_i cross (x_{i+1} - x_i). Any fixed origin gives the same closed
   sum; one near the polygon keeps its digits. */
void PolygonRings::measure(const RingSegment &segment, bool centers, double *value)
{
  const auto x = reinterpret_cast<const Position *>(atom->x[0]);
  const double xprd = domain->xprd, yprd = domain->yprd, xy = domain->xy;
  const double *const origin = polygon_list[segment.polygon].origin;
  const Vertex *const vertex = &vertex_list[segment.begin];
  const int size = segment.end - segment.begin;
  double *const px = place_x.data(), *const py = place_y.data();
  double *const ex = &edge_x[first_edge(segment)], *const ey = &edge_y[first_edge(segment)];

  for (int n = 0; n < size; n++) {
    const double *here = x[vertex[n].i];
    px[n] = here[0] + vertex[n].image.a * xprd + vertex[n].image.b * xy - origin[0];
    py[n] = here[1] + vertex[n].image.b * yprd - origin[1];
  }
  for (int n = 1; n < size; n++) {
    ex[n] = px[n] - px[n - 1];
    ey[n] = py[n] - py[n - 1];
  }
  const double *first = x[vertex[0].i], *before = x[vertex[0].prev];
  const double *last = x[vertex[size - 1].i], *after = x[vertex[size - 1].next];
  ex[0] = first[0] - before[0];
  ey[0] = first[1] - before[1];
  ex[size] = after[0] - last[0];
  ey[size] = after[1] - last[1];

  double twice_area = 0.0;
#pragma omp simd reduction(+ : twice_area)
  for (int n = 0; n < size; n++) twice_area += px[n] * ey[n + 1] - py[n] * ex[n + 1];
  value[0] += 0.5 * twice_area;
  if (!centers) return;
  for (int n = 0; n < size; n++) {
    value[1] += px[n];
    value[2] += py[n];
  }
}

std::vector<tagint> PolygonRings::molecules() const
{
  std::vector<std::vector<tagint>> own(comm->nprocs);
  for (const auto &polygon : polygon_list)
    if (polygon.first)
      for (auto &to : own) to.push_back(polygon.molecule);
  std::vector<tagint> all;
  for (const auto &part : exchange_records(own, world)) all.insert(all.end(), part.begin(), part.end());
  std::sort(all.begin(), all.end());
  return all;
}

double PolygonRings::memory_usage() const
{
  return polygon_list.capacity() * sizeof(Polygon) + segment_list.capacity() * sizeof(RingSegment) +
      vertex_list.capacity() * sizeof(Vertex) + 2 * (edge_x.capacity() + place_x.capacity()) * sizeof(double);
}
