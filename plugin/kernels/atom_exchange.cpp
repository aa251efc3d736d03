// These functions copy vectors of all atoms between arrays in the order of their ids and the arrays
// of LAMMPS, which changes its order whenever it sorts atoms. Each returns n, or -1 where the ids
// are not 1 to n. `wide`: ids and image flags have 64 bits (LAMMPS_BIGBIG), otherwise 32.

#include "kernel.h"

using std::int64_t;

namespace {

int64_t number(const void *numbers, int64_t wide, int64_t i)
{
  return wide ? static_cast<const int64_t *>(numbers)[i]
              : static_cast<const std::int32_t *>(numbers)[i];
}

// Calls act(row, value, shift) for x and y of all atoms: the number of LAMMPS, the value in the
// order of ids, and the translation by the image flags, which LAMMPS packs into one number.
template <class Row, class Value, class Act>
int64_t visit(int64_t n, int64_t wide, const void *id, const void *image, const double *box,
              Value *values, Row *const *rows, Act act)
{
  const int bits = wide ? 21 : 10;
  const int64_t zero = int64_t{1} << (bits - 1);
  for (int64_t i = 0; i < n; ++i) {
    const int64_t k = number(id, wide, i) - 1, flags = box ? number(image, wide, i) : 0;
    if (k < 0 || k >= n) return -1;
    const int64_t a = (flags & (2 * zero - 1)) - zero, b = (flags >> bits & (2 * zero - 1)) - zero;
    for (int d = 0; d < 2; ++d)
      act(rows[i][d], values[2 * k + d], box ? a * box[d] + b * box[d + 2] : 0.0);
  }
  return n;
}

}    // namespace

// Writes values (n, 2) to rows of LAMMPS (n, 3), less translations if there is a box (2, 2).
JAMLAB_KERNEL put_atoms(int64_t n, int64_t wide, const void *id, const void *image,
                        const double *box, const double *values, double *const *rows)
try {
  return visit(n, wide, id, image, box, values, rows,
               [](double &row, double value, double shift) { row = value - shift; });
}
JAMLAB_OR_NO_MEMORY

// Reads rows of LAMMPS into values, and adds the translations.
JAMLAB_KERNEL take_atoms(int64_t n, int64_t wide, const void *id, const void *image,
                         const double *box, double *values, const double *const *rows)
try {
  return visit(n, wide, id, image, box, values, rows,
               [](double row, double &value, double shift) { value = row + shift; });
}
JAMLAB_OR_NO_MEMORY
