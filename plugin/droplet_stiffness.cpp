// SPDX-License-Identifier: GPL-2.0-or-later
#include "droplet_stiffness.h"

#include "atom.h"
#include "bond.h"
#include "error.h"
#include "fix_outline_energy.h"
#include "fix_polygon_area.h"
#include "force.h"
#include "neighbor.h"
#include "pair_circuloline.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using jamlab::point, jamlab::Vector;

static constexpr double ENDLESS = 1e300;

static Vector xy(const Vec3 &v) { return {v.x, v.y}; }

static void add(Vec3 &to, const Vector &f)
{
  to.x += f.x;
  to.y += f.y;
}

bool LAMMPS_NS::find_meetings(PairCirculoline &pair, const double *const *x,
                              std::vector<DropletMeeting> &meetings, double beyond)
{
  pair.refuse_shared_walls();
  meetings.clear();
  for (const Contact &c : pair.find_contacts(beyond)) {
    const jamlab::Foot &foot = c.foot;
    const double d = sqrt(foot.rsq);
    const Vector edge = point(x[c.head], 0) - point(x[c.tail], 0), &r = foot.r;
    const bool flat = c.tail == c.head;    // a flat wall does not turn
    const bool corner = foot.t <= 0.0 || foot.t >= 1.0;
    const double length = flat ? ENDLESS : corner ? 0.0 : size(edge);
    const PairLaw &law = pair.law_of(c);
    const double force = law.acts(d) ? pair.contact_force(c).magnitude : 0.0;
    const Vector along = edge * (length > 0.0 ? 1.0 / length : 0.0);
    meetings.push_back({c.vertex, c.tail, c.head, flat ? 0.0 : foot.t, {r.x / d, r.y / d}, d,
                        law.stiffness(d), force, law.spring(), along, length});
    if (d == 0.0) return false;
  }
  return true;
}

/* Finds a coefficient of bond style line/tension, an array by bond type. */
static const double *by_bond_type(const LAMMPS *lmp, const char *name)
{
  int dim = 0;
  const void *const found = lmp->force->bond->extract(name, dim);
  if (!found || dim != 1) lmp->error->all(FLERR, "Bond style has no {} of each type", name);
  return static_cast<const double *>(found);
}

void DropletStiffness::take(const std::vector<DropletMeeting> &found)
{
  meetings = &found;
  const double *const *const x = lmp->atom->x;
  const int nlocal = lmp->atom->nlocal, newton = lmp->force->newton_bond;

  const double *const gamma = by_bond_type(lmp, "gamma"), *const eta = by_bond_type(lmp, "eta");
  edges.clear();
  for (int n = 0; n < lmp->neighbor->nbondlist; n++) {
    const int *const bond = lmp->neighbor->bondlist[n], i = bond[0], j = bond[1], type = bond[2];
    const Vector e = point(x[j], 0) - point(x[i], 0);
    const double rsq = dot(e, e) + eta[type] * eta[type];
    if (rsq == 0.0) continue;
    const double tension = gamma[type] / sqrt(rsq);
    const bool own_i = newton || i < nlocal, own_j = newton || j < nlocal;
    edges.push_back({i, j, e, tension * (1.0 - e.x * e.x / rsq), -tension * e.x * e.y / rsq,
                     tension * (1.0 - e.y * e.y / rsq), own_i, own_j, own_i && own_j ? 1.0 : 0.5});
  }

  const PolygonRings &rings = area->rings();
  vertices.clear();
  for (const PolygonRings::Vertex &v : rings.vertices()) {
    const Vector across = point(x[v.next], 0) - point(x[v.prev], 0);
    vertices.push_back({v.i, v.prev, v.next, v.polygon, {0.5 * across.y, -0.5 * across.x},
                        rings.position(v)});
  }
  outlines.take();
}

Virial DropletStiffness::add_product(const Field &p, double strain, double factor, Field &out)
{
  Virial virial;
  add_contacts(p, strain, factor, out, virial);
  add_tension(p, strain, factor, out, virial);
  add_areas(p, strain, factor, out, virial);
  outlines.add_product(p, strain, factor, out, virial);
  return virial;
}

/* The distance d depends on vertex, tail and head with the weights c = (1, t - 1, -t) and w = (0,
   -1, 1): grad d = c n, and hess d = -(1/L) [w n (c tau)^T + c tau (w n)^T + (d/L) w n (w n)^T]; at
   a corner, hess d = (1 - n n^T)/d of two points. */
