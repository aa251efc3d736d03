// SPDX-License-Identifier: GPL-2.0-or-later
#include "fix_overdamped.h"

#include "comm.h"
#include "disk_flow.h"
#include "droplet_flow.h"
#include "error.h"
#include "force.h"
#include "image_offset.h"
#include "memory.h"
#include "modify.h"
#include "pair_disk_drag.h"
#include "restart_values.h"
#include "timer.h"
#include "update.h"
#include "utils.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

using namespace LAMMPS_NS;
using namespace FixConst;

static constexpr double LEAN = 0.55;    // tilt over width where the box flips, and not back at once
static constexpr double LAYOUT = -29.0;    // of a restart file; up to 0.2.0 there is a time
static constexpr int HEAD = 3;    // layout, numbers of an atom, bytes of the flow

FixOverdamped::FixOverdamped(LAMMPS *lmp, int narg, char **arg) :
    Fix(lmp, narg, arg), user_time_step(update->dt)
{
  const FlowSettings settings(lmp, narg, arg);
  GhostExchange &exchange = *this;
  if (force->pair_match("disk/drag", 1))
    flow = std::make_unique<DiskFlow>(lmp, settings, exchange);
  else if (force->pair_match("circuloline", 1))
    flow = std::make_unique<DropletFlow>(lmp, settings, exchange);
  else
    error->all(FLERR, "{}: needs pair_style disk/drag, or circuloline for droplets, which know the "
               "contacts, before the fix", WHO);

  time_integrate = time_depend = no_change_box = 1;
  box_change |= BOX_CHANGE_XY;
  force_reneighbor = 1;
  next_reneighbor = -1;
  vector_flag = global_freq = 1;
  size_vector = OverdampedFlow::COLUMNS;
  extvector = 0;
  peratom_flag = peratom_freq = 1;
  size_peratom_cols = 3;
  restart_global = restart_peratom = restart_pbc = 1;
  comm_forward = comm_reverse = 3;
  fields = flow->fields();
  maxexchange = 3 * static_cast<int>(fields.size());

  FixOverdamped::grow_arrays(atom->nmax);
  atom->add_callback(Atom::GROW);
  atom->add_callback(Atom::RESTART);
}

FixOverdamped::~FixOverdamped()
{
  atom->delete_callback(id, Atom::GROW);
  atom->delete_callback(id, Atom::RESTART);
  memory->destroy(array_atom);
  if (update) flow->set_time_step(user_time_step);
}

int FixOverdamped::setmask()
{
  return INITIAL_INTEGRATE | PRE_EXCHANGE | PRE_FORCE | FINAL_INTEGRATE | POST_RUN;
}

void FixOverdamped::init()
{
  check();
  const std::vector<Fix *> pushes = check_forces();
  if (update->whichflag == 2) flow->set_time_step(user_time_step);    // of a minimisation
  flow->init(pushes);
}

void FixOverdamped::check() const
{
  if (igroup != 0)
    error->all(FLERR, "{}: group must be all: the drag of every atom enters", WHO);
  if (domain->dimension != 2 || !domain->triclinic || !domain->xperiodic || !domain->yperiodic)
    error->all(FLERR, "{}: needs dimension 2 and a periodic triclinic box (change_box all "
               "triclinic)", WHO);
  if (utils::strmatch(update->integrate_style, "^respa"))
    error->all(FLERR, "{}: works with run_style verlet only", WHO);
  if (atom->map_style == Atom::MAP_NONE)
    error->all(FLERR, "{}: needs an atom map: use atom_modify map array", WHO);
  if (comm->layout != Comm::LAYOUT_TILED && comm->procgrid[0] > 2)
    error->all(FLERR, "{}: {} ranks side by side along x: atoms may go to any of them when the box "
               "flips; use processors 1 * 1", WHO, comm->procgrid[0]);
}

/* Forces other than contact forces and constant ones would move particles without being in any
   stress, energy or step: drag and stiffness are known of the forces of the model alone. So would
   fixes that move them or the box. Returns fixes that add constant forces. */
