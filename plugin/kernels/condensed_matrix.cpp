// This file eliminates the rows of droplets that nothing joins with others, and solves for them.

#include "condensed_matrix.h"

#include "../dense_panel.h"

#include <algorithm>

using namespace jamlab;
using LAMMPS_NS::padded;

// The first wide term of a row is its home. A term that leaves a part makes its rows outer ones.
void CondensedMatrix::join(const std::vector<int> &rows)
{
  if (rows.size() >= WIDE) {
    const int number = static_cast<int>(parts.size());
    parts.emplace_back();
    for (const int r : rows)
      if (r >= 0 && home[r] < 0) home[r] = number;
  }
  int first = -1;
  bool together = true;
  for (const int r : rows) {
    if (r < 0) continue;
    if (first < 0) first = r;
    together = together && in_part(first, r);
  }
  if (together) return;
  for (const int r : rows)
    if (r >= 0) outer[r] = 1;
}

void CondensedMatrix::arrange()
{
  const int size = static_cast<int>(home.size());
  for (int r = 0; r < size; ++r)
    if (home[r] >= 0 && !outer[r]) parts[home[r]].rows.push_back(r);
  for (Part &part : parts) part.inner = static_cast<int>(part.rows.size());
  for (int r = 0; r < size; ++r) {
    if (home[r] >= 0 && !outer[r]) {
      outer[r] = -1;
      continue;
    }
    outer[r] = static_cast<int>(lasts.size());
    lasts.push_back(r);
    if (home[r] >= 0) parts[home[r]].rows.push_back(r);
  }
  std::size_t all = 0, eliminated = 0, tallest = 0;
  for (Part &part : parts) {
    for (std::size_t k = 0; k < part.rows.size(); ++k) place[part.rows[k]] = static_cast<int>(k);
    part.stride = padded(part.height());
    part.numbers = all;
    part.panel = eliminated;
    all += part.stride * part.height();
    eliminated += part.stride * part.width();
    tallest = std::max<std::size_t>(tallest, part.stride);
  }
  numbers.assign(all, 0.0);
  panels.assign(eliminated + LAMMPS_NS::PANEL_ROWS, 0.0);
  room.resize(tallest * LAMMPS_NS::PANEL_COLUMNS);
  product.resize(tallest * tallest);
}

void CondensedMatrix::add(int i, int j, const Block &block)
{
  if (!in_part(i, j)) {
    between.push_back({outer[i], outer[j], block});
    return;
  }
  const Part &part = parts[home[i]];
  const int k = place[i], m = place[j];  // the lower triangle is held
  double *const to = &numbers[part.numbers + 2 * std::min(k, m) * part.stride + 2 * std::max(k, m)];
  to[0] += block[0];
  to[1] += block[k < m ? 1 : 2];
  to[part.stride] += block[k < m ? 2 : 1];
  to[part.stride + 1] += block[3];
}

double CondensedMatrix::largest_diagonal() const
{
  std::vector<double> found(2 * lasts.size(), 0.0);
  for (const Factors::Entry &e : between)
    if (e.i == e.j) {
      found[2 * e.i] += e.block[0];
      found[2 * e.i + 1] += e.block[3];
    }
  for (const Part &part : parts)
    for (int k = 0; k < part.height(); ++k)
      found.push_back(numbers[part.numbers + k * (part.stride + 1)]);
  return *std::max_element(found.begin(), found.end());
}

static void subtract(double a, double b, const PerStrain &x, const PerStrain &y, PerStrain &from)
{
  for (int q = 0; q < STRAINS; ++q) from[q] -= a * x[q] + b * y[q];
}

void CondensedMatrix::subtract_product(const Columns &x, Columns &r) const
{
  Columns own, left;
  for (const Part &part : parts) {
    own.clear();
    for (const int row : part.rows) own.insert(own.end(), &x[2 * row], &x[2 * row] + 2);
    left.assign(own.size(), PerStrain{});
    for (int c = 0; c < part.height(); ++c) {
      const double *const column = &numbers[part.numbers + c * part.stride];
      PerStrain sum{};
      for (int k = c + 1; k < part.height(); ++k)
        for (int q = 0; q < STRAINS; ++q) {
          left[k][q] += column[k] * own[c][q];
          sum[q] += column[k] * own[k][q];
        }
      for (int q = 0; q < STRAINS; ++q) left[c][q] += column[c] * own[c][q] + sum[q];
    }
    for (int k = 0; k < part.height(); ++k)
      for (int q = 0; q < STRAINS; ++q) r[2 * part.rows[k / 2] + k % 2][q] -= left[k][q];
  }
  for (const Factors::Entry &e : between) {
    const int i = 2 * lasts[e.i], j = 2 * lasts[e.j];
    const Block &b = e.block;
    subtract(b[0], b[1], x[j], x[j + 1], r[i]);
    subtract(b[2], b[3], x[j], x[j + 1], r[i + 1]);
    if (i == j) continue;
    subtract(b[0], b[2], x[i], x[i + 1], r[j]);
    subtract(b[1], b[3], x[i], x[i + 1], r[j + 1]);
  }
}

