// This file finds how the sites of a packing answer a strain, from the terms of its energy.
//
// Positions move as x = (1 + E) X + u. With the second derivatives K_uu, K_uE and K_EE of the
// energy, sites at rest move by u = -K_uu^-1 K_uE E.

#include "condensed_matrix.h"
#include "kernel.h"
#include "vector.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <vector>

using namespace jamlab;

namespace {

constexpr int64_t STAYS = -1, ABSENT = -2;  // rows of sites that the matrix does not have

using Factors = LAMMPS_NS::BlockCholesky<2>;

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

// Calls act(sites, k) for each term k of which no site is absent.
template <class Act> void visit_terms(const TermGroup &group, const int64_t *row, Act act)
{
  for (int64_t k = 0; k < group.count; ++k) {
    const int64_t *const sites = group.sites + k * group.width;
    if (std::none_of(sites, sites + group.width, [&](int64_t i) { return row[i] == ABSENT; }))
      act(sites, k);
  }
}

class Stiffness {
 public:
  Columns couplings;                 // K_uE
  double ee[STRAINS][STRAINS] = {};  // K_EE

  // row (sites): of each site in the matrix, or STAYS, or ABSENT: terms of absent sites are left
  // out
  Stiffness(const int64_t *row, int64_t rows) : couplings(2 * rows, PerStrain{}), row(row) {}

  // take(i, j, block): for each block of K_uu, of which one of (i, j) and (j, i) is given
  template <class Take> void add(const TermGroup &group, double *forces, Take take)
  {
    const int64_t m = group.width;
    local.resize(m);
    visit_terms(group, row, [&](const int64_t *sites, int64_t k) {
      for (int64_t a = 0; a < m; ++a) {
        local[a] = point(group.local, k * m + a);
        put(forces, sites[a], point(forces, sites[a]) - point(group.gradient, k * m + a));
      }
      const double *const h = group.hessian + k * 4 * m * m;
      add_couplings(m, sites, h);
      for (int64_t a = 0; a < m; ++a)
        for (int64_t b = a; b < m; ++b) {
          const int64_t i = row[sites[a]], j = row[sites[b]];
          if (i >= 0 && j >= 0)
            take(static_cast<int>(i), static_cast<int>(j), block(m, a, b, i == j, h));
        }
    });
  }

 private:
  const int64_t *row;
  std::vector<Vector> local;

  // h: (2 m, 2 m) Hessian of a term between m sites
  void add_couplings(int64_t m, const int64_t *sites, const double *h)
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
  }

