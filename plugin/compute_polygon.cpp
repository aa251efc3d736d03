// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "compute_polygon.h"

#include "error.h"
#include "memory.h"
#include "update.h"

using namespace LAMMPS_NS;

static constexpr char WHO[] = "Compute polygon";
static constexpr double FOUR_PI = 12.566370614359172954;

/* ---------------------------------------------------------------------- */

ComputePolygon::ComputePolygon(LAMMPS *lmp, int narg, char **arg) :
    Compute(lmp, narg, arg), outline(lmp)
{
  if (narg != 3) error->all(FLERR, "Compute polygon takes no arguments");

  array_flag = 1;
  extarray = 0;
  size_array_cols = 4;
  outline.init(WHO, groupbit);
  size_array_rows = static_cast<int>(outline.count());
  memory->create(array, size_array_rows, size_array_cols, "polygon:array");
}

/* ---------------------------------------------------------------------- */

ComputePolygon::~ComputePolygon()
{
  memory->destroy(array);
}

/* ---------------------------------------------------------------------- */

void ComputePolygon::init()
{
  outline.init(WHO, groupbit);
  if (outline.count() != size_array_rows)
    error->all(FLERR, "Compute polygon: there are {} molecules now and were {} when it was defined",
               outline.count(), size_array_rows);
}

/* ---------------------------------------------------------------------- */

void ComputePolygon::compute_array()
{
  invoked_array = update->ntimestep;
  outline.refresh(WHO, groupbit);
  outline.areas(area);
  outline.perimeters(perimeter);
  outline.crossings(crossing);

  for (int m = 1; m <= size_array_rows; m++) {
    double *row = array[m - 1];
    row[0] = area[m];
    row[1] = perimeter[m];
    row[2] = area[m] > 0.0 ? perimeter[m] * perimeter[m] / (FOUR_PI * area[m]) : 0.0;
    row[3] = crossing[m];
  }
}

/* ---------------------------------------------------------------------- */

double ComputePolygon::memory_usage()
{
  return (area.capacity() + perimeter.capacity() + crossing.capacity()) * sizeof(double) +
      4.0 * size_array_rows * sizeof(double);
}
