// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "droplet_drag.h"

#include "atom.h"
#include "compute.h"
#include "domain.h"
#include "error.h"
#include "fix_overdamped.h"
#include "fix_polygon_area.h"
#include "force.h"
#include "modify.h"
#include "neighbor.h"
#include "pair_circuloline.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr char WHO[] = "Fix overdamped";

static constexpr int SLOW = 25;              // conjugate gradients after which factors are made anew
static constexpr double OTHER_STEP = 2.0;    // or if the time ahead is that many times another one
static constexpr double ROUNDING = 4e-15;    // of a force on a vertex, over line tension: positions are off by that

/* ---------------------------------------------------------------------- */

static FixPolygonArea *area_of_all(LAMMPS *lmp)
{
  const auto found = lmp->modify->get_fix_by_style("^polygon/area$");
  auto *const area = found.size() == 1 ? dynamic_cast<FixPolygonArea *>(found[0]) : nullptr;
  if (!area || area->igroup != 0)
    lmp->error->all(FLERR, "{}: droplets need one fix polygon/area, of group all", WHO);
  if (!lmp->force->bond || !utils::strmatch(lmp->force->bond_style, "^line/tension$"))
    lmp->error->all(FLERR, "{}: droplets need bond_style line/tension", WHO);
  return area;
}

/* ---------------------------------------------------------------------- */

DropletDrag::DropletDrag(LAMMPS *lmp, GhostExchange &exchange, const Settings &settings, const DragLaw &law,
                         Compute &virial, Compute &energy) :
    DragSolver(lmp->world, exchange, settings, law), lmp(lmp),
    pair(dynamic_cast<PairCirculoline *>(lmp->force->pair_match("circuloline", 1))), area(area_of_all(lmp)),
    virial(virial), energy(energy), stiffness(lmp, area)
{
}

/* ---------------------------------------------------------------------- */

void DropletDrag::take(int local, int ghost, double time_ahead)
{
  make_room(local, ghost);
  for (Motions *each : {&work, &still}) each->resize(local + ghost);
  ahead = time_ahead;
  if (lmp->neighbor->ago == 0) atoms_moved_between_ranks = true;
  stale = last_iterations > SLOW || ahead > OTHER_STEP * factors_ahead || ahead * OTHER_STEP < factors_ahead;
  for (Compute *compute : {&virial, &energy}) compute->addstep(lmp->update->ntimestep + 1);

  if (!find_meetings(*pair, lmp->atom->x, meetings)) {
    const DropletMeeting &m = meetings.back();
    const tagint *const tag = lmp->atom->tag;
    lmp->error->one(FLERR, "{}: {} outlines cross at atom {}, edge {} - {}: take shorter steps, by a smaller tolerance", WHO,
                    FLOW_CROSSES, tag[m.vertex], tag[m.tail], tag[m.head]);
  }
  weights.resize(meetings.size());
  read_outlines();
  stiffness.take(meetings);
}

/* ---------------------------------------------------------------------- */

void DropletDrag::read_outlines()
{
  const auto x = lmp->atom->x;
  const PolygonSums &rings = area->rings();
  turns.assign(nlocal, {-1, -1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0});
  for (const auto &run : rings.runs())
    for (int n = run.begin; n < run.end; n++) {
      const PolygonSums::Vertex &v = rings.vertices()[n];
      const double in_x = x[v.i][0] - x[v.prev][0], in_y = x[v.i][1] - x[v.prev][1];
      const double out_x = x[v.next][0] - x[v.i][0], out_y = x[v.next][1] - x[v.i][1];
      const double square = in_x * in_x + in_y * in_y + out_x * out_x + out_y * out_y;
      turns[v.i] = {v.prev, v.next, in_x, in_y, out_x, out_y, square > 0.0 ? 1.0 / square : 0.0,
                    settings.background / rings.polygons()[run.polygon].size};
    }
  for (int i = 0; i < nlocal; i++)
    if (turns[i].prev < 0)
      lmp->error->one(FLERR, "{}: atom {} is no vertex of a droplet", WHO, lmp->atom->tag[i]);
}

/* ----------------------------------------------------------------------
   approach and slip of the vertex past the edge, the affine flow included
------------------------------------------------------------------------- */

