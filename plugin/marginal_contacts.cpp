// SPDX-License-Identifier: GPL-2.0-or-later

/* Pairs of disks with a gap of zero: whether they part, meet or rub. See disk_drag.h. */

#include "disk_drag.h"

#include "dense_solver.h"
#include "marginal_contact_solver.h"
#include "pair_disk_drag.h"

#include <map>
#include <utility>

using namespace LAMMPS_NS;

static constexpr double ANSWER = 1e-5;      // residual of an answer over the force that it answers
static constexpr double EXACT = 1e-8;       // the same for disks with marginal contacts alone, and
                                            // for power laws, whose held forces swing by more
static constexpr double MOVES = 10.0;       // residuals: approach over the velocity of a contact
static constexpr double SINGULAR = 1e-2;    // pivot over the largest one that determines nothing
static constexpr double ANSWERS = 1e-4;     // approach over slip of an answer, if it has any
static constexpr double SAME = 1e-6;        // of the reach, between the two halves of a contact

std::map<DiskDrag::Ids, std::size_t> DiskDrag::marginal_numbers() const
{
  std::map<Ids, std::size_t> found;
  for (std::size_t e = 0; e < marginal.size(); e++)
    found[ids(marginal[e].first, marginal[e].second)] = e;
  return found;
}

/* Of the images of one pair, that with the gap closest to zero counts; with newton off, both halves
   of it. */
void DiskDrag::find_pairs()
{
  pairs_of.assign(marginal.size(), {});
  if (marginal.empty()) return;
  const auto numbers = marginal_numbers();
  const std::vector<DiskPair> &pairs = pair.pairs();
  const tagint *const tag = atom->tag;
  for (std::size_t k = 0; k < pairs.size(); k++)
    if (const auto e = numbers.find(ids(tag[pairs[k].i], tag[pairs[k].j])); e != numbers.end())
      pairs_of[e->second].push_back(static_cast<int>(k));
  const auto gap = [&](int k) { return fabs(hypot(pairs[k].x, pairs[k].y) - pairs[k].reach); };
  const auto closer = [&](int k, int l) { return gap(k) < gap(l); };
  for (auto &images : pairs_of) {
    if (images.empty()) continue;
    const int first = *std::min_element(images.begin(), images.end(), closer);
    const DiskPair &half = pairs[first];
    const auto other = [&](int k) {    // neither it nor its other half
      const DiskPair &p = pairs[k];
      return k != first &&
          (half.share == 1.0 || tag[p.i] != tag[half.j] || tag[p.j] != tag[half.i] ||
           hypot(p.x + half.x, p.y + half.y) >= SAME * half.reach);
    };
    images.erase(std::remove_if(images.begin(), images.end(), other), images.end());
  }
}

void DiskDrag::expect(const std::vector<Change> &changes)
{
  const auto numbers = marginal_numbers();
  for (const Change &change : changes) {
    const auto e = numbers.find(ids(change.first, change.second));
    if (e == numbers.end()) {
      marginal.push_back({change.first, change.second, change.state});
      marginal.back().tried = 1 << (change.state == OPEN ? CLOSED : OPEN);
    } else if (change.state != RUBBING) {    // the theta of a rubbing one says what becomes of it
      marginal[e->second].tried = 1 << marginal[e->second].state;
      marginal[e->second].state = change.state;
    }
  }
}

std::vector<DiskDrag::MarginalSlip> DiskDrag::marginal_slips(const Field &u, double rate) const
{
  std::vector<MarginalSlip> slips(marginal.size(), MarginalSlip());
  for (std::size_t e = 0; e < marginal.size(); e++)
    for (const int k : pairs_of[e]) {
      const DiskPair &p = pair.pairs()[k];
      DiskRow row;
      Contact contact;
      const auto here = std::lower_bound(pair_of.begin(), pair_of.end(), k);
      if (here != pair_of.end() && *here == k) {    // in contact: where it is now
        row = rows[here - pair_of.begin()];
        contact = contacts[here - pair_of.begin()];
      } else {
        contact_of(p, p.x, p.y, row, contact);
      }
      const double affine = rate * row.ny * contact.distance;
      const Slip s = slip_of(row, relative_velocity(row, u.data(), affine));
      slips[e].approach += p.share * s.approach;
      slips[e].slide += p.share * s.slide;
      slips[e].gap += p.share * (contact.distance - p.reach);
    }
  MPI_Allreduce(MPI_IN_PLACE, slips.data(), static_cast<int>(3 * slips.size()), MPI_DOUBLE,
                MPI_SUM, world);
  return slips;
}

