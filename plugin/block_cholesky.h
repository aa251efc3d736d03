// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "dense_panel.h"
#include "vector_bytes.h"

#include <array>
#include <vector>

namespace LAMMPS_NS {

/* BlockCholesky holds the Cholesky factors of a sparse symmetric matrix of D x D blocks, with one
   row of blocks for each vertex or disk. An order of elimination is kept for other patterns of the
   same rows, until their factors have 1.3 times the blocks. Neighboring columns of the factors with
   nearly the same rows are one dense panel. */
template <int D> class BlockCholesky {
 public:
  using Block = std::array<double, D * D>;    // row by row
  struct Entry {    // to row i, column j; one of (i, j) and (j, i)
    int i, j;
    Block block;
  };

  // Sets where blocks may differ from zero: where entries are, in any order, repeated or not.
  void set_pattern(int size, const std::vector<Entry> &);
  // The same from a matrix of numbers by columns, of D size each: rows of column c are
  // rows[first[c]] and so on. Of two elements (r, c) and (c, r) one may be missing.
  void set_pattern(int size, const int *first, const int *rows);
  void forget_order() { rank.clear(); }          // rows are other ones from now on
  void set(const std::vector<Entry> &);          // the sum of entries, within the pattern
  void set(const double *numbers);               // of the matrix by columns that set the pattern
  bool factorise(double shift);    // shift: added to the diagonal; false: not positive definite
  // The same as L S L^T with signs S, without pivoting. False: a pivot is so small that rounding
  // would take more than half of the digits; another shift may do.
  bool factorise_indefinite(double shift);
  int negative() const;                        // number of negative eigenvalues
  int stopped_at() const { return stopped; }    // number of a row without a pivot, -1 if none
  void solve(std::vector<double> &r);    // D numbers of each row: right-hand side in, solution out
  void solve(double *r, int count);      // for several; those of one number of a row lie together
  // In single precision, from factors of a positive definite matrix: a preconditioner at half the
  // cost. The first solution after each factorisation rounds them.
  void solve_roughly(std::vector<double> &r);
  int size() const { return static_cast<int>(rank.size()); }
  double mean_diagonal() const;
  double blocks_below() const { return filled; }
  double updates() const { return updated; }    // products of two blocks in a factorisation
  double memory_usage() const
  {
    return bytes(values, rounded, product, solved, panels, graph.other, lower, spots);
  }

 private:
  struct Graph {    // of each row, the other rows that it has blocks with, in order
    std::vector<int> first, other;
    bool operator==(const Graph &o) const { return first == o.first && other == o.other; }
  };
  struct Panel {
    int begin, end;           // columns, in the order of elimination
    int below, rows;          // begin and number of the ranks of its lower rows in `lower`
    std::ptrdiff_t stride;    // of its columns, in numbers
    std::size_t values;       // column by column, from the row of the first column down
    int width() const { return D * (end - begin); }
    int height() const { return D * (end - begin + rows); }
  };

  Graph graph;
  std::vector<int> rank, row;    // place of each row in the order of elimination, and the reverse
  std::vector<int> lower, panel_of;       // rows of panels; panel of each column
  std::vector<int> place;                 // of each row in the panel at hand
  struct Copy {
    std::size_t from, to;
  };
  struct Spot {    // of an entry in values
    int i, j;
    bool turned;
    std::ptrdiff_t stride;
    std::size_t to;
  };
  std::vector<Spot> spots;
  std::vector<Copy> copies;    // of numbers of a matrix by columns, to values
  std::vector<Panel> panels;
  const DensePanels *dense = &dense_panels();
  std::vector<double> values, product, solved, gathered;
  std::vector<float> rounded, rough, few;    // values, a solution, and its numbers of one panel
  bool values_rounded = false;
  std::vector<double> signs;    // in the order of elimination; none of a positive definite matrix
  int stopped = -1;
  double filled = 0.0, updated = 0.0, filled_when_ordered = 0.0;

  Graph read(int size, const std::vector<Entry> &) const;
  Graph transposed(const Graph &) const;
  Graph united(const Graph &, const Graph &) const;
  void use(Graph &&);
  void find_places(const Panel &);
  void find_order();
  std::vector<int> order_children_first();
  void find_fill();
  std::vector<int> count_blocks(const std::vector<int> &parent) const;
  void make_panels(const std::vector<int> &parent, const std::vector<int> &count);
  void find_rows(const std::vector<int> &parent);
  void find_spots(const std::vector<Entry> &);
  std::vector<int> find_parents() const;
  bool eliminate(double shift, double least);
  void subtract_product(const Panel &);
  void round_values();
  template <class Number>
  void solve_one(double *r, int apart, const Number *factors, DensePanels::Step<Number> *down,
                 DensePanels::Step<Number> *up, std::vector<Number> &solved,
                 std::vector<Number> &gathered);
  void solve_four(double *r, int apart, int count);
  double *column(const Panel &panel, int k) { return &values[panel.values + k * panel.stride]; }
};

}    // namespace LAMMPS_NS
