// SPDX-License-Identifier: GPL-2.0-or-later

/* Motion: velocities, steps, the box. */

#include "fix_overdamped.h"

#include "atom.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "image_offset.h"
#include "modify.h"
#include "neighbor.h"
#include "output.h"
#include "timer.h"
#include "update.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

using namespace LAMMPS_NS;

static constexpr char WHO[] = "Fix overdamped";

static constexpr double STABLE = 2.0;    // step over the least relaxation time; it diverges at 2.5
static constexpr double TRAVEL = 0.03;    // of the fastest disk in a step, beside the flow, mean diameters
static constexpr double REACH = 0.2;    // of the skin of the neighbor list: travel of a disk in a step
static constexpr double STRAIN = 0.02;      // that the box may lean in a step
static constexpr double PHASE = 0.2;        // of an oscillation that may pass in a step
static constexpr double GROWTH = 1.5, SHRINKAGE = 0.3, SAFETY = 0.9;
static constexpr double FINE = 1e-6;    // tolerance; below, the shortest step shrinks as the root of it
static constexpr double DROPLET_FIRST = 1e-6;    // over the longest, which knows of no relaxation
static constexpr double DROPLET_SHORTEST = 1e-2;    // over tau
static constexpr double DROPLET_STILL = 1e-11;    // over tau: a velocity whose error is rounding
static constexpr double STUCK = 1e-7;       // step over the stable one at which a run is given up
static constexpr double LEAN = 0.55;    // tilt over width where the box flips; above 1/2: not to flip back

double FixOverdamped::area() const
{
  return domain->xprd * domain->yprd;
}

double FixOverdamped::time_unit() const
{
  return droplet_law.tau > 0.0 ? droplet_law.tau : 1.0;
}

double FixOverdamped::driven_rate() const
{
  return drive == RATE ? wanted_rate : drive == OSCILLATE ? amplitude * omega * cos(omega * state.time) : state.rate;
}

void FixOverdamped::setup(int /*vflag*/)
{
  if (last_timestep >= 0 && last_timestep != update->ntimestep) forget_velocities();
  for (int i = 0; i < atom->nlocal; i++) std::fill_n(atom->v[i], 3, 0.0);    // massless
  if (state.end <= state.time) end_interval();
  if (!droplets) {
    start_disks();
    plan_disks();
    return;
  }
  solver->update_contacts(atom->nlocal, atom->nghost, 0.0);
  start_droplets();
  const State last = state;
  add_up();
  const double energy = state.sums.energy, elastic = state.sums.elastic;    // of these positions
  if (state.step > 0.0) state = last;    // of contacts before the positions were corrected
  state.sums.energy = energy;
  state.sums.elastic = elastic;
  if (state.step == 0.0) state.step = DROPLET_FIRST * longest_step();
  set_time_step(up_to_end(std::min(state.step, longest_step())));
}

/* something else has moved the particles since, such as a minimisation */
void FixOverdamped::forget_velocities()
{
  for (Field *each : fields()) std::fill(each->begin(), each->end(), Vec3());
  state.step = state.last_step = state.step_before = 0.0;
}

/* particles and box to the end of the step */
void FixOverdamped::initial_integrate(int /*vflag*/)
{
  if (!droplets && !plan.made) {    // of `run ... pre no` after an interval, as if before this step
    update->ntimestep--;
    plan_disks();
    update->ntimestep++;
  }
  const double dt = update->dt, strain_step = droplets ? next_strain_step(dt) : plan.strain;
  at_start = state;
  if (droplets)
    predict_droplets(dt, strain_step);
  else
    move_disks();
  const double rate = state.rate;
  if (droplets && drive == STRESS && state.last_step > 0.0)
    state.rate += dt / state.last_step * (rate - state.rate_before);
  state.rate_before = rate;
  state.last_step = dt;
  state.strain_step = strain_step;
  state.strain += strain_step;
  state.time += dt;
  if (interval > 0.0 && fabs(state.end - state.time) < 1e-9 * dt) state.time = state.end;
  state.rate = driven_rate();
  lean(strain_step);
  double farthest = 0.0;
  const Field &moves = droplets ? displacement : plan.displacement;
  for (int i = 0; i < atom->nlocal; i++) farthest = std::max(farthest, hypot(moves[i].x, moves[i].y));
  keep_neighbors(farthest, strain_step);
}