DiskDrag::Revision DiskDrag::revise(const Field &u, double rate, double least_speed)
{
  Revision found = FITS;
  const std::vector<MarginalSlip> slips = marginal_slips(u, rate);
  for (std::size_t e = 0; e < marginal.size(); e++) {
    MarginalContact &m = marginal[e];
    const double speed = speed_of(slips[e]);
    int first, second;    // states to be tried next
    if (m.state == RUBBING && (m.free || m.theta < 0.0 || m.theta > 1.0)) {
      const bool parts = !m.free && m.theta < 0.0;
      first = parts ? OPEN : CLOSED;
      second = parts ? CLOSED : OPEN;
    } else if (m.state != RUBBING && law.beta > 0.0 && law.tau > 0.0 &&
               speed > std::max(least_speed, min_speed) &&
               against(m, slips[e]) > MOVES * settings.tolerance * speed) {
      first = m.state == CLOSED ? OPEN : CLOSED;
      second = RUBBING;
    } else
      continue;
    m.tried |= 1 << m.state;
    const int next = !(m.tried & 1 << first) ? first : !(m.tried & 1 << second) ? second : -1;
    if (next < 0) {
      found = CYCLES;
      continue;
    }
    m.set(next);
    if (found == FITS) found = CHANGED;
  }
  if (found != FITS) find_contacts();
  return found;
}

bool DiskDrag::close_rubbing()
{
  if (rubbing == 0) return false;
  for (MarginalContact &m : marginal) {
    if (m.state != RUBBING) continue;
    m.tried = 1 << RUBBING;
    m.set(CLOSED);
  }
  find_contacts();
  return true;
}

/* The gap moves against the state at this velocity, beside what takes back a gap that is not quite
   zero. */
double DiskDrag::against(const MarginalContact &m, const MarginalSlip &s) const
{
  if (m.state == RUBBING) return fabs(s.approach);
  const double back = closing * s.gap;
  return m.state == CLOSED ? s.approach + std::min(0.0, back) : -s.approach - std::max(0.0, back);
}

/* The misfit is that velocity over the velocity of the contact and the least that counts; of a
   rubbing pair, it tells how far theta is from the range of 0 to 1. */
double DiskDrag::misfit(const MarginalContact &m, const MarginalSlip &s, double least_speed) const
{
  const double speed = speed_of(s), whole = speed + least_speed;
  if (!(whole > 0.0) || speed <= min_speed) return 0.0;
  if (m.state == RUBBING && !m.free)
    return std::max({0.0, -m.theta, m.theta - 1.0}) * speed / whole;
  return std::max(0.0, against(m, s)) / whole;
}

double DiskDrag::misfit(const Field &u, double rate, double least_speed) const
{
  const std::vector<MarginalSlip> slips = marginal_slips(u, rate);
  double worst = 0.0;
  for (std::size_t e = 0; e < marginal.size(); e++)
    worst = std::max(worst, misfit(marginal[e], slips[e], least_speed));
  return worst;
}

bool DiskDrag::rubs(const Field &u, double rate) const
{
  if (rubbing == 0) return false;
  const std::vector<MarginalSlip> slips = marginal_slips(u, rate);
  for (std::size_t e = 0; e < marginal.size(); e++)
    if (marginal[e].state == RUBBING && speed_of(slips[e]) > min_speed) return true;
  return false;
}

void DiskDrag::forget_settled(bool all)
{
  if (all)
    for (MarginalContact &m : marginal) m.tried = 0;
  const std::vector<MarginalSlip> slips = marginal_slips(rest, 0.0);
  std::vector<MarginalContact> kept;
  for (std::size_t e = 0; e < marginal.size(); e++) {
    const MarginalContact &m = marginal[e];
    const bool told = m.state == CLOSED ? slips[e].gap < 0.0 : slips[e].gap > 0.0;
    if (m.state == RUBBING || !told || m.tried) kept.push_back(m);
  }
  if (kept.size() == marginal.size()) return;
  marginal = kept;
  find_pairs();
  find_contacts();
}

