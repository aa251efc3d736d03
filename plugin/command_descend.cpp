// SPDX-License-Identifier: GPL-2.0-or-later
#include "command_descend.h"

#include "atom.h"
#include "block_assembly.h"
#include "bond_line_tension.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix_polygon_area.h"
#include "fmt/format.h"
#include "force.h"
#include "group.h"
#include "input.h"
#include "modify.h"
#include "pair_circuloline.h"
#include "update.h"
#include "utils.h"
#include "variable.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;

// any finite matrix has factors with this shift, in units of the mean diagonal
static constexpr double HIGHEST = 1e6;

static FixPolygonArea *area_of(LAMMPS *lmp)
{
  const auto found = lmp->modify->get_fix_by_style("^polygon/area$");
  return found.size() == 1 ? dynamic_cast<FixPolygonArea *>(found.front()) : nullptr;
}

CommandDescend::CommandDescend(LAMMPS *lmp) :
    CommandForces(lmp), numbers(), counts(), pair(dynamic_cast<PairCirculoline *>(force->pair)),
    stiffness(lmp, area_of(lmp))
{
}

/* At the end LAMMPS has the energy, the forces and the stress of the final state.

   The string-style variable "descent" returns the numbers of steps, of evaluations of forces, of
   factorisations, of those refused because the matrix is not positive definite, of line searches
   without a lower energy, and of steps along which the force does not fall; then the largest force,
   the last shift that held, and 1 if outlines crossed. */
void CommandDescend::command(int narg, char **arg)
{
  if (comm->nprocs > 1) error->all(FLERR, "jamlab/descend runs on one rank");
  if (!pair || !area_of(lmp) || !dynamic_cast<BondLineTension *>(force->bond))
    error->all(FLERR, "jamlab/descend needs pair style circuloline, bond style line/tension and "
               "one fix polygon/area");
  if (!atom->tag_consecutive())
    error->all(FLERR, "jamlab/descend needs atom IDs from 1 to the number of atoms");
  read(narg, arg);

  Point here;
  read_positions(here.x);
  descend(here);
  put_positions(here.x);
  next_forces(true);
  const Counts &c = counts;
  input->variable->set(fmt::format(
      "descent string \"{} {} {} {} {} {} {:.17g} {:.17g} {}\"", c.steps, c.forces, c.factors,
      c.refused, c.stuck, c.bent, c.largest_force, c.shift, c.crossed ? 1 : 0));
}

void CommandDescend::read(int narg, char **arg)
{
  constexpr int count = sizeof(Numbers) / sizeof(double);
  if (narg != count) error->all(FLERR, "jamlab/descend needs {} numbers", count);
  Numbers &n = numbers;
  double values[count];
  for (int k = 0; k < count; k++) values[k] = utils::numeric(FLERR, arg[k], false, lmp);
  std::memcpy(&n, values, sizeof(Numbers));
  if (n.refresh < 1.0 || n.definite <= 1.0)
    error->all(FLERR, "jamlab/descend: {} steps for one factorisation and a factor {} of the shift "
               "make no sense", n.refresh, n.definite);
  pairs.resize(static_cast<std::size_t>(n.refresh));
}

/* Unwrapped positions are read by atom ID. Fix setforce must hold the atoms of a group "fixed". */
void CommandDescend::read_positions(Vector &x)
{
  x.resize(2 * atom->nlocal);
  const int found = group->find("fixed"), bit = found < 0 ? 0 : group->bitmask[found];
  still.assign(atom->nlocal, 0);
  for (int i = 0; i < atom->nlocal; i++) {
    still[atom->tag[i] - 1] = (atom->mask[i] & bit) != 0;
    double r[3];
    domain->unmap(atom->x[i], atom->image[i], r);
    std::copy_n(r, 2, &x[2 * (atom->tag[i] - 1)]);
  }
}

void CommandDescend::put_positions(const Vector &x) const
{
  double zero[3] = {0.0, 0.0, 0.0}, shift[3];
  for (int i = 0; i < atom->nlocal; i++) {
    domain->unmap(zero, atom->image[i], shift);
    for (int d = 0; d < 2; d++) atom->x[i][d] = x[2 * (atom->tag[i] - 1) + d] - shift[d];
  }
}

void CommandDescend::evaluate(Point &point)
{
  put_positions(point.x);
  point.energy = next_forces();
  point.force.resize(point.x.size());
  for (int i = 0; i < atom->nlocal; i++)
    std::copy_n(atom->f[i], 2, &point.force[2 * (atom->tag[i] - 1)]);
  counts.forces++;
}

/* Eight sums do not wait for each other. */
static double dot(const std::vector<double> &a, const std::vector<double> &b)
{
  double sums[8] = {}, rest = 0.0;
  std::size_t k = 0;
  for (; k + 8 <= a.size(); k += 8)
#pragma omp simd
    for (int n = 0; n < 8; n++) sums[n] += a[k + n] * b[k + n];
  for (; k < a.size(); k++) rest += a[k] * b[k];
  for (const double sum : sums) rest += sum;
  return rest;
}

static void add(std::vector<double> &to, double factor, const std::vector<double> &from)
{
  const double *const __restrict source = from.data();
  double *const __restrict target = to.data();
  for (std::size_t k = 0; k < to.size(); k++) target[k] += factor * source[k];
}

static double longest_part(const std::vector<double> &v)
{
  double longest = 0.0;
  for (const double one : v) longest = std::max(longest, std::fabs(one));
  return longest;
}

static double largest_norm(const std::vector<double> &v)
{
  double largest = 0.0;
  for (std::size_t k = 0; k < v.size(); k += 2)
    largest = std::max(largest, v[k] * v[k] + v[k + 1] * v[k + 1]);
  return std::sqrt(largest);
}

