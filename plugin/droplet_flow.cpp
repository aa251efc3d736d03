// SPDX-License-Identifier: GPL-2.0-or-later
#include "droplet_flow.h"

#include "droplet_drag.h"
#include "error.h"
#include "force.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr double GROWTH = 1.5, SHRINKAGE = 0.3, SAFETY = 0.9;
static constexpr double FINE = 1e-6;     // tolerance, below which the least step goes as its root
static constexpr double FIRST = 1e-6;    // over the longest, which knows of no relaxation
static constexpr double LEAST = 1e-2;    // step over tau to which errors may shorten one
static constexpr double SHORTEST = 1e-7;    // step over tau at which a run is given up
static constexpr double STILL = 1e-11;      // over tau: a velocity whose error is rounding
static constexpr double PHASE = 0.1;    // of an oscillation in a step: its work is a trapezoid
static constexpr double FARTHEST = 0.005;    // over the size of a droplet: from its prediction to
                                             // where forces take a vertex
static constexpr double RETRY = 0.25;        // step over one that was too long
// Rises of a stress over the last one that went too far or not, and the least one over all of it
static constexpr double LESS_LOAD = 0.25, MORE_LOAD = 2.0, LEAST_LOAD = 1e-3;
static constexpr double STRAIN = 0.02, BALANCE = 0.05, OVERALL = 0.2, STRICTEST = 0.1,
                        ROUNDING = 1e-13;    // see `balances`

std::unique_ptr<DragSolver> DropletFlow::make_solver()
{
  if (!force->pair_match("circuloline", 1))
    error->all(FLERR, "{}: needs pair_style circuloline, with which it began", WHO);
  const DragLaw &law = settings.droplet_law;
  if (law.tau == 0.0 && settings.solver.background == 0.0)
    error->all(FLERR, "{}: no drag at all: give drag tau beta alpha with a tau that is not 0, or a "
               "background drag", WHO);
  auto found = std::make_unique<DropletDrag>(lmp, exchange, settings.solver, law);
  drag = found.get();
  return found;
}

void DropletFlow::keep(RestartBytes &bytes)
{
  OverdampedFlow::keep(bytes);
  bytes(last);
  bytes(load);
  bytes(lost);
}

/* Without contact drag, the background drag on a droplet relaxes against its contacts. */
void DropletFlow::find_scales()
{
  const auto [length, energy] = drag->scales();
  size = length;
  energy_unit = energy;
  time_unit = settings.droplet_law.tau;
  if (time_unit == 0.0) time_unit = settings.solver.background * size * size / energy;
}

bool DropletFlow::Load::rises() const
{
  return fabs(rise) > LEAST_LOAD * fabs(whole);
}

/* A guess of the rate under a stress, from rest: the drag of a power law has no bound there. */
double DropletFlow::first_rate() const
{
  if (settings.droplet_law.alpha == 1.0) return 0.0;
  return load.rise * size * size / (energy_unit * time_unit);
}

/* A run that resumes has its velocities. A flow begins with velocities that the drag alone allows:
   forces, which vertices without drag cannot stand, act from the first step on. */
void DropletFlow::setup()
{
  update_contacts(0.0);
  find_scales();
  const bool begins = state.step == 0.0;
  if (begins) last = Last();
  if (!begins || settings.free_rate())
    solver->set_solution(velocity, state.rate);
  else if (const DragSolver::Result result = find_velocities(false); !result.converged)
    refuse_velocities(result);
  FlowSums sums = state.sums;
  add_up();
  if (!begins) {    // drag is that of contacts before the positions were corrected
    sums.energy = state.sums.energy;
    sums.elastic = state.sums.elastic;
    state.sums = sums;
  }
  if (begins && settings.free_rate())
    load = {stress(), settings.stress - stress(), settings.stress - stress()};
  const double longest = longest_step(size, PHASE, time_unit);
  if (begins) state.step = FIRST * longest;
  set_time_step(up_to_end(std::min(state.step, longest)));
}

