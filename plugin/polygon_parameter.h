// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "pointers.h"
#include "polygon_rings.h"

#include <string>
#include <vector>

namespace LAMMPS_NS {

/* A PolygonParameter has one value for each polygon of a fix, as an argument says: a number, d_name
   (a per-atom property) or v_name (an equal- or atom-style variable). All vertices of a polygon
   must have the same value. */
class PolygonParameter : protected Pointers {
 public:
  PolygonParameter(class LAMMPS *lmp, const char *who, const char *what, bool may_be_zero) :
      Pointers(lmp), who(who), what(what), may_be_zero(may_be_zero) {}

  void read(const char *argument);
  void init(int igroup);    // finds the variable or property
  // values of all polygons of this rank; on_all_ranks: collective, checks all vertices of each
  void evaluate(const PolygonRings &, bool on_all_ranks, std::vector<double> &);
  bool constant() const { return source == NUMBER; }
  bool is_variable() const { return source == EQUAL || source == ATOM; }

 private:
  enum { NUMBER, PROPERTY, EQUAL, ATOM } source = NUMBER;
  const char *who, *what;
  bool may_be_zero;
  double number = 0.0;
  std::string name;
  int index = -1, igroup = 0;
  std::vector<double> per_atom;
  std::vector<double> before;    // values of a property at the last evaluation

  bool allowed(double value) const { return value > 0.0 || (may_be_zero && value == 0.0); }
  bool as_before(const double *of_atom) const;
  void read_vertices(const PolygonRings &, bool on_all_ranks, const double *of_atom,
                     std::vector<double> &values) const;
};

}    // namespace LAMMPS_NS
