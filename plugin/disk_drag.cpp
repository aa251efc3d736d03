// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "disk_drag.h"

#include "pair_disk_drag.h"

#include <algorithm>
#include <cmath>
#include <tuple>

using namespace LAMMPS_NS;

// A disk with few contacts has a singular block; what the shift adds, in parts of its trace, slows convergence only
static constexpr double BLOCK_SHIFT = 1e-3;
static constexpr double ROUNDING = 4e-16;
static constexpr int PEELS = 20;    // chains of loose disks are shorter
static constexpr double SAME = 1e-6;    // of the reach, between the two halves of a contact

/* ---------------------------------------------------------------------- */

DiskDrag::DiskDrag(MPI_Comm world, GhostExchange &exchange, const Settings &settings, const PairDiskDrag &pair,
                   const tagint *const &tags) :
    DragSolver(world, exchange, settings, pair.drag()), pair(pair), tags(tags)
{
}

/* ---------------------------------------------------------------------- */

const std::vector<DiskPair> &DiskDrag::near() const
{
  return pair.pairs();
}

/* ----------------------------------------------------------------------
   states as gaps tell them, but of edges
------------------------------------------------------------------------- */

void DiskDrag::take(int local, int ghost, double /*ahead*/)
{
  make_room(local, ghost);
  for (auto &each : blocks) each.resize(local + ghost);
  rest.assign(local + ghost, Motion());
  answers.clear();
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
  edge_pairs.clear();
  for (const Edge &edge : edged) edge_pairs.push_back(find_pairs(edge));
  find_contacts();
}

/* ----------------------------------------------------------------------
   of several images of one pair that whose gap is closest to zero
------------------------------------------------------------------------- */

std::vector<int> DiskDrag::find_pairs(const Edge &edge) const
{
  std::vector<int> found;
  double least = HUGE_VAL;
  for (std::size_t k = 0; k < near().size(); k++) {
    const DiskPair &p = near()[k];
    const tagint a = tags[p.i], b = tags[p.j];
    if (!(a == edge.first && b == edge.second) && !(a == edge.second && b == edge.first)) continue;
    const double gap = fabs(hypot(p.x, p.y) - p.reach);
    if (gap >= least) continue;
    found.assign(1, static_cast<int>(k));
    least = gap;
  }
  if (found.empty() || near()[found[0]].share == 1.0) return found;
  const DiskPair &half = near()[found[0]];
  for (std::size_t k = 0; k < near().size(); k++) {
    const DiskPair &p = near()[k];
    if (tags[p.i] == tags[half.j] && tags[p.j] == tags[half.i] &&
        hypot(p.x + half.x, p.y + half.y) < SAME * half.reach && static_cast<int>(k) != found[0])
      found.push_back(static_cast<int>(k));
  }
  return found;
}

/* ---------------------------------------------------------------------- */

DiskContact DiskDrag::contact_of(const DiskPair &p, double x, double y) const
{
  const double r = hypot(x, y);
  const Repulsion push = pair.repulsion(p.strength, p.reach - r);
  const double back = law.arms_to_contact ? 0.5 * push.overlap : 0.0;
  const double stiffness = pair.repulsion(p.strength, std::max(p.reach - r, least_overlap)).stiffness;
  return {p.i, p.j, x / r, y / r, r, stiffness, push.force, push.energy, p.radius_i - back, p.radius_j - back,
          p.share};
}

/* ---------------------------------------------------------------------- */

void DiskDrag::find_contacts()
{
  rubbing = 0;
  for (std::size_t e = 0; e < edged.size(); e++) {
    if (edged[e].state == RUBBING) rubbing++;
    for (const int k : edge_pairs[e]) states[k] = edged[e].state;
  }
  pair_of.clear();
  for (std::size_t k = 0; k < states.size(); k++)
    if (states[k] != OPEN) pair_of.push_back(static_cast<int>(k));
  edge_of.assign(pair_of.size(), -1);
  for (std::size_t e = 0; e < edged.size(); e++)
    for (const int k : edge_pairs[e])
      if (edged[e].state == RUBBING)
        edge_of[std::lower_bound(pair_of.begin(), pair_of.end(), k) - pair_of.begin()] = static_cast<int>(e);
  weights.resize(pair_of.size());
  displace(rest, 0.0);
}

