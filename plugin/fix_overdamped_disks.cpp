// SPDX-License-Identifier: GPL-2.0-or-later

/* Steps of disks: Runge and Kutta's of third order, Bogacki & Shampine, Appl. Math. Lett. 2, 321
   (1989), with stages at 0, 1/2 and 3/4 of the step, in coordinates that lean with the box. Contacts
   are held over a step, so that velocities are smooth in it; a step ends where gaps open or close, as
   soon as what is dragged too much or too little since then is an error of the size that the step may make. */

#include "fix_overdamped.h"

#include "atom.h"
#include "disk_drag.h"
#include "domain.h"
#include "error.h"
#include "gather_records.h"
#include "neighbor.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr char WHO[] = "Fix overdamped";

static constexpr double NODES[3] = {0.0, 0.5, 0.75};    // each is reached at the velocity of the last
static constexpr double FIRST = 0.1;        // first step over the longest
static constexpr double GROWTH = 2.5, SHRINKAGE = 0.2, SAFETY = 0.9;
static constexpr double NOISE = 0.7;    // error over that of a longer step, from where it is the solver's
static constexpr double EXTRAPOLATION = 0.95;    // of velocities, for the solver to start from; at 1,
                                                 // motion without drag would grow
static constexpr double STEP_SHARE = 0.2;    // of the tolerance, for one step: errors of steps add up
static constexpr double DISTURBED = 10.0;    // disks that move as much as a contact that drags wrongly
static constexpr double SMALL_SYSTEM = 32.0;    // disks; one of more counts for less in a stress
static constexpr double SHORTEST_SHARE = 0.05;    // of the error of a whole step, for the shortest
static constexpr double SETTLES = 0.5;      // gap of a rubbing pair that goes in the longest step
static constexpr double STUCK = 1e-9;    // step over the relaxation time below which none is tried
static constexpr double FORCED = 1e-3;    // step over the relaxation time where pairs that rub allow none
static constexpr double STILL = 1e-12;    // travel in a step, mean diameters, whose error is rounding
static constexpr int ROUNDS = 8;            // of the states of several pairs

/* integral of the parabola through the three stages, up to a part of the step */
FixOverdamped::Weights FixOverdamped::dense_weights(double part)
{
  const double third = part * part * part / 3.0, square = part * part;
  return {(third - 0.625 * square + 0.375 * part) / 0.375, (0.375 * square - third) / 0.125,
          (third - 0.25 * square) / 0.1875};
}

FixOverdamped::Weights FixOverdamped::ahead_weights(double part)
{
  return {(part - 0.5) * (part - 0.75) / 0.375, part * (part - 0.75) / -0.125, part * (part - 0.5) / 0.1875};
}

/* A stress is a mean over all disks: the more, the less one contact counts that drags wrongly */
double FixOverdamped::finite_size_factor() const
{
  return std::max(1.0, atom->natoms / SMALL_SYSTEM);
}

/* velocities at the positions that LAMMPS has; which pairs touch, part or rub */
void FixOverdamped::start_disks()
{
  if (neighbor->ago == 0) disks->neighbors_are_new();
  disks->update_contacts(atom->nlocal, atom->nghost, 0.0);
  disks->close_gaps(state.gap_time > 0.0 ? SETTLES / state.gap_time : 0.0);
  disks->forget_settled(false);    // gaps of the last step have become wide
  disks->zero_rattler_velocities(velocity);
  const double least = tolerance * state.sums.speed / DISTURBED;
  disks->set_min_speed((finite_size_factor() - 1.0) * STEP_SHARE * least);
  const auto parts = disks->parts_before();
  if (parts.size() > 1 && disks->marginal_pairs_change() &&
      (disks->rubs(velocity, state.rate) || !fit(find_velocities(), least))) {
    relax_ties(parts, least);
  } else {
    DiskDrag::Revision revision = DiskDrag::CHANGED;
    while (revision == DiskDrag::CHANGED) {
      const DragSolver::Result result = find_velocities();
      if (!result.converged) {
        if (!disks->close_rubbing()) refuse(result);
        std::fill(velocity.begin(), velocity.end(), Vec3());
      }
      revision = result.converged ? disks->revise(velocity, state.rate, least) : DiskDrag::CHANGED;
    }
    if (revision == DiskDrag::CYCLES) relax_ties(parts, least);
  }
  disks->forget_settled(true);
  add_up();
}

bool FixOverdamped::fit(const DragSolver::Result &result, double least_speed) const
{
  return result.converged && disks->misfit(velocity, state.rate, least_speed) <= tolerance;
}

