// SPDX-License-Identifier: GPL-2.0-or-later
// Contacts of a PairCirculoline, and their forces.
#include "pair_circuloline.h"

#include "comm.h"
#include "error.h"
#include "fix_polygon_outline.h"
#include "force.h"
#include "outline_checks.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;

static void add_virial(double *sum, double share, const double *xx_yy_xy)
{
  sum[0] += share * xx_yy_xy[0];
  sum[1] += share * xx_yy_xy[1];
  sum[3] += share * xx_yy_xy[2];
}

void PairCirculoline::compute(int eflag, int vflag)
{
  ev_init(eflag, vflag);
  renew_candidates();
  flat_walls.update();
  // LAMMPS clears what ghosts collect, and returns it, only if a newton flag is on
  const bool own = !force->newton || flat_walls.shared();
  if (own) ghosts.assign(atom->nlocal + atom->nghost + flat_walls.extra(), {});
  if (evflag)
    own ? apply_contacts<true, true>() : apply_contacts<false, true>();
  else
    own ? apply_contacts<true, false>() : apply_contacts<false, false>();
  if (own) return_from_ghosts();
}

/* Each contact pushes its vertex from its edge, or pulls it there. */
template <bool OWN, bool TALLY> void PairCirculoline::apply_contacts()
{
  const auto f = reinterpret_cast<Position *>(atom->nlocal ? atom->f[0] : nullptr);
  Returned *const returned = ghosts.data();
  const bool parts = vflag_either || eflag_atom || !eflag_global;    // more than the energy
  visit_contacts([=](const Contact &contact) {
    const ContactForce push = contact_force(contact);
    const jamlab::Vector of_head = push.f * contact.foot.t;
    const int atoms[3] = {contact.vertex, contact.tail, contact.head};
    const jamlab::Vector forces[3] = {push.f, of_head - push.f, of_head * -1.0};
    for (int k = 0; k < 3; k++) {
      double *const sum = OWN ? &returned[atoms[k]][FORCE] : f[atoms[k]];
      sum[0] += forces[k].x;
      sum[1] += forces[k].y;
    }
    if (TALLY && !parts)
      eng_vdwl += push.energy;
    else if (TALLY)
      tally(contact, push, OWN);
  });
}

template <class Act> void PairCirculoline::visit_contacts(Act act, double beyond)
{
  if (atom->nlocal == 0) return;
  pair_laws.set(laws, atom->ntypes, force->special_lj, beyond);
  const auto x = reinterpret_cast<const Position *>(atom->x[0]);
  for (int k = 0; k < NUMBER_OF_CONTACT_FORMS; k++) {
    if (!in_use[k]) continue;
    candidates[k].choose(beyond);
    for (const auto &block : candidates[k].blocks()) {
      candidates[k].measure(block);
      // one touch is written beyond the last
      const std::size_t room = candidates[k].most_contacts(block) + 1;
      if (found.size() < room) found.resize(room);
      const auto form = static_cast<ContactForm>(k);
      const std::size_t count = find_touches(form, candidates[k], block, pair_laws, found.data());
      for (std::size_t n = 0; n < count; n++) act(contact_of(found[n], candidates[k], block, x));
    }
  }
  for (const Contact &contact : own_contacts.find(x, pair_laws)) act(contact);
  for (const Contact &contact : flat_walls.find(x, pair_laws)) act(contact);
}

const std::vector<Contact> &PairCirculoline::find_contacts(double beyond)
{
  flat_walls.update();
  all_found.clear();
  visit_contacts([this](const Contact &contact) { all_found.push_back(contact); }, beyond);
  return all_found;
}

/* Half of the energy and virial belongs to the vertex, half to the edge, whose ends share it as
   they share the force. */
void PairCirculoline::tally(const Contact &contact, const ContactForce &push, bool own)
{
  const jamlab::Vector &r = contact.foot.r, &f = push.f;
  const double t = contact.foot.t, v[3] = {r.x * f.x, r.y * f.y, r.x * f.y};
  if (eflag_global) eng_vdwl += push.energy;
  if (vflag_global) add_virial(virial, 1.0, v);
  if (!eflag_atom && !vflag_atom) return;

  const int atoms[3] = {contact.vertex, contact.tail, contact.head};
  const double share[3] = {0.5, 0.5 * (1.0 - t), 0.5 * t};
  for (int k = 0; k < 3; k++) {
    const int i = atoms[k];
    if (own) {
      ghosts[i][ENERGY] += share[k] * push.energy;
      for (int d = 0; d < 3; d++) ghosts[i][VIRIAL + d] += share[k] * v[d];
      continue;
    }
    if (eflag_atom) eatom[i] += share[k] * push.energy;
    if (vflag_atom) add_virial(vatom[i], share[k], v);
  }
}

