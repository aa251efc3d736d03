// SPDX-License-Identifier: GPL-2.0-or-later
#include "elimination_order.h"

#include <algorithm>

using namespace LAMMPS_NS;

EliminationOrder::EliminationOrder(const std::vector<int> &first, const std::vector<int> &others) :
    rows(first.size() - 1), elements(rows.size(), {{}, 0, -1}), of_degree(rows.size() + 1, -1),
    mark(rows.size(), -1)
{
  for (std::size_t i = rows.size(); i-- > 0;) {
    rows[i] = {{others.begin() + first[i], others.begin() + first[i + 1]}, {}, 0, -1, -1};
    put(static_cast<int>(i), first[i + 1] - first[i]);
  }
}

std::vector<int> EliminationOrder::find()
{
  std::vector<int> order;
  least = 0;
  while (order.size() < rows.size()) {
    while (of_degree[least] < 0) least++;
    order.push_back(of_degree[least]);
    eliminate(order.back());
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

/* Row p and its elements become one element. */
void EliminationOrder::eliminate(int p)
{
  take(p);
  mark[p] = p;
  std::vector<int> joined;
  const auto join = [&](const std::vector<int> &from) {
    for (const int i : from)
      if (mark[i] != p) {
        mark[i] = p;
        joined.push_back(i);
      }
  };
  join(rows[p].rows);
  for (const int e : rows[p].elements) {
    join(elements[e].rows);
    elements[e].rows = {};
  }
  rows[p] = {{}, {}, 0, -1, -1};
  elements[p].rows = joined;

  for (const int i : joined)
    for (const int e : rows[i].elements) {
      Element &element = elements[e];
      if (element.seen != p) element.outside = static_cast<int>(element.rows.size());
      element.seen = p;
      element.outside--;
    }
  for (const int i : joined) renew(i, p);
}

/* Row i now has the neighbors of element p; elements that lie within p are dropped. */
void EliminationOrder::renew(int i, int p)
{
  Row &row = rows[i];
  take(i);
  const auto drop = [](std::vector<int> &from, auto which) {
    from.erase(std::remove_if(from.begin(), from.end(), which), from.end());
  };
  drop(row.rows, [&](int j) { return mark[j] == p; });
  drop(row.elements, [&](int e) { return elements[e].rows.empty() || elements[e].outside <= 0; });
  std::size_t degree = row.rows.size() + elements[p].rows.size() - 1;
  for (const int e : row.elements) degree += elements[e].outside;
  row.elements.push_back(p);
  put(i, static_cast<int>(std::min(degree, rows.size() - 1)));
}
