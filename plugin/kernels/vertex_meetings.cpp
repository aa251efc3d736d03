// Meetings of vertices with edges of other polygons, and of other images of their own, in every contact form.

#include "../contact_law.h"
#include "kernel.h"
#include "periodic_grid.h"

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
  std::vector<int64_t> particle, after, before;

  Polygons(int64_t count, const int64_t *offsets, const double *positions)
    : n(offsets[count]), x(positions), particle(n), after(n), before(n)
  {
    for (int64_t p = 0; p < count; ++p)
      for (int64_t v = offsets[p]; v < offsets[p + 1]; ++v) {
        particle[v] = p;
        after[v] = v + 1 < offsets[p + 1] ? v + 1 : offsets[p];
        before[after[v]] = v;
      }
  }
  Vector at(int64_t v) const { return point(x, v); }
  Vector edge(int64_t v) const { return at(after[v]) - at(v); }
};

// All meetings nearer than reach, sorted by vertex, tail and image.
int64_t find_all(const Polygons &polygons, const Lattice &lattice, double reach, double most_copies, double *search,
                 std::vector<Meeting> &all)
{
  const int64_t n = polygons.n;
  double longest = 0.0;
  for (int64_t e = 0; e < n; ++e) longest = std::max(longest, size(polygons.edge(e)));
  const double furthest = reach + 0.5 * longest;
  const double rounding = 1e-14 * (2 * largest_coordinate(n, polygons.x) + lattice.longest);
  lattice.report(furthest + rounding, search);
  if (lattice.too_many_images(furthest + rounding, n, most_copies)) return TOO_MANY_IMAGES;
  std::vector<Place> places;
  if (!locate_all(lattice, n, polygons.x, places)) return TOO_FAR;
  const PeriodicGrid<int64_t> grid(lattice, places, count_up(n), reach + rounding);

  std::vector<int64_t> start(n + 1, 0);
  std::vector<Meeting> found;
  for (int64_t e = 0; e < n; ++e) {
    const Vector edge = polygons.edge(e), middle = polygons.at(e) + edge * 0.5;
    const double square = dot(edge, edge);
    // around the box of the edge in fractions of the cell, seen from the image of the tail in it
    const Vector whole = lattice.fraction(edge);
    const double fraction[2] = {whole.x, whole.y};
    double low[2], high[2];
    for (int axis = 0; axis < 2; ++axis) {
      const double margin = lattice.margin(reach + rounding, axis);
      low[axis] = places[e].f[axis] + std::min(fraction[axis], 0.0) - margin;
      high[axis] = places[e].f[axis] + std::max(fraction[axis], 0.0) + margin;
    }
    grid.search(low, high, [&](const PeriodicGrid<int64_t>::Entry &entry, const Image &image) {
      const int64_t v = entry.item;
      const Image shift = places[v].wrap - places[e].wrap - image;  // of the edge, that brings it beside the vertex
      if (polygons.particle[v] == polygons.particle[e] && shift.home()) return;
      const double f[2] = {entry.f[0] + image.first, entry.f[1] + image.second};
      if (f[0] < low[0] || f[0] > high[0] || f[1] < low[1] || f[1] > high[1]) return;
      const Image in_box = lattice.in_box(shift);
      const Vector moved = lattice.translation(in_box);
      const Vector r = edge * 0.5 - (middle - polygons.at(v) + moved);  // from the tail to the vertex
      const double place = square > 0 ? std::min(std::max(dot(r, edge) / square, 0.0), 1.0) : 0.0;
      const Vector apart = r - edge * place;
      if (!(dot(apart, apart) < reach * reach)) return;
      found.push_back({v, e, in_box, place, std::hypot(apart.x, apart.y), apart, moved});
      ++start[v + 1];
    });
  }
  for (int64_t v = 0; v < n; ++v) start[v + 1] += start[v];
  std::vector<int64_t> next(start.begin(), start.end() - 1);
  all.resize(found.size());
  for (const Meeting &meeting : found) all[next[meeting.vertex]++] = meeting;
  for (int64_t v = 0; v < n; ++v)
    std::sort(all.begin() + start[v], all.begin() + start[v + 1], [](const Meeting &a, const Meeting &b) {
      return a.tail != b.tail ? a.tail < b.tail : a.image < b.image;
    });
  return 0;
}

// Whether the edge that starts in `own` crosses the edge of the meeting.
bool crosses(const Polygons &polygons, int64_t own, const Meeting &meeting)
{
  const Vector a = polygons.at(own), b = a + polygons.edge(own);
  const Vector c = polygons.at(meeting.tail) + meeting.shift, d = c + polygons.edge(meeting.tail);
  return cross(b - a, c - a) * cross(b - a, d - a) < 0 && cross(d - c, a - c) * cross(d - c, b - c) < 0;
}

