// This file chains pieces of a boundary into loops on the torus, and sums over the pieces of voids.

#include "kernel.h"
#include "periodic_grid.h"

using namespace jamlab;

namespace {

Image image_at(const int64_t *images, int64_t k) { return {images[2 * k], images[2 * k + 1]}; }

void put_image(int64_t *images, int64_t k, const Image &image)
{
  images[2 * k] = image.first;
  images[2 * k + 1] = image.second;
}

// A particle on the boundary of a void, in some image.
struct Corner {
  int64_t of, particle;
  Image image;
  bool operator<(const Corner &other) const
  {
    if (of != other.of) return of < other.of;
    return particle != other.particle ? particle < other.particle : image < other.image;
  }
  bool operator==(const Corner &other) const
  {
    return of == other.of && particle == other.particle && image == other.image;
  }
};

}  // namespace

constexpr int64_t NO_CHAIN = -3;  // a piece follows none, or several

// Chains k pieces into loops.
//   following (k), shift (k, 2): the next piece, and which image of it;
//   loop (k), image (k, 2), winding (k, 2), origin (k) out: see Boundary; the last two by loops.
// Returns the number of loops.
JAMLAB_KERNEL chain_loops(int64_t k, const int64_t *following, const int64_t *shift, int64_t *loop,
                          int64_t *image, int64_t *winding, int64_t *origin)
try {
  std::fill(loop, loop + k, -1);
  int64_t loops = 0;
  for (int64_t first = 0; first < k; ++first) {
    if (loop[first] >= 0) continue;
    Image so_far{0, 0};
    int64_t piece = first;
    do {
      if (piece < 0 || piece >= k || loop[piece] >= 0) return NO_CHAIN;
      loop[piece] = loops;
      put_image(image, piece, so_far);
      so_far = so_far + image_at(shift, piece);
      piece = following[piece];
    } while (piece != first);
    put_image(winding, loops, so_far);
    origin[loops++] = first;
  }
  return loops;
}
JAMLAB_OR_NO_MEMORY

// Sums over the k pieces that bound m voids.
//   particle, radius, angle (k), start, end, centre (k, 2): see Pieces;
//   of (k): void that each piece bounds, or -1; place (k, 2): image of it in line with the void;
//   counts (k): 1 where a piece is of a side of its void, 2 where images of a particle count once;
//   sliver: length up to which a piece is no side; box (2, 2);
//   perimeter, sides (m) out; reference (m, 2) out: where the first piece of each void begins;
//   moment (m, 2) out: of its area about that point.
JAMLAB_KERNEL void_sums(int64_t k, const int64_t *particle, const double *start, const double *end,
                        const double *centre, const double *radius, const double *angle,
                        const int64_t *of, const int64_t *place, const int64_t *counts,
                        double sliver, const double *box, int64_t m, double *perimeter,
                        int64_t *sides, double *reference, double *moment)
try {
  std::fill(perimeter, perimeter + m, 0.0);
  std::fill(sides, sides + m, 0);
  std::fill(moment, moment + 2 * m, 0.0);
  std::vector<char> begun(m, 0);
  std::vector<Corner> corners;
  for (int64_t piece = 0; piece < k; ++piece) {
    const int64_t own = of[piece];
    if (own < 0) continue;
    const Image image = image_at(place, piece);
    const Vector shift = point(box, 0) * static_cast<double>(image.first) +
                         point(box, 1) * static_cast<double>(image.second);
    if (!begun[own]) put(reference, own, point(start, piece) + shift);
    begun[own] = 1;
    const Vector move = shift - point(reference, own), p = point(start, piece) + move;
    const Vector q = point(end, piece) + move, chord = q - p;
    Vector part = (p + q) * (cross(p, q) / 6);
    double length = size(chord);
    if (radius[piece] > 0) {
      // between an arc and its chord: (2/3) R^3 sin(angle/2)^3 towards the middle of the arc
      const double w = radius[piece], turned = angle[piece];
      part += (point(centre, piece) + move) * (0.5 * w * w * (turned - std::sin(turned)));
      part += Vector{chord.y, -chord.x} * (dot(chord, chord) / 12);
      length = w * turned;
    }
    perimeter[own] += length;
    moment[2 * own] -= part.x;
    moment[2 * own + 1] -= part.y;
    if (counts[piece] && length > sliver)
      corners.push_back({own, particle[piece], counts[piece] == 2 ? Image{0, 0} : image});
  }
  std::sort(corners.begin(), corners.end());
  for (std::size_t c = 0; c < corners.size(); ++c)
    if (!c || !(corners[c] == corners[c - 1])) ++sides[corners[c].of];
  return 0;
}
JAMLAB_OR_NO_MEMORY