/* Particles that come to touch must be in the neighbor list, whatever neigh_modify says. Half the skin
   is for the corrections of droplets, which come after */
void FixOverdamped::keep_neighbors(double farthest, double strain)
{
  MPI_Allreduce(MPI_IN_PLACE, &farthest, 1, MPI_DOUBLE, MPI_MAX, world);
  if (neighbor->ago == 0) approached = 0.0;
  approached += 2.0 * farthest + fabs(strain) * neighbor->cutneighmax;
  if (approached > 0.5 * neighbor->skin) next_reneighbor = update->ntimestep;
}

void FixOverdamped::end_interval()
{
  if (interval > 0.0) state.end = (floor(state.time / interval + 1e-9) + 1.0) * interval;
}

double FixOverdamped::next_strain_step(double dt) const
{
  if (drive == RATE) return wanted_rate * dt;
  if (drive == OSCILLATE) return amplitude * (sin(omega * (state.time + dt)) - sin(omega * state.time));
  return droplet_strain_step(dt);
}

void FixOverdamped::lean(double strain)
{
  domain->xy += strain * domain->yprd;
  domain->set_global_box();
  domain->set_local_box();
  if (fabs(domain->xy) > LEAN * domain->xprd) {
    flip = domain->xy > 0.0 ? -1 : 1;
    next_reneighbor = update->ntimestep;
  }
}

/* image flags begin anew after IMGMAX boxes: half way there, whole particles go back to the box */
void FixOverdamped::move_back()
{
  const tagint *const particle = droplets ? atom->molecule : atom->tag;
  tagint most[2] = {0, 0};    // boxes, particles
  for (int i = 0; i < atom->nlocal; i++) {
    const ImageOffset own(atom->image[i]);
    most[0] = std::max<tagint>(most[0], std::max(std::abs(own.a), std::abs(own.b)));
    most[1] = std::max(most[1], particle[i]);
  }
  MPI_Allreduce(MPI_IN_PLACE, most, 2, MPI_LMP_TAGINT, MPI_MAX, world);
  if (most[0] < IMGMAX / 2) return;
  std::vector<std::array<int, 2>> least(most[1] + 1, {IMGMAX, IMGMAX});
  for (int i = 0; i < atom->nlocal; i++) {
    auto &[x, y] = least[particle[i]];
    const ImageOffset own(atom->image[i]);
    x = std::min(x, own.a);
    y = std::min(y, own.b);
  }
  MPI_Allreduce(MPI_IN_PLACE, least.data(), static_cast<int>(2 * least.size()), MPI_INT, MPI_MIN, world);
  for (int i = 0; i < atom->nlocal; i++) {
    const auto [x, y] = least[particle[i]];
    atom->image[i] -= static_cast<imageint>(x) + static_cast<imageint>(y) * (static_cast<imageint>(1) << IMGBITS);
  }
}

/* the same lattice with another vector along y */
void FixOverdamped::pre_exchange()
{
  move_back();
  if (!flip) return;
  domain->xy += flip * domain->xprd;
  domain->set_global_box();
  domain->set_local_box();
  domain->image_flip(flip, 0, 0);
  for (int i = 0; i < atom->nlocal; i++) domain->remap(atom->x[i], atom->image[i]);
  flip = 0;
}

void FixOverdamped::final_integrate()
{
  const bool ended = interval > 0.0 && state.time == state.end;
  if (droplets) {
    const Field predicted(velocity.begin(), velocity.begin() + atom->nlocal);
    const double stress_before = stress(), dissipation_before = dissipation(), rate = state.rate;
    const double energy_before = state.sums.energy;
    solver->update_contacts(atom->nlocal, atom->nghost, implicit_time);
    if (!correct_droplets(predicted, rate, find_velocities())) {
      step_back();
      return;
    }
    add_up();
    const double work = 0.5 * state.strain_step * (stress_before + stress());
    const double dissipated = 0.5 * state.last_step * (dissipation_before + dissipation());
    const double gap = work - dissipated - (state.sums.energy - energy_before) / area();
    if (!balances(gap, dissipation_before)) {
      step_back();
      return;
    }
    state.work += work;
    state.dissipated += dissipated;
    state.gap += gap;
    adapt_step();
    set_time_step(up_to_end(std::min(state.step, longest_step())));
  } else {
    start_disks();
    plan.made = false;
    if (!ended) plan_disks();    // a run that resumes here plans anew
  }
  if (!ended) return;
  end_interval();
  stopped = true;
  timer->force_timeout();
}