void DropletStiffness::add_contacts(const Field &p, double strain, double factor, Field &out,
                                    Virial &virial) const
{
  for (const DropletMeeting &m : *meetings) {
    const Vector v = xy(p[m.vertex]), a = xy(p[m.tail]), b = xy(p[m.head]), &n = m.normal;
    const double s = 1.0 - m.t;
    // the displacement of the vertex against its foot, which the shear moves along x
    const Vector r = v - a * s - b * m.t + Vector{strain * n.y * m.distance, 0.0};
    const Vector edge = m.along * m.length;
    const double across = dot(r, n);
    Vector f = n * (m.stiffness * across), g{0.0, 0.0};
    if (m.length > 0.0) {
      const Vector w = b - a + Vector{strain * edge.y, 0.0};    // of the head against the tail
      const double turn = dot(w, n) / m.length, along = dot(r, m.along);
      f += m.along * (m.force * turn);
      g = n * (m.force * (along / m.length + m.distance / m.length * turn));
    } else {
      f += (r - n * across) * (-m.force / m.distance);
    }
    f = f * factor;
    g = g * factor;
    add(out[m.vertex], f);
    add(out[m.tail], (f * s + g) * -1.0);
    add(out[m.head], g - f * m.t);
    virial.add(f, n * m.distance);
    virial.add(g, edge);
  }
}

void DropletStiffness::add_tension(const Field &p, double strain, double factor, Field &out,
                                   Virial &virial) const
{
  for (const Edge &e : edges) {
    const Vector d = xy(p[e.j]) - xy(p[e.i]) + Vector{strain * e.r.y, 0.0};
    const Vector f = Vector{e.xx * d.x + e.xy * d.y, e.xy * d.x + e.yy * d.y} * factor;
    if (e.own_i) add(out[e.i], f * -1.0);
    if (e.own_j) add(out[e.j], f);
    virial.add(f * e.share, e.r);
  }
}

/* The Hessian of an area is ka grad a grad a^T + ka (a - a0) hess a. A shear does not change a. */
void DropletStiffness::add_areas(const Field &p, double strain, double factor, Field &out,
                                 Virial &virial)
{
  const PolygonRings &rings = area->rings();
  stretch.assign(rings.polygons().size(), 0.0);
  for (const Vertex &v : vertices) stretch[v.polygon] += dot(v.slope, xy(p[v.i]));
  rings.sum(stretch, 1);
  for (const Vertex &v : vertices) {
    const double push = factor * area->stiffness_of(v.polygon) * stretch[v.polygon];
    const double half =
        0.5 * factor * area->stiffness_of(v.polygon) * area->excess_of(v.polygon);
    const Vec3 &before = p[v.prev], &after = p[v.next];
    const Vector turned{after.y - before.y, before.x - after.x - 2.0 * strain * v.slope.x};
    const Vector f = v.slope * push + turned * half;
    add(out[v.i], f);
    virial.add(f, v.r);
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
  outlines.assemble(factor, matrix);
}

/* The formulas are those of add_contacts. */
void DropletStiffness::assemble_contacts(double factor, BlockAssembly<2> &matrix) const
{
  for (const DropletMeeting &m : *meetings) {
    const int site[3] = {m.vertex, m.tail, m.head};
    const double c[3] = {1.0, m.t - 1.0, -m.t}, w[3] = {0.0, -1.0, 1.0};
    const double k = factor * m.stiffness, f = factor * m.force;
    const double per_length = m.length > 0.0 ? 1.0 / m.length : 0.0;
    const double per_d = m.length > 0.0 ? 0.0 : f / m.distance;
    const Vector &n = m.normal, &t = m.along;
    for (int a = 0; a < 3; a++)
      for (int b = a; b < 3; b++) {
        const double nn = c[a] * c[b] * (k + per_d) +
            f * per_length * per_length * m.distance * w[a] * w[b];
        const double nt = f * per_length * w[a] * c[b], tn = f * per_length * c[a] * w[b];
        const double one = c[a] * c[b] * per_d;
        matrix.add(site[a], site[b],
                   {nn * n.x * n.x + nt * n.x * t.x + tn * t.x * n.x - one,
                    nn * n.x * n.y + nt * n.x * t.y + tn * t.x * n.y,
                    nn * n.y * n.x + nt * n.y * t.x + tn * t.y * n.x,
                    nn * n.y * n.y + nt * n.y * t.y + tn * t.y * n.y - one});
      }
  }
}

void DropletStiffness::assemble_areas(double factor, BlockAssembly<2> &matrix) const
{
  // the next vertex of the same polygon, which the box may cut into several parts
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
      const Vector own = v.slope * ka, &other = o.slope;
      matrix.add(v.i, o.i, {own.x * other.x, own.x * other.y, own.y * other.x, own.y * other.y});
    }
    const double half = 0.5 * ka * area->excess_of(v.polygon);
    matrix.add(v.i, v.next, {0.0, half, -half, 0.0});
  }
}

double DropletStiffness::largest_tension(double size) const
{
  const double *const gamma = by_bond_type(lmp, "gamma");
  double found = *std::max_element(gamma + 1, gamma + 1 + lmp->atom->nbondtypes);
  for (const FixOutlineEnergy *const law : FixOutlineEnergy::all_of(lmp))
    found = std::max(found, law->scale(size));
  return found;
}
