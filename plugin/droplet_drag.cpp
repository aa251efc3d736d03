// SPDX-License-Identifier: GPL-2.0-or-later
#include "droplet_drag.h"

#include "atom.h"
#include "bond.h"
#include "compute.h"
#include "domain.h"
#include "error.h"
#include "fix_outline_energy.h"
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
using jamlab::point, jamlab::Vector;

static constexpr double OTHER_STEP = 2.0;    // ratio of times ahead that makes factors outdated
static constexpr int ALWAYS = -1;            // iterations from which factors pay
static constexpr double SHIFT = 1e-8, LARGEST_SHIFT = 1e6, MORE_SHIFT = 1e3;    // of the diagonal
static constexpr double ROUNDING = 4e-15;    // of a force on a vertex, over line tension

static constexpr char STRESSES[] =
    "{}: stresses need the virial of fix {}: use fix_modify {} virial yes";

static FixPolygonArea *area_of_all(LAMMPS *lmp)
{
  const auto found = lmp->modify->get_fix_by_style("^polygon/area$");
  auto *const area = found.size() == 1 ? dynamic_cast<FixPolygonArea *>(found[0]) : nullptr;
  if (!area || area->igroup != 0)
    lmp->error->all(FLERR, "{}: droplets need one fix polygon/area, of group all", WHO);
  if (!lmp->force->bond || !utils::strmatch(lmp->force->bond_style, "^line/tension$"))
    lmp->error->all(FLERR, "{}: droplets need bond_style line/tension", WHO);
  if (!area->thermo_virial)
    lmp->error->all(FLERR, STRESSES, WHO, area->id, area->id);
  for (const FixOutlineEnergy *const law : FixOutlineEnergy::all_of(lmp))
    if (!law->thermo_virial)
      lmp->error->all(FLERR, STRESSES, WHO, law->id, law->id);
  return area;
}

DropletDrag::DropletDrag(LAMMPS *lmp, GhostExchange &exchange, const Settings &settings,
                         const DragLaw &law) :
    DragSystem(lmp->world, exchange, settings, law), lmp(lmp),
    pair(dynamic_cast<PairCirculoline *>(lmp->force->pair_match("circuloline", 1))),
    area(area_of_all(lmp)), stiffness(lmp, area)
{
  const char *const names[] = {"thermo_pe", "thermo_press"};
  for (int k = 0; k < 2; k++) {
    wanted[k] = lmp->modify->get_compute_by_id(names[k]);
    if (!wanted[k])
      lmp->error->all(FLERR, "{}: compute {} of LAMMPS is gone, which makes it find energies and "
                      "virials: do not uncompute it", WHO, names[k]);
  }
  want_sums(lmp->update->ntimestep);
}

void DropletDrag::want_sums(bigint step)
{
  for (Compute *each : wanted) each->addstep(step);
}

void DropletDrag::read_sums()
{
  Bond *const bond = lmp->force->bond;
  evaluated = {pair->eng_vdwl + bond->energy};
  std::vector<const double *> virials = {+pair->virial, +bond->virial, +area->virial};
  const std::vector<FixOutlineEnergy *> outlines = FixOutlineEnergy::all_of(lmp);
  for (const FixOutlineEnergy *const law : outlines) virials.push_back(law->virial);
  for (const double *const virial : virials) {
    evaluated.xx += virial[0];
    evaluated.yy += virial[1];
    evaluated.xy += virial[3];
  }
  MPI_Allreduce(MPI_IN_PLACE, &evaluated, 4, MPI_DOUBLE, MPI_SUM, world);
  evaluated.energy += area->compute_scalar();
  for (FixOutlineEnergy *const law : outlines) evaluated.energy += law->compute_scalar();
}

