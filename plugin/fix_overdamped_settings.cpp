// SPDX-License-Identifier: GPL-2.0-or-later

/* Arguments, checks, output. */

#include "fix_overdamped.h"

#include "atom.h"
#include "comm.h"
#include "compute.h"
#include "disk_drag.h"
#include "domain.h"
#include "droplet_drag.h"
#include "error.h"
#include "force.h"
#include "group.h"
#include "modify.h"
#include "pair_disk_drag.h"
#include "update.h"
#include "utils.h"

#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;
using namespace FixConst;

static constexpr char WHO[] = "Fix overdamped";
// Overlap over the mean one and the root of the tolerance, below which disks drag as at it: stresses of 4 flows with
// exponent 2.5 err as little as without, and steps that were 1e-7 long become 100 times longer
static constexpr double LAYER = 0.01;

FixOverdamped::FixOverdamped(LAMMPS *lmp, int narg, char **arg) : Fix(lmp, narg, arg)
{
  read_arguments(narg, arg);
  user_time_step = update->dt;

  time_integrate = 1;
  time_depend = 1;
  force_reneighbor = 1;
  next_reneighbor = -1;
  no_change_box = 1;
  box_change |= BOX_CHANGE_XY;
  restart_global = restart_peratom = 1;
  restart_pbc = 1;
  vector_flag = 1;
  size_vector = 21;
  global_freq = 1;
  extvector = 0;
  comm_forward = comm_reverse = 3;
  maxexchange = PER_ATOM;

  FixOverdamped::grow_arrays(atom->nmax);
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
}

FixOverdamped::~FixOverdamped()
{
  atom->delete_callback(id, Atom::GROW);
  atom->delete_callback(id, Atom::RESTART);
  if (update) set_time_step(user_time_step);
  if (!modify) return;
  for (const char *name : {"virial", "energy"})    // they may be gone, by uncompute
    if (const auto own = fmt::format("{}_{}", id, name); modify->get_compute_by_id(own)) modify->delete_compute(own);
}

/* computes that come later than the fix would not be asked before the first step */
void FixOverdamped::post_constructor()
{
  virial = modify->add_compute(fmt::format("{}_virial all pressure NULL virial", id));
  energy = modify->add_compute(fmt::format("{}_energy all pe", id));
}

/* fix ID all overdamped (rate value | oscillate amplitude omega | stress value)
     [drag tau beta alpha] [tolerance value] [solver value] [iterations value] [background value]
     [fluid value] [longest value] [stop value] [(fixed | walls) group] */
void FixOverdamped::read_arguments(int narg, char **arg)
{
  const auto is = [&](int k, const char *keyword, int values) {
    if (strcmp(arg[k], keyword) != 0) return false;
    if (k + values >= narg) error->all(FLERR, "{}: {} needs {} value(s)", WHO, keyword, values);
    return true;
  };
  for (int k = 3; k < narg; k += 2) {
    const Drive earlier = drive;
    if (is(k, "rate", 1)) {
      drive = RATE;
      wanted_rate = number("rate", arg[k + 1]);
    } else if (is(k, "oscillate", 2)) {
      drive = OSCILLATE;
      amplitude = number("amplitude", arg[k + 1]);
      omega = number("omega", arg[k + 2]);
      k++;
    } else if (is(k, "stress", 1)) {
      drive = STRESS;
      wanted_stress = number("stress", arg[k + 1]);
    } else {
      double *value = is(k, "tolerance", 1)     ? &tolerance
          : is(k, "solver", 1)                  ? &settings.tolerance
          : is(k, "background", 1)              ? &settings.background
          : is(k, "fluid", 1)                   ? &fluid
          : is(k, "longest", 1)                 ? &longest
          : is(k, "stop", 1)                    ? &interval
                                                : nullptr;
      if (value)
        *value = number(arg[k], arg[k + 1]);
      else if (is(k, "fixed", 1) || is(k, "walls", 1)) {
        const int found = group->find(arg[k + 1]);
        if (found < 0) error->all(FLERR, "{}: {} {}: there is no such group", WHO, arg[k], arg[k + 1]);
        fixed_bit = group->bitmask[found];
        walls = strcmp(arg[k], "walls") == 0;
      } else if (is(k, "drag", 3)) {
        read_droplet_law(arg + k + 1);
        k += 2;
      } else if (is(k, "iterations", 1))
        settings.iterations = utils::inumeric(FLERR, arg[k + 1], false, lmp);
      else
        error->all(FLERR, "{}: {} is not one of: rate, oscillate, stress, drag, tolerance, solver, iterations, "
                   "background, fluid, longest, stop, fixed, walls", WHO, arg[k]);
      continue;
    }
    if (earlier != NONE) error->all(FLERR, "{}: give one of rate, oscillate and stress, not two", WHO);
  }
  if (!droplet_law_given || droplet_law.tau == 0.0) droplet_law.tau = droplet_law.beta = 0.0;
  if (drive == NONE) error->all(FLERR, "{}: give one of: rate value, oscillate amplitude omega, stress value", WHO);
  if (drive == OSCILLATE && !(amplitude > 0.0 && omega > 0.0))
    error->all(FLERR, "{}: amplitude {} and omega {} of oscillate must be positive", WHO, amplitude, omega);
  if (!(tolerance > 0.0 && tolerance <= 0.1))
    error->all(FLERR, "{}: tolerance {} must lie above 0, up to 0.1", WHO, tolerance);
  if (!(settings.tolerance >= 1e-13 && settings.tolerance <= 0.1))
    error->all(FLERR, "{}: solver {} must lie between 1e-13 and 0.1", WHO, settings.tolerance);
  if (settings.iterations < 1)
    error->all(FLERR, "{}: iterations {} must be 1 or more", WHO, settings.iterations);
  if (settings.background < 0.0 || fluid < 0.0 || longest < 0.0 || interval < 0.0)
    error->all(FLERR, "{}: background {}, fluid {}, longest {} and stop {} must not be negative", WHO,
               settings.background, fluid, longest, interval);
}