void FixOverdamped::post_run()
{
  if (update->whichflag == 1) last_timestep = update->ntimestep;    // of a run alone
  if (stopped) timer->reset_timeout();
  stopped = false;
}

/* of this moment */
DragSolver::Result FixOverdamped::find_velocities(bool with_forces)
{
  if (with_forces)
    solver->elastic_forces(forces);
  else
    forces.assign(atom->nlocal, Vec3());
  state.rate = driven_rate();
  hold_fixed();
  DragSolver::Load load = {state.rate, 0.0, drive == STRESS};
  if (load.free_rate) load.moment = area() * wanted_stress - solver->elastic_moment();
  const DragSolver::Result result = solver->solve(forces, velocity, load);
  last_iterations = result.iterations;
  state.iterations += result.iterations;
  state.rate = load.rate;
  if (settings.background == 0.0 && !fixed_bit) remove_drift();
  return result;
}

void FixOverdamped::refuse(const DragSolver::Result &result) const
{
  if (droplets)
    error->all(FLERR, "{}: {} at time {:.6g}, strain {:.6g} droplets slip past each other, and steps of {:.2g} are "
               "still too long: {}", WHO, FLOW_SLIPS, state.time, state.strain, state.last_step, more_background());
  const std::string left = std::isfinite(result.residual) ? fmt::format("a residual of {:.3g}", result.residual)
                                                          : std::string("no finite residual");
  error->all(FLERR,
             "{}: {} the drag is nearly singular at time {:.6g}, strain {:.6g}: {} is left after {} iterations: {}, "
             "or a looser solver tolerance",
             WHO, FLOW_SINGULAR, state.time, state.strain, left, result.iterations, more_background());
}

std::string FixOverdamped::more_background() const
{
  return fmt::format("the background drag is {:g}; give 1e-2 k tau, or, of that or more, ten times as much",
                     settings.background);
}

/* contact drag leaves all that touches free to drift as a whole; what touches nothing stays with
   the affine flow */
void FixOverdamped::remove_drift()
{
  double sums[3] = {0.0, 0.0, 0.0};
  for (int i = 0; i < atom->nlocal; i++) {
    if (!solver->touched(i)) continue;
    sums[0] += velocity[i].x;
    sums[1] += velocity[i].y;
    sums[2] += 1.0;
  }
  MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE, MPI_SUM, world);
  for (int i = 0; i < atom->nlocal; i++) {
    if (!solver->touched(i)) continue;
    velocity[i].x -= sums[0] / sums[2];
    velocity[i].y -= sums[1] / sums[2];
  }
  send_to_ghosts(velocity);
}

/* height of the edge of the box next to an atom, above it */
double FixOverdamped::to_edge(int i) const
{
  const double y = atom->x[i][1] - domain->boxlo[1];
  return round(y / domain->yprd) * domain->yprd - y;
}

/* what does not move follows the box, a wall as a whole with the edge next to it */
void FixOverdamped::hold_fixed()
{
  if (!fixed_bit) return;
  std::vector<char> given(atom->nlocal, 0);
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & fixed_bit)) continue;
    given[i] = 1;
    velocity[i] = {walls ? state.rate * to_edge(i) : 0.0, 0.0, 0.0};
  }
  solver->hold(given);
}

