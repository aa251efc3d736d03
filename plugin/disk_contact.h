// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_DISK_CONTACT_H
#define JAMLAB_DISK_CONTACT_H

namespace LAMMPS_NS {

/* Two disks of the neighbor list, which may touch before the list is made anew. A pair between ranks, or
   with a periodic image, is seen by both its owners where newton is off: each then counts half of it. */

struct DiskPair {
  int i, j;             // local or ghost index
  double x, y;          // from i to j
  double reach;         // distance at which they touch
  double stiffness;     // k
  double radius_i, radius_j;
  double share;         // 1, or 1/2 of a pair that two ranks see
};

/* Two disks that touch. */

struct DiskContact {
  int i, j;
  double nx, ny;        // unit vector from i to j
  double distance;      // of the centers
  double stiffness;
  double force;         // elastic, k times the overlap, a push
  double arm_i, arm_j;  // from the center to where the surfaces slide
  double share;
};

}    // namespace LAMMPS_NS

#endif