/* ---------------------------------------------------------------------- */

void DiskDrag::displace(const Motions &moved, double strain)
{
  contacts.clear();
  answers.clear();
  for (const int k : pair_of) {
    const bool rubs = edge_of[contacts.size()] >= 0;    // its gap is zero but for rounding, which moves a loose disk
    const DiskPair &p = near()[k];
    const double y = p.y + moved[p.j].y - moved[p.i].y, x = p.x + moved[p.j].x - moved[p.i].x + strain * y;
    contacts.push_back(contact_of(p, x, y));
    if (rubs) contacts.back().force = contacts.back().energy = 0.0;
  }
}

/* ---------------------------------------------------------------------- */

void DiskDrag::push(Motions &force) const
{
  force.assign(nlocal + nghost, Motion());
  for (const DiskContact &c : contacts) {
    force[c.i].x -= c.force * c.nx;
    force[c.i].y -= c.force * c.ny;
    force[c.j].x += c.force * c.nx;
    force[c.j].y += c.force * c.ny;
  }
  for (std::size_t e = 0; e < edged.size(); e++)
    if (edged[e].state == RUBBING) push_pair(e, 0.0, edged[e].held, force);
  exchange.add_from_ghosts(force);
}

/* ----------------------------------------------------------------------
   add forces on an edge against its parting and its slip, ghosts apart; returns their part in A stress, of this rank
------------------------------------------------------------------------- */

double DiskDrag::push_pair(std::size_t edge, double back, double rub, Motions &force) const
{
  double moment = 0.0;
  for (std::size_t k = 0; k < contacts.size(); k++) {
    if (edge_of[k] != static_cast<int>(edge)) continue;
    const DiskContact &c = contacts[k];
    const double fx = back * c.nx - rub * c.ny, fy = back * c.ny + rub * c.nx;
    Motion &a = force[c.i], &b = force[c.j];
    a = {a.x + fx, a.y + fy, a.spin + rub * c.arm_i};
    b = {b.x - fx, b.y - fy, b.spin + rub * c.arm_j};
    moment -= c.share * fx * c.ny * c.distance;
  }
  return moment;
}

/* ----------------------------------------------------------------------
   approach and slip of j past i, the affine flow included
------------------------------------------------------------------------- */

void DiskDrag::slip(const DiskContact &c, const Motions &u, double rate, double &approach, double &slide)
{
  const Motion &a = u[c.i], &b = u[c.j];
  const double x = b.x - a.x + rate * c.ny * c.distance, y = b.y - a.y;
  approach = x * c.nx + y * c.ny;
  slide = y * c.nx - x * c.ny - c.arm_i * a.spin - c.arm_j * b.spin;
}

/* ---------------------------------------------------------------------- */

double DiskDrag::contact_speed(const DiskPair &p, const Motions &u, double rate) const
{
  double approach, slide;
  slip(contact_of(p, p.x, p.y), u, rate, approach, slide);
  return law.tau > 0.0 ? sqrt(approach * approach + law.beta * slide * slide) : fabs(approach);
}

/* ----------------------------------------------------------------------
   out = B p + b rate; power = (p, rate) B (p, rate); flow = b p + c rate, of all ranks
------------------------------------------------------------------------- */

void DiskDrag::multiply(Motions &p, double rate, Motions &out, double &power, double &flow)
{
  multiply_by({}, p, rate, out, power, flow);
}

/* ---------------------------------------------------------------------- */

void DiskDrag::multiply_ahead(Motions &p, double rate, Motions &out, double &power, double &flow)
{
  multiply_by(bends, p, rate, out, power, flow);
}

/* ---------------------------------------------------------------------- */

