// SPDX-License-Identifier: GPL-2.0-or-later
#include "marginal_contact_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

using namespace LAMMPS_NS;

static constexpr double PACE = 0.05;      // of a theta in a step
static constexpr double AGREES = 0.2;    // of the largest parting: by how much a step may miss it
static constexpr double GROWTH = 2.0;     // of a step
static constexpr double RESTS = 1e-7;     // parting over the fastest velocity of a pair
static constexpr int STEPS = 1000;        // at most

MarginalContactSolver::Found MarginalContactSolver::find(const std::vector<double> &thetas) const
{
  const std::size_t n = 2 * m;
  std::vector<double> matrix(n * (n + 1));
  for (std::size_t k = 0; k < n; k++) {
    double *const row = &matrix[k * (n + 1)];
    const double *const answer = &answers[k * n];
    for (std::size_t half = 0; half < n; half += m)
      for (std::size_t l = 0; l < m; l++)
        row[half + l] = -answer[half + l] * (thetas[l] - base) * weights[half + l];
    row[k] += 1.0;
    row[n] = still[k];
  }
  Found found = {DenseSolver(std::move(matrix), n), std::vector<double>(m), std::vector<double>(m)};
  const std::vector<double> &velocity = found.velocities.solution();
  for (std::size_t k = 0; k < m; k++) {
    found.partings[k] = velocity[k] + back[k];
    found.slips[k] = velocity[m + k];
  }
  return found;
}

/* Velocities change by the answers to the drag of a pair, both of which follow its theta. */
std::vector<double> MarginalContactSolver::slopes(const Found &now,
                                                  const std::vector<std::size_t> &free) const
{
  const std::size_t n = 2 * m, count = free.size(), columns = 2 * count;
  std::vector<double> drags(n * columns), found(count * count);
  for (std::size_t k = 0; k < n; k++)
    for (std::size_t f = 0; f < count; f++)
      for (std::size_t half = 0; half < 2; half++) {
        const std::size_t l = half * m + free[f];
        drags[k * columns + half * count + f] = answers[k * n + l] * weights[l];
      }
  const std::vector<double> &velocity = now.velocities.solution();
  const std::vector<double> changes = now.velocities.solve(drags, columns, free);
  for (std::size_t k = 0; k < count; k++)
    for (std::size_t f = 0; f < count; f++)
      found[k * count + f] = changes[k * columns + f] * velocity[free[f]] +
          changes[k * columns + count + f] * velocity[m + free[f]];
  return found;
}

/* Some thetas take Euler's implicit step, linearised: a short one follows the path, and a long one
   is Newton's. false: the step is too long for the partings that it expects, or, by a determinant
   that is not positive, to leave a state that does not last. */
bool MarginalContactSolver::take_step(const std::vector<std::size_t> &free,
                                      const std::vector<double> &slopes, double time,
                                      double allowed, std::vector<double> &thetas,
                                      Found &now) const
{
  const std::size_t count = free.size(), columns = count + 1;
  std::vector<double> matrix(count * columns), next(thetas);
  for (std::size_t k = 0; k < count; k++) {
    for (std::size_t l = 0; l < count; l++)
      matrix[k * columns + l] = (k == l ? 1.0 : 0.0) + time * slopes[k * count + l];
    matrix[k * columns + count] = -time * now.partings[free[k]];
  }
  const DenseSolver step(std::move(matrix), count);
  if (!(step.determinant() > 0.0)) return false;
  for (std::size_t k = 0; k < count; k++) {
    double &theta = next[free[k]];
    theta = std::clamp(theta + step.solution()[k], 0.0, 1.0);
    if (fabs(theta - thetas[free[k]]) > PACE) return false;
  }
  Found later = find(next);
  for (std::size_t k = 0; k < count; k++) {
    double expected = now.partings[free[k]];
    for (std::size_t l = 0; l < count; l++)
      expected += slopes[k * count + l] * (next[free[l]] - thetas[free[l]]);
    if (!(fabs(later.partings[free[k]] - expected) <= allowed)) return false;
  }
  thetas = next;
  now = std::move(later);
  return true;
}

bool MarginalContactSolver::relax(std::vector<double> &thetas) const
{
  Found now = find(thetas);
  double time = 0.0;
  for (int step = 0; step < STEPS; step++) {
    double fastest = 0.0, off = 0.0;
    std::vector<std::size_t> free;
    for (std::size_t e = 0; e < m; e++) {
      const double v = now.partings[e];
      if (!std::isfinite(v)) return false;
      fastest = std::max(fastest, hypot(v, now.slips[e]));
      if ((thetas[e] <= 0.0 && v >= 0.0) || (thetas[e] >= 1.0 && v <= 0.0)) continue;
      free.push_back(e);
      off = std::max(off, fabs(v));
    }
    if (off <= RESTS * fastest) return true;
    if (time == 0.0) time = PACE / off;
    const std::vector<double> slope = slopes(now, free);
    while (!take_step(free, slope, time, AGREES * off, thetas, now))
      if (!((time /= GROWTH) > 0.0)) return false;
    time *= GROWTH;
  }
  return false;
}
