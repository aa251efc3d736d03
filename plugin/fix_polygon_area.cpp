// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "fix_polygon_area.h"

#include "atom.h"
#include "error.h"
#include "neighbor.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cstring>
#include <vector>

using namespace LAMMPS_NS;
using namespace FixConst;

static constexpr char WHO[] = "Fix polygon/area";

/* ----------------------------------------------------------------------
   fix ID group polygon/area ka d_name
------------------------------------------------------------------------- */

FixPolygonArea::FixPolygonArea(LAMMPS *lmp, int narg, char **arg) :
    Fix(lmp, narg, arg), energy(0.0), outline(lmp)
{
  if (narg != 5)
    error->all(FLERR, "Fix polygon/area needs: ka d_name, name from fix property/atom");

  ka = utils::numeric(FLERR, arg[3], false, lmp);
  if (ka < 0.0) error->all(FLERR, "Fix polygon/area: ka {} must not be negative", arg[3]);
  if (strncmp(arg[4], "d_", 2) != 0)
    error->all(FLERR, "Fix polygon/area: rest area {} must be a per-atom property d_name", arg[4]);
  property = arg[4] + 2;

  scalar_flag = 1;
  global_freq = 1;
  extscalar = 1;
  energy_global_flag = 1;
  virial_global_flag = virial_peratom_flag = 1;
  thermo_energy = thermo_virial = 1;
}

/* ---------------------------------------------------------------------- */

int FixPolygonArea::setmask()
{
  return POST_FORCE | MIN_POST_FORCE;
}

/* ---------------------------------------------------------------------- */

void FixPolygonArea::init()
{
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "Fix polygon/area: run_style respa leaves its forces out: use run_style verlet");
  outline.init(WHO, groupbit);

  int is_double, columns;
  const int index = atom->find_custom(property.c_str(), is_double, columns);
  if (index < 0 || !is_double || columns > 0)
    error->all(FLERR, "Fix polygon/area: no per-atom property d_{}: use fix property/atom", property);

  const double *a0 = atom->dvector[index];
  rest_area.assign(outline.count() + 1, 0.0);
  std::vector<double> smallest(outline.count() + 1, 1.0e300);
  for (int i = 0; i < atom->nlocal; i++) {
    if (!(atom->mask[i] & groupbit) || atom->molecule[i] == 0) continue;
    if (a0[i] <= 0.0)
      error->one(FLERR, "Fix polygon/area: rest area d_{} of atom {} is {}, must be positive",
                 property, atom->tag[i], a0[i]);
    const tagint m = atom->molecule[i];
    rest_area[m] = std::max(rest_area[m], a0[i]);
    smallest[m] = std::min(smallest[m], a0[i]);
  }
  const int size = static_cast<int>(rest_area.size());
  MPI_Allreduce(MPI_IN_PLACE, rest_area.data(), size, MPI_DOUBLE, MPI_MAX, world);
  MPI_Allreduce(MPI_IN_PLACE, smallest.data(), size, MPI_DOUBLE, MPI_MIN, world);
  for (int m = 1; m < size; m++)
    if (rest_area[m] > 0.0 && smallest[m] != rest_area[m])
      error->all(FLERR, "Fix polygon/area: d_{} differs between the vertices of polygon {}: {} and {}",
                 property, m, smallest[m], rest_area[m]);
}

/* ---------------------------------------------------------------------- */

void FixPolygonArea::setup(int vflag)
{
  post_force(vflag);
}

/* ---------------------------------------------------------------------- */

void FixPolygonArea::min_setup(int vflag)
{
  post_force(vflag);
}

/* ----------------------------------------------------------------------
   f_i = -ka (a - a0) da/dx_i, da/dx_i = (1/2) (y_next - y_prev, x_prev - x_next).
   Every rank adds the force on its own vertices only: nothing to send back.
------------------------------------------------------------------------- */

void FixPolygonArea::post_force(int vflag)
{
  v_init(vflag);
  if (neighbor->ago == 0) outline.refresh(WHO, groupbit);
  outline.areas(area);

  energy = 0.0;
  for (std::size_t m = 1; m < area.size(); m++)
    energy += 0.5 * ka * (area[m] - rest_area[m]) * (area[m] - rest_area[m]);

  const double *const *x = atom->x;
  double **f = atom->f;
  for (const auto &vertex : outline.vertices()) {
    const int i = vertex.i;
    const tagint m = atom->molecule[i];
    const double half_pressure = -0.5 * ka * (area[m] - rest_area[m]);
    const double fx = half_pressure * (x[vertex.next][1] - x[vertex.prev][1]);
    const double fy = half_pressure * (x[vertex.prev][0] - x[vertex.next][0]);
    f[i][0] += fx;
    f[i][1] += fy;

    if (evflag) {
      double r[2];
      outline.position(vertex, r);
      double v[6] = {r[0] * fx, r[1] * fy, 0.0, r[0] * fy, 0.0, 0.0};
      v_tally(i, v);
    }
  }
}

/* ---------------------------------------------------------------------- */

void FixPolygonArea::min_post_force(int vflag)
{
  post_force(vflag);
}

/* ---------------------------------------------------------------------- */

double FixPolygonArea::compute_scalar()
{
  return energy;
}

/* ---------------------------------------------------------------------- */

void *FixPolygonArea::extract(const char *str, int &dim)
{
  dim = 0;
  if (strcmp(str, "ka") == 0) return &ka;
  return nullptr;
}

/* ---------------------------------------------------------------------- */

double FixPolygonArea::memory_usage()
{
  return (rest_area.capacity() + area.capacity()) * sizeof(double) +
      outline.vertices().capacity() * sizeof(PolygonOutline::Vertex);
}
