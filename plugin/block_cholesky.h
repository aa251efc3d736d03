// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_BLOCK_CHOLESKY_H
#define JAMLAB_BLOCK_CHOLESKY_H

#include <utility>
#include <vector>

namespace LAMMPS_NS {

/* Cholesky factors of a sparse symmetric matrix of 2 x 2 blocks, one row of blocks for each point of the
   plane. Rows are eliminated in the order of least degree: the one with the fewest neighbors first, whose
   neighbors then are neighbors of each other. */

class BlockCholesky {
 public:
  struct Block {
    double xx = 0.0, xy = 0.0, yx = 0.0, yy = 0.0;
  };

  // which blocks may be other than zero, (i, j) or (j, i), in any order, repeated or not
  void set_pattern(int size, const std::vector<std::pair<int, int>> &pairs);
  void clear();                                  // all blocks zero
  void add(int i, int j, const Block &block);    // to row i, column j; give one of (i, j) and (j, i)
  bool factorise(double shift);                  // shift: added to the diagonal; false: not positive definite
  void solve(std::vector<double> &r) const;      // x, y of each row: right-hand side in, solution out
  int size() const { return static_cast<int>(columns.size()); }
  double mean_diagonal() const;
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

  bool eliminate(Column &, std::vector<int> &place);
};

}    // namespace LAMMPS_NS

#endif
