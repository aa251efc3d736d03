// A symmetric matrix of sites, of which those of one droplet have a dense part: its area joins them
// all. Rows that nothing joins with other droplets are eliminated first, each droplet's by itself;
// the few that are left have sparse factors.
#pragma once

#include "../block_cholesky.h"

#include <array>
#include <cstdint>
#include <vector>

namespace jamlab {

constexpr int STRAINS = 4;  // components E_xx, E_xy, E_yx, E_yy
using PerStrain = std::array<double, STRAINS>;
using Columns = std::vector<PerStrain>;  // of each coordinate, two of a row

// Use: `join` for every term, the wide ones first, `arrange`, then `add` for every block of a term.
class CondensedMatrix {
 public:
  using Factors = LAMMPS_NS::BlockCholesky<2>;
  using Block = Factors::Block;
  static constexpr int WIDE = 4;  // sites of a term that has a dense part

  explicit CondensedMatrix(std::int64_t rows) : home(rows, -1), place(rows), outer(rows, 0) {}

  // Says that a term joins rows, of which negative ones count as none.
  void join(const std::vector<int> &rows);
  void arrange();
  // To row i, column j; one of (i, j) and (j, i).
  void add(int i, int j, const Block &block);

  double largest_diagonal() const;
  void subtract_product(const Columns &x, Columns &r) const;  // the matrix times x from r
  bool factorise(double shift);  // shift: added to the diagonal; false: not positive definite
  void solve(Columns &r);        // right-hand sides in, solutions out

 private:
  struct Part {  // dense, column by column
    std::vector<int> rows;  // inner ones first
    int inner = 0;
    std::ptrdiff_t stride = 0;
    std::size_t numbers = 0, panel = 0;  // where they begin
    int width() const { return 2 * inner; }
    int height() const { return 2 * static_cast<int>(rows.size()); }
  };
  std::vector<Part> parts;
  std::vector<int> home, place;  // part of each row, -1 if none; its place there
  std::vector<int> outer;        // number of each row that is eliminated last; -1: inner
  std::vector<int> lasts;        // these rows
  std::vector<double> numbers, panels, room, product;
  std::vector<Factors::Entry> between;  // blocks that no part holds
  Factors factors;
  const LAMMPS_NS::DensePanels *dense = &LAMMPS_NS::dense_panels();

  bool in_part(int i, int j) const { return home[i] >= 0 && home[i] == home[j]; }
  bool eliminate(const Part &part, double shift, std::vector<Factors::Entry> &left);
};

}  // namespace jamlab
