// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "compute.h"
#include "polygon_rings.h"

#include <algorithm>
#include <vector>

namespace LAMMPS_NS {

/* The global array has one row for each closed ring of the group, in the order of molecule IDs:

   1    area a of the bare polygon, without the rim of the circulo-lines
   2    perimeter p
   3    shape factor A = p^2 / (4 pi a)
   4    number of pairs of its edges that cross, 0 unless it has folded over itself
   5    molecule ID */
class ComputePolygon : public Compute {
 public:
  ComputePolygon(class LAMMPS *, int, char **);
  ~ComputePolygon() override;
  void init() override;
  void compute_array() override;
  int lock_length() override;    // rows now, for fix ave/time: polygons may come and go
  double memory_usage() override { return bytes(shape, perimeter) + polygon_rings.memory_usage(); }

 private:
  PolygonRings polygon_rings;
  std::vector<tagint> molecules;    // one for each row
  std::vector<double> shape, perimeter;

  void resize();
  std::size_t row_of(tagint molecule) const
  {
    return std::lower_bound(molecules.begin(), molecules.end(), molecule) - molecules.begin();
  }
};

}    // namespace LAMMPS_NS
