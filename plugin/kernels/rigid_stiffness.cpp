// The second derivatives of the energy of rigid polygons.

#include "rigid_polygons.h"

#include <algorithm>

using namespace jamlab;

namespace {

using Blocks = double[6][6];  // of the coordinates of a vertex's polygon and of the other

void add_outer(Blocks &h, double factor, const double (&slope)[6])
{
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) h[a][b] += factor * slope[a] * slope[b];
}

}  // namespace

// Adds the spring of a contact, and its force times second derivatives of the distance.
void RigidPolygons::add_stiffness(const RimContact &c, Stiffness &to) const
{
  Blocks h = {};
  add_outer(h, spring(), c.slope);
  const double force = spring() * std::max(0.0, c.overlap);
  const double turn = dot(c.normal, c.arm), foot = dot(c.normal, c.foot);
  const double per_i = 1 / radii[c.turned ? to.j : to.i], per_j = 1 / radii[c.turned ? to.i : to.j];
  const Vector across{-c.normal.y, c.normal.x};
  h[2][2] += force * turn * per_i * per_i;
  if (c.corner) {
    const double slope[6] = {across.x,  across.y,  cross(c.arm, across) * per_i,
                             -across.x, -across.y, -cross(c.foot, across) * per_j};
    add_outer(h, -force / c.distance, slope);
    h[5][5] -= force * foot * per_j * per_j;
  } else {
    h[5][5] += force * dot(c.normal, c.point) * per_j * per_j;
    const Vector side = across * per_j;
    const double mixed[5] = {side.x, side.y, turn * per_i * per_j, -side.x, -side.y};
    for (int a = 0; a < 5; ++a) {
      h[a][5] -= force * mixed[a];
      h[5][a] -= force * mixed[a];
    }
  }
  to.radial -= force * dot(c.normal, to.apart) * (c.turned ? -1.0 : 1.0);
  const int own = c.turned ? 3 : 0, other = 3 - own;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b) {
      to.ii[3 * a + b] += h[own + a][own + b];
      to.ij[3 * a + b] += h[own + a][other + b];
      to.jj[3 * a + b] += h[other + a][other + b];
    }
}

void RigidPolygons::assemble()
{
  stiffness.clear();
  for (const NearPair &pair : near) {
    stiffness.push_back({pair.i, pair.j, pair.apart, 0.0, {}, {}, {}});
    for (int64_t m = pair.first; m < pair.last; ++m)
      add_stiffness(contacts[m], stiffness.back());
  }
}

RigidPolygons::Numbers RigidPolygons::forces_of_scaling() const
{
  Numbers u(forces.size(), 0.0);
  for (const Stiffness &pair : stiffness) {
    const Vector &d = pair.apart;
    double of_i[3];
    for (int a = 0; a < 3; ++a) {
      of_i[a] = pair.ii[3 * a] * d.x + pair.ii[3 * a + 1] * d.y;
      u[3 * pair.i + a] -= of_i[a];
      u[3 * pair.j + a] -= pair.ij[a] * d.x + pair.ij[3 + a] * d.y;
    }
    if (!shears) continue;
    u[3 * n] -= (of_i[0] * d.x - of_i[1] * d.y) / box_coordinate();
    u[3 * n + 1] -= of_i[0] * d.y / box_coordinate();
  }
  return u;
}

// Rows of this block belong to polygon i, or j, and columns to the two shears. A shear moves i
// against j by (s x + g y, -s y).
RigidPolygons::Block RigidPolygons::shear_block(const Stiffness &pair, bool of_j) const
{
  Block block{};
  const Vector &d = pair.apart;
  for (int a = 0; a < 3; ++a) {
    const double x = of_j ? pair.ij[a] : pair.ii[3 * a];
    const double y = of_j ? pair.ij[3 + a] : pair.ii[3 * a + 1];
    block[3 * a] = (x * d.x - y * d.y) / box_coordinate();
    block[3 * a + 1] = x * d.y / box_coordinate();
  }
  return block;
}

RigidPolygons::Block RigidPolygons::box_block(const Stiffness &pair) const
{
  const auto [x, y] = pair.apart;
  const double xx = pair.ii[0], xy = pair.ii[1], yy = pair.ii[4];
  const double square = box_coordinate() * box_coordinate();
  Block block{};
  block[0] = (x * x * xx - 2 * x * y * xy + y * y * yy + pair.radial) / square;
  block[1] = block[3] = (x * y * xx - y * y * xy) / square;
  block[4] = y * y * xx / square;
  return block;
}

// Calls act(i, j, block) for blocks whose sum is the matrix. Transposed blocks are left out.
template <class Act> void RigidPolygons::visit_blocks(Act act) const
{
  for (const Stiffness &pair : stiffness) {
    if (pair.i == pair.j) {
      Block both;
      for (int a = 0; a < 9; ++a)
        both[a] = pair.ii[a] + pair.jj[a] + pair.ij[a] + pair.ij[3 * (a % 3) + a / 3];
      act(pair.i, pair.i, both);
    } else {
      act(pair.i, pair.i, pair.ii);
      act(pair.j, pair.j, pair.jj);
      act(pair.i, pair.j, pair.ij);
    }
    if (!shears) continue;
    act(pair.i, n, shear_block(pair, false));
    act(pair.j, n, shear_block(pair, true));
    act(n, n, box_block(pair));
  }
}

// Returns whether the matrix is positive definite with this shift of the diagonal. `pin_loose`
// gives a stiffness of 1 to polygons without contacts, and to one polygon against translations of
// all.
bool RigidPolygons::factorise(double shift, bool pin_loose)
{
  entries.clear();
  const auto add = [&](int64_t i, int64_t j, const Block &block) {
    entries.push_back({static_cast<int>(i), static_cast<int>(j), block});
  };
  visit_blocks(add);
  if (shears) add(n, n, {0, 0, 0, 0, 0, 0, 0, 0, 1});
  if (pin_loose) {
    std::vector<int> contacts(n, 0);
    for (const Stiffness &pair : stiffness) {
      ++contacts[pair.i];
      ++contacts[pair.j];
    }
    for (int64_t i = 0; i < n; ++i)
      if (!contacts[i]) add(i, i, {1, 0, 0, 0, 1, 0, 0, 0, 1});
    const int64_t held = std::max_element(contacts.begin(), contacts.end()) - contacts.begin();
    if (contacts[held]) add(held, held, {1, 0, 0, 0, 1, 0, 0, 0, 0});
  }
  factors.set_pattern(static_cast<int>(n + shears), entries);
  factors.set(entries);
  return factors.factorise(shift);
}

void RigidPolygons::write_stiffness(double *matrix) const
{
  const std::size_t rows = forces.size();
  std::fill_n(matrix, rows * rows, 0.0);
  visit_blocks([&](int64_t i, int64_t j, const Block &block) {
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) {
        matrix[(3 * i + a) * rows + 3 * j + b] += block[3 * a + b];
        if (i != j) matrix[(3 * j + b) * rows + 3 * i + a] += block[3 * a + b];
      }
  });
}
