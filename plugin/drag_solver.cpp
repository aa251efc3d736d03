// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "drag_solver.h"

#include <algorithm>
#include <cmath>
#include <tuple>

using namespace LAMMPS_NS;

// A disk with few contacts has a singular block; what the shift adds, in parts of its trace, slows convergence only
static constexpr double BLOCK_SHIFT = 1e-3;
// Contacts that move less, compared with all others, drag as if they moved that much: a power law below 1 has no limit
static constexpr double SLOWEST = 1e-5;
static constexpr double STANDSTILL = 1e-30;    // speed over the unit of length and tau, if nothing moves at all
static constexpr double ROUNDING = 4e-16;
static constexpr int MOST_ROUNDS = 200;       // of a power law; the error falls by 1 - alpha in each
static constexpr double INNER = 0.3;          // part of the tolerance that conjugate gradients keep to
static constexpr int PEELS = 20;              // chains of loose disks are shorter

/* ---------------------------------------------------------------------- */

double DragSolver::sum(double value) const
{
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, world);
  return value;
}

/* ---------------------------------------------------------------------- */

void DragSolver::take(const std::vector<DiskContact> &found, const DragLaw &drag, int local, int ghost)
{
  contacts = &found;
  law = drag;
  nlocal = local;
  nghost = ghost;
  weights.resize(found.size());
  for (Motions *each : {&residual, &direction, &product, &blocks[0], &blocks[1]}) each->resize(local + ghost);
  inverse.resize(local);
}

/* ----------------------------------------------------------------------
   approach and slip of j past i, the affine flow included
------------------------------------------------------------------------- */

void DragSolver::slip(const DiskContact &c, const Motions &u, double rate, double &approach, double &slide) const
{
  const Motion &a = u[c.i], &b = u[c.j];
  const double x = b.x - a.x + rate * c.ny * c.distance, y = b.y - a.y;
  approach = x * c.nx + y * c.ny;
  slide = y * c.nx - x * c.ny - c.arm_i * a.spin - c.arm_j * b.spin;
}

/* ----------------------------------------------------------------------
   out = B p + b rate; power = (p, rate) B (p, rate); flow = b p + c rate, of all ranks
------------------------------------------------------------------------- */

