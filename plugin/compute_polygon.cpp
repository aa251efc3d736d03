// SPDX-License-Identifier: GPL-2.0-or-later
#include "compute_polygon.h"

#include "atom.h"
#include "comm.h"
#include "error.h"
#include "fix_polygon_outline.h"
#include "memory.h"
#include "update.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr char WHO[] = "Compute polygon";
static constexpr double FOUR_PI = 12.566370614359172954;
enum { AREA, PERIMETER, SHAPE_FACTOR, CROSSINGS, MOLECULE, COLUMNS };

ComputePolygon::ComputePolygon(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), polygon_rings(lmp, WHO)
{
  if (narg != 3) error->all(FLERR, "Compute polygon takes no arguments");

  array_flag = 1;
  extarray = 0;
  size_array_cols = COLUMNS;
  size_array_rows_variable = 1;
  ComputePolygon::init();
}

ComputePolygon::~ComputePolygon()
{
  memory->destroy(array);
}

void ComputePolygon::init()
{
  polygon_rings.init(groupbit);
  resize();
}

void ComputePolygon::resize()
{
  molecules = polygon_rings.molecules();
  size_array_rows = static_cast<int>(molecules.size());
  memory->grow(array, std::max(1, size_array_rows), COLUMNS, "polygon:array");
}

int ComputePolygon::lock_length()
{
  polygon_rings.refresh(groupbit);
  resize();
  return size_array_rows;
}

void ComputePolygon::compute_array()
{
  invoked_array = update->ntimestep;
  comm->forward_comm();    // fix deform moves atoms at the end of a step, but not ghosts
  polygon_rings.refresh(groupbit);
  resize();

  const auto &polygons = polygon_rings.polygons();
  perimeter.assign(polygons.size(), 0.0);
  polygon_rings.areas_and_centers(shape, false, [&](const PolygonRings::RingSegment &segment) {
    const PolygonRings::Edges edges = polygon_rings.edges(segment);
    for (int n = 1; n <= segment.end - segment.begin; n++)
      perimeter[segment.polygon] += std::hypot(edges.x[n], edges.y[n]);
  });
  polygon_rings.sum(perimeter, 1);

  double *const all = size_array_rows ? array[0] : nullptr;
  std::fill_n(all, size_array_rows * COLUMNS, 0.0);
  const auto links = FixPolygonOutline::shared(lmp, WHO)->present_links();    // with crossings
  for (std::size_t k = 0; k < polygons.size(); k++) {
    if (polygons[k].first < 0) continue;
    double *const row = array[row_of(polygons[k].molecule)];
    const double a = shape[3 * k], p = perimeter[k];
    row[AREA] = a;
    row[PERIMETER] = p;
    row[SHAPE_FACTOR] = a > 0.0 ? p * p / (FOUR_PI * a) : 0.0;
    row[CROSSINGS] = links[polygons[k].first].crossings;
    row[MOLECULE] = static_cast<double>(polygons[k].molecule);
  }
  MPI_Allreduce(MPI_IN_PLACE, all, size_array_rows * COLUMNS, MPI_DOUBLE, MPI_SUM, world);
}
