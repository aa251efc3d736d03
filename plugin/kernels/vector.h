// Vectors of the plane are read from and written to arrays (n, 2).
#pragma once

#include <cmath>
#include <cstdint>

namespace jamlab {

struct Vector {
  double x, y;
  Vector operator+(const Vector &other) const { return {x + other.x, y + other.y}; }
  Vector operator-(const Vector &other) const { return {x - other.x, y - other.y}; }
  Vector operator*(double factor) const { return {factor * x, factor * y}; }
  Vector &operator+=(const Vector &other) { return *this = *this + other; }
  Vector &operator-=(const Vector &other) { return *this = *this - other; }
};

inline double dot(const Vector &a, const Vector &b) { return a.x * b.x + a.y * b.y; }
inline double cross(const Vector &a, const Vector &b) { return a.x * b.y - a.y * b.x; }
inline double size(const Vector &a) { return std::sqrt(dot(a, a)); }  // for 1e-100 to 1e100

// Returns whether edges a-b and c-d pass through each other; touching ends do not count.
inline bool edges_cross(const Vector &a, const Vector &b, const Vector &c, const Vector &d)
{
  return cross(b - a, c - a) * cross(b - a, d - a) < 0 &&
         cross(d - c, a - c) * cross(d - c, b - c) < 0;
}

inline Vector point(const double *points, int64_t i) { return {points[2 * i], points[2 * i + 1]}; }

inline void put(double *points, int64_t i, const Vector &p)
{
  points[2 * i] = p.x;
  points[2 * i + 1] = p.y;
}

}  // namespace jamlab
