// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "kernels/vector.h"

#include <array>
#include <vector>

namespace LAMMPS_NS {

/* The velocity of a disk or a vertex beside the affine flow, or the force and the torque on it. */
struct Vec3 {
  double x = 0.0, y = 0.0, spin = 0.0;

  jamlab::Vector xy() const { return {x, y}; }
  Vec3 operator+(const Vec3 &o) const { return {x + o.x, y + o.y, spin + o.spin}; }
  Vec3 operator-(const Vec3 &o) const { return {x - o.x, y - o.y, spin - o.spin}; }
  Vec3 &operator+=(const Vec3 &o) { return *this = *this + o; }
};
inline Vec3 operator*(double c, const Vec3 &v) { return {c * v.x, c * v.y, c * v.spin}; }
inline Vec3 with_lean(const Vec3 &v, double strain) { return {v.x + strain * v.y, v.y, v.spin}; }

using Field = std::vector<Vec3>;    // of owned atoms, then of ghosts

// two numbers side by side, such as x and y, on which processors work at once
using Double2 = double __attribute__((vector_size(16), aligned(8), may_alias));
inline Double2 &double2(double &first) { return reinterpret_cast<Double2 &>(first); }
inline Double2 double2(const double &first) { return reinterpret_cast<const Double2 &>(first); }

struct WideVec3 {    // as a row holds it while it works
  Double2 xy;
  double spin;
};

// as plain numbers, which compilers vectorise
inline double *numbers(Field &field) { return reinterpret_cast<double *>(field.data()); }
inline const double *numbers(const Field &field) { return numbers(const_cast<Field &>(field)); }

// over the first n atoms, as field_dot
inline void field_add(Field &to, double factor, const Field &from, int n)
{
  double *const __restrict t = numbers(to);
  const double *const __restrict f = numbers(from);
  for (int k = 0; k < 3 * n; k++) t[k] += factor * f[k];
}

double field_dot(const Field &a, const Field &b, int n);

/* A row of J in the drag matrix B = J^T W J + background, where W holds a weight of each contact.
   The slip at a contact is linear in the velocities u of its sites, which count with coefficients c
   and turn with arms r:

     approach = n . sum c u,   slide = t . sum c u - sum r spin,   t = (-n_y, n_x)

   The row of two disks: j moves past i, and n points from i to j. Products stream through all rows,
   which therefore have 40 bytes. */
struct DiskRow {
  static constexpr int SITES = 2, D = 3;    // D counts the degrees of freedom of a disk.
  int i, j;
  double nx, ny, arm_i, arm_j;

  int site(int a) const { return a ? j : i; }
  double coefficient(int a) const { return a ? 1.0 : -1.0; }
  double arm(int a) const { return a ? arm_j : arm_i; }
};

/* The row of two droplets: a vertex moves past the point (1 - t) tail + t head of an edge, and n
   points to the vertex. The spin of an outline follows from its vertices. */
struct DropletRow {
  static constexpr int SITES = 3, D = 2;
  int vertex, tail, head;
  double t, nx, ny, half_distance;

  int site(int a) const { return a == 0 ? vertex : a == 1 ? tail : head; }
  double coefficient(int a) const { return a == 0 ? 1.0 : a == 1 ? t - 1.0 : -t; }
  double arm(int a) const { return half_distance * (a == 0 ? 1.0 : a == 1 ? 1.0 - t : t); }
};

/* The part of a row that belongs to one site, by the degrees of freedom of this site. */
template <int D> struct RowPart {
  int site;
  std::array<double, D> approach, slide;
};

struct Slip {
  double approach, slide;
};

// sum c u and sum r spin; affine: what the affine flow adds, the rate times n_y times the distance
template <class Row> WideVec3 relative_velocity(const Row &row, const Vec3 *u, double affine)
{
  WideVec3 sum = {{affine, 0.0}, 0.0};
  for (int a = 0; a < Row::SITES; a++) {
    const Vec3 &v = u[row.site(a)];
    sum.xy += row.coefficient(a) * double2(v.x);
    sum.spin += row.arm(a) * v.spin;
  }
  return sum;
}

template <class Row> inline Slip slip_of(const Row &row, const WideVec3 &v)
{
  return {v.xy[0] * row.nx + v.xy[1] * row.ny, v.xy[1] * row.nx - v.xy[0] * row.ny - v.spin};
}

// The force of a push against the approach and of a rub against the slide, whose arms turn disks
template <class Row> inline WideVec3 force_of(const Row &row, double push, double rub)
{
  const Double2 xy = {push * row.nx - rub * row.ny, push * row.ny + rub * row.nx};
  return {xy, rub};
}

// out += J^T force
template <class Row> inline void add_forces(const Row &row, const WideVec3 &force, Vec3 *out)
{
  for (int a = 0; a < Row::SITES; a++) {
    Vec3 &f = out[row.site(a)];
    double2(f.x) += row.coefficient(a) * force.xy;
    f.spin -= row.arm(a) * force.spin;
  }
}

}    // namespace LAMMPS_NS
