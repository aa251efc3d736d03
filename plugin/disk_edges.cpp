// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

/* Pairs of disks with a gap of zero: whether they part, meet or rub. */

#include "disk_drag.h"

#include "edge_relaxation.h"
#include "pair_disk_drag.h"

#include <algorithm>
#include <cmath>
#include <numeric>

using namespace LAMMPS_NS;

static constexpr double BASE = 0.5;             // part of the drag that keeps the matrix well conditioned
static constexpr double ANSWER = 1e-5;          // residual of an answer, over the force that is answered
static constexpr double MOVES = 10.0;           // residuals; approach over the velocity of a contact that is more
static constexpr double SINGULAR = 1e-2;        // pivot over the largest one that determines nothing
static constexpr double EXACT = 1e-8;           // the same, where a disk may have no other contact than edges, and of a
                                                // power law, whose forces held swing by more than what is left
static constexpr double ANSWERS = 1e-4;         // approach over slip of an answer: a disk on one contact has none

/* ---------------------------------------------------------------------- */

void DiskDrag::expect(const Change &change)
{
  for (Edge &edge : edged)
    if (std::minmax(edge.first, edge.second) == std::minmax(change.first, change.second)) {    // ghosts turn them round
      if (change.state == RUBBING) return;    // its theta says what becomes of it
      edge.tried = 1 << edge.state;
      edge.state = change.state;
      return;
    }
  const int before = change.state == OPEN ? CLOSED : OPEN;
  edged.push_back({change.first, change.second, change.state, BASE, BASE, 0.0, 1 << before, false});
}

/* ---------------------------------------------------------------------- */

std::vector<DiskDrag::Slip> DiskDrag::edge_slips(const Motions &u, double rate) const
{
  std::vector<Slip> slips(edged.size(), {0.0, 0.0, 0.0});
  for (std::size_t e = 0; e < edged.size(); e++) {
    for (const int pair : edge_pairs[e]) {
      const DiskPair &p = near()[pair];
      DiskContact c = contact_of(p, p.x, p.y);
      for (std::size_t k = 0; k < contacts.size(); k++)
        if (pair_of[k] == pair) c = contacts[k];    // where it is now
      double approach, slide;
      slip(c, u, rate, approach, slide);
      slips[e].approach += p.share * approach;
      slips[e].slide += p.share * slide;
      slips[e].gap += p.share * (c.distance - p.reach);
    }
  }
  MPI_Allreduce(MPI_IN_PLACE, slips.data(), static_cast<int>(3 * slips.size()), MPI_DOUBLE, MPI_SUM, world);
  return slips;
}

/* ---------------------------------------------------------------------- */

DiskDrag::Revision DiskDrag::revise(const Motions &u, double rate, double least_speed)
{
  Revision found = FITS;
  const std::vector<Slip> slips = edge_slips(u, rate);
  for (std::size_t e = 0; e < edged.size(); e++) {
    Edge &edge = edged[e];
    const Slip &s = slips[e];
    const double speed = speed_of(s);
    const double off = against(edge, s);
    int first, second;    // states to be tried next
    if (edge.state == RUBBING && (edge.free || edge.theta < 0.0 || edge.theta > 1.0)) {
      const bool parts = !edge.free && edge.theta < 0.0;
      first = parts ? OPEN : CLOSED;
      second = parts ? CLOSED : OPEN;
    } else if (edge.state != RUBBING && law.beta > 0.0 && law.tau > 0.0 && speed > std::max(least_speed, alone) &&
               off > MOVES * settings.tolerance * speed) {
      first = edge.state == CLOSED ? OPEN : CLOSED;
      second = RUBBING;
    } else
      continue;
    edge.tried |= 1 << edge.state;
    const int next = !(edge.tried & 1 << first) ? first : !(edge.tried & 1 << second) ? second : -1;
    if (next < 0) {
      found = CYCLES;
      continue;
    }
    set_state(edge, next);
    if (found == FITS) found = CHANGED;
  }
  if (found != FITS) find_contacts();
  return found;
}

