// Loops of boundary pieces on a torus: chained, and what they enclose; sums over the voids that they bound.

#include "kernel.h"
#include "periodic_image.h"
#include "vector.h"

#include <algorithm>
#include <vector>

using namespace jamlab;

namespace {

Image image_at(const int64_t *images, int64_t i) { return {images[2 * i], images[2 * i + 1]}; }

void put_image(int64_t *images, int64_t i, const Image &image)
{
  images[2 * i] = image.first;
  images[2 * i + 1] = image.second;
}

Vector translation(const Image &image, const double *box)
{
  const double a = static_cast<double>(image.first), b = static_cast<double>(image.second);
  return {a * box[0] + b * box[2], a * box[1] + b * box[3]};
}

// Area between a circular piece and its chord, R^2 (angle - sin(angle))/2; 0 for a straight piece.
double bulge(double radius, double angle) { return 0.5 * radius * radius * (angle - std::sin(angle)); }

struct Corner {
  int64_t particle;
  Image image;
  bool operator<(const Corner &other) const
  {
    return particle != other.particle ? particle < other.particle : image < other.image;
  }
  bool operator==(const Corner &other) const { return particle == other.particle && image == other.image; }
};

}  // namespace

// Chain pieces into loops, numbered by their first pieces.
//   following (k), a permutation; shift (k, 2): image of the piece that follows; loop (k), image (k, 2), winding (k,
//   2), origin (k) out: see Boundary, of which the first rows of the last two are written, one for each loop.
// Returns the number of loops, or -1 if `following` is no permutation.
JAMLAB_KERNEL chain_loops(int64_t k, const int64_t *following, const int64_t *shift, int64_t *loop, int64_t *image,
                          int64_t *winding, int64_t *origin)
try {
  std::fill(loop, loop + k, -1);
  int64_t loops = 0;
  for (int64_t first = 0; first < k; ++first) {
    if (loop[first] >= 0) continue;
    Image at = {0, 0};
    int64_t piece = first;
    do {
      if (piece < 0 || piece >= k || loop[piece] >= 0) return -1;
      loop[piece] = loops;
      put_image(image, piece, at);
      at = at + image_at(shift, piece);
      piece = following[piece];
    } while (piece != first);
    origin[loops] = first;
    put_image(winding, loops++, at);
  }
  return loops;
}
JAMLAB_OR_NO_MEMORY

// Area to the right of each loop by Green's theorem; of a loop that winds around the torus, up to multiples of the
// cell.
//   start, end (k, 2), radius, angle (k), loop (k), image (k, 2): pieces in line with the first of their loop;
//   winding (loops, 2), origin (loops); box (2, 2); area (loops) out.
JAMLAB_KERNEL loop_areas(int64_t k, int64_t loops, const double *start, const double *end, const double *radius,
                         const double *angle, const int64_t *loop, const int64_t *image, const int64_t *winding,
                         const int64_t *origin, const double *box, double *area)
try {
  std::vector<Vector> reference(loops);
  for (int64_t l = 0; l < loops; ++l) {
    const Vector first = point(start, origin[l]) + translation(image_at(image, origin[l]), box);
    area[l] = 0.5 * cross(translation(image_at(winding, l), box), first);
    // loops that close are measured from their own beginning, which keeps the digits of small ones
    reference[l] = image_at(winding, l).home() ? first : Vector{0.0, 0.0};
  }
  for (int64_t piece = 0; piece < k; ++piece) {
    const int64_t l = loop[piece];
    const Vector move = translation(image_at(image, piece), box) - reference[l];
    area[l] -= 0.5 * cross(point(start, piece) + move, point(end, piece) + move);
    if (radius[piece] > 0) area[l] -= bulge(radius[piece], angle[piece]);
  }
  return loops;
}
JAMLAB_OR_NO_MEMORY

// Sums over the pieces that bound each void.
//   owner (k), start, end, centre (k, 2), radius, angle (k), loop (k), image (k, 2): pieces of the boundary;
//   void_of_loop (loops), -1 for none; loop_image (loops, 2); counts (loops): whether pieces of a loop may be sides;
//   apart (voids): whether two images of a particle are two sides; shortest: a shorter piece is no side; box (2, 2);
//   void (k), place (k, 2): void of each piece and its image; perimeter, sides (voids), reference, moment (voids, 2)
//   out: integral of x over the void, x counted from the reference.
JAMLAB_KERNEL sum_voids(int64_t k, int64_t voids, const int64_t *owner, const double *start, const double *end,
                        const double *centre, const double *radius, const double *angle, const int64_t *loop,
                        const int64_t *image, const int64_t *void_of_loop, const int64_t *loop_image,
                        const bool *counts, const bool *apart, double shortest, const double *box, int64_t *own_void,
                        int64_t *place, double *perimeter, int64_t *sides, double *reference, double *moment)
try {
  std::vector<int64_t> first(voids + 1, 0);
  for (int64_t piece = 0; piece < k; ++piece) {
    own_void[piece] = void_of_loop[loop[piece]];
    put_image(place, piece, image_at(image, piece) + image_at(loop_image, loop[piece]));
    if (own_void[piece] >= 0) ++first[own_void[piece] + 1];
  }
  for (int64_t v = 0; v < voids; ++v) first[v + 1] += first[v];
  std::vector<int64_t> next(first.begin(), first.end() - 1), pieces(first[voids]);
  for (int64_t piece = 0; piece < k; ++piece)
    if (own_void[piece] >= 0) pieces[next[own_void[piece]]++] = piece;

  std::vector<Corner> corners;
  for (int64_t v = 0; v < voids; ++v) {
    corners.clear();
    Vector sum = {0.0, 0.0}, from = {0.0, 0.0};
    perimeter[v] = 0.0;
    for (int64_t n = first[v]; n < first[v + 1]; ++n) {
      const int64_t piece = pieces[n];
      const Image at = image_at(place, piece);
      const Vector shift = translation(at, box), chord = point(end, piece) - point(start, piece);
      if (n == first[v]) from = point(start, piece) + shift;
      const Vector move = shift - from, p = point(start, piece) + move, q = point(end, piece) + move;
      sum = sum - (p + q) * (cross(p, q) / 6);
      double length = size(chord);
      if (radius[piece] > 0) {
        length = radius[piece] * angle[piece];
        // of the area between arc and chord: (2/3) R^3 sin(angle/2)^3 towards the middle of the arc
        sum = sum - (point(centre, piece) + move) * bulge(radius[piece], angle[piece]) -
              Vector{chord.y, -chord.x} * (dot(chord, chord) / 12);
      }
      perimeter[v] += length;
      if (length > shortest && counts[loop[piece]]) corners.push_back({owner[piece], apart[v] ? at : Image{0, 0}});
    }
    std::sort(corners.begin(), corners.end());
    sides[v] = std::unique(corners.begin(), corners.end()) - corners.begin();
    put(reference, v, from);
    put(moment, v, sum);
  }
  return voids;
}
JAMLAB_OR_NO_MEMORY
