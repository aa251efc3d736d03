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
#define four(from) (*reinterpret_cast<const Four *>(from))
#define together(numbers, row) \
  (*reinterpret_cast<Four *>(const_cast<double *>(numbers) + TOGETHER * (row)))

#define MULTIPLY(a, b, depth, along, beside, sums)                                          \
  do {                                                                                      \
    Four s00 = sums[0], s01 = sums[1], s10 = sums[2], s11 = sums[3];                        \
    Four s20 = sums[4], s21 = sums[5], s30 = sums[6], s31 = sums[7];                        \
    const double *pa = (a), *pb = (b);                                                      \
    for (int k = 0; k < (depth); k++, pa += (along), pb += (beside)) {                      \
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

#define READ(sums, from, apart)                                                             \
  for (int c = 0; c < COLUMNS; c++)                                                         \
  std::memcpy(&sums[2 * c], (from) + c * (apart), 2 * sizeof(Four))
#define WRITE(sums, to, apart)                                                              \
  for (int c = 0; c < COLUMNS; c++)                                                         \
  std::memcpy((to) + c * (apart), &sums[2 * c], 2 * sizeof(Four))

static constexpr int WIDE = PANEL_COLUMNS;    // of a product that one copy of rows serves
static constexpr int DEPTH = 64;              // columns of a panel that are copied at once

/* The same sums for the first columns of the lower triangle of rows rows^T, in the same order of k.
   Large panels do not fit into the cache: copies of what is used again lie densely. */
static ALWAYS_INLINE void multiply_wide(const double *rows, int depth, int height, int columns,
                                        Stride stride, double *product, Stride apart)
{
  double theirs[WIDE / COLUMNS][DEPTH * COLUMNS], own[DEPTH * PANEL_ROWS];
  for (int begin = 0; begin < depth; begin += DEPTH) {
    const double *const from = rows + begin * stride;
    const int deep = std::min(DEPTH, depth - begin);
    for (int q = 0; q < columns; q += COLUMNS)
      for (int k = 0; k < deep; k++)
        std::memcpy(theirs[q / COLUMNS] + COLUMNS * k, from + k * stride + q, sizeof(Four));
    for (int r = 0; r < height; r += PANEL_ROWS) {
      for (int k = 0; k < deep; k++)
        std::memcpy(own + PANEL_ROWS * k, from + k * stride + r, 2 * sizeof(Four));
      for (int q = 0; q < std::min(columns, r + PANEL_ROWS); q += COLUMNS) {
        double *const to = product + q * apart + r;
        Four sums[2 * COLUMNS] = {};
        if (begin) READ(sums, to, apart);
        MULTIPLY(own, theirs[q / COLUMNS], deep, PANEL_ROWS, COLUMNS, sums);
        WRITE(sums, to, apart);
      }
    }
  }
}

JAMLAB_WIDE_VECTORS bool LAMMPS_NS::factorise_panel(double *panel, int width, int height,
                                                    Stride stride, double *room)
{
  for (int first = 0; first < width; first += COLUMNS) {
    const int last = std::min(first + COLUMNS, width), wide = first - first % WIDE;
    const double *const rest = panel + wide * stride;
    const Stride apart = padded(height - wide);
    if (wide && wide == first)
      multiply_wide(panel + wide, wide, height - wide, std::min(WIDE, width - wide), stride, room,
                    apart);
    if (first)
      for (int r = first; r < height; r += PANEL_ROWS) {
        Four sums[2 * COLUMNS] = {};
        if (wide) READ(sums, room + (first - wide) * apart + r - wide, apart);
        MULTIPLY(rest + r, rest + first, first - wide, stride, stride, sums);
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
  if (width > WIDE && height > WIDE) {
    for (int first = 0; first < height; first += WIDE)
      multiply_wide(rows + first, width, height - first, std::min(WIDE, height - first), stride,
                    product + first * (apart + 1), apart);
    return;
  }
  for (int first = 0; first < height; first += COLUMNS)
    for (int r = first; r < height; r += PANEL_ROWS) {
      Four sums[2 * COLUMNS] = {};
      MULTIPLY(rows + r, rows + first, width, stride, stride, sums);
      WRITE(sums, product + first * apart + r, apart);
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
  if (block == 1)
    down<1>(panel, width, rows, stride, own, below);
  else if (block == 2)
    down<2>(panel, width, rows, stride, own, below);
  else
    down<3>(panel, width, rows, stride, own, below);
}

JAMLAB_WIDE_VECTORS void LAMMPS_NS::solve_up(int block, const double *panel, int width, int rows,
                                             Stride stride, double *own, const double *below)
{
  if (block == 1)
    up<1>(panel, width, rows, stride, own, below);
  else if (block == 2)
    up<2>(panel, width, rows, stride, own, below);
  else
    up<3>(panel, width, rows, stride, own, below);
}

/* Two columns at once, so that rows are read and written half as often. */
static ALWAYS_INLINE void down_four(const double *panel, int width, int rows, Stride stride,
                                    double *own, double *below)
{
  for (int c = 0; c < width; c += 2) {
    const double *const left = panel + c * stride;
    const Four x = together(own, c) *= left[c];
    if (c + 1 == width) {
      for (int r = 0; r < rows; r++) together(below, r) -= x * left[width + r];
      return;
    }
    const double *const right = left + stride;
    const Four y = together(own, c + 1) = (together(own, c + 1) - x * left[c + 1]) * right[c + 1];
    for (int r = c + 2; r < width; r++)
      together(own, r) = together(own, r) - x * left[r] - y * right[r];
    for (int r = 0; r < rows; r++)
      together(below, r) = together(below, r) - x * left[width + r] - y * right[width + r];
  }
}

static ALWAYS_INLINE void up_four(const double *panel, int width, int rows, Stride stride,
                                  double *own, const double *below)
{
  int c = width - 1;
  for (; c > 0; c -= 2) {
    const double *const right = panel + c * stride, *const left = right - stride;
    Four x = {}, y = {};
    for (int r = 0; r < rows; r++) {
      x += together(below, r) * left[width + r];
      y += together(below, r) * right[width + r];
    }
    for (int r = c + 1; r < width; r++) {
      x += together(own, r) * left[r];
      y += together(own, r) * right[r];
    }
    y = together(own, c) = (together(own, c) - y) * right[c];
    together(own, c - 1) = (together(own, c - 1) - (x + y * left[c])) * left[c - 1];
  }
  if (c == 0) {
    Four x = {};
    for (int r = 0; r < rows; r++) x += together(below, r) * panel[width + r];
    for (int r = 1; r < width; r++) x += together(own, r) * panel[r];
    together(own, 0) = (together(own, 0) - x) * panel[0];
  }
}

JAMLAB_WIDE_VECTORS void LAMMPS_NS::solve_down_four(const double *panel, int width, int rows,
                                                    Stride stride, double *own, double *below)
{
  down_four(panel, width, rows, stride, own, below);
}

JAMLAB_WIDE_VECTORS void LAMMPS_NS::solve_up_four(const double *panel, int width, int rows,
                                                  Stride stride, double *own, const double *below)
{
  up_four(panel, width, rows, stride, own, below);
}