void DropletDrag::update_contacts(int local, int ghost, double time_ahead)
{
  make_room(local, ghost);
  for (Field *each : {&work, &still}) each->resize(local + ghost);
  ahead = time_ahead;
  if (lmp->neighbor->ago == 0) moved_between_ranks = true;
  outdated = ahead > OTHER_STEP * factors_ahead || ahead * OTHER_STEP < factors_ahead;
  want_sums(lmp->update->ntimestep + 1);
  read_sums();

  if (!find_meetings(*pair, lmp->atom->x, meetings)) {
    const DropletMeeting &m = meetings.back();
    const tagint *const tag = lmp->atom->tag;
    lmp->error->one(FLERR, "{}: {} outlines cross at atom {}, edge {} - {}: take shorter steps, by "
                    "a smaller tolerance", WHO, FLOW_CROSSES, tag[m.vertex], tag[m.tail],
                    tag[m.head]);
  }
  rows.clear();
  contacts.clear();
  for (const DropletMeeting &m : meetings) {
    rows.push_back({m.vertex, m.tail, m.head, m.t, m.normal.x, m.normal.y, 0.5 * m.distance});
    contacts.push_back({m.distance, m.stiffness, m.drag});    // the virial knows the force
  }
  read_outlines();
  stiffness.take(meetings);
}

void DropletDrag::read_outlines()
{
  const auto x = lmp->atom->x;
  const PolygonRings &rings = area->rings();
  turns.assign(nlocal, {-1, -1, {0.0, 0.0}, {0.0, 0.0}, 0.0});
  background.assign(nlocal, 0.0);
  for (const auto &segment : rings.segments())
    for (int n = segment.begin; n < segment.end; n++) {
      const PolygonRings::Vertex &v = rings.vertices()[n];
      const Vector here = point(x[v.i], 0), in = here - point(x[v.prev], 0);
      const Vector out = point(x[v.next], 0) - here;
      const double square = dot(in, in) + dot(out, out);
      turns[v.i] = {v.prev, v.next, in, out, square > 0.0 ? 1.0 / square : 0.0};
      background[v.i] = settings.background / rings.polygons()[segment.polygon].size;
    }
  for (int i = 0; i < nlocal; i++)
    if (turns[i].prev < 0 && pair->flat(i))
      turns[i].prev = turns[i].next = i;    // it does not turn
    else if (turns[i].prev < 0)
      lmp->error->one(FLERR, "{}: atom {} is no vertex of a droplet", WHO, lmp->atom->tag[i]);
}

/* The spin of a vertex is the angular velocity of the outline there. */
void DropletDrag::find_spins(Field &p, double rate)
{
  if (law.beta == 0.0) return;
  for (int i = 0; i < nlocal; i++) {
    const Turn &t = turns[i];
    const Vector v = p[i].xy(), affine = {rate, 0.0};
    const Vector in = v - p[t.prev].xy() + affine * t.in.y;
    const Vector out = p[t.next].xy() - v + affine * t.out.y;
    p[i].spin = t.per_square * (cross(t.in, in) + cross(t.out, out));
  }
  exchange.send_to_ghosts(p);
}

/* Torques on outlines become forces on their vertices; returns the torque on the affine flow. */
double DropletDrag::turn_back(Field &out, FlowSums *sums)
{
  if (law.beta == 0.0) return 0.0;
  double flow = 0.0;
  for (int i = 0; i < nlocal; i++) {
    const Turn &t = turns[i];
    out[i].spin *= t.per_square;
    flow -= out[i].spin * (t.in.y * t.in.y + t.out.y * t.out.y);
    if (!sums) continue;
    const double stretch = out[i].spin * (t.in.x * t.in.y + t.out.x * t.out.y);
    sums->xx -= stretch;
    sums->yy += stretch;
  }
  exchange.send_to_ghosts(out);
  for (int i = 0; i < nlocal; i++) {
    const Turn &t = turns[i];
    const double in = out[i].spin + out[t.prev].spin, away = out[i].spin + out[t.next].spin;
    work[i] = {away * t.out.y - in * t.in.y, in * t.in.x - away * t.out.x, -out[i].spin};
  }
  for (int i = 0; i < nlocal; i++) out[i] += work[i];
  return flow;
}

