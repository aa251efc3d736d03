// SPDX-License-Identifier: GPL-2.0-or-later
#include "block_cholesky.h"

#include "dense_panel.h"
#include "elimination_order.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <limits>
#include <numeric>
#include <utility>

using namespace LAMMPS_NS;

static constexpr double GROWN = 1.3;    // blocks of the factors, over those in a new order
static constexpr double GROWTH = 1e7;   // of the numbers of L S L^T, over the largest of the matrix
static constexpr double ZEROS = 0.2;    // part of a panel that may be blocks that stay zero

template <int D> void BlockCholesky<D>::set_pattern(int size, const std::vector<Entry> &entries)
{
  copies.clear();
  use(read(size, entries));
}

template <int D>
void BlockCholesky<D>::set_pattern(int size, const int *first, const int *rows)
{
  std::vector<int> seen(size, -1);
  Graph found;
  found.first.push_back(0);
  for (int i = 0; i < size; i++) {
    seen[i] = i;
    for (int n = first[D * i]; n < first[D * (i + 1)]; n++)
      if (const int j = rows[n] / D; seen[j] != i) {
        seen[j] = i;
        found.other.push_back(j);
      }
    found.first.push_back(static_cast<int>(found.other.size()));
  }
  found = transposed(found);
  if (const Graph turned = transposed(found); !(turned == found)) found = united(found, turned);
  use(std::move(found));

  copies.clear();
  place.resize(size);
  for (const Panel &panel : panels) {
    find_places(panel);
    for (int c = panel.begin; c < panel.end; c++)
      for (int b = 0; b < D; b++) {
        const int k = D * row[c] + b;
        const std::size_t to = panel.values + (D * (c - panel.begin) + b) * panel.stride;
        for (int n = first[k]; n < first[k + 1]; n++) {
          const int r = rank[rows[n] / D], a = rows[n] % D;
          if (r > c || (r == c && a >= b))
            copies.push_back({static_cast<std::size_t>(n), to + D * place[r] + a});
        }
      }
  }
}

template <int D> void BlockCholesky<D>::set(const double *numbers)
{
  std::fill(values.begin(), values.end(), 0.0);
  for (const Copy &copy : copies) values[copy.to] += numbers[copy.from];
}

template <int D> void BlockCholesky<D>::use(Graph &&found)
{
  const int size = static_cast<int>(found.first.size()) - 1;
  const bool ordered = static_cast<int>(rank.size()) == size;
  if (ordered && found == graph) return;
  graph = std::move(found);
  if (ordered) find_fill();
  if (ordered && filled <= GROWN * filled_when_ordered) return;
  find_order();
  find_fill();
  filled_when_ordered = filled;
}

/* The same with rows and columns exchanged, which sorts each row. */
template <int D> auto BlockCholesky<D>::transposed(const Graph &of) const -> Graph
{
  const int size = static_cast<int>(of.first.size()) - 1;
  Graph found{std::vector<int>(size + 1, 0), std::vector<int>(of.other.size())};
  for (const int j : of.other) found.first[j + 1]++;
  std::partial_sum(found.first.begin(), found.first.end(), found.first.begin());
  std::vector<int> next = found.first;
  for (int i = 0; i < size; i++)
    for (int n = of.first[i]; n < of.first[i + 1]; n++) found.other[next[of.other[n]]++] = i;
  return found;
}

/* A sum of matrices may drop a zero from one triangle that is rounding in the other. */
template <int D> auto BlockCholesky<D>::united(const Graph &a, const Graph &b) const -> Graph
{
  Graph found;
  found.first.push_back(0);
  for (std::size_t i = 0; i + 1 < a.first.size(); i++) {
    const auto row_of = [i](const Graph &g, int end) { return g.other.begin() + g.first[i + end]; };
    std::set_union(row_of(a, 0), row_of(a, 1), row_of(b, 0), row_of(b, 1),
                   std::back_inserter(found.other));
    found.first.push_back(static_cast<int>(found.other.size()));
  }
  return found;
}