bool find_crossing(const Polygons &polygons, const std::vector<Meeting> &all, bool before, int64_t *crossing)
{
  for (const Meeting &meeting : all) {
    const int64_t own = before ? polygons.before[meeting.vertex] : meeting.vertex;
    if (!crosses(polygons, own, meeting)) continue;
    crossing[0] = polygons.particle[own];
    crossing[1] = polygons.particle[meeting.tail];
    return true;
  }
  return false;
}

// Name of what meets only once, the first and the second in it, and which meeting it is.
struct Named {
  int64_t first, second;
  Image image;
  const Meeting *meeting;
  int64_t turn;

  bool same(const Named &other) const
  {
    return first == other.first && second == other.second && image == other.image;
  }
  bool operator<(const Named &other) const
  {
    if (first != other.first) return first < other.first;
    if (second != other.second) return second < other.second;
    if (!(image == other.image)) return image < other.image;
    if (meeting->distance != other.meeting->distance) return meeting->distance < other.meeting->distance;
    if (meeting->tail != other.meeting->tail) return meeting->tail < other.meeting->tail;
    return turn < other.turn;
  }
};

// The closest meeting of every name, of equals that with the lowest tail.
std::vector<Meeting> keep_closest(int64_t n, const std::vector<Named> &names)
{
  std::vector<int64_t> start(n + 1, 0);
  for (const Named &name : names) ++start[name.first + 1];
  for (int64_t k = 0; k < n; ++k) start[k + 1] += start[k];
  std::vector<int64_t> next(start.begin(), start.end() - 1);
  std::vector<Named> sorted(names.size());
  for (const Named &name : names) sorted[next[name.first]++] = name;
  for (int64_t k = 0; k < n; ++k) std::sort(sorted.begin() + start[k], sorted.begin() + start[k + 1]);
  std::vector<Meeting> closest;
  for (std::size_t k = 0; k < sorted.size(); ++k)
    if (!k || !sorted[k].same(sorted[k - 1])) closest.push_back(*sorted[k].meeting);
  return closest;
}

std::vector<Named> name_polygons(const Polygons &polygons, const std::vector<Meeting> &all)
{
  std::vector<Named> names;
  names.reserve(all.size());
  for (const Meeting &m : all) names.push_back({m.vertex, polygons.particle[m.tail], m.image, &m, 0});
  return names;
}

// Every meeting belongs to two pairs of edges: that of either edge that starts or ends in the vertex. Seen from both
// sides a pair has one name: the lower edge first, the image counted from it.
std::vector<Named> name_edge_pairs(const Polygons &polygons, const std::vector<Meeting> &all)
{
  std::vector<Named> names;
  names.reserve(2 * all.size());
  for (int before = 0; before < 2; ++before)
    for (const Meeting &m : all) {
      const int64_t own = before ? polygons.before[m.vertex] : m.vertex, turn = static_cast<int64_t>(names.size());
      if (own < m.tail || (own == m.tail && m.image.positive()))
        names.push_back({own, m.tail, m.image, &m, turn});
      else
        names.push_back({m.tail, own, Image{0, 0} - m.image, &m, turn});
    }
  return names;
}

}  // namespace

constexpr int64_t OUTLINES_CROSS = -3;

// Meetings nearer than reach in one of the contact forms; sorted by what each form counts once.
//   offsets (particles + 1), x (vertices, 2), box (2, 2), form: a ContactForm; vertex, tail, place (room), separation,
//   shift (room, 2) out: see VertexContacts; crossing (2) out: polygons that cross; search (5) out: see
//   periodic_neighbors.
// Returns the number of meetings, of which the first `room` are written, or why there are none.
JAMLAB_KERNEL vertex_meetings(int64_t particles, const int64_t *offsets, const double *x, const double *box,
                              double reach, int64_t form, double most_copies, int64_t room, int64_t *vertex,
                              int64_t *tail, double *place, double *separation, double *shift, int64_t *crossing,
                              double *search)
try {
  const Polygons polygons(particles, offsets, x);
  std::vector<Meeting> all;
  const int64_t refusal = find_all(polygons, Lattice(box), reach, most_copies, search, all);
  if (refusal < 0) return refusal;
  const bool segments = form == LAMMPS_NS::SEGMENT;    // one meeting for each pair of edges; of segment/smooth all
  if (find_crossing(polygons, all, false, crossing) || (segments && find_crossing(polygons, all, true, crossing)))
    return OUTLINES_CROSS;
  if (form == LAMMPS_NS::OUTLINE) all = keep_closest(polygons.n, name_polygons(polygons, all));
  if (segments) all = keep_closest(polygons.n, name_edge_pairs(polygons, all));
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
