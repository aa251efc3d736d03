// This file finds how the sites of a packing answer a strain, from the terms of its energy.
//
// Positions move as x = (1 + E) X + u. With the second derivatives K_uu, K_uE and K_EE of the
// energy, sites at rest move by u = -K_uu^-1 K_uE E.

#include "../block_cholesky.h"
#include "kernel.h"
#include "vector.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

using namespace jamlab;

namespace {

constexpr int STRAINS = 4;  // components E_xx, E_xy, E_yx, E_yy
constexpr int64_t STAYS = -1, ABSENT = -2;  // rows of sites that the matrix does not have

using Factors = LAMMPS_NS::BlockCholesky<2>;
using PerStrain = std::array<double, STRAINS>;
using Columns = std::vector<PerStrain>;  // of each coordinate

// Terms between the same number of sites, see jamlab.packing.terms.Terms.
struct TermGroup {
  int64_t count, width;
  const int64_t *sites;
  const double *local, *gradient, *hessian;

  // table (6): count, width, and the addresses of the arrays
  explicit TermGroup(const int64_t *table)
    : count(table[0]), width(table[1]), sites(reinterpret_cast<const int64_t *>(table[2])),
      local(reals(table[3])), gradient(reals(table[4])), hessian(reals(table[5]))
  {
  }
  static const double *reals(int64_t address) { return reinterpret_cast<const double *>(address); }
};

class Stiffness {
 public:
  std::vector<Factors::Entry> entries;  // of K_uu
  Columns couplings;                    // K_uE
  double ee[STRAINS][STRAINS] = {};     // K_EE

  // row (sites): of each site in the matrix, or STAYS, or ABSENT: terms of absent sites are left
  // out
  Stiffness(const int64_t *row, int64_t rows) : couplings(2 * rows, PerStrain{}), row(row) {}

  void add(const TermGroup &group, double *forces)
  {
    const int64_t m = group.width;
    local.resize(m);
    entries.reserve(entries.size() + group.count * m * (m + 1) / 2);
    for (int64_t k = 0; k < group.count; ++k) {
      const int64_t *const sites = group.sites + k * m;
      if (std::any_of(sites, sites + m, [&](int64_t i) { return row[i] == ABSENT; })) continue;
      for (int64_t a = 0; a < m; ++a) {
        local[a] = point(group.local, k * m + a);
        put(forces, sites[a], point(forces, sites[a]) - point(group.gradient, k * m + a));
      }
      add_term(m, sites, group.hessian + k * 4 * m * m);
    }
  }

  double largest_diagonal() const
  {
    std::vector<double> diagonal(couplings.size(), 0.0);
    for (const auto &e : entries)
      if (e.i == e.j) {
        diagonal[2 * e.i] += e.block[0];
        diagonal[2 * e.i + 1] += e.block[3];
      }
    return *std::max_element(diagonal.begin(), diagonal.end());
  }

  // Subtracts K_uu times x from r.
  void subtract_product(const Columns &x, Columns &r) const
  {
    for (const auto &e : entries) {
      const int i = 2 * e.i, j = 2 * e.j;
      const auto &b = e.block;
      subtract(b[0], b[1], x[j], x[j + 1], r[i]);
      subtract(b[2], b[3], x[j], x[j + 1], r[i + 1]);
      if (i == j) continue;
      subtract(b[0], b[2], x[i], x[i + 1], r[j]);
      subtract(b[1], b[3], x[i], x[i + 1], r[j + 1]);
    }
  }

 private:
  const int64_t *row;
  std::vector<Vector> local;

  static void subtract(double a, double b, const PerStrain &x, const PerStrain &y, PerStrain &from)
  {
    for (int q = 0; q < STRAINS; ++q) from[q] -= a * x[q] + b * y[q];
  }

