// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <cstddef>

namespace LAMMPS_NS {

/* Factors consist of dense panels: `width` columns of `height` numbers, column by column, `stride`
   apart. The first `width` rows are a lower triangle. Numbers above the diagonal or beyond the
   height have no meaning. The diagonal of factors holds reciprocals. Factors are L S L^T: S = 1 of
   a positive definite matrix; of another one S holds signs. */
using Stride = std::ptrdiff_t;
inline constexpr int PANEL_ROWS = 8;    // are read and written together, beyond the height too
inline constexpr int PANEL_COLUMNS = 32;    // of a product that are found together
inline constexpr int TOGETHER = 4;    // right-hand sides; their numbers of one row lie together

inline int padded(int height) { return height + PANEL_ROWS; }

/* DensePanels are the functions that suit this processor best. All give the same digits. */
struct DensePanels {
  // Return the number of columns that have pivots above `least`: `width`, or where they stopped.
  // `room`: for PANEL_COLUMNS padded columns.
  using Factorise = int(double *panel, int width, int height, Stride stride, double *room,
                        double *signs, double least);
  // Find the lower triangle of rows S rows^T, for `height` rows of a panel, column by column, which
  // are `apart` from each other.
  using Multiply = void(const double *rows, int width, int height, Stride stride,
                        const double *signs, double *product, Stride apart);
  // Take one step of solving with L and with L^T, in blocks of 1 to 3 columns. `own`, of `width`
  // numbers, belongs to the columns, and `below` to the rows that follow.
  using Down = void(const double *panel, int width, int rows, Stride stride, double *own,
                    double *below);
  using Up = void(const double *panel, int width, int rows, Stride stride, double *own,
                  const double *below);
  // Take these steps in single precision. `numbers` are those of the columns and of the rows that
  // follow. They and the panel hold zeros in PANEL_ROWS rows beyond the height.
  using Rough = void(const float *panel, int width, int height, Stride stride, float *numbers);
  Factorise *factorise, *factorise_signed;
  Multiply *multiply, *multiply_signed;
  Down *down[3];
  Up *up[3];
  Down *down_four;
  Up *up_four;
  Rough *down_rough, *up_rough;
};

const DensePanels &dense_panels();

}    // namespace LAMMPS_NS
