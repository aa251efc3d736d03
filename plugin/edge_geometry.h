// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "kernels/nearest_foot.h"

namespace LAMMPS_NS {

using Position = double[3];    // LAMMPS holds its rows one after the other

/* The frame of an edge is found once for all vertices that meet the edge. */
struct EdgeFrame {
  double x, y, ex, ey, per_lsq;    // tail, from tail to head, 1 / length^2 (0 for a point)
};

inline EdgeFrame edge_frame(const double *tail, const double *head)
{
  const double ex = head[0] - tail[0], ey = head[1] - tail[1];
  const double lsq = ex * ex + ey * ey;
  return {tail[0], tail[1], ex, ey, lsq > 0.0 ? 1.0 / lsq : 0.0};
}

inline jamlab::Foot foot_on_edge(const double *x, const EdgeFrame &edge)
{
  const jamlab::Vector along{edge.ex, edge.ey}, from_tail{x[0] - edge.x, x[1] - edge.y};
  return foot_at(from_tail, along, dot(from_tail, along) * edge.per_lsq);
}

/* x and y are side by side, in one register where the processor has such registers. */
using Two = double __attribute__((vector_size(16), aligned(8), may_alias));

inline Two two(const double *from) { return *reinterpret_cast<const Two *>(from); }

/* NearestEdge finds the edge nearest to a point, if it is nearer than the root of `within`. Which
   edge is nearest cannot be predicted, so no branch depends on it. Half of the edges do not touch
   the point: only the distance is kept, and the foot is found again on the nearest edge. */
class NearestEdge {
 public:
  NearestEdge(const double *at, double within) : point(two(at)), rsq(within), within(within) {}

  void meet(const EdgeFrame &edge, int number)
  {
    const Two along = two(&edge.ex), from_tail = point - two(&edge.x), product = from_tail * along;
    const double t = jamlab::clamped((product[0] + product[1]) * edge.per_lsq);
    const Two apart = from_tail - Two{t, t} * along, squares = apart * apart;
    const double square = squares[0] + squares[1];
    found = square < rsq ? number : found;
    rsq = square < rsq ? square : rsq;
  }
  bool touches() const { return rsq < within; }
  int number() const { return found; }    // of some edge, if none is near enough

 private:
  Two point;
  double rsq, within;
  int found = 0;
};

}    // namespace LAMMPS_NS
