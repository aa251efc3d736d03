// SPDX-License-Identifier: GPL-2.0-or-later
#include "polygon_parameter.h"

#include "atom.h"
#include "error.h"
#include "input.h"
#include "utils.h"
#include "variable.h"

#include <cstring>

using namespace LAMMPS_NS;

void PolygonParameter::read(const char *argument)
{
  name = argument;
  const std::string prefix = name.substr(0, 2);
  source = prefix == "d_" ? PROPERTY : prefix == "v_" ? EQUAL : NUMBER;
  if (source != NUMBER) {
    name = name.substr(2);
    return;
  }
  number = utils::numeric(FLERR, argument, false, lmp);
  if (!allowed(number))
    error->all(FLERR, "{}: {} {} must be positive{}", who, what, name, may_be_zero ? " or 0" : "");
}

void PolygonParameter::init(int group)
{
  igroup = group;
  if (source == PROPERTY) {
    int is_double, columns;
    index = atom->find_custom(name.c_str(), is_double, columns);
    if (index < 0 || !is_double || columns > 0)
      error->all(FLERR, "{}: no per-atom property d_{} for {}: use fix property/atom", who, name,
                 what);
  } else if (source != NUMBER) {
    index = input->variable->find(name.c_str());
    if (index < 0) error->all(FLERR, "{}: no variable {} for {}", who, name, what);
    if (!input->variable->equalstyle(index) && !input->variable->atomstyle(index))
      error->all(FLERR, "{}: variable {} for {} must be of style equal or atom", who, name, what);
    source = input->variable->equalstyle(index) ? EQUAL : ATOM;
  }
}

void PolygonParameter::evaluate(const PolygonRings &rings, bool on_all_ranks,
                                std::vector<double> &values)
{
  const auto &polygons = rings.polygons();
  if (source == PROPERTY && !on_all_ranks && as_before(atom->dvector[index])) return;
  if (source == EQUAL) number = input->variable->compute_equal(index);
  values.assign(polygons.size(), number);
  if (source == PROPERTY) read_vertices(rings, on_all_ranks, atom->dvector[index], values);
  if (source == ATOM) {
    per_atom.resize(atom->nmax);
    input->variable->compute_atom(index, igroup, per_atom.data(), 1, 0);
    read_vertices(rings, on_all_ranks, per_atom.data(), values);
  }
  for (std::size_t k = 0; k < polygons.size(); k++)
    if (!allowed(values[k]))
      error->one(FLERR, "{}: {} of polygon {} is {}, must be positive{}; vertices that fix deposit "
                 "or create_atoms made have it from an atom-style variable v_name", who, what,
                 polygons[k].molecule, values[k], may_be_zero ? " or 0" : "");
  if (source == PROPERTY) before.assign(atom->dvector[index], atom->dvector[index] + atom->nlocal);
}

/* Whether no vertex has another value than at the last evaluation, which gave those of polygons. */
bool PolygonParameter::as_before(const double *of_atom) const
{
  if (static_cast<int>(before.size()) != atom->nlocal) return false;
  return before.empty() ||
      std::memcmp(before.data(), of_atom, before.size() * sizeof(double)) == 0;
}

/* All vertices of a polygon must have the value of the first one, which another rank may own, or of
   one of this rank. */
void PolygonParameter::read_vertices(const PolygonRings &rings, bool on_all_ranks,
                                     const double *of_atom, std::vector<double> &values) const
{
  if (on_all_ranks)
    values = rings.of_first(1, [=](int i, double *value) { *value = of_atom[i]; });
  for (const auto &segment : rings.segments()) {
    const auto *const vertices = rings.vertices().data();
    if (!on_all_ranks) values[segment.polygon] = of_atom[vertices[segment.begin].i];
    const double value = values[segment.polygon];
    for (int n = segment.begin; n < segment.end; n++)
      if (of_atom[vertices[n].i] != value)
        error->one(FLERR, "{}: {} {} differs between the vertices of polygon {}: {} and {}", who,
                   what, name, rings.polygons()[segment.polygon].molecule, value,
                   of_atom[vertices[n].i]);
  }
}
