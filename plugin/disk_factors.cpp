// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

/* The preconditioner of disks: each one's own block of B, or Cholesky factors of the B of each rank. Which one, and for
   how long factors serve, follows from counts of products of two 3 x 3 blocks: the same on every machine. */

#include "disk_drag.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

// Costs over that of one contact in one iteration, some 10 ns
static constexpr double PER_DISK = 1.0;                       // in an iteration
static constexpr double SOLVED_DISK = 2.0, SOLVED_BLOCK = 0.8;    // in a solution with factors
static constexpr double UPDATE = 1.2, NEW_CONTACT = 17.0, NEW_DISK = 6.0;    // of new factors
static constexpr double ORDER = 300.0;    // of each disk's place in the order of elimination
// Iterations with new factors, that no newer ones would save; with those of each rank's part alone 20 to 48 were seen
static constexpr double FRESH = 2.0, FRESH_PARTS = 30.0;
static constexpr double NORMS = 3.0;      // solutions with factors beside iterations
static constexpr int UNKNOWN = 1 << 30;    // velocities, with which factors become too old
static constexpr double SERVED = 4.0;     // velocities for which factors serve, to begin with
static constexpr double WORTH = 1.5;      // cost without factors over that with them, from which on they are tried
// Drag over the background that motions without any get, such as gears that turn each other
static constexpr double SHIFT = 1e-3;

/* ----------------------------------------------------------------------
   Factors, once iterations without have cost more. New ones, once iterations with old ones have cost more than that,
   and from then on as early as those became too old. Lists of neighbors that are made anew begin without.
------------------------------------------------------------------------- */

void DiskDrag::choose_factors()
{
  if (settings.background == 0.0) return;    // without background, factors amplify what rounding leaves
  const bool moved = find_owners();
  const FactorCosts costs = factor_costs(moved);
  if (costs.moved) {
    factored = false;
    serves = UNKNOWN;
    amplified = 1.0;
    spent = 0.0;
    factors.forget_order();
    return;
  }
  if (!factored) {
    const double last = last_iterations * costs.iteration;
    spent += last;
    if (spent < costs.order) return;
    if (!patterned)    // tells the costs
      set_factor_pattern();
    else if (spent > costs.anew && last > WORTH * (costs.fresh() + costs.anew / SERVED))
      factorise();
    return;
  }
  age++;
  spent += std::max(0.0, last_iterations - costs.least) * (costs.iteration + costs.solution);
  const bool costly = spent > costs.anew;
  if (!costly && age < serves) return;
  serves = costly ? std::max(1, age - 1) : spent < 0.5 * costs.anew ? serves + 1 + serves / 4 : serves;
  factorise();
}

/* ----------------------------------------------------------------------
   before answers to forces on several pairs, all with one matrix, and none of which starts from velocities before
------------------------------------------------------------------------- */

void DiskDrag::factorise_for(std::size_t solutions)
{
  if (settings.background == 0.0 || (factored && age == 0)) return;
  FactorCosts costs = factor_costs(false);
  if (factored) {
    if (solutions * (costs.iteration + costs.solution) > costs.anew) factorise();    // each saves an iteration or more
    return;
  }
  const double without = solutions * answer_iterations * costs.iteration;
  if (without < costs.order) return;
  if (!patterned) set_factor_pattern();
  costs = factor_costs(false);
  if (without > WORTH * (solutions * costs.fresh() + costs.anew)) factorise();
}

/* ----------------------------------------------------------------------
   the largest of all ranks, which then decide alike
------------------------------------------------------------------------- */

DiskDrag::FactorCosts DiskDrag::factor_costs(bool moved) const
{
  double costs[5] = {moved ? 1.0 : 0.0, contacts.size() + PER_DISK * nlocal,
                     SOLVED_DISK * nlocal + SOLVED_BLOCK * factors.blocks_below(),
                     UPDATE * factors.updates() + NEW_CONTACT * contacts.size() + NEW_DISK * nlocal, ORDER * nlocal};
  MPI_Allreduce(MPI_IN_PLACE, costs, 5, MPI_DOUBLE, MPI_MAX, world);
  int ranks;
  MPI_Comm_size(world, &ranks);
  return {costs[0] > 0.0, costs[1], costs[2], costs[3], costs[4], ranks > 1 ? FRESH_PARTS : FRESH};
}

double DiskDrag::FactorCosts::fresh() const
{
  return least * iteration + (least + NORMS) * solution;
}

/* ----------------------------------------------------------------------
   true: atoms or ghosts are other ones
------------------------------------------------------------------------- */

