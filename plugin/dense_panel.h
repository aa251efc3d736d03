// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <cstddef>

namespace LAMMPS_NS {

/* Factors consist of dense panels: `width` columns of `height` numbers, column by column, `stride`
   apart, with room for PANEL_ROWS more numbers below each. The first `width` rows are a lower
   triangle. Numbers above the diagonal have no meaning, and in a matrix those below the height have
   none; in factors these are zeros, and the diagonal holds reciprocals. Factors are L S L^T: S = 1
   of a positive definite matrix; of another one S holds signs. */
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
  // Take one step of solving with L, down, or with L^T, up. `numbers` belong to the columns and
  // of the rows that follow, and then PANEL_ROWS zeros.
  template <class Number>
  using Step = void(const Number *panel, int width, int height, Stride stride, Number *numbers);
  // Take these steps for TOGETHER right-hand sides. `own`, of `width` rows, belongs to the columns,
  // and `below` to the rows that follow.
  using DownFour = void(const double *panel, int width, int rows, Stride stride, double *own,
                        double *below);
  using UpFour = void(const double *panel, int width, int rows, Stride stride, double *own,
                      const double *below);
  Factorise *factorise, *factorise_signed;
  Multiply *multiply, *multiply_signed;
  Step<double> *down, *up;
  Step<double> *up_disks;    // of panels with three columns for each disk
  Step<float> *down_rough, *up_rough;
  DownFour *down_four;
  UpFour *up_four;
};

const DensePanels &dense_panels();

}    // namespace LAMMPS_NS
