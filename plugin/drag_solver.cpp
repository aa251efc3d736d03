// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#include "drag_solver.h"

#include <algorithm>
#include <cmath>

using namespace LAMMPS_NS;

// Contacts that move less, compared with all others, drag as if they moved that much: a power law below 1 has no limit
static constexpr double SLOWEST = 1e-5;
static constexpr double STANDSTILL = 1e-30;    // speed over the unit of length and tau, if nothing moves at all
static constexpr int MOST_ROUNDS = 200;       // of a power law; of droplets the error falls by 1 - alpha in each
static constexpr double INNER = 0.3;          // part of the tolerance that conjugate gradients keep to
static constexpr double FORCING = 1e-4;       // part of the squared residual that a step of Newton's may leave
static constexpr double LESS = 0.5;           // squared residual after such a step, over that before, that will do
static constexpr double SHORTEST = 0.01;      // part of such a step

double DragSolver::sum(double value) const
{
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, world);
  return value;
}

void DragSolver::make_room(int local, int ghost)
{
  nlocal = local;
  nghost = ghost;
  for (Field *each : {&residual, &direction, &product, &start, &descent}) each->resize(local + ghost);
  inverse.resize(local);
}

/* squares: of the velocities of the contacts of this rank */
double DragSolver::speed_floor(double squares, double count) const
{
  double sums[2] = {squares, count};
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, world);
  return SLOWEST * SLOWEST * (sums[1] > 0.0 ? sums[0] / sums[1] : 0.0) + STANDSTILL * STANDSTILL;
}

/* descent = M^-1 residual; residual descent over all ranks */
double DragSolver::precondition(double r_flow, double &z_flow)
{
  double product = 0.0;
  for (int i = 0; i < nlocal; i++) {
    const Block &m = inverse[i];
    const Vec3 v = residual[i];
    Vec3 &z = descent[i];
    z.x = m.xx * v.x + m.xy * v.y + m.xs * v.spin;
    z.y = m.xy * v.x + m.yy * v.y + m.ys * v.spin;
    z.spin = m.xs * v.x + m.ys * v.y + m.ss * v.spin;
    product += v.x * z.x + v.y * z.y + v.spin * z.spin;
  }
  z_flow = inverse_flow * r_flow;
  return sum(product) + r_flow * z_flow;
}

/* squared norm of what drives the flow: forces, and the drag of the affine flow alone */
double DragSolver::rhs_norm(const Field &force, const Load &load)
{
  double power, flow, z_flow;
  std::fill(direction.begin(), direction.end(), Vec3());
  multiply(direction, load.free_rate ? 0.0 : load.rate, product, power, flow);
  std::copy_n(force.begin(), nlocal, residual.begin());
  field_add(residual, -1.0, product, nlocal);
  return precondition(load.free_rate ? load.moment : 0.0, z_flow);
}

/* residual = F - ahead K (u - start) - B u - b rate; returns that of the rate, where it is free */
double DragSolver::find_residual(const Field &force, Field &u, const Load &load, bool moved)
{
  double power, flow, ahead = 0.0, without = 0.0;
  multiply(u, load.rate, product, power, flow);
  std::copy_n(force.begin(), nlocal, residual.begin());
  field_add(residual, -1.0, product, nlocal);
  if (moved && looks_ahead()) {
    for (int i = 0; i < nlocal; i++)
      direction[i] = {u[i].x - start[i].x, u[i].y - start[i].y, u[i].spin - start[i].spin};
    multiply_ahead(direction, load.rate - start_rate, product, power, ahead);
    field_add(residual, -1.0, product, nlocal);
    multiply(direction, load.rate - start_rate, product, power, without);
    field_add(residual, 1.0, product, nlocal);
  }
  return load.free_rate ? load.moment - flow - settings.fluid * load.rate - ahead + without : 0.0;
}

/* conjugate gradients from the residual on; returns its squared norm */
double DragSolver::conjugate_gradients(Field &u, Load &load, double r_flow, double enough, Result &result)
{
  double z_flow;
  double rho = precondition(r_flow, z_flow);
  std::copy_n(descent.begin(), nlocal, direction.begin());
  double p_flow = z_flow;
  needs_flow = load.free_rate;
  while (rho > INNER * INNER * enough && result.iterations < settings.iterations) {
    result.iterations++;
    double power, flow;
    multiply_ahead(direction, p_flow, product, power, flow);
    flow += settings.fluid * p_flow;
    power += settings.fluid * p_flow * p_flow;
    result.positive = power > 0.0;
    if (!result.positive) break;
    const double step = rho / power;
    field_add(u, step, direction, nlocal);
    field_add(residual, -step, product, nlocal);
    if (load.free_rate) {
      load.rate += step * p_flow;
      r_flow -= step * flow;
    }
    const double before = rho;
    rho = precondition(r_flow, z_flow);
    const double keep = rho / before;
    for (int i = 0; i < nlocal; i++) {
      direction[i].x = descent[i].x + keep * direction[i].x;
      direction[i].y = descent[i].y + keep * direction[i].y;
      direction[i].spin = descent[i].spin + keep * direction[i].spin;
    }
    p_flow = z_flow + keep * p_flow;
  }
  needs_flow = true;
  return rho;
}