template <int D>
auto BlockCholesky<D>::read(int size, const std::vector<Entry> &entries) const -> Graph
{
  std::vector<int> end(size + 1, 0), other(2 * entries.size());
  for (const Entry &e : entries) {
    end[e.i] += e.i != e.j;
    end[e.j] += e.i != e.j;
  }
  std::partial_sum(end.begin(), end.end(), end.begin());
  for (const Entry &e : entries) {    // each row is filled from its end
    if (e.i == e.j) continue;
    other[--end[e.i]] = e.j;
    other[--end[e.j]] = e.i;
  }
  // the transpose is the same graph with sorted rows
  std::vector<int> next = end, sorted(end[size]);
  for (int i = 0; i < size; i++)
    for (int n = end[i]; n < end[i + 1]; n++) sorted[next[other[n]]++] = i;
  Graph found;
  found.first.push_back(0);
  for (int i = 0; i < size; i++) {
    for (int n = end[i]; n < end[i + 1]; n++)
      if (n == end[i] || sorted[n] != sorted[n - 1]) found.other.push_back(sorted[n]);
    found.first.push_back(static_cast<int>(found.other.size()));
  }
  return found;
}

template <int D> void BlockCholesky<D>::find_order()
{
  row = EliminationOrder(graph.first, graph.other).find();
  rank.resize(row.size());
  for (std::size_t c = 0; c < row.size(); c++) rank[row[c]] = static_cast<int>(c);
}

/* The parent of a column in a tree is the row of its first block below the diagonal. */
template <int D> std::vector<int> BlockCholesky<D>::find_parents() const
{
  const int size = static_cast<int>(row.size());
  std::vector<int> parent(size, -1), highest(size, -1);    // highest: known so far above a column
  for (int c = 0; c < size; c++)
    for (int n = graph.first[row[c]]; n < graph.first[row[c] + 1]; n++)
      for (int i = rank[graph.other[n]]; i >= 0 && i < c;) {
        const int above = highest[i];
        highest[i] = c;
        if (above < 0) parent[i] = c;
        i = above;
      }
  return parent;
}

/* In the new order, which keeps the factors, a column follows the last of its children. Parents in
   this order are returned. */
template <int D> std::vector<int> BlockCholesky<D>::order_children_first()
{
  const int size = static_cast<int>(row.size());
  const std::vector<int> parent = find_parents();
  std::vector<int> first_child(size + 1, -1), next_child(size, -1), order, way, place_of(size);
  for (int c = size - 1; c >= 0; c--) {
    const int above = parent[c] < 0 ? size : parent[c];
    next_child[c] = first_child[above];
    first_child[above] = c;
  }
  for (int root = first_child[size]; root >= 0; root = next_child[root]) {
    way.push_back(root);
    while (!way.empty()) {
      int &child = first_child[way.back()];
      if (child >= 0) {
        way.push_back(child);
        child = next_child[child];
      } else {
        place_of[way.back()] = static_cast<int>(order.size());
        order.push_back(row[way.back()]);
        way.pop_back();
      }
    }
  }
  row = order;
  for (int c = 0; c < size; c++) rank[row[c]] = c;
  std::vector<int> moved(size, -1);
  for (int c = 0; c < size; c++)
    if (parent[c] >= 0) moved[place_of[c]] = place_of[parent[c]];
  return moved;
}

/* Numbers of blocks in each column of the factors, the diagonal too: J. R. Gilbert, E. G. Ng and
   B. W. Peyton, SIAM J. Matrix Anal. Appl. 15, 1075 (1994). A row has blocks in the columns of a
   subtree, whose leaves are counted, less the columns where two of its branches meet. */
