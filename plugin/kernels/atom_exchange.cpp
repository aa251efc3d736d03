// Copy positions and forces between arrays in the order of the ids and LAMMPS' own arrays, whose order changes whenever
// LAMMPS sorts its atoms. A lattice vector for every image flag keeps positions unwrapped. Each function returns n, or
// -1 where the ids are not 1 to n; `_wide` ones are for ids and image flags of 64 bits (LAMMPS_BIGBIG).

#include "kernel.h"

using std::int64_t;

namespace {

// LAMMPS packs the flags of three axes into one number.
template <class Packed> struct Flags {
  static constexpr int BITS = sizeof(Packed) == 8 ? 21 : 10;
  static constexpr int64_t ZERO = int64_t{1} << (BITS - 1), MASK = 2 * ZERO - 1;

  static Packed packed(int64_t a, int64_t b)
  {
    return static_cast<Packed>(((a + ZERO) & MASK) | ((b + ZERO) & MASK) << BITS | ZERO << 2 * BITS);
  }
  static double shift(Packed image, const double *box, int axis)
  {
    const int64_t a = (image & MASK) - ZERO, b = (image >> BITS & MASK) - ZERO;
    return a * box[axis] + b * box[axis + 2];
  }
};

// act(i, k): LAMMPS' atom i has the id k + 1.
template <class Packed, class Act> int64_t visit(int64_t n, const Packed *id, Act act)
{
  for (int64_t i = 0; i < n; ++i) {
    const int64_t k = id[i] - 1;
    if (k < 0 || k >= n) return -1;
    act(i, k);
  }
  return n;
}

template <class Packed>
int64_t put(int64_t n, const Packed *id, const Packed *image, const double *box, const double *from, double *const *x)
{
  return visit(n, id, [&](int64_t i, int64_t k) {
    for (int axis = 0; axis < 2; ++axis) x[i][axis] = from[2 * k + axis] - Flags<Packed>::shift(image[i], box, axis);
  });
}

template <class Packed>
int64_t take(int64_t n, const Packed *id, const Packed *image, const double *box, const double *const *x, double *to)
{
  return visit(n, id, [&](int64_t i, int64_t k) {
    for (int axis = 0; axis < 2; ++axis) to[2 * k + axis] = x[i][axis] + Flags<Packed>::shift(image[i], box, axis);
  });
}

template <class Packed> int64_t take_plain(int64_t n, const Packed *id, const double *const *f, double *to)
{
  return visit(n, id, [&](int64_t i, int64_t k) {
    for (int axis = 0; axis < 2; ++axis) to[2 * k + axis] = f[i][axis];
  });
}

template <class Packed>
int64_t place(int64_t n, const Packed *id, const double *inside, const int64_t *flags, double *const *x, Packed *image)
{
  return visit(n, id, [&](int64_t i, int64_t k) {
    for (int axis = 0; axis < 2; ++axis) x[i][axis] = inside[2 * k + axis];
    image[i] = Flags<Packed>::packed(flags[2 * k], flags[2 * k + 1]);
  });
}

}    // namespace

#define JAMLAB_EXCHANGE(ENDING, PACKED)                                                                                \
  /* wrapped positions of LAMMPS from unwrapped ones (n, 2); the image flags stay */                                   \
  JAMLAB_KERNEL put_positions##ENDING(int64_t n, const PACKED *id, const PACKED *image, const double *box,             \
                                      const double *positions, double *const *x)                                       \
  {                                                                                                                    \
    return put(n, id, image, box, positions, x);                                                                       \
  }                                                                                                                    \
  /* unwrapped positions (n, 2) from those of LAMMPS */                                                                \
  JAMLAB_KERNEL take_positions##ENDING(int64_t n, const PACKED *id, const PACKED *image, const double *box,            \
                                       const double *const *x, double *positions)                                      \
  {                                                                                                                    \
    return take(n, id, image, box, x, positions);                                                                      \
  }                                                                                                                    \
  /* forces (n, 2) from those of LAMMPS */                                                                             \
  JAMLAB_KERNEL take_forces##ENDING(int64_t n, const PACKED *id, const double *const *f, double *forces)               \
  {                                                                                                                    \
    return take_plain(n, id, f, forces);                                                                               \
  }                                                                                                                    \
  /* wrapped positions and image flags into LAMMPS */                                                                  \
  JAMLAB_KERNEL place_atoms##ENDING(int64_t n, const PACKED *id, const double *inside, const int64_t *flags,           \
                                    double *const *x, PACKED *image)                                                   \
  {                                                                                                                    \
    return place(n, id, inside, flags, x, image);                                                                      \
  }

JAMLAB_EXCHANGE(, std::int32_t)
JAMLAB_EXCHANGE(_wide, std::int64_t)
