// Copy positions and forces between arrays in the order of the ids and LAMMPS' own arrays, whose order changes whenever
// LAMMPS sorts its atoms. A lattice vector for every image flag keeps positions unwrapped. Each function returns n, or
// -1 where the ids are not 1 to n; `wide`: ids and image flags have 64 bits (LAMMPS_BIGBIG), else 32.

#include "kernel.h"

using std::int64_t;

namespace {

int64_t number(const void *numbers, int64_t wide, int64_t i)
{
  return wide ? static_cast<const int64_t *>(numbers)[i] : static_cast<const std::int32_t *>(numbers)[i];
}

// LAMMPS packs the flags of three axes into one number.
struct Flags {
  const int64_t bits, zero;

  explicit Flags(int64_t wide) : bits(wide ? 21 : 10), zero(int64_t{1} << (bits - 1)) {}
  int64_t flag(int64_t image, int axis) const { return (image >> axis * bits & (2 * zero - 1)) - zero; }
  int64_t packed(int64_t a, int64_t b) const
  {
    const int64_t mask = 2 * zero - 1;
    return ((a + zero) & mask) | ((b + zero) & mask) << bits | zero << 2 * bits;
  }
  double shift(int64_t image, const double *box, int axis) const
  {
    return flag(image, 0) * box[axis] + flag(image, 1) * box[axis + 2];
  }
};

// act(i, k, axis): LAMMPS' atom i has the id k + 1.
template <class Act> int64_t visit(int64_t n, int64_t wide, const void *id, Act act)
{
  for (int64_t i = 0; i < n; ++i) {
    const int64_t k = number(id, wide, i) - 1;
    if (k < 0 || k >= n) return -1;
    for (int axis = 0; axis < 2; ++axis) act(i, k, axis);
  }
  return n;
}

}    // namespace

// wrapped positions of LAMMPS from unwrapped ones (n, 2); the image flags stay
JAMLAB_KERNEL put_positions(int64_t n, int64_t wide, const void *id, const void *image, const double *box,
                            const double *positions, double *const *x)
try {
  const Flags flags(wide);
  return visit(n, wide, id, [&](int64_t i, int64_t k, int axis) {
    x[i][axis] = positions[2 * k + axis] - flags.shift(number(image, wide, i), box, axis);
  });
}
JAMLAB_OR_NO_MEMORY

// unwrapped positions (n, 2) from those of LAMMPS
JAMLAB_KERNEL take_positions(int64_t n, int64_t wide, const void *id, const void *image, const double *box,
                             const double *const *x, double *positions)
try {
  const Flags flags(wide);
  return visit(n, wide, id, [&](int64_t i, int64_t k, int axis) {
    positions[2 * k + axis] = x[i][axis] + flags.shift(number(image, wide, i), box, axis);
  });
}
JAMLAB_OR_NO_MEMORY

// forces (n, 2) from those of LAMMPS
JAMLAB_KERNEL take_forces(int64_t n, int64_t wide, const void *id, const double *const *f, double *forces)
try {
  return visit(n, wide, id, [&](int64_t i, int64_t k, int axis) { forces[2 * k + axis] = f[i][axis]; });
}
JAMLAB_OR_NO_MEMORY

// wrapped positions and image flags into LAMMPS
JAMLAB_KERNEL place_atoms(int64_t n, int64_t wide, const void *id, const double *inside, const int64_t *images,
                          double *const *x, void *image)
try {
  const Flags flags(wide);
  return visit(n, wide, id, [&](int64_t i, int64_t k, int axis) {
    x[i][axis] = inside[2 * k + axis];
    const int64_t packed = flags.packed(images[2 * k], images[2 * k + 1]);
    if (wide)
      static_cast<int64_t *>(image)[i] = packed;
    else
      static_cast<std::int32_t *>(image)[i] = static_cast<std::int32_t>(packed);
  });
}
JAMLAB_OR_NO_MEMORY