/* ---------------------------------------------------------------------- */

bool DiskDrag::close_rubbing()
{
  if (rubbing == 0) return false;
  for (Edge &edge : edged) {
    if (edge.state != RUBBING) continue;
    edge.tried = 1 << RUBBING;
    set_state(edge, CLOSED);
  }
  find_contacts();
  return true;
}

/* ---------------------------------------------------------------------- */

void DiskDrag::set_state(Edge &edge, int state)
{
  edge.state = state;
  edge.held = 0.0;
  edge.free = false;
  edge.base = edge.theta = BASE;
}

/* ---------------------------------------------------------------------- */

double DiskDrag::speed_of(const Slip &s) const
{
  return sqrt(s.approach * s.approach + law.beta * s.slide * s.slide);
}

/* ----------------------------------------------------------------------
   velocity of the gap against the state; what only takes back a gap that is not quite zero does not count
------------------------------------------------------------------------- */

double DiskDrag::against(const Edge &edge, const Slip &s) const
{
  if (edge.state == RUBBING) return fabs(s.approach);
  const double back = closing * s.gap;
  return edge.state == CLOSED ? s.approach + std::min(0.0, back) : -s.approach - std::max(0.0, back);
}

/* ----------------------------------------------------------------------
   that over the velocity of the contact and the least that counts; of a rubbing pair, how far its theta is from
   0 to 1
------------------------------------------------------------------------- */

double DiskDrag::misfit(const Edge &edge, const Slip &s, double least_speed) const
{
  const double speed = speed_of(s), whole = speed + least_speed;
  if (!(whole > 0.0) || speed <= alone) return 0.0;
  if (edge.state == RUBBING && !edge.free) return std::max({0.0, -edge.theta, edge.theta - 1.0}) * speed / whole;
  return std::max(0.0, against(edge, s)) / whole;
}

/* ---------------------------------------------------------------------- */

double DiskDrag::misfit(const Motions &u, double rate, double least_speed) const
{
  const std::vector<Slip> slips = edge_slips(u, rate);
  double worst = 0.0;
  for (std::size_t e = 0; e < edged.size(); e++) worst = std::max(worst, misfit(edged[e], slips[e], least_speed));
  return worst;
}

/* ---------------------------------------------------------------------- */

bool DiskDrag::rubs(const Motions &u, double rate) const
{
  if (rubbing == 0) return false;
  const std::vector<Slip> slips = edge_slips(u, rate);
  for (std::size_t e = 0; e < edged.size(); e++)
    if (edged[e].state == RUBBING && speed_of(slips[e]) > alone) return true;
  return false;
}

/* ---------------------------------------------------------------------- */

void DiskDrag::forget_settled(bool all)
{
  if (all)
    for (Edge &edge : edged) edge.tried = 0;
  const std::vector<Slip> slips = edge_slips(rest, 0.0);
  std::vector<Edge> kept;
  for (std::size_t e = 0; e < edged.size(); e++) {
    Edge &edge = edged[e];
    const bool told = edge.state == CLOSED ? slips[e].gap < 0.0 : slips[e].gap > 0.0;
    if (edge.state == RUBBING || !told || edge.tried) kept.push_back(edge);
  }
  if (kept.size() == edged.size()) return;
  edged = kept;
  edge_pairs.clear();
  for (const Edge &edge : edged) edge_pairs.push_back(find_pairs(edge));
  find_contacts();
}

/* ---------------------------------------------------------------------- */

std::vector<double> DiskDrag::thetas() const
{
  std::vector<double> found;
  for (const Edge &edge : edged) found.push_back(edge.theta);
  return found;
}

/* ---------------------------------------------------------------------- */

