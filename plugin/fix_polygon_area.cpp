// SPDX-License-Identifier: GPL-2.0-or-later
#include "fix_polygon_area.h"

#include "atom.h"
#include "edge_geometry.h"
#include "error.h"
#include "fix_polygon_outline.h"
#include "force.h"
#include "library.h"
#include "modify.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <vector>

using namespace LAMMPS_NS;

static constexpr char WHO[] = "Fix polygon/area";

/* The command is: fix ID group polygon/area ka a0. Each value is a number, d_name or v_name. */
FixPolygonArea::FixPolygonArea(LAMMPS *lmp, int narg, char **arg) :
    Fix(lmp, narg, arg), polygon_rings(lmp, WHO), stiffness(lmp, WHO, "ka", true),
    rest_area(lmp, WHO, "rest area", false), energy(0.0), level(0), parameters_of(-1)
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
  respa_level_support = 1;
  centroidstressflag = CENTROID_NOTAVAIL;
}

int FixPolygonArea::setmask()
{
  return FixConst::POST_FORCE | FixConst::PRE_FORCE_RESPA | FixConst::MIN_POST_FORCE;
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

  if (!utils::strmatch(update->integrate_style, "^respa")) return;
  const int levels = *static_cast<int *>(lammps_extract_global(lmp, "respa_levels"));
  level = respa_level < 0 ? levels - 1 : std::min(respa_level, levels - 1);
}

void FixPolygonArea::setup(int vflag)
{
  if (!utils::strmatch(update->integrate_style, "^respa")) post_force(vflag);
}

/* At its level, the force is there before those of styles and of other fixes. */
void FixPolygonArea::pre_force_respa(int vflag, int at, int /*loop*/)
{
  if (at == level) post_force(vflag);
}

/* The force is f_i = -ka (a - a0) da/dx_i with da/dx_i = (1/2) (y_next - y_prev, x_prev - x_next).
   Each rank adds the forces on its own vertices, so nothing goes back to other ranks. */
void FixPolygonArea::post_force(int vflag)
{
  ev_init(update->eflag_atom == update->ntimestep ? ENERGY_ATOM : ENERGY_NONE, vflag);
  polygon_rings.refresh(groupbit);
  find_parameters();
  energy = 0.0;
  const auto act = [this](const auto &segment) { add_area_force(segment); };
  polygon_rings.areas_and_centers(shape, vflag_either, act);
}

void FixPolygonArea::add_area_force(const PolygonRings::RingSegment &segment)
{
  const PolygonRings::Vertex *const vertices = &polygon_rings.vertices()[segment.begin];
  const auto f = reinterpret_cast<Position *>(atom->f[0]);
  const auto [ex, ey] = polygon_rings.edges(segment);
  const int size = segment.end - segment.begin, k = segment.polygon;
  const double excess = excess_of(k), half_pressure = -0.5 * ka[k] * excess;
  const double per_vertex = -half_pressure * excess / polygon_rings.polygons()[k].size;
  energy += per_vertex * size;

  for (int n = 0; n < size; n++) {
    const double fx = half_pressure * (ey[n] + ey[n + 1]);
    const double fy = -half_pressure * (ex[n] + ex[n + 1]);
    f[vertices[n].i][0] += fx;
    f[vertices[n].i][1] += fy;
    if (vflag_either || eflag_atom) tally(vertices[n], per_vertex, {fx, fy});
  }
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

/* Values may change from one evaluation to the next, those of properties too. */
void FixPolygonArea::find_parameters()
{
  const bool fresh = parameters_of != polygon_rings.refreshed();
  if (!fresh && stiffness.constant() && rest_area.constant()) return;
  parameters_of = polygon_rings.refreshed();

  const bool variables = stiffness.is_variable() || rest_area.is_variable();
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
