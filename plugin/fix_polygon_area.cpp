// SPDX-License-Identifier: GPL-2.0-or-later
#include "fix_polygon_area.h"

#include "atom.h"
#include "edge_geometry.h"
#include "error.h"
#include "fix_polygon_outline.h"
#include "force.h"
#include "modify.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

using namespace LAMMPS_NS;

static constexpr char WHO[] = "Fix polygon/area";

/* The command is: fix ID group polygon/area ka a0. Each value is a number, d_name or v_name. */
FixPolygonArea::FixPolygonArea(LAMMPS *lmp, int narg, char **arg) :
    Fix(lmp, narg, arg), polygon_rings(lmp, WHO), stiffness(lmp, WHO, "ka", true),
    rest_area(lmp, WHO, "rest area", false), energy(0.0), eflag_caller(0), parameters_of(-1),
    done(false)
{
  if (narg != 5)
    error->all(FLERR, "{} needs: ka a0, each a number, d_name from fix property/atom, or v_name",
               WHO);

  stiffness.read(arg[3]);
  rest_area.read(arg[4]);

  scalar_flag = 1;
  global_freq = 1;
  extscalar = 1;
  energy_global_flag = energy_peratom_flag = 1;
  virial_global_flag = virial_peratom_flag = 1;
  thermo_energy = thermo_virial = 1;
  centroidstressflag = CENTROID_NOTAVAIL;
}

FixPolygonArea::~FixPolygonArea()
{
  const auto bond = dynamic_cast<BondLineTension *>(force ? force->bond : nullptr);
  if (bond && bond->rings == this) bond->rings = nullptr;
}

void FixPolygonArea::post_constructor()
{
  FixPolygonOutline::shared(lmp, WHO);
}

void FixPolygonArea::init()
{
  stiffness.init(igroup);
  rest_area.init(igroup);
  polygon_rings.init(groupbit);
  parameters_of = -1;
  done = false;

  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "{}: works with run_style verlet only", WHO);
  const auto bond = dynamic_cast<BondLineTension *>(force->bond);
  if (bond && atom->nbondtypes == 1 && first_to_add())
    bond->rings = this;
  else if (bond && bond->rings == this)
    bond->rings = nullptr;
}

/* No fix before this one may see or change the forces that it adds to. */
bool FixPolygonArea::first_to_add()
{
  for (Fix *fix : modify->get_fix_list()) {
    if (fix == this) return true;
    if (fix->setmask() & OWN_MASK) return false;
  }
  return false;
}

/* The force is f_i = -ka (a - a0) da/dx_i with da/dx_i = (1/2) (y_next - y_prev, x_prev - x_next).
   Each rank adds the forces on its own vertices, so nothing goes back to other ranks. */
void FixPolygonArea::post_force(int vflag)
{
  ev_init(eflag_caller, vflag);
  if (!done) add_forces(0.0, 0.0);
  done = false;
}

/* Bond style line/tension calls this: where all its bonds are edges of these rings, their tension
   is added in the same pass. The energy is that of edges that start at vertices of this rank. */
bool FixPolygonArea::add_tension_too(double gamma, double eta, double &energy_of_edges)
{
  polygon_rings.refresh(groupbit);
  if (!polygon_rings.hold_all_bonds()) return false;
  vflag_either = eflag_atom = 0;
  energy_of_edges += add_forces(gamma, eta);
  return done = true;
}

double FixPolygonArea::add_forces(double gamma, double eta)
{
  polygon_rings.refresh(groupbit);
  find_parameters();
  energy = 0.0;
  double length = 0.0;
  const auto act = [&](const auto &segment) { length += add_area_force(segment, gamma, eta); };
  polygon_rings.areas_and_centers(shape, vflag_either, act);
  return gamma * length;
}

/* The sum of sqrt(l^2 + eta^2) is returned. An edge of zero length has no direction and pulls
   nowhere. */
double FixPolygonArea::add_area_force(const PolygonRings::RingSegment &segment, double gamma,
                                      double eta)
{
  const PolygonRings::Vertex *const vertices = &polygon_rings.vertices()[segment.begin];
  const auto f = reinterpret_cast<Position *>(atom->f[0]);
  const auto [ex, ey] = polygon_rings.edges(segment);
  const int size = segment.end - segment.begin, k = segment.polygon;
  const double excess = excess_of(k), half_pressure = -0.5 * ka[k] * excess;
  const double per_vertex = -half_pressure * excess / polygon_rings.polygons()[k].size;
  energy += per_vertex * size;

  pulls.resize(std::max<std::size_t>(pulls.size(), size + 1));
  double *const pull = pulls.data();    // of each edge, over its length
  double length = 0.0;
#pragma omp simd reduction(+ : length)
  for (int n = 0; n <= size; n++) {
    const double square = ex[n] * ex[n] + ey[n] * ey[n] + eta * eta;
    const double long_enough = sqrt(std::max(square, std::numeric_limits<double>::min()));
    pull[n] = gamma / long_enough;
    length += n ? long_enough : 0.0;
  }
  for (int n = 0; n < size; n++) {
    const double fx = half_pressure * (ey[n] + ey[n + 1]);
    const double fy = -half_pressure * (ex[n] + ex[n + 1]);
    f[vertices[n].i][0] += fx + pull[n + 1] * ex[n + 1] - pull[n] * ex[n];
    f[vertices[n].i][1] += fy + pull[n + 1] * ey[n + 1] - pull[n] * ey[n];
    if (vflag_either || eflag_atom) tally(vertices[n], per_vertex, {fx, fy});
  }
  return length;
}

void FixPolygonArea::tally(const PolygonRings::Vertex &vertex, double share,
                           const jamlab::Vector &f)
{
  const int size = polygon_rings.polygons()[vertex.polygon].size;
  const double *const sums = &shape[3 * vertex.polygon + 1];
  const jamlab::Vector center{sums[0] / size, sums[1] / size};
  const jamlab::Vector r = polygon_rings.position(vertex) - center;
  double v[6] = {r.x * f.x, r.y * f.y, 0.0, r.x * f.y, 0.0, 0.0};
  if (vflag_either) v_tally(vertex.i, v);
  if (eflag_atom) eatom[vertex.i] += share;
}

void FixPolygonArea::find_parameters()
{
  const bool fresh = parameters_of != polygon_rings.refreshed();
  if (!fresh && !stiffness.changes() && !rest_area.changes()) return;
  parameters_of = polygon_rings.refreshed();

  const bool variables = stiffness.changes() || rest_area.changes();
  if (variables) modify->clearstep_compute();
  stiffness.evaluate(polygon_rings, fresh, ka);
  rest_area.evaluate(polygon_rings, fresh, a0);
  if (variables) modify->addstep_compute(update->ntimestep + 1);
}

double FixPolygonArea::compute_scalar()
{
  double total;
  MPI_Allreduce(&energy, &total, 1, MPI_DOUBLE, MPI_SUM, world);
  return total;
}
