// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "atom.h"
#include "block_cholesky.h"

#include <utility>
#include <vector>

namespace LAMMPS_NS {

/* A BlockAssembly sums up the matrix of a quadratic form over atoms, as far as this rank owns both
   atoms of a block. A ghost counts as the atom that it is an image of. Rows and columns of the
   atoms in `given` are zero. */
template <int D> class BlockAssembly {
 public:
  using Block = typename BlockCholesky<D>::Block;

  explicit BlockAssembly(Atom *atom, std::vector<char> given = {}) :
      atom(atom), given(std::move(given)) {}

  int owner(int i) const    // -1: another rank's
  {
    const int own = i < atom->nlocal ? i : atom->map(atom->tag[i]);
    return own < atom->nlocal ? own : -1;
  }

  // Adds the block of atoms i and j, but not its transpose, the block of j and i.
  void add(int i, int j, const Block &b)
  {
    const int own_i = owner(i), own_j = owner(j);
    if (own_i < 0 || own_j < 0) return;
    const bool free = given.empty() || !(given[own_i] || given[own_j]);
    if (!free && own_i != own_j) return;
    entries.push_back({own_i, own_j, free ? b : Block{}});
    if (i == j || own_i != own_j) return;
    Block &both = entries.back().block;
    for (int k = 0; k < D; k++)
      for (int l = 0; l < D; l++) both[D * k + l] = b[D * k + l] + b[D * l + k];
  }

  void fill(BlockCholesky<D> &matrix) const
  {
    matrix.set_pattern(atom->nlocal, entries);
    refill(matrix);
  }

  void refill(BlockCholesky<D> &matrix) const { matrix.set(entries); }    // after a factorisation

 private:
  Atom *atom;
  std::vector<char> given;    // of owned atoms; empty: none
  std::vector<typename BlockCholesky<D>::Entry> entries;
};

}    // namespace LAMMPS_NS
