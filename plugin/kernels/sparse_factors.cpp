// Factors of sparse symmetric matrices that Python holds by columns: L L^T of positive definite
// ones, L S L^T, with signs S, of others. Numbers that belong to one site are a block, as the
// displacement of a disk is.
#include "kernel.h"

#include "../block_cholesky.h"

#include <algorithm>
#include <cstddef>
#include <variant>
#include <vector>

using LAMMPS_NS::BlockCholesky;

namespace {

constexpr double ZEROS = 0.25;  // part of the blocks that the matrix may lack

class SparseFactors {
 public:
  void set_pattern(int size, const int *first, const int *rows) {
    if (first_.size() == static_cast<std::size_t>(size) + 1 &&
        std::equal(first_.begin(), first_.end(), first) &&
        std::equal(rows_.begin(), rows_.end(), rows))
      return;
    first_.clear();  // whatever fails below, the pattern is set anew
    rows_.assign(rows, rows + first[size]);
    const std::size_t width = block_width(size, first, rows);
    if (width != factors_.index() + 1) {
      if (width == 1) factors_.emplace<0>();
      if (width == 2) factors_.emplace<1>();
      if (width == 3) factors_.emplace<2>();
    }
    const int blocks = size / static_cast<int>(width);
    std::visit([&](auto &factors) { factors.set_pattern(blocks, first, rows); }, factors_);
    first_.assign(first, first + size + 1);
  }

  // Returns the row where a pivot fails, the number of rows if none does.
  int factorise(const double *numbers, double shift, bool indefinite) {
    return std::visit(
        [&](auto &factors) {
          factors.set(numbers);
          const bool done =
              indefinite ? factors.factorise_indefinite(shift) : factors.factorise(shift);
          return done ? static_cast<int>(first_.size()) - 1 : factors.stopped_at();
        },
        factors_);
  }

  int negative() const {
    return std::visit([](const auto &factors) { return factors.negative(); }, factors_);
  }

  void solve(double *right, int count) {
    std::visit([&](auto &factors) { factors.solve(right, count); }, factors_);
  }

 private:
  std::vector<int> first_, rows_;
  std::variant<BlockCholesky<1>, BlockCholesky<2>, BlockCholesky<3>> factors_;

  // The width whose blocks are fullest; 1 if too many numbers of them are missing.
  static std::size_t block_width(int size, const int *first, const int *rows) {
    std::size_t best = 1;
    double fullest = 1.0 - ZEROS;
    for (const int width : {2, 3}) {
      if (size % width) continue;
      std::vector<int> seen(size / width, -1);
      std::int64_t blocks = 0;
      for (int c = 0; c < size; c++)
        for (int n = first[c]; n < first[c + 1]; n++) {
          int &last = seen[rows[n] / width];
          blocks += last != c / width;
          last = c / width;
        }
      const double full = first[size] / (static_cast<double>(blocks) * width * width);
      if (full > fullest) {
        fullest = full;
        best = width;
      }
    }
    return best;
  }
};

SparseFactors &factors_of(std::int64_t handle) {
  return *reinterpret_cast<SparseFactors *>(handle);
}

}  // namespace

// Makes what the others work on, which is freed by sparse_factors_free.
JAMLAB_KERNEL sparse_factors_make()
try {
  return reinterpret_cast<std::int64_t>(new SparseFactors);
}
JAMLAB_OR_NO_MEMORY

JAMLAB_KERNEL sparse_factors_free(std::int64_t handle) {
  delete &factors_of(handle);
  return 0;
}

// Factorises a matrix by columns, of both triangles, with `shift` added to its diagonal. Its order
// of elimination is kept. Returns the row where a pivot fails, the number of rows if none does.
JAMLAB_KERNEL sparse_factors_factorise(std::int64_t handle, std::int64_t size, const int *first,
                                       const int *rows, const double *numbers, double shift,
                                       std::int64_t indefinite)
try {
  SparseFactors &factors = factors_of(handle);
  factors.set_pattern(static_cast<int>(size), first, rows);
  return factors.factorise(numbers, shift, indefinite != 0);
}
JAMLAB_OR_NO_MEMORY

// The number of negative eigenvalues, after `indefinite` factors.
JAMLAB_KERNEL sparse_factors_negative(std::int64_t handle) { return factors_of(handle).negative(); }

// Right-hand sides in, solutions out: `count` numbers for each row.
JAMLAB_KERNEL sparse_factors_solve(std::int64_t handle, std::int64_t count, double *right)
try {
  factors_of(handle).solve(right, static_cast<int>(count));
  return 0;
}
JAMLAB_OR_NO_MEMORY