bool CondensedMatrix::factorise(double shift)
{
  std::vector<Factors::Entry> left = between;
  for (const Part &part : parts)
    if (!eliminate(part, shift, left)) return false;
  if (lasts.empty()) return true;
  factors.set_pattern(static_cast<int>(lasts.size()), left);
  factors.set(left);
  return factors.factorise(shift);
}

// Inner rows are eliminated. What is left of the others is added to `left`.
bool CondensedMatrix::eliminate(const Part &part, double shift, std::vector<Factors::Entry> &left)
{
  const int width = part.width(), size = part.height() - width, apart = padded(size);
  const double *const whole = &numbers[part.numbers];
  double *const own = &panels[part.panel];
  std::fill(product.begin(), product.begin() + static_cast<std::ptrdiff_t>(size) * apart, 0.0);
  if (width) {
    std::copy_n(whole, width * part.stride, own);
    for (int k = 0; k < width; ++k) own[k * (part.stride + 1)] += shift;
    const int height = part.height();
    if (dense->factorise(own, width, height, part.stride, room.data(), nullptr, 0.0) < width)
      return false;
    if (size)
      dense->multiply(own + width, width, size, part.stride, nullptr, product.data(), apart);
  }
  const double *const corner = whole + width * (part.stride + 1);
  const auto number = [&](int row, int column) {
    return corner[column * part.stride + row] - product[column * apart + row];
  };
  for (int a = 0; a < size; a += 2)
    for (int b = 0; b <= a; b += 2) {
      const double lower = number(a + 1, b), upper = a == b ? lower : number(a, b + 1);
      left.push_back({outer[part.rows[(width + a) / 2]], outer[part.rows[(width + b) / 2]],
                      {number(a, b), upper, lower, number(a + 1, b + 1)}});
    }
  return true;
}

void CondensedMatrix::solve(Columns &r)
{
  Columns solved, below, rest;
  for (const int row : lasts) rest.insert(rest.end(), &r[2 * row], &r[2 * row] + 2);
  const auto inner = [&](const Part &part) {
    solved.clear();
    for (int k = 0; k < part.inner; ++k)
      solved.insert(solved.end(), &r[2 * part.rows[k]], &r[2 * part.rows[k]] + 2);
    below.clear();
    for (std::size_t k = part.inner; k < part.rows.size(); ++k) {
      const PerStrain *const from = &rest[2 * outer[part.rows[k]]];
      below.insert(below.end(), from, from + 2);
    }
  };
  const auto put_inner = [&](const Part &part) {
    for (int k = 0; k < part.width(); ++k) r[2 * part.rows[k / 2] + k % 2] = solved[k];
  };
  for (const Part &part : parts) {
    if (!part.inner) continue;
    inner(part);
    dense->down_four(&panels[part.panel], part.width(), static_cast<int>(below.size()), part.stride,
                     solved[0].data(), below.empty() ? nullptr : below[0].data());
    put_inner(part);
    for (std::size_t k = 0; k < below.size(); ++k)
      rest[2 * outer[part.rows[part.inner + k / 2]] + k % 2] = below[k];
  }
  if (!lasts.empty()) factors.solve(rest[0].data(), STRAINS);
  for (const Part &part : parts) {
    if (!part.inner) continue;
    inner(part);
    dense->up_four(&panels[part.panel], part.width(), static_cast<int>(below.size()), part.stride,
                   solved[0].data(), below.empty() ? nullptr : below[0].data());
    put_inner(part);
  }
  for (std::size_t k = 0; k < lasts.size(); ++k)
    std::copy_n(&rest[2 * k], 2, &r[2 * lasts[k]]);
}
