// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <cstddef>

namespace LAMMPS_NS {

/* Cholesky factors consist of dense panels: `width` columns of `height` numbers, column by column,
   `stride` apart. The first `width` rows are a lower triangle. Numbers above the diagonal or beyond
   the height have no meaning. The diagonal of factors holds reciprocals. */
using Stride = std::ptrdiff_t;
inline constexpr int PANEL_ROWS = 8;    // are read and written together, beyond the height too

inline int padded(int height) { return height + PANEL_ROWS; }

// Returns false if the matrix is not positive definite. `room`: for so many padded columns.
inline constexpr int PANEL_COLUMNS = 32;
bool factorise_panel(double *panel, int width, int height, Stride stride, double *room);

// Finds the lower triangle of rows rows^T, for `height` rows of a panel, column by column, which
// are `apart` from each other.
void multiply_panel(const double *rows, int width, int height, Stride stride, double *product,
                    Stride apart);

// These take one step of solving with the factors and with their transpose, in blocks of 1 to 3
// columns. `own`, of `width` numbers, belongs to the columns, and `below` to the rows that follow.
void solve_down(int block, const double *panel, int width, int rows, Stride stride, double *own,
                double *below);
void solve_up(int block, const double *panel, int width, int rows, Stride stride, double *own,
              const double *below);

// The same for four right-hand sides at once, whose numbers of one row lie together.
inline constexpr int TOGETHER = 4;
void solve_down_four(const double *panel, int width, int rows, Stride stride, double *own,
                     double *below);
void solve_up_four(const double *panel, int width, int rows, Stride stride, double *own,
                   const double *below);

}    // namespace LAMMPS_NS
