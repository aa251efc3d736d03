// SPDX-License-Identifier: GPL-2.0-or-later
#include "dense_solver.h"

#include "wide_vectors.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

using namespace LAMMPS_NS;

/* Subtracts a row from others, which begin `stride` apart, times their factors, as far apart. */
JAMLAB_WIDE_VECTORS static void subtract_row(const double *__restrict row, std::size_t length,
                                             const double *factors, std::size_t factor_stride,
                                             double *__restrict rows, std::size_t stride,
                                             std::size_t count)
{
  for (std::size_t k = 0; k < count; k++) {
    const double factor = factors[k * factor_stride];
    if (factor == 0.0) continue;
    double *const to = rows + k * stride;
#pragma omp simd
    for (std::size_t l = 0; l < length; l++) to[l] -= factor * row[l];
  }
}

/* The same for rows whose factors stand before them; finds the largest magnitude that is left in
   each, but for its last number. */
JAMLAB_WIDE_VECTORS static void
subtract_row_and_compare(const double *__restrict row, std::size_t length, double *__restrict rows,
                         std::size_t stride, std::size_t count, double *__restrict largest)
{
  for (std::size_t k = 0; k < count; k++) {
    double *const to = rows + k * stride, factor = to[-1], most = 0.0;
#pragma omp simd reduction(max : most)
    for (std::size_t l = 0; l < length; l++) {
      to[l] -= factor * row[l];
      most = std::max(most, std::fabs(to[l]));
    }
    to[length] -= factor * row[length];
    largest[k] = most;
  }
}

DenseSolver::DenseSolver(std::vector<double> matrix, std::size_t m, double singular) :
    m(m), a(std::move(matrix)), row(m), unknown(m), values(m, 0.0)
{
  std::iota(row.begin(), row.end(), 0);
  std::iota(unknown.begin(), unknown.end(), 0);
  eliminate(singular);
  for (std::size_t k = 0; k < rank; k++) values[unknown[k]] = line(k)[m];
}

void DenseSolver::eliminate(double singular)
{
  std::vector<double> largest(m);    // of each row that has no pivot yet
  for (std::size_t k = 0; k < m; k++)
    for (std::size_t l = 0; l < m; l++) largest[k] = std::max(largest[k], std::fabs(line(k)[l]));
  double largest_pivot = 0.0;
  for (; rank < m; rank++) {
    const std::size_t r =
        std::max_element(largest.begin() + rank, largest.end()) - largest.begin();
    std::size_t c = rank;
    while (c + 1 < m && std::fabs(line(r)[c]) != largest[r]) c++;
    const double pivot = line(r)[c];
    largest_pivot = std::max(largest_pivot, std::fabs(pivot));
    if (!(std::fabs(pivot) > singular * largest_pivot)) break;
    product *= (r == rank) == (c == rank) ? pivot : -pivot;
    std::swap(largest[rank], largest[r]);
    move_pivot(r, c);

    double *const own = line(rank) + rank, *const right = own + 1;
    const std::size_t length = m - rank;
    for (std::size_t l = 0; l < length; l++) right[l] /= pivot;
    subtract_row(right, length, a.data() + rank, m + 1, a.data() + rank + 1, m + 1, rank);
    subtract_row_and_compare(right, length - 1, right + m + 1, m + 1, length - 1,
                             largest.data() + rank + 1);
  }
}

/* Exchanges rows and columns, so that the pivot in row r and column c comes next. */
void DenseSolver::move_pivot(std::size_t r, std::size_t c)
{
  if (r != rank) {
    std::swap_ranges(line(r), line(r) + m + 1, line(rank));
    std::swap(row[r], row[rank]);
  }
  if (c != rank) {
    for (std::size_t k = 0; k < m; k++) std::swap(line(k)[c], line(k)[rank]);
    std::swap(unknown[c], unknown[rank]);
  }
}

void DenseSolver::mark_undetermined(std::vector<bool> &marks) const
{
  for (std::size_t k = rank; k < m; k++) marks[unknown[k]] = marks[row[k]] = true;
}

/* The same steps as for the first right-hand side. Of rows that have had their pivot, those
   that are asked for go on. */
std::vector<double> DenseSolver::solve(const std::vector<double> &rights, std::size_t columns,
                                       const std::vector<std::size_t> &asked) const
{
  std::vector<double> b(m * columns), found(asked.size() * columns, 0.0);
  for (std::size_t k = 0; k < m; k++)
    std::copy_n(&rights[row[k] * columns], columns, &b[k * columns]);
  std::vector<char> goes_on(m, 0);
  for (const std::size_t each : asked) goes_on[each] = 1;
  for (std::size_t k = 0; k < rank; k++) {
    double *const own = &b[k * columns];
    for (std::size_t l = 0; l < columns; l++) own[l] /= line(k)[k];
    for (std::size_t n = 0; n < k; n++)
      if (goes_on[unknown[n]])
        subtract_row(own, columns, line(n) + k, 0, &b[n * columns], columns, 1);
    subtract_row(own, columns, line(k) + m + 1 + k, m + 1, own + columns, columns, m - k - 1);
  }
  std::vector<std::size_t> place(m);
  for (std::size_t k = 0; k < m; k++) place[unknown[k]] = k;
  for (std::size_t n = 0; n < asked.size(); n++)
    if (place[asked[n]] < rank)
      std::copy_n(&b[place[asked[n]] * columns], columns, &found[n * columns]);
  return found;
}