std::vector<Fix *> FixOverdamped::check_forces() const
{
  const auto refuse = [&](const std::string &what) {
    error->all(FLERR, "{}: {} pushes particles too, which enters neither stress nor steps: remove "
               "it", WHO, what);
  };
  if (utils::strmatch(force->pair_style, "^hybrid")) {
    const auto *const disks = dynamic_cast<PairDiskDrag *>(force->pair_match("disk/drag", 1));
    if (!disks || disks->is_elastic() || !utils::strmatch(force->pair_style, "^hybrid/overlay$"))
      refuse(fmt::format("pair_style {}", force->pair_style));
    if (!force->pair->single_enable)
      error->all(FLERR, "{}: pair_style {}: not all of its styles say the force of two disks alone "
                 "(Pair::single)", WHO, force->pair_style);
  }
  if (force->angle) refuse(fmt::format("angle_style {}", force->angle_style));
  if (force->dihedral) refuse(fmt::format("dihedral_style {}", force->dihedral_style));
  if (force->improper) refuse(fmt::format("improper_style {}", force->improper_style));
  if (force->kspace) refuse("kspace_style");
  std::vector<Fix *> pushes;
  bool later = false;
  for (int k = 0; k < modify->nfix; k++) {
    Fix *const fix = modify->fix[k];
    const int mask = modify->fmask[k];
    const char *const style = fix->style;
    const bool pushes_all = BodyForces::accepts(fix);
    later = later || fix == this;
    if (later && (pushes_all || utils::strmatch(style, "^polygon/")))
      error->all(FLERR, "{}: fix {} of style {} comes later, so the first step would miss its "
                 "forces: define it before", WHO, fix->id, style);
    if (pushes_all) pushes.push_back(fix);
    const bool plane = utils::strmatch(style, "^enforce2d");
    if (fix == this || pushes_all || plane || utils::strmatch(style, "^polygon/")) continue;
    const bool no_threads = !strcmp(style, "OMP") && !force->pair_match("/omp$", 0, 1);
    if (no_threads) continue;
    if (mask & (PRE_FORCE | POST_FORCE)) refuse(fmt::format("fix {} of style {}", fix->id, style));
    const int integrates = mask & (INITIAL_INTEGRATE | POST_INTEGRATE | FINAL_INTEGRATE);
    const char *const changes = fix->time_integrate || integrates ? "moves atoms"
        : mask & PRE_EXCHANGE && !utils::strmatch(style, "^balance")
        ? "adds, removes or swaps atoms"
        : fix->box_change & ~Fix::BOX_CHANGE_DOMAIN ? "changes the box" : nullptr;
    if (changes)
      error->all(FLERR, "{}: fix {} of style {} {}, too, which enters neither work nor steps: "
                 "unfix it", WHO, fix->id, style, changes);
  }
  return pushes;
}

void FixOverdamped::setup(int /*vflag*/)
{
  if (last_timestep >= 0 && last_timestep != update->ntimestep) flow->forget_velocities();
  for (int i = 0; i < atom->nlocal; i++) std::fill_n(atom->v[i], 3, 0.0);    // no inertia
  flow->begin_interval();
  flow->check_held();
  flow->setup();
  show_velocities();
}

void FixOverdamped::initial_integrate(int /*vflag*/)
{
  flow->begin_step();
  if (fabs(domain->xy) > LEAN * domain->xprd) flip = domain->xy > 0.0 ? -1 : 1;
  if (flip || flow->outran_neighbors()) next_reneighbor = update->ntimestep;
}

void FixOverdamped::final_integrate()
{
  flow->end_step();
  show_velocities();
  if (!flow->begin_interval()) return;
  stopped = true;
  timer->force_timeout();
}

void FixOverdamped::show_velocities()
{
  const Field &u = flow->velocities();
  for (int i = 0; i < atom->nlocal; i++) {
    std::copy_n(&u[i].x, 2, array_atom[i]);
    array_atom[i][2] = u[i].spin / flow->spin_length();
  }
}

void FixOverdamped::post_run()
{
  if (update->whichflag == 1) last_timestep = update->ntimestep;    // of a run alone
  if (stopped) timer->reset_timeout();
  stopped = false;
}

/* Image flags begin anew after IMGMAX boxes. Half way there, whole particles go back to the box. */
void FixOverdamped::move_back()
{
  const tagint *const particle = flow->particles();
  tagint most[2] = {0, 0};    // boxes, particles
  for (int i = 0; i < atom->nlocal; i++) {
    const ImageOffset own(atom->image[i]);
    most[0] = std::max<tagint>(most[0], std::max(std::abs(own.a), std::abs(own.b)));
    most[1] = std::max(most[1], particle[i]);
  }
  MPI_Allreduce(MPI_IN_PLACE, most, 2, MPI_LMP_TAGINT, MPI_MAX, world);
  if (most[0] < IMGMAX / 2) return;
  std::vector<std::array<int, 2>> least(most[1] + 1, {IMGMAX, IMGMAX});
  for (int i = 0; i < atom->nlocal; i++) {
    auto &[x, y] = least[particle[i]];
    const ImageOffset own(atom->image[i]);
    x = std::min(x, own.a);
    y = std::min(y, own.b);
  }
  const int numbers = static_cast<int>(2 * least.size());
  MPI_Allreduce(MPI_IN_PLACE, least.data(), numbers, MPI_INT, MPI_MIN, world);
  for (int i = 0; i < atom->nlocal; i++) {
    const imageint x = least[particle[i]][0], y = least[particle[i]][1];
    atom->image[i] -= x + y * (static_cast<imageint>(1) << IMGBITS);
  }
}

