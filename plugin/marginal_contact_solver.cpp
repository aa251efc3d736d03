// SPDX-License-Identifier: GPL-2.0-or-later
#include "marginal_contact_solver.h"

#include "dense_solver.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr double PACE = 0.05;      // of a theta in a step
static constexpr double AGREES = 0.2;    // of the largest parting: by how much a step may miss it
static constexpr double GROWTH = 2.0;     // of a step
static constexpr double RESTS = 1e-7;     // parting over the fastest velocity of a pair
static constexpr int STEPS = 1000;        // at most

MarginalContactSolver::Found MarginalContactSolver::find(const std::vector<double> &thetas) const
{
  const std::size_t n = 2 * m, columns = n + 1 + n;
  std::vector<double> matrix(n * columns);
  for (std::size_t k = 0; k < n; k++) {
    double *const row = &matrix[k * columns];
    for (std::size_t l = 0; l < n; l++) {
      row[l] = (k == l ? 1.0 : 0.0) - answers[k * n + l] * (thetas[l % m] - base) * weights[l];
      row[n + 1 + l] = answers[k * n + l] * weights[l];
    }
    row[n] = still[k];
  }
  solve_dense(matrix, n, columns);
  Found found{std::vector<double>(m), std::vector<double>(m), std::vector<double>(m * m)};
  const auto velocity = [&](std::size_t k) { return matrix[k * columns + n]; };
  for (std::size_t k = 0; k < m; k++) {
    found.partings[k] = velocity(k) + back[k];
    found.slips[k] = velocity(m + k);
    for (std::size_t l = 0; l < m; l++)
      found.slopes[k * m + l] = matrix[k * columns + n + 1 + l] * velocity(l) +
          matrix[k * columns + n + 1 + m + l] * velocity(m + l);
  }
  return found;
}

/* Some thetas take Euler's implicit step, linearised: a short one follows the path, and a long one
   is Newton's. false: the step is too long for the partings that it expects, or, by a determinant
   that is not positive, to leave a state that does not last. */
bool MarginalContactSolver::take_step(const std::vector<std::size_t> &free, double time,
                                      double allowed, std::vector<double> &thetas,
                                      Found &now) const
{
  const std::size_t count = free.size(), columns = count + 1;
  std::vector<double> matrix(count * columns), next(thetas);
  for (std::size_t k = 0; k < count; k++) {
    for (std::size_t l = 0; l < count; l++)
      matrix[k * columns + l] = (k == l ? 1.0 : 0.0) + time * now.slopes[free[k] * m + free[l]];
    matrix[k * columns + count] = -time * now.partings[free[k]];
  }
  if (!(solve_dense(matrix, count, columns) > 0.0)) return false;
  for (std::size_t k = 0; k < count; k++) {
    double &theta = next[free[k]];
    theta = std::clamp(theta + matrix[k * columns + count], 0.0, 1.0);
    if (fabs(theta - thetas[free[k]]) > PACE) return false;
  }
  const Found later = find(next);
  for (const std::size_t e : free) {
    double expected = now.partings[e];
    for (const std::size_t f : free) expected += now.slopes[e * m + f] * (next[f] - thetas[f]);
    if (!(fabs(later.partings[e] - expected) <= allowed)) return false;
  }
  thetas = next;
  now = later;
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
    while (!take_step(free, time, AGREES * off, thetas, now))
      if (!((time /= GROWTH) > 0.0)) return false;
    time *= GROWTH;
  }
  return false;
}