void DiskDrag::multiply_by(const std::vector<Bend> &less, Motions &p, double rate, Motions &out, double &power,
                           double &flow)
{
  exchange.send_to_ghosts(p);
  std::fill(out.begin(), out.end(), Motion());
  double sums[2] = {0.0, 0.0};
  for (std::size_t k = 0; k < contacts.size(); k++) {
    const DiskContact &c = contacts[k];
    double approach, slide;
    slip(c, p, rate, approach, slide);
    double push = weights[k] * approach, rub = law.beta * weights[k] * slide;
    if (!less.empty()) {
      const double bent = less[k].approach * approach + less[k].slide * slide;
      push -= less[k].approach * bent;
      rub -= less[k].slide * bent;
    }
    const double fx = push * c.nx - rub * c.ny, fy = push * c.ny + rub * c.nx;
    Motion &a = out[c.i], &b = out[c.j];
    a.x -= fx;
    a.y -= fy;
    a.spin -= rub * c.arm_i;
    b.x += fx;
    b.y += fy;
    b.spin -= rub * c.arm_j;
    sums[0] += c.share * (push * approach + rub * slide);
    sums[1] += c.share * fx * c.ny * c.distance;
  }
  exchange.add_from_ghosts(out);
  if (settings.background > 0.0)
    for (int i = 0; i < nlocal; i++) {
      out[i].x += settings.background * p[i].x;
      out[i].y += settings.background * p[i].y;
      sums[0] += settings.background * (p[i].x * p[i].x + p[i].y * p[i].y);
    }
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, world);
  power = sums[0];
  flow = sums[1];
}

/* ---------------------------------------------------------------------- */

void DiskDrag::find_weights(const Motions &u, double rate)
{
  if (law.alpha != 1.0) answers.clear();
  bends.clear();
  std::vector<double> square(law.alpha == 1.0 ? 0 : contacts.size());
  double squares = 0.0, count = 0.0;
  for (std::size_t k = 0; k < square.size(); k++) {
    double approach, slide;
    slip(contacts[k], u, rate, approach, slide);
    square[k] = law.square(approach, slide);
    squares += contacts[k].share * square[k];
    count += contacts[k].share;
  }
  const double slowest = law.alpha == 1.0 ? 0.0 : speed_floor(squares, count);
  for (std::size_t k = 0; k < contacts.size(); k++)
    weights[k] = (edge_of[k] < 0 ? 1.0 : edged[edge_of[k]].base) * contacts[k].stiffness *
        law.weight(square.empty() ? 0.0 : square[k], slowest);
}

/* ---------------------------------------------------------------------- */

bool DiskDrag::find_slopes(const Motions &u, double rate)
{
  bends.resize(contacts.size());
  for (std::size_t k = 0; k < contacts.size(); k++) {
    double approach, slide;
    slip(contacts[k], u, rate, approach, slide);
    // the weight goes as its square, floor included, to the power (alpha - 1) / 2
    const double whole = (edge_of[k] < 0 ? 1.0 : edged[edge_of[k]].base) * contacts[k].stiffness * law.tau;
    const double square = pow(weights[k] / whole, 2.0 / (law.alpha - 1.0));
    const double bend = law.tau * sqrt((1.0 - law.alpha) * weights[k] / square);
    bends[k] = whole > 0.0 ? Bend{bend * approach, bend * law.beta * slide} : Bend{0.0, 0.0};
  }
  return true;
}

/* ---------------------------------------------------------------------- */

DiskDrag::Slope DiskDrag::slope_of(std::size_t k) const
{
  const double w = weights[k], v = law.beta * w;
  if (bends.empty()) return {w, 0.0, v};
  const Bend &b = bends[k];
  return {w - b.approach * b.approach, -b.approach * b.slide, v - b.slide * b.slide};
}

/* ----------------------------------------------------------------------
   the block of each disk in B, inverted; and c
------------------------------------------------------------------------- */

