// SPDX-License-Identifier: GPL-2.0-or-later

/* Steps of droplets: backward differences of second order with steps of any length. With q the
   positions and u their velocities beside the affine flow, r the ratio of this step dt to the last one,

     q = q_last + r^2/(1 + 2 r) (q_last - q_before) + ahead u,   ahead = dt (1 + r)/(1 + 2 r).

   Forces are evaluated at the q of the mean velocity u* of two steps, and those at the end of the step
   are F - ahead K (u - u*). An extrapolated u* would open and close a contact in turn, step after step.
   Where the correction goes too far, or K is negative, a shorter step is taken from q_last: a droplet
   that slips past others moves as fast as drag allows, at once if nothing drags on it. */

#include "fix_overdamped.h"

#include "atom.h"
#include "domain.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr double FARTHEST = 0.005;    // from its prediction to where forces take a vertex
static constexpr double RETRY = 0.25;       // step over one that was too long
static constexpr double SHORTEST = 1e-7;    // step over tau at which a run is given up
static constexpr double STRAIN = 0.02, BALANCE = 0.05, OVERALL = 0.2, STRICTEST = 0.1,
                        ROUNDING = 1e-13;    // see `balances`

/* A run that resumes has its velocities. A flow begins with velocities that the drag alone allows:
   forces, which vertices without drag cannot stand, act from the first step on. */
void FixOverdamped::start_droplets()
{
  if (state.step > 0.0 || drive == STRESS) {
    solver->set_solution(velocity, state.rate);
    return;
  }
  if (const DragSolver::Result result = find_velocities(false); !result.converged) refuse(result);
}

/* part of the last step's displacement that this one repeats */
double FixOverdamped::repeated(double ratio)
{
  return ratio * ratio / (1.0 + 2.0 * ratio);
}

/* strain of the next step where the stress is given; of the rate as of other velocities */
double FixOverdamped::droplet_strain_step(double dt) const
{
  const double ratio = state.last_step > 0.0 ? dt / state.last_step : 0.0;
  const double rate = state.rate + ratio * (state.rate - state.rate_before);
  return repeated(ratio) * state.strain_step + dt * (1.0 + ratio) / (1.0 + 2.0 * ratio) * rate;
}

void FixOverdamped::predict_droplets(double dt, double strain_step)
{
  const double ratio = state.last_step > 0.0 ? dt / state.last_step : 0.0, again = repeated(ratio);
  const double per_time = state.last_step > 0.0 ? 1.0 / (state.last_step + state.step_before) : 0.0;
  const double leaned = state.strain_step, ylo = domain->boxlo[1];
  implicit_time = dt * (1.0 + ratio) / (1.0 + 2.0 * ratio);
  double **const x = atom->x;
  for (int i = 0; i < atom->nlocal; i++) {
    const Vec3 v = velocity[i], m = displacement[i], w = last_displacement[i];
    Vec3 u = {(m.x + w.x + leaned * w.y) * per_time, (m.y + w.y) * per_time, 0.0};    // as the box leans now
    if (per_time == 0.0) u = v;
    double dx = again * m.x + implicit_time * u.x;
    if (rides(i)) dx = strain_step * to_edge(i);    // exactly, or walls would lose their shape
    const double dy = again * m.y + implicit_time * u.y;
    x[i][1] += dy;
    x[i][0] += dx + strain_step * (x[i][1] - ylo);
    last_velocity[i] = v;
    velocity[i] = with_lean(u, strain_step);
    last_displacement[i] = m;
    displacement[i] = with_lean({dx, dy, 0.0}, strain_step);
  }
  state.step_before = state.last_step;
}

/* sum over vertices of how far the last step is off, over its time: displacements differ from the
   mean velocity of both ends by dt^2 u''/12, those of backward differences from exact ones by 2/9 */
