// SPDX-License-Identifier: GPL-2.0-or-later
#include "overdamped_flow.h"

#include "error.h"
#include "output.h"
#include "vector_bytes.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr double STABLE = 2.0;    // step over the least relaxation time; it diverges at 2.5
static constexpr double TRAVEL = 0.03;    // of the fastest particle in a step, beside the flow
static constexpr double REACH = 0.2;      // the same over the skin of the neighbor list
static constexpr double STRAIN = 0.02;    // that the box may lean in a step
static constexpr double STUCK = 1e-7;     // step over the stable one at which a run is given up

void OverdampedFlow::init(const std::vector<Fix *> &pushes)
{
  bodies.init(pushes);
  if (!bodies.empty() && settings.solver.background == 0.0)
    error->all(FLERR, "{}: fix {} pushes particles, and nothing resists those that touch nothing: "
               "give a background drag", WHO, bodies.first());
  settings.solver.fluid = settings.fluid * area();
  solver = make_solver();
}

/* What is held does not move by them. */
void OverdampedFlow::find_body_forces()
{
  if (bodies.empty()) return;
  bodies.measure();
  Field on_free = bodies.applied();
  for (int i = 0; i < atom->nlocal; i++)
    if (atom->mask[i] & settings.fixed_bit) on_free[i] = Vec3();
  solver->set_body_forces(bodies.applied(), on_free);
}

void OverdampedFlow::keep(RestartBytes &bytes)
{
  bytes(state);
  bytes(iterations);
}

void OverdampedFlow::forget_velocities()
{
  for (Field *each : fields()) std::fill(each->begin(), each->end(), Vec3());
  state.step = 0.0;
}

double OverdampedFlow::driven_rate() const
{
  if (settings.drive == FlowSettings::RATE) return settings.rate;
  if (settings.free_rate()) return state.rate;
  return settings.amplitude * settings.omega * cos(settings.omega * state.time);
}

double OverdampedFlow::typical_rate() const
{
  const bool oscillates = settings.drive == FlowSettings::OSCILLATE;
  return oscillates ? settings.amplitude * settings.omega : fabs(state.rate);
}

double OverdampedFlow::given_strain(double time) const
{
  if (settings.drive == FlowSettings::RATE) return settings.rate * time;
  const double omega = settings.omega;
  return settings.amplitude * (sin(omega * (state.time + time)) - sin(omega * state.time));
}

double OverdampedFlow::over_ranks(double value, MPI_Op operation) const
{
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, operation, world);
  return value;
}

/* The atom moves beside the flow, and then with it. */
void OverdampedFlow::move(int i, double dx, double dy, double strain)
{
  double *const x = atom->x[i];
  x[1] += dy;
  x[0] += dx + strain * (x[1] - domain->boxlo[1]);
}

void OverdampedFlow::lean(double strain)
{
  domain->xy += strain * domain->yprd;
  domain->set_global_box();
  domain->set_local_box();
}

void OverdampedFlow::advance(double strain, double farthest)
{
  const double dt = update->dt;
  state.strain += strain;
  state.time += dt;
  if (settings.interval > 0.0 && fabs(state.end - state.time) < 1e-9 * dt) state.time = state.end;
  state.rate = driven_rate();
  lean(strain);
  if (neighbor->ago == 0) approached = 0.0;
  approached += 2.0 * over_ranks(farthest, MPI_MAX) + fabs(strain) * neighbor->cutneighmax;
}

bool OverdampedFlow::begin_interval()
{
  if (!interval_ended()) return false;
  state.end = (floor(state.time / settings.interval + 1e-9) + 1.0) * settings.interval;
  return true;
}

/* A step, or two of half the length, end where the interval does. */
double OverdampedFlow::up_to_end(double step) const
{
  const double left = state.end - state.time;
  if (settings.interval > 0.0 && left > 0.0 && left < 2.0 * step)
    return left <= step ? left : 0.5 * left;
  return step;
}

/* LAMMPS takes its present step for the last one. In a run without setup that is the next one. */
void OverdampedFlow::set_time_step(double dt, bigint last)
{
  struct Present {
    bigint &step, present;
    ~Present() { step = present; }
  } const present = {update->ntimestep, update->ntimestep};
  update->ntimestep = last;
  update->update_time();
  update->dt = dt;
  output->reset_dt();    // of dumps that are written at given times
}

void OverdampedFlow::update_contacts(double ahead)
{
  solver->update_contacts(atom->nlocal, atom->nghost, ahead);
  hold_fixed();
}