/* The same on all ranks, as all that solutions end by. */
double DropletDrag::rounding() const
{
  const double force = ROUNDING * stiffness.largest_tension(size);
  return force * force * lmp->atom->natoms / std::max(mean_diagonal, 1e-300);
}

void DropletDrag::elastic_forces(Field &force) const
{
  force.resize(nlocal);
  for (int i = 0; i < nlocal; i++) force[i] = {lmp->atom->f[i][0], lmp->atom->f[i][1], 0.0};
  for (std::size_t i = 0; i < applied.size(); i++) force[i] = force[i] - applied[i];
}

/* Elastic forces and energies of the end of the step follow from known ones by the change of
   velocities, u - u_initial, over the time ahead. */
FlowSums DropletDrag::add_up(const Field &u, double rate)
{
  Field change(nlocal + nghost), out(nlocal + nghost);
  const double rate_change = rate - initial_rate;
  for (int i = 0; i < nlocal; i++) change[i] = u[i] - initial_velocity[i];
  exchange.send_to_ghosts(change);
  const Virial followed = stiffness.add_product(change, rate_change, ahead, out);
  exchange.add_from_ghosts(out);
  FlowSums sums;
  sums.elastic = followed.xy;
  sums.xx = followed.xx;
  sums.yy = followed.yy;
  Field elastic_force;
  elastic_forces(elastic_force);
  for (int i = 0; i < nlocal; i++) {
    const double x = ahead * elastic_force[i].x * change[i].x;
    const double y = ahead * elastic_force[i].y * change[i].y;
    sums.xx -= x;
    sums.yy -= y;
    sums.energy -= x + y;
  }
  sums.energy += 0.5 * ahead * field_dot(out, change, nlocal);

  std::copy_n(u.begin(), nlocal + nghost, still.begin());
  const Product drag = multiply(still, rate, DRAG, out, nullptr, &sums);
  add_background_sums(u, sums);
  MPI_Allreduce(MPI_IN_PLACE, &sums, sizeof(FlowSums) / sizeof(double), MPI_DOUBLE, MPI_SUM, world);
  const double elastic = elastic_moment();
  sums.energy += evaluated.energy + ahead * rate_change * (elastic + 0.5 * sums.elastic);
  sums.elastic += elastic;
  sums.viscous = drag.affine_flow;
  sums.xx -= evaluated.xx;
  sums.yy -= evaluated.yy;
  return sums;
}

/* In single precision: the mean does not depend on the order of the sum. */
DropletDrag::Scales DropletDrag::scales()
{
  const auto &polygons = area->rings().polygons();
  double sums[2] = {0.0, 0.0};
  for (std::size_t k = 0; k < polygons.size(); k++) {
    if (polygons[k].first < 0) continue;    // another rank counts it
    sums[0] += sqrt(area->rest_area_of(static_cast<int>(k)));
    sums[1] += 1.0;
  }
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, lmp->world);
  size = static_cast<float>(sums[0] / sums[1]);
  int unused;
  const auto eps = static_cast<double **>(pair->extract("eps", unused));
  double energy = size * stiffness.largest_tension(size);
  for (int i = 1; i <= lmp->atom->ntypes; i++)
    energy = std::max(energy, *std::max_element(eps[i] + 1, eps[i] + 1 + lmp->atom->ntypes));
  return {size, energy};
}

