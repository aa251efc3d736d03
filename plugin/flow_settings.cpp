// SPDX-License-Identifier: GPL-2.0-or-later
#include "flow_settings.h"

#include "error.h"
#include "group.h"
#include "lammps.h"
#include "utils.h"

#include <cstring>

using namespace LAMMPS_NS;

static constexpr double LEAST = 1e-300, MOST = 1e300;    // of numbers that have no other limits

static double number(LAMMPS *lmp, const char *name, const char *text, double least, double most)
{
  const double value = utils::numeric(FLERR, text, false, lmp);
  if (!(value >= least && value <= most))
    lmp->error->all(FLERR, "{}: {} {} must lie between {} and {}", WHO, name, text, least, most);
  return value;
}

/* fix ID all overdamped (rate value | oscillate amplitude omega | stress value)
     [drag tau beta alpha] [tolerance value] [solver value] [iterations value] [background value]
     [fluid value] [longest value] [stop value] [(fixed | walls) group] */
FlowSettings::FlowSettings(LAMMPS *lmp, int narg, char **arg)
{
  for (int k = 3; k < narg;) {
    const Drive earlier = drive;
    drive = NONE;
    k += read(lmp, narg - k, arg + k);
    if (earlier != NONE && drive != NONE)
      lmp->error->all(FLERR, "{}: give one of rate, oscillate and stress, not two", WHO);
    if (drive == NONE) drive = earlier;
  }
  if (drive == NONE)
    lmp->error->all(FLERR, "{}: give rate, oscillate or stress, and what it is", WHO);
}

/* Reads a keyword and its values. Returns how many words these are. */
int FlowSettings::read(LAMMPS *lmp, int words, char **arg)
{
  const auto is = [&](const char *keyword, int values) {
    if (strcmp(arg[0], keyword) != 0) return false;
    if (values >= words) lmp->error->all(FLERR, "{}: {} needs {} value(s)", WHO, keyword, values);
    return true;
  };
  const struct {
    const char *keyword;
    double *value, least, most;
    Drive drive = NONE;
  } numbers[] = {{"rate", &rate, -MOST, MOST, RATE},
                 {"stress", &stress, -MOST, MOST, STRESS},
                 {"tolerance", &tolerance, LEAST, 0.1},
                 {"solver", &solver.tolerance, 1e-13, 0.1},
                 {"background", &solver.background, 0.0, MOST},
                 {"fluid", &fluid, 0.0, MOST},
                 {"longest", &longest, 0.0, MOST},
                 {"stop", &interval, 0.0, MOST}};
  for (const auto &each : numbers) {
    if (!is(each.keyword, 1)) continue;
    *each.value = number(lmp, each.keyword, arg[1], each.least, each.most);
    drive = each.drive;
    return 2;
  }
  if (is("oscillate", 2)) {
    drive = OSCILLATE;
    amplitude = number(lmp, "amplitude", arg[1], LEAST, MOST);
    omega = number(lmp, "omega", arg[2], LEAST, MOST);
    return 3;
  }
  if (is("drag", 3)) {
    droplet_law_given = true;
    droplet_law.tau = number(lmp, "tau of drag", arg[1], 0.0, MOST);
    droplet_law.beta = utils::numeric(FLERR, arg[2], false, lmp);
    droplet_law.alpha = utils::numeric(FLERR, arg[3], false, lmp);
    droplet_law.check(lmp->error, WHO);
    if (droplet_law.tau == 0.0) droplet_law.beta = 0.0;
    return 4;
  }
  if (is("fixed", 1) || is("walls", 1)) {
    const int found = lmp->group->find(arg[1]);
    if (found < 0) lmp->error->all(FLERR, "{}: {} {}: there is no such group", WHO, arg[0], arg[1]);
    if (fixed_bit)
      lmp->error->all(FLERR, "{}: {} {}: give one group of atoms that do not move, as fixed or as "
                      "walls", WHO, arg[0], arg[1]);
    fixed_bit = lmp->group->bitmask[found];
    walls = strcmp(arg[0], "walls") == 0;
  } else if (is("iterations", 1)) {
    solver.iterations = utils::inumeric(FLERR, arg[1], false, lmp);
    if (solver.iterations < 1)
      lmp->error->all(FLERR, "{}: iterations {} must be 1 or more", WHO, arg[1]);
  } else
    lmp->error->all(FLERR, "{}: {} is not one of: rate, oscillate, stress, drag, tolerance, "
                    "solver, iterations, background, fluid, longest, stop, fixed, walls",
                    WHO, arg[0]);
  return 2;
}
