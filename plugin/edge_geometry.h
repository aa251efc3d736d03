// SPDX-License-Identifier: GPL-2.0-or-later

#pragma once

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
   predicted, so nothing branches on it; x and y stand side by side. Half of what is looked at touches nothing: only
   the distance is kept, and the foot sought anew on the edge that was found. */
class NearestEdge {
 public:
#ifdef __SSE2__
  NearestEdge(const double *point, double within) : point(_mm_loadu_pd(point)), rsq(_mm_set_sd(within)), within(within)
  {
  }

  void meet(const EdgeFrame &edge, int number)
  {
    const __m128d along = _mm_loadu_pd(&edge.ex), from_tail = _mm_sub_pd(point, _mm_loadu_pd(&edge.x));
    const __m128d here = _mm_min_sd(
        _mm_max_sd(_mm_mul_sd(sum(_mm_mul_pd(from_tail, along)), _mm_load_sd(&edge.per_lsq)), _mm_setzero_pd()),
        _mm_set_sd(1.0));
    const __m128d apart = _mm_sub_pd(from_tail, _mm_mul_pd(_mm_unpacklo_pd(here, here), along));
    const __m128d square = sum(_mm_mul_pd(apart, apart));
    found = _mm_comilt_sd(square, rsq) ? number : found;
    rsq = _mm_min_sd(square, rsq);
  }
  bool touches() const { return _mm_cvtsd_f64(rsq) < within; }

 private:
  __m128d point, rsq;    // rsq in the lower lane

  static __m128d sum(__m128d v) { return _mm_add_sd(v, _mm_unpackhi_pd(v, v)); }
#else
  NearestEdge(const double *point, double within) : x(point[0]), y(point[1]), rsq(within), within(within) {}

  void meet(const EdgeFrame &edge, int number)
  {
    const double square = foot_on_edge(x, y, edge).rsq;
    found = square < rsq ? number : found;
    rsq = std::min(square, rsq);
  }
  bool touches() const { return rsq < within; }

 private:
  double x, y, rsq;
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
