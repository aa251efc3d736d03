// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "block_cholesky.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <set>

using namespace LAMMPS_NS;

/* ---------------------------------------------------------------------- */

void BlockCholesky::set_pattern(int size, const std::vector<std::pair<int, int>> &pairs)
{
  std::vector<std::vector<int>> near(size);
  for (const auto &pair : pairs) {
    if (pair.first == pair.second) continue;
    near[pair.first].push_back(pair.second);
    near[pair.second].push_back(pair.first);
  }
  std::set<std::pair<std::size_t, int>> waiting;    // by degree
  for (int i = 0; i < size; i++) {
    std::sort(near[i].begin(), near[i].end());
    near[i].erase(std::unique(near[i].begin(), near[i].end()), near[i].end());
    waiting.insert({near[i].size(), i});
  }

  columns.clear();
  rank.assign(size, 0);
  std::vector<int> joined;
  while (!waiting.empty()) {
    const int row = waiting.begin()->second;
    waiting.erase(waiting.begin());
    rank[row] = static_cast<int>(columns.size());
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
    columns.push_back({row, {}, left, std::vector<Block>(left.size())});
  }
  for (Column &column : columns) {
    for (int &i : column.below) i = rank[i];
    std::sort(column.below.begin(), column.below.end());
  }
}

/* ---------------------------------------------------------------------- */

void BlockCholesky::clear()
{
  for (Column &column : columns) {
    column.diagonal = {};
    std::fill(column.blocks.begin(), column.blocks.end(), Block());
  }
}

/* ---------------------------------------------------------------------- */

void BlockCholesky::add(int i, int j, const Block &block)
{
  const bool turned = rank[i] < rank[j];    // the block of the lower triangle is the transposed one
  Column &column = columns[turned ? rank[i] : rank[j]];
  const int other = turned ? rank[j] : rank[i];
  const auto place = std::lower_bound(column.below.begin(), column.below.end(), other);
  Block *const to = i == j ? &column.diagonal : &column.blocks[place - column.below.begin()];
  to->xx += block.xx;
  to->yy += block.yy;
  to->xy += turned ? block.yx : block.xy;
  to->yx += turned ? block.xy : block.yx;
}

/* ---------------------------------------------------------------------- */

double BlockCholesky::mean_diagonal() const
{
  double total = 0.0;
  for (const Column &column : columns) total += column.diagonal.xx + column.diagonal.yy;
  return columns.empty() ? 0.0 : 0.5 * total / columns.size();
}

/* ---------------------------------------------------------------------- */

bool BlockCholesky::factorise(double shift)
{
  std::vector<int> place(columns.size());
  for (Column &column : columns) {
    column.diagonal.xx += shift;
    column.diagonal.yy += shift;
  }
  for (Column &column : columns)
    if (!eliminate(column, place)) return false;
  return true;
}

/* ----------------------------------------------------------------------
   the diagonal becomes its factor (xx 0; yx yy), blocks below B become L = B factor^-T, and L L^T is
   taken off all that is left
------------------------------------------------------------------------- */

bool BlockCholesky::eliminate(Column &column, std::vector<int> &place)
{
  Block &d = column.diagonal;
  if (!(d.xx > 0.0)) return false;
  d.xx = std::sqrt(d.xx);
  d.yx /= d.xx;
  const double rest = d.yy - d.yx * d.yx;
  if (!(rest > 0.0)) return false;
  d.yy = std::sqrt(rest);
  for (Block &b : column.blocks) {
    b.xx /= d.xx;
    b.yx /= d.xx;
    b.xy = (b.xy - b.xx * d.yx) / d.yy;
    b.yy = (b.yy - b.yx * d.yx) / d.yy;
  }
  for (std::size_t n = 0; n < column.below.size(); n++) {
    const Block &b = column.blocks[n];
    Column &other = columns[column.below[n]];
    Block &o = other.diagonal;
    o.xx -= b.xx * b.xx + b.xy * b.xy;
    o.yx -= b.yx * b.xx + b.yy * b.xy;
    o.yy -= b.yx * b.yx + b.yy * b.yy;
    for (std::size_t k = 0; k < other.below.size(); k++) place[other.below[k]] = static_cast<int>(k);
    for (std::size_t m = n + 1; m < column.below.size(); m++) {
      const Block &a = column.blocks[m];
      Block &to = other.blocks[place[column.below[m]]];
      to.xx -= a.xx * b.xx + a.xy * b.xy;
      to.xy -= a.xx * b.yx + a.xy * b.yy;
      to.yx -= a.yx * b.xx + a.yy * b.xy;
      to.yy -= a.yx * b.yx + a.yy * b.yy;
    }
  }
  return true;
}

/* ---------------------------------------------------------------------- */

void BlockCholesky::solve(std::vector<double> &r) const
{
  for (const Column &c : columns) {
    double &x = r[2 * c.row], &y = r[2 * c.row + 1];
    x /= c.diagonal.xx;
    y = (y - c.diagonal.yx * x) / c.diagonal.yy;
    for (std::size_t n = 0; n < c.below.size(); n++) {
      double *const to = &r[2 * columns[c.below[n]].row];
      to[0] -= c.blocks[n].xx * x + c.blocks[n].xy * y;
      to[1] -= c.blocks[n].yx * x + c.blocks[n].yy * y;
    }
  }
  for (auto c = columns.rbegin(); c != columns.rend(); ++c) {
    double &x = r[2 * c->row], &y = r[2 * c->row + 1];
    for (std::size_t n = 0; n < c->below.size(); n++) {
      const double *const from = &r[2 * columns[c->below[n]].row];
      x -= c->blocks[n].xx * from[0] + c->blocks[n].yx * from[1];
      y -= c->blocks[n].xy * from[0] + c->blocks[n].yy * from[1];
    }
    y /= c->diagonal.yy;
    x = (x - c->diagonal.yx * y) / c->diagonal.xx;
  }
}

/* ---------------------------------------------------------------------- */

double BlockCholesky::memory_usage() const
{
  double bytes = columns.capacity() * sizeof(Column) + rank.capacity() * sizeof(int);
  for (const Column &column : columns)
    bytes += column.below.capacity() * sizeof(int) + column.blocks.capacity() * sizeof(Block);
  return bytes;
}
