// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_DISK_CONTACT_H
#define JAMLAB_DISK_CONTACT_H

namespace LAMMPS_NS {

/* Two overlapping disks. A contact between ranks, or with a periodic image, is seen by both its
   owners where newton is off: each then counts half of it. */

struct DiskContact {
  int i, j;             // local or ghost index
  double nx, ny;        // unit vector from i to j
  double distance;      // of the centers
  double stiffness;     // second derivative of the energy
  double force;         // elastic, a push
  double energy;
  double arm_i, arm_j;  // from the center to where the surfaces slide
  double share;         // 1, or 1/2 of a contact that two ranks see
};

}    // namespace LAMMPS_NS

#endif