  static Factors::Block block(int64_t m, int64_t a, int64_t b, bool same, const double *h)
  {
    const double *const x = h + 4 * m * a + 2 * b, *const y = x + 2 * m;
    if (a != b && same) return {2 * x[0], x[1] + y[0], x[1] + y[0], 2 * y[1]};  // own images
    return {x[0], x[1], y[0], y[1]};
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

  void sum_column(const std::vector<Factors::Entry> &entries, const int *half, const int *end)
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

// Products of each column of one and each of the other.
std::array<PerStrain, STRAINS> products(const Columns &a, const Columns &b)
{
  std::array<PerStrain, STRAINS> sums{};
  for (std::size_t k = 0; k < a.size(); ++k)
    for (int p = 0; p < STRAINS; ++p)
      for (int q = 0; q < STRAINS; ++q) sums[p][q] += a[k][p] * b[k][q];
  return sums;
}

}  // namespace

constexpr int64_t FIRM = 0, LOOSE = 1, UNSTABLE = 2;

// Response of a packing to the four components of a strain.
//   table (groups, 6): see TermGroup; row (sites): see Stiffness; rows: of the matrix;
//   rounding: of eigenvalues over the largest element of the diagonal;
//   push (2 rows): at random; near: its response is that much stiffer without a floppy mode;
//   forces (sites, 2) out; ee, response (4, 4) out: K_EE and K_uE^T K_uu^-1 K_uE;
//   displacements (sites, 2, 4) out: 0 where a site stays or is absent.
// Returns whether the response is FIRM, LOOSE, where floppy modes may answer and nothing is written
// of it, or the matrix is UNSTABLE, with eigenvalues that are negative beyond rounding.
JAMLAB_KERNEL static_response(int64_t groups, const int64_t *table, int64_t sites,
                              const int64_t *row, int64_t rows, double rounding, double near,
                              const double *push, double *forces, double *ee, double *response,
                              double *displacements)
try {
  std::fill(forces, forces + 2 * sites, 0.0);
  std::fill(displacements, displacements + 2 * STRAINS * sites, 0.0);
  std::fill(response, response + STRAINS * STRAINS, 0.0);
  Stiffness stiffness(row, rows);
  CondensedMatrix matrix(rows);
  std::vector<int> joined;
  for (int64_t turn = 0; turn < 2 * groups; ++turn) {  // the wide ones first
    const TermGroup group(table + 6 * (turn % groups));
    if ((group.width >= CondensedMatrix::WIDE) != (turn < groups)) continue;
    joined.resize(group.width);
    visit_terms(group, row, [&](const int64_t *at, int64_t) {
      std::transform(at, at + group.width, joined.begin(), [&](int64_t i) { return row[i]; });
      matrix.join(joined);
    });
  }
  matrix.arrange();
  for (int64_t g = 0; g < groups; ++g)
    stiffness.add(TermGroup(table + 6 * g), forces,
                  [&](int i, int j, const Factors::Block &block) { matrix.add(i, j, block); });
  std::copy(stiffness.ee[0], stiffness.ee[0] + STRAINS * STRAINS, ee);
  if (!rows) return FIRM;

  const double floppy = rounding * matrix.largest_diagonal();
  if (!matrix.factorise(0.0)) return matrix.factorise(floppy) ? LOOSE : UNSTABLE;
  const Columns &right = stiffness.couplings;
  Columns x = right, left = right;
  matrix.solve(x);
  matrix.subtract_product(x, left);  // rounding leaves some, and one more solution takes it away
  matrix.solve(left);
  for (std::size_t k = 0; k < x.size(); ++k)
    for (int q = 0; q < STRAINS; ++q) x[k][q] += left[k][q];
  const auto energies = products(x, right), squares = products(x, x);
  for (int q = 0; q < STRAINS; ++q)
    if (!(energies[q][q] >= floppy * squares[q][q])) return LOOSE;
  for (int p = 0; p < STRAINS; ++p)
    std::copy(energies[p].begin(), energies[p].end(), response + STRAINS * p);
  for (int64_t i = 0; i < sites; ++i)
    for (int k = 0; k < 2 && row[i] >= 0; ++k)
      for (int q = 0; q < STRAINS; ++q)
        displacements[STRAINS * (2 * i + k) + q] = -x[2 * row[i] + k][q];

  Columns yields(2 * rows, PerStrain{});
  for (int64_t k = 0; k < 2 * rows; ++k) yields[k][0] = push[k];
  matrix.solve(yields);
  const double bound = near * floppy, pushed = std::inner_product(push, push + 2 * rows, push, 0.0);
  return pushed <= bound * bound * products(yields, yields)[0][0] ? LOOSE : FIRM;
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
  std::vector<Factors::Entry> entries;
  for (int64_t g = 0; g < groups; ++g)
    stiffness.add(TermGroup(table + 6 * g), forces.data(),
                  [&](int i, int j, const Factors::Block &b) { entries.push_back({i, j, b}); });
  std::copy(stiffness.ee[0], stiffness.ee[0] + STRAINS * STRAINS, ee);
  for (const PerStrain &coupling : stiffness.couplings)
    couplings = std::copy(coupling.begin(), coupling.end(), couplings);
  return Columnwise(rows).write(entries, first, indices, numbers);
}
JAMLAB_OR_NO_MEMORY
