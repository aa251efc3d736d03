// This file sorts contacts by the pairs of particles that touch, and finds which particles rattle.

#include "kernel.h"
#include "periodic_grid.h"

#include <tuple>

using namespace jamlab;

namespace {

struct Name {
  int64_t i, j;
  Image image;  // of j
  int64_t contact, swapped;

  // Seen from both sides a pair has one name: the lower number first, the image counted from it.
  Name(int64_t one, int64_t other, const Image &image, int64_t contact)
    : i(one), j(other), image(image), contact(contact),
      swapped(one > other || (one == other && !image.positive()))
  {
    if (!swapped) return;
    std::swap(i, j);
    this->image = Image{0, 0} - image;
  }
  std::tuple<int64_t, int64_t, int64_t, int64_t> key() const
  {
    return {i, j, image.first, image.second};
  }
};

}  // namespace

// Names pairs of particles alike from both sides.
//   i, j (contacts), image (contacts, 2): of j;
//   names (contacts, 4) out: i <= j and the image, sorted, of which the first are written;
//   row (contacts) out: name of each contact; swapped (contacts) out: 0 or 1.
// Returns the number of names.
JAMLAB_KERNEL named_pairs(int64_t contacts, const int64_t *i, const int64_t *j,
                          const int64_t *image, int64_t *names, int64_t *row, int64_t *swapped)
try {
  std::vector<Name> all;
  all.reserve(contacts);
  for (int64_t k = 0; k < contacts; ++k)
    all.emplace_back(i[k], j[k], Image{image[2 * k], image[2 * k + 1]}, k);
  std::sort(all.begin(), all.end(), [](const Name &a, const Name &b) { return a.key() < b.key(); });
  int64_t count = 0;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const Name &name = all[k];
    if (!k || name.key() != all[k - 1].key()) {
      int64_t *const to = names + 4 * count++;
      std::tie(to[0], to[1], to[2], to[3]) = name.key();
    }
    row[name.contact] = count - 1;
    swapped[name.contact] = name.swapped;
  }
  return count;
}
JAMLAB_OR_NO_MEMORY

// Takes away particles with too few contacts, again and again, until all others have enough.
//   pairs (contacts, 2); places (contacts): at which each pair touches; suspects (particles): 0 of
//   those that count as held; least: contacts of a particle that is held;
//   rattlers (particles) out; bearing (contacts) out: 1 between two that do not rattle. Returns 0.
JAMLAB_KERNEL find_rattlers(int64_t contacts, const int64_t *pairs, const int64_t *places,
                            int64_t particles, const int64_t *suspects, int64_t least,
                            int64_t *rattlers, int64_t *bearing)
try {
  std::vector<int64_t> degree(particles);
  std::fill(rattlers, rattlers + particles, 0);
  for (bool changed = true; changed;) {
    changed = false;
    std::fill(degree.begin(), degree.end(), 0);
    for (int64_t k = 0; k < contacts; ++k) {
      const int64_t i = pairs[2 * k], j = pairs[2 * k + 1];
      bearing[k] = !(rattlers[i] || rattlers[j]);
      degree[i] += bearing[k] * places[k];
      degree[j] += bearing[k] * places[k];
    }
    for (int64_t p = 0; p < particles; ++p)
      if (degree[p] < least && suspects[p] && !rattlers[p]) rattlers[p] = changed = true;
  }
  return 0;
}
JAMLAB_OR_NO_MEMORY
