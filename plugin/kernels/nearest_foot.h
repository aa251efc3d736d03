// The foot of a point on an edge is the point of the edge that is closest to it.
#pragma once

#include "vector.h"

namespace jamlab {

// Clamps t to [0, 1]. GCC makes branches of it, which cost little where contacts last.
inline double clamped(double t)
{
  const double positive = t > 0.0 ? t : 0.0;
  return positive < 1.0 ? positive : 1.0;
}

struct Foot {
  Vector r;    // from the foot to the point
  double rsq;  // the square of r
  double t;    // place of the foot, from 0 at the tail to 1 at the head
};

// from_tail: the point; along: the edge; t: place on the line of the edge.
inline Foot foot_at(const Vector &from_tail, const Vector &along, double t)
{
  const double place = clamped(t);
  const Vector r = from_tail - along * place;
  return {r, dot(r, r), place};
}

// An edge of length 0 is a point.
inline Foot foot_on_edge(const Vector &from_tail, const Vector &along)
{
  const double lsq = dot(along, along);
  return foot_at(from_tail, along, lsq > 0.0 ? dot(from_tail, along) / lsq : 0.0);
}

}  // namespace jamlab
