// SPDX-License-Identifier: GPL-2.0-or-later
#include "disk_drag.h"

#include "pair_disk_drag.h"

using namespace LAMMPS_NS;

// Added to blocks, which few contacts leave singular, over their trace: it slows convergence only
static constexpr double BLOCK_SHIFT = 1e-3;
static constexpr double ROUNDING = 4e-16;
static constexpr int PEELS = 20;    // chains of loose disks are shorter
// Iterations over sqrt(N) from which factors pay, since their cost over that of an iteration grows
static constexpr double SLOW = 5.0;
// Drag over the background that motions without any get, such as gears that turn each other
static constexpr double SHIFT = 1e-3;
static constexpr double LOOK = 0.125;         // part of a step
static constexpr double ACCURATE = 1e-12;    // part of a step, of the time of a change

DiskDrag::DiskDrag(MPI_Comm world, GhostExchange &exchange, const Settings &settings,
                   PairDiskDrag &pair, Atom *atom) :
    DragSystem(world, exchange, settings, pair.drag()), pair(pair), atom(atom),
    length(pair.unit_length()), slow(SLOW * sqrt(static_cast<double>(atom->natoms)))
{
}

/* The gap of a pair tells its state, unless the pair is marginal. */
void DiskDrag::update_contacts(int local, int ghost, double /*ahead*/)
{
  make_room(local, ghost);
  rows_are_own = pair.owns_all();
  rest.assign(local + ghost, Vec3());
  background.assign(local, settings.background);
  states.resize(pair.pairs().size());
  double overlaps[2] = {0.0, 0.0};    // sum and number
  for (std::size_t k = 0; k < states.size(); k++) {
    const DiskPair &p = pair.pairs()[k];
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

void DiskDrag::contact_of(const DiskPair &p, double x, double y, DiskRow &row,
                          Contact &contact) const
{
  if (p.flat()) x = 0.0;
  const double r = hypot(x, y);
  const Repulsion push = pair.push(p, p.reach - r);
  const double back = law.arms == DragLaw::CONTACT ? 0.5 * push.overlap : 0.0;
  const double lever = law.arms == DragLaw::NONE ? 0.0 : 1.0 / length;
  const double stiffness =
      p.reach - r < least_overlap ? pair.push(p, least_overlap).stiffness : push.stiffness;
  row = {p.i, p.j, x / r, y / r, lever * (p.radius_i - back), lever * (p.radius_j - back)};
  contact = {r, stiffness, law.stiffness(stiffness), push.force, push.energy, p.share, 1.0, 0.0};
}

void DiskDrag::find_contacts()
{
  for (std::size_t e = 0; e < marginal.size(); e++)
    for (const int k : pairs_of[e]) states[k] = marginal[e].state;
  pair_of.clear();
  for (std::size_t k = 0; k < states.size(); k++)
    if (states[k] != OPEN) pair_of.push_back(static_cast<int>(k));
  rows_of.assign(marginal.size(), {});
  rubbing = 0;
  for (std::size_t e = 0; e < marginal.size(); e++) {
    if (marginal[e].state != RUBBING) continue;
    rubbing++;
    for (const int k : pairs_of[e]) {
      const auto row = std::lower_bound(pair_of.begin(), pair_of.end(), k);
      rows_of[e].push_back(static_cast<int>(row - pair_of.begin()));
    }
  }
  displace(rest, 0.0);
}

/* Rubbing pairs do not push: their gap is zero but for rounding, which would move a loose disk. */
void DiskDrag::displace(const Field &moved, double strain)
{
  answers.clear();
  rows.resize(pair_of.size());
  contacts.resize(pair_of.size());
  for (std::size_t k = 0; k < pair_of.size(); k++) {
    const DiskPair &p = pair.pairs()[pair_of[k]];
    const double y = p.y + moved[p.j].y - moved[p.i].y;
    const double x = p.x + moved[p.j].x - moved[p.i].x + strain * y;
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
  const double affine = rate * row.ny * contact.distance;
  const Slip s = slip_of(row, relative_velocity(row, u.data(), affine));
  return law.tau > 0.0 ? speed_of(s) : fabs(s.approach);
}

void DiskDrag::find_changes(const Field &u, double rate, double time, const Displacement &moved,
                            std::vector<Change> &found) const
{
  for (std::size_t k = 0; k < states.size(); k++) {
    if (states[k] == RUBBING) continue;
    const DiskPair &p = pair.pairs()[k];
    const double sign = states[k] == CLOSED ? 1.0 : -1.0;
    const auto misfits = [&](double t) {
      double x, y, strain;
      moved(p, t, x, y, strain);
      const double r = hypot(p.flat() ? 0.0 : p.x + x + strain * (p.y + y), p.y + y);
      return sign * (r - p.reach) > 0.0;
    };
    if (!misfits(time)) continue;
    double low = 0.0, high = time;
    if (misfits(0.0)) {    // decided against its gap, which is zero but for rounding
      while (low < time && misfits(low)) low += LOOK * time;
      if (!(low < time)) continue;
    }
    for (int n = 0; n < 60 && high - low > ACCURATE * time; n++) {
      const double middle = 0.5 * (low + high);
      (misfits(middle) ? high : low) = middle;
    }
    found.push_back({atom->tag[p.i], atom->tag[p.j], states[k] == CLOSED ? OPEN : CLOSED, high,
                     contact_speed(p, u, rate),
                     law.tau > 0.0 ? 0.0 : pair.edge_stiffness(p) / settings.background});
  }
}

void DiskDrag::find_weights(const Field &u, double rate)
{
  if (!law.is_linear()) answers.clear();
  DragSystem::find_weights(u, rate);
}

/* The weight goes as its square, floor included, to the power (alpha - 1) / 2. */
bool DiskDrag::find_tangent(const Field &u, double rate)
{
  corrections.resize(rows.size());
  for (std::size_t k = 0; k < rows.size(); k++) {
    const Slip s = slip(k, u, rate);
    const double whole = contacts[k].part * contacts[k].drag * law.tau;
    const double square = pow(weights[k] / whole, 2.0 / (law.alpha - 1.0));
    const double g = law.tau * sqrt((1.0 - law.alpha) * weights[k] / square);
    corrections[k] = {0.0, 0.0};
    if (whole > 0.0) corrections[k] = {g * s.approach, g * law.beta * s.slide};
  }
  return true;
}

/* Finds the block of each disk in B, inverted, and c. */
void DiskDrag::find_preconditioner(bool free_rate)
{
  blocks.assign(nlocal + nghost, {});
  double flow[2] = {0.0, 0.0};    // c, and the stiffness of the affine flow
  for (std::size_t k = 0; k < rows.size(); k++) {
    const DiskRow &row = rows[k];
    const Correction g = correction(k);
    SymmetricBlock own;
    for (int a = 0; a < DiskRow::SITES; a++) {
      const double c = row.coefficient(a);
      const Vec3 approach = {c * row.nx, c * row.ny, 0.0};
      const Vec3 slide = {-c * row.ny, c * row.nx, -row.arm(a)};
      own = {};
      own.add(weights[k], approach);
      own.add(law.beta * weights[k], slide);
      own.add(-1.0, g.approach * approach + g.slide * slide);
      blocks[row.site(a)] += own;
    }
    const double along = carried.empty()
        ? lever(k) : relative_velocity(row, carried.data(), lever(k)).xy[0];
    const double squared = contacts[k].share * along * along;
    flow[0] += squared * own.xx;
    flow[1] += squared * contacts[k].stiffness * row.nx * row.nx;
  }
  if (!rows_are_own) add_blocks_from_ghosts();
  inverse.assign(nlocal, {});
  for (int i = 0; i < nlocal; i++) {
    const SymmetricBlock &m = blocks[i];
    const double shift = BLOCK_SHIFT * (m.xx + m.yy) + settings.background;
    const double a = m.xx + shift, d = m.yy + shift, g = m.ss + shift, b = m.xy, e = m.xs, f = m.ys;
    const double det = a * (d * g - f * f) - b * (b * g - e * f) + e * (b * f - d * e);
    if (!(det > 0.0)) continue;
    inverse[i] = {(d * g - f * f) / det, (e * f - b * g) / det, (a * g - e * e) / det,
                  (b * f - d * e) / det, (b * e - a * f) / det, (a * d - b * b) / det};
  }
  MPI_Allreduce(MPI_IN_PLACE, flow, 2, MPI_DOUBLE, MPI_SUM, world);
  affine_drag = flow[0];
  flow[0] += settings.fluid;
  inverse_flow = free_rate && flow[0] > 0.0 ? 1.0 / flow[0] : 0.0;
  flow_relaxation = free_rate && flow[1] > 0.0 ? flow[0] / flow[1] : HUGE_VAL;
  // without background drag, factors would amplify what rounding leaves; with a power law, older
  // ones would judge a Newton step by a wrong norm
  if (settings.background > 0.0 && factors_are_due(slow, !law.is_linear())) factorise();
}

/* Two exchanges of three numbers sum up what both ranks of a contact know of a block. */
void DiskDrag::add_blocks_from_ghosts()
{
  Field half(blocks.size());
  for (const auto first : {&SymmetricBlock::xx, &SymmetricBlock::xs}) {
    for (std::size_t i = 0; i < half.size(); i++) std::copy_n(&(blocks[i].*first), 3, &half[i].x);
    exchange.add_from_ghosts(half);
    for (std::size_t i = 0; i < half.size(); i++) std::copy_n(&half[i].x, 3, &(blocks[i].*first));
  }
}

/* Answers to forces on several pairs have one matrix, and no velocities to start from. */
void DiskDrag::factorise_for_answers()
{
  if (settings.background == 0.0 || (factored && age == 0)) return;
  if (factored || answer_iterations > slow) factorise();
}

/* Blocks on the diagonal have all contacts, others those between two disks of this rank. */
void DiskDrag::factorise()
{
  BlockAssembly<3> matrix(atom, given);
  assemble_rows(matrix, false);
  for (int i = 0; i < nlocal; i++) {
    const auto &[xx, xy, yy, xs, ys, ss] = blocks[i];
    const double x = xx + settings.background, y = yy + settings.background;
    matrix.add(i, i, {x, xy, xs, xy, y, ys, xs, ys, ss});
  }
  matrix.fill(factors);
  int all = factors.factorise(SHIFT * settings.background);
  MPI_Allreduce(MPI_IN_PLACE, &all, 1, MPI_INT, MPI_MIN, world);
  factored = all;
  age = 0;
}

/* Pairs of numbers stand side by side, in the order of SymmetricBlock. */
double DiskDrag::precondition()
{
  if (factored) return DragSystem::precondition();
  Double2 sums = {0.0, 0.0};
  double turning = 0.0;
  for (int i = 0; i < nlocal; i++) {
    const SymmetricBlock &m = inverse[i];
    const Vec3 &v = residual[i];
    const Double2 flat = double2(m.xx) * v.x + double2(m.xy) * v.y + double2(m.xs) * v.spin;
    const Double2 turn = double2(m.xs) * double2(v.x);
    descent[i] = {flat[0], flat[1], turn[0] + turn[1] + m.ss * v.spin};
    sums += flat * double2(v.x);
    turning += descent[i].spin * v.spin;
  }
  return sums[0] + sums[1] + turning;
}

/* Rounding of the contact forces leaves at most the energy F B^-1 F in the error. */
double DiskDrag::rounding() const
{
  double total = 0.0;
  for (std::size_t k = 0; k < contacts.size(); k++) {
    const Contact &c = contacts[k];
    total += c.share * c.force * c.force / (weights[k] + settings.background);
  }
  return ROUNDING * ROUNDING * sum(total);
}

/* A disk with too few contacts to hold it keeps no velocity from the last step: nothing would ever
   take away the part that costs no drag. Its neighbours may be loose without it. If the contacts
   that remain are too few to hold the disks that remain, none keeps its velocity. */
void DiskDrag::zero_rattler_velocities(Field &u)
{
  const double least = law.beta > 0.0 ? 2.0 : 3.0, isostatic = law.beta > 0.0 ? 3.0 : 4.0;
  Field kept(nlocal + nghost, {1.0, 0.0, 0.0});    // x: whether a disk is held
  for (int round = 0; round < PEELS; round++) {
    Field count(nlocal + nghost);    // x: its contacts with such disks
    for (const DiskRow &row : rows) {
      if (kept[row.i].x == 0.0 || kept[row.j].x == 0.0) continue;
      count[row.i].x += 1.0;
      count[row.j].x += 1.0;
    }
    exchange.add_from_ghosts(count);
    double totals[3] = {0.0, 0.0, 0.0};    // disks that lose contact, that are held; contacts' ends
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

/* Forces along the slip of rubbing pairs count. */
double DiskDrag::elastic_moment() const
{
  double elastic = 0.0;
  for (std::size_t k = 0; k < rows.size(); k++)
    elastic -= contacts[k].share * contacts[k].force * rows[k].nx * lever(k);
  Field unused(nlocal + nghost);
  for (std::size_t e = 0; e < marginal.size(); e++)
    elastic -= add_pair_forces(e, 0.0, marginal[e].held, unused);
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

/* A contact relaxes in a time of drag over stiffness. The background slows it at least by the share
   of a disk with twelve half contacts. A thin fluid lets the whole box relax as fast. */
double DiskDrag::least_relaxation_time() const
{
  double least = HUGE_VAL;
  for (std::size_t k = 0; k < contacts.size(); k++)
    if (contacts[k].stiffness > 0.0)    // rounds to 0 where disks that stiffen barely touch
      least = std::min(least, (weights[k] + settings.background / 12.0) / contacts[k].stiffness);
  return law.alpha * std::min(least, flow_relaxation);
}
