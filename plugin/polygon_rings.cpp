// SPDX-License-Identifier: GPL-2.0-or-later
#include "polygon_rings.h"

#include "comm.h"
#include "edge_geometry.h"
#include "error.h"
#include "fix_polygon_outline.h"
#include "gather_records.h"

#include <algorithm>
#include <string>

using namespace LAMMPS_NS;

void PolygonRings::init(int groupbit)
{
  outline = FixPolygonOutline::shared(lmp, who);
  outline->read_bonds();
  outline_refresh = -1;
  refuse_other_bonds(groupbit);
  clear();
  for (int i = 0; i < atom->nlocal; i++)
    if (takes_part(i, groupbit)) count(i);
  find_shared();
  refuse_cut_polygons();
}

void PolygonRings::clear()
{
  polygon_list.clear();
  segment_list.clear();
  vertex_list.clear();
  number.clear();
}

/* A vertex counts to its polygon, whose number is returned. */
int PolygonRings::count(int i)
{
  const tagint molecule = atom->molecule[i];
  const auto [place, is_new] = number.emplace(molecule, static_cast<int>(polygon_list.size()));
  if (is_new) polygon_list.push_back({molecule, outline->link(i).size, 0, {0.0, 0.0}, -1});
  Polygon &polygon = polygon_list[place->second];
  polygon.owned++;
  if (outline->link(i).first) polygon.first = i;
  return place->second;
}

/* Vertices of closed rings take part. Atoms without bonds have no area and are left alone. */
bool PolygonRings::takes_part(int i, int groupbit) const
{
  return (atom->mask[i] & groupbit) && outline->link(i).kind == RING;
}

/* All ranks stop, since the message of one rank alone is lost now and then. */
void PolygonRings::refuse_other_bonds(int groupbit) const
{
  tagint lowest = MAXTAGINT, found[2] = {0, 0};    // molecule and kind
  for (int i = 0; i < atom->nlocal; i++) {
    const int kind = outline->link(i).kind;
    if (!(atom->mask[i] & groupbit) || kind == LONE || kind == RING) continue;
    if (atom->tag[i] >= lowest) continue;
    lowest = atom->tag[i];
    found[0] = atom->molecule[i];
    found[1] = kind;
  }
  const tagint own = lowest;
  MPI_Allreduce(MPI_IN_PLACE, &lowest, 1, MPI_LMP_TAGINT, MPI_MIN, world);
  if (lowest == MAXTAGINT) return;

  if (own != lowest) found[0] = found[1] = 0;
  MPI_Allreduce(MPI_IN_PLACE, found, 2, MPI_LMP_TAGINT, MPI_MAX, world);
  error->all(FLERR, "{}: the bonds of molecule {} (atom {}) {}, and only one closed ring has an "
             "area: use a group without it, or repair its bonds", who, found[0], lowest,
             found[1] == CHAIN ? "make an open chain" : "branch or make more than one ring");
}

void PolygonRings::refresh(int groupbit)
{
  outline = FixPolygonOutline::shared(lmp, who);    // users may unfix it
  const bigint now = outline->refresh();
  if (now == outline_refresh) return;
  outline_refresh = now;
  refuse_other_bonds(groupbit);

  clear();
  std::vector<char> seen(atom->nlocal, 0);
  for (int i = 0; i < atom->nlocal; i++)
    if (!seen[i] && takes_part(i, groupbit)) walk(i, groupbit, seen);
  edge_x.resize(vertex_list.size() + segment_list.size());
  edge_y.resize(edge_x.size());
  place_x.resize(vertex_list.size());
  place_y.resize(vertex_list.size());
  find_shared();
  refuse_cut_polygons();
  find_origins();
}

/* Walks from an owned vertex along its ring, as far as this rank owns the vertices. */
void PolygonRings::walk(int start, int groupbit, std::vector<char> &seen)
{
  const int begin = static_cast<int>(vertex_list.size());
  for (int i = start; i >= 0 && i < atom->nlocal && !seen[i] && takes_part(i, groupbit);) {
    seen[i] = 1;
    const int prev = outline->prev(i), next = outline->next(i);
    if (prev < 0 || next < 0)
      error->one(FLERR, "{}: vertex {} cannot see its neighbors on polygon {}: raise comm_modify "
                 "cutoff", who, atom->tag[i], atom->molecule[i]);
    vertex_list.push_back({i, prev, next, count(i), outline->image_of(i)});
    i = atom->map(outline->link(i).next);
  }
  segment_list.push_back({vertex_list[begin].polygon, begin, static_cast<int>(vertex_list.size())});
}

/* Finds polygons whose vertices several ranks own, and numbers them in the order of molecules. */
void PolygonRings::find_shared()
{
  shared.clear();
  std::vector<tagint> own;
  for (const auto &polygon : polygon_list)
    if (polygon.owned != polygon.size) own.push_back(polygon.molecule);
  std::vector<tagint> all = gather_records(own, world);
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  all_shared = all.size();
  for (std::size_t k = 0; k < polygon_list.size(); k++) {
    const Polygon &polygon = polygon_list[k];
    if (polygon.owned == polygon.size) continue;
    const auto place = std::lower_bound(all.begin(), all.end(), polygon.molecule);
    shared.push_back({static_cast<int>(k), static_cast<int>(place - all.begin())});
  }
}

void PolygonRings::refuse_cut_polygons() const
{
  std::vector<double> in_group;
  for (const auto &polygon : polygon_list) in_group.push_back(polygon.owned);
  sum(in_group, 1);
  for (std::size_t k = 0; k < polygon_list.size(); k++)
    if (in_group[k] != polygon_list[k].size)
      error->one(FLERR, "{}: the group holds {:.0f} of the {} vertices of polygon {}, needs all or "
                 "none", who, in_group[k], polygon_list[k].size, polygon_list[k].molecule);
}

void PolygonRings::find_origins()
{
  const std::vector<double> found = of_first(4, [this](int i, double *origin) {
    const ImageOffset &image = outline->image_of(i);
    const double numbers[4] = {atom->x[i][0], atom->x[i][1], 1.0 * image.a, 1.0 * image.b};
    std::copy_n(numbers, 4, origin);
  });
  for (std::size_t k = 0; k < polygon_list.size(); k++)
    std::copy_n(&found[4 * k], 2, polygon_list[k].origin);
  for (Vertex &vertex : vertex_list) {
    const double *const image = &found[4 * vertex.polygon + 2];
    const ImageOffset first(static_cast<int>(image[0]), static_cast<int>(image[1]));
    vertex.image = vertex.image - first;
  }
}

void PolygonRings::sum(std::vector<double> &values, int width) const
{
  if (all_shared == 0) return;
  std::vector<double> sums(width * all_shared, 0.0);
  for (const auto &[polygon, place] : shared)
    std::copy_n(&values[width * polygon], width, &sums[width * place]);
  const int size = static_cast<int>(sums.size());
  MPI_Allreduce(MPI_IN_PLACE, sums.data(), size, MPI_DOUBLE, MPI_SUM, world);
  for (const auto &[polygon, place] : shared)
    std::copy_n(&sums[width * place], width, &values[width * polygon]);
}

/* The area is a = (1/2) sum x_i cross (x_{i+1} - x_i). Any fixed origin gives the same sum; one
   near the polygon keeps its digits. */
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
  std::vector<tagint> own;
  for (const auto &polygon : polygon_list)
    if (polygon.first >= 0) own.push_back(polygon.molecule);
  std::vector<tagint> all = gather_records(own, world);
  std::sort(all.begin(), all.end());
  return all;
}
