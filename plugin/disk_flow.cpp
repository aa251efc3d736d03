// SPDX-License-Identifier: GPL-2.0-or-later
#include "disk_flow.h"

#include "error.h"
#include "gather_records.h"
#include "pair_disk_drag.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <set>

using namespace LAMMPS_NS;

static constexpr double NODES[3] = {0.0, 0.5, 0.75};    // each at the velocity of the last one
static constexpr double FIRST = 0.1;    // first step over the longest
static constexpr double GROWTH = 2.5, SHRINKAGE = 0.2, SAFETY = 0.9;
static constexpr double NOISE = 0.7;    // error over that of a longer step: it is the solver's
// Part of the velocities' change that the solver starts from; at 1, motion without drag would grow
static constexpr double EXTRAPOLATION = 0.95;
static constexpr double STEP_SHARE = 0.2;     // of the tolerance: errors of steps add up
static constexpr double DISTURBED = 10.0;     // disks that a contact which drags wrongly moves
static constexpr double SMALL_SYSTEM = 32.0;    // disks; one of more counts for less in a stress
static constexpr double SHORTEST_SHARE = 0.05;    // of the error of a whole step, for the shortest
static constexpr double SETTLES = 0.5;    // gap of a rubbing pair that goes in the longest step
// Steps over the relaxation time: the shortest one tried, and one where rubbing pairs allow none
static constexpr double STUCK = 1e-9, FORCED = 1e-3;
static constexpr double STILL = 1e-12;    // mean diameters of travel whose error is rounding
static constexpr double PHASE = 0.2;      // of an oscillation that may pass in a step
static constexpr int ROUNDS = 8;          // of the states of several pairs
// Overlap over the mean one and the root of the tolerance, below which disks drag as at it:
// stresses of 4 flows with exponent 2.5 err as little as without, and steps that were 1e-7 long
// become 100 times longer
static constexpr double LAYER = 0.01;

std::unique_ptr<DragSolver> DiskFlow::make_solver()
{
  auto *const style = dynamic_cast<PairDiskDrag *>(force->pair_match("disk/drag", 1));
  if (!style)
    error->all(FLERR, "{}: needs pair_style disk/drag, with which it began", WHO);
  if (settings.droplet_law_given)
    error->all(FLERR, "{}: drag is for droplets: disks have that of pair_style disk/drag", WHO);
  if (style->drag().tau == 0.0 && settings.solver.background == 0.0)
    error->all(FLERR, "{}: no drag at all: tau = 0 of pair_style disk/drag needs a background drag",
               WHO);
  if (force->bond)
    error->all(FLERR, "{}: bond_style {} pushes disks too, which enters neither stress nor steps: "
               "remove it", WHO, force->bond_style);
  auto found = std::make_unique<DiskDrag>(world, exchange, settings.solver, *style, atom);
  if (drag) marginal = drag->marginal_contacts();
  found->set_marginal_contacts(marginal);
  found->set_least_overlap(LAYER * sqrt(settings.tolerance));
  drag = found.get();
  diameter = style->mean_diameter(true);
  return found;
}

void DiskFlow::keep(RestartBytes &bytes)
{
  OverdampedFlow::keep(bytes);
  if (drag) marginal = drag->marginal_contacts();
  bytes(gap_time);
  bytes(marginal);
}

void DiskFlow::begin_step()
{
  if (!plan.made) make_plan(update->ntimestep - 1);    // of `run ... pre no` after an interval
  const double step = plan.step, strain = strain_after(plan.time, step);
  const Weights times = dense_weights(plan.time, step), ahead = ahead_weights(plan.time / step);
  // without a background drag, motion that no contact drags would keep its slope for good
  const double slope = settings.solver.background > 0.0 ? 1.0 / (NODES[2] * step) : 0.0;
  double farthest = 0.0, dissipated = 0.0;
  double work = stages[0].stress * strain;    // of a constant stress no digit is lost
  for (int s = 0; s < 3; s++) {
    work += times[s] * (stages[s].stress - stages[0].stress) * stages[s].rate;
    work += times[s] * stages[s].pushed;
    dissipated += times[s] * stages[s].dissipation;
  }
  for (int i = 0; i < atom->nlocal; i++) {
    const Vec3 &a = stages[0].velocities[i], &b = stages[1].velocities[i],
               &c = stages[2].velocities[i];
    Vec3 moved = times[0] * a + times[1] * b + times[2] * c;
    const Vec3 guess = ahead[0] * a + ahead[1] * b + ahead[2] * c;
    if (rides(i)) moved = {strain * to_edge(i), 0.0, 0.0};    // exactly
    farthest = std::max(farthest, hypot(moved.x, moved.y));
    move(i, moved.x, moved.y, strain);
    velocity[i] = velocity[i] + EXTRAPOLATION * (with_lean(guess, strain) - velocity[i]);
    acceleration[i] = with_lean(slope * (c - a), strain);
  }
  drag->expect(plan.changes);
  state.work += work;
  state.dissipated += dissipated;
  state.step = plan.next_step;
  gap_time = plan.longest;
  advance(strain, farthest);
}

