// SPDX-License-Identifier: GPL-2.0-or-later
#include "disk_drag.h"

#include "pair_disk_drag.h"

using namespace LAMMPS_NS;

// Added to blocks of disks, which few contacts leave singular, over their trace: slows convergence only
static constexpr double BLOCK_SHIFT = 1e-3;
static constexpr double ROUNDING = 4e-16;
static constexpr int PEELS = 20;    // chains of loose disks are shorter
// Conjugate gradients are slow without factors from SLOW times sqrt(N) iterations on, as the cost of
// factors over that of an iteration grows; with them, from GROWN times as many as they first took
static constexpr double SLOW = 5.0;
static constexpr int GROWN = 2, FEW = 8;
// Drag over the background that motions without any get, such as gears that turn each other
static constexpr double SHIFT = 1e-3;

DiskDrag::DiskDrag(MPI_Comm world, GhostExchange &exchange, const Settings &settings, const PairDiskDrag &pair,
                   Atom *atom) :
    DragSystem(world, exchange, settings, pair.drag()), pair(pair), atom(atom),
    slow(SLOW * sqrt(static_cast<double>(atom->natoms)))
{
}

const std::vector<DiskPair> &DiskDrag::near() const
{
  return pair.pairs();
}

/* states by the gaps, but of marginal pairs */
void DiskDrag::update_contacts(int local, int ghost, double /*ahead*/)
{
  make_room(local, ghost);
  rows_are_own = pair.owns_all();
  for (auto &each : blocks) each.resize(local + ghost);
  rest.assign(local + ghost, Vec3());
  background.assign(local, settings.background);
  states.resize(near().size());
  double overlaps[2] = {0.0, 0.0};    // sum and number
  for (std::size_t k = 0; k < states.size(); k++) {
    const DiskPair &p = near()[k];
    states[k] = p.x * p.x + p.y * p.y < p.reach * p.reach ? CLOSED : OPEN;
    if (states[k] == OPEN) continue;
    overlaps[0] += p.share * (p.reach - hypot(p.x, p.y));
    overlaps[1] += p.share;
  }
  MPI_Allreduce(MPI_IN_PLACE, overlaps, 2, MPI_DOUBLE, MPI_SUM, world);
  least_overlap = overlaps[1] > 0.0 ? thinnest * overlaps[0] / overlaps[1] : 0.0;
  find_pairs();
  find_contacts();
}

void DiskDrag::contact_of(const DiskPair &p, double x, double y, DiskRow &row, Contact &contact) const
{
  if (p.flat()) x = 0.0;
  const double r = hypot(x, y);
  const Repulsion push = pair.repulsion(p.strength, p.reach - r);
  const double back = law.arms_to_contact ? 0.5 * push.overlap : 0.0;
  const double stiffness = pair.repulsion(p.strength, std::max(p.reach - r, least_overlap)).stiffness;
  row = {p.i, p.j, x / r, y / r, p.radius_i - back, p.radius_j - back};
  contact = {r, stiffness, push.force, push.energy, p.share, 1.0, 0.0};
}

void DiskDrag::find_contacts()
{
  rubbing = 0;
  for (std::size_t e = 0; e < marginal.size(); e++) {
    if (marginal[e].state == RUBBING) rubbing++;
    for (const int k : pairs_of[e]) states[k] = marginal[e].state;
  }
  pair_of.clear();
  for (std::size_t k = 0; k < states.size(); k++)
    if (states[k] != OPEN) pair_of.push_back(static_cast<int>(k));
  rows_of.assign(marginal.size(), {});
  for (std::size_t e = 0; e < marginal.size(); e++)
    for (const int k : pairs_of[e])
      if (marginal[e].state == RUBBING)
        rows_of[e].push_back(static_cast<int>(std::lower_bound(pair_of.begin(), pair_of.end(), k) - pair_of.begin()));
  displace(rest, 0.0);
}

/* the gap of a rubbing pair is zero but for rounding, which would move a loose disk */
void DiskDrag::displace(const Field &moved, double strain)
{
  answers.clear();
  rows.resize(pair_of.size());
  contacts.resize(pair_of.size());
  for (std::size_t k = 0; k < pair_of.size(); k++) {
    const DiskPair &p = near()[pair_of[k]];
    const double y = p.y + moved[p.j].y - moved[p.i].y, x = p.x + moved[p.j].x - moved[p.i].x + strain * y;
    contact_of(p, x, y, rows[k], contacts[k]);
    if (rows_are_own) rows[k].j = pair.owner(p.j);
  }
  for (std::size_t e = 0; e < marginal.size(); e++)
    for (const int k : rows_of[e]) {
      contacts[k].force = contacts[k].energy = 0.0;
      contacts[k].part = marginal[e].base;
    }
}

