// SPDX-License-Identifier: GPL-2.0-or-later

#include "polygon_parameter.h"

#include "atom.h"
#include "error.h"
#include "input.h"
#include "utils.h"
#include "variable.h"

#include <cmath>

using namespace LAMMPS_NS;

static constexpr double ROUNDING = 1.0e-12;    // of a mean over ranks, relative

void PolygonParameter::read(const char *argument)
{
  name = argument;
  const std::string prefix = name.substr(0, 2);
  source = prefix == "d_" ? PROPERTY : prefix == "v_" ? EQUAL : NUMBER;
  if (source == NUMBER)
    number = utils::numeric(FLERR, argument, false, lmp);
  else
    name = name.substr(2);
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

void PolygonParameter::evaluate(const PolygonRings &rings, bool checked,
                                std::vector<double> &values)
{
  const auto &polygons = rings.polygons();
  if (source == NUMBER || source == EQUAL) {
    if (source == EQUAL) number = input->variable->compute_equal(index);
    values.assign(polygons.size(), number);
    return;
  }
  const double *of_atom = source == PROPERTY ? atom->dvector[index] : nullptr;
  if (source == ATOM) {
    per_atom.resize(atom->nmax);
    input->variable->compute_atom(index, igroup, per_atom.data(), 1, 0);
    of_atom = per_atom.data();
  }
  values.resize(polygons.size());
  for (const auto &segment : rings.segments())
    values[segment.polygon] = of_atom[rings.vertices()[segment.begin].i];
  if (checked) check(rings, of_atom, values);
}

/* the same on all vertices, also on those of other ranks */
void PolygonParameter::check(const PolygonRings &rings, const double *of_atom,
                             const std::vector<double> &values) const
{
  const auto &polygons = rings.polygons();
  std::vector<double> mean(polygons.size(), 0.0);
  for (const auto &segment : rings.segments())
    for (int n = segment.begin; n < segment.end; n++) {
      const int i = rings.vertices()[n].i;
      if (of_atom[i] != values[segment.polygon])
        error->one(FLERR, "{}: {} {} differs between the vertices of polygon {}: {} and {}", who,
                   what, name, polygons[segment.polygon].molecule, values[segment.polygon],
                   of_atom[i]);
      mean[segment.polygon] += of_atom[i] / polygons[segment.polygon].size;
    }
  rings.sum(mean, 1);
  for (std::size_t k = 0; k < polygons.size(); k++)
    if (std::fabs(mean[k] - values[k]) > ROUNDING * std::fabs(values[k]))
      error->one(FLERR, "{}: {} {} differs between the vertices of polygon {}: {} here, {} on "
                 "average", who, what, name, polygons[k].molecule, values[k], mean[k]);
}