  // h: (2 m, 2 m) Hessian of a term between m sites
  void add_term(int64_t m, const int64_t *sites, const double *h)
  {
    for (int64_t a = 0; a < m; ++a)
      for (int i = 0; i < 2; ++i) {
        PerStrain coupling{};
        const double *const of = h + 2 * m * (2 * a + i);
        for (int64_t b = 0; b < m; ++b)
          for (int j = 0; j < 2; ++j) {
            coupling[2 * j] += of[2 * b + j] * local[b].x;
            coupling[2 * j + 1] += of[2 * b + j] * local[b].y;
          }
        for (int q = 0; q < STRAINS; ++q) {
          ee[2 * i][q] += local[a].x * coupling[q];
          ee[2 * i + 1][q] += local[a].y * coupling[q];
          if (row[sites[a]] >= 0) couplings[2 * row[sites[a]] + i][q] += coupling[q];
        }
      }
    for (int64_t a = 0; a < m; ++a)
      for (int64_t b = a; b < m; ++b) add_block(m, a, b, row[sites[a]], row[sites[b]], h);
  }

  void add_block(int64_t m, int64_t a, int64_t b, int64_t i, int64_t j, const double *h)
  {
    if (i < 0 || j < 0) return;
    const double *const x = h + 4 * m * a + 2 * b, *const y = x + 2 * m;
    Factors::Block block{x[0], x[1], y[0], y[1]};
    if (a != b && i == j) block = {2 * x[0], x[1] + y[0], x[1] + y[0], 2 * y[1]};  // own images
    entries.push_back({static_cast<int>(i), static_cast<int>(j), block});
  }
};

// The sum of entries as a matrix by columns, with both triangles: see strain_stiffness.
class Columnwise {
 public:
  explicit Columnwise(int64_t size) : where(size, -1) {}

  int64_t write(const std::vector<Factors::Entry> &entries, int *first, int *rows, double *numbers)
  {
    const int size = static_cast<int>(where.size());
    std::vector<int> end(size + 1, 0), of_column(2 * entries.size());
    const auto each = [&](auto act) {
      for (std::size_t n = 0; n < entries.size(); ++n) {
        act(static_cast<int>(2 * n), entries[n].j);
        if (entries[n].i != entries[n].j) act(static_cast<int>(2 * n + 1), entries[n].i);
      }
    };
    each([&](int, int column) { end[column + 1]++; });
    std::partial_sum(end.begin(), end.end(), end.begin());
    std::vector<int> next(end.begin(), end.end() - 1);
    each([&](int half, int column) { of_column[next[column]++] = half; });
    int64_t count = 0;
    for (int j = 0; j < size; ++j) {
      sum_column(entries, of_column.data() + end[j], of_column.data() + end[j + 1]);
      for (int b = 0; b < 2; ++b) {
        first[2 * j + b] = static_cast<int>(count);
        for (const int i : members)
          for (int a = 0; a < 2; ++a) {
            rows[count] = 2 * i + a;
            numbers[count++] = sums[where[i]][2 * a + b];
          }
      }
      for (const int i : members) where[i] = -1;
    }
    first[2 * size] = static_cast<int>(count);
    return count;
  }

 private:
  std::vector<int> where;    // of each row in `sums`
  std::vector<int> members;  // rows of a column, sorted
  std::vector<Factors::Block> sums;

  void sum_column(const std::vector<Factors::Entry> &entries, const int *half,
                  const int *end)
  {
    members.clear();
    sums.clear();
    for (; half < end; ++half) {
      const Factors::Entry &e = entries[*half / 2];
      const bool turned = *half % 2;
      const int i = turned ? e.j : e.i;
      if (where[i] < 0) {
        where[i] = static_cast<int>(sums.size());
        members.push_back(i);
        sums.push_back({});
      }
      for (int a = 0; a < 2; ++a)
        for (int b = 0; b < 2; ++b)
          sums[where[i]][2 * a + b] += e.block[turned ? 2 * b + a : 2 * a + b];
    }
    std::sort(members.begin(), members.end());
  }
};

// Products of columns p of one and q of the other.
double product(const Columns &a, int p, const Columns &b, int q)
{
  double sum = 0.0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += a[k][p] * b[k][q];
  return sum;
}

}  // namespace

constexpr int64_t FIRM = 0, LOOSE = 1, UNSTABLE = 2;

