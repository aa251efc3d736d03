// SPDX-License-Identifier: GPL-2.0-or-later

#pragma once

namespace LAMMPS_NS {

/* Dense panels of Cholesky factors: `width` columns of `height` numbers, of which the first `width` rows are a lower
   triangle, one column after the other, `stride` apart. What stands above the diagonal or beyond the height means
   nothing. In factors, the diagonal holds the reciprocals of theirs. */
inline constexpr int PANEL_ROWS = 8;    // that are read and written together, beyond the height too

inline int padded(int height) { return height + PANEL_ROWS; }

bool factorise_panel(double *panel, int width, int height, int stride);    // false: not positive definite

// lower triangle of rows rows^T, for `height` rows of a panel: column by column, `apart` from each other
void multiply_panel(const double *rows, int width, int height, int stride, double *product, int apart);

// one step of solving with the factors and with their transpose, in blocks of 2 or 3 columns: own, `width` numbers,
// belong to the columns, below to the rows that follow
void solve_down(int block, const double *panel, int width, int rows, int stride, double *own, double *below);
void solve_up(int block, const double *panel, int width, int rows, int stride, double *own, const double *below);

}    // namespace LAMMPS_NS
