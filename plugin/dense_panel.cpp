// SPDX-License-Identifier: GPL-2.0-or-later
#include "dense_panel.h"

#include "wide_vectors.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#define ALWAYS_INLINE inline __attribute__((always_inline))

using namespace LAMMPS_NS;

static constexpr int COLUMNS = 4;    // of a product that are found together with PANEL_ROWS rows

/* sums[q][r] becomes the sum over k < depth of a[r] b[q] in column k. */
using Four = double __attribute__((vector_size(32), aligned(8), may_alias));
#define four(from) *reinterpret_cast<const Four *>(from)

#define MULTIPLY(a, b, depth, stride, sums)                                                 \
  do {                                                                                      \
    Four s00 = {}, s01 = {}, s10 = {}, s11 = {}, s20 = {}, s21 = {}, s30 = {}, s31 = {};    \
    const double *pa = (a), *pb = (b);                                                      \
    for (int k = 0; k < (depth); k++, pa += (stride), pb += (stride)) {                     \
      const Four low = four(pa), high = four(pa + 4);                                       \
      s00 += low * pb[0];                                                                   \
      s01 += high * pb[0];                                                                  \
      s10 += low * pb[1];                                                                   \
      s11 += high * pb[1];                                                                  \
      s20 += low * pb[2];                                                                   \
      s21 += high * pb[2];                                                                  \
      s30 += low * pb[3];                                                                   \
      s31 += high * pb[3];                                                                  \
    }                                                                                       \
    sums[0] = s00; sums[1] = s01; sums[2] = s10; sums[3] = s11;                             \
    sums[4] = s20; sums[5] = s21; sums[6] = s30; sums[7] = s31;                             \
  } while (0)

JAMLAB_WIDE_VECTORS bool LAMMPS_NS::factorise_panel(double *panel, int width, int height,
                                                    Stride stride)
{
  for (int first = 0; first < width; first += COLUMNS) {
    const int last = std::min(first + COLUMNS, width);
    if (first)
      for (int r = first; r < height; r += PANEL_ROWS) {
        Four sums[2 * COLUMNS];
        MULTIPLY(panel + r, panel + first, first, stride, sums);
        for (int c = first; c < last; c++) {
          Four *const to = reinterpret_cast<Four *>(panel + c * stride + r);
          to[0] -= sums[2 * (c - first)];
          to[1] -= sums[2 * (c - first) + 1];
        }
      }
    for (int c = first; c < last; c++) {
      double *const __restrict own = panel + c * stride;
      for (int b = first; b < c; b++) {
        const double *const __restrict before = panel + b * stride;
        const double factor = before[c];
        for (int r = c; r < height; r++) own[r] -= factor * before[r];
      }
      if (!(own[c] > 0.0)) return false;
      const double reciprocal = own[c] = 1.0 / std::sqrt(own[c]);
      for (int r = c + 1; r < height; r++) own[r] *= reciprocal;
    }
  }
  return true;
}

JAMLAB_WIDE_VECTORS void LAMMPS_NS::multiply_panel(const double *rows, int width, int height,
                                                   Stride stride, double *product, Stride apart)
{
  for (int first = 0; first < height; first += COLUMNS)
    for (int r = first; r < height; r += PANEL_ROWS) {
      Four sums[2 * COLUMNS];
      MULTIPLY(rows + r, rows + first, width, stride, sums);
      double *const to = product + first * apart + r;
      for (int q = 0; q < COLUMNS; q++)
        std::memcpy(to + q * apart, &sums[2 * q], 2 * sizeof(Four));
    }
}

template <int D>
static ALWAYS_INLINE void down(const double *panel, int width, int rows, Stride stride,
                               double *__restrict own, double *__restrict below)
{
  for (int c = 0; c < width; c += D, panel += D * stride) {
    double x[D];
    for (int a = 0; a < D; a++) {
      x[a] = own[c + a];
      for (int b = 0; b < a; b++) x[a] -= panel[b * stride + c + a] * x[b];
      own[c + a] = x[a] *= panel[a * stride + c + a];
    }
    for (int r = c + D; r < width; r++)
      for (int b = 0; b < D; b++) own[r] -= x[b] * panel[b * stride + r];
    for (int r = 0; r < rows; r++)
      for (int b = 0; b < D; b++) below[r] -= x[b] * panel[b * stride + width + r];
  }
}

template <int D>
static ALWAYS_INLINE void up(const double *panel, int width, int rows, Stride stride,
                             double *__restrict own, const double *__restrict below)
{
  for (int c = width - D; c >= 0; c -= D) {
    const double *const column = panel + c * stride;
    double sums[D] = {};
#pragma omp simd reduction(+ : sums[:D])
    for (int r = 0; r < rows; r++)
      for (int b = 0; b < D; b++) sums[b] += column[b * stride + width + r] * below[r];
    for (int r = c + D; r < width; r++)
      for (int b = 0; b < D; b++) sums[b] += column[b * stride + r] * own[r];
    for (int b = D - 1; b >= 0; b--) {
      for (int a = b + 1; a < D; a++) sums[b] += column[b * stride + c + a] * own[c + a];
      own[c + b] = (own[c + b] - sums[b]) * column[b * stride + c + b];
    }
  }
}

JAMLAB_WIDE_VECTORS void LAMMPS_NS::solve_down(int block, const double *panel, int width, int rows,
                                               Stride stride, double *own, double *below)
{
  block == 2 ? down<2>(panel, width, rows, stride, own, below)
             : down<3>(panel, width, rows, stride, own, below);
}

JAMLAB_WIDE_VECTORS void LAMMPS_NS::solve_up(int block, const double *panel, int width, int rows,
                                             Stride stride, double *own, const double *below)
{
  block == 2 ? up<2>(panel, width, rows, stride, own, below)
             : up<3>(panel, width, rows, stride, own, below);
}