// Response of a packing to the four components of a strain.
//   table (groups, 6): see TermGroup; row (sites): see Stiffness; rows: of the matrix; rounding: of eigenvalues over the largest element of the diagonal;
//   push (2 rows): at random; near: its response is that much stiffer without a floppy mode;
//   forces (sites, 2) out; ee, response (4, 4) out: K_EE and K_uE^T K_uu^-1 K_uE;
//   displacements (sites, 2, 4) out: 0 where a site stays or is absent.
// Returns whether the response is FIRM, LOOSE, where floppy modes may answer and nothing is written
// of it, or the matrix is UNSTABLE, with eigenvalues that are negative beyond rounding.
JAMLAB_KERNEL static_response(int64_t groups, const int64_t *table, int64_t sites,
                              const int64_t *row, int64_t rows, double rounding, double near, const double *push, double *forces,
                              double *ee, double *response, double *displacements)
try {
  std::fill(forces, forces + 2 * sites, 0.0);
  std::fill(displacements, displacements + 2 * STRAINS * sites, 0.0);
  std::fill(response, response + STRAINS * STRAINS, 0.0);
  Stiffness stiffness(row, rows);
  for (int64_t g = 0; g < groups; ++g) stiffness.add(TermGroup(table + 6 * g), forces);
  std::copy(stiffness.ee[0], stiffness.ee[0] + STRAINS * STRAINS, ee);
  if (!rows) return FIRM;

  const double floppy = rounding * stiffness.largest_diagonal();
  Factors factors;
  factors.set_pattern(static_cast<int>(rows), stiffness.entries);
  factors.set(stiffness.entries);
  if (!factors.factorise(0.0)) {
    factors.set(stiffness.entries);
    return factors.factorise(floppy) ? LOOSE : UNSTABLE;
  }
  const Columns &right = stiffness.couplings;
  Columns x = right, left = right;
  factors.solve(x[0].data(), STRAINS);
  stiffness.subtract_product(x, left);  // rounding leaves some, and one more solution takes it away
  factors.solve(left[0].data(), STRAINS);
  for (std::size_t k = 0; k < x.size(); ++k)
    for (int q = 0; q < STRAINS; ++q) x[k][q] += left[k][q];
  for (int q = 0; q < STRAINS; ++q)
    if (!(product(x, q, right, q) >= floppy * product(x, q, x, q))) return LOOSE;
  for (int p = 0; p < STRAINS; ++p)
    for (int q = 0; q < STRAINS; ++q) response[STRAINS * p + q] = product(x, p, right, q);
  for (int64_t i = 0; i < sites; ++i)
    for (int k = 0; k < 2 && row[i] >= 0; ++k)
      for (int q = 0; q < STRAINS; ++q)
        displacements[STRAINS * (2 * i + k) + q] = -x[2 * row[i] + k][q];

  std::vector<double> yields(push, push + 2 * rows);
  factors.solve(yields);
  const auto square = [&](const double *v) { return std::inner_product(v, v + 2 * rows, v, 0.0); };
  const double bound = near * floppy;
  return square(push) <= bound * bound * square(yields.data()) ? LOOSE : FIRM;
}
JAMLAB_OR_NO_MEMORY

// Second derivatives of the energy, of which the response follows.
//   table, row, rows: see static_response; couplings (2 rows, 4) out: K_uE; ee (4, 4) out: K_EE;
//   first (2 rows + 1), indices, numbers out: K_uu by columns, with room for four numbers of each
//   two sites of a term.
// Returns how many numbers there are.
JAMLAB_KERNEL strain_stiffness(int64_t groups, const int64_t *table, int64_t sites,
                               const int64_t *row, int64_t rows, double *couplings, double *ee,
                               int *first, int *indices, double *numbers)
try {
  std::vector<double> forces(2 * sites, 0.0);
  Stiffness stiffness(row, rows);
  for (int64_t g = 0; g < groups; ++g) stiffness.add(TermGroup(table + 6 * g), forces.data());
  std::copy(stiffness.ee[0], stiffness.ee[0] + STRAINS * STRAINS, ee);
  for (std::size_t k = 0; k < stiffness.couplings.size(); ++k)
    std::copy(stiffness.couplings[k].begin(), stiffness.couplings[k].end(), couplings + STRAINS * k);
  return Columnwise(rows).write(stiffness.entries, first, indices, numbers);
}
JAMLAB_OR_NO_MEMORY