void DiskDrag::find_preconditioner(bool free_rate)
{
  Motions &first = blocks[0], &second = blocks[1];    // xx xy yy, xs ys ss: two exchanges of three numbers
  std::fill(first.begin(), first.end(), Motion());
  std::fill(second.begin(), second.end(), Motion());
  double flow[2] = {0.0, 0.0};    // c, and the stiffness of the affine flow
  for (std::size_t k = 0; k < contacts.size(); k++) {
    const DiskContact &c = contacts[k];
    const auto [w, m, v] = slope_of(k);
    const double both = 2.0 * m * c.nx * c.ny;
    const double xx = w * c.nx * c.nx + v * c.ny * c.ny - both, yy = w * c.ny * c.ny + v * c.nx * c.nx + both;
    const double xy = (w - v) * c.nx * c.ny + m * (c.nx * c.nx - c.ny * c.ny);
    for (const auto &[n, arm, sign] : {std::tuple{c.i, c.arm_i, 1.0}, std::tuple{c.j, c.arm_j, -1.0}}) {
      first[n].x += xx;
      first[n].y += xy;
      first[n].spin += yy;
      second[n].x -= sign * arm * (v * c.ny - m * c.nx);    // slide = sign (ny, -nx) u - arm spin
      second[n].y += sign * arm * (v * c.nx + m * c.ny);
      second[n].spin += v * arm * arm;
    }
    const double arm = c.share * c.ny * c.ny * c.distance * c.distance;
    flow[0] += arm * xx;
    flow[1] += arm * c.stiffness * c.nx * c.nx;
  }
  exchange.add_from_ghosts(first);
  exchange.add_from_ghosts(second);
  for (int i = 0; i < nlocal; i++) {
    const double shift = BLOCK_SHIFT * (first[i].x + first[i].spin) + settings.background;
    const double a = first[i].x + shift, b = first[i].y, d = first[i].spin + shift;
    const double e = second[i].x, f = second[i].y, g = second[i].spin + shift;
    const double det = a * (d * g - f * f) - b * (b * g - e * f) + e * (b * f - d * e);
    if (!(det > 0.0)) {
      inverse[i] = {};
      continue;
    }
    inverse[i] = {(d * g - f * f) / det, (e * f - b * g) / det, (a * g - e * e) / det,
                  (b * f - d * e) / det, (b * e - a * f) / det, (a * d - b * b) / det};
  }
  MPI_Allreduce(MPI_IN_PLACE, flow, 2, MPI_DOUBLE, MPI_SUM, world);
  flow[0] += settings.fluid;
  inverse_flow = free_rate && flow[0] > 0.0 ? 1.0 / flow[0] : 0.0;
  flow_relaxation = free_rate && flow[1] > 0.0 ? flow[0] / flow[1] : HUGE_VAL;
  choose_factors();
}

/* ----------------------------------------------------------------------
   squared norm that rounding of the contact forces leaves in any residual
------------------------------------------------------------------------- */

double DiskDrag::rounding() const
{
  double total = 0.0;
  for (std::size_t k = 0; k < contacts.size(); k++) {
    const DiskContact &c = contacts[k];
    total += c.share * c.force * c.force / (weights[k] + settings.background);
  }
  return ROUNDING * ROUNDING * amplified * sum(total);
}

/* ----------------------------------------------------------------------
   A disk with too few contacts to hold it keeps no velocity from the last step: nothing would ever
   take away the part that costs no drag. Its neighbours may be loose without it. If the contacts
   that remain are too few to hold the disks that remain, none keeps its velocity.
------------------------------------------------------------------------- */