void DragSolver::keep(State &state, const Field &force, const Field &u, const Load &load) const
{
  state.force.assign(force.begin(), force.begin() + nlocal);
  state.u.assign(u.begin(), u.begin() + nlocal);
  state.rate = load.rate;
  state.moment = load.moment;
  state.held = multipliers();
}

/* back to a part of a step of Newton's that lessens the residual, whose squared norm was rho: contacts that should come
   to rest are thrown as far to the other side by the whole of it */
void DragSolver::line_search(double rho, Field &force, Field &u, Load &load)
{
  keep(after, force, u, load);
  const auto between = [&](double part, const Field &a, const Field &b, Field &out) {
    for (int i = 0; i < nlocal; i++)
      out[i] = {a[i].x + part * (b[i].x - a[i].x), a[i].y + part * (b[i].y - a[i].y),
                a[i].spin + part * (b[i].spin - a[i].spin)};
  };
  const auto left = [&](double part) {
    between(part, before.force, after.force, force);
    between(part, before.u, after.u, u);
    load.rate = before.rate + part * (after.rate - before.rate);
    load.moment = before.moment + part * (after.moment - before.moment);
    std::vector<double> part_held(after.held);
    for (std::size_t e = 0; e < part_held.size(); e++)
      part_held[e] = before.held[e] + part * (after.held[e] - before.held[e]);
    set_multipliers(part_held);
    exchange.send_to_ghosts(u);
    find_weights(u, load.rate);
    double z_flow;
    return precondition(find_residual(force, u, load, false), z_flow);
  };
  double best = 1.0, last = 1.0, least = left(1.0);
  for (double part = 0.5; part > SHORTEST && !(least <= LESS * rho); part *= 0.5) {
    const double found = left(last = part);
    if (found < least) {
      least = found;
      best = part;
    }
  }
  if (best != last) left(best);
}

/* force: on the owned atoms. u: in, where to start; out, the velocities, ghosts too */
DragSolver::Result DragSolver::solve(Field &force, Field &u, Load &load)
{
  Result result = {0, false, 0.0, true};
  start_rate = load.rate;
  std::copy_n(u.begin(), nlocal, start.begin());
  bool newton = false;
  for (int round = 0; round < MOST_ROUNDS; round++) {
    exchange.send_to_ghosts(u);
    find_weights(u, load.rate);
    newton = law.alpha != 1.0 && find_slopes(u, load.rate);
    if (round == 0 || law.alpha != 1.0) find_preconditioner(load.free_rate);
    if (newton) last_iterations = 0;    // each step has a matrix of its own
    const double driven = rhs_norm(force, load);
    const double enough = std::max(settings.tolerance * settings.tolerance * driven, rounding());

    double z_flow;
    const double r_flow = find_residual(force, u, load, round > 0);
    double rho = precondition(r_flow, z_flow);
    result.residual = driven > 0.0 ? sqrt(std::max(rho, 0.0) / driven) : 0.0;
    result.converged = rho <= enough;
    if (result.converged || !std::isfinite(rho)) {
      if (!result.converged || !enforce_constraints(force, u, load, result)) break;
      continue;
    }

    if (newton) keep(before, force, u, load);
    const double rho_before = rho;
    const int earlier = result.iterations;
    rho = conjugate_gradients(u, load, r_flow, newton ? std::max(enough, FORCING * rho) : enough, result);
    if (!result.positive) break;
    if (newton) last_iterations = result.iterations - earlier;
    const bool holds = enforce_constraints(force, u, load, result);
    if (newton) line_search(rho_before, force, u, load);
    if (law.alpha == 1.0 && !holds) {
      result.residual = driven > 0.0 ? sqrt(std::max(rho, 0.0) / driven) : 0.0;
      result.converged = rho <= enough;
      break;
    }
    if (result.iterations >= settings.iterations) break;
  }
  if (!newton) last_iterations = result.iterations;
  exchange.send_to_ghosts(u);
  find_weights(u, load.rate);
  return result;
}

void DragSolver::set_solution(Field &u, double rate)
{
  exchange.send_to_ghosts(u);
  std::copy_n(u.begin(), nlocal, start.begin());
  start_rate = rate;
  find_weights(u, rate);
}

double DragSolver::memory_usage() const
{
  return inverse.capacity() * sizeof(Block) + 5.0 * residual.capacity() * sizeof(Vec3);
}