void DiskDrag::find_exits(const Motions &u, double rate, const std::vector<double> &first,
                          const std::vector<double> &later, double time, double end, std::vector<Change> &found) const
{
  if (rubbing == 0) return;
  const std::vector<Slip> slips = edge_slips(u, rate);
  for (std::size_t e = 0; e < edged.size(); e++) {
    if (edged[e].state != RUBBING) continue;
    const double slope = (later[e] - first[e]) / time, last = first[e] + slope * end;
    if (last >= 0.0 && last <= 1.0) continue;
    const double at = std::max(0.0, ((last < 0.0 ? 0.0 : 1.0) - first[e]) / slope);
    found.push_back({edged[e].first, edged[e].second, RUBBING, at, fabs(slips[e].slide) * sqrt(law.beta), fabs(slope)});
  }
}

/* ----------------------------------------------------------------------
   Forces along the slip of rubbing pairs so that their approach is none: the velocities answer to them
   linearly. true: they have changed.
------------------------------------------------------------------------- */

bool DiskDrag::hold(Motions &force, Motions &u, Load &load, Result &result)
{
  if (rubbing == 0) return false;
  exchange.send_to_ghosts(u);
  std::vector<std::size_t> rubs;
  for (std::size_t e = 0; e < edged.size(); e++)
    if (edged[e].state == RUBBING) rubs.push_back(e);
  const std::size_t m = rubs.size();
  const bool known = answers.size() == m;
  if (!known) {
    answers.resize(m);
    rate_answers.assign(m, 0.0);
  }
  std::vector<double> matrix(m * m), right(m);
  std::vector<bool> free(m, false);    // that slip without an answer in their approach
  const std::vector<Slip> slips = edge_slips(u, load.rate);
  std::vector<Motions> pushes(m);
  std::vector<double> moments(m, 0.0);
  bool enough = true;
  double speeds[2] = {0.0, static_cast<double>(nlocal)};
  for (int i = 0; i < nlocal; i++) speeds[0] += hypot(u[i].x, u[i].y);
  MPI_Allreduce(MPI_IN_PLACE, speeds, 2, MPI_DOUBLE, MPI_SUM, world);
  const double typical = speeds[0] / speeds[1];
  for (std::size_t a = 0; a < m; a++) {
    const Slip &s = slips[rubs[a]];
    right[a] = s.approach + closing * s.gap;
    enough = enough && (edged[rubs[a]].free || fabs(right[a]) <= settings.tolerance * (fabs(s.slide) + fabs(closing * s.gap) + typical));
  }
  if (enough && result.converged) {
    update_thetas(rubs, slips);
    return false;
  }
  if (!known) factorise_for(m);
  for (std::size_t a = 0; a < m; a++) {
    if (known) {
      pushes[a].assign(nlocal + nghost, Motion());
      moments[a] = push_pair(rubs[a], 0.0, 1.0, pushes[a]);
      exchange.add_from_ghosts(pushes[a]);
      moments[a] = load.free_rate ? sum(moments[a]) : 0.0;
    } else {
      moments[a] = answer_to(rubs[a], 0.0, 1.0, is_linear() ? ANSWER : EXACT, load, pushes[a], answers[a],
                             rate_answers[a], result);
    }
    const std::vector<Slip> answer = edge_slips(answers[a], rate_answers[a]);
    for (std::size_t b = 0; b < m; b++) matrix[b * m + a] = answer[rubs[b]].approach;
    const Slip &own = answer[rubs[a]];
    free[a] = fabs(own.approach) <= ANSWERS * fabs(own.slide);
  }
  for (std::size_t a = 0; a < m; a++) {
    if (!free[a]) continue;
    for (std::size_t b = 0; b < m; b++) matrix[a * m + b] = a == b ? 1.0 : 0.0;
    right[a] = 0.0;
  }
  solve_dense(matrix, right, free);
  for (std::size_t a = 0; a < m; a++) edged[rubs[a]].free = free[a];
  for (std::size_t a = 0; a < m; a++) {
    const double q = -right[a];
    edged[rubs[a]].held += q;
    for (int i = 0; i < nlocal; i++) {
      const Motion &z = answers[a][i], &t = pushes[a][i];
      u[i] = {u[i].x + q * z.x, u[i].y + q * z.y, u[i].spin + q * z.spin};
      force[i] = {force[i].x + q * t.x, force[i].y + q * t.y, force[i].spin + q * t.spin};
    }
    load.rate += q * rate_answers[a];
    load.moment += q * moments[a];
  }
  exchange.send_to_ghosts(u);
  update_thetas(rubs, edge_slips(u, load.rate));
  return true;
}

