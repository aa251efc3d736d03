// SPDX-License-Identifier: GPL-2.0-or-later
#include "droplet_drag.h"

#include "atom.h"
#include "compute.h"
#include "domain.h"
#include "error.h"
#include "fix_polygon_area.h"
#include "flow_settings.h"
#include "force.h"
#include "modify.h"
#include "neighbor.h"
#include "pair_circuloline.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr int SLOW = 25;    // iterations after which factors are made anew
static constexpr double OTHER_STEP = 2.0;    // or if the time ahead is that many times another one
static constexpr double SHIFT = 1e-8, LARGEST_SHIFT = 1e6, MORE_SHIFT = 1e3;    // over the mean diagonal
static constexpr double ROUNDING = 4e-15;    // of a force on a vertex, over line tension

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

DropletDrag::DropletDrag(LAMMPS *lmp, GhostExchange &exchange, const Settings &settings, const DragLaw &law,
                         Compute &virial, Compute &energy) :
    DragSystem(lmp->world, exchange, settings, law), lmp(lmp),
    pair(dynamic_cast<PairCirculoline *>(lmp->force->pair_match("circuloline", 1))), area(area_of_all(lmp)),
    virial(virial), energy(energy), stiffness(lmp, area)
{
}

void DropletDrag::update_contacts(int local, int ghost, double time_ahead)
{
  make_room(local, ghost);
  for (Field *each : {&work, &still}) each->resize(local + ghost);
  ahead = time_ahead;
  if (lmp->neighbor->ago == 0) moved_between_ranks = true;
  stale = last_iterations > SLOW || ahead > OTHER_STEP * factors_ahead || ahead * OTHER_STEP < factors_ahead;
  for (Compute *compute : {&virial, &energy}) compute->addstep(lmp->update->ntimestep + 1);

  if (!find_meetings(*pair, lmp->atom->x, meetings)) {
    const DropletMeeting &m = meetings.back();
    const tagint *const tag = lmp->atom->tag;
    lmp->error->one(FLERR, "{}: {} outlines cross at atom {}, edge {} - {}: take shorter steps, by a smaller tolerance",
                    WHO, FLOW_CROSSES, tag[m.vertex], tag[m.tail], tag[m.head]);
  }
  rows.clear();
  contacts.clear();
  for (const DropletMeeting &m : meetings) {
    rows.push_back({m.vertex, m.tail, m.head, m.t, m.normal.x, m.normal.y, 0.5 * m.distance});
    contacts.push_back({m.distance, m.stiffness});    // the virial knows elastic forces
  }
  read_outlines();
  stiffness.take(meetings);
}

void DropletDrag::read_outlines()
{
  const auto x = lmp->atom->x;
  const PolygonRings &rings = area->rings();
  turns.assign(nlocal, {-1, -1, 0.0, 0.0, 0.0, 0.0, 0.0});
  background.assign(nlocal, 0.0);
  for (const auto &segment : rings.segments())
    for (int n = segment.begin; n < segment.end; n++) {
      const PolygonRings::Vertex &v = rings.vertices()[n];
      const double in_x = x[v.i][0] - x[v.prev][0], in_y = x[v.i][1] - x[v.prev][1];
      const double out_x = x[v.next][0] - x[v.i][0], out_y = x[v.next][1] - x[v.i][1];
      const double square = in_x * in_x + in_y * in_y + out_x * out_x + out_y * out_y;
      turns[v.i] = {v.prev, v.next, in_x, in_y, out_x, out_y, square > 0.0 ? 1.0 / square : 0.0};
      background[v.i] = settings.background / rings.polygons()[segment.polygon].size;
    }
  for (int i = 0; i < nlocal; i++)
    if (turns[i].prev < 0 && pair->flat(i))
      turns[i].prev = turns[i].next = i;    // it does not turn
    else if (turns[i].prev < 0)
      lmp->error->one(FLERR, "{}: atom {} is no vertex of a droplet", WHO, lmp->atom->tag[i]);
}

/* angular velocity of the outline at each vertex */
void DropletDrag::find_spins(Field &p, double rate)
{
  if (law.beta == 0.0) return;
  for (int i = 0; i < nlocal; i++) {
    const Turn &t = turns[i];
    const Vec3 &v = p[i], &a = p[t.prev], &b = p[t.next];
    p[i].spin = t.per_square * (t.in_x * (v.y - a.y) - t.in_y * (v.x - a.x + rate * t.in_y) + t.out_x * (b.y - v.y) -
                                t.out_y * (b.x - v.x + rate * t.out_y));
  }
  exchange.send_to_ghosts(p);
}