/* of pairs with a gap of zero, each of which decides on the others; a power law changes their drag */
void FixOverdamped::relax_ties(const std::vector<double> &parts, double least_speed)
{
  DragSolver::Result result = {};
  for (int round = 0; round < (disks->is_linear() ? 1 : ROUNDS); round++) {
    const bool rests =
        disks->relax_marginal_pairs(parts, velocity, {driven_rate(), area() * wanted_stress, drive == STRESS});
    result = find_velocities();
    if (rests && fit(result, least_speed)) return;
    if (!result.converged) std::fill(velocity.begin(), velocity.end(), Vec3());
  }
  if (!result.converged && !(result = find_velocities()).converged) refuse(result);
  state.unsettled += 1.0;
}

double FixOverdamped::strain_after(double time, double step) const
{
  if (drive == RATE) return wanted_rate * time;
  if (drive == OSCILLATE) return amplitude * (sin(omega * (state.time + time)) - sin(omega * state.time));
  const Weights w = dense_weights(time / step);
  double strain = 0.0;
  for (int s = 0; s < 3; s++) strain += step * w[s] * stages[s].rate;
  return strain;
}

/* velocities of the second and third stage; returns how far the step is off, over its time */
double FixOverdamped::try_stages(double step)
{
  const int nall = atom->nlocal + atom->nghost;
  const State start = state;
  Field displacement(nall), u(velocity.begin(), velocity.begin() + nall);
  const auto keep = [&](int s, double strain) {
    Stage &stage = stages[s];
    stage.velocities.resize(nall);
    for (int i = 0; i < nall; i++) stage.velocities[i] = with_lean(u[i], -strain);
    stage.rate = state.rate;
    stage.stress = stress();
    stage.dissipation = dissipation();
    stage.thetas = disks->thetas();
  };
  keep(0, 0.0);
  bool converged = true;
  for (int s = 1; s < 3 && converged; s++) {
    const Stage &last = stages[s - 1];
    for (int i = 0; i < nall; i++) displacement[i] = step * NODES[s] * last.velocities[i];
    state.time = start.time + NODES[s] * step;
    const double strain = drive == STRESS ? step * NODES[s] * last.rate : strain_after(NODES[s] * step, step);
    disks->displace(displacement, strain);
    for (int i = 0; i < atom->nlocal; i++) {    // along lines through the last step, two stages
      const Vec3 change = s == 1 ? step * acceleration()[i] : u[i] - stages[0].velocities[i];
      u[i] = u[i] + EXTRAPOLATION * 0.5 * change;
    }
    std::swap(u, velocity);
    velocity.resize(std::max<std::size_t>(u.size(), nall));
    converged = find_velocities().converged;
    add_up();
    std::swap(u, velocity);
    keep(s, strain);
  }
  const double iterations = state.iterations;
  state = start;
  state.iterations = iterations;
  if (!converged) return HUGE_VAL;

  double off = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    const Vec3 &a = stages[0].velocities[i], &b = stages[1].velocities[i], &c = stages[2].velocities[i];
    off += hypot(2.0 * a.x - 6.0 * b.x + 4.0 * c.x, 2.0 * a.y - 6.0 * b.y + 4.0 * c.y) / 9.0;
  }
  MPI_Allreduce(MPI_IN_PLACE, &off, 1, MPI_DOUBLE, MPI_SUM, world);
  if (drive == STRESS)
    off += atom->natoms * length_unit * fabs(2.0 * stages[0].rate - 6.0 * stages[1].rate + 4.0 * stages[2].rate) / 9.0;
  return off;
}

