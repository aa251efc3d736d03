// Copy positions and forces between arrays in the order of the ids and LAMMPS' own arrays, whose order changes whenever
// LAMMPS sorts its atoms. A lattice vector for every image flag keeps positions unwrapped.

#include "kernel.h"

using std::int64_t;

namespace {
constexpr int BITS = 10, ZERO = 512, MASK = (1 << BITS) - 1;  // LAMMPS packs the flags of three axes into 32 bits

struct Shift {
  double x, y;
};

Shift shift_of(int32_t image, const double *box)
{
  const int a = (image & MASK) - ZERO, b = (image >> BITS & MASK) - ZERO;
  return {a * box[0] + b * box[2], a * box[1] + b * box[3]};
}
}    // namespace

// Wrapped positions of LAMMPS from unwrapped ones (n, 2); the image flags stay.
JAMLAB_KERNEL put_positions(int64_t n, const int32_t *id, const int32_t *image, const double *box, const double *positions,
                            double *const *x)
{
  for (int64_t i = 0; i < n; ++i) {
    const int64_t k = id[i] - 1;
    if (k < 0 || k >= n) return -1;
    const Shift s = shift_of(image[i], box);
    x[i][0] = positions[2 * k] - s.x;
    x[i][1] = positions[2 * k + 1] - s.y;
  }
  return n;
}

// Unwrapped positions (n, 2) from those of LAMMPS.
JAMLAB_KERNEL take_positions(int64_t n, const int32_t *id, const int32_t *image, const double *box, const double *const *x,
                             double *positions)
{
  for (int64_t i = 0; i < n; ++i) {
    const int64_t k = id[i] - 1;
    if (k < 0 || k >= n) return -1;
    const Shift s = shift_of(image[i], box);
    positions[2 * k] = x[i][0] + s.x;
    positions[2 * k + 1] = x[i][1] + s.y;
  }
  return n;
}

// Forces (n, 2) from those of LAMMPS.
JAMLAB_KERNEL take_forces(int64_t n, const int32_t *id, const double *const *f, double *forces)
{
  for (int64_t i = 0; i < n; ++i) {
    const int64_t k = id[i] - 1;
    if (k < 0 || k >= n) return -1;
    forces[2 * k] = f[i][0];
    forces[2 * k + 1] = f[i][1];
  }
  return n;
}

// Wrapped positions and image flags into LAMMPS.
JAMLAB_KERNEL place_atoms(int64_t n, const int32_t *id, const double *inside, const int64_t *flags, double *const *x,
                          int32_t *image)
{
  for (int64_t i = 0; i < n; ++i) {
    const int64_t k = id[i] - 1;
    if (k < 0 || k >= n) return -1;
    x[i][0] = inside[2 * k];
    x[i][1] = inside[2 * k + 1];
    image[i] = static_cast<int32_t>(flags[2 * k] + ZERO) | static_cast<int32_t>(flags[2 * k + 1] + ZERO) << BITS | ZERO << 2 * BITS;
  }
  return n;
}