void FixOverdamped::read_droplet_law(char **arg)
{
  droplet_law_given = true;
  droplet_law.tau = number("tau", arg[0]);
  droplet_law.beta = number("beta", arg[1]);
  droplet_law.alpha = number("alpha", arg[2]);
  if (!(droplet_law.tau >= 0.0)) error->all(FLERR, "{}: tau {} of drag must be a time, or 0", WHO, arg[0]);
  if (!(droplet_law.beta >= 0.0 && droplet_law.beta <= LARGEST_BETA))
    error->all(FLERR, "{}: beta {} of drag must lie between 0 and {}", WHO, arg[1], LARGEST_BETA);
  if (!(droplet_law.alpha >= LEAST_ALPHA && droplet_law.alpha <= 1.0))
    error->all(FLERR, "{}: alpha {} of drag must lie between {} and 1 (linear)", WHO, arg[2], LEAST_ALPHA);
}

double FixOverdamped::number(const char *keyword, const char *text) const
{
  const double value = utils::numeric(FLERR, text, false, lmp);
  if (!std::isfinite(value)) error->all(FLERR, "{}: {} {} must be finite", WHO, keyword, text);
  return value;
}

int FixOverdamped::setmask()
{
  return INITIAL_INTEGRATE | PRE_EXCHANGE | FINAL_INTEGRATE | POST_RUN;
}

void FixOverdamped::init()
{
  check();
  check_forces();
  if (update->whichflag == 2) set_time_step(user_time_step);    // of a minimisation
  virial = modify->get_compute_by_id(fmt::format("{}_virial", id));
  energy = modify->get_compute_by_id(fmt::format("{}_energy", id));
  if (!virial || !energy)
    error->all(FLERR, "{}: compute {}_virial or {}_energy is gone, which belong to it: do not uncompute them", WHO, id,
               id);
  make_solver();
}

/* Forces other than contact forces would move particles without being in any stress, energy or
   step: drag and stiffness are known of the forces of the model alone. So would fixes that move them or the box. */
void FixOverdamped::check_forces() const
{
  const bool disks = force->pair_match("disk/drag", 1);
  const auto refuse = [&](const std::string &what) {
    error->all(FLERR, "{}: {} pushes {} too, which enters neither stress nor steps: remove it", WHO, what,
               disks ? "disks" : "droplets");
  };
  if (utils::strmatch(force->pair_style, "^hybrid")) refuse(fmt::format("pair_style {}", force->pair_style));
  if (disks && force->bond) refuse(fmt::format("bond_style {}", force->bond_style));
  if (force->angle) refuse(fmt::format("angle_style {}", force->angle_style));
  if (force->dihedral) refuse(fmt::format("dihedral_style {}", force->dihedral_style));
  if (force->improper) refuse(fmt::format("improper_style {}", force->improper_style));
  if (force->kspace) refuse("kspace_style");
  for (int k = 0; k < modify->nfix; k++) {
    const Fix *const fix = modify->fix[k];
    const int mask = modify->fmask[k];
    if (fix == this || utils::strmatch(fix->style, "^polygon/") || utils::strmatch(fix->style, "^enforce2d")) continue;
    if (mask & (PRE_FORCE | POST_FORCE)) refuse(fmt::format("fix {} of style {}", fix->id, fix->style));
    const bool moves = fix->time_integrate || mask & (INITIAL_INTEGRATE | POST_INTEGRATE | FINAL_INTEGRATE);
    const bool exchanges = mask & PRE_EXCHANGE && !utils::strmatch(fix->style, "^balance");
    if (moves || exchanges || fix->box_change & ~Fix::BOX_CHANGE_DOMAIN)
      error->all(FLERR, "{}: fix {} of style {} {}, too, which enters neither work nor steps: unfix it", WHO, fix->id,
                 fix->style, moves ? "moves atoms" : exchanges ? "adds, removes or swaps atoms" : "changes the box");
  }
}

