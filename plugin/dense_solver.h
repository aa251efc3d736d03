// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <cstddef>
#include <vector>

namespace LAMMPS_NS {

/* Solves m equations by Gauss and Jordan's elimination with the largest pivots. A pivot that is not
   above `singular` times the largest one determines nothing: those unknowns are 0. The factors of
   the elimination are kept, for right-hand sides that come later. */
class DenseSolver {
 public:
  // matrix: m rows, row by row, each with m coefficients and a right-hand side
  DenseSolver(std::vector<double> matrix, std::size_t m, double singular = 0.0);

  double determinant() const { return product; }    // of the determined part
  const std::vector<double> &solution() const { return values; }
  // marks unknowns, and equations with them, that no pivot determines
  void mark_undetermined(std::vector<bool> &marks) const;
  // rights: m rows of `columns` right-hand sides; found: as many rows as unknowns are asked for
  std::vector<double> solve(const std::vector<double> &rights, std::size_t columns,
                            const std::vector<std::size_t> &asked) const;

 private:
  std::size_t m, rank = 0;
  std::vector<double> a;    // the eliminated matrix; its columns before a pivot hold factors
  std::vector<std::size_t> row, unknown;    // at each place of the eliminated matrix
  double product = 1.0;
  std::vector<double> values;

  double *line(std::size_t k) { return a.data() + k * (m + 1); }
  const double *line(std::size_t k) const { return a.data() + k * (m + 1); }
  void eliminate(double singular);
  void move_pivot(std::size_t r, std::size_t c);
};

}    // namespace LAMMPS_NS
