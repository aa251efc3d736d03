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
  double stiffness;     // k
  double force;         // elastic, k times the overlap, a push
  double arm_i, arm_j;  // from the center to where the surfaces slide
  double share;         // 1, or 1/2 of a contact that two ranks see
};

/* Drag on the relative velocity at a contact, Baumgarten & Tighe eqs 5, 6 and 9: with the approach
   v_n and the slip v_t, the dissipation function is
   R = sum k tau^alpha/(alpha + 1) (v_n^2 + beta v_t^2)^((alpha + 1)/2), lengths in the unit of length. */

struct DragLaw {
  double beta = 1.0, tau = 1.0, alpha = 1.0;
  bool arms_to_contact = false;    // levers end in the middle of the overlap, not at the radius
};

}    // namespace LAMMPS_NS

#endif
