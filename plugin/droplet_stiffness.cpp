// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "droplet_stiffness.h"

#include "atom.h"
#include "bond.h"
#include "fix_polygon_area.h"
#include "force.h"
#include "neighbor.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

void DropletStiffness::take(const std::vector<DropletMeeting> &found, bool without_prestress)
{
  meetings = &found;
  soft = without_prestress;
  const double *const *const x = lmp->atom->x;
  const int nlocal = lmp->atom->nlocal;

  int dim;
  const auto gamma = static_cast<const double *>(lmp->force->bond->extract("gamma", dim));
  const auto eta = static_cast<const double *>(lmp->force->bond->extract("eta", dim));
  edges.clear();
  for (int n = 0; n < lmp->neighbor->nbondlist; n++) {
    const int i = lmp->neighbor->bondlist[n][0], j = lmp->neighbor->bondlist[n][1], type = lmp->neighbor->bondlist[n][2];
    const double ex = x[j][0] - x[i][0], ey = x[j][1] - x[i][1], rsq = ex * ex + ey * ey + eta[type] * eta[type];
    if (rsq == 0.0) continue;
    const double tension = gamma[type] / sqrt(rsq);
    const bool own_i = lmp->force->newton_bond || i < nlocal, own_j = lmp->force->newton_bond || j < nlocal;
    edges.push_back({i, j, ey, tension * (1.0 - ex * ex / rsq), -tension * ex * ey / rsq,
                     tension * (1.0 - ey * ey / rsq), own_i, own_j, own_i && own_j ? 1.0 : 0.5});
  }

  const PolygonSums &rings = area->rings();
  vertices.clear();
  for (const auto &run : rings.runs())
    for (int n = run.begin; n < run.end; n++) {
      const PolygonSums::Vertex &v = rings.vertices()[n];
      double r[2];
      rings.position(v, rings.polygons()[run.polygon], r);
      vertices.push_back({v.i, v.prev, v.next, run.polygon, 0.5 * (x[v.next][1] - x[v.prev][1]),
                          0.5 * (x[v.prev][0] - x[v.next][0]), r[1]});
    }
}

/* ---------------------------------------------------------------------- */

double DropletStiffness::add_product(const Motions &p, double strain, double factor, Motions &out)
{
  return add_contacts(p, strain, factor, out) + add_tension(p, strain, factor, out) +
      add_areas(p, strain, factor, out);
}

/* ----------------------------------------------------------------------
   Hessian of the distance d, weights c = (1, t - 1, -t) and w = (0, -1, 1) on vertex, tail and head:
   grad d = c n; hess d = -(1/L) [w n (c tau)^T + c tau (w n)^T + (d/L) w n (w n)^T]; at a corner
   (1 - n n^T)/d between two points
------------------------------------------------------------------------- */

double DropletStiffness::add_contacts(const Motions &p, double strain, double factor, Motions &out) const
{
  double flow = 0.0;
  for (const DropletMeeting &m : *meetings) {
    const Motion &v = p[m.vertex], &a = p[m.tail], &b = p[m.head];
    const double s = 1.0 - m.t;
    // of the vertex against its foot, and of the head against the tail; the shear moves both along x
    const double rx = v.x - s * a.x - m.t * b.x + strain * m.ny * m.distance, ry = v.y - s * a.y - m.t * b.y;
    const double across = rx * m.nx + ry * m.ny;
    const double f = soft ? 0.0 : m.force;
    double fx = m.stiffness * across * m.nx, fy = m.stiffness * across * m.ny, gx = 0.0, gy = 0.0;
    double edge_y = 0.0;
    if (m.length > 0.0) {
      edge_y = m.ty * m.length;
      const double wx = b.x - a.x + strain * edge_y, wy = b.y - a.y;
      const double turn = (wx * m.nx + wy * m.ny) / m.length, along = rx * m.tx + ry * m.ty;
      fx += f * turn * m.tx;
      fy += f * turn * m.ty;
      const double g = f * (along / m.length + m.distance / m.length * turn);
      gx = g * m.nx;
      gy = g * m.ny;
    } else {
      const double per_d = -f / m.distance;
      fx += per_d * (rx - across * m.nx);
      fy += per_d * (ry - across * m.ny);
    }
    fx *= factor;
    fy *= factor;
    gx *= factor;
    gy *= factor;
    out[m.vertex].x += fx;
    out[m.vertex].y += fy;
    out[m.tail].x -= s * fx + gx;
    out[m.tail].y -= s * fy + gy;
    out[m.head].x += gx - m.t * fx;
    out[m.head].y += gy - m.t * fy;
    flow += fx * m.ny * m.distance + gx * edge_y;
  }
  return flow;
}

