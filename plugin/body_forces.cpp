// SPDX-License-Identifier: GPL-2.0-or-later
#include "body_forces.h"

#include "atom.h"
#include "error.h"
#include "fix.h"
#include "flow_settings.h"
#include "group.h"
#include "modify.h"
#include "utils.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

static constexpr double ROUNDING = 1e-12;    // of a force over a mass

bool BodyForces::accepts(const Fix *fix)
{
  return utils::strmatch(fix->style, "^gravity") || utils::strmatch(fix->style, "^addforce");
}

/* Another run may have other forces. The atoms of a dynamic group are known after the first step
   alone. */
void BodyForces::init(const std::vector<Fix *> &fixes)
{
  sources.clear();
  for (Fix *const fix : fixes) {
    if (group->dynamic[fix->igroup])
      error->all(FLERR, "{}: fix {} of style {} has the dynamic group {}, so that its forces come "
                 "and go: give a static one", WHO, fix->id, fix->style, group->names[fix->igroup]);
    if (fix->nevery != 1)
      error->all(FLERR, "{}: fix {} of style {} adds its force every {} steps, which have any "
                 "length: leave out every", WHO, fix->id, fix->style, fix->nevery);
    sources.push_back({fix, fix->id, utils::strmatch(fix->style, "^gravity")});
  }
}

const char *BodyForces::first() const
{
  return sources.front().fix->id;
}

void BodyForces::measure()
{
  enum { X, MINUS_X, Y, MINUS_Y, Z, NUMBERS };
  double **const f = atom->f;
  forces.assign(atom->nlocal, Vec3());
  for (Source &source : sources) {
    if (modify->get_fix_by_id(source.id) != source.fix)
      error->all(FLERR, "{}: fix {} was not in the last run: leave out pre no", WHO, source.id);
    source.fix->post_force(0);
    double most[NUMBERS] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL, -HUGE_VAL, 0.0};
    for (int i = 0; i < atom->nlocal; i++) {
      if (!(atom->mask[i] & source.fix->groupbit)) continue;
      const double mass = atom->rmass ? atom->rmass[i] : atom->mass[atom->type[i]];
      const double per = source.per_mass ? 1.0 / mass : 1.0, x = per * f[i][0], y = per * f[i][1];
      const double values[NUMBERS] = {x, -x, y, -y, fabs(f[i][2])};
      for (int k = 0; k < NUMBERS; k++) most[k] = std::max(most[k], values[k]);
      forces[i] += {f[i][0], f[i][1], 0.0};
      std::fill_n(f[i], 3, 0.0);
    }
    MPI_Allreduce(MPI_IN_PLACE, most, NUMBERS, MPI_DOUBLE, MPI_MAX, world);
    if (most[X] > -HUGE_VAL) check(source, most);
  }
}

/* most: of x, -x, y, -y and |z| over all atoms of the group */
void BodyForces::check(Source &source, const double *most) const
{
  const Fix *const fix = source.fix;
  if (most[4] > 0.0)
    error->all(FLERR, "{}: fix {} of style {} pushes along z, where nothing moves in 2D", WHO,
               fix->id, fix->style);
  for (int d = 0; d < 2; d++) {
    const double high = most[2 * d], low = -most[2 * d + 1];
    const double before = source.known ? source.force[d] : high;
    const double size = ROUNDING * std::max({fabs(high), fabs(low), fabs(before)});
    if (high - low > size || fabs(high - before) > size)
      error->all(FLERR, "{}: fix {} of style {}: the force{} along {} is not the same for all "
                 "atoms of its group and at all steps: {:.6g} to {:.6g}, {:.6g} at first; give "
                 "constant numbers, without region", WHO, fix->id, fix->style,
                 source.per_mass ? " over the mass" : "", d ? "y" : "x", low, high, before);
    source.force[d] = high;
  }
  source.known = true;
}