void DiskDrag::let_go_of_loose(Motions &u)
{
  const double least = law.beta > 0.0 ? 2.0 : 3.0, isostatic = law.beta > 0.0 ? 3.0 : 4.0;
  Motions &held = blocks[0], &count = blocks[1];
  for (auto &one : held) one.x = 1.0;
  for (int round = 0; round < PEELS; round++) {
    std::fill(count.begin(), count.end(), Motion());
    for (const DiskContact &c : contacts) {
      if (held[c.i].x == 0.0 || held[c.j].x == 0.0) continue;
      count[c.i].x += 1.0;
      count[c.j].x += 1.0;
    }
    exchange.add_from_ghosts(count);
    double totals[3] = {0.0, 0.0, 0.0};    // disks that come loose, disks held, ends of their contacts
    for (int i = 0; i < nlocal; i++) {
      if (held[i].x == 0.0) continue;
      if (count[i].x < least) {
        held[i].x = 0.0;
        u[i] = Motion();
        totals[0] += 1.0;
      }
      totals[1] += 1.0;
      totals[2] += count[i].x;
    }
    MPI_Allreduce(MPI_IN_PLACE, totals, 3, MPI_DOUBLE, MPI_SUM, world);
    if (totals[0] == 0.0) {
      if (totals[2] < isostatic * totals[1]) std::fill_n(u.begin(), nlocal, Motion());
      return;
    }
    exchange.send_to_ghosts(held);
  }
}

/* ---------------------------------------------------------------------- */

// of the forces held, too
double DiskDrag::elastic_moment() const
{
  double elastic = 0.0;
  for (const DiskContact &c : contacts) elastic -= c.share * c.force * c.nx * c.ny * c.distance;
  Motions unused(nlocal + nghost);
  for (std::size_t e = 0; e < edged.size(); e++)
    if (edged[e].state == RUBBING) elastic -= push_pair(e, 0.0, edged[e].held, unused);
  return sum(elastic);
}

/* ---------------------------------------------------------------------- */

FlowSums DiskDrag::add_up(const Motions &u, double rate)
{
  FlowSums sums;
  for (std::size_t k = 0; k < contacts.size(); k++) {
    const DiskContact &c = contacts[k];
    double approach, slide;
    slip(c, u, rate, approach, slide);
    const double push = weights[k] * approach;
    const double rub = law.beta * weights[k] * slide + (edge_of[k] < 0 ? 0.0 : edged[edge_of[k]].held);
    const double x = push * c.nx - rub * c.ny, y = push * c.ny + rub * c.nx, part = c.share * c.distance;
    sums.elastic -= part * c.force * c.nx * c.ny;
    sums.viscous += part * x * c.ny;
    sums.xx += part * (x - c.force * c.nx) * c.nx;
    sums.yy += part * (y - c.force * c.ny) * c.ny;
    sums.energy += c.share * c.energy;
    sums.dissipation += c.share * (push * approach + rub * slide);
    sums.contacts += c.share;
  }
  for (int i = 0; i < nlocal; i++) {
    const double square = u[i].x * u[i].x + u[i].y * u[i].y;
    sums.speed += sqrt(square);
    sums.dissipation += settings.background * square;
  }
  MPI_Allreduce(MPI_IN_PLACE, &sums, sizeof(FlowSums) / sizeof(double), MPI_DOUBLE, MPI_SUM, world);
  return sums;
}

/* ----------------------------------------------------------------------
   time in which a contact relaxes: drag over stiffness. The background slows it at least by the
   share of a disk with twelve half contacts. A thin fluid lets the whole box relax as fast.
------------------------------------------------------------------------- */

double DiskDrag::least_relaxation_time() const
{
  double least = HUGE_VAL;
  for (std::size_t k = 0; k < contacts.size(); k++)
    if (contacts[k].stiffness > 0.0)    // rounds to 0 where disks that stiffen barely touch
      least = std::min(least, (weights[k] + settings.background / 12.0) / contacts[k].stiffness);
  return law.alpha * std::min(least, flow_relaxation);
}

/* ---------------------------------------------------------------------- */

double DiskDrag::memory_usage() const
{
  return DragSolver::memory_usage() + weights.capacity() * (sizeof(double) + 2 * sizeof(int) + sizeof(DiskContact)) +
      states.capacity() * sizeof(int) + (3.0 + answers.size()) * blocks[0].capacity() * sizeof(Motion);
}
