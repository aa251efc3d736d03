// Disks cut by their power cells: chords that overlapping disks share, what others leave of them, and free arcs.

#include "kernel.h"
#include "periodic_image.h"
#include "vector.h"

#include <algorithm>
#include <limits>
#include <vector>

using namespace jamlab;

namespace {

constexpr double TURN = 6.283185307179586, INFINITE = std::numeric_limits<double>::infinity();

// Distance of the radical line from the centre of a disk; distance > 0.
double radical_height(double distance, double radius, double other)
{
  return 0.5 * (distance + (radius - other) * (radius + other) / distance);
}

struct Chord {
  bool real;
  double distance, height_i, height_j;
};

Chord cut(const Vector &r, double radius_i, double radius_j, double touch)
{
  const double distance = std::hypot(r.x, r.y), reach = radius_i + radius_j;
  Chord chord = {false, distance, radical_height(distance, radius_i, radius_j),
                 radical_height(distance, radius_j, radius_i)};
  chord.real = distance < reach && std::fabs(chord.height_i) < radius_i && std::fabs(chord.height_j) < radius_j;
  if (touch > 0 && std::fabs(distance - reach) <= touch * reach) return {true, distance, radius_i, radius_j};
  return chord;
}

struct Covered {
  double start, end;
  int64_t row, turn;
  bool operator<(const Covered &other) const { return start != other.start ? start < other.start : turn < other.turn; }
};

double turned(double angle)  // into 0 .. TURN
{
  const double rest = std::fmod(angle, TURN);
  return rest < 0 ? rest + TURN : rest;
}

}  // namespace

// Chords seen from both disks of every pair that overlaps or touches, sorted by disk.
//   i, j (pairs), r, shift (pairs, 2): see Pairs; radius (n); touch: see disk_cells; room for 2 * pairs rows in
//   disk, other, distance, height, half, pair and in normal, turn (rows, 2); first (n + 1): rows of each disk;
//   swallowed (n): disks inside others, which have no chords.
// Returns the number of rows.
JAMLAB_KERNEL disk_chords(int64_t pairs, const int64_t *i, const int64_t *j, const double *r, const int64_t *shift,
                          int64_t n, const double *radius, double touch, int64_t *disk, int64_t *other,
                          double *normal, double *distance, double *height, double *half, int64_t *pair,
                          int64_t *image, int64_t *first, bool *swallowed)
try {
  std::fill(swallowed, swallowed + n, false);
  for (int64_t k = 0; k < pairs; ++k) {
    const double apart = std::hypot(r[2 * k], r[2 * k + 1]);
    if (apart + radius[j[k]] <= radius[i[k]])
      swallowed[j[k]] = true;  // of two equal disks in one place, i < j stays
    else if (apart + radius[i[k]] <= radius[j[k]])
      swallowed[i[k]] = true;
  }
  std::vector<int64_t> as_first(n + 1, 0), as_second(n + 1, 0);
  std::vector<Chord> chords(pairs);
  for (int64_t k = 0; k < pairs; ++k) {
    chords[k] = {false, 0.0, 0.0, 0.0};
    if (!swallowed[i[k]] && !swallowed[j[k]]) chords[k] = cut(point(r, k), radius[i[k]], radius[j[k]], touch);
    as_first[i[k]] += chords[k].real;
    as_second[j[k]] += chords[k].real;
  }
  first[0] = 0;
  for (int64_t d = 0; d < n; ++d) {
    first[d + 1] = first[d] + as_first[d] + as_second[d];
    as_second[d] = first[d] + as_first[d];
    as_first[d] = first[d];
  }
  for (int64_t k = 0; k < pairs; ++k) {
    const Chord &chord = chords[k];
    if (!chord.real) continue;
    const int64_t a = as_first[i[k]]++, b = as_second[j[k]]++;
    const double edge = radius[i[k]];
    const Vector unit = {r[2 * k] / chord.distance, r[2 * k + 1] / chord.distance};
    disk[a] = other[b] = i[k];
    disk[b] = other[a] = j[k];
    put(normal, a, unit);
    put(normal, b, unit * -1.0);
    distance[a] = distance[b] = chord.distance;
    height[a] = chord.height_i;
    height[b] = chord.height_j;
    half[a] = half[b] = std::sqrt((edge - chord.height_i) * (edge + chord.height_i));
    pair[a] = b;
    pair[b] = a;
    for (int axis = 0; axis < 2; ++axis) {
      image[2 * a + axis] = shift[2 * k + axis];
      image[2 * b + axis] = -shift[2 * k + axis];
    }
  }
  return first[n];
}
JAMLAB_OR_NO_MEMORY

