// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "pointers.h"
#include "slip_row.h"

#include <array>
#include <string>
#include <vector>

namespace LAMMPS_NS {

/* Constant forces on all atoms of a group: those of fix gravity, which are proportional to masses,
   and of fix addforce. LAMMPS adds them to the other forces. Here each fix is asked for its own
   alone. A step holds them constant, so a force that differs between atoms or steps is refused,
   such as one of a variable, in a region or of a direction that turns. */
class BodyForces : protected Pointers {
 public:
  BodyForces(class LAMMPS *lmp) : Pointers(lmp) {}

  static bool accepts(const class Fix *);
  void init(const std::vector<Fix *> &);
  bool empty() const { return sources.empty(); }
  const char *first() const;    // fix, by its name
  void measure();               // collective, where no other forces have been added
  const Field &applied() const { return forces; }    // to owned atoms

 private:
  struct Source {
    Fix *fix;
    std::string id;
    bool per_mass, known = false;
    std::array<double, 2> force = {0.0, 0.0};    // on each atom, or over its mass, in this run
  };
  std::vector<Source> sources;
  Field forces;

  void check(Source &, const double *most) const;
};

}    // namespace LAMMPS_NS