void DropletDrag::slip(const DropletMeeting &m, const Motions &p, double rate, double &approach, double &slide) const
{
  const Motion &v = p[m.vertex], &a = p[m.tail], &b = p[m.head];
  const double s = 1.0 - m.t;
  const double x = v.x - s * a.x - m.t * b.x + rate * m.ny * m.distance, y = v.y - s * a.y - m.t * b.y;
  approach = x * m.nx + y * m.ny;
  slide = y * m.nx - x * m.ny - 0.5 * m.distance * (v.spin + s * a.spin + m.t * b.spin);
}

/* ----------------------------------------------------------------------
   angular velocity of the outline at each vertex
------------------------------------------------------------------------- */

void DropletDrag::find_spins(Motions &p, double rate)
{
  for (int i = 0; i < nlocal; i++) {
    const Turn &t = turns[i];
    const Motion &v = p[i], &a = p[t.prev], &b = p[t.next];
    p[i].spin = t.per_square * (t.in_x * (v.y - a.y) - t.in_y * (v.x - a.x + rate * t.in_y) + t.out_x * (b.y - v.y) -
                                t.out_y * (b.x - v.x + rate * t.out_y));
  }
  exchange.send_to_ghosts(p);
}

/* ----------------------------------------------------------------------
   torques on the outlines as forces on their vertices; returns the torque on the affine flow
------------------------------------------------------------------------- */

double DropletDrag::turn_back(Motions &out, FlowSums *sums)
{
  double flow = 0.0;
  for (int i = 0; i < nlocal; i++) {
    const Turn &t = turns[i];
    out[i].spin *= t.per_square;
    flow -= out[i].spin * (t.in_y * t.in_y + t.out_y * t.out_y);
    if (!sums) continue;
    const double stretch = out[i].spin * (t.in_x * t.in_y + t.out_x * t.out_y);
    sums->xx -= stretch;
    sums->yy += stretch;
  }
  exchange.send_to_ghosts(out);
  for (int i = 0; i < nlocal; i++) {
    const Turn &t = turns[i];
    const double in = out[i].spin + out[t.prev].spin, away = out[i].spin + out[t.next].spin;
    work[i] = {away * t.out_y - in * t.in_y, in * t.in_x - away * t.out_x, 0.0};
  }
  for (int i = 0; i < nlocal; i++) out[i] = {out[i].x + work[i].x, out[i].y + work[i].y, 0.0};
  return flow;
}

/* ----------------------------------------------------------------------
   out = (B + ahead K) p + (b + ahead k) rate
------------------------------------------------------------------------- */

void DropletDrag::apply(Motions &p, double rate, double time, Motions &out, double &power, double &flow, FlowSums *sums)
{
  exchange.send_to_ghosts(p);
  if (law.beta > 0.0) find_spins(p, rate);
  std::fill(out.begin(), out.end(), Motion());
  double total[2] = {0.0, 0.0};
  for (std::size_t k = 0; k < meetings.size(); k++) {
    const DropletMeeting &m = meetings[k];
    double approach, slide;
    slip(m, p, rate, approach, slide);
    const double push = weights[k] * approach, rub = law.beta * weights[k] * slide;
    const double fx = push * m.nx - rub * m.ny, fy = push * m.ny + rub * m.nx;
    const double torque = 0.5 * m.distance * rub, s = 1.0 - m.t;
    Motion &v = out[m.vertex], &a = out[m.tail], &b = out[m.head];
    v = {v.x + fx, v.y + fy, v.spin - torque};
    a = {a.x - s * fx, a.y - s * fy, a.spin - s * torque};
    b = {b.x - m.t * fx, b.y - m.t * fy, b.spin - m.t * torque};
    total[1] += fx * m.ny * m.distance;
    if (!sums) continue;
    sums->xx += fx * m.nx * m.distance;
    sums->yy += fy * m.ny * m.distance;
    sums->dissipation += push * approach + rub * slide;
  }
  if (time > 0.0) total[1] += stiffness.add_product(p, rate, time, out);
  exchange.add_from_ghosts(out);
  if (law.beta > 0.0) total[1] += turn_back(out, sums);
  for (int i = 0; i < nlocal; i++) {
    out[i].x += turns[i].drag * p[i].x;
    out[i].y += turns[i].drag * p[i].y;
    total[0] += out[i].x * p[i].x + out[i].y * p[i].y;
  }
  MPI_Allreduce(MPI_IN_PLACE, total, 2, MPI_DOUBLE, MPI_SUM, world);
  flow = total[1];
  power = total[0] + rate * flow;
}

/* ---------------------------------------------------------------------- */