/* Places are counted from the centroid of the area. Forces are 0 on all but fixed droplets. */
double DropletDrag::moment_of_kept(const Field &force) const
{
  enum { AREA, MOMENT_X, MOMENT_Y, FORCE_X, FORCE_Y, WORK, NUMBERS };
  const PolygonRings &rings = area->rings();
  const auto x = lmp->atom->x;
  std::vector<double> sums(NUMBERS * rings.polygons().size(), 0.0);
  for (const PolygonRings::Vertex &v : rings.vertices()) {
    double *const of = &sums[NUMBERS * v.polygon];
    const Vector here = rings.position(v), edge = point(x[v.next], 0) - point(x[v.i], 0);
    const double twice = here.x * edge.y - here.y * edge.x;
    of[AREA] += twice;
    of[MOMENT_X] += (2.0 * here.x + edge.x) * twice / 3.0;
    of[MOMENT_Y] += (2.0 * here.y + edge.y) * twice / 3.0;
    of[FORCE_X] += force[v.i].x;
    of[FORCE_Y] += force[v.i].y;
    of[WORK] += force[v.i].x * here.x + force[v.i].y * here.y;
  }
  rings.sum(sums, NUMBERS);
  double found = 0.0;
  for (std::size_t k = 0; k < rings.polygons().size(); k++) {
    if (rings.polygons()[k].first < 0) continue;    // another rank counts it
    const double *const of = &sums[NUMBERS * k];
    found += of[WORK] - (of[FORCE_X] * of[MOMENT_X] + of[FORCE_Y] * of[MOMENT_Y]) / of[AREA];
  }
  return found;
}

void DropletDrag::find_preconditioner(bool free_rate)
{
  if (factors_are_due(ALWAYS, outdated)) factorise();
  outdated = !law.is_linear();
  inverse_flow = 0.0;
  if (!free_rate) return;
  std::fill(still.begin(), still.end(), Vec3());
  std::copy(carried.begin(), carried.end(), still.begin());
  Field out(still.size());
  const double flow = multiply(still, 1.0, TANGENT, out, nullptr, nullptr).flow + settings.fluid;
  inverse_flow = flow > 0.0 ? 1.0 / flow : 0.0;
}

/* K is not positive definite where droplets slip. The diagonal is raised until the sum is. */
void DropletDrag::factorise()
{
  factors_ahead = ahead;
  age = 0;
  BlockAssembly<2> matrix(lmp->atom, given);
  assemble_rows(matrix, true);
  for (int i = 0; i < nlocal; i++) matrix.add(i, i, {background[i], 0.0, 0.0, background[i]});
  if (ahead > 0.0) stiffness.assemble(ahead, matrix);
  matrix.fill(factors);
  const double own = factors.mean_diagonal();
  MPI_Allreduce(&own, &mean_diagonal, 1, MPI_DOUBLE, MPI_MAX, world);
  for (double shift = SHIFT; shift < LARGEST_SHIFT; shift *= MORE_SHIFT) {
    factored = factors.factorise(own > 0.0 ? shift * own : 1.0);
    if (factored) return;
    matrix.refill(factors);
  }
  lmp->error->one(FLERR, "{}: the matrix of drag has no Cholesky factor at step {}: are positions "
                  "finite?", WHO, lmp->update->ntimestep);
}

/* Spins of sites are spins of their outlines, which belong to vertices and their neighbors. */
void DropletDrag::find_parts(std::size_t k, std::vector<Part> &parts) const
{
  DragSystem::find_parts(k, parts);
  for (int a = 0; a < DropletRow::SITES; a++) {
    const int site = parts[a].site;
    const int own = site < nlocal ? site : lmp->atom->map(lmp->atom->tag[site]);
    if (own >= nlocal) continue;
    const Turn &t = turns[own];
    const double arm = rows[k].arm(a) * t.per_square;
    parts.push_back({own, {0.0, 0.0}, {arm * (t.in.y - t.out.y), arm * (t.out.x - t.in.x)}});
    parts.push_back({t.prev, {0.0, 0.0}, {-arm * t.in.y, arm * t.in.x}});
    parts.push_back({t.next, {0.0, 0.0}, {arm * t.out.y, -arm * t.out.x}});
  }
}

/* Without background drag, contacts leave droplets free to drift as a whole if none is held. */
void DropletDrag::project(Field &field) const
{
  if (settings.background > 0.0 || !given.empty()) return;
  Vec3 total;
  for (int i = 0; i < nlocal; i++) total += field[i];
  MPI_Allreduce(MPI_IN_PLACE, &total.x, 3, MPI_DOUBLE, MPI_SUM, world);
  const Vec3 drift = -1.0 / static_cast<double>(lmp->atom->natoms) * total;
  for (int i = 0; i < nlocal; i++) field[i] += drift;
}
