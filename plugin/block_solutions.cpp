// SPDX-License-Identifier: GPL-2.0-or-later
// Solutions from the factors of a BlockCholesky.
#include "block_cholesky.h"

#include "dense_panel.h"

#include <algorithm>
#include <cstddef>

using namespace LAMMPS_NS;

template <int D> void BlockCholesky<D>::solve(std::vector<double> &r)
{
  solve_one(r.data(), 1);
}

template <int D> void BlockCholesky<D>::solve(double *r, int count)
{
  for (int k = 0; k < count; k += TOGETHER)
    if (k + 1 == count)
      solve_one(r + k, count);
    else
      solve_four(r + k, count, std::min(TOGETHER, count - k));
}

template <int D> void BlockCholesky<D>::solve_one(double *r, int apart)
{
  const int size = static_cast<int>(rank.size());
  solved.resize(std::max<std::size_t>(solved.size(), D * size));
  for (int c = 0; c < size; c++)
    for (int a = 0; a < D; a++) solved[D * c + a] = r[apart * (D * row[c] + a)];
  double *const x = gathered.data();
  const auto row_below = [&](const Panel &p, int n) { return &solved[D * lower[p.below + n]]; };
  const auto gather = [&](const Panel &p) {
    for (int n = 0; n < p.rows; n++) std::copy_n(row_below(p, n), D, x + D * n);
  };
  for (const Panel &p : panels) {
    gather(p);
    double *const own = &solved[D * p.begin];
    dense->down[D - 1](&values[p.values], p.width(), D * p.rows, p.stride, own, x);
    if (!signs.empty())
      for (int k = 0; k < p.width(); k++) own[k] *= signs[D * p.begin + k];
    for (int n = 0; n < p.rows; n++) std::copy_n(x + D * n, D, row_below(p, n));
  }
  for (std::size_t k = panels.size(); k-- > 0;) {
    const Panel &p = panels[k];
    gather(p);
    dense->up[D - 1](&values[p.values], p.width(), D * p.rows, p.stride, &solved[D * p.begin], x);
  }
  for (int c = 0; c < size; c++)
    for (int a = 0; a < D; a++) r[apart * (D * row[c] + a)] = solved[D * c + a];
}

template <int D> void BlockCholesky<D>::round_values()
{
  rounded.resize(values.size());
  int tallest = 0;
  for (const Panel &p : panels) {
    tallest = std::max(tallest, p.height());
    for (int k = 0; k < p.width(); k++) {
      const double *const from = &values[p.values + k * p.stride];
      float *const to = &rounded[p.values + k * p.stride];
      for (int r = k; r < p.height(); r++) to[r] = static_cast<float>(from[r]);
      std::fill_n(to + p.height(), PANEL_ROWS, 0.0f);
    }
  }
  few.resize(tallest + PANEL_ROWS);
  values_rounded = true;
}

template <int D> void BlockCholesky<D>::solve_roughly(std::vector<double> &r)
{
  if (!values_rounded) round_values();
  const int size = static_cast<int>(rank.size());
  rough.resize(D * size);
  for (int c = 0; c < size; c++)
    for (int a = 0; a < D; a++) rough[D * c + a] = static_cast<float>(r[D * row[c] + a]);
  const auto gather = [&](const Panel &p) {
    std::copy_n(&rough[D * p.begin], p.width(), few.data());
    float *const below = few.data() + p.width();
    for (int n = 0; n < p.rows; n++)
      for (int a = 0; a < D; a++) below[D * n + a] = rough[D * lower[p.below + n] + a];
    std::fill_n(below + D * p.rows, PANEL_ROWS, 0.0f);
  };
  for (const Panel &p : panels) {
    gather(p);
    dense->down_rough(&rounded[p.values], p.width(), p.height(), p.stride, few.data());
    std::copy_n(few.data(), p.width(), &rough[D * p.begin]);
    const float *const below = few.data() + p.width();
    for (int n = 0; n < p.rows; n++)
      for (int a = 0; a < D; a++) rough[D * lower[p.below + n] + a] = below[D * n + a];
  }
  for (std::size_t k = panels.size(); k-- > 0;) {
    const Panel &p = panels[k];
    gather(p);
    dense->up_rough(&rounded[p.values], p.width(), p.height(), p.stride, few.data());
    std::copy_n(few.data(), p.width(), &rough[D * p.begin]);
  }
  for (int c = 0; c < size; c++)
    for (int a = 0; a < D; a++) r[D * row[c] + a] = rough[D * c + a];
}

template <int D> void BlockCholesky<D>::solve_four(double *r, int apart, int count)
{
  constexpr int SIZE = TOGETHER * D;    // numbers of one row
  const int size = static_cast<int>(rank.size());
  solved.resize(std::max<std::size_t>(solved.size(), SIZE * size));
  const auto numbers = [&](int c, int a) { return r + apart * (D * row[c] + a); };
  for (int c = 0; c < size; c++)
    for (int a = 0; a < D; a++) {
      double *const to = &solved[SIZE * c + TOGETHER * a];
      std::fill(std::copy_n(numbers(c, a), count, to), to + TOGETHER, 0.0);
    }
  double *const x = gathered.data();
  const auto row_below = [&](const Panel &p, int n) { return &solved[SIZE * lower[p.below + n]]; };
  const auto gather = [&](const Panel &p) {
    for (int n = 0; n < p.rows; n++) std::copy_n(row_below(p, n), SIZE, x + SIZE * n);
  };
  for (const Panel &p : panels) {
    gather(p);
    double *const own = &solved[SIZE * p.begin];
    dense->down_four(&values[p.values], p.width(), D * p.rows, p.stride, own, x);
    if (!signs.empty())
      for (int k = 0; k < TOGETHER * p.width(); k++) own[k] *= signs[D * p.begin + k / TOGETHER];
    for (int n = 0; n < p.rows; n++) std::copy_n(x + SIZE * n, SIZE, row_below(p, n));
  }
  for (std::size_t k = panels.size(); k-- > 0;) {
    const Panel &p = panels[k];
    gather(p);
    dense->up_four(&values[p.values], p.width(), D * p.rows, p.stride, &solved[SIZE * p.begin], x);
  }
  for (int c = 0; c < size; c++)
    for (int a = 0; a < D; a++)
      std::copy_n(&solved[SIZE * c + TOGETHER * a], count, numbers(c, a));
}

template class LAMMPS_NS::BlockCholesky<1>;
template class LAMMPS_NS::BlockCholesky<2>;
template class LAMMPS_NS::BlockCholesky<3>;
