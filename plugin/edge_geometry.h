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

}    // namespace LAMMPS_NS