std::vector<double> DiskDrag::of_marginals(double MarginalContact::*value) const
{
  std::vector<double> found;
  for (const MarginalContact &m : marginal) found.push_back(m.*value);
  return found;
}

void DiskDrag::find_exits(const Field &u, double rate, const std::vector<double> &first,
                          const std::vector<double> &later, double time, double end,
                          std::vector<Change> &found) const
{
  if (rubbing == 0) return;
  const std::vector<MarginalSlip> slips = marginal_slips(u, rate);
  for (std::size_t e = 0; e < marginal.size(); e++) {
    if (marginal[e].state != RUBBING) continue;
    const double slope = (later[e] - first[e]) / time, last = first[e] + slope * end;
    if (last >= 0.0 && last <= 1.0) continue;
    const double at = std::max(0.0, ((last < 0.0 ? 0.0 : 1.0) - first[e]) / slope);
    found.push_back({marginal[e].first, marginal[e].second, RUBBING, at,
                     fabs(slips[e].slide) * sqrt(law.beta), fabs(slope)});
  }
}

/* Adds forces on a marginal pair, against parting and slip, to a field without ghosts' sums.
   Returns their part in A stress, of this rank. */
double DiskDrag::add_pair_forces(std::size_t e, double back, double rub, Field &force) const
{
  double moment = 0.0;
  for (const int k : rows_of[e]) {
    const WideVec3 on_pair = force_of(rows[k], -back, -rub);
    add_forces(rows[k], on_pair, force.data());
    moment += contacts[k].share * on_pair.xy[0] * lever(k);
  }
  return moment;
}

/* Forces along the slip of rubbing pairs make their approach vanish: velocities answer to them
   linearly. true: the forces have changed. */
bool DiskDrag::enforce_constraints(Field &force, Field &u, Load &load, Result &result)
{
  if (rubbing == 0) return false;
  exchange.send_to_ghosts(u);
  std::vector<std::size_t> rubs;
  for (std::size_t e = 0; e < marginal.size(); e++)
    if (marginal[e].state == RUBBING) rubs.push_back(e);
  const std::size_t m = rubs.size(), columns = m + 1;
  const std::vector<MarginalSlip> slips = marginal_slips(u, load.rate);
  double speeds[2] = {0.0, static_cast<double>(nlocal)};
  for (int i = 0; i < nlocal; i++) speeds[0] += hypot(u[i].x, u[i].y);
  MPI_Allreduce(MPI_IN_PLACE, speeds, 2, MPI_DOUBLE, MPI_SUM, world);
  std::vector<double> matrix(m * columns);
  bool enough = true;
  for (std::size_t a = 0; a < m; a++) {
    const MarginalSlip &s = slips[rubs[a]];
    const double back = closing * s.gap, off = matrix[a * columns + m] = s.approach + back;
    const double speed = fabs(s.slide) + fabs(back) + speeds[0] / speeds[1];
    enough = enough && (marginal[rubs[a]].free || fabs(off) <= settings.tolerance * speed);
  }
  if (enough && result.converged) {
    update_thetas(rubs, slips);
    return false;
  }

  if (answers.empty()) {
    factorise_for_answers();
    const double accuracy = law.is_linear() ? ANSWER : EXACT;
    std::vector<PairForces> slides;
    for (const std::size_t e : rubs) slides.push_back({e, 0.0, 1.0});
    answers = answers_to(slides, accuracy, load.free_rate, result);
  }
  std::vector<bool> free(m, false);    // pairs that slip without an answer in their approach
  for (std::size_t a = 0; a < m; a++) {
    const std::vector<MarginalSlip> answer = marginal_slips(answers[a].velocity, answers[a].rate);
    for (std::size_t b = 0; b < m; b++) matrix[b * columns + a] = answer[rubs[b]].approach;
    const MarginalSlip &own = answer[rubs[a]];
    free[a] = fabs(own.approach) <= ANSWERS * fabs(own.slide);
  }
  for (std::size_t a = 0; a < m; a++)
    for (std::size_t b = 0; free[a] && b <= m; b++) matrix[a * columns + b] = a == b ? 1.0 : 0.0;
  const DenseSolver solved(std::move(matrix), m, SINGULAR);
  solved.mark_undetermined(free);
  for (std::size_t a = 0; a < m; a++) {
    const double q = -solved.solution()[a];
    marginal[rubs[a]].free = free[a];
    marginal[rubs[a]].held += q;
    field_add(u, q, answers[a].velocity, nlocal);
    field_add(force, q, answers[a].force, nlocal);
    load.rate += q * answers[a].rate;
    load.moment += q * answers[a].moment;
  }
  exchange.send_to_ghosts(u);
  update_thetas(rubs, marginal_slips(u, load.rate));
  return true;
}