/* forces on walls, which do work beside that of the stress of an affine flow */
void FixOverdamped::add_walls()
{
  Field elastic, net;
  solver->elastic_forces(elastic);
  solver->net_forces(elastic, velocity, state.rate, net);
  double found[6] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & fixed_bit)) continue;
    const double offset = walls ? to_edge(i) : 0.0;
    found[0] -= elastic[i].x * offset;
    found[1] -= (net[i].x - elastic[i].x) * offset;
    double *const wall = found + (offset < 0.0 ? 2 : 4);
    wall[0] += net[i].x;
    wall[1] += net[i].y;
  }
  MPI_Allreduce(MPI_IN_PLACE, found, 6, MPI_DOUBLE, MPI_SUM, world);
  state.sums.elastic += found[0];
  state.sums.viscous += found[1];
  std::copy_n(found + 2, 4, state.sums.walls);
}

void FixOverdamped::add_up()
{
  state.sums = solver->add_up(velocity, state.rate);
  if (fixed_bit) add_walls();
  state.sums.viscous += settings.fluid * state.rate;
  state.sums.dissipation += settings.fluid * state.rate * state.rate;
}

/* step of droplets that keeps the error at the tolerance, which goes as the square of the step */
void FixOverdamped::adapt_step()
{
  double off = droplet_error();
  MPI_Allreduce(MPI_IN_PLACE, &off, 1, MPI_DOUBLE, MPI_SUM, world);
  const double longest = longest_step();
  off /= state.sums.speed + atom->natoms * (typical_rate() + DROPLET_STILL / time_unit());
  const double factor = off > 0.0 ? SAFETY * sqrt(tolerance / off) : GROWTH;
  const double floor = DROPLET_SHORTEST * std::min(time_unit(), longest);
  const double least = std::min(floor * std::min(1.0, sqrt(tolerance / FINE)), state.last_step * GROWTH);
  state.step = std::max(state.last_step * std::clamp(factor, SHRINKAGE, GROWTH), least);
}

double FixOverdamped::longest_step() const
{
  double relaxation = solver->least_relaxation_time(), fastest = 0.0;
  for (int i = 0; i < atom->nlocal; i++)
    fastest = std::max(fastest, velocity[i].x * velocity[i].x + velocity[i].y * velocity[i].y);
  MPI_Allreduce(MPI_IN_PLACE, &relaxation, 1, MPI_DOUBLE, MPI_MIN, world);
  MPI_Allreduce(MPI_IN_PLACE, &fastest, 1, MPI_DOUBLE, MPI_MAX, world);
  fastest = sqrt(fastest);

  double least = HUGE_VAL;
  if (std::isfinite(relaxation)) least = STABLE * relaxation;
  const double stable = least;
  if (fastest > 0.0) least = std::min(least, std::min(TRAVEL * length_unit, REACH * neighbor->skin) / fastest);
  if (typical_rate() > 0.0) least = std::min(least, STRAIN / typical_rate());
  if (drive == OSCILLATE)
    least = std::min(least, (droplets ? 0.5 : 1.0) * PHASE / omega);    // their work is a trapezoid
  if (!std::isfinite(least) && (droplets || interval > 0.0)) least = droplets ? time_unit() : interval;    // all rests
  if (longest > 0.0) least = std::min(least, longest);
  if (!std::isfinite(least))
    error->all(FLERR, "{}: nothing touches and nothing moves: give the longest step, as longest value", WHO);
  const double flow = typical_rate() > 0.0 ? STRAIN / typical_rate() : HUGE_VAL;
  if (std::isfinite(stable) && least < STUCK * std::min(stable, flow) && (longest == 0.0 || least < longest))
    error->all(FLERR, "{}: {} at time {:.6g}, strain {:.6g}, rate {:.3g} the fastest one moves at {:.3g} beside "
               "the flow, and steps of {:.2g} lead nowhere: {}, or lower the rate", WHO, FLOW_STUCK, state.time,
               state.strain, state.rate, fastest, least, more_background());
  return least;
}

/* of a step: it, or half of it, ends where the interval does */
double FixOverdamped::up_to_end(double step) const
{
  const double left = state.end - state.time;
  if (interval > 0.0 && left > 0.0 && left < 2.0 * step) return left <= step ? left : 0.5 * left;
  return step;
}

void FixOverdamped::set_time_step(double dt)
{
  update->update_time();
  update->dt = dt;
  output->reset_dt();    // of dumps that are written at given times
}
