// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_FIX_POLYGON_AREA_H
#define JAMLAB_FIX_POLYGON_AREA_H

#include "fix.h"
#include "polygon_outline.h"

#include <vector>

namespace LAMMPS_NS {

/* Area elasticity of polygons, second term of Boromand et al. eq 7:
   E = (ka/2) sum_m (a_m - a0_m)^2. a0 is read from a per-atom property, the
   same on all vertices of a polygon. */

class FixPolygonArea : public Fix {
 public:
  FixPolygonArea(class LAMMPS *, int, char **);
  int setmask() override;
  void init() override;
  void setup(int) override;
  void min_setup(int) override;
  void post_force(int) override;
  void min_post_force(int) override;
  double compute_scalar() override;
  void *extract(const char *, int &) override;
  double memory_usage() override;

 protected:
  double ka, energy;
  std::string property;    // name of the per-atom property that holds a0
  std::vector<double> rest_area, area;
  PolygonOutline outline;
};

}    // namespace LAMMPS_NS

#endif
