// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_BLOCK_CHOLESKY_H
#define JAMLAB_BLOCK_CHOLESKY_H

#include <array>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

/* Cholesky factors of a sparse symmetric matrix of D x D blocks, one row of blocks for each vertex or disk.
   Rows are eliminated in the order of least degree: the one with the fewest neighbors first, whose
   neighbors then are neighbors of each other. The order serves other patterns of the same rows too, until
   their factors have grown by too much. */

template <int D> class BlockCholesky {
 public:
  using Block = std::array<double, D * D>;    // row by row

  // which blocks may be other than zero, (i, j) or (j, i), in any order, repeated or not
  void set_pattern(int size, const std::vector<std::pair<int, int>> &pairs);
  void forget_order() { rank.clear(); }          // rows are other ones from now on
  void clear();                                  // all blocks zero
  void add(int i, int j, const Block &block);    // to row i, column j; give one of (i, j) and (j, i)
  bool factorise(double shift);                  // shift: added to the diagonal; false: not positive definite
  void solve(std::vector<double> &r);            // D numbers of each row: right-hand side in, solution out
  int size() const { return static_cast<int>(columns.size()); }
  double mean_diagonal() const;
  double blocks_below() const { return filled; }
  double updates() const { return updated; }    // products of two blocks in a factorisation
  double memory_usage() const;

 private:
  struct Column {
    int row;                   // that it is, in the order of the caller
    Block diagonal;
    std::vector<int> below;    // ranks of the rows with blocks, in the order of elimination
    std::vector<Block> blocks;
  };
  std::vector<Column> columns;    // in the order of elimination
  std::vector<int> rank;          // of each row
  std::vector<std::array<double, D>> solved;
  double filled = 0.0, updated = 0.0, filled_when_ordered = 0.0;

  void find_order(std::vector<std::vector<int>> near);
  void find_fill(const std::vector<std::vector<int>> &near);
  bool eliminate(Column &, std::vector<int> &place);
};

}    // namespace LAMMPS_NS

#endif
