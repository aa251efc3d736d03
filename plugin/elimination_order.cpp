// SPDX-License-Identifier: GPL-2.0-or-later
#include "elimination_order.h"

#include <algorithm>

using namespace LAMMPS_NS;

EliminationOrder::EliminationOrder(const std::vector<int> &first, const std::vector<int> &others) :
    near(others), rows(first.size() - 1), elements(rows.size(), {0, 0, 0, -1}),
    of_degree(rows.size() + 1, -1), mark(rows.size(), -1)
{
  members.reserve(2 * others.size());
  for (std::size_t i = rows.size(); i-- > 0;) {
    rows[i] = {first[i], 0, first[i], first[i + 1], 0, -1, -1};
    put(static_cast<int>(i), first[i + 1] - first[i]);
  }
}

std::vector<int> EliminationOrder::find()
{
  std::vector<int> order;
  order.reserve(rows.size());
  least = 0;
  while (order.size() < rows.size()) {
    while (of_degree[least] < 0) least++;
    order.push_back(of_degree[least]);
    eliminate(order.back(), order);
  }
  return order;
}

void EliminationOrder::put(int i, int degree)
{
  const int next = of_degree[degree];
  rows[i].degree = degree;
  rows[i].before = -1;
  rows[i].after = next;
  if (next >= 0) rows[next].before = i;
  of_degree[degree] = i;
  least = std::min(least, degree);
}

void EliminationOrder::take(int i)
{
  const Row &row = rows[i];
  (row.before < 0 ? of_degree[row.degree] : rows[row.before].after) = row.after;
  if (row.after >= 0) rows[row.after].before = row.before;
}

/* Row p and its elements become one element. Rows that it holds with all their neighbors follow at
   once: they fill nothing more. */
void EliminationOrder::eliminate(int p, std::vector<int> &order)
{
  take(p);
  mark[p] = p;
  const int begin = static_cast<int>(members.size());
  const auto join = [&](int i) {
    if (mark[i] == p) return;
    mark[i] = p;
    members.push_back(i);
  };
  const Row &own = rows[p];
  for (int n = own.others; n < own.end; n++) join(near[n]);
  for (int n = own.first; n < own.first + own.elements; n++) {
    Element &element = elements[near[n]];
    for (int k = element.first; k < element.end; k++) join(members[k]);
    element.end = element.first;
  }
  const int end = static_cast<int>(members.size());
  elements[p] = {begin, end, 0, -1};

  for (int k = begin; k < end; k++) {
    const Row &row = rows[members[k]];
    for (int n = row.first; n < row.first + row.elements; n++) {
      Element &element = elements[near[n]];
      if (element.seen != p) element.outside = element.end - element.first;
      element.seen = p;
      element.outside--;
    }
  }
  int to = begin;
  for (int k = begin; k < end; k++)
    if (const int i = members[k]; shorten(i, p))
      members[to++] = i;
    else
      order.push_back(i);
  elements[p].end = to;
  for (int k = begin; k < to; k++) renew(members[k], p);
}

/* Row i now has the neighbors of element p; other neighbors and elements that lie within p are
   dropped. There is room for p, as p has ceased to be a neighbor or an element of p one of
   row i. Returns whether row i has neighbors outside p. */
bool EliminationOrder::shorten(int i, int p)
{
  Row &row = rows[i];
  take(i);
  int to = row.end;
  for (int n = row.end; n-- > row.others;)
    if (mark[near[n]] != p) near[--to] = near[n];
  row.others = to;
  to = row.first;
  for (int n = row.first; n < row.first + row.elements; n++)
    if (const Element &e = elements[near[n]]; e.first < e.end && e.outside > 0)
      near[to++] = near[n];
  near[to++] = p;
  row.elements = to - row.first;
  return row.elements > 1 || row.others < row.end;
}

void EliminationOrder::renew(int i, int p)
{
  const Row &row = rows[i];
  std::size_t degree = elements[p].end - elements[p].first - 1 + row.end - row.others;
  for (int n = row.first; n < row.first + row.elements - 1; n++)
    degree += elements[near[n]].outside;
  put(i, static_cast<int>(std::min(degree, rows.size() - 1)));
}