/* A flipped box is of the same lattice, with another vector along y. */
void FixOverdamped::pre_exchange()
{
  move_back();
  if (!flip) return;
  domain->xy += flip * domain->xprd;
  domain->set_global_box();
  domain->set_local_box();
  domain->image_flip(flip, 0, 0);
  for (int i = 0; i < atom->nlocal; i++) domain->remap(atom->x[i], atom->image[i]);
  flip = 0;
}

void FixOverdamped::write_restart(FILE *fp)
{
  if (comm->me != 0) return;
  RestartBytes kept, record;
  flow->keep(kept);
  double head[HEAD] = {LAYOUT, static_cast<double>(maxexchange),
                       static_cast<double>(kept.written().size())};
  for (double &each : head) record(each);
  write_value(fp, record.written() + kept.written());
}

void FixOverdamped::restart(char *buf)
{
  double head[HEAD] = {};
  RestartBytes layout(buf, sizeof(double)), record(buf, sizeof(head));
  layout(head[0]);    // earlier records may have nothing else
  if (head[0] == LAYOUT)
    for (double &each : head) record(each);
  if (head[0] != LAYOUT || head[1] != maxexchange)
    error->all(FLERR, "{}: the restart file was written by another version of this plugin, which "
               "can end the flow, or for other particles; or start a flow anew from a data file of "
               "its state", WHO);
  RestartBytes kept(buf + sizeof(head), static_cast<std::size_t>(std::max(0.0, head[2])));
  flow->keep(kept);
  if (!kept.complete())
    error->all(FLERR, "{}: the restart file holds {} bytes of the flow, which are not those of its "
               "numbers: it is damaged; start a flow anew from a data file of its state", WHO,
               head[2]);
}

void FixOverdamped::send_to_ghosts(Field &motions)
{
  traveling = &motions;
  comm->forward_comm(this, 3);
}

void FixOverdamped::add_from_ghosts(Field &motions)
{
  if (flow->owners_count_twice()) return;
  traveling = &motions;
  comm->reverse_comm(this, 3);
}

int FixOverdamped::pack_forward_comm(int n, int *indices, double *buf, int, int *)
{
  for (int k = 0; k < n; k++) std::copy_n(&(*traveling)[indices[k]].x, 3, buf + 3 * k);
  return 3 * n;
}

void FixOverdamped::unpack_forward_comm(int n, int first, double *buf)
{
  if (n) std::copy_n(buf, 3 * n, &(*traveling)[first].x);
}

int FixOverdamped::pack_reverse_comm(int n, int first, double *buf)
{
  if (n) std::copy_n(&(*traveling)[first].x, 3 * n, buf);
  return 3 * n;
}

void FixOverdamped::unpack_reverse_comm(int n, int *indices, double *buf)
{
  for (int k = 0; k < n; k++, buf += 3) {
    Vec3 &sum = (*traveling)[indices[k]];
    sum = sum + Vec3{buf[0], buf[1], buf[2]};
  }
}

void FixOverdamped::grow_arrays(int nmax)
{
  for (Field *each : fields) each->resize(nmax);
  memory->grow(array_atom, nmax, 3, "overdamped:array_atom");
}

void FixOverdamped::copy_arrays(int i, int j, int /*delflag*/)
{
  for (Field *each : fields) (*each)[j] = (*each)[i];
  std::copy_n(array_atom[i], 3, array_atom[j]);
}

void FixOverdamped::set_arrays(int i)
{
  for (Field *each : fields) (*each)[i] = Vec3();
  std::fill_n(array_atom[i], 3, 0.0);
}

int FixOverdamped::pack_exchange(int i, double *buf)
{
  for (const Field *each : fields) buf = std::copy_n(&(*each)[i].x, 3, buf);
  return maxexchange;
}

int FixOverdamped::unpack_exchange(int i, double *buf)
{
  for (Field *each : fields) {
    std::copy_n(buf, 3, &(*each)[i].x);
    buf += 3;
  }
  return maxexchange;
}

int FixOverdamped::pack_restart(int i, double *buf)
{
  buf[0] = maxexchange + 1;
  pack_exchange(i, buf + 1);
  return maxexchange + 1;
}

void FixOverdamped::unpack_restart(int i, int nth)
{
  double *extra = atom->extra[i];
  int m = 0;
  for (int k = 0; k < nth; k++) m += static_cast<int>(extra[m]);
  unpack_exchange(i, extra + m + 1);
}