void DiskDrag::set_multipliers(const std::vector<double> &forces)
{
  for (std::size_t e = 0; e < marginal.size(); e++) marginal[e].held = forces[e];
}

struct DiskDrag::Pending {    // an answer that conjugate gradients have begun to find
  Answer answer;
  Load unit;
  Descent so_far;
  Field residual, direction, product_of_direction;
  std::vector<double> descent;    // three numbers of each disk
};

/* Finds the velocities that answer to forces on marginal pairs. Each has conjugate gradients of its
   own, as if it were alone; factors are read once for a few. */
std::vector<DiskDrag::Answer> DiskDrag::answers_to(const std::vector<PairForces> &forces,
                                                   double accuracy, bool free_rate, Result &result)
{
  const Field none(nlocal + nghost);
  std::vector<Answer> found;
  for (std::size_t first = 0; first < forces.size(); first += TOGETHER) {
    const std::size_t count = std::min(TOGETHER, forces.size() - first);
    std::vector<Pending> some(count);
    for (std::size_t k = 0; k < count; k++) {
      const auto &[e, back, rub] = forces[first + k];
      Pending &p = some[k];
      p.answer = {none, none, 0.0, 0.0};
      double moment = add_pair_forces(e, back, rub, p.answer.force);
      exchange.add_from_ghosts(p.answer.force);
      if (!carried.empty()) moment += field_dot(p.answer.force, carried, nlocal);
      p.answer.moment = free_rate ? sum(moment) : 0.0;
      p.unit = {0.0, p.answer.moment, free_rate};
      p.so_far = begin_descent({accuracy, 0.0, 0.0, 0.0}, p.answer.moment);
      p.residual = p.answer.force;
      p.direction = p.product_of_direction = none;
    }
    needs_flow = free_rate;
    find_together(some.data(), count, result);
    needs_flow = true;
    for (Pending &p : some) {
      if (!factored) answer_iterations = p.so_far.taken;
      p.answer.rate = p.unit.rate;
      exchange.send_to_ghosts(p.answer.velocity);
      found.push_back(std::move(p.answer));
    }
  }
  return found;
}

void DiskDrag::find_together(Pending *some, std::size_t count, Result &result)
{
  std::vector<Pending *> left;
  for (std::size_t k = 0; k < count; k++) left.push_back(some + k);
  const auto use = [this](Pending &p) {
    std::swap(residual, p.residual);
    std::swap(direction, p.direction);
    std::swap(product_of_direction, p.product_of_direction);
  };
  while (!left.empty()) {
    if (factored) precondition_together(left);
    std::vector<Pending *> on;
    for (Pending *const p : left) {
      if (!goes_on(p->so_far, result)) continue;
      use(*p);
      for (int i = 0; factored && i < nlocal; i++)
        descent[i] = {p->descent[3 * i], p->descent[3 * i + 1], p->descent[3 * i + 2]};
      const double rho = factored ? field_dot(residual, descent, nlocal) : precondition_free();
      if (iterate(p->so_far, rho, p->answer.velocity, p->unit, result)) on.push_back(p);
      use(*p);
    }
    left = on;
  }
}

void DiskDrag::precondition_together(const std::vector<Pending *> &some)
{
  const std::size_t count = some.size();
  std::vector<double> columns(3 * nlocal * count);
  for (std::size_t k = 0; k < count; k++) {
    Field &left = some[k]->residual;
    for (std::size_t i = 0; i < given.size(); i++)
      if (given[i]) left[i] = Vec3();
    const double *const from = numbers(left);
    for (int i = 0; i < 3 * nlocal; i++) columns[i * count + k] = from[i];
  }
  factors.solve(columns.data(), static_cast<int>(count));
  for (std::size_t k = 0; k < count; k++) {
    some[k]->descent.resize(3 * nlocal);
    for (int i = 0; i < 3 * nlocal; i++) some[k]->descent[i] = columns[i * count + k];
  }
}

