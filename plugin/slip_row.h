// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include <array>
#include <vector>

namespace LAMMPS_NS {

struct Vec3 {    // velocity of a disk or a vertex beside the affine flow, or force and torque on it
  double x = 0.0, y = 0.0, spin = 0.0;

  Vec3 operator+(const Vec3 &o) const { return {x + o.x, y + o.y, spin + o.spin}; }
  Vec3 operator-(const Vec3 &o) const { return {x - o.x, y - o.y, spin - o.spin}; }
};
inline Vec3 operator*(double factor, const Vec3 &v) { return {factor * v.x, factor * v.y, factor * v.spin}; }
inline Vec3 with_lean(const Vec3 &v, double strain) { return {v.x + strain * v.y, v.y, v.spin}; }

using Field = std::vector<Vec3>;    // of owned atoms, then of ghosts

// of the first n atoms, as plain numbers, on which compilers know how to work side by side
inline void field_add(Field &to, double factor, const Field &from, int n)
{
  double *const __restrict t = reinterpret_cast<double *>(to.data());
  const double *const __restrict f = reinterpret_cast<const double *>(from.data());
  for (int k = 0; k < 3 * n; k++) t[k] += factor * f[k];
}

double field_dot(const Field &a, const Field &b, int n);    // of the first n atoms

/* The slip at a contact is linear in the velocities u of its sites, which move with coefficients c and
   turn with arms r about them:

     approach = n . sum c u,   slide = t . sum c u - sum r spin,   t = (-n_y, n_x)

   so a row of J in the drag matrix B = J^T W J + background, where W holds a weight for each. */
struct DiskRow {    // disk j past disk i, n from i to j; 40 bytes: products stream through all rows
  static constexpr int SITES = 2, D = 3;    // D: degrees of freedom of a disk
  int i, j;
  double nx, ny, arm_i, arm_j;

  int site(int a) const { return a ? j : i; }
  double coefficient(int a) const { return a ? 1.0 : -1.0; }
  double arm(int a) const { return a ? arm_j : arm_i; }
};

struct DropletRow {    // a vertex past the point (1 - t) tail + t head of an edge, n towards the vertex
  static constexpr int SITES = 3, D = 2;    // the spin of an outline follows from its vertices
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

// x, y of sum c u, with an affine flow: rate times n_y times the distance of the two; sum r spin
template <class Row> inline Vec3 passing(const Row &row, const Vec3 *u, double affine)
{
  Vec3 sum = {affine, 0.0, 0.0};
  for (int a = 0; a < Row::SITES; a++) {
    const Vec3 &v = u[row.site(a)];
    sum.x += row.coefficient(a) * v.x;
    sum.y += row.coefficient(a) * v.y;
    sum.spin += row.arm(a) * v.spin;
  }
  return sum;
}

template <class Row> inline Slip slip_of(const Row &row, const Vec3 &v)
{
  return {v.x * row.nx + v.y * row.ny, v.y * row.nx - v.x * row.ny - v.spin};
}

// of forces against approach and slide; spin: that against the slide, to be multiplied by arms
template <class Row> inline Vec3 force_of(const Row &row, double push, double rub)
{
  return {push * row.nx - rub * row.ny, push * row.ny + rub * row.nx, rub};
}

// J^T of them
template <class Row> inline void add_forces(const Row &row, const Vec3 &force, Vec3 *out)
{
  for (int a = 0; a < Row::SITES; a++) {
    Vec3 &f = out[row.site(a)];
    f.x += row.coefficient(a) * force.x;
    f.y += row.coefficient(a) * force.y;
    f.spin -= row.arm(a) * force.spin;
  }
}

}    // namespace LAMMPS_NS