/* the next step: as long as its error allows, and contacts */
void FixOverdamped::plan_disks()
{
  const double longest = longest_step(), still = STILL / longest;
  const double speeds = state.sums.speed + atom->natoms * length_unit * (typical_rate() + still);
  const double allowed = STEP_SHARE * tolerance * speeds;
  double step = state.step > 0.0 ? state.step : FIRST * longest;
  plan.longest = longest;
  double next;
  bool rejected = false, forced = false;
  double off_before = HUGE_VAL, before = step;
  while (true) {
    step = up_to_end(std::min(step, longest));
    const double off = try_stages(step), factor = off > 0.0 ? SAFETY * sqrt(allowed / off) : GROWTH;
    next = step * std::clamp(factor, SHRINKAGE, GROWTH);
    if (factor >= SAFETY || (forced && std::isfinite(off))) break;
    if (std::isfinite(off) && off > NOISE * off_before) {    // the solver's, at any step
      next = before;
      break;
    }
    off_before = off;
    before = step;
    rejected = true;
    if (step < STUCK * longest) {
      if (forced || !disks->rubs())
        error->all(FLERR, "{}: {} at time {:.6g}, strain {:.6g}, rate {:.3g} velocities change within {:.2g}: {}, or "
                   "lower the rate", WHO, FLOW_STUCK, state.time, state.strain, state.rate, step, more_background());
      state.unsettled += 1.0;    // it is said, and the flow continues
      forced = true;
      next = FORCED * longest;
    }
    step = next;
  }
  plan.next_step = rejected ? next : std::max(next, state.step);    // if cut short by others
  plan.step = step;
  plan.time = up_to_changes(step, finite_size_factor() * allowed);
  plan.strain = strain_after(plan.time, step);
  const Weights w = dense_weights(plan.time / step), v = ahead_weights(plan.time / step);
  plan.work = stages[0].stress * plan.strain;    // of a constant stress no digit is lost
  plan.dissipated = 0.0;
  plan.displacement.assign(atom->nlocal, Vec3());
  plan.extrapolated.assign(atom->nlocal, Vec3());
  for (int s = 0; s < 3; s++) {
    const Stage &stage = stages[s];
    plan.work += step * w[s] * (stage.stress - stages[0].stress) * stage.rate;
    plan.dissipated += step * w[s] * stage.dissipation;
    for (int i = 0; i < atom->nlocal; i++) {
      plan.displacement[i] = plan.displacement[i] + step * w[s] * stage.velocities[i];
      plan.extrapolated[i] = plan.extrapolated[i] + v[s] * stage.velocities[i];
    }
  }
  for (int i = 0; i < atom->nlocal; i++)
    if (rides(i)) plan.displacement[i] = {plan.strain * to_edge(i), 0.0, 0.0};    // exactly
  plan.made = true;
  set_time_step(plan.time);
}

/* part of the step after which contacts that should have opened or closed have made an error as
   large as the step may */
double FixOverdamped::up_to_changes(double step, double allowed)
{
  std::vector<DiskDrag::Change> changes;
  const auto displacement = [&](const DiskPair &p, double time, double &x, double &y, double &strain) {
    const Weights w = dense_weights(time / step);
    Vec3 sum;
    for (int s = 0; s < 3; s++) sum = sum + step * w[s] * (stages[s].velocities[p.j] - stages[s].velocities[p.i]);
    x = sum.x;
    y = sum.y;
    strain = strain_after(time, step);
  };
  std::vector<DiskDrag::Change> own;
  disks->find_changes(velocity, state.rate, step, displacement, own);
  for (const auto &change : gather_records(own, world)) {
    const auto same = [&](const DiskDrag::Change &other) {    // newton off: two ranks see a pair
      return std::minmax(change.first, change.second) == std::minmax(other.first, other.second);
    };
    if (std::none_of(changes.begin(), changes.end(), same)) changes.push_back(change);
  }
  disks->find_exits(velocity, state.rate, stages[0].thetas, stages[2].thetas, NODES[2] * step, step, changes);
  const auto off = [&](double time) {
    double sum = 0.0;
    for (const auto &change : changes) {
      const double late = std::max(0.0, time - change.time);
      sum += DISTURBED * change.speed * late *
             (change.steepness > 0.0 ? std::min(1.0, 0.5 * change.steepness * late) : 1.0);
    }
    return sum;
  };
  double low = 0.0, high = step;
  if (off(step) > allowed * step) {
    for (int n = 0; n < 60; n++) {
      const double middle = 0.5 * (low + high);
      (off(middle) > allowed * std::max(middle, SHORTEST_SHARE * step) ? high : low) = middle;
    }
  }
  plan.changes.clear();
  for (const auto &change : changes)
    if (change.time < high) plan.changes.push_back(change);
  return high;
}

void FixOverdamped::move_disks()
{
  const double ylo = domain->boxlo[1];
  // without a background drag, motion that no contact drags would keep its slope for good
  const double slope = settings.background > 0.0 ? 1.0 / (NODES[2] * plan.step) : 0.0;
  double **const x = atom->x;
  for (int i = 0; i < atom->nlocal; i++) {
    x[i][1] += plan.displacement[i].y;
    x[i][0] += plan.displacement[i].x + plan.strain * (x[i][1] - ylo);
    velocity[i] = velocity[i] + EXTRAPOLATION * (with_lean(plan.extrapolated[i], plan.strain) - velocity[i]);
    const Vec3 change = stages[2].velocities[i] - stages[0].velocities[i];
    acceleration()[i] = with_lean(slope * change, plan.strain);
  }
  for (const auto &change : plan.changes) disks->expect(change);
  state.work += plan.work;
  state.dissipated += plan.dissipated;
  state.step = plan.next_step;
  state.gap_time = plan.longest;
}
