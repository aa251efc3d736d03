// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "block_cholesky.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

using namespace LAMMPS_NS;

static constexpr double GROWN = 1.3;    // blocks of the factors, over those in an order of their own

/* ---------------------------------------------------------------------- */

template <int D> void BlockCholesky<D>::set_pattern(int size, const std::vector<std::pair<int, int>> &pairs)
{
  std::vector<std::vector<int>> near(size);
  for (const auto &pair : pairs) {
    if (pair.first == pair.second) continue;
    near[pair.first].push_back(pair.second);
    near[pair.second].push_back(pair.first);
  }
  for (auto &each : near) {
    std::sort(each.begin(), each.end());
    each.erase(std::unique(each.begin(), each.end()), each.end());
  }
  columns.resize(size);
  if (static_cast<int>(rank.size()) == size) find_fill(near);
  if (static_cast<int>(rank.size()) == size && filled <= GROWN * filled_when_ordered) return;
  find_order(near);
  find_fill(near);
  filled_when_ordered = filled;
}

/* ---------------------------------------------------------------------- */

template <int D> void BlockCholesky<D>::find_order(std::vector<std::vector<int>> near)
{
  const int size = static_cast<int>(near.size());
  std::set<std::pair<std::size_t, int>> waiting;    // by degree
  for (int i = 0; i < size; i++) waiting.insert({near[i].size(), i});

  rank.assign(size, 0);
  std::vector<int> joined;
  for (int place = 0; place < size; place++) {
    const int row = waiting.begin()->second;
    waiting.erase(waiting.begin());
    rank[row] = place;
    columns[place].row = row;
    const std::vector<int> left = std::move(near[row]);
    for (const int i : left) {
      waiting.erase({near[i].size(), i});
      joined.clear();
      std::set_union(near[i].begin(), near[i].end(), left.begin(), left.end(), std::back_inserter(joined));
      near[i].clear();
      for (const int j : joined)
        if (j != i && j != row) near[i].push_back(j);
      waiting.insert({near[i].size(), i});
    }
  }
}

/* ----------------------------------------------------------------------
   below a column: its neighbors, and what is below the columns whose first block below is in its row
------------------------------------------------------------------------- */

template <int D> void BlockCholesky<D>::find_fill(const std::vector<std::vector<int>> &near)
{
  const int size = static_cast<int>(columns.size());
  std::vector<int> seen(size, -1), first_child(size, -1), next_child(size, -1);
  filled = updated = 0.0;
  for (int c = 0; c < size; c++) {
    Column &column = columns[c];
    column.below.clear();
    seen[c] = c;
    const auto take = [&](int r) {
      if (r < c || seen[r] == c) return;
      seen[r] = c;
      column.below.push_back(r);
    };
    for (const int j : near[column.row]) take(rank[j]);
    for (int child = first_child[c]; child >= 0; child = next_child[child])
      for (const int r : columns[child].below) take(r);
    std::sort(column.below.begin(), column.below.end());
    if (!column.below.empty()) {
      next_child[c] = first_child[column.below.front()];
      first_child[column.below.front()] = c;
    }
    column.blocks.resize(column.below.size());
    const double count = static_cast<double>(column.below.size());
    filled += count;
    updated += 0.5 * count * (count + 1.0);
  }
}

/* ---------------------------------------------------------------------- */

template <int D> void BlockCholesky<D>::clear()
{
  for (Column &column : columns) {
    column.diagonal = {};
    std::fill(column.blocks.begin(), column.blocks.end(), Block());
  }
}

/* ---------------------------------------------------------------------- */

template <int D> void BlockCholesky<D>::add(int i, int j, const Block &block)
{
  const bool turned = rank[i] < rank[j];    // the block of the lower triangle is the transposed one
  Column &column = columns[turned ? rank[i] : rank[j]];
  const int other = turned ? rank[j] : rank[i];
  const auto place = std::lower_bound(column.below.begin(), column.below.end(), other);
  Block &to = i == j ? column.diagonal : column.blocks[place - column.below.begin()];
  for (int a = 0; a < D; a++)
    for (int b = 0; b < D; b++) to[D * a + b] += turned ? block[D * b + a] : block[D * a + b];
}

/* ---------------------------------------------------------------------- */

template <int D> double BlockCholesky<D>::mean_diagonal() const
{
  double total = 0.0;
  for (const Column &column : columns)
    for (int a = 0; a < D; a++) total += column.diagonal[(D + 1) * a];
  return columns.empty() ? 0.0 : total / (D * columns.size());
}

