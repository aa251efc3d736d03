// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "contact_forms.h"

namespace LAMMPS_NS {

/* FlatWalls are lines along x through single atoms and their images along y, which vertices alone
   meet. They reach all over the box: on several ranks each rank knows all of them, and numbers them
   after its atoms and ghosts. */
class FlatWalls : protected Pointers {
 public:
  FlatWalls(class LAMMPS *lmp) : Pointers(lmp) {}

  struct Wall {
    tagint tag, molecule;
    int type, mask;
    int rank, index;    // its owner, and its local index there
    double y;           // at the last update
    bool operator<(const Wall &o) const { return tag < o.tag; }
  };

  // Collective, after each neighbor build: finds the walls that each vertex can touch.
  void build(const class NeighList *, const ContactLaws &);
  // Collective: takes present heights.
  void update();
  // The list is valid until the next call.
  const std::vector<Contact> &find(const Position *x, const PairLaws &);

  bool shared() const;    // between several ranks
  int extra() const { return shared() ? static_cast<int>(walls.size()) : 0; }    // numbers
  const Wall &operator[](int number) const { return walls[number]; }
  double memory_usage() const { return bytes(walls, rows, found); }

 private:
  struct Row {
    int i, wall, law;
    int image;    // of the wall, along y
  };
  std::vector<Wall> walls;
  std::vector<Row> rows;
  std::vector<Contact> found;

  int image_above(double height) const;
};

}    // namespace LAMMPS_NS
