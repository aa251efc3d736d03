#include "periodic_neighbors.h"

#include "kernel.h"

using namespace jamlab;

// Points of b, in every image, nearer to points of a than the sum of the reaches of both.
//   a (n_a, 2), reach_a (n_a), b (n_b, 2), reach_b (n_b), box (2, 2); once, most_copies, search:
//   see visit_neighbors; i, j (room), r (room, 2), shift (room, 2) out.
// Returns the number of neighbors, of which the first `room` are written, or why there are none.
JAMLAB_KERNEL periodic_neighbors(int64_t n_a, const double *a, const double *reach_a, int64_t n_b,
                                 const double *b, const double *reach_b, const double *box,
                                 int64_t once, double most_copies, int64_t room, int64_t *i,
                                 int64_t *j, double *r, int64_t *shift, double *search)
try {
  if (!n_a || !n_b) return 0;
  int64_t count = 0;
  const int64_t refusal = visit_neighbors(
      {n_a, a, reach_a}, {n_b, b, reach_b}, Lattice(box), once, most_copies, search,
      [&](const Neighbor &found) {
        if (count < room) {
          i[count] = found.i;
          j[count] = found.j;
          put(r, count, found.r);
          shift[2 * count] = found.shift.first;
          shift[2 * count + 1] = found.shift.second;
        }
        ++count;
      });
  return refusal ? refusal : count;
}
JAMLAB_OR_NO_MEMORY
