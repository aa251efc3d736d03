// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "block_cholesky.h"
#include "command_forces.h"
#include "droplet_stiffness.h"

#include <vector>

namespace LAMMPS_NS {

/* The command jamlab/descend takes droplets to a minimum of their energy by limited-memory BFGS,
   which starts from the inverse of the Hessian: vertices are almost free to slide along a flat
   while contacts and areas are stiff. A shift makes the Hessian positive definite. Its factors
   serve for several steps, whose pairs correct them. The command runs on one rank.

   Near the minimum the energy, which contains the whole perimeter, has no digits left for a line
   search. There the work of the force along the step, (F0 + F1) . s/2, replaces the fall of the
   energy. */
class CommandDescend : public CommandForces {
 public:
  CommandDescend(class LAMMPS *);
  void command(int, char **) override;

 private:
  using Vector = std::vector<double>;    // x and y of each vertex, by atom ID
  struct Point {
    Vector x, force;
    double energy;
  };
  struct Pair {    // a step and the change of the force along it
    Vector change, bend;
    double curvature, along;
  };
  struct Numbers {    // arguments, as in jamlab.protocols.preconditioned_lbfgs.LbfgsSettings
    double force, steps, loose_force, loose_energy, refresh, reach, longer, closing, trials;
    double energy_digits, sufficient, curved, shift, least_shift, first_shift, definite;
  } numbers;
  struct Counts {
    double steps, forces, factors, refused, stuck, bent, largest_force, shift;
    bool crossed;
  } counts;

  class PairCirculoline *pair;
  DropletStiffness stiffness;
  std::vector<DropletMeeting> meetings;
  BlockCholesky<2> factors;
  std::vector<int> row;    // of each atom ID in the factors
  std::vector<char> still;    // of each atom ID, whether it is fixed
  Vector column;
  std::vector<Pair> pairs;
  std::size_t known = 0;    // pairs
  double moved;             // longest move of a coordinate in the last step

  void read(int, char **);
  void read_positions(Vector &);
  void put_positions(const Vector &) const;
  void evaluate(Point &);
  void descend(Point &);
  bool factorise(double largest_force);
  void solve(const Vector &force, Vector &step);
  void inverse_times(const Vector &force, Vector &step);
  bool search_line(const Point &, const Vector &step, double longest, Point &trial);
  bool add_pair(const Point &, const Point &trial);
  bool enough(double largest_force) const;
};

}    // namespace LAMMPS_NS