void FixOverdamped::make_solver()
{
  GhostExchange &exchange = *this;
  settings.fluid = fluid * area();
  auto *const style = dynamic_cast<PairDiskDrag *>(force->pair_match("disk/drag", 1));
  droplets = !style;
  if (droplets) {
    disks = nullptr;
    solver = std::make_unique<DropletDrag>(lmp, exchange, settings, droplet_law, *virial, *energy);
    return;
  }
  auto drag = std::make_unique<DiskDrag>(world, exchange, settings, *style, atom);
  drag->set_marginal_contacts(disks ? disks->marginal_contacts() : restored);    // of the run before
  disks = drag.get();
  drag->set_least_overlap(LAYER * sqrt(tolerance));
  solver = std::move(drag);
  length_unit = style->mean_diameter();
}

void FixOverdamped::check() const
{
  const auto *const disks = dynamic_cast<PairDiskDrag *>(force->pair_match("disk/drag", 1));
  if (!disks && !force->pair_match("circuloline", 1))
    error->all(FLERR, "{}: needs pair_style disk/drag, or circuloline for droplets, which know the contacts", WHO);
  if (disks && droplet_law_given)
    error->all(FLERR, "{}: drag is for droplets: that of disks stands in pair_style disk/drag", WHO);
  if (!disks && !droplet_law_given && settings.background == 0.0)
    error->all(FLERR, "{}: no drag at all: give drag tau beta alpha, or a background drag", WHO);
  if (walls && drive == STRESS) error->all(FLERR, "{}: walls need a rate or oscillate, not a stress", WHO);
  if (igroup != 0) error->all(FLERR, "{}: group must be all: the drag of every atom enters", WHO);
  if (domain->dimension != 2 || !domain->triclinic || !domain->xperiodic || !domain->yperiodic)
    error->all(FLERR, "{}: needs dimension 2 and a periodic triclinic box (change_box all triclinic)", WHO);
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "{}: works with run_style verlet only", WHO);
  if (atom->map_style == Atom::MAP_NONE) error->all(FLERR, "{}: needs an atom map: use atom_modify map array", WHO);
  if (comm->layout != Comm::LAYOUT_TILED && comm->procgrid[0] > 2)
    error->all(FLERR, "{}: {} ranks side by side along x: atoms may go to any of them when the box flips; use "
               "processors 1 * 1", WHO, comm->procgrid[0]);
  if (disks && disks->drag().tau == 0.0 && settings.background == 0.0)
    error->all(FLERR, "{}: no drag at all: tau = 0 of pair_style disk/drag needs a background drag", WHO);
  if (!disks && droplet_law.tau == 0.0 && settings.background == 0.0)
    error->all(FLERR, "{}: no drag at all: tau = 0 of drag needs a background drag", WHO);
}

/* stresses over the area of the box; the columns of the manual */
double FixOverdamped::compute_vector(int n)
{
  const double a = area();
  switch (n) {
    case 0: return state.time;
    case 1: return state.strain;
    case 2: return state.rate;
    case 3: return stress();
    case 4: return state.sums.elastic / a;
    case 5: return state.sums.viscous / a;
    case 6: return -0.5 * (state.sums.xx + state.sums.yy) / a;       // pressure
    case 7: return (state.sums.xx - state.sums.yy) / a;              // first normal stress difference
    case 8: return dissipation();
    case 9: return state.sums.energy / a;                      // elastic
    case 10: return state.work;                          // done since the start, per area
    case 11: return state.dissipated;
    case 12: return last_iterations;
    case 13: return update->dt;                          // of the next step
    case 14: return state.iterations;
    case 15: return state.sums.contacts;
    case 16: return state.unsettled;
    // shear stress and pressure on the lower wall and on the upper one
    case 17: return state.sums.walls[0] / domain->xprd;
    case 18: return -state.sums.walls[1] / domain->xprd;
    case 19: return -state.sums.walls[2] / domain->xprd;
    case 20: return state.sums.walls[3] / domain->xprd;
    default: return 0.0;
  }
}