void DiskFlow::end_step()
{
  settle_contacts();
  plan.made = false;
  if (!interval_ended()) make_plan(update->ntimestep);    // a run that resumes here plans anew
}

/* The integral up to a time of the parabola through the three stages of a step: the time for which
   the velocities of each count. */
DiskFlow::Weights DiskFlow::dense_weights(double time, double step)
{
  const double part = time / step, square = part * part, third = part * part * part / 3.0;
  return {step * ((third - 0.625 * square + 0.375 * part) / 0.375),
          step * ((0.375 * square - third) / 0.125), step * ((third - 0.25 * square) / 0.1875)};
}

/* The parabola itself, at a part of the step. */
DiskFlow::Weights DiskFlow::ahead_weights(double part)
{
  return {(part - 0.5) * (part - 0.75) / 0.375, part * (part - 0.75) / -0.125,
          part * (part - 0.5) / 0.1875};
}

/* A stress is a mean over all disks: the more there are, the less one contact counts that drags
   wrongly. */
double DiskFlow::finite_size_factor() const
{
  return std::max(1.0, atom->natoms / SMALL_SYSTEM);
}

/* Finds which pairs touch, part or rub at the present positions, and the velocities there. */
void DiskFlow::settle_contacts()
{
  if (neighbor->ago == 0) drag->neighbors_are_new();
  update_contacts(0.0);
  drag->close_gaps(gap_time > 0.0 ? SETTLES / gap_time : 0.0);
  drag->forget_settled(false);    // gaps of the last step have become wide
  drag->zero_rattler_velocities(velocity);
  const double least = settings.tolerance * state.sums.speed / DISTURBED;
  drag->set_min_speed((finite_size_factor() - 1.0) * STEP_SHARE * least);
  const auto parts = drag->parts_before();
  if (parts.size() > 1 && drag->marginal_pairs_change() &&
      (drag->rubs(velocity, state.rate) || !fit(find_velocities(), least))) {
    relax_ties(parts, least);
  } else {
    DiskDrag::Revision revision = DiskDrag::CHANGED;
    while (revision == DiskDrag::CHANGED) {
      const DragSolver::Result result = find_velocities();
      if (result.converged) {
        revision = drag->revise(velocity, state.rate, least);
      } else {
        if (!drag->close_rubbing()) refuse_velocities(result);
        std::fill(velocity.begin(), velocity.end(), Vec3());
      }
    }
    if (revision == DiskDrag::CYCLES) relax_ties(parts, least);
  }
  drag->forget_settled(true);
  add_up();
}

bool DiskFlow::fit(const DragSolver::Result &result, double least_speed) const
{
  return result.converged &&
      drag->misfit(velocity, state.rate, least_speed) <= settings.tolerance;
}

/* Pairs with a gap of zero decide on each other. A power law changes their drag in each round. */
void DiskFlow::relax_ties(const std::vector<double> &parts, double least_speed)
{
  DragSolver::Result result = {};
  for (int round = 0; round < (drag->is_linear() ? 1 : ROUNDS); round++) {
    const DragSolver::Load load = {driven_rate(), area() * settings.stress,
                                   settings.free_rate()};
    const bool rests = drag->relax_marginal_pairs(parts, velocity, load);
    result = find_velocities();
    if (rests && fit(result, least_speed)) return;
    if (!result.converged) std::fill(velocity.begin(), velocity.end(), Vec3());
  }
  if (!result.converged && !(result = find_velocities()).converged) refuse_velocities(result);
  state.unsettled += 1.0;
}

double DiskFlow::strain_after(double time, double step) const
{
  if (!settings.free_rate()) return given_strain(time);
  const Weights times = dense_weights(time, step);
  return times[0] * stages[0].rate + times[1] * stages[1].rate + times[2] * stages[2].rate;
}

void DiskFlow::keep_stage(int s, const Field &u, double strain)
{
  Stage &stage = stages[s];
  stage.velocities.assign(u.begin(), u.begin() + atom->nlocal + atom->nghost);
  for (Vec3 &each : stage.velocities) each = with_lean(each, -strain);
  stage.rate = state.rate;
  stage.stress = stress();
  stage.dissipation = dissipation();
  stage.pushed = pushed();
  stage.thetas = drag->thetas();
}

