// This file cuts disks by their power cells.

#include "kernel.h"
#include "vector.h"

#include <algorithm>
#include <limits>

using namespace jamlab;

namespace {

constexpr double ENDLESS = std::numeric_limits<double>::infinity();

// A chord of a disk lies on the line normal . x = height, with the disk on its inner side.
struct Line {
  int64_t number;
  Vector normal;
  double height, distance;  // of the other disk
};

struct Interval {
  double low, high;
};

// Keeps the part of chord e that lies on the inner side of line k, in the places t of its points
// height normal + t tangent. With s = sin and q = cos of the angle between the normals, 1 - |q| =
// s^2/(1 + |q|) keeps the bound exact where the lines are nearly parallel: both chords must agree
// on which line is in front. Of lines that coincide, the line of the more distant disk is in front.
void cut(const Line &e, const Line &k, Interval &kept)
{
  const double sine = cross(e.normal, k.normal), cosine = dot(e.normal, k.normal);
  const double facing = cosine < 0 ? -e.height : e.height;
  const double room = (k.height - facing) + facing * (sine * sine) / (1 + std::fabs(cosine));
  if (sine > 0) {
    kept.high = std::min(kept.high, room / sine);
  } else if (sine < 0) {
    kept.low = std::max(kept.low, room / sine);
  } else {
    const bool farther =
      k.distance > e.distance || (k.distance == e.distance && k.number < e.number);
    if (room < 0 || (room == 0 && cosine > 0 && farther)) kept.high = -ENDLESS;
  }
}

}  // namespace

// Lengths of chords inside all others of their disk.
//   disk (chords): of each, sorted; first (disks + 1): chord of each disk; normal (chords, 2),
//   height, distance, half (chords): see jamlab.geometry.power_cells.Chords; length (chords) out.
// Returns 0.
JAMLAB_KERNEL clip_chords(int64_t chords, const int64_t *disk, const int64_t *first,
                          const double *normal, const double *height, const double *distance,
                          const double *half, double *length)
try {
  const auto line = [&](int64_t c) { return Line{c, point(normal, c), height[c], distance[c]}; };
  for (int64_t c = 0; c < chords; ++c) {
    Interval kept{-half[c], half[c]};
    const Line own = line(c);
    for (int64_t k = first[disk[c]]; k < first[disk[c] + 1]; ++k) cut(own, line(k), kept);
    length[c] = std::max(kept.high - kept.low, 0.0);
  }
  return 0;
}
JAMLAB_OR_NO_MEMORY