/* Vertices and box go where the mean velocity of two steps leads. */
void DropletFlow::begin_step()
{
  const bool free_rate = settings.free_rate();
  const double dt = update->dt, ratio = last.time > 0.0 ? dt / last.time : 0.0;
  const double again = ratio * ratio / (1.0 + 2.0 * ratio);    // part of the last displacement
  const double per_time = last.time > 0.0 ? 1.0 / (last.time + last.time_before) : 0.0;
  const double rate = state.rate;
  const double rate_ahead = free_rate && last.time == 0.0 && rate == 0.0
      ? first_rate() : rate + ratio * (rate - last.rate_before);
  implicit_time = dt * (1.0 + ratio) / (1.0 + 2.0 * ratio);
  const double strain =
      free_rate ? again * last.strain + implicit_time * rate_ahead : given_strain(dt);
  double farthest = 0.0;
  initial = state;
  for (int i = 0; i < atom->nlocal; i++) {
    const Vec3 v = velocity[i], m = displacement[i], w = last_displacement[i];
    Vec3 both = m + w;
    both.x += last.strain * w.y;    // as the box leans now
    const Vec3 u = per_time > 0.0 ? per_time * both : v;
    double dx = again * m.x + implicit_time * u.x;
    if (rides(i)) dx = strain * to_edge(i);    // exactly, or walls would lose their shape
    const double dy = again * m.y + implicit_time * u.y;
    move(i, dx, dy, strain);
    last_velocity[i] = v;
    velocity[i] = with_lean(u, strain);
    last_displacement[i] = m;
    displacement[i] = with_lean({dx, dy, 0.0}, strain);
    farthest = std::max(farthest, hypot(displacement[i].x, displacement[i].y));
  }
  if (free_rate) state.rate = rate_ahead;
  last = {dt, last.time, strain, rate};
  advance(strain, farthest);
}

void DropletFlow::end_step()
{
  const int n = atom->nlocal;
  const double stress_before = stress(), dissipation_before = dissipation();
  const double energy_before = state.sums.energy, rate_before = state.rate;
  Field change(velocity.begin(), velocity.begin() + n);
  update_contacts(implicit_time);
  const bool converged = find_velocities().converged;
  double farthest = 0.0;
  for (int i = 0; i < n; i++) {
    change[i] = implicit_time * (velocity[i] - change[i]);
    farthest = std::max(farthest, hypot(change[i].x, change[i].y));
  }
  farthest = over_ranks(farthest, MPI_MAX);
  if (!converged || farthest > FARTHEST * size) return step_back();
  approached += 2.0 * farthest;
  correct(change, settings.free_rate() ? implicit_time * (state.rate - rate_before) : 0.0);
  add_up();
  const double work = 0.5 * last.strain * (stress_before + stress()) + pushed_work();
  const double dissipated = 0.5 * last.time * (dissipation_before + dissipation());
  const double gap = work - dissipated - (state.sums.energy - energy_before) / area();
  if (!balances(gap, dissipation_before)) return step_back();
  state.work += work;
  state.dissipated += dissipated;
  lost += gap;
  if (settings.free_rate()) {
    load.held += load.rise;
    const double rest = settings.stress - load.held;
    load.rise = std::copysign(std::min(MORE_LOAD * fabs(load.rise), fabs(rest)), rest);
  }
  adapt_step();
}

/* Of body forces, per area: what the affine flow carries does not count. */
double DropletFlow::pushed_work() const
{
  Field beside(displacement.begin(), displacement.begin() + atom->nlocal);
  for (Vec3 &each : beside) each = with_lean(each, -0.5 * last.strain);
  return over_ranks(solver->body_work(beside), MPI_SUM) / area();
}

/* Vertices go from where the prediction went to where the velocities lead; the box too, if its rate
   was free. */