void CommandDescend::descend(Point &here)
{
  Point trial;
  Vector step;
  const int most = static_cast<int>(numbers.refresh);
  int age = most;
  double longest = numbers.reach;
  bool at_here = true;    // forces and contacts of LAMMPS
  counts.shift = numbers.first_shift;
  moved = 0.0;
  evaluate(here);
  while (true) {
    counts.largest_force = largest_norm(here.force);
    if (enough(counts.largest_force) || counts.steps >= numbers.steps) return;
    counts.steps++;
    if (age == most) {
      if (!at_here) evaluate(here);
      if (!factorise(counts.largest_force)) return;
      known = 0;
      age = 0;
    }
    age++;
    inverse_times(here.force, step);
    if (dot(step, here.force) <= 0.0) {
      known = 0;
      solve(here.force, step);
    }
    at_here = search_line(here, step, longest, trial);
    if (!at_here) {
      counts.stuck++;
      if (age == 1) return;    // not even a fresh Hessian shows the way down
      age = most;
      continue;
    }
    if (!add_pair(here, trial)) {
      counts.bent++;
      if (age > 1) age = most;    // the model is wrong here: factorise anew
    }
    Vector change = trial.x;
    add(change, -1.0, here.x);
    moved = longest_part(change);
    longest = std::min(numbers.reach, numbers.longer * moved);
    std::swap(here, trial);
  }
}

/* The descent has converged, or forces are too small to press droplets together again. */
bool CommandDescend::enough(double largest_force) const
{
  return largest_force <= numbers.force ||
         (largest_force < numbers.loose_force && pair->eng_vdwl < numbers.loose_energy);
}

/* The Hessian is factorised at the positions of LAMMPS. The least shift grows with the largest
   force; above it, the shift below the last one that held is tried first. Gaps that steps will
   close are as stiff as contacts, or every step would end where the first gap closes. */
bool CommandDescend::factorise(double largest_force)
{
  if (!find_meetings(*pair, atom->x, meetings, numbers.closing * moved)) {
    counts.crossed = true;
    return false;
  }
  std::vector<int> rows(atom->nlocal);
  for (int i = 0; i < atom->nlocal; i++) rows[atom->tag[i] - 1] = i;
  if (rows != row) factors.forget_order();
  row = rows;
  stiffness.take(meetings);
  BlockAssembly<2> matrix(atom);
  stiffness.assemble(1.0, matrix);
  matrix.fill(factors);

  const double least = std::max(numbers.shift * largest_force, numbers.least_shift);
  const double highest = HIGHEST * std::max(1.0, std::fabs(factors.mean_diagonal()));
  double shift = std::max(least, counts.shift);
  for (bool first = true;; first = false, shift *= numbers.definite) {
    if (!(shift < highest)) return false;
    if (!first) matrix.refill(factors);
    counts.factors++;
    if (factors.factorise(shift)) {
      counts.shift = shift / numbers.definite;
      return true;
    }
    counts.refused++;
  }
}

/* Beside pairs single precision does: steps are as many. Without them the step is Newton's. */
void CommandDescend::solve(const Vector &force, Vector &step)
{
  column.resize(force.size());
  for (std::size_t k = 0; k < row.size(); k++) std::copy_n(&force[2 * k], 2, &column[2 * row[k]]);
  known ? factors.solve_roughly(column) : factors.solve(column);
  step.resize(force.size());
  for (std::size_t k = 0; k < row.size(); k++)
    if (still[k])
      step[2 * k] = step[2 * k + 1] = 0.0;
    else
      std::copy_n(&column[2 * row[k]], 2, &step[2 * k]);
}

/* The product follows algorithm 7.4 of Nocedal & Wright. */
void CommandDescend::inverse_times(const Vector &force, Vector &step)
{
  Vector rest = force;
  for (std::size_t k = known; k-- > 0;) {
    pairs[k].along = dot(pairs[k].change, rest) / pairs[k].curvature;
    add(rest, -pairs[k].along, pairs[k].bend);
  }
  solve(rest, step);
  for (std::size_t k = 0; k < known; k++)
    add(step, pairs[k].along - dot(pairs[k].bend, step) / pairs[k].curvature, pairs[k].change);
}

/* Follows the step, up to `longest`, until the energy falls enough; returns false if it does
   not. */
bool CommandDescend::search_line(const Point &here, const Vector &step, double longest,
                                 Point &trial)
{
  const double slope = dot(here.force, step);
  const double noise = numbers.energy_digits * std::fabs(here.energy);
  double length = std::min(1.0, longest / longest_part(step));
  for (int k = 0; k < numbers.trials; k++) {
    trial.x = here.x;
    add(trial.x, length, step);
    evaluate(trial);
    const double new_slope = dot(trial.force, step);
    double fall = here.energy - trial.energy;
    if (std::fabs(fall) <= noise) fall = 0.5 * length * (slope + new_slope);
    if (fall > numbers.sufficient * length * slope) return true;
    // the secant of the force along the step gives the next length
    length *= new_slope < slope ? std::clamp(slope / (slope - new_slope), 0.1, 0.5) : 0.5;
  }
  return false;
}

/* The pair is refused, with false, if the force does not fall along the step. */
bool CommandDescend::add_pair(const Point &here, const Point &trial)
{
  Pair &next = pairs[known];
  next.change = trial.x;
  add(next.change, -1.0, here.x);
  next.bend = here.force;
  add(next.bend, -1.0, trial.force);
  next.curvature = dot(next.change, next.bend);
  const double scale = std::sqrt(dot(next.change, next.change) * dot(next.bend, next.bend));
  if (!(next.curvature > numbers.curved * scale)) return false;
  known++;
  return true;
}