/* ---------------------------------------------------------------------- */

template <int D> bool BlockCholesky<D>::factorise(double shift)
{
  std::vector<int> place(columns.size());
  for (Column &column : columns)
    for (int a = 0; a < D; a++) column.diagonal[(D + 1) * a] += shift;
  for (Column &column : columns)
    if (!eliminate(column, place)) return false;
  return true;
}

/* ----------------------------------------------------------------------
   the diagonal becomes its factor, a lower triangle; blocks below B become L = B factor^-T, and L L^T is
   taken off all that is left
------------------------------------------------------------------------- */

template <int D> bool BlockCholesky<D>::eliminate(Column &column, std::vector<int> &place)
{
  Block &d = column.diagonal;
  for (int a = 0; a < D; a++)
    for (int b = 0; b <= a; b++) {
      double rest = d[D * a + b];
      for (int c = 0; c < b; c++) rest -= d[D * a + c] * d[D * b + c];
      if (a == b && !(rest > 0.0)) return false;
      d[D * a + b] = a == b ? std::sqrt(rest) : rest / d[(D + 1) * b];
    }
  for (Block &l : column.blocks)
    for (int a = 0; a < D; a++)
      for (int b = 0; b < D; b++) {
        double rest = l[D * a + b];
        for (int c = 0; c < b; c++) rest -= l[D * a + c] * d[D * b + c];
        l[D * a + b] = rest / d[(D + 1) * b];
      }
  const auto take_off = [](Block &to, const Block &l, const Block &m) {
    for (int a = 0; a < D; a++)
      for (int b = 0; b < D; b++)
        for (int c = 0; c < D; c++) to[D * a + b] -= l[D * a + c] * m[D * b + c];
  };
  for (std::size_t n = 0; n < column.below.size(); n++) {
    const Block &m = column.blocks[n];
    Column &other = columns[column.below[n]];
    take_off(other.diagonal, m, m);
    for (std::size_t k = 0; k < other.below.size(); k++) place[other.below[k]] = static_cast<int>(k);
    for (std::size_t k = n + 1; k < column.below.size(); k++)
      take_off(other.blocks[place[column.below[k]]], column.blocks[k], m);
  }
  return true;
}

/* ---------------------------------------------------------------------- */

template <int D> void BlockCholesky<D>::solve(std::vector<double> &r)
{
  using Row = std::array<double, D>;
  solved.resize(columns.size());
  for (std::size_t c = 0; c < columns.size(); c++) std::copy_n(&r[D * columns[c].row], D, solved[c].begin());
  for (std::size_t c = 0; c < columns.size(); c++) {
    const Column &column = columns[c];
    Row own = solved[c];
    for (int a = 0; a < D; a++) {
      for (int b = 0; b < a; b++) own[a] -= column.diagonal[D * a + b] * own[b];
      own[a] /= column.diagonal[(D + 1) * a];
    }
    solved[c] = own;
    for (std::size_t n = 0; n < column.below.size(); n++) {
      Row &to = solved[column.below[n]];
      const Block &l = column.blocks[n];
      for (int a = 0; a < D; a++)
        for (int b = 0; b < D; b++) to[a] -= l[D * a + b] * own[b];
    }
  }
  for (std::size_t c = columns.size(); c-- > 0;) {
    const Column &column = columns[c];
    Row own = solved[c];
    for (std::size_t n = 0; n < column.below.size(); n++) {
      const Row from = solved[column.below[n]];
      const Block &l = column.blocks[n];
      for (int a = 0; a < D; a++)
        for (int b = 0; b < D; b++) own[b] -= l[D * a + b] * from[a];
    }
    for (int a = D - 1; a >= 0; a--) {
      for (int b = a + 1; b < D; b++) own[a] -= column.diagonal[D * b + a] * own[b];
      own[a] /= column.diagonal[(D + 1) * a];
    }
    solved[c] = own;
    std::copy_n(own.begin(), D, &r[D * column.row]);
  }
}

/* ---------------------------------------------------------------------- */

template <int D> double BlockCholesky<D>::memory_usage() const
{
  double bytes = columns.capacity() * sizeof(Column) + rank.capacity() * sizeof(int);
  for (const Column &column : columns)
    bytes += column.below.capacity() * sizeof(int) + column.blocks.capacity() * sizeof(Block);
  return bytes;
}

template class LAMMPS_NS::BlockCholesky<2>;    // vertices
template class LAMMPS_NS::BlockCholesky<3>;    // disks, which rotate
