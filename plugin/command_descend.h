// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "block_assembly.h"
#include "command_forces.h"
#include "droplet_stiffness.h"
#include "kernels/lbfgs_descent.h"

#include <cmath>
#include <vector>

namespace LAMMPS_NS {

/* The command jamlab/descend takes droplets to a minimum of their energy by LbfgsDescent, of which
   it is the model. It runs on one rank. */
class CommandDescend : public CommandForces {
 public:
  using Values = jamlab::Values;    // x and y of each vertex, by atom ID

  CommandDescend(class LAMMPS *);
  void command(int, char **) override;

  double energy() const { return present_energy; }
  const Values &forces() const { return present_forces; }
  double largest_force() const;
  double rounding(double digits) const { return digits * std::fabs(present_energy); }
  bool ended() const;
  void mark() { marked = x; }
  void back();
  void go(const Values &step, double length);
  void moved(Values &change) const;
  bool assemble(double beyond);
  bool factorise(double shift);
  double stiffness() const { return std::fabs(factors.mean_diagonal()); }
  void solve(const Values &force, Values &step, bool roughly);

 private:
  struct Numbers {    // arguments
    double force, steps, loose_force, loose_energy;
    jamlab::LbfgsNumbers method;
  } numbers;

  class PairCirculoline *pair;
  DropletStiffness stiff;
  std::vector<DropletMeeting> meetings;
  BlockAssembly<2> matrix;
  BlockCholesky<2> factors;
  bool filled = false;        // with the matrix, not its factors
  bool crossed = false;       // outlines
  std::vector<int> row;       // of each atom ID in the factors
  std::vector<char> still;    // of each atom ID, whether it is fixed
  Values x, marked, present_forces, column;
  double present_energy = 0.0;
  int evaluations = 0;

  void read(int, char **);
  void read_positions();
  void put_positions() const;
  void evaluate();
};

}    // namespace LAMMPS_NS