void DiskDrag::elastic_forces(Field &force) const
{
  force.assign(nlocal + nghost, Vec3());
  for (std::size_t k = 0; k < rows.size(); k++)
    add_forces(rows[k], force_of(rows[k], contacts[k].force, 0.0), force.data());
  for (std::size_t e = 0; e < marginal.size(); e++)
    add_pair_forces(e, 0.0, marginal[e].held, force);
  exchange.add_from_ghosts(force);
}

double DiskDrag::contact_speed(const DiskPair &p, const Field &u, double rate) const
{
  DiskRow row;
  Contact contact;
  contact_of(p, p.x, p.y, row, contact);
  const Slip s = slip_of(row, passing(row, u.data(), rate * row.ny * contact.distance));
  return law.tau > 0.0 ? sqrt(s.approach * s.approach + law.beta * s.slide * s.slide) : fabs(s.approach);
}

void DiskDrag::find_weights(const Field &u, double rate)
{
  if (!is_linear()) answers.clear();
  DragSystem::find_weights(u, rate);
}

/* the weight goes as its square, floor included, to the power (alpha - 1) / 2 */
bool DiskDrag::find_slopes(const Field &u, double rate)
{
  bends.resize(rows.size());
  for (std::size_t k = 0; k < rows.size(); k++) {
    const Slip s = slip(k, u, rate);
    const double whole = contacts[k].part * contacts[k].stiffness * law.tau;
    const double square = pow(weights[k] / whole, 2.0 / (law.alpha - 1.0));
    const double bend = law.tau * sqrt((1.0 - law.alpha) * weights[k] / square);
    bends[k] = whole > 0.0 ? Slip{bend * s.approach, bend * law.beta * s.slide} : Slip{0.0, 0.0};
  }
  return true;
}

/* the block of each disk in B, inverted; and c */
void DiskDrag::find_preconditioner(bool free_rate)
{
  for (auto &each : blocks) std::fill(each.begin(), each.end(), Vec3());
  double flow[2] = {0.0, 0.0};    // c, and the stiffness of the affine flow
  std::vector<Part> parts;
  for (std::size_t k = 0; k < rows.size(); k++) {
    find_parts(k, parts);
    Block own = {};
    for (const Part &part : parts) {    // xx xy yy, xs ys ss: two exchanges of three numbers
      own = block(k, part, part);
      const double whole = 1.0 / contacts[k].share;    // seen by two ranks: each adds its own disk's
      Vec3 &f = blocks[0][part.site], &s = blocks[1][part.site];
      f = f + whole * Vec3{own[0], own[1], own[4]};
      s = s + whole * Vec3{own[2], own[5], own[8]};
    }
    const double squared = lever(k) * lever(k);
    flow[0] += squared * own[0];
    flow[1] += contacts[k].share * squared * contacts[k].stiffness * rows[k].nx * rows[k].nx;
  }
  for (auto &each : blocks) exchange.add_from_ghosts(each);
  for (int i = 0; i < nlocal; i++) {
    const Vec3 &first = blocks[0][i], &second = blocks[1][i];
    const double shift = BLOCK_SHIFT * (first.x + first.spin) + settings.background;
    const double a = first.x + shift, b = first.y, d = first.spin + shift;
    const double e = second.x, f = second.y, g = second.spin + shift;
    const double det = a * (d * g - f * f) - b * (b * g - e * f) + e * (b * f - d * e);
    inverse[i] = {};
    if (!(det > 0.0)) continue;
    inverse[i] = {(d * g - f * f) / det, (e * f - b * g) / det, (a * g - e * e) / det,
                  (b * f - d * e) / det, (b * e - a * f) / det, (a * d - b * b) / det};
  }
  MPI_Allreduce(MPI_IN_PLACE, flow, 2, MPI_DOUBLE, MPI_SUM, world);
  affine_drag = flow[0];
  flow[0] += settings.fluid;
  inverse_flow = free_rate && flow[0] > 0.0 ? 1.0 / flow[0] : 0.0;
  flow_relaxation = free_rate && flow[1] > 0.0 ? flow[0] / flow[1] : HUGE_VAL;
  choose_factors();
}

/* without background drag, factors would amplify what rounding leaves */
void DiskDrag::choose_factors()
{
  if (settings.background == 0.0) return;
  int anew = moved_between_ranks;
  MPI_Allreduce(MPI_IN_PLACE, &anew, 1, MPI_INT, MPI_MAX, world);
  if (anew) {
    factored = moved_between_ranks = false;
    factors.forget_order();
  }
  if (!factored) {
    if (last_iterations > slow) factorise();
    return;
  }
  if (law.alpha != 1.0) return factorise();    // others judge a step of Newton's by a wrong norm
  if (++age == 1) fresh_iterations = last_iterations;
  if (last_iterations > std::max(FEW, GROWN * fresh_iterations)) factorise();
}

