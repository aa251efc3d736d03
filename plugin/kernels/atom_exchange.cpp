// Copies vectors of all atoms between arrays in the order of their ids and LAMMPS' own arrays, whose order changes
// whenever LAMMPS sorts its atoms. Each function returns n, or -1 where the ids are not 1 to n; `wide`: ids and image
// flags have 64 bits (LAMMPS_BIGBIG), else 32.

#include "kernel.h"

using std::int64_t;

namespace {

int64_t number(const void *numbers, int64_t wide, int64_t i)
{
  return wide ? static_cast<const int64_t *>(numbers)[i] : static_cast<const std::int32_t *>(numbers)[i];
}

// act(i, k, axis, shift): LAMMPS' atom i has the id k + 1, and its image flags stand for this shift in the box. LAMMPS
// packs the flags of three axes into one number.
template <class Act>
int64_t visit(int64_t n, int64_t wide, const void *id, const void *image, const double *box, Act act)
{
  const int bits = wide ? 21 : 10;
  const int64_t zero = int64_t{1} << (bits - 1);
  for (int64_t i = 0; i < n; ++i) {
    const int64_t k = number(id, wide, i) - 1, flags = box ? number(image, wide, i) : 0;
    if (k < 0 || k >= n) return -1;
    const int64_t a = (flags & (2 * zero - 1)) - zero, b = (flags >> bits & (2 * zero - 1)) - zero;
    for (int axis = 0; axis < 2; ++axis) act(i, k, axis, box ? a * box[axis] + b * box[axis + 2] : 0.0);
  }
  return n;
}

}    // namespace

// rows of LAMMPS (n, 3) from values (n, 2), less what the image flags stand for in a box (2, 2), if there is one
JAMLAB_KERNEL put_atoms(int64_t n, int64_t wide, const void *id, const void *image, const double *box,
                        const double *values, double *const *rows)
try {
  return visit(n, wide, id, image, box, [&](int64_t i, int64_t k, int axis, double shift) {
    rows[i][axis] = values[2 * k + axis] - shift;
  });
}
JAMLAB_OR_NO_MEMORY

// the other way
JAMLAB_KERNEL take_atoms(int64_t n, int64_t wide, const void *id, const void *image, const double *box,
                         double *values, const double *const *rows)
try {
  return visit(n, wide, id, image, box, [&](int64_t i, int64_t k, int axis, double shift) {
    values[2 * k + axis] = rows[i][axis] + shift;
  });
}
JAMLAB_OR_NO_MEMORY
