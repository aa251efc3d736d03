// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "fix.h"
#include "image_offset.h"
#include "molecule_outline.h"
#include "vector_bytes.h"

#include <atomic>
#include <utility>
#include <vector>

namespace LAMMPS_NS {

/* This fix knows which vertex follows which on the outline of its molecule. The bonds are the
   outlines. They are read at the start of every run, and whenever molecules have come or gone; atom
   IDs and their order have no meaning. One instance serves all styles of this plugin, which make it
   when there is none.

   A polygon and its periodic images are different outlines. Image flags say to which of them an
   atom or ghost belongs: two atoms of one molecule that need the same lattice translation to their
   unwrapped place are of one image. So a polygon may be wider than half the box, and it may touch
   its own images as it touches other polygons. */
class FixPolygonOutline : public Fix {
 public:
  FixPolygonOutline(class LAMMPS *, int, char **);
  ~FixPolygonOutline() override;
  static FixPolygonOutline *shared(class LAMMPS *, const char *caller);

  int setmask() override { return FixConst::POST_NEIGHBOR | FixConst::MIN_POST_NEIGHBOR; }
  void init() override { unread = true; }
  // Neighbor lists and ghosts are new. The styles ask for a refresh when they need it; styles that
  // compute without these calls (rerun, gcmc) do so too.
  void setup_post_neighbor() override { rebuilds = ++all_rebuilds; }
  void post_neighbor() override { rebuilds = ++all_rebuilds; }
  void min_post_neighbor() override { rebuilds = ++all_rebuilds; }
  void grow_arrays(int nmax) override { links.resize(nmax); }
  void copy_arrays(int i, int j, int /*delflag*/) override { links[j] = links[i]; }
  void set_arrays(int i) override { links[i] = {}; }
  int pack_exchange(int, double *) override;
  int unpack_exchange(int, double *) override;
  int pack_forward_comm(int, int *, double *, int, int *) override;
  void unpack_forward_comm(int, int, double *) override;
  double memory_usage() override { return bytes(links, images, successor, predecessor, tags); }

  // Finds the links that bonds and positions of owned atoms make now; the second function keeps
  // them for the styles. Both are collective, and need no ghosts and no neighbor list.
  std::vector<OutlineLink> present_links() const;
  void read_bonds();
  // Collective, before the first use after a neighbor build: returns the number of the refresh.
  bigint refresh();
  // Identifies neighbor lists. The first number is 0 until this fix has seen lists made.
  std::pair<bigint, bigint> lists() const;

  // These belong to owned atoms and ghosts at the last refresh.
  const OutlineLink &link(int i) const { return links[i]; }
  const ImageOffset &image_of(int i) const { return images[i]; }
  int next(int i) const { return successor[i]; }      // local index in the same copy, -1 if absent
  int prev(int i) const { return predecessor[i]; }

 private:
  std::vector<OutlineLink> links;
  std::vector<ImageOffset> images;
  std::vector<tagint> tags;    // of atoms and ghosts at the last refresh
  std::vector<int> successor, predecessor;
  // of all instances, in all threads: users may unfix one
  inline static std::atomic<bigint> all_rebuilds{0};
  bool unread;
  bigint rebuilds, refreshed;
  std::pair<bigint, bigint> refreshed_for;    // lists

  bool outlines_changed() const;
  int bonds_of(int i) const;
  int in_same_image(int i, tagint tag) const;
  void warn_of_crossings() const;
};

}    // namespace LAMMPS_NS