DragSolver::Result OverdampedFlow::find_velocities(bool with_forces)
{
  if (with_forces)
    solver->driving_forces(forces);
  else
    forces.assign(atom->nlocal, Vec3());
  state.rate = driven_rate();
  hold_fixed();
  DragSolver::Load load = {state.rate, 0.0, settings.free_rate()};
  if (load.free_rate) load.moment = area() * held_stress() - solver->driven_moment(forces);
  const DragSolver::Result result = solver->solve(forces, velocity, load);
  if (load.free_rate && !solver->resists_rate())
    error->all(FLERR, "{}: {} nothing resists a shear rate under a stress at time {:.6g}, strain "
               "{:.6g}: give a fluid with a viscosity, or drag of contacts that touch", WHO,
               FLOW_SINGULAR, state.time, state.strain);
  last_iterations = result.iterations;
  iterations += result.iterations;
  state.rate = load.rate;
  if (settings.solver.background == 0.0 && !settings.fixed_bit) remove_drift();
  return result;
}

void OverdampedFlow::refuse_velocities(const DragSolver::Result &result) const
{
  error->all(FLERR, "{}: {} the drag is nearly singular at time {:.6g}, strain {:.6g}: a residual "
             "of {:.3g} is left after {} iterations: {}, or a looser solver tolerance, or "
             "more iterations", WHO,
             FLOW_SINGULAR, state.time, state.strain, result.residual, result.iterations,
             more_background());
}

std::string OverdampedFlow::more_background() const
{
  return fmt::format("the background drag is {:g} in units of LAMMPS: give ten times as much, and "
                     "at least 1e-2 k tau", settings.solver.background);
}

/* Contact drag leaves all that touches free to drift as a whole. What touches nothing stays with
   the affine flow. */
void OverdampedFlow::remove_drift()
{
  double sums[3] = {0.0, 0.0, 0.0};
  for (int i = 0; i < atom->nlocal; i++) {
    if (!solver->touched(i)) continue;
    sums[0] += velocity[i].x;
    sums[1] += velocity[i].y;
    sums[2] += 1.0;
  }
  MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE, MPI_SUM, world);
  const Vec3 drift = {sums[0] / sums[2], sums[1] / sums[2], 0.0};
  for (int i = 0; i < atom->nlocal; i++)
    if (solver->touched(i)) velocity[i] = velocity[i] - drift;
  exchange.send_to_ghosts(velocity);
}

double OverdampedFlow::edge(int i) const
{
  return round((atom->x[i][1] - domain->boxlo[1]) / domain->yprd) * domain->yprd;
}

/* A droplet moves as a whole: no bond leaves the group, or leads from one wall to the other. */
void OverdampedFlow::check_held() const
{
  if (!settings.fixed_bit) return;
  const char *const name = settings.walls ? "walls" : "fixed";
  double held = 0.0, cut = 0.0;
  for (int i = 0; i < atom->nlocal; i++) held += atom->mask[i] & settings.fixed_bit ? 1.0 : 0.0;
  if (over_ranks(held, MPI_SUM) == 0.0)
    error->all(FLERR, "{}: {}: the group has no atoms", WHO, name);
  // LAMMPS of 2023 does not set the number where atoms have no bonds
  const int bonds = atom->molecular == Atom::ATOMIC ? 0 : neighbor->nbondlist;
  for (int n = 0; n < bonds; n++) {
    const int i = neighbor->bondlist[n][0], j = neighbor->bondlist[n][1];
    const bool first = atom->mask[i] & settings.fixed_bit;
    const bool second = atom->mask[j] & settings.fixed_bit;
    const bool torn = settings.walls && first && edge(i) != edge(j);
    if (first != second || torn) cut = std::max(cut, static_cast<double>(atom->tag[i]));
  }
  cut = over_ranks(cut, MPI_MAX);
  if (cut > 0.0)
    error->all(FLERR, "{}: {}: the droplet of atom {:.0f} is held in part, or lies between both "
               "walls: give whole droplets{}", WHO, name, cut,
               settings.walls ? " near the lower or the upper edge of the box" : "");
}

bool OverdampedFlow::rides(int i) const
{
  return settings.walls && settings.drive != FlowSettings::RATE &&
      (atom->mask[i] & settings.fixed_bit);
}

/* What does not move follows the box; a wall follows the edge next to it as a whole. */
void OverdampedFlow::hold_fixed()
{
  if (!settings.fixed_bit) return;
  std::vector<char> given(atom->nlocal, 0);
  Field per_rate;    // of walls under a stress
  if (settings.walls && settings.free_rate()) per_rate.resize(atom->nlocal + atom->nghost);
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & settings.fixed_bit)) continue;
    given[i] = 1;
    velocity[i] = {settings.walls ? state.rate * to_edge(i) : 0.0, 0.0, 0.0};
    if (!per_rate.empty()) per_rate[i] = {to_edge(i), 0.0, 0.0};
  }
  solver->hold(given, per_rate);
}