/* Finds the second and third stage. Returns how far the step is off, over its time. */
double DiskFlow::try_stages(double step)
{
  const int nall = atom->nlocal + atom->nghost;
  const State initial = state;
  Field displacement(nall), u(velocity.begin(), velocity.begin() + nall);
  keep_stage(0, u, 0.0);
  bool converged = true;
  for (int s = 1; s < 3 && converged; s++) {
    const Stage &last = stages[s - 1];
    const double time = NODES[s] * step;
    for (int i = 0; i < nall; i++) displacement[i] = time * last.velocities[i];
    state.time = initial.time;
    const double strain = settings.free_rate() ? time * last.rate : given_strain(time);
    state.time += time;
    drag->displace(displacement, strain);
    for (int i = 0; i < atom->nlocal; i++) {    // along lines through the last step, two stages
      const Vec3 change = s == 1 ? step * acceleration[i] : u[i] - stages[0].velocities[i];
      u[i] = u[i] + EXTRAPOLATION * 0.5 * change;
    }
    std::swap(u, velocity);
    velocity.resize(std::max<std::size_t>(u.size(), nall));
    converged = find_velocities().converged;
    add_up();
    std::swap(u, velocity);
    keep_stage(s, u, strain);
  }
  state = initial;
  if (!converged) return HUGE_VAL;

  const auto &[first, second, third] = stages;
  double off = 0.0;
  for (int i = 0; i < atom->nlocal; i++) {
    const Vec3 &a = first.velocities[i], &b = second.velocities[i], &c = third.velocities[i];
    off += hypot(2.0 * a.x - 6.0 * b.x + 4.0 * c.x, 2.0 * a.y - 6.0 * b.y + 4.0 * c.y) / 9.0;
  }
  off = over_ranks(off, MPI_SUM);
  if (settings.free_rate())
    off += atom->natoms * diameter *
        fabs(2.0 * first.rate - 6.0 * second.rate + 4.0 * third.rate) / 9.0;
  return off;
}

/* Tries shorter and shorter steps, until the error of one is allowed. */
double DiskFlow::choose_step(double allowed)
{
  const double longest = plan.longest;
  double step = state.step > 0.0 ? state.step : FIRST * longest;
  double next, off_before = HUGE_VAL, before = step;
  bool rejected = false, forced = false;
  while (true) {
    step = up_to_end(std::min(step, longest));
    const double off = try_stages(step);
    const double factor = off > 0.0 ? SAFETY * sqrt(allowed / off) : GROWTH;
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
      if (forced || !drag->rubs())
        error->all(FLERR, "{}: {} at time {:.6g}, strain {:.6g}, rate {:.3g} velocities change "
                   "within {:.2g}: {}, or lower the rate", WHO, FLOW_STUCK, state.time,
                   state.strain, state.rate, step, more_background());
      state.unsettled += 1.0;    // it is said, and the flow continues
      forced = true;
      next = FORCED * longest;
    }
    step = next;
  }
  plan.next_step = rejected ? next : std::max(next, state.step);    // if cut short by others
  return step;
}

/* The next step is as long as its error and contacts allow. */
void DiskFlow::make_plan(bigint last)
{
  const double interval = settings.interval;
  plan.longest = longest_step(diameter, PHASE, interval > 0.0 ? interval : HUGE_VAL);
  const double slowest = typical_rate() + STILL / plan.longest;
  const double allowed = STEP_SHARE * settings.tolerance *
      (state.sums.speed + atom->natoms * diameter * slowest);
  plan.step = choose_step(allowed);
  plan.time = up_to_changes(plan.step, finite_size_factor() * allowed);
  plan.made = true;
  set_time_step(plan.time, last);
}

/* Contacts that open or close within the step, and rubbing pairs that part or meet. */
std::vector<DiskDrag::Change> DiskFlow::find_changes(double step) const
{
  const auto displacement = [&](const DiskPair &p, double time, double &x, double &y,
                                double &strain) {
    const Weights times = dense_weights(time, step);
    Vec3 sum;
    for (int s = 0; s < 3; s++)
      sum = sum + times[s] * (stages[s].velocities[p.j] - stages[s].velocities[p.i]);
    x = sum.x;
    y = sum.y;
    strain = strain_after(time, step);
  };
  std::vector<DiskDrag::Change> own, changes;
  drag->find_changes(velocity, state.rate, step, displacement, own);
  std::set<std::pair<tagint, tagint>> known;    // with newton off, two ranks see a pair
  for (const auto &change : gather_records(own, world))
    if (known.insert(std::minmax(change.first, change.second)).second) changes.push_back(change);
  drag->find_exits(velocity, state.rate, stages[0].thetas, stages[2].thetas, NODES[2] * step, step,
                   changes);
  return changes;
}

/* The part of the step after which contacts that should have opened or closed have made an error as
   large as the step may. */
double DiskFlow::up_to_changes(double step, double allowed)
{
  const std::vector<DiskDrag::Change> changes = find_changes(step);
  const auto off = [&](double time) {
    double sum = 0.0;
    for (const auto &change : changes) {
      const double late = std::max(0.0, time - change.time);
      const double part = 0.5 * change.steepness * late;    // of the drag that is wrong; 0: all
      sum += DISTURBED * change.speed * late * (part > 0.0 ? std::min(1.0, part) : 1.0);
    }
    return sum;
  };
  const int halvings = off(step) > allowed * step ? 60 : 0;
  double low = 0.0, high = step;
  for (int n = 0; n < halvings; n++) {
    const double middle = 0.5 * (low + high);
    (off(middle) > allowed * std::max(middle, SHORTEST_SHARE * step) ? high : low) = middle;
  }
  plan.changes.clear();
  for (const auto &change : changes)
    if (change.time < high) plan.changes.push_back(change);
  return high;
}