/* ---------------------------------------------------------------------- */

std::vector<double> DiskDrag::held() const
{
  std::vector<double> found;
  for (const Edge &edge : edged) found.push_back(edge.held);
  return found;
}

/* ---------------------------------------------------------------------- */

void DiskDrag::hold_at(const std::vector<double> &forces)
{
  for (std::size_t e = 0; e < edged.size(); e++) edged[e].held = forces[e];
}

/* ----------------------------------------------------------------------
   velocities that answer to unit forces on an edge; returns the part of these in A stress, where the rate is free
------------------------------------------------------------------------- */

double DiskDrag::answer_to(std::size_t edge, double back, double rub, double accuracy, const Load &load, Motions &push,
                           Motions &answer, double &rate, Result &result)
{
  push.assign(nlocal + nghost, Motion());
  double moment = push_pair(edge, back, rub, push);
  exchange.add_from_ghosts(push);
  moment = load.free_rate ? sum(moment) : 0.0;
  Load unit = {0.0, moment, load.free_rate};
  answer.assign(nlocal + nghost, Motion());
  std::copy_n(push.begin(), nlocal, residual.begin());
  double z_flow;
  const double driven = precondition(moment, z_flow);
  const int before = result.iterations;
  descend(answer, unit, moment, accuracy * accuracy * driven, result);
  if (!factored) answer_iterations = result.iterations - before;
  rate = unit.rate;
  exchange.send_to_ghosts(answer);
  return moment;
}

/* ---------------------------------------------------------------------- */

std::vector<double> DiskDrag::whole_weights() const
{
  std::vector<double> whole(edged.size(), 0.0);
  for (std::size_t k = 0; k < contacts.size(); k++)
    if (edge_of[k] >= 0) whole[edge_of[k]] += contacts[k].share * weights[k] / edged[edge_of[k]].base;
  MPI_Allreduce(MPI_IN_PLACE, whole.data(), static_cast<int>(whole.size()), MPI_DOUBLE, MPI_SUM, world);
  return whole;
}

/* ----------------------------------------------------------------------
   part of the drag of the pair, as it slips, that acts on it
------------------------------------------------------------------------- */

void DiskDrag::update_thetas(const std::vector<std::size_t> &rubs, const std::vector<Slip> &slips)
{
  const std::vector<double> whole = whole_weights();
  for (const std::size_t e : rubs) {
    const double drag = law.beta * whole[e] * slips[e].slide;
    edged[e].theta = drag != 0.0 ? edged[e].base + edged[e].held / drag : edged[e].base;
  }
}

/* ---------------------------------------------------------------------- */

bool DiskDrag::edges_change() const
{
  return std::any_of(edged.begin(), edged.end(), [](const Edge &edge) { return edge.tried != 0; });
}

/* ---------------------------------------------------------------------- */

std::vector<double> DiskDrag::parts_before() const
{
  std::vector<double> parts;
  for (const Edge &edge : edged)
    parts.push_back(edge.state == RUBBING ? std::clamp(edge.theta, 0.0, 1.0)
                                          : (edge.state == CLOSED) != (edge.tried != 0) ? 1.0 : 0.0);
  return parts;
}

/* ----------------------------------------------------------------------
   with all edges at the part BASE of their drag, velocities answer linearly to the rest of it, two forces on each
------------------------------------------------------------------------- */

