// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_COMPUTE_POLYGON_H
#define JAMLAB_COMPUTE_POLYGON_H

#include "compute.h"
#include "polygon_outline.h"

#include <vector>

namespace LAMMPS_NS {

/* Global array, one row per molecule ID: area a, perimeter p and shape factor
   A = p^2 / (4 pi a) of the bare polygon, without the rim of the circulo-lines;
   number of pairs of its edges that cross, 0 unless it has folded over itself. */

class ComputePolygon : public Compute {
 public:
  ComputePolygon(class LAMMPS *, int, char **);
  ~ComputePolygon() override;
  void init() override;
  void compute_array() override;
  double memory_usage() override;

 private:
  PolygonOutline outline;
  std::vector<double> area, perimeter, crossing;
};

}    // namespace LAMMPS_NS

#endif