void DropletDrag::multiply(Motions &p, double rate, Motions &out, double &power, double &flow)
{
  apply(p, rate, 0.0, out, power, flow, nullptr);
}

/* ---------------------------------------------------------------------- */

void DropletDrag::multiply_ahead(Motions &p, double rate, Motions &out, double &power, double &flow)
{
  apply(p, rate, ahead, out, power, flow, nullptr);
}

/* ---------------------------------------------------------------------- */

void DropletDrag::find_weights(const Motions &u, double rate)
{
  std::vector<double> square(law.alpha == 1.0 ? 0 : meetings.size());
  double slowest = 0.0;
  if (law.alpha != 1.0) {
    work.assign(u.begin(), u.begin() + nlocal + nghost);
    find_spins(work, rate);
    double squares = 0.0;
    for (std::size_t k = 0; k < square.size(); k++) {
      double approach, slide;
      slip(meetings[k], work, rate, approach, slide);
      square[k] = law.square(approach, slide);
      squares += square[k];
    }
    slowest = speed_floor(squares, static_cast<double>(square.size()));
  }
  for (std::size_t k = 0; k < meetings.size(); k++)
    weights[k] = meetings[k].stiffness * law.weight(square.empty() ? 0.0 : square[k], slowest);
}

/* ---------------------------------------------------------------------- */

double DropletDrag::rounding() const
{
  const double force = ROUNDING * stiffness.largest_tension();
  return force * force * lmp->atom->natoms / std::max(mean_diagonal, 1e-300);
}

/* ----------------------------------------------------------------------
   of the forces, before they follow the velocities
------------------------------------------------------------------------- */

double DropletDrag::elastic_moment() const
{
  virial.compute_vector();
  return -virial.vector[3] * lmp->domain->xprd * lmp->domain->yprd;
}

/* ---------------------------------------------------------------------- */

FlowSums DropletDrag::add_up(const Motions &u, double rate)
{
  // what forces and energy have followed: K (u - start), over the time ahead

  double power, power_all, power_drag, all, drag;
  Motions out(nlocal + nghost);
  Motions &followed = still;
  for (int i = 0; i < nlocal; i++) followed[i] = {u[i].x - start[i].x, u[i].y - start[i].y, 0.0};
  const double extra = rate - start_rate;
  multiply_ahead(followed, extra, out, power_all, all);
  multiply(followed, extra, out, power_drag, drag);
  double given = 0.0;
  const auto f = lmp->atom->f;
  for (int i = 0; i < nlocal; i++) given += f[i][0] * followed[i].x + f[i][1] * followed[i].y;
  const double elastic = elastic_moment();

  FlowSums sums;
  std::copy_n(u.begin(), nlocal + nghost, followed.begin());
  apply(followed, rate, 0.0, out, power, sums.viscous, &sums);
  for (int i = 0; i < nlocal; i++) {
    const double square = u[i].x * u[i].x + u[i].y * u[i].y;
    sums.speed += sqrt(square);
    sums.dissipation += turns[i].drag * square;
  }
  sums.contacts = static_cast<double>(meetings.size());
  double of_ranks[6] = {sums.xx, sums.yy, sums.dissipation, sums.speed, sums.contacts, given};
  MPI_Allreduce(MPI_IN_PLACE, of_ranks, 6, MPI_DOUBLE, MPI_SUM, world);

  sums.elastic = elastic + all - drag;
  const double a = lmp->domain->xprd * lmp->domain->yprd;
  sums.xx = of_ranks[0] - a * virial.vector[0];
  sums.yy = of_ranks[1] - a * virial.vector[1];
  sums.dissipation = of_ranks[2];
  sums.speed = of_ranks[3];
  sums.contacts = of_ranks[4];
  given = of_ranks[5] - elastic * extra;
  sums.energy = energy.compute_scalar() + ahead * (0.5 * (power_all - power_drag) - given);
  return sums;
}

/* ----------------------------------------------------------------------
   steps look ahead: none is unstable
------------------------------------------------------------------------- */

double DropletDrag::least_relaxation_time() const
{
  return HUGE_VAL;
}

/* ---------------------------------------------------------------------- */

double DropletDrag::memory_usage() const
{
  return DragSolver::memory_usage() + meetings.capacity() * (sizeof(DropletMeeting) + sizeof(double)) +
      2.0 * work.capacity() * sizeof(Motion) + turns.capacity() * sizeof(Turn) + factors.memory_usage();
}
