// SPDX-License-Identifier: GPL-2.0-or-later

#include "droplet_stiffness.h"

#include "atom.h"
#include "bond.h"
#include "fix_polygon_area.h"
#include "force.h"
#include "neighbor.h"
#include "pair_circuloline.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr double ENDLESS = 1e300;

bool LAMMPS_NS::find_meetings(PairCirculoline &pair, const double *const *x, std::vector<DropletMeeting> &meetings,
                              double beyond)
{
  meetings.clear();
  for (const Contact &c : pair.find_contacts(beyond)) {
    const Foot &foot = c.foot;
    const double d = sqrt(foot.rsq), ex = x[c.head][0] - x[c.tail][0], ey = x[c.head][1] - x[c.tail][1];
    const bool flat = c.tail == c.head, corner = foot.t <= 0.0 || foot.t >= 1.0;    // a flat wall does not turn
    const double length = flat ? ENDLESS : corner ? 0.0 : sqrt(ex * ex + ey * ey);
    const double per_length = length > 0.0 ? 1.0 / length : 0.0;
    meetings.push_back({c.vertex, c.tail, c.head, flat ? 0.0 : foot.t, foot.dx / d, foot.dy / d, d, pair.stiffness(c),
                        std::max(0.0, pair.contact_force(c).magnitude), ex * per_length, ey * per_length, length});
    if (d == 0.0) return false;
  }
  return true;
}

void DropletStiffness::take(const std::vector<DropletMeeting> &found)
{
  meetings = &found;
  const double *const *const x = lmp->atom->x;
  const int nlocal = lmp->atom->nlocal;

  int dim;
  const auto gamma = static_cast<const double *>(lmp->force->bond->extract("gamma", dim));
  const auto eta = static_cast<const double *>(lmp->force->bond->extract("eta", dim));
  edges.clear();
  for (int n = 0; n < lmp->neighbor->nbondlist; n++) {
    const int *const bond = lmp->neighbor->bondlist[n], i = bond[0], j = bond[1], type = bond[2];
    const double ex = x[j][0] - x[i][0], ey = x[j][1] - x[i][1], rsq = ex * ex + ey * ey + eta[type] * eta[type];
    if (rsq == 0.0) continue;
    const double tension = gamma[type] / sqrt(rsq);
    const bool own_i = lmp->force->newton_bond || i < nlocal, own_j = lmp->force->newton_bond || j < nlocal;
    edges.push_back({i, j, ex, ey, tension * (1.0 - ex * ex / rsq), -tension * ex * ey / rsq,
                     tension * (1.0 - ey * ey / rsq), own_i, own_j, own_i && own_j ? 1.0 : 0.5});
  }

  const PolygonRings &rings = area->rings();
  vertices.clear();
  for (const auto &segment : rings.segments())
    for (int n = segment.begin; n < segment.end; n++) {
      const PolygonRings::Vertex &v = rings.vertices()[n];
      double r[2];
      rings.position(v, rings.polygons()[segment.polygon], r);
      vertices.push_back({v.i, v.prev, v.next, segment.polygon, 0.5 * (x[v.next][1] - x[v.prev][1]),
                          0.5 * (x[v.prev][0] - x[v.next][0]), r[0], r[1]});
    }
}

Virial DropletStiffness::add_product(const Field &p, double strain, double factor, Field &out)
{
  Virial virial;
  add_contacts(p, strain, factor, out, virial);
  add_tension(p, strain, factor, out, virial);
  add_areas(p, strain, factor, out, virial);
  return virial;
}

/* Hessian of the distance d, weights c = (1, t - 1, -t) and w = (0, -1, 1) on vertex, tail and head:
   grad d = c n; hess d = -(1/L) [w n (c tau)^T + c tau (w n)^T + (d/L) w n (w n)^T]; at a corner
   (1 - n n^T)/d between two points */
void DropletStiffness::add_contacts(const Field &p, double strain, double factor, Field &out, Virial &virial) const
{
  for (const DropletMeeting &m : *meetings) {
    const Vec3 &v = p[m.vertex], &a = p[m.tail], &b = p[m.head];
    const double s = 1.0 - m.t;
    // of the vertex against its foot, and of the head against the tail; the shear moves both along x
    const double rx = v.x - s * a.x - m.t * b.x + strain * m.ny * m.distance, ry = v.y - s * a.y - m.t * b.y;
    const double across = rx * m.nx + ry * m.ny;
    const double f = m.force;
    double fx = m.stiffness * across * m.nx, fy = m.stiffness * across * m.ny, gx = 0.0, gy = 0.0;
    const double edge_x = m.tx * m.length, edge_y = m.ty * m.length;
    if (m.length > 0.0) {
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
    virial.add(fx, fy, m.nx * m.distance, m.ny * m.distance);
    virial.add(gx, gy, edge_x, edge_y);
  }
}

void DropletStiffness::add_tension(const Field &p, double strain, double factor, Field &out, Virial &virial) const
{
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
    virial.add(e.share * fx, e.share * fy, e.x, e.y);
  }
}