/* torques on the outlines as forces on their vertices; returns the torque on the affine flow */
double DropletDrag::turn_back(Field &out, FlowSums *sums)
{
  if (law.beta == 0.0) return 0.0;
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

double DropletDrag::rounding() const
{
  const double force = ROUNDING * stiffness.largest_tension();
  return force * force * lmp->atom->natoms / std::max(mean_diagonal, 1e-300);
}

/* of the forces, before they follow the velocities */
double DropletDrag::elastic_moment() const
{
  virial.compute_vector();
  return -virial.vector[3] * lmp->domain->xprd * lmp->domain->yprd;
}

void DropletDrag::elastic_forces(Field &force) const
{
  force.resize(nlocal);
  for (int i = 0; i < nlocal; i++) force[i] = {lmp->atom->f[i][0], lmp->atom->f[i][1], 0.0};
}

/* elastic forces and energies of the end of the step: K (u - start) over the time ahead, from known ones */
FlowSums DropletDrag::add_up(const Field &u, double rate)
{
  Field change(nlocal + nghost), out(nlocal + nghost);
  for (int i = 0; i < nlocal; i++) change[i] = u[i] - start[i];
  exchange.send_to_ghosts(change);
  const Virial followed = stiffness.add_product(change, rate - start_rate, ahead, out);
  exchange.add_from_ghosts(out);
  FlowSums sums;
  sums.elastic = followed.xy;
  sums.xx = followed.xx;
  sums.yy = followed.yy;
  const auto f = lmp->atom->f;
  for (int i = 0; i < nlocal; i++) {
    const double x = ahead * f[i][0] * change[i].x, y = ahead * f[i][1] * change[i].y;
    sums.xx -= x;
    sums.yy -= y;
    sums.energy -= x + y;
  }
  sums.energy += 0.5 * ahead * field_dot(out, change, nlocal);

  double power, viscous;
  std::copy_n(u.begin(), nlocal + nghost, still.begin());
  apply(still, rate, 0.0, false, out, power, viscous, nullptr, &sums);
  add_background_sums(u, sums);
  MPI_Allreduce(MPI_IN_PLACE, &sums, sizeof(FlowSums) / sizeof(double), MPI_DOUBLE, MPI_SUM, world);
  const double elastic = elastic_moment(), a = lmp->domain->xprd * lmp->domain->yprd;
  sums.energy += energy.compute_scalar() + ahead * (rate - start_rate) * (elastic + 0.5 * sums.elastic);
  sums.elastic += elastic;
  sums.viscous = viscous;
  sums.xx -= a * virial.vector[0];
  sums.yy -= a * virial.vector[1];
  return sums;
}

void DropletDrag::find_preconditioner(bool free_rate)
{
  int anew = stale || moved_between_ranks;
  MPI_Allreduce(MPI_IN_PLACE, &anew, 1, MPI_INT, MPI_MAX, world);
  if (anew) factorise();
  stale = law.alpha != 1.0;
  inverse_flow = 0.0;
  if (!free_rate) return;
  double power, flow;
  std::fill(still.begin(), still.end(), Vec3());
  Field out(still.size());
  multiply_ahead(still, 1.0, out, power, flow, nullptr);
  flow += settings.fluid;
  inverse_flow = flow > 0.0 ? 1.0 / flow : 0.0;
}

/* K is not positive definite where droplets slip: with more on the diagonal until the sum is */
void DropletDrag::factorise()
{
  factors_ahead = ahead;
  if (moved_between_ranks) factors.forget_order();
  moved_between_ranks = false;
  BlockAssembly<2> matrix(lmp->atom, given);
  assemble_rows(matrix, true);
  for (int i = 0; i < nlocal; i++) matrix.add(i, i, {background[i], 0.0, 0.0, background[i]});
  if (ahead > 0.0) stiffness.assemble(ahead, matrix);
  matrix.fill(factors);
  mean_diagonal = factors.mean_diagonal();
  for (double shift = SHIFT; shift < LARGEST_SHIFT; shift *= MORE_SHIFT) {
    factored = factors.factorise(mean_diagonal > 0.0 ? shift * mean_diagonal : 1.0);
    if (factored) return;
    matrix.refill(factors);
  }
  lmp->error->one(FLERR, "Fix overdamped: the matrix of drag has no Cholesky factor at step {}: are positions finite?",
                  lmp->update->ntimestep);
}

/* spins of sites are those of their outlines: parts of vertices of this rank and their neighbors */
void DropletDrag::find_parts(std::size_t k, std::vector<Part> &parts) const
{
  DragSystem::find_parts(k, parts);
  for (int a = 0; a < DropletRow::SITES; a++) {
    const int site = parts[a].site, own = site < nlocal ? site : lmp->atom->map(lmp->atom->tag[site]);
    if (own >= nlocal) continue;
    const Turn &t = turns[own];
    const double arm = rows[k].arm(a) * t.per_square;
    parts.push_back({own, {0.0, 0.0}, {arm * (t.in_y - t.out_y), arm * (t.out_x - t.in_x)}});
    parts.push_back({t.prev, {0.0, 0.0}, {-arm * t.in_y, arm * t.in_x}});
    parts.push_back({t.next, {0.0, 0.0}, {arm * t.out_y, -arm * t.out_x}});
  }
}

/* without background drag, contacts leave droplets free to drift as a whole if none is held */
void DropletDrag::project(Field &field) const
{
  if (settings.background > 0.0 || !given.empty()) return;
  double mean[2] = {0.0, 0.0};
  for (int i = 0; i < nlocal; i++) {
    mean[0] += field[i].x;
    mean[1] += field[i].y;
  }
  MPI_Allreduce(MPI_IN_PLACE, mean, 2, MPI_DOUBLE, MPI_SUM, world);
  for (int i = 0; i < nlocal; i++) {
    field[i].x -= mean[0] / lmp->atom->natoms;
    field[i].y -= mean[1] / lmp->atom->natoms;
  }
}
