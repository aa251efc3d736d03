// SPDX-License-Identifier: GPL-2.0-or-later
// Solutions from the factors of a BlockCholesky.
#include "block_cholesky.h"

#include "dense_panel.h"

#include <algorithm>
#include <cstddef>

using namespace LAMMPS_NS;

template <int D> void BlockCholesky<D>::solve(std::vector<double> &r)
{
  solve(r.data(), 1);
}

/* The order of sums decides the last digits of flows of disks, where no other order is faster. */
template <int D> void BlockCholesky<D>::solve(double *r, int count)
{
  const auto up = D == 3 ? dense->up_disks : dense->up;
  for (int k = 0; k < count; k += TOGETHER)
    if (k + 1 == count)
      solve_one(r + k, count, values.data(), dense->down, up, solved, gathered);
    else
      solve_four(r + k, count, std::min(TOGETHER, count - k));
}

/* The right-hand side may be one of several that lie together: its numbers are `apart`. Those of
   a panel are gathered side by side, like its columns. */
template <int D>
template <class Number>
void BlockCholesky<D>::solve_one(double *r, int apart, const Number *factors,
                                 DensePanels::Step<Number> *down, DensePanels::Step<Number> *up,
                                 std::vector<Number> &solved, std::vector<Number> &gathered)
{
  const int size = static_cast<int>(rank.size());
  solved.resize(std::max<std::size_t>(solved.size(), D * size));
  for (int c = 0; c < size; c++)
    for (int a = 0; a < D; a++)
      solved[D * c + a] = static_cast<Number>(r[apart * (D * row[c] + a)]);
  Number *const x = gathered.data();
  const auto row_below = [&](const Panel &p, int n) { return &solved[D * lower[p.below + n]]; };
  const auto gather = [&](const Panel &p) {
    Number *to = std::copy_n(&solved[D * p.begin], p.width(), x);
    for (int n = 0; n < p.rows; n++)
      for (const Number *from = row_below(p, n), *end = from + D; from != end;) *to++ = *from++;
    std::fill_n(to, PANEL_ROWS, Number(0));
  };
  for (const Panel &p : panels) {
    gather(p);
    down(factors + p.values, p.width(), p.height(), p.stride, x);
    if (!signs.empty())
      for (int k = 0; k < p.width(); k++) x[k] *= static_cast<Number>(signs[D * p.begin + k]);
    std::copy_n(x, p.width(), &solved[D * p.begin]);
    const Number *from = x + p.width();
    for (int n = 0; n < p.rows; n++)
      for (Number *to = row_below(p, n), *end = to + D; to != end;) *to++ = *from++;
  }
  for (std::size_t k = panels.size(); k-- > 0;) {
    const Panel &p = panels[k];
    gather(p);
    up(factors + p.values, p.width(), p.height(), p.stride, x);
    std::copy_n(x, p.width(), &solved[D * p.begin]);
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
      for (int r = k; r < padded(p.height()); r++) to[r] = static_cast<float>(from[r]);
    }
  }
  few.resize(tallest + PANEL_ROWS);
  values_rounded = true;
}

template <int D> void BlockCholesky<D>::solve_roughly(std::vector<double> &r)
{
  if (!values_rounded) round_values();
  solve_one(r.data(), 1, rounded.data(), dense->down_rough, dense->up_rough, rough, few);
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