/* ka grad a grad a^T + ka (a - a0) hess a; a shear does not change a */
void DropletStiffness::add_areas(const Field &p, double strain, double factor, Field &out, Virial &virial)
{
  const PolygonRings &rings = area->rings();
  stretch.assign(rings.polygons().size(), 0.0);
  for (const Vertex &v : vertices) stretch[v.polygon] += v.slope_x * p[v.i].x + v.slope_y * p[v.i].y;
  rings.sum(stretch, 1);
  for (const Vertex &v : vertices) {
    const double push = factor * area->stiffness_of(v.polygon) * stretch[v.polygon];
    const double half = 0.5 * factor * area->stiffness_of(v.polygon) * area->excess_of(v.polygon);
    const Vec3 &before = p[v.prev], &after = p[v.next];
    const double fx = push * v.slope_x + half * (after.y - before.y);
    const double fy = push * v.slope_y + half * (before.x - after.x - 2.0 * strain * v.slope_x);
    out[v.i].x += fx;
    out[v.i].y += fy;
    virial.add(fx, fy, v.x, v.y);
  }
}

void DropletStiffness::assemble(double factor, BlockAssembly<2> &matrix) const
{
  assemble_contacts(factor, matrix);
  for (const Edge &e : edges) {
    const double xx = factor * e.xx, xy = factor * e.xy, yy = factor * e.yy;
    if (e.own_i) matrix.add(e.i, e.i, {xx, xy, xy, yy});
    if (e.own_j) matrix.add(e.j, e.j, {xx, xy, xy, yy});
    matrix.add(e.i, e.j, {-e.share * xx, -e.share * xy, -e.share * xy, -e.share * yy});
  }
  assemble_areas(factor, matrix);
}

/* as in add_contacts */
void DropletStiffness::assemble_contacts(double factor, BlockAssembly<2> &matrix) const
{
  for (const DropletMeeting &m : *meetings) {
    const int site[3] = {m.vertex, m.tail, m.head};
    const double c[3] = {1.0, m.t - 1.0, -m.t}, w[3] = {0.0, -1.0, 1.0};
    const double k = factor * m.stiffness, f = factor * m.force;
    const double per_length = m.length > 0.0 ? 1.0 / m.length : 0.0, per_d = m.length > 0.0 ? 0.0 : f / m.distance;
    for (int a = 0; a < 3; a++)
      for (int b = a; b < 3; b++) {
        const double nn = c[a] * c[b] * (k + per_d) + f * per_length * per_length * m.distance * w[a] * w[b];
        const double nt = f * per_length * w[a] * c[b], tn = f * per_length * c[a] * w[b], one = c[a] * c[b] * per_d;
        matrix.add(site[a], site[b],
                   {nn * m.nx * m.nx + nt * m.nx * m.tx + tn * m.tx * m.nx - one,
                    nn * m.nx * m.ny + nt * m.nx * m.ty + tn * m.tx * m.ny,
                    nn * m.ny * m.nx + nt * m.ny * m.tx + tn * m.ty * m.nx,
                    nn * m.ny * m.ny + nt * m.ny * m.ty + tn * m.ty * m.ny - one});
      }
  }
}

void DropletStiffness::assemble_areas(double factor, BlockAssembly<2> &matrix) const
{
  // of each vertex the next one of its polygon, which the boundary of the box may cut into several parts
  std::vector<int> later(vertices.size()), first(area->rings().polygons().size(), -1);
  for (std::size_t n = vertices.size(); n-- > 0;) {
    later[n] = first[vertices[n].polygon];
    first[vertices[n].polygon] = static_cast<int>(n);
  }
  for (std::size_t n = 0; n < vertices.size(); n++) {
    const Vertex &v = vertices[n];
    const double ka = factor * area->stiffness_of(v.polygon);
    for (int m = static_cast<int>(n); m >= 0; m = later[m]) {
      const Vertex &o = vertices[m];
      matrix.add(v.i, o.i, {ka * v.slope_x * o.slope_x, ka * v.slope_x * o.slope_y, ka * v.slope_y * o.slope_x,
                            ka * v.slope_y * o.slope_y});
    }
    const double half = 0.5 * ka * area->excess_of(v.polygon);
    matrix.add(v.i, v.next, {0.0, half, -half, 0.0});
  }
}

double DropletStiffness::largest_tension() const
{
  int dim;
  const auto gamma = static_cast<const double *>(lmp->force->bond->extract("gamma", dim));
  return *std::max_element(gamma + 1, gamma + 1 + lmp->atom->nbondtypes);
}
