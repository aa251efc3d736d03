// What capsules, the points within a rim of an edge, cover of the outlines of other edges: moved lines and arcs.
#pragma once

#include "edge_grid.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace jamlab {

constexpr double TURN = 6.283185307179586, INFINITE = std::numeric_limits<double>::infinity();

struct Interval {
  double low, high;
  bool operator<(const Interval &other) const { return low < other.low; }
};

// What is covered of an element from 0 to its extent.
struct Cover {
  double extent;
  bool whole;
  std::vector<Interval> parts;

  void clear(double length)
  {
    extent = length;
    whole = !(length > 0);
    parts.clear();
  }
  void add(double low, double high)
  {
    low = std::max(low, 0.0);
    high = std::min(high, extent);
    if (!(low < high)) return;
    if (low == 0 && high == extent) whole = true;
    parts.push_back({low, high});
  }
};

// Interval of s with lower < x + slope s < upper.
inline Interval cross_slab(double x, double slope, double lower, double upper)
{
  if (slope == 0) {
    const bool always = lower < x && x < upper;
    return {always ? -INFINITE : INFINITE, always ? INFINITE : -INFINITE};
  }
  const double a = (lower - x) / slope, b = (upper - x) / slope;
  return {std::min(a, b), std::max(a, b)};
}

// Part of the moved edge i in the capsule around edge j, whose tail lies at r from that of edge i: the capsule is the
// union of two disks around its ends and of a rectangle, and the part of a line in it is one interval.
inline void cut_line(const Edges &edges, int64_t i, int64_t j, const Vector &from_tail, Cover &cover)
{
  const double w = edges.rim, extent = edges.length[j];
  const Vector u = point(edges.along, i), v = point(edges.along, j);
  const Vector r = from_tail - point(edges.normal, i) * w;  // from the beginning of the moved edge
  const Vector ends[2] = {r, r + v * extent};
  const double place[2] = {dot(ends[0], u), dot(ends[1], u)}, aside[2] = {cross(u, ends[0]), cross(u, ends[1])};
  if ((aside[0] >= w && aside[1] >= w) || (aside[0] <= -w && aside[1] <= -w)) return;
  if ((place[0] <= -w && place[1] <= -w) || std::min(place[0], place[1]) >= edges.length[i] + w) return;
  double low = INFINITE, high = -INFINITE;
  for (int k = 0; k < 2; ++k) {
    const double half = std::sqrt(std::max((w - aside[k]) * (w + aside[k]), 0.0));
    if (!(half > 0)) continue;
    low = std::min(low, place[k] - half);
    high = std::max(high, place[k] + half);
  }
  const Interval x = cross_slab(-dot(r, v), dot(u, v), 0.0, extent), y = cross_slab(-cross(v, r), cross(v, u), -w, w);
  const double enter = std::max(x.low, y.low), leave = std::min(x.high, y.high);
  if (enter < leave) {
    low = std::min(low, enter);
    high = std::max(high, leave);
  }
  cover.add(low, high);
}

// The arc around the tail of edge i: direction of its middle, and how far its ends are from there, in rims.
struct Arc {
  Vector first, middle;
  double chord;
  bool narrow;
};

inline Arc find_arc(const Edges &edges, int64_t i)
{
  const Vector first = point(edges.normal, edges.before[i]), sum = point(edges.normal, i) + first;
  const double cosine = 0.5 * size(sum);  // of half the turn
  if (!(cosine > 0.1)) return {first, sum, 2.0, false};
  return {first, sum * (0.5 / cosine), std::sqrt(std::max(2 - 2 * cosine, 0.0)), true};
}

inline double sine_to(double cosine) { return std::sqrt(std::max((1 - cosine) * (1 + cosine), 0.0)); }

// Direction in which the circle of radius w around the corner leaves the capsule, towards the end of sign * x.
//
// In the frame of the capsule, x along it and y >= 0 the distance of the corner from its line, directions are counted
// from the one straight at the line, (sine, cosine): the circle crosses the near side y = w of the capsule at +-beta,
// cos(beta) = y/w - 1, if it does so between its ends, else it crosses the disk around that end.
inline Vector leave_capsule(double x, double y, double length, double w, double sign)
{
  const double cosine = std::min(std::max(y / w - 1, -1.0), 1.0), sine = sine_to(cosine);
  const double crossing = x + sign * w * sine;
  if (crossing >= 0 && crossing <= length) return {sign * sine, cosine};
  const double aside = (crossing > length ? length : 0.0) - x, apart = std::sqrt(aside * aside + y * y);
  const Vector toward = apart > 0 ? Vector{aside / apart, y / apart} : Vector{0.0, 1.0};
  const double c = std::min(0.5 * apart / w, 1.0), s = sign * sine_to(c);
  return {toward.x * c + toward.y * s, toward.y * c - toward.x * s};
}

// Part of the arc around the tail of edge i in the capsule around edge j.
inline void cut_arc(const Edges &edges, int64_t j, const Vector &r, const Arc &arc, Cover &cover)
{
  const double w = edges.rim, length = edges.length[j];
  const Vector v = point(edges.along, j);
  if (arc.narrow) {  // most arcs lie in the capsule or outside as a whole
    const Vector middle = arc.middle * w - r;
    const double along = dot(middle, v), aside = cross(v, middle);
    const double beyond = along - std::min(std::max(along, 0.0), length), square = beyond * beyond + aside * aside;
    const double outer = w * (1 + arc.chord) * (1 + NEAR), inner = w * (1 - arc.chord) * (1 - NEAR);
    if (square > outer * outer) return;
    if (inner > 0 && square < inner * inner) return cover.add(0.0, cover.extent);
  }
  const double x = -dot(r, v), across = -cross(v, r), y = std::fabs(across);  // of the corner
  const double beyond = x - std::min(std::max(x, 0.0), length), distance = std::sqrt(beyond * beyond + y * y);
  if (!(distance < 2 * w)) return;
  const double side = across >= 0 ? 1.0 : -1.0;
  const Vector down = {side * v.y, -side * v.x};
  double end[2];  // of the interval, counter-clockwise from the beginning of the arc
  for (int k = 0; k < 2; ++k) {
    const Vector local = leave_capsule(x, y, length, w, side * (k ? 1.0 : -1.0));
    const Vector direction = v * local.x + down * local.y;
    end[k] = std::atan2(cross(arc.first, direction), dot(arc.first, direction));
  }
  // the interval spans more than 2 pi/3 from nearer than w/2, and less than 4 pi/3 from further away
  double width = end[1] - end[0];
  if (width < (distance < 0.5 * w ? 1.0 : -1.0)) width += TURN;
  const double begin = end[0] < 0 ? end[0] + TURN : end[0];
  cover.add(begin, begin + width);  // an interval that runs through the beginning of the arc shows at both ends
  cover.add(begin - TURN, begin - TURN + width);
}

}  // namespace jamlab