/* before answers to forces on several pairs, with one matrix and no velocities to start from */
void DiskDrag::factorise_for_answers()
{
  if (settings.background == 0.0 || (factored && age == 0)) return;
  if (factored || answer_iterations > slow) factorise();
}

/* blocks on the diagonal are of all contacts; between disks, of those with both ends on this rank */
void DiskDrag::factorise()
{
  BlockAssembly<3> matrix(atom, given);
  assemble_rows(matrix, false);
  for (int i = 0; i < nlocal; i++) {
    const Vec3 &f = blocks[0][i], &s = blocks[1][i];
    const double x = f.x + settings.background, y = f.spin + settings.background;
    matrix.add(i, i, {x, f.y, s.x, f.y, y, s.y, s.x, s.y, s.spin});
  }
  matrix.fill(factors);
  int all = factors.factorise(SHIFT * settings.background);
  MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MIN, world);
  factored = all;
  age = 0;
}

/* energy of the error that rounding of the contact forces leaves, F B^-1 F at most */
double DiskDrag::rounding() const
{
  double total = 0.0;
  for (std::size_t k = 0; k < contacts.size(); k++)
    total += contacts[k].share * contacts[k].force * contacts[k].force / (weights[k] + settings.background);
  return ROUNDING * ROUNDING * sum(total);
}

/* A disk with too few contacts to hold it keeps no velocity from the last step: nothing would ever
   take away the part that costs no drag. Its neighbours may be loose without it. If the contacts
   that remain are too few to hold the disks that remain, none keeps its velocity. */
void DiskDrag::zero_rattler_velocities(Field &u)
{
  const double least = law.beta > 0.0 ? 2.0 : 3.0, isostatic = law.beta > 0.0 ? 3.0 : 4.0;
  Field &kept = blocks[0], &count = blocks[1];
  for (auto &one : kept) one.x = 1.0;
  for (int round = 0; round < PEELS; round++) {
    std::fill(count.begin(), count.end(), Vec3());
    for (const DiskRow &row : rows) {
      if (kept[row.i].x == 0.0 || kept[row.j].x == 0.0) continue;
      count[row.i].x += 1.0;
      count[row.j].x += 1.0;
    }
    exchange.add_from_ghosts(count);
    double totals[3] = {0.0, 0.0, 0.0};    // disks that come loose, that are held; contacts' ends
    for (int i = 0; i < nlocal; i++) {
      if (kept[i].x == 0.0) continue;
      if (count[i].x < least) {
        kept[i].x = 0.0;
        u[i] = Vec3();
        totals[0] += 1.0;
      }
      totals[1] += 1.0;
      totals[2] += count[i].x;
    }
    MPI_Allreduce(MPI_IN_PLACE, totals, 3, MPI_DOUBLE, MPI_SUM, world);
    if (totals[0] == 0.0) {
      if (totals[2] < isostatic * totals[1]) std::fill_n(u.begin(), nlocal, Vec3());
      return;
    }
    exchange.send_to_ghosts(kept);
  }
}

/* with that of the forces held */
double DiskDrag::elastic_moment() const
{
  double elastic = 0.0;
  for (std::size_t k = 0; k < rows.size(); k++)
    elastic -= contacts[k].share * contacts[k].force * rows[k].nx * lever(k);
  Field unused(nlocal + nghost);
  for (std::size_t e = 0; e < marginal.size(); e++) elastic -= add_pair_forces(e, 0.0, marginal[e].held, unused);
  return sum(elastic);
}

FlowSums DiskDrag::add_up(const Field &u, double rate)
{
  for (std::size_t e = 0; e < marginal.size(); e++)
    for (const int k : rows_of[e]) contacts[k].held = marginal[e].held;
  FlowSums sums;
  add_row_sums(u, rate, sums);
  add_background_sums(u, sums);
  MPI_Allreduce(MPI_IN_PLACE, &sums, sizeof(FlowSums) / sizeof(double), MPI_DOUBLE, MPI_SUM, world);
  return sums;
}

/* time in which a contact relaxes: drag over stiffness. The background slows it at least by the
   share of a disk with twelve half contacts. A thin fluid lets the whole box relax as fast. */
double DiskDrag::least_relaxation_time() const
{
  double least = HUGE_VAL;
  for (std::size_t k = 0; k < contacts.size(); k++)
    if (contacts[k].stiffness > 0.0)    // rounds to 0 where disks that stiffen barely touch
      least = std::min(least, (weights[k] + settings.background / 12.0) / contacts[k].stiffness);
  return law.alpha * std::min(least, flow_relaxation);
}