/* These weights belong to the whole drag of rubbing pairs, of which the matrix holds a part. */
std::vector<double> DiskDrag::whole_weights() const
{
  std::vector<double> whole(marginal.size(), 0.0);
  for (std::size_t e = 0; e < marginal.size(); e++)
    for (const int k : rows_of[e]) whole[e] += contacts[k].share * weights[k] / contacts[k].part;
  MPI_Allreduce(MPI_IN_PLACE, whole.data(), static_cast<int>(whole.size()), MPI_DOUBLE, MPI_SUM,
                world);
  return whole;
}

/* theta is the part of the drag of a pair, as it slips, that acts on it. */
void DiskDrag::update_thetas(const std::vector<std::size_t> &rubs,
                             const std::vector<MarginalSlip> &slips)
{
  const std::vector<double> whole = whole_weights();
  for (const std::size_t e : rubs) {
    const double drag = law.beta * whole[e] * slips[e].slide;
    marginal[e].theta = drag != 0.0 ? marginal[e].base + marginal[e].held / drag : marginal[e].base;
  }
}

bool DiskDrag::marginal_pairs_change() const
{
  return std::any_of(marginal.begin(), marginal.end(), [](const auto &m) { return m.tried != 0; });
}

std::vector<double> DiskDrag::parts_before() const
{
  std::vector<double> parts;
  for (const MarginalContact &m : marginal)
    parts.push_back(m.state == RUBBING ? std::clamp(m.theta, 0.0, 1.0)
                                       : (m.state == CLOSED) != (m.tried != 0) ? 1.0 : 0.0);
  return parts;
}

/* With all marginal pairs at the part BASE of their drag, velocities answer linearly to the rest of
   it, two forces on each. */
bool DiskDrag::relax_marginal_pairs(std::vector<double> parts, const Field &u, const Load &driven)
{
  const std::size_t m = marginal.size(), n = 2 * m;
  for (MarginalContact &each : marginal) each.set(RUBBING);
  find_contacts();
  Field force, base(u);
  driving_forces(force);
  Load load = driven;
  if (load.free_rate) load.moment -= driven_moment(force);
  Result result = {0, false, 0.0, true};
  exchange.send_to_ghosts(base);
  find_weights(base, load.rate);
  find_preconditioner(load.free_rate);
  factorise_for_answers();
  const Residual rest = find_residual(force, base, load, false);
  conjugate_gradients(base, load, rest.flow, {EXACT, 0.0, rounding(), rest.dissipation}, result);
  exchange.send_to_ghosts(base);
  const std::vector<double> none(n);
  MarginalContactSolver pairs = {m, BASE, none, std::vector<double>(n * n), none, none};
  const std::vector<MarginalSlip> slips = marginal_slips(base, load.rate);
  const std::vector<double> whole = whole_weights();
  for (std::size_t e = 0; e < m; e++) {
    pairs.still[e] = slips[e].approach;
    pairs.back[e] = closing * slips[e].gap;
    pairs.still[m + e] = slips[e].slide;
    pairs.weights[e] = whole[e];
    pairs.weights[m + e] = law.beta * whole[e];
  }
  for (std::size_t first = 0; first < n; first += TOGETHER) {
    std::vector<PairForces> some;
    for (std::size_t k = first; k < std::min(n, first + TOGETHER); k++)
      some.push_back({k % m, k < m ? 1.0 : 0.0, k < m ? 0.0 : 1.0});
    const std::vector<Answer> found = answers_to(some, EXACT, load.free_rate, result);
    for (std::size_t k = 0; k < found.size(); k++) {
      const std::vector<MarginalSlip> slip = marginal_slips(found[k].velocity, found[k].rate);
      for (std::size_t e = 0; e < m; e++) {
        pairs.answers[e * n + first + k] = slip[e].approach;
        pairs.answers[(m + e) * n + first + k] = slip[e].slide;
      }
    }
  }
  const bool rests = pairs.relax(parts);
  for (std::size_t e = 0; e < m; e++)
    marginal[e].set(parts[e] == 0.0 ? OPEN : parts[e] == 1.0 ? CLOSED : RUBBING);
  find_contacts();
  return rests;
}
