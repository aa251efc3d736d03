// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_PAIR_DISK_DRAG_H
#define JAMLAB_PAIR_DISK_DRAG_H

#include "disk_contact.h"
#include "drag_law.h"
#include "pair.h"

#include <vector>

namespace LAMMPS_NS {

/* Disks that repel by E = K (s - r)^exponent, 2 as in pair_style harmonic/cut, and remember who is near to whom.
   Their drag is no force of this style: fix overdamped balances it against the elastic force. */

class PairDiskDrag : public Pair {
 public:
  PairDiskDrag(class LAMMPS *);
  ~PairDiskDrag() override;
  void compute(int, int) override;
  void settings(int, char **) override;
  void coeff(int, char **) override;
  void init_style() override;
  double init_one(int, int) override;
  void write_restart(FILE *) override;
  void read_restart(FILE *) override;
  void write_restart_settings(FILE *) override;
  void read_restart_settings(FILE *) override;
  void write_data(FILE *) override;
  void write_data_all(FILE *) override;
  double single(int, int, int, int, double, double, double, double &) override;
  void *extract(const char *, int &) override;
  double memory_usage() override;

  const std::vector<DiskPair> &pairs() const { return found; }    // of the last force evaluation
  const DragLaw &drag() const { return law; }
  double mean_diameter() const;
  Repulsion repulsion(double strength, double overlap) const { return {strength, overlap, exponent}; }

 private:
  DragLaw law;
  double exponent = 2.0;
  double **strength, **reach;    // K and s of two types
  std::vector<DiskPair> found;

  void allocate();
  void remember(int i, int j, double x, double y, double strength);
};

}    // namespace LAMMPS_NS

#endif