template <int D>
std::vector<int> BlockCholesky<D>::count_blocks(const std::vector<int> &parent) const
{
  const int size = static_cast<int>(row.size());
  std::vector<int> count(size), first(size, -1), seen(size, -1), leaf(size, -1), up(size);
  for (int c = 0; c < size; c++) {
    count[c] = first[c] < 0;    // a leaf of the tree
    for (int i = c; i >= 0 && first[i] < 0; i = parent[i]) first[i] = c;
  }
  std::iota(up.begin(), up.end(), 0);
  for (int c = 0; c < size; c++) {
    if (parent[c] >= 0) count[parent[c]]--;
    for (int n = graph.first[row[c]]; n < graph.first[row[c] + 1]; n++) {
      const int r = rank[graph.other[n]];
      if (r < c || first[c] <= seen[r]) continue;    // not a leaf of the subtree of row r
      count[c]++;
      if (leaf[r] >= 0) {
        int meet = leaf[r];
        while (meet != up[meet]) meet = up[meet];
        for (int i = leaf[r]; i != meet;) i = std::exchange(up[i], meet);
        count[meet]--;
      }
      seen[r] = first[c];
      leaf[r] = c;
    }
    if (parent[c] >= 0) up[c] = parent[c];
  }
  for (int c = 0; c < size; c++)
    if (parent[c] >= 0) count[parent[c]] += count[c];
  return count;
}

template <int D> void BlockCholesky<D>::find_fill()
{
  const std::vector<int> parent = order_children_first(), count = count_blocks(parent);
  filled = updated = 0.0;
  for (const int blocks : count) {
    const double below = blocks - 1.0;
    filled += below;
    updated += 0.5 * below * (below + 1.0);
  }
  make_panels(parent, count);
}

/* A column joins the panel of the columns before it if its first child is the last of them, and few
   blocks of the panel stay zero. Below its columns, a panel has the rows of its last column. */
template <int D>
void BlockCholesky<D>::make_panels(const std::vector<int> &parent, const std::vector<int> &count)
{
  const int size = static_cast<int>(count.size());
  std::vector<std::pair<int, double>> parts;    // first column and number of nonzero blocks
  const auto worthwhile = [&](int begin, int last, double blocks) {
    const double width = last - begin + 1;
    const double all = 0.5 * width * (width + 1.0) + width * (count[last] - 1);
    return all - blocks <= ZEROS * all;
  };
  for (int c = 0; c < size; c++) {
    int begin = c;
    double blocks = count[c];
    while (!parts.empty() && parent[begin - 1] == begin &&
           worthwhile(parts.back().first, c, parts.back().second + blocks)) {
      begin = parts.back().first;
      blocks += parts.back().second;
      parts.pop_back();
    }
    parts.emplace_back(begin, blocks);
  }

  panels.clear();
  spots.clear();
  panel_of.resize(size);
  std::size_t room = 0;
  int tallest = 0, rows = 0;
  for (std::size_t k = 0; k < parts.size(); k++) {
    const int begin = parts[k].first, end = k + 1 < parts.size() ? parts[k + 1].first : size;
    Panel panel = {begin, end, rows, count[end - 1] - 1, 0, room};
    rows += panel.rows;
    panel.stride = padded(panel.height());
    room += panel.stride * panel.width();
    tallest = std::max(tallest, panel.height());
    std::fill(panel_of.begin() + begin, panel_of.begin() + end, static_cast<int>(panels.size()));
    panels.push_back(panel);
  }
  lower.resize(rows);
  find_rows(parent);
  values.resize(room + PANEL_ROWS);
  gathered.resize(TOGETHER * padded(tallest));
  product.resize(std::max<std::size_t>(product.size(), PANEL_COLUMNS * padded(tallest)));
}

/* Rows below a panel are those of its columns in the matrix, and those below the panels whose first
   row is one of its columns. */