void DragSolver::multiply(Motions &p, double rate, Motions &out, double &power, double &flow)
{
  exchange.send_to_ghosts(p);
  std::fill(out.begin(), out.end(), Motion());
  double sums[2] = {0.0, 0.0};
  for (std::size_t k = 0; k < contacts->size(); k++) {
    const DiskContact &c = (*contacts)[k];
    double approach, slide;
    slip(c, p, rate, approach, slide);
    const double push = weights[k] * approach, rub = law.beta * weights[k] * slide;
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

/* ----------------------------------------------------------------------
   drag over velocity at each contact: k tau, times (tau speed)^(alpha - 1) of a power law
------------------------------------------------------------------------- */

void DragSolver::find_weights(const Motions &u, double rate)
{
  for (std::size_t k = 0; k < contacts->size(); k++) weights[k] = (*contacts)[k].stiffness * law.tau;
  if (law.alpha == 1.0) return;

  double sums[2] = {0.0, 0.0};
  std::vector<double> square(contacts->size());
  for (std::size_t k = 0; k < contacts->size(); k++) {
    double approach, slide;
    slip((*contacts)[k], u, rate, approach, slide);
    square[k] = law.tau * law.tau * (approach * approach + law.beta * slide * slide);
    sums[0] += (*contacts)[k].share * square[k];
    sums[1] += (*contacts)[k].share;
  }
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, world);
  const double slowest = SLOWEST * SLOWEST * (sums[1] > 0.0 ? sums[0] / sums[1] : 0.0) + STANDSTILL * STANDSTILL;
  for (std::size_t k = 0; k < contacts->size(); k++) weights[k] *= pow(square[k] + slowest, 0.5 * (law.alpha - 1.0));
}

/* ----------------------------------------------------------------------
   the block of each disk in B, inverted; and c
------------------------------------------------------------------------- */

void DragSolver::find_preconditioner(bool free_rate)
{
  Motions &first = blocks[0], &second = blocks[1];    // xx xy yy, xs ys ss: two exchanges of three numbers
  std::fill(first.begin(), first.end(), Motion());
  std::fill(second.begin(), second.end(), Motion());
  double c_flow = 0.0;
  for (std::size_t k = 0; k < contacts->size(); k++) {
    const DiskContact &c = (*contacts)[k];
    const double w = weights[k], v = law.beta * w;
    const double xx = w * c.nx * c.nx + v * c.ny * c.ny, yy = w * c.ny * c.ny + v * c.nx * c.nx;
    const double xy = (w - v) * c.nx * c.ny;
    for (const auto &[n, arm, sign] : {std::tuple{c.i, c.arm_i, 1.0}, std::tuple{c.j, c.arm_j, -1.0}}) {
      first[n].x += xx;
      first[n].y += xy;
      first[n].spin += yy;
      second[n].x -= sign * v * arm * c.ny;    // slide = sign (ny, -nx) u - arm spin
      second[n].y += sign * v * arm * c.nx;
      second[n].spin += v * arm * arm;
    }
    c_flow += c.share * xx * c.ny * c.ny * c.distance * c.distance;
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
  c_flow = sum(c_flow);
  inverse_flow = free_rate && c_flow > 0.0 ? 1.0 / c_flow : 0.0;
}

/* ----------------------------------------------------------------------
   z = M^-1 r; r z over all ranks
------------------------------------------------------------------------- */

double DragSolver::precondition(const Motions &r, double r_flow, Motions &z, double &z_flow)
{
  double product = 0.0;
  for (int i = 0; i < nlocal; i++) {
    const Block &m = inverse[i];
    const Motion v = r[i];
    z[i].x = m.xx * v.x + m.xy * v.y + m.xs * v.spin;
    z[i].y = m.xy * v.x + m.yy * v.y + m.ys * v.spin;
    z[i].spin = m.xs * v.x + m.ys * v.y + m.ss * v.spin;
    product += v.x * z[i].x + v.y * z[i].y + v.spin * z[i].spin;
  }
  z_flow = inverse_flow * r_flow;
  return sum(product) + r_flow * z_flow;
}

/* ----------------------------------------------------------------------
   squared norm that rounding of the contact forces leaves in any residual
------------------------------------------------------------------------- */

double DragSolver::rounding() const
{
  double total = 0.0;
  for (std::size_t k = 0; k < contacts->size(); k++) {
    const DiskContact &c = (*contacts)[k];
    total += c.share * c.force * c.force / (weights[k] + settings.background);
  }
  return ROUNDING * ROUNDING * sum(total);
}

/* ----------------------------------------------------------------------
   force: on the owned disks. u: in, where to start; out, the velocities, ghosts too
------------------------------------------------------------------------- */

DragSolver::Result DragSolver::solve(const Motions &force, Motions &u, Load &load)
{
  Result result = {0, false, 0.0};
  Motions z(nlocal + nghost);
  for (int round = 0; round < MOST_ROUNDS; round++) {
    exchange.send_to_ghosts(u);
    find_weights(u, load.rate);
    if (round == 0 || law.alpha != 1.0) find_preconditioner(load.free_rate);

    // what drives the flow, and what of it the present velocities do not balance

    double power, flow, z_flow;
    Motions &still = direction;
    std::fill(still.begin(), still.end(), Motion());
    multiply(still, load.free_rate ? 0.0 : load.rate, product, power, flow);
    for (int i = 0; i < nlocal; i++)
      residual[i] = {force[i].x - product[i].x, force[i].y - product[i].y, force[i].spin - product[i].spin};
    const double driven = precondition(residual, load.free_rate ? load.moment : 0.0, z, z_flow);
    const double enough = std::max(settings.tolerance * settings.tolerance * driven, rounding());

    multiply(u, load.rate, product, power, flow);
    for (int i = 0; i < nlocal; i++)
      residual[i] = {force[i].x - product[i].x, force[i].y - product[i].y, force[i].spin - product[i].spin};
    double r_flow = load.free_rate ? load.moment - flow : 0.0;
    double rho = precondition(residual, r_flow, z, z_flow);
    result.residual = driven > 0.0 ? sqrt(rho / driven) : 0.0;
    if (!(rho > enough)) {
      result.converged = std::isfinite(rho);
      break;
    }

    std::copy_n(z.begin(), nlocal, direction.begin());
    double p_flow = z_flow;
    while (rho > INNER * INNER * enough && result.iterations < settings.iterations) {
      result.iterations++;
      multiply(direction, p_flow, product, power, flow);
      if (!(power > 0.0)) break;
      const double step = rho / power;
      for (int i = 0; i < nlocal; i++) {
        u[i].x += step * direction[i].x;
        u[i].y += step * direction[i].y;
        u[i].spin += step * direction[i].spin;
        residual[i].x -= step * product[i].x;
        residual[i].y -= step * product[i].y;
        residual[i].spin -= step * product[i].spin;
      }
      if (load.free_rate) {
        load.rate += step * p_flow;
        r_flow -= step * flow;
      }
      const double before = rho;
      rho = precondition(residual, r_flow, z, z_flow);
      const double keep = rho / before;
      for (int i = 0; i < nlocal; i++) {
        direction[i].x = z[i].x + keep * direction[i].x;
        direction[i].y = z[i].y + keep * direction[i].y;
        direction[i].spin = z[i].spin + keep * direction[i].spin;
      }
      p_flow = z_flow + keep * p_flow;
    }
    if (law.alpha == 1.0) {
      result.residual = driven > 0.0 ? sqrt(rho / driven) : 0.0;
      result.converged = rho <= enough;
      break;
    }
    if (result.iterations >= settings.iterations) break;
  }
  exchange.send_to_ghosts(u);
  find_weights(u, load.rate);
  return result;
}

/* ----------------------------------------------------------------------
   A disk with too few contacts to hold it keeps no velocity from the last step: nothing would ever
   take away the part that costs no drag. Its neighbours may be loose without it. If the contacts
   that remain are too few to hold the disks that remain, none keeps its velocity.
------------------------------------------------------------------------- */

void DragSolver::let_go_of_loose_disks(Motions &u)
{
  const double least = law.beta > 0.0 ? 2.0 : 3.0, isostatic = law.beta > 0.0 ? 3.0 : 4.0;
  Motions &held = direction, &count = product;
  for (auto &one : held) one.x = 1.0;
  for (int round = 0; round < PEELS; round++) {
    std::fill(count.begin(), count.end(), Motion());
    for (const DiskContact &c : *contacts) {
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

/* ----------------------------------------------------------------------
   time in which a contact relaxes: drag over stiffness. The background slows it at least by the
   share of a disk with twelve half contacts.
------------------------------------------------------------------------- */

double DragSolver::least_relaxation_time() const
{
  double least = HUGE_VAL;
  for (std::size_t k = 0; k < contacts->size(); k++)
    least = std::min(least, (weights[k] + settings.background / 12.0) / (*contacts)[k].stiffness);
  return law.alpha * least;
}

/* ---------------------------------------------------------------------- */

double DragSolver::memory_usage() const
{
  return weights.capacity() * sizeof(double) + inverse.capacity() * sizeof(Block) +
      5 * residual.capacity() * sizeof(Motion);
}