// Length of each chord inside all other half planes n_k . x <= h_k of its disk.
//
// Points on chord e are h_e n_e + t tau_e, |t| <= c_e; line k keeps t (n_k . tau_e) <= h_k - h_e n_k . n_e. With
// s = n_k . tau_e = sin and q = n_k . n_e = cos of the angle between the normals, 1 - |q| = s^2/(1 + |q|) keeps the
// right-hand side exact where the lines are nearly parallel: both chords must agree on which line is in front. Of lines
// that coincide, that of the more distant disk is in front.
JAMLAB_KERNEL clip_chords(int64_t n, const int64_t *first, const double *normal, const double *distance,
                          const double *height, const double *half, double *length)
try {
  for (int64_t d = 0; d < n; ++d)
    for (int64_t e = first[d]; e < first[d + 1]; ++e) {
      const Vector own = point(normal, e);
      double above = -half[e], below = half[e];
      for (int64_t k = first[d]; k < first[d + 1]; ++k) {
        const Vector line = point(normal, k);
        const double sine = cross(own, line), cosine = dot(line, own);
        const double facing = cosine < 0 ? -height[e] : height[e];
        const double room = (height[k] - facing) + facing * sine * sine / (1 + std::fabs(cosine));
        if (sine > 0) {
          below = std::min(below, room / sine);
        } else if (sine < 0) {
          above = std::max(above, room / sine);
        } else {
          const bool farther = distance[k] > distance[e] || (distance[k] == distance[e] && k < e);
          if (room < 0 || (room == 0 && cosine > 0 && farther)) below = -INFINITE;
        }
      }
      length[e] = std::max(below - above, 0.0);
    }
  return first[n];
}
JAMLAB_OR_NO_MEMORY

// Arcs outside the union of the cut angles [theta - alpha, theta + alpha], alpha = arctan2(c, h), of every disk that is
// not swallowed; arcs between chords first, then whole circles.
//   Angles are counted from the start of the first cut of each disk, so that no free arc runs through zero.
//   disk, from, to (room), start, angle (room) out, room for as many arcs as chords and disks: see DiskCells.
// Returns the number of arcs.
JAMLAB_KERNEL free_arcs(int64_t n, const int64_t *first, const double *normal, const double *height,
                        const double *half, const bool *swallowed, int64_t *disk, double *start, double *angle,
                        int64_t *from, int64_t *to)