/* ---------------------------------------------------------------------- */

double DropletStiffness::add_tension(const Motions &p, double strain, double factor, Motions &out) const
{
  double flow = 0.0;
  for (const Edge &e : edges) {
    const double dx = p[e.j].x - p[e.i].x + strain * e.y, dy = p[e.j].y - p[e.i].y;
    const double fx = factor * (e.xx * dx + e.xy * dy), fy = factor * (e.xy * dx + e.yy * dy);
    if (e.own_i) {
      out[e.i].x -= fx;
      out[e.i].y -= fy;
    }
    if (e.own_j) {
      out[e.j].x += fx;
      out[e.j].y += fy;
    }
    flow += e.share * fx * e.y;
  }
  return flow;
}

/* ----------------------------------------------------------------------
   ka grad a grad a^T + ka (a - a0) hess a; a shear does not change a
------------------------------------------------------------------------- */

double DropletStiffness::add_areas(const Motions &p, double strain, double factor, Motions &out)
{
  const PolygonSums &rings = area->rings();
  stretch.assign(rings.polygons().size(), 0.0);
  for (const Vertex &v : vertices) stretch[v.polygon] += v.slope_x * p[v.i].x + v.slope_y * p[v.i].y;
  rings.sum(stretch, 1);
  double flow = 0.0;
  for (const Vertex &v : vertices) {
    const double push = factor * area->stiffness_of(v.polygon) * stretch[v.polygon];
    const double half = soft ? 0.0 : 0.5 * factor * area->stiffness_of(v.polygon) * area->excess_of(v.polygon);
    const Motion &before = p[v.prev], &after = p[v.next];
    const double fx = push * v.slope_x + half * (after.y - before.y);
    const double fy = push * v.slope_y + half * (before.x - after.x - 2.0 * strain * v.slope_x);
    out[v.i].x += fx;
    out[v.i].y += fy;
    flow += fx * v.y;
  }
  return flow;
}

/* ---------------------------------------------------------------------- */

void DropletStiffness::add_blocks(double factor, Motions &blocks) const
{
  const auto add = [&](int i, double xx, double xy, double yy) {
    blocks[i].x += factor * xx;
    blocks[i].y += factor * xy;
    blocks[i].spin += factor * yy;
  };
  for (const DropletMeeting &m : *meetings) {
    const double xx = m.stiffness * m.nx * m.nx, xy = m.stiffness * m.nx * m.ny, yy = m.stiffness * m.ny * m.ny;
    const double s = (1.0 - m.t) * (1.0 - m.t), t = m.t * m.t;
    add(m.vertex, xx, xy, yy);
    add(m.tail, s * xx, s * xy, s * yy);
    add(m.head, t * xx, t * xy, t * yy);
  }
  for (const Edge &e : edges) {
    if (e.own_i) add(e.i, e.xx, e.xy, e.yy);
    if (e.own_j) add(e.j, e.xx, e.xy, e.yy);
  }
  for (const Vertex &v : vertices) {
    const double ka = area->stiffness_of(v.polygon);
    add(v.i, ka * v.slope_x * v.slope_x, ka * v.slope_x * v.slope_y, ka * v.slope_y * v.slope_y);
  }
}

/* ---------------------------------------------------------------------- */

double DropletStiffness::largest_tension() const
{
  int dim;
  const auto gamma = static_cast<const double *>(lmp->force->bond->extract("gamma", dim));
  return *std::max_element(gamma + 1, gamma + 1 + lmp->atom->nbondtypes);
}
