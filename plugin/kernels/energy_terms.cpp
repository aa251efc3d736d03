// This file finds derivatives of small terms of the energy, as jamlab.packing.terms.Terms holds
// them.

#include "kernel.h"
#include "vector.h"

#include <vector>

using namespace jamlab;

namespace {

// A force along the vector r from one site to another, or along another normal.
struct Central {
  Vector r, normal;
  double slope, along, across;  // dU/dr, and stiffness
};

void put_central(const Central &term, double *local, double *gradient, double *hessian)
{
  const double n[2] = {term.normal.x, term.normal.y};
  put(local, 0, {0.0, 0.0});
  put(local, 1, term.r);
  for (int i = 0; i < 2; ++i) {
    const double force = term.slope * n[i];
    gradient[i] = -force;
    gradient[2 + i] = force;
    for (int j = 0; j < 2; ++j) {
      const double projected = n[i] * n[j];
      const double block = term.along * projected + term.across * ((i == j) - projected);
      double *const h = hessian + 4 * i + j;  // of both sites
      h[0] = h[10] = block;
      h[2] = h[8] = -block;
    }
  }
}

}  // namespace

// Forces along vectors from one site to another.
//   r, normal (terms, 2); slope (terms): dU/dr along the normal; along, across (terms): stiffness;
//   local, gradient (terms, 2, 2), hessian (terms, 2, 2, 2, 2) out. Returns 0.
JAMLAB_KERNEL central_terms(int64_t terms, const double *r, const double *normal,
                            const double *slope, const double *along, const double *across,
                            double *local, double *gradient, double *hessian)
try {
  for (int64_t k = 0; k < terms; ++k)
    put_central({point(r, k), point(normal, k), slope[k], along[k], across[k]}, local + 4 * k,
                gradient + 4 * k, hessian + 16 * k);
  return 0;
}
JAMLAB_OR_NO_MEMORY

// The energy gamma sqrt(l^2 + eta^2) of edges of length l.
//   edge (terms, 2): head less tail;
//   energy (terms), local, gradient (terms, 2, 2), hessian (terms, 2, 2, 2, 2) out. Returns 0.
JAMLAB_KERNEL tension_terms(int64_t terms, const double *edge, double gamma, double eta,
                            double *energy, double *local, double *gradient, double *hessian)
try {
  for (int64_t k = 0; k < terms; ++k) {
    const Vector e = point(edge, k);
    const double length = std::sqrt(dot(e, e) + eta * eta);
    const double inverse = length > 0 ? 1.0 / length : 0.0;
    energy[k] = gamma * length;
    put_central({e, e * inverse, gamma, 0.0, gamma * inverse}, local + 4 * k, gradient + 4 * k,
                hessian + 16 * k);
  }
  return 0;
}
JAMLAB_OR_NO_MEMORY

// A vertex and the inner part of an edge, at the vector r = (x_vertex - foot) of length d from each
// other. The foot is (1 - t) tail + t head. With the unit normal n = r/d, the unit tangent tau, the
// edge length L and weights c = (1, t - 1, -t), w = (0, -1, 1) on vertex, tail and head, the
// derivatives of d are c n and -(1/L) [w n (c tau)^T + c tau (w n)^T + (d/L) w n (w n)^T].
//   place (terms): t; separation, edge (terms, 2): r, and head less tail;
//   slope, stiffness (terms): dU/dd, d2U/dd2;
//   local, gradient (terms, 3, 2), hessian (terms, 3, 2, 3, 2) out. Returns 0.
JAMLAB_KERNEL edge_contact_terms(int64_t terms, const double *place, const double *separation,
                                 const double *edge, const double *slope, const double *stiffness,
                                 double *local, double *gradient, double *hessian)
try {
  for (int64_t k = 0; k < terms; ++k) {
    const Vector r = point(separation, k), along = point(edge, k);
    const double d = std::hypot(r.x, r.y), length = std::hypot(along.x, along.y), t = place[k];
    const double n[2] = {r.x / d, r.y / d}, tau[2] = {along.x / length, along.y / length};
    const double c[3] = {1.0, t - 1.0, -t}, w[3] = {0.0, -1.0, 1.0};
    const double per_length = slope[k] / length;
    const Vector tail = (r + along * t) * -1.0;
    put(local, 3 * k, {0.0, 0.0});
    put(local, 3 * k + 1, tail);
    put(local, 3 * k + 2, tail + along);
    double cn[6], ct[6], wn[6];
    for (int a = 0; a < 6; ++a) {
      cn[a] = c[a / 2] * n[a % 2];
      ct[a] = c[a / 2] * tau[a % 2];
      wn[a] = w[a / 2] * n[a % 2];
      gradient[6 * k + a] = slope[k] * cn[a];
    }
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b < 6; ++b) {
        const double bend = wn[a] * ct[b] + ct[a] * wn[b] + d / length * wn[a] * wn[b];
        hessian[36 * k + 6 * a + b] = stiffness[k] * cn[a] * cn[b] - per_length * bend;
      }
  }
  return 0;
}
JAMLAB_OR_NO_MEMORY

// The energy (ka/2) (a - a0)^2 of polygons of equal numbers of vertices.
//   x: positions; first (terms): vertex of each polygon; excess (terms): a - a0;
//   local, gradient (terms, vertices, 2), hessian (terms, vertices, 2, vertices, 2) out. Returns 0.
JAMLAB_KERNEL area_terms(int64_t terms, int64_t vertices, const double *x, const int64_t *first,
                         double ka, const double *excess, double *local, double *gradient,
                         double *hessian)
try {
  const int64_t size = 2 * vertices;
  std::vector<double> slope(size);  // of the area
  for (int64_t k = 0; k < terms; ++k) {
    double *const places = local + size * k, *const matrix = hessian + size * size * k;
    const auto around = [&](int64_t v) { return (v + vertices) % vertices; };
    for (int64_t v = 0; v < vertices; ++v)
      put(places, v, point(x, first[k] + v) - point(x, first[k]));
    for (int64_t v = 0; v < vertices; ++v) {
      const Vector across = point(places, around(v + 1)) - point(places, around(v - 1));
      put(slope.data(), v, {0.5 * across.y, -0.5 * across.x});
    }
    const double push = ka * excess[k], half = 0.5 * push;
    for (int64_t a = 0; a < size; ++a) {
      gradient[size * k + a] = push * slope[a];
      const double own = ka * slope[a];
      for (int64_t b = 0; b < size; ++b) matrix[size * a + b] = own * slope[b];
    }
    for (int64_t v = 0; v < vertices; ++v) {  // the area is bilinear in neighboring vertices
      const int64_t i = 2 * v, after = 2 * around(v + 1), before = 2 * around(v - 1);
      matrix[size * i + after + 1] += half;
      matrix[size * (i + 1) + after] -= half;
      matrix[size * i + before + 1] -= half;
      matrix[size * (i + 1) + before] += half;
    }
  }
  return 0;
}
JAMLAB_OR_NO_MEMORY
