// This file measures how much of the outlines of droplets lies in contact with other droplets.

#include "droplet_outlines.h"
#include "kernel.h"

using namespace jamlab;

// Parts of edges nearer than delta to another polygon, or to an image of their own.
//   offsets (n + 1), x (vertices, 2), box (2, 2), delta;
//   i, j, length (room), shift (room, 2) out: polygon of the edge, the other one and its image, and
//   the length of the part; search (5) out: see visit_neighbors.
// Returns the number of parts, of which the first `room` are written, or why there are none.
JAMLAB_KERNEL contact_lengths(int64_t n, const int64_t *offsets, const double *x, const double *box,
                              double delta, double most_copies, int64_t room, int64_t *i,
                              int64_t *j, int64_t *shift, double *length, double *search)
try {
  DropletOutlines outlines(n, offsets, x, box, 0.5 * delta);
  const int64_t refusal = outlines.find_near(most_copies, search);
  if (refusal < 0) return refusal;
  OutlineCutter cutter(outlines);
  int64_t count = 0;
  for (int64_t edge = 0; edge < static_cast<int64_t>(outlines.edges.size()); ++edge)
    cutter.find_contacts(edge, [&](const NearPolygon &other, double begin, double end) {
      const int64_t k = count++;
      if (k >= room) return;
      i[k] = outlines.edges[edge].particle;
      j[k] = other.particle;
      shift[2 * k] = other.shift.first;
      shift[2 * k + 1] = other.shift.second;
      length[k] = end - begin;
    });
  return count;
}
JAMLAB_OR_NO_MEMORY
