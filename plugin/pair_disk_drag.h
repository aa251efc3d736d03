// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "disk_contact.h"
#include "drag_law.h"
#include "atom.h"
#include "comm.h"
#include "force.h"
#include "pair.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {

/* Disks repel by E = K (s - r)^exponent, 2 as in pair_style harmonic/cut; the style remembers which
   are near. K and s are those of two types; or s is half the sum of two diameters of the atoms' own
   and K is that of s = 1, times s^power: types then are classes of size whose s is how far two of
   them may reach. With a shell a, disks attract: E = K ((s - r)^2 - 2 a^2) up to r = s + a, and
   -K (s + 2 a - r)^2 up to s + 2 a. An atom of diameter 0 is a flat wall: all disks, of one rank,
   meet it at their distance along y. Their drag is no force of this style: fix overdamped balances
   it against the elastic force. With `elastic off` the energy of two disks comes from the other
   styles of hybrid/overlay, which fix overdamped asks by `single`. */
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
  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;
  double memory_usage() override
  {
    return Pair::memory_usage() + found.capacity() * sizeof(DiskPair);
  }

  const std::vector<DiskPair> &pairs() const { return found; }    // of the last force evaluation
  // one rank alone counts a pair once, and then knows the owner of each ghost
  bool owns_all() const { return comm->nprocs == 1 && force->newton_pair; }
  int owner(int i) const { return i < atom->nlocal ? i : atom->map(atom->tag[i]); }
  const DragLaw &drag() const { return law; }
  double mean_diameter(bool with_walls);    // flat ones
  double unit_length();    // by which turning disks are compared with moving ones
  bool is_elastic() const { return elastic; }
  // `depth`: cutoff less distance, the overlap itself of disks without a shell
  Repulsion push(const DiskPair &p, double depth) const
  {
    return elastic ? repulsion(p.strength, depth) : push_of_others(p, depth);
  }
  double edge_stiffness(const DiskPair &p) const    // of two disks that begin to touch
  {
    return elastic ? 2.0 * p.strength : push_of_others(p, 0.0).stiffness;
  }
  Repulsion repulsion(double strength, double depth) const
  {
    Repulsion push(strength, depth, exponent);    // its stiffness is that of drag: never negative
    if (shell == 0.0) return push;
    push.overlap = depth - 2.0 * shell;
    const bool inner = depth >= shell;
    const double well = inner ? push.overlap * push.overlap - 2.0 * shell * shell : -depth * depth;
    push.energy = strength * well;
    push.force = 2.0 * strength * (inner ? push.overlap : -depth);
    return push;
  }

 private:
  DragLaw law;
  double exponent = 2.0;
  bool elastic = true;
  double shell = 0.0;    // width of the attraction up to its maximum; it ends at twice that
  double **strength, **reach;    // K and s of two types
  std::vector<DiskPair> found;
  std::string sizes;       // per-atom property with the diameters; empty: diameters of the types
  double power = 0.0;      // of s in K, with diameters of the atoms' own
  std::vector<double> own;    // their diameters, of ghosts too, at the last force evaluation

  Repulsion push_of_others(const DiskPair &, double depth) const;
  void find_sizes();
  void check_reach() const;
  double diameter(int i, int type) const { return sizes.empty() ? reach[type][type] : own[i]; }
  bool is_wall(int i) const { return diameter(i, atom->type[i]) == 0.0; }
  double contact_distance(int i, int j, int itype, int jtype) const
  {
    return sizes.empty() ? reach[itype][jtype] : 0.5 * (own[i] + own[j]);
  }
  double stiffness(int itype, int jtype, double s) const
  {
    return power != 0.0 ? strength[itype][jtype] * pow(s, power) : strength[itype][jtype];
  }
  void allocate();
};

}    // namespace LAMMPS_NS