template <int D> void BlockCholesky<D>::find_rows(const std::vector<int> &parent)
{
  const int many = static_cast<int>(panels.size());
  std::vector<int> seen(row.size(), -1), child(many, -1), next(many, -1);
  for (int k = 0; k < many; k++) {
    const Panel &panel = panels[k];
    int *to = lower.data() + panel.below;
    const auto take = [&](int r) {
      if (r < panel.end || seen[r] == k) return;
      seen[r] = k;
      *to++ = r;
    };
    for (int c = panel.begin; c < panel.end; c++)
      for (int n = graph.first[row[c]]; n < graph.first[row[c] + 1]; n++)
        take(rank[graph.other[n]]);
    for (int j = child[k]; j >= 0; j = next[j])
      for (int n = 0; n < panels[j].rows; n++) take(lower[panels[j].below + n]);
    std::sort(lower.data() + panel.below, to);
    if (const int above = parent[panel.end - 1]; above >= 0)
      next[k] = std::exchange(child[panel_of[above]], k);
  }
}

/* Entries of the same rows and columns as the last time, in the same order, go to the same
   spots. */
template <int D> void BlockCholesky<D>::set(const std::vector<Entry> &entries)
{
  const auto known = [](const Spot &spot, const Entry &e) {
    return spot.i == e.i && spot.j == e.j;
  };
  if (!std::equal(spots.begin(), spots.end(), entries.begin(), entries.end(), known))
    find_spots(entries);
  std::fill(values.begin(), values.end(), 0.0);
  for (std::size_t n = 0; n < entries.size(); n++) {
    const Spot &spot = spots[n];
    const double *const from = entries[n].block.data();
    double *const to = &values[spot.to];
    for (int a = 0; a < D; a++)
      for (int b = 0; b < D; b++)
        to[b * spot.stride + a] += from[spot.turned ? D * b + a : D * a + b];
  }
}

/* Entries are taken panel by panel, so that the places of rows are found once for each panel. */
template <int D> void BlockCholesky<D>::find_spots(const std::vector<Entry> &entries)
{
  std::vector<int> end(panels.size() + 1, 0), of_panel(entries.size());
  const auto panel_number = [this](const Entry &e) {
    return panel_of[std::min(rank[e.i], rank[e.j])];
  };
  for (const Entry &e : entries) end[panel_number(e)]++;
  std::partial_sum(end.begin(), end.end(), end.begin());
  for (std::size_t n = entries.size(); n-- > 0;)
    of_panel[--end[panel_number(entries[n])]] = static_cast<int>(n);
  place.resize(rank.size());
  spots.resize(entries.size());
  for (std::size_t k = 0; k < panels.size(); k++) {
    const Panel &panel = panels[k];
    find_places(panel);
    for (int n = end[k]; n < end[k + 1]; n++) {
      const Entry &entry = entries[of_panel[n]];
      const int i = rank[entry.i], j = rank[entry.j], c = std::min(i, j) - panel.begin;
      const std::size_t to = panel.values + D * c * panel.stride + D * place[std::max(i, j)];
      // the block of the lower triangle is the transposed one where i < j
      spots[of_panel[n]] = {entry.i, entry.j, i < j, panel.stride, to};
    }
  }
}

template <int D> void BlockCholesky<D>::find_places(const Panel &panel)
{
  const int columns = panel.end - panel.begin;
  std::iota(place.begin() + panel.begin, place.begin() + panel.end, 0);
  for (int n = 0; n < panel.rows; n++) place[lower[panel.below + n]] = columns + n;
}

template <int D> double BlockCholesky<D>::mean_diagonal() const
{
  double total = 0.0;
  for (const Panel &panel : panels)
    for (int k = 0; k < panel.width(); k++) total += values[panel.values + k * (panel.stride + 1)];
  return rank.empty() ? 0.0 : total / (D * rank.size());
}

template <int D> bool BlockCholesky<D>::factorise(double shift)
{
  signs.clear();
  return eliminate(shift, 0.0);
}

/* Without pivoting, a small pivot makes large factors: rounding has the effect of a change of the
   matrix by some 1e-16 of the largest row of L, squared. */