/* Forces on walls do work beside the stress of an affine flow. Other fixed droplets keep
   their areas while the box is compressed, so that drag on them does another work. */
void OverdampedFlow::add_walls()
{
  Field elastic, net;
  solver->elastic_forces(elastic);
  solver->net_forces(elastic, velocity, state.rate, net);
  Field drag(atom->nlocal);
  double found[7] = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & settings.fixed_bit)) continue;
    drag[i] = net[i] - elastic[i];
    const double offset = settings.walls ? to_edge(i) : 0.0;
    found[0] -= elastic[i].x * offset;
    found[1] -= drag[i].x * offset;
    double *const wall = found + (offset < 0.0 ? 2 : 4);
    wall[0] += net[i].x;
    wall[1] += net[i].y;
  }
  if (!settings.walls) found[6] = 0.5 * solver->moment_of_kept(drag);
  MPI_Allreduce(MPI_IN_PLACE, found, 7, MPI_DOUBLE, MPI_SUM, world);
  state.sums.elastic += found[0];
  state.sums.viscous += found[1];
  state.sums.xx += found[6];
  state.sums.yy += found[6];
  std::copy_n(found + 2, 4, state.sums.walls);
}

void OverdampedFlow::add_up()
{
  const double fluid = settings.solver.fluid;
  state.sums = solver->add_up(velocity, state.rate);
  if (settings.fixed_bit) add_walls();
  state.sums.viscous += fluid * state.rate;
  state.sums.dissipation += fluid * state.rate * state.rate;
}

/* Of body forces against the background drag alone: a mean over disks, or over vertices. */
double OverdampedFlow::falling_speed() const
{
  return sqrt(state.sums.fall / (settings.solver.background * atom->natoms));
}

double OverdampedFlow::longest_step(double length, double phase, double rest) const
{
  double fastest = 0.0;
  for (int i = 0; i < atom->nlocal; i++)
    fastest = std::max(fastest, velocity[i].x * velocity[i].x + velocity[i].y * velocity[i].y);
  fastest = sqrt(over_ranks(fastest, MPI_MAX));
  const double stable = STABLE * over_ranks(solver->least_relaxation_time(), MPI_MIN);
  const double flow = typical_rate() > 0.0 ? STRAIN / typical_rate() : HUGE_VAL;

  double least = std::min(stable, flow);
  if (fastest > 0.0)
    least = std::min(least, std::min(TRAVEL * length, REACH * neighbor->skin) / fastest);
  if (settings.drive == FlowSettings::OSCILLATE) least = std::min(least, phase / settings.omega);
  if (!std::isfinite(least)) least = rest;
  const bool limited = settings.longest > 0.0 && settings.longest <= least;
  if (limited) least = settings.longest;
  if (!std::isfinite(least))
    error->all(FLERR, "{}: nothing touches and nothing moves: give the longest step, as longest "
               "value", WHO);
  const double speed = bodies.empty() ? 0.0 : falling_speed();
  const double usual = std::min({stable, flow, speed > 0.0 ? STRAIN * length / speed : HUGE_VAL});
  if (std::isfinite(stable) && least < STUCK * usual && !limited)
    error->all(FLERR, "{}: {} at time {:.6g}, strain {:.6g}, rate {:.3g} the fastest one moves at "
               "{:.3g} beside the flow, and steps of {:.2g} lead nowhere: {}, or lower the rate",
               WHO, FLOW_STUCK, state.time, state.strain, state.rate, fastest, least,
               more_background());
  return least;
}

/* Stresses are means over the box. */
double OverdampedFlow::column(int n) const
{
  const FlowSums &s = state.sums;
  const double a = area(), width = domain->xprd;
  const double columns[COLUMNS] = {
      state.time, state.strain, state.rate, stress(), s.elastic / a, s.viscous / a,
      -0.5 * (s.xx + s.yy) / a,    // pressure
      (s.xx - s.yy) / a,           // first normal stress difference
      dissipation(), s.energy / a, state.work, state.dissipated,
      last_iterations, update->dt, iterations, s.contacts, state.unsettled,
      // shear stress and pressure on the lower wall and on the upper one
      s.walls[0] / width, -s.walls[1] / width, -s.walls[2] / width, s.walls[3] / width,
      solver ? solver->marginal_pairs() : 0.0};
  return n < COLUMNS ? columns[n] : 0.0;
}

double OverdampedFlow::memory_usage()
{
  double used = bytes(forces, bodies.applied()) + (solver ? solver->memory_usage() : 0.0);
  for (const Field *each : fields()) used += bytes(*each);
  return used;
}
