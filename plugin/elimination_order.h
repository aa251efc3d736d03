// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <vector>

namespace LAMMPS_NS {

/* EliminationOrder finds an order of the rows of a sparse symmetric matrix with little fill. The
   row with the fewest neighbors goes first; its neighbors then are neighbors of each other. Such a
   set of rows is kept as one element, never as pairs, and numbers of neighbors are upper bounds:
   Amestoy, Davis and Duff, SIAM J. Matrix Anal. Appl. 17, 886 (1996). */
class EliminationOrder {
 public:
  // The neighbors of row i, sorted or not, are others[first[i]] to others[first[i + 1] - 1].
  EliminationOrder(const std::vector<int> &first, const std::vector<int> &others);
  std::vector<int> find();    // rows, in the order of their elimination

 private:
  struct Row {
    int first, elements;          // in `near`: from `first` on, so many elements that it is in
    int others, end;              // then free room, and neighbors that are left
    int degree, before, after;    // the same degree
  };
  struct Element {
    int first, end;       // in `members`: its rows; none of an absorbed element
    int outside, seen;    // rows that are not in the newest element, if looked at for it
  };
  std::vector<int> near, members;
  std::vector<Row> rows;
  std::vector<Element> elements;    // by the row that made them
  std::vector<int> of_degree;       // first row of each degree, -1 if none
  std::vector<int> mark;            // the newest element that a row is in
  int least = 0;

  void put(int i, int degree);
  void take(int i);
  void eliminate(int p, std::vector<int> &order);
  bool shorten(int i, int p);
  void renew(int i, int p);
};

}    // namespace LAMMPS_NS
