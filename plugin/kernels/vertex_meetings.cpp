// This file finds where vertices meet edges of other polygons, or of other images of their own.

#include "kernel.h"
#include "nearest_foot.h"
#include "periodic_neighbors.h"

using namespace jamlab;

namespace {

struct Meeting {
  int64_t vertex, tail;
  Image image;  // of the edge
  double place, distance;
  Vector separation, shift;
};

struct Polygons {
  int64_t n;
  const double *x;
  std::vector<int64_t> particle, after;

  Polygons(int64_t count, const int64_t *offsets, const double *positions)
    : n(offsets[count]), x(positions), particle(n), after(n)
  {
    for (int64_t p = 0; p < count; ++p)
      for (int64_t v = offsets[p]; v < offsets[p + 1]; ++v) {
        particle[v] = p;
        after[v] = v + 1 < offsets[p + 1] ? v + 1 : offsets[p];
      }
  }
  Vector at(int64_t v) const { return point(x, v); }
  Vector edge(int64_t v) const { return at(after[v]) - at(v); }
};

// Finds all meetings nearer than reach, sorted by vertex, tail and image. A vertex meets an edge
// only if it is nearer to the middle of the edge than reach and half the length of the edge.
int64_t find_all(const Polygons &polygons, const Lattice &lattice, double reach, double most_copies,
                 double *search, std::vector<Meeting> &all)
{
  const int64_t n = polygons.n;
  if (!n) return 0;
  std::vector<double> middles(2 * n), reaches(n), none(n, 0.0);
  for (int64_t e = 0; e < n; ++e) {
    put(middles.data(), e, polygons.at(e) + polygons.edge(e) * 0.5);
    reaches[e] = (reach + 0.5 * size(polygons.edge(e))) * (1 + 1e-12);
  }
  const auto meet = [&](const Neighbor &near) {
    const int64_t e = near.i, v = near.j;
    const Image image = Image{0, 0} - near.shift;  // the edge that lies beside the vertex
    if (polygons.particle[v] == polygons.particle[e] && image.home()) return;
    const Vector edge = polygons.edge(e), r = edge * 0.5 + near.r;  // vertex from the tail
    const Foot foot = foot_on_edge(r, edge);
    if (foot.rsq < reach * reach)
      all.push_back({v, e, image, foot.t, std::hypot(foot.r.x, foot.r.y), foot.r,
                     lattice.translation(image)});
  };
  const int64_t refusal = visit_neighbors({n, middles.data(), reaches.data()},
                                          {n, polygons.x, none.data()}, lattice, false,
                                          most_copies, search, meet);
  std::sort(all.begin(), all.end(), [](const Meeting &a, const Meeting &b) {
    if (a.vertex != b.vertex) return a.vertex < b.vertex;
    return a.tail != b.tail ? a.tail < b.tail : a.image < b.image;
  });
  return refusal;
}

// Finds whether an edge that starts in a vertex crosses an edge that the vertex meets.
bool find_crossing(const Polygons &polygons, const std::vector<Meeting> &all, int64_t *crossing)
{
  for (const Meeting &meeting : all) {
    const Vector a = polygons.at(meeting.vertex), c = polygons.at(meeting.tail) + meeting.shift;
    const Vector b = a + polygons.edge(meeting.vertex), d = c + polygons.edge(meeting.tail);
    if (!edges_cross(a, b, c, d)) continue;
    crossing[0] = polygons.particle[meeting.vertex];
    crossing[1] = polygons.particle[meeting.tail];
    return true;
  }
  return false;
}

// Keeps the closest meeting of each vertex with each polygon, of equals that with the lowest tail.
void keep_closest(const Polygons &polygons, std::vector<Meeting> &all)
{
  const auto same = [&](const Meeting &a, const Meeting &b) {
    return a.vertex == b.vertex && polygons.particle[a.tail] == polygons.particle[b.tail] &&
           a.image == b.image;
  };
  const auto earlier = [&](const Meeting &a, const Meeting &b) {
    if (a.vertex != b.vertex) return a.vertex < b.vertex;
    if (polygons.particle[a.tail] != polygons.particle[b.tail]) return a.tail < b.tail;
    if (!(a.image == b.image)) return a.image < b.image;
    return a.distance != b.distance ? a.distance < b.distance : a.tail < b.tail;
  };
  std::sort(all.begin(), all.end(), earlier);
  all.erase(std::unique(all.begin(), all.end(), same), all.end());
}

}  // namespace

constexpr int64_t OUTLINES_CROSS = -3;

// Meetings nearer than reach, sorted by vertex, tail and image.
//   offsets (particles + 1), x (vertices, 2), box (2, 2); closest: one with each polygon;
//   vertex, tail, place (room), separation, shift (room, 2) out: see VertexContacts;
//   crossing (2) out: polygons that cross; search (5) out: see visit_neighbors.
// Returns the number of meetings, of which the first `room` are written, or why there are none.
JAMLAB_KERNEL vertex_meetings(int64_t particles, const int64_t *offsets, const double *x,
                              const double *box, double reach, int64_t closest, double most_copies,
                              int64_t room, int64_t *vertex, int64_t *tail, double *place,
                              double *separation, double *shift, int64_t *crossing, double *search)
try {
  const Polygons polygons(particles, offsets, x);
  std::vector<Meeting> all;
  const int64_t refusal = find_all(polygons, Lattice(box), reach, most_copies, search, all);
  if (refusal < 0) return refusal;
  if (find_crossing(polygons, all, crossing)) return OUTLINES_CROSS;
  if (closest) keep_closest(polygons, all);
  const int64_t count = static_cast<int64_t>(all.size());
  for (int64_t k = 0; k < std::min(count, room); ++k) {
    vertex[k] = all[k].vertex;
    tail[k] = all[k].tail;
    place[k] = all[k].place;
    put(separation, k, all[k].separation);
    put(shift, k, all[k].shift);
  }
  return count;
}
JAMLAB_OR_NO_MEMORY
