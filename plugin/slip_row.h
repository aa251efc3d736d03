// SPDX-License-Identifier: GPL-2.0-or-later

#pragma once

#include <array>
#include <numeric>
#include <vector>

namespace LAMMPS_NS {

struct Vec3 {    // velocity of a disk or a vertex beside the affine flow, or a force on it and a torque
  double x = 0.0, y = 0.0, spin = 0.0;

  Vec3 operator+(const Vec3 &o) const { return {x + o.x, y + o.y, spin + o.spin}; }
  Vec3 operator-(const Vec3 &o) const { return {x - o.x, y - o.y, spin - o.spin}; }
};
inline Vec3 operator*(double factor, const Vec3 &v) { return {factor * v.x, factor * v.y, factor * v.spin}; }
inline Vec3 with_lean(const Vec3 &v, double strain) { return {v.x + strain * v.y, v.y, v.spin}; }    // with the box

using Field = std::vector<Vec3>;    // of owned atoms, then of ghosts

// of the first n atoms, as plain numbers, on which compilers know how to work side by side
inline void field_add(Field &to, double factor, const Field &from, int n)
{
  double *const __restrict t = reinterpret_cast<double *>(to.data());
  const double *const __restrict f = reinterpret_cast<const double *>(from.data());
  for (int k = 0; k < 3 * n; k++) t[k] += factor * f[k];
}

// eight sums side by side, since each addition waits for the one before
inline double field_dot(const Field &a, const Field &b, int n)
{
  constexpr int SUMS = 8;
  const double *const p = reinterpret_cast<const double *>(a.data());
  const double *const q = reinterpret_cast<const double *>(b.data());
  double sums[SUMS] = {};
  int k = 0;
  for (; k + SUMS <= 3 * n; k += SUMS)
    for (int m = 0; m < SUMS; m++) sums[m] += p[k + m] * q[k + m];
  for (; k < 3 * n; k++) sums[0] += p[k] * q[k];
  return std::accumulate(sums, sums + SUMS, 0.0);
}

/* The slip at a contact is linear in the velocities u of its sites, which move with coefficients c and turn
   with arms r about them:

     approach = n . sum c u,   slide = t . sum c u - sum r spin,   t = (-n_y, n_x)

   so a row of J in the drag matrix B = J^T W J + background, where W holds a weight for each of both. */
struct DiskRow {    // disk j past disk i, n from i to j; 40 bytes, since every product streams through all rows
  static constexpr int SITES = 2, D = 3;    // D: degrees of freedom of a disk
  int i, j;
  double nx, ny, arm_i, arm_j;

  int site(int a) const { return a ? j : i; }
  double coefficient(int a) const { return a ? 1.0 : -1.0; }
  double arm(int a) const { return a ? arm_j : arm_i; }
};

struct DropletRow {    // a vertex past the point (1 - t) tail + t head of an edge, n from there to the vertex
  static constexpr int SITES = 3, D = 2;    // a vertex does not rotate; the spin of its outline follows from the others
  int vertex, tail, head;
  double t, nx, ny, half_distance;

  int site(int a) const { return a == 0 ? vertex : a == 1 ? tail : head; }
  double coefficient(int a) const { return a == 0 ? 1.0 : a == 1 ? t - 1.0 : -t; }
  double arm(int a) const { return half_distance * (a == 0 ? 1.0 : a == 1 ? 1.0 - t : t); }
};

/* What approach and slide depend on at one site: as a part of the row, by degrees of freedom. */
template <int D> struct RowPart {
  int site;
  std::array<double, D> approach, slide;
};

struct Slip {
  double approach, slide;
};

// u with the affine flow of a rate: lever = n_y times the distance of the two
template <class Row> inline Slip slip_of(const Row &row, const Vec3 *u, double affine)
{
  double x = affine, y = 0.0, turn = 0.0;
  for (int a = 0; a < Row::SITES; a++) {
    const Vec3 &v = u[row.site(a)];
    x += row.coefficient(a) * v.x;
    y += row.coefficient(a) * v.y;
    turn += row.arm(a) * v.spin;
  }
  return {x * row.nx + y * row.ny, y * row.nx - x * row.ny - turn};
}

// J^T of forces against both, at one site
template <class Row> inline void add_force(const Row &row, int a, double push, double rub, Vec3 &f)
{
  f.x += row.coefficient(a) * (push * row.nx - rub * row.ny);
  f.y += row.coefficient(a) * (push * row.ny + rub * row.nx);
  f.spin -= row.arm(a) * rub;
}

template <class Row> inline void add_forces(const Row &row, double push, double rub, Vec3 *out)
{
  for (int a = 0; a < Row::SITES; a++) add_force(row, a, push, rub, out[row.site(a)]);
}

}    // namespace LAMMPS_NS
