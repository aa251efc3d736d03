// Sum blocks of small terms into a sparse symmetric matrix of 2 x 2 blocks, one for each pair of sites that a term
// joins.

#include "kernel.h"

#include <algorithm>
#include <vector>

using std::int64_t;

// Columns of every row of sites: which sites share a term with it, itself included, sorted.
//   sites (terms, width); start (size + 1) out; columns (room) out, or nothing but `start` if the room is too small.
// Returns the number of columns.
JAMLAB_KERNEL joined_sites(int64_t size, int64_t terms, const int64_t *width, const int64_t *first,
                           const int64_t *sites, int64_t room, int64_t *start, int32_t *columns)
try {
  std::vector<int64_t> place(size + 1, 0);
  for (int64_t t = 0; t < terms; ++t)
    for (int64_t a = 0; a < width[t]; ++a) place[sites[first[t] + a] + 1] += width[t];
  for (int64_t i = 0; i < size; ++i) place[i + 1] += place[i];
  std::vector<int32_t> all(place[size]);
  std::vector<int64_t> next(place.begin(), place.end() - 1);
  for (int64_t t = 0; t < terms; ++t) {
    const int64_t *own = sites + first[t];
    for (int64_t a = 0; a < width[t]; ++a)
      for (int64_t b = 0; b < width[t]; ++b) all[next[own[a]]++] = static_cast<int32_t>(own[b]);
  }
  start[0] = 0;
  for (int64_t i = 0; i < size; ++i) {
    const auto low = all.begin() + place[i], high = all.begin() + place[i + 1];
    std::sort(low, high);
    const int64_t count = std::unique(low, high) - low;
    start[i + 1] = start[i] + count;
    if (start[i + 1] <= room) std::copy(low, low + count, columns + start[i]);
  }
  return start[size];
}
JAMLAB_OR_NO_MEMORY

// Add the blocks of terms, each (2 w, 2 w) for w sites, to the data of a CSC matrix with the pattern of `joined_sites`.
JAMLAB_KERNEL add_blocks(int64_t terms, int64_t width, const int64_t *sites, const double *blocks, const int64_t *start,
                         const int32_t *columns, double *data)
try {
  for (int64_t t = 0; t < terms; ++t) {
    const int64_t *own = sites + t * width;
    const double *block = blocks + t * 4 * width * width;
    for (int64_t a = 0; a < width; ++a) {
      const int64_t low = start[own[a]], count = start[own[a] + 1] - low;
      for (int64_t b = 0; b < width; ++b) {
        const int32_t *found = std::lower_bound(columns + low, columns + low + count, static_cast<int32_t>(own[b]));
        double *upper = data + 4 * low + 2 * (found - columns - low), *lower = upper + 2 * count;
        const double *values = block + 4 * a * width + 2 * b;
        upper[0] += values[0];
        upper[1] += values[1];
        lower[0] += values[2 * width];
        lower[1] += values[2 * width + 1];
      }
    }
  }
  return terms;
}
JAMLAB_OR_NO_MEMORY

// Pattern of the matrix in compressed sparse columns, from the columns of `joined_sites`.
JAMLAB_KERNEL coordinate_pattern(int64_t size, const int64_t *start, const int32_t *columns, int32_t *indptr,
                                 int32_t *indices)
try {
  int32_t *next = indices;
  for (int64_t i = 0; i < size; ++i)
    for (int64_t axis = 0; axis < 2; ++axis) {
      indptr[2 * i + axis] = static_cast<int32_t>(next - indices);
      for (int64_t k = start[i]; k < start[i + 1]; ++k) {
        *next++ = 2 * columns[k];
        *next++ = 2 * columns[k] + 1;
      }
    }
  indptr[2 * size] = static_cast<int32_t>(next - indices);
  return next - indices;
}
JAMLAB_OR_NO_MEMORY