void PairCirculoline::return_from_ghosts()
{
  comm->reverse_comm(this);
  if (const int walls = flat_walls.extra()) {
    Returned *const sums = &ghosts[atom->nlocal + atom->nghost];
    MPI_Allreduce(MPI_IN_PLACE, sums->data(), walls * RETURNED, MPI_DOUBLE, MPI_SUM, world);
    for (int w = 0; w < walls; w++)
      if (flat_walls[w].rank == comm->me) ghosts[flat_walls[w].index] = sums[w];
  }
  for (int i = 0; i < atom->nlocal; i++) {
    const Returned &sum = ghosts[i];
    for (int d = 0; d < 2; d++) atom->f[i][d] += sum[FORCE + d];
    if (eflag_atom) eatom[i] += sum[ENERGY];
    if (vflag_atom) add_virial(vatom[i], 1.0, &sum[VIRIAL]);
  }
}

int PairCirculoline::pack_reverse_comm(int n, int first, double *buf)
{
  std::memcpy(buf, &ghosts[first], n * sizeof(Returned));
  return n * RETURNED;
}

void PairCirculoline::unpack_reverse_comm(int n, int *indices, double *buf)
{
  for (int k = 0; k < n; k++)
    for (double &sum : ghosts[indices[k]]) sum += *buf++;
}

PairCirculoline::End PairCirculoline::end(int i) const
{
  const int nall = atom->nlocal + atom->nghost;
  if (i < nall) return {atom->tag[i], atom->molecule[i], atom->mask[i]};
  const FlatWalls::Wall &wall = flat_walls[i - nall];
  return {wall.tag, wall.molecule, wall.mask};
}

void PairCirculoline::refuse_shared_walls() const
{
  if (flat_walls.shared())
    error->all(FLERR, "{}: types in flat reach all over the box: flows of droplets between them "
               "need one rank", WHO);
}

/* Crossing edges (d = 0) have no direction and no force. */
PairCirculoline::ContactForce PairCirculoline::contact_force(const Contact &contact) const
{
  const PairLaw &law = pair_laws[contact.law];
  const jamlab::Foot &foot = contact.foot;
  const double d = sqrt(foot.rsq);
  const PairLaw::Push push = law.push(d);
  const double magnitude = d > 0.0 ? push.force : 0.0;
  const double per_d = d > 0.0 ? magnitude / d : 0.0;
  return {d - law.width, push.energy, magnitude, foot.r * per_d};
}

/* Computes may ask for contacts at any point of a step. Ghosts lag behind where fix deform or a
   flow has moved atoms since the forces. Candidates are local and ghost indices, which neighbor
   lists and commands change. */
const std::vector<Contact> &PairCirculoline::present_contacts()
{
  const int nall = atom->nlocal + atom->nghost;
  const auto lists = FixPolygonOutline::shared(lmp, WHO)->lists();
  if ((lists == candidates_for || lists.first == 0) &&
      (static_cast<int>(tags.size()) != nall || !std::equal(tags.begin(), tags.end(), atom->tag)))
    error->one(FLERR, "{}: atoms have changed since the last run: use run 0 first", WHO);
  comm->forward_comm();
  renew_candidates();
  return find_contacts();
}

void PairCirculoline::renew_candidates()
{
  outline = FixPolygonOutline::shared(lmp, WHO);    // users may unfix it
  if (candidates_for == outline->lists()) return;
  find_candidates();
  candidates_for = outline->lists();
  tags.assign(atom->tag, atom->tag + atom->nlocal + atom->nghost);
}

void PairCirculoline::find_candidates()
{
  outline->refresh();
  check_outlines(lmp, WHO, *outline, list, laws);
  check_special_bonds(lmp, WHO, laws);
  for (int k = 0; k < NUMBER_OF_CONTACT_FORMS; k++)
    if (in_use[k]) candidates[k].build(outline, list, laws, static_cast<ContactForm>(k));
  laws.steps = laws.steps_of_range();
  own_contacts.build(WHO, *outline, list, laws);
  flat_walls.build(list, laws);
}