bool DiskDrag::find_owners()
{
  const std::size_t all = nlocal + nghost;
  if (factored_tags.size() == all && std::equal(factored_tags.begin(), factored_tags.end(), tags)) return false;
  factored_tags.assign(tags, tags + all);
  std::vector<std::pair<tagint, int>> own;
  for (int i = 0; i < nlocal; i++) own.emplace_back(tags[i], i);
  std::sort(own.begin(), own.end());
  owners.assign(all, -1);
  for (std::size_t i = 0; i < all; i++) {
    const auto found = std::lower_bound(own.begin(), own.end(), std::make_pair(tags[i], 0));
    if (found != own.end() && found->first == tags[i]) owners[i] = found->second;
  }
  return true;
}

/* ---------------------------------------------------------------------- */

void DiskDrag::set_factor_pattern()
{
  std::vector<std::pair<int, int>> pairs;
  for (const DiskContact &c : contacts)
    if (owners[c.i] >= 0 && owners[c.j] >= 0) pairs.emplace_back(owners[c.i], owners[c.j]);
  factors.set_pattern(nlocal, pairs);
  patterned = true;
}

/* ----------------------------------------------------------------------
   blocks on the diagonal are those of all contacts; between disks, those of contacts that this rank owns both ends of
------------------------------------------------------------------------- */

void DiskDrag::factorise()
{
  set_factor_pattern();
  factors.clear();
  for (std::size_t k = 0; k < contacts.size(); k++) {
    const DiskContact &c = contacts[k];
    const int i = owners[c.i], j = owners[c.j];
    if (i < 0 || j < 0) continue;
    const auto [w, m, v] = slope_of(k);
    // approach = n (u_j - u_i), slide = t (u_j - u_i) - arm_i spin_i - arm_j spin_j
    const double n[3] = {c.nx, c.ny, 0.0}, at_i[3] = {c.ny, -c.nx, -c.arm_i}, at_j[3] = {-c.ny, c.nx, -c.arm_j};
    BlockCholesky<3>::Block block;
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 3; b++)
        block[3 * a + b] = c.share * (v * at_i[a] * at_j[b] - w * n[a] * n[b] + m * (at_i[a] * n[b] - n[a] * at_j[b]));
    if (i != j) {
      factors.add(i, j, block);
      continue;
    }
    BlockCholesky<3>::Block both;
    for (int a = 0; a < 3; a++)
      for (int b = 0; b < 3; b++) both[3 * a + b] = block[3 * a + b] + block[3 * b + a];
    factors.add(i, i, both);
  }
  for (int i = 0; i < nlocal; i++) {
    const Motion &f = blocks[0][i], &s = blocks[1][i];
    const double x = f.x + settings.background, y = f.spin + settings.background;
    factors.add(i, i, {x, f.y, s.x, f.y, y, s.y, s.x, s.y, s.spin});
  }
  factored = factors.factorise(SHIFT * settings.background);
  int all = factored;
  MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MIN, world);
  factored = all;
  spent = 0.0;
  age = 0;
  amplified = factored ? find_amplified() : 1.0;
}

/* ---------------------------------------------------------------------- */

double DiskDrag::find_amplified()
{
  column.resize(3 * nlocal);
  std::vector<double> noise(3 * nlocal);
  for (int i = 0; i < nlocal; i++) {
    const double part[3] = {blocks[0][i].x, blocks[0][i].spin, blocks[1][i].spin};
    for (int a = 0; a < 3; a++) {
      const unsigned digit = (1664525u * static_cast<unsigned>(3 * tags[i] + a) + 1013904223u) >> 16 & 1;
      column[3 * i + a] = noise[3 * i + a] = (digit ? 1.0 : -1.0) * sqrt(std::max(part[a], 0.0));
    }
  }
  factors.solve(column);
  double sums[2] = {0.0, 0.0};
  for (std::size_t n = 0; n < noise.size(); n++) {
    sums[0] += noise[n] * column[n];
    sums[1] += noise[n] != 0.0 ? 1.0 : 0.0;
  }
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, world);
  return sums[1] > 0.0 ? std::max(1.0, sums[0] / sums[1]) : 1.0;
}

/* ---------------------------------------------------------------------- */

double DiskDrag::precondition(double r_flow, double &z_flow)
{
  if (!factored) return DragSolver::precondition(r_flow, z_flow);
  column.resize(3 * nlocal);
  for (int i = 0; i < nlocal; i++) {
    column[3 * i] = residual[i].x;
    column[3 * i + 1] = residual[i].y;
    column[3 * i + 2] = residual[i].spin;
  }
  factors.solve(column);
  double product = 0.0;
  for (int i = 0; i < nlocal; i++) {
    descent[i] = {column[3 * i], column[3 * i + 1], column[3 * i + 2]};
    product += residual[i].x * descent[i].x + residual[i].y * descent[i].y + residual[i].spin * descent[i].spin;
  }
  z_flow = inverse_flow * r_flow;
  return sum(product) + r_flow * z_flow;
}
