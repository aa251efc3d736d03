// SPDX-License-Identifier: GPL-2.0-or-later
#include "fix_polygon_perimeter.h"

#include "atom.h"
#include "error.h"
#include "modify.h"
#include "update.h"

#include <cmath>

using namespace LAMMPS_NS;
using jamlab::Vector;

static constexpr char WHO[] = "Fix polygon/perimeter";

static Vector unit(const Vector &r, double length)    // an edge of length 0 has no direction
{
  return length > 0.0 ? r * (1.0 / length) : Vector{0.0, 0.0};
}

/* The command is: fix ID group polygon/perimeter kp kl p0 a0. The rest area a0 is a number, d_name
   or v_name. */
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

/* Second derivatives of the length of every edge; the perimeter is the sum over a polygon. */
std::vector<FixPolygonPerimeter::Corner> FixPolygonPerimeter::corners()
{
  find_sides();
  std::vector<Corner> found;
  for (const Side &s : sides) {
    const Vector e = unit(s.out.r, s.out.length);
    Corner c{s.prev, s.i, s.next, s.polygon, s.in.r, s.out.r, {}, s.slope, e};
    if (s.out.length > 0.0) {
      const double k = s.pull_out / s.out.length, more = s.spring - k;
      c.second[2][2] = k + more * e.x * e.x;
      c.second[2][3] = c.second[3][2] = more * e.x * e.y;
      c.second[3][3] = k + more * e.y * e.y;
    }
    found.push_back(c);
  }
  return found;
}