template <int D> bool BlockCholesky<D>::factorise_indefinite(double shift)
{
  double largest = std::abs(shift);
  for (const double number : values) largest = std::max(largest, std::abs(number));
  signs.resize(D * rank.size());
  if (!eliminate(shift, std::numeric_limits<double>::min())) return false;
  solved.assign(std::max(solved.size(), signs.size()), 0.0);    // rows of L, squared
  for (const Panel &panel : panels)
    for (int k = 0; k < panel.width(); k++) {
      const double *const own = &values[panel.values + k * panel.stride];
      solved[D * panel.begin + k] += 1.0 / (own[k] * own[k]);
      for (int r = k + 1; r < panel.width(); r++) solved[D * panel.begin + r] += own[r] * own[r];
      for (int r = 0; r < D * panel.rows; r++)
        solved[D * lower[panel.below + r / D] + r % D] += std::pow(own[panel.width() + r], 2);
    }
  for (std::size_t k = 0; k < signs.size(); k++)
    if (!(solved[k] <= GROWTH * largest)) {
      stopped = D * row[k / D] + static_cast<int>(k % D);
      return false;
    }
  return true;
}

template <int D> int BlockCholesky<D>::negative() const
{
  return static_cast<int>(std::count(signs.begin(), signs.end(), -1.0));
}

/* The diagonal block of each panel is replaced by its factor, a lower triangle. The rows B below it
   become L = B factor^-T S, and L S L^T is subtracted from the rest of the matrix. */
template <int D> bool BlockCholesky<D>::eliminate(double shift, double least)
{
  stopped = -1;
  values_rounded = false;
  const auto factor = signs.empty() ? dense->factorise : dense->factorise_signed;
  for (const Panel &panel : panels) {
    double *const own = &values[panel.values];
    for (int k = 0; k < panel.width(); k++) own[k * (panel.stride + 1)] += shift;
    const int done = factor(own, panel.width(), panel.height(), panel.stride, product.data(),
                            signs.data() + (signs.empty() ? 0 : D * panel.begin), least);
    if (done < panel.width()) {
      stopped = D * row[panel.begin + done / D] + done % D;
      return false;
    }
    if (panel.rows) subtract_product(panel);
  }
  return true;
}

template <int D> void BlockCholesky<D>::subtract_product(const Panel &panel)
{
  const int size = D * panel.rows;
  const std::size_t stride = padded(size);
  product.resize(std::max(product.size(), stride * stride));
  const auto multiply = signs.empty() ? dense->multiply : dense->multiply_signed;
  multiply(&values[panel.values + panel.width()], panel.width(), size, panel.stride,
           signs.data() + (signs.empty() ? 0 : D * panel.begin), product.data(), stride);

  const int *const rows = lower.data() + panel.below;
  for (int n = 0; n < panel.rows;) {    // for the columns of one other panel at a time
    const Panel &other = panels[panel_of[rows[n]]];
    const int *const theirs = lower.data() + other.below;
    for (; n < panel.rows && rows[n] < other.end; n++) {
      const double *const from = &product[D * n * stride];
      double *const to = column(other, D * (rows[n] - other.begin));
      const auto subtract = [&](int k, int place) {
        for (int b = 0; b < D; b++)
          for (int a = 0; a < D; a++)
            to[b * other.stride + D * place + a] -= from[b * stride + D * k + a];
      };
      int k = n, place = 0;
      for (; k < panel.rows && rows[k] < other.end; k++) subtract(k, rows[k] - other.begin);
      for (; k < panel.rows; k++) {
        while (theirs[place] != rows[k]) place++;
        subtract(k, other.end - other.begin + place);
      }
    }
  }
}

template class LAMMPS_NS::BlockCholesky<1>;    // any symmetric matrix
template class LAMMPS_NS::BlockCholesky<2>;    // vertices
template class LAMMPS_NS::BlockCholesky<3>;    // disks, which rotate
