// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "bond.h"

namespace LAMMPS_NS {

/* The line tension of an edge without rest length has the energy E = gamma sqrt(l^2 + eta^2). With
   eta = 0 this is the first term of Boromand et al. eq 7; eta > 0 smooths the direction of the edge
   as l -> 0. */
class BondLineTension : public Bond {
 public:
  BondLineTension(class LAMMPS *);
  ~BondLineTension() override;
  void compute(int, int) override;
  void coeff(int, char **) override;
  void init_style() override;
  double equilibrium_distance(int) override { return 0.0; }
  void write_restart(FILE *) override;
  void read_restart(FILE *) override;
  void write_data(FILE *) override;
  double single(int, double, int, int, double &) override;
  void *extract(const char *, int &) override;

 protected:
  double *gamma, *eta;

  void allocate();

 private:
  struct Row;
  struct Block;
  void measure(const Row *, int count, Block &) const;
  void add_pulls(const Row *, int count, const Block &);
};

}    // namespace LAMMPS_NS
