// SPDX-License-Identifier: GPL-2.0-or-later
#include "fix_polygon_bending.h"

#include "atom.h"
#include "error.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;
using jamlab::Vector;

static constexpr char WHO[] = "Fix polygon/bending";
static constexpr double TWO_PI = 6.28318530717958647692;

/* The command is: fix ID group polygon/bending kappa theta0 */
FixPolygonBending::FixPolygonBending(LAMMPS *lmp, int narg, char **arg) :
    FixOutlineEnergy(lmp, narg, arg, WHO)
{
  if (narg != 5) error->all(FLERR, "{} needs: kappa theta0, two numbers", WHO);
  kappa = positive(lmp, WHO, "kappa", arg[3]);
  theta0 = positive(lmp, WHO, "theta0", arg[4]);
}

/* The formulas are those of `bending` in jamlab/outline_laws/bending.py. */
FixPolygonBending::Turn FixPolygonBending::turn_at(const PolygonRings::Vertex &v,
                                                   bool with_second) const
{
  const Edge in = edge(v.prev, v.i), out = edge(v.i, v.next);
  if (in.length == 0.0 || out.length == 0.0)
    error->one(FLERR, "{}: an edge at atom {} has length 0, and no direction", WHO,
               atom->tag[v.i]);
  const Vector &a = in.r, &b = out.r;
  const double off = std::atan2(cross(a, b), dot(a, b)) -
      theta0 * TWO_PI / rings.polygons()[v.polygon].size;
  const double l = 0.5 * (in.length + out.length), along = kappa * off / l;
  Turn c{a, b, 0.5 * along * off, {}, {}};
  const double across = c.energy / l;
  const double sa = in.length * in.length, sb = out.length * out.length;
  const double angle[4] = {a.y / sa, -a.x / sa, -b.y / sb, b.x / sb};
  const double unit[4] = {a.x / in.length, a.y / in.length, b.x / out.length, b.y / out.length};
  for (int m = 0; m < 4; m++) c.slope[m] = along * angle[m] - 0.5 * across * unit[m];
  if (!with_second) return c;

  for (int m = 0; m < 4; m++)
    for (int n = 0; n < 4; n++)
      c.second[m][n] = kappa / l * angle[m] * angle[n] + 0.5 * across / l * unit[m] * unit[n] -
          0.5 * along / l * (angle[m] * unit[n] + unit[m] * angle[n]);
  for (int side = 0; side < 2; side++) {
    const double square = side ? sb : sa, sign = side ? along : -along;
    const Vector &e = side ? b : a;
    const double mixed = sign * 2.0 * e.x * e.y / (square * square);
    const double other = sign * (e.y * e.y - e.x * e.x) / (square * square);
    const double bend = 0.5 * across / (side ? out.length : in.length);
    const int k = 2 * side;
    c.second[k][k] += mixed - bend * (1.0 - unit[k] * unit[k]);
    c.second[k + 1][k + 1] += -mixed - bend * (1.0 - unit[k + 1] * unit[k + 1]);
    c.second[k][k + 1] += other + bend * unit[k] * unit[k + 1];
    c.second[k + 1][k] += other + bend * unit[k] * unit[k + 1];
  }
  return c;
}

void FixPolygonBending::add_forces()
{
  for (const PolygonRings::Vertex &v : rings.vertices()) {
    const Turn c = turn_at(v, false);
    const Vector in{c.slope[0], c.slope[1]}, out{c.slope[2], c.slope[3]};
    force[v.prev] += in;
    force[v.i] += out - in;
    force[v.next] -= out;
    energy += c.energy;
    if (!vflag_either && !eflag_atom) continue;
    Virial virial;
    virial.add(in * -1.0, c.in);
    virial.add(out * -1.0, c.out);
    tally(v.i, c.energy, virial);
  }
}

std::vector<FixPolygonBending::Corner> FixPolygonBending::corners()
{
  std::vector<Corner> found;
  for (const PolygonRings::Vertex &v : rings.vertices()) {
    const Turn turn = turn_at(v, true);
    Corner c{v.prev, v.i, v.next, v.polygon, turn.in, turn.out, {}, {0.0, 0.0}, {0.0, 0.0}};
    std::copy_n(turn.second[0], 16, c.second[0]);
    found.push_back(c);
  }
  return found;
}