try {
  int64_t count = 0;
  std::vector<Covered> cuts;
  std::vector<double> ends;
  for (int64_t d = 0; d < n; ++d) {
    if (first[d] == first[d + 1]) continue;
    cuts.clear();
    ends.clear();
    double zero = 0.0;
    for (int64_t k = first[d]; k < first[d + 1]; ++k) {
      const double theta = std::atan2(normal[2 * k + 1], normal[2 * k]), alpha = std::atan2(half[k], height[k]);
      if (k == first[d]) zero = theta - alpha;
      const double begin = turned(theta - alpha - zero);
      cuts.push_back({begin, begin + 2 * alpha, k, k});
      ends.push_back(theta + alpha);
    }
    const std::size_t plain = cuts.size();
    for (std::size_t c = 0; c < plain; ++c) {  // cuts that run through zero cover its other side too
      if (!(cuts[c].end > TURN)) continue;
      cuts.push_back({0.0, cuts[c].end - TURN, cuts[c].row, first[n] + cuts[c].row});
      cuts[c].end = TURN;
    }
    std::sort(cuts.begin(), cuts.end());
    const Covered *reached = &cuts[0];  // the cut so far that ends last
    for (std::size_t c = 0; c < cuts.size(); ++c) {
      if (cuts[c].end >= reached->end) reached = &cuts[c];
      const bool last = c + 1 == cuts.size();
      const double gap = (last ? TURN : cuts[c + 1].start) - reached->end;
      if (!(gap > 0) || count >= first[n] + n) continue;
      disk[count] = d;
      start[count] = turned(ends[reached->row - first[d]]);
      angle[count] = gap;
      from[count] = reached->row;
      to[count++] = last ? first[d] : cuts[c + 1].row;  // after the last gap comes the cut at zero
    }
  }
  for (int64_t d = 0; d < n; ++d) {
    if (first[d] != first[d + 1] || swallowed[d]) continue;
    disk[count] = d;
    start[count] = 0.0;
    angle[count] = TURN;
    from[count] = to[count] = -1;
    ++count;
  }
  return count;
}
JAMLAB_OR_NO_MEMORY

// Whether two cuts of one circle overlap: a point then lies in three disks.
JAMLAB_KERNEL cuts_overlap(int64_t n, const int64_t *first, const double *normal, const double *height,
                           const double *half)
try {
  for (int64_t d = 0; d < n; ++d)
    for (int64_t a = first[d]; a < first[d + 1]; ++a)
      for (int64_t b = a + 1; b < first[d + 1]; ++b) {
        const double square = half[a] * half[a] + height[a] * height[a];  // of the radius
        const double cosine = height[a] * height[b] - half[a] * half[b];  // of the sum of both half angles
        const bool beyond_half_turn = height[a] * half[b] + height[b] * half[a] < 0;
        if (beyond_half_turn || dot(point(normal, a), point(normal, b)) * square > cosine) return 1;
      }
  return 0;
}
JAMLAB_OR_NO_MEMORY

// Free arcs as pieces of the boundary, each followed by the arc of the disk that it meets.
//   disk, start, angle, from, to (arcs): see DiskCells; pair, image: of the chords; positions (n, 2), radius (n);
//   begin, end, centre (arcs, 2), size (arcs): see Pieces; following (arcs), shift (arcs, 2) out, -1 where no arc
//   begins.
JAMLAB_KERNEL draw_arcs(int64_t arcs, const int64_t *disk, const double *start, const double *angle,
                        const int64_t *from, const int64_t *to, int64_t chords, const int64_t *pair,
                        const int64_t *image, const double *positions, const double *radius, double *begin,
                        double *end, double *centre, double *size, int64_t *following, int64_t *shift)
try {
  std::vector<int64_t> begins_at(chords, -1);
  for (int64_t a = 0; a < arcs; ++a)
    if (from[a] >= 0) begins_at[from[a]] = a;
  for (int64_t a = 0; a < arcs; ++a) {
    const Vector middle = point(positions, disk[a]);
    const double w = radius[disk[a]], stop = start[a] + angle[a];
    put(begin, a, middle + Vector{std::cos(start[a]), std::sin(start[a])} * w);
    put(end, a, middle + Vector{std::cos(stop), std::sin(stop)} * w);
    put(centre, a, middle);
    size[a] = w;
    const bool whole = from[a] < 0;
    following[a] = whole ? a : begins_at[pair[to[a]]];
    shift[2 * a] = whole ? 0 : image[2 * to[a]];
    shift[2 * a + 1] = whole ? 0 : image[2 * to[a] + 1];
  }
  return arcs;
}
JAMLAB_OR_NO_MEMORY
