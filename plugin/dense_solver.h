// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

namespace LAMMPS_NS {

/* Solves equations by Gauss and Jordan's elimination with the largest pivots. The matrix has m
   rows, row by row; the columns behind m are right-hand sides, which become the solutions. A pivot
   that is not above `singular` times the largest one determines nothing: those unknowns are 0, and
   listed in `undetermined`. The determinant of the determined part is returned. */
inline double solve_dense(std::vector<double> &matrix, std::size_t m, std::size_t columns,
                          double singular = 0.0, std::vector<bool> *undetermined = nullptr)
{
  std::vector<std::size_t> row(m), unknown(m);
  std::iota(row.begin(), row.end(), 0);
  std::iota(unknown.begin(), unknown.end(), 0);
  const auto at = [&](std::size_t k, std::size_t l) -> double & {
    return matrix[row[k] * columns + (l < m ? unknown[l] : l)];
  };
  double determinant = 1.0, largest = 0.0;
  std::size_t rank = 0;
  for (; rank < m; rank++) {
    std::size_t r = rank, c = rank;
    for (std::size_t k = rank; k < m; k++)
      for (std::size_t l = rank; l < m; l++)
        if (std::fabs(at(k, l)) > std::fabs(at(r, c))) {
          r = k;
          c = l;
        }
    largest = std::max(largest, std::fabs(at(r, c)));
    if (!(std::fabs(at(r, c)) > singular * largest)) break;
    determinant *= (r == rank) == (c == rank) ? at(r, c) : -at(r, c);
    std::swap(row[rank], row[r]);
    std::swap(unknown[rank], unknown[c]);
    for (std::size_t l = columns; l-- > rank;) at(rank, l) /= at(rank, rank);
    for (std::size_t k = 0; k < m; k++) {
      const double factor = at(k, rank);
      if (k == rank || factor == 0.0) continue;
      for (std::size_t l = rank; l < columns; l++) at(k, l) -= factor * at(rank, l);
    }
  }
  const std::vector<double> eliminated(matrix);
  for (std::size_t k = 0; k < m; k++) {
    for (std::size_t l = m; l < columns; l++)
      matrix[unknown[k] * columns + l] = k < rank ? eliminated[row[k] * columns + l] : 0.0;
    if (k >= rank && undetermined) (*undetermined)[unknown[k]] = (*undetermined)[row[k]] = true;
  }
  return determinant;
}

}    // namespace LAMMPS_NS
