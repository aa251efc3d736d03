// SPDX-License-Identifier: GPL-2.0-or-later

#pragma once

#include "compute.h"

namespace LAMMPS_NS {

/* compute ID group1 polygon/group/group group2: energy of the contacts between two
   groups (scalar) and force on the first by the second (vector of 3). A contact is
   between them if one holds its vertex and the other the first vertex of its edge. */
class ComputePolygonGroup : public Compute {
 public:
  ComputePolygonGroup(class LAMMPS *, int, char **);
  ~ComputePolygonGroup() override;
  void init() override;
  double compute_scalar() override;
  void compute_vector() override;

 private:
  class PairCirculoline *pair;
  int otherbit;
  double energy;

  void sum();
};

}    // namespace LAMMPS_NS
