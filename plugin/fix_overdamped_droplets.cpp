// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

/* Steps of droplets: backward differences of second order with steps of any length. With q the positions
   and u their velocities beside the affine flow, r the ratio of this step dt to the last one,

     q = q_last + r^2/(1 + 2 r) (q_last - q_before) + ahead u,   ahead = dt (1 + r)/(1 + 2 r).

   Forces are evaluated at the q of extrapolated velocities u*, and those at the end of the step are
   F - ahead K (u - u*). */

#include "fix_overdamped.h"

#include "atom.h"
#include "domain.h"
#include "update.h"

using namespace LAMMPS_NS;

/* ----------------------------------------------------------------------
   A run that goes on has its velocities. A flow begins with those that the drag alone allows: forces,
   which vertices without drag cannot stand, act from the first step on.
------------------------------------------------------------------------- */

void FixOverdamped::start_droplets()
{
  if (state.last_step > 0.0 || drive == STRESS) {
    solver->accept(now, state.rate);
    return;
  }
  find_velocities(false);
}

/* ----------------------------------------------------------------------
   part of the last step's displacement that this one repeats
------------------------------------------------------------------------- */

double FixOverdamped::repeated(double ratio)
{
  return ratio * ratio / (1.0 + 2.0 * ratio);
}

/* ----------------------------------------------------------------------
   strain of the next step where the stress is given; of the rate as of other velocities
------------------------------------------------------------------------- */

double FixOverdamped::droplet_strain_step(double dt) const
{
  const double ratio = state.last_step > 0.0 ? dt / state.last_step : 0.0;
  const double rate = state.rate + ratio * (state.rate - state.rate_before);
  return repeated(ratio) * state.strain_step + dt * (1.0 + ratio) / (1.0 + 2.0 * ratio) * rate;
}

/* ---------------------------------------------------------------------- */

void FixOverdamped::predict_droplets(double dt, double strain_step)
{
  const double ratio = state.last_step > 0.0 ? dt / state.last_step : 0.0, again = repeated(ratio);
  const double leaned = state.strain_step, ylo = domain->boxlo[1];
  ahead = dt * (1.0 + ratio) / (1.0 + 2.0 * ratio);
  double **const x = atom->x;
  for (int i = 0; i < atom->nlocal; i++) {
    const Motion v = now[i], w = before[i], m = moved[i];
    const double wx = w.x + leaned * w.y;    // seen from the box as it leans now
    const double ux = v.x + ratio * (v.x - wx), uy = v.y + ratio * (v.y - w.y);
    const double dx = again * m.x + ahead * ux, dy = again * m.y + ahead * uy;
    x[i][1] += dy;
    x[i][0] += dx + strain_step * (x[i][1] - ylo);
    before[i] = v;
    now[i] = {ux + strain_step * uy, uy, 0.0};
    moved[i] = {dx + strain_step * dy, dy, 0.0};
  }
}

/* ----------------------------------------------------------------------
   from where the prediction went to where the velocities lead; the box too, if its rate was free
------------------------------------------------------------------------- */

void FixOverdamped::correct_droplets(const Motions &predicted, double predicted_rate)
{
  const double extra = ahead * (state.rate - predicted_rate), ylo = domain->boxlo[1];
  double **const x = atom->x;
  for (int i = 0; i < atom->nlocal; i++) {
    const double dx = ahead * (now[i].x - predicted[i].x), dy = ahead * (now[i].y - predicted[i].y);
    moved[i].x += dx;
    moved[i].y += dy;
    x[i][1] += dy;
    x[i][0] += dx;
    if (drive == STRESS) x[i][0] += extra * (x[i][1] - ylo);
  }
  if (drive != STRESS) return;
  state.strain_step += extra;
  state.strain += extra;
  domain->xy += extra * domain->yprd;
  domain->set_global_box();
  domain->set_local_box();
}