bool DiskDrag::relax_edges(std::vector<double> parts, const Motions &u, const Load &driven)
{
  const std::size_t m = edged.size(), n = 2 * m;
  for (Edge &edge : edged) set_state(edge, RUBBING);
  find_contacts();
  Motions force, base(u), push, answer;
  this->push(force);
  Load load = driven;
  if (load.free_rate) load.moment -= elastic_moment();
  Result result = {0, false, 0.0, true};
  exchange.send_to_ghosts(base);
  find_weights(base, load.rate);
  find_preconditioner(load.free_rate);
  factorise_for(n);
  const double enough = std::max(EXACT * EXACT * driving(force, load), rounding());
  descend(base, load, find_residual(force, base, load, false), enough, result);
  exchange.send_to_ghosts(base);
  EdgeRelaxation edges = {m, BASE, std::vector<double>(n), std::vector<double>(n * n), std::vector<double>(n),
                          std::vector<double>(m)};
  const std::vector<Slip> slips = edge_slips(base, load.rate);
  const std::vector<double> whole = whole_weights();
  for (std::size_t e = 0; e < m; e++) {
    edges.still[e] = slips[e].approach;
    edges.back[e] = closing * slips[e].gap;
    edges.still[m + e] = slips[e].slide;
    edges.weights[e] = whole[e];
    edges.weights[m + e] = law.beta * whole[e];
  }
  for (std::size_t k = 0; k < n; k++) {
    double rate;
    answer_to(k % m, k < m ? 1.0 : 0.0, k < m ? 0.0 : 1.0, EXACT, load, push, answer, rate, result);
    const std::vector<Slip> found = edge_slips(answer, rate);
    for (std::size_t e = 0; e < m; e++) {
      edges.answers[e * n + k] = found[e].approach;
      edges.answers[(m + e) * n + k] = found[e].slide;
    }
  }
  const bool rests = edges.relax(parts);
  for (std::size_t e = 0; e < m; e++) set_state(edged[e], parts[e] == 0.0 ? OPEN : parts[e] == 1.0 ? CLOSED : RUBBING);
  find_contacts();
  return rests;
}

/* ----------------------------------------------------------------------
   m unknowns by elimination with pivots; those that the others leave undetermined are 0 and free
------------------------------------------------------------------------- */

void DiskDrag::solve_dense(std::vector<double> &matrix, std::vector<double> &right, std::vector<bool> &free)
{
  const std::size_t m = right.size();
  std::vector<std::size_t> rows(m), columns(m);
  std::iota(rows.begin(), rows.end(), 0);
  std::iota(columns.begin(), columns.end(), 0);
  const auto at = [&](std::size_t k, std::size_t l) -> double & { return matrix[rows[k] * m + columns[l]]; };
  double largest = 0.0;
  std::size_t rank = 0;
  for (; rank < m; rank++) {
    std::size_t row = rank, column = rank;
    for (std::size_t k = rank; k < m; k++)
      for (std::size_t l = rank; l < m; l++)
        if (fabs(at(k, l)) > fabs(at(row, column))) {
          row = k;
          column = l;
        }
    largest = std::max(largest, fabs(at(row, column)));
    if (!(fabs(at(row, column)) > SINGULAR * largest)) break;
    std::swap(rows[rank], rows[row]);
    std::swap(columns[rank], columns[column]);
    for (std::size_t k = rank + 1; k < m; k++) {
      const double factor = at(k, rank) / at(rank, rank);
      for (std::size_t l = rank; l < m; l++) at(k, l) -= factor * at(rank, l);
      right[rows[k]] -= factor * right[rows[rank]];
    }
  }
  std::vector<double> found(m, 0.0);
  for (std::size_t n = rank; n-- > 0;) {
    double sum = right[rows[n]];
    for (std::size_t l = n + 1; l < rank; l++) sum -= at(n, l) * found[columns[l]];
    found[columns[n]] = sum / at(n, n);
  }
  for (std::size_t n = rank; n < m; n++) free[columns[n]] = free[rows[n]] = true;
  right = found;
}