double FixOverdamped::droplet_error() const
{
  double off = 0.0;
  const double dt = state.last_step, leaned = state.strain_step;
  for (int i = 0; i < atom->nlocal; i++) {
    const Vec3 &u = velocity[i], &v = last_velocity[i], &m = displacement[i];
    off += hypot(m.x / dt - 0.5 * (u.x + v.x + leaned * v.y), m.y / dt - 0.5 * (u.y + v.y));
  }
  return 8.0 / 3.0 * off;
}

/* whether a step loses little enough energy per area: a part of the tolerance of what goes into a box
   that leans by STRAIN, by the lower power of both ends, since one may be a burst; less, the more of
   what all steps may lose is lost. Rounding of the sum of energies and shortest steps always pass */
bool FixOverdamped::balances(double gap, double dissipation_before) const
{
  const double time = typical_rate() > 0.0 ? STRAIN / typical_rate() : time_unit();
  const double power = std::max(fabs(stress() * state.rate), std::min(dissipation_before, dissipation()));
  const double together = OVERALL * tolerance * std::max(fabs(state.work), state.dissipated);
  const double left = gap * state.gap > 0.0 ? std::max(STRICTEST, 1.0 - fabs(state.gap) / together) : 1.0;
  const double rounding = ROUNDING * fabs(state.sums.energy) / area();
  return fabs(gap) <= left * BALANCE * tolerance * time * power + rounding || state.last_step <= SHORTEST * time_unit();
}

/* from where the prediction went to where the velocities lead; the box too, if its rate was free.
   false: the step was too long */
bool FixOverdamped::correct_droplets(const Field &predicted, double predicted_rate,
                                     const DragSolver::Result &result)
{
  double farthest = 0.0;
  for (int i = 0; i < atom->nlocal; i++)
    farthest = std::max(farthest, hypot(velocity[i].x - predicted[i].x, velocity[i].y - predicted[i].y));
  MPI_Allreduce(MPI_IN_PLACE, &farthest, 1, MPI_DOUBLE, MPI_MAX, world);
  farthest *= implicit_time;
  if (!result.converged || farthest > FARTHEST) {
    if (state.last_step < SHORTEST * time_unit()) refuse(result);
    return false;
  }
  approached += 2.0 * farthest;
  const double extra = implicit_time * (state.rate - predicted_rate), ylo = domain->boxlo[1];
  double **const x = atom->x;
  for (int i = 0; i < atom->nlocal; i++) {
    if (rides(i)) continue;
    const double dx = implicit_time * (velocity[i].x - predicted[i].x),
                 dy = implicit_time * (velocity[i].y - predicted[i].y);
    displacement[i].x += dx;
    displacement[i].y += dy;
    x[i][1] += dy;
    x[i][0] += dx;
    if (drive != STRESS) continue;
    displacement[i].x += extra * displacement[i].y;
    x[i][0] += extra * (x[i][1] - ylo);
  }
  if (drive == STRESS) {
    state.strain_step += extra;
    state.strain += extra;
    domain->xy += extra * domain->yprd;
    domain->set_global_box();
    domain->set_local_box();
  }
  return true;
}

/* to the start of the step, from which a shorter one begins without history */
void FixOverdamped::step_back()
{
  const double leaned = state.strain_step, ylo = domain->boxlo[1];
  double **const x = atom->x;
  for (int i = 0; i < atom->nlocal; i++) {
    x[i][1] -= displacement[i].y;
    x[i][0] -= displacement[i].x + leaned * (x[i][1] - ylo);
    velocity[i] = last_velocity[i];
    displacement[i] = last_displacement[i] = Vec3();
  }
  domain->xy -= leaned * domain->yprd;
  domain->set_global_box();
  domain->set_local_box();
  const double iterations = state.iterations;
  state = at_start;
  state.iterations = iterations;
  state.last_step = state.step_before = 0.0;
  state.step = RETRY * update->dt;
  update->update_time();
  update->dt = state.step;
}
