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

/* The nearest of several edges to a point, if nearer than the root of `within`. Which is nearest cannot be
   predicted: with x and y side by side and no branch, 8.5 instead of 11.4 ns for 2.3 edges. */

class NearestEdge {
 public:
#ifdef __SSE2__
  NearestEdge(const double *point, double within) :
      point(_mm_loadu_pd(point)), away(_mm_setzero_pd()), rsq(_mm_set1_pd(within)), t(away), within(within) {}

  void meet(const EdgeFrame &edge, int number)
  {
    const __m128d along = _mm_loadu_pd(&edge.ex), from_tail = _mm_sub_pd(point, _mm_loadu_pd(&edge.x));
    const __m128d here = _mm_min_pd(_mm_max_pd(_mm_mul_pd(of_both(_mm_mul_pd(from_tail, along)), _mm_set1_pd(edge.per_lsq)),
                                               _mm_setzero_pd()), _mm_set1_pd(1.0));
    const __m128d apart = _mm_sub_pd(from_tail, _mm_mul_pd(here, along)), square = of_both(_mm_mul_pd(apart, apart));
    const __m128d nearer = _mm_cmplt_pd(square, rsq);
    away = chosen(nearer, apart, away);
    t = chosen(nearer, here, t);
    rsq = _mm_min_pd(square, rsq);
    found = _mm_movemask_pd(nearer) ? number : found;
  }
  Foot foot() const
  {
    return {_mm_cvtsd_f64(away), _mm_cvtsd_f64(_mm_unpackhi_pd(away, away)), _mm_cvtsd_f64(rsq), _mm_cvtsd_f64(t)};
  }
  bool touches() const { return _mm_cvtsd_f64(rsq) < within; }

 private:
  __m128d point, away, rsq, t;    // rsq and t twice

  static __m128d of_both(__m128d v) { return _mm_add_pd(v, _mm_shuffle_pd(v, v, 1)); }
  static __m128d chosen(__m128d mask, __m128d yes, __m128d no)
  {
    return _mm_or_pd(_mm_and_pd(mask, yes), _mm_andnot_pd(mask, no));
  }
#else
  NearestEdge(const double *point, double within) : x(point[0]), y(point[1]), nearest({0.0, 0.0, within, 0.0}), within(within) {}

  void meet(const EdgeFrame &edge, int number)
  {
    const Foot foot = foot_on_edge(x, y, edge);
    if (!(foot.rsq < nearest.rsq)) return;
    nearest = foot;
    found = number;
  }
  Foot foot() const { return nearest; }
  bool touches() const { return nearest.rsq < within; }

 private:
  double x, y;
  Foot nearest;
#endif
  double within;
  int found = 0;

 public:
  int number() const { return found; }    // of some edge, if none is near enough
};

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
