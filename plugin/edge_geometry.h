// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_EDGE_GEOMETRY_H
#define JAMLAB_EDGE_GEOMETRY_H

#include <algorithm>
#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace LAMMPS_NS {

using Position = double[3];    // LAMMPS holds its rows one after the other

/* Between 0 and 1. Where the foot falls cannot be predicted, and compilers make branches
   of min and max: 26 instead of 21 ns per vertex for all contacts of form outline. */

inline double clamped(double t)
{
#ifdef __SSE2__
  return _mm_cvtsd_f64(_mm_min_sd(_mm_max_sd(_mm_set_sd(t), _mm_set_sd(0.0)), _mm_set_sd(1.0)));
#else
  return std::min(1.0, std::max(0.0, t));
#endif
}

/* Closest point of an edge to a vertex: the vector from it to the vertex, its
   square, and the place t in [0, 1] from the tail to the head. */

struct Foot {
  double dx, dy, rsq, t;
};

inline Foot foot_on_edge(const double *vertex, const double *tail, const double *head)
{
  const double ex = head[0] - tail[0], ey = head[1] - tail[1];
  const double rx = vertex[0] - tail[0], ry = vertex[1] - tail[1];
  const double lsq = ex * ex + ey * ey;
  const double t = clamped(lsq > 0.0 ? (rx * ex + ry * ey) / lsq : 0.0);
  const double dx = rx - t * ex, dy = ry - t * ey;
  return {dx, dy, dx * dx + dy * dy, t};
}

/* The same for an edge whose length has been taken once for all that it meets. */

struct EdgeFrame {
  double x, y, ex, ey, per_lsq;    // tail, from tail to head, 1 / length^2 (0 for a point)
};

inline EdgeFrame edge_frame(const double *tail, const double *head)
{
  const double ex = head[0] - tail[0], ey = head[1] - tail[1];
  const double lsq = ex * ex + ey * ey;
  return {tail[0], tail[1], ex, ey, lsq > 0.0 ? 1.0 / lsq : 0.0};
}

inline Foot foot_on_edge(double x, double y, const EdgeFrame &edge)
{
  const double rx = x - edge.x, ry = y - edge.y;
  const double t = clamped((rx * edge.ex + ry * edge.ey) * edge.per_lsq);
  const double dx = rx - t * edge.ex, dy = ry - t * edge.ey;
  return {dx, dy, dx * dx + dy * dy, t};
}

inline double cross(const double *o, const double *a, const double *b)
{
  return (a[0] - o[0]) * (b[1] - o[1]) - (a[1] - o[1]) * (b[0] - o[0]);
}

// edges a-b and c-d pass through each other; touching ends do not count

inline bool edges_cross(const double *a, const double *b, const double *c, const double *d)
{
  return cross(a, b, c) * cross(a, b, d) < 0.0 && cross(c, d, a) * cross(c, d, b) < 0.0;
}

}    // namespace LAMMPS_NS

#endif
