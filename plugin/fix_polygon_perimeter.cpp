// SPDX-License-Identifier: GPL-2.0-or-later
#include "fix_polygon_perimeter.h"

#include "atom.h"
#include "error.h"
#include "modify.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using jamlab::Vector;

static constexpr char WHO[] = "Fix polygon/perimeter";

static Vector unit(const Vector &r, double length)    // an edge of length 0 has no direction
{
  return length > 0.0 ? r * (1.0 / length) : Vector{0.0, 0.0};
}

/* The change of the pull of an edge, of stiffness `spring` along it. */
static Vector change_of_pull(const Vector &change, const Vector &r, double length, double pull,
                             double spring)
{
  if (length == 0.0) return {0.0, 0.0};
  const Vector n = unit(r, length), along = n * dot(n, change);
  return along * spring + (change - along) * (pull / length);
}

/* The command is: fix ID group polygon/perimeter kp kl p0 a0. The rest area a0 is a number, d_name or
   v_name. */
FixPolygonPerimeter::FixPolygonPerimeter(LAMMPS *lmp, int narg, char **arg) :
    FixOutlineEnergy(lmp, narg, arg, WHO), rest_area(lmp, WHO, "rest area", false)
{
  if (narg != 7)
    error->all(FLERR, "{} needs: kp kl p0 a0, of which a0 is a number, d_name or v_name", WHO);
  kp = positive(lmp, WHO, "kp", arg[3]);
  kl = positive(lmp, WHO, "kl", arg[4]);
  index = positive(lmp, WHO, "p0", arg[5]);
  rest_area.read(arg[6]);
}

void FixPolygonPerimeter::init()
{
  rest_area.init(igroup);
  FixOutlineEnergy::init();
  parameters_of = -1;
}

void FixPolygonPerimeter::find_parameters()
{
  const bool fresh = parameters_of != rings.refreshed();
  if (!fresh && rest_area.constant()) return;
  parameters_of = rings.refreshed();
  if (rest_area.is_variable()) modify->clearstep_compute();
  rest_area.evaluate(rings, fresh, a0);
  if (rest_area.is_variable()) modify->addstep_compute(update->ntimestep + 1);
  largest_side = 0.0;
  for (const double area : a0) largest_side = std::max(largest_side, std::sqrt(area));
}

double FixPolygonPerimeter::pull(int polygon, double length) const
{
  const int nv = rings.polygons()[polygon].size;
  return kp * excess[polygon] + kl * nv * (length - rest[polygon]);
}

/* Collective: perimeters of whole polygons. */
void FixPolygonPerimeter::find_sides()
{
  sides.clear();
  excess.assign(rings.polygons().size(), 0.0);
  rest.resize(excess.size());
  for (const PolygonRings::Vertex &v : rings.vertices()) {
    const Edge in = edge(v.prev, v.i), out = edge(v.i, v.next);
    const Vector slope = unit(in.r, in.length) - unit(out.r, out.length);
    const double spring = kl * rings.polygons()[v.polygon].size;
    sides.push_back({v.prev, v.i, v.next, v.polygon, in, out, slope, spring, 0.0, 0.0});
    excess[v.polygon] += out.length;
  }
  rings.sum(excess, 1);
  for (std::size_t k = 0; k < excess.size(); k++) {
    excess[k] -= index * std::sqrt(a0[k]);
    rest[k] = index * std::sqrt(a0[k]) / rings.polygons()[k].size;
  }
  for (Side &s : sides) {
    s.pull_in = pull(s.polygon, s.in.length);
    s.pull_out = pull(s.polygon, s.out.length);
  }
}

void FixPolygonPerimeter::add_forces()
{
  find_parameters();
  find_sides();
  for (const Side &s : sides) {
    const Vector in = unit(s.in.r, s.in.length) * s.pull_in;
    const Vector out = unit(s.out.r, s.out.length) * s.pull_out;
    const double off = s.out.length - rest[s.polygon], whole = excess[s.polygon];
    const double share = 0.5 * kp * whole * whole / rings.polygons()[s.polygon].size +
        0.5 * s.spring * off * off;
    force[s.i] += out - in;
    energy += share;
    if (!vflag_either && !eflag_atom) continue;
    Virial virial;
    virial.add(out * -1.0, s.out.r);
    tally(s.i, share, virial);
  }
}

void FixPolygonPerimeter::take()
{
  find_sides();
}

/* The Hessian is kp grad p grad p^T, and the second derivatives of the length of every edge. */
void FixPolygonPerimeter::add_product(const Field &p, double strain, double factor, Field &out,
                                      Virial &virial) const
{
  std::vector<double> stretch(excess.size(), 0.0);
  for (const Side &s : sides) {
    const Vector change = p[s.next].xy() - p[s.i].xy() + Vector{strain * s.out.r.y, 0.0};
    stretch[s.polygon] += dot(unit(s.out.r, s.out.length), change);
  }
  rings.sum(stretch, 1);
  for (const Side &s : sides) {
    const double push = kp * stretch[s.polygon];
    const Vector before = p[s.i].xy() - p[s.prev].xy() + Vector{strain * s.in.r.y, 0.0};
    const Vector after = p[s.next].xy() - p[s.i].xy() + Vector{strain * s.out.r.y, 0.0};
    const Vector in = change_of_pull(before, s.in.r, s.in.length, s.pull_in, s.spring);
    const Vector away = change_of_pull(after, s.out.r, s.out.length, s.pull_out, s.spring);
    const Vector f = (s.slope * push + in - away) * factor;
    out[s.i] += {f.x, f.y, 0.0};
    virial.add((unit(s.out.r, s.out.length) * push + away) * factor, s.out.r);
  }
}

void FixPolygonPerimeter::assemble(double factor, BlockAssembly<2> &matrix) const
{
  // the next vertex of the same polygon, which the box may cut into several parts
  std::vector<int> later(sides.size()), first(excess.size(), -1);
  for (std::size_t n = sides.size(); n-- > 0;) {
    later[n] = first[sides[n].polygon];
    first[sides[n].polygon] = static_cast<int>(n);
  }
  for (std::size_t n = 0; n < sides.size(); n++) {
    const Side &s = sides[n];
    for (int m = static_cast<int>(n); m >= 0; m = later[m]) {
      const Vector own = s.slope * (factor * kp), &other = sides[m].slope;
      matrix.add(s.i, sides[m].i,
                 {own.x * other.x, own.x * other.y, own.y * other.x, own.y * other.y});
    }
    if (s.out.length == 0.0) continue;
    const Vector e = unit(s.out.r, s.out.length);
    const double k = factor * s.pull_out / s.out.length, more = factor * s.spring - k;
    const double xx = k + more * e.x * e.x, xy = more * e.x * e.y, yy = k + more * e.y * e.y;
    matrix.add(s.i, s.i, {xx, xy, xy, yy});
    matrix.add(s.next, s.next, {xx, xy, xy, yy});
    matrix.add(s.i, s.next, {-xx, -xy, -xy, -yy});
  }
}