void DropletFlow::correct(const Field &change, double strain)
{
  for (int i = 0; i < atom->nlocal; i++) {
    const Vec3 more = rides(i) ? Vec3{strain * to_edge(i), 0.0, 0.0} : change[i];
    move(i, more.x, more.y, 0.0);
    move(i, 0.0, 0.0, strain);
    displacement[i] = with_lean(displacement[i] + more, strain);
  }
  last.strain += strain;
  state.strain += strain;
  if (strain != 0.0) lean(strain);
}

/* Whether a step loses little enough energy per area: a part of the tolerance of what goes into a
   box that leans by STRAIN, by the lower power of both ends, since one may be a burst; with body
   forces, also of what would dissipate in free fall, since what comes to rest has no power. The
   part is less, the more of what all steps may lose is lost. Rounding of the sum of energies and
   shortest steps at a constant stress always pass. */
bool DropletFlow::balances(double gap, double dissipation_before) const
{
  const double time = typical_rate() > 0.0 ? STRAIN / typical_rate() : time_unit;
  const double least = std::min(dissipation_before, dissipation());
  const double power = std::max(fabs(stress() * state.rate), least);
  const double together =
      OVERALL * settings.tolerance * std::max(fabs(state.work), state.dissipated);
  const double left = gap * lost > 0.0 ? std::max(STRICTEST, 1.0 - fabs(lost) / together) : 1.0;
  const double rounding = ROUNDING * fabs(state.sums.energy) / area();
  const double allowed = time * power + time_unit * state.sums.fall / area();
  return fabs(gap) <= left * BALANCE * settings.tolerance * allowed + rounding ||
      (last.time <= SHORTEST * time_unit && !load.rises());
}

/* The flow goes back to the start of the step, from which a shorter one begins without history. The
   response of droplets to a stress may be elastic, at once, and larger than a step: then the stress
   rises in parts. */
void DropletFlow::step_back()
{
  double step = RETRY * last.time;
  if (last.time < SHORTEST * time_unit) {
    if (!load.rises()) refuse();
    load.rise *= LESS_LOAD;
    step = FIRST * time_unit;
  }
  for (int i = 0; i < atom->nlocal; i++) {
    move(i, -displacement[i].x, -displacement[i].y, -last.strain);
    velocity[i] = last_velocity[i];
    displacement[i] = last_displacement[i] = Vec3();
  }
  lean(-last.strain);
  state = initial;
  state.step = step;
  last = Last();
  set_time_step(state.step);
}

void DropletFlow::refuse() const
{
  error->all(FLERR, "{}: {} at time {:.6g}, strain {:.6g} droplets slip past each other, and steps "
             "of {:.2g} are still too long: {}", WHO, FLOW_SLIPS, state.time, state.strain,
             last.time, more_background());
}

/* The next step keeps the error at the tolerance, which goes as the square of the step. The error
   is the sum over vertices of how far the last step is off, over its time: displacements differ
   from the mean velocity of both ends by dt^2 u''/12, those of backward differences from exact ones
   by 2/9. */
void DropletFlow::adapt_step()
{
  double off = 0.0;
  const double dt = last.time, leaned = last.strain;
  for (int i = 0; i < atom->nlocal; i++) {
    const Vec3 &u = velocity[i], &v = last_velocity[i], &m = displacement[i];
    off += hypot(m.x / dt - 0.5 * (u.x + v.x + leaned * v.y), m.y / dt - 0.5 * (u.y + v.y));
  }
  off = over_ranks(8.0 / 3.0 * off, MPI_SUM);
  off /= state.sums.speed + atom->natoms * size * (typical_rate() + STILL / time_unit);
  const double longest = longest_step(size, PHASE, time_unit), tolerance = settings.tolerance;
  const double factor = off > 0.0 ? SAFETY * sqrt(tolerance / off) : GROWTH;
  const double floor = LEAST * std::min(time_unit, longest);
  const double least = std::min(floor * std::min(1.0, sqrt(tolerance / FINE)), dt * GROWTH);
  state.step = std::max(dt * std::clamp(factor, SHRINKAGE, GROWTH), least);
  set_time_step(up_to_end(std::min(state.step, longest)));
}
