// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_DISK_DRAG_H
#define JAMLAB_DISK_DRAG_H

#include "disk_contact.h"
#include "drag_solver.h"

#include <cmath>

namespace LAMMPS_NS {

/* Drag of disks: on approach and slip at their contacts, those that pair_style disk/drag has found. */

class DiskDrag : public DragSolver {
 public:
  DiskDrag(MPI_Comm world, GhostExchange &exchange, const Settings &settings, const class PairDiskDrag &pair);
  void take(int nlocal, int nghost, double ahead) override;
  void let_go_of_loose(Motions &u) override;
  double elastic_moment() const override;
  FlowSums add_up(const Motions &u, double rate) override;
  double least_relaxation_time() const override;
  double memory_usage() const override;

 private:
  const std::vector<DiskContact> &contacts;
  std::vector<double> weights;    // drag over velocity of approach
  double flow_relaxation = HUGE_VAL;    // time in which a free rate relaxes while no disk leaves the affine flow
  Motions blocks[2];

  void find_weights(const Motions &u, double rate) override;
  void find_preconditioner(bool free_rate) override;
  void multiply(Motions &p, double rate, Motions &out, double &power, double &flow) override;
  double rounding() const override;
  void slip(const DiskContact &, const Motions &u, double rate, double &approach, double &slide) const;
};

}    // namespace LAMMPS_NS

#endif
