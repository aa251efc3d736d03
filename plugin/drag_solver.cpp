// SPDX-License-Identifier: GPL-2.0-or-later
#include "drag_solver.h"

#include "wide_vectors.h"

#include <algorithm>
#include <cmath>
#include <numeric>

using namespace LAMMPS_NS;

// Contacts slower than that, over all others, drag as if they moved so: a power law below 1 diverges
static constexpr double SLOWEST = 1e-5;
static constexpr double STANDSTILL = 1e-30;    // speed, unit of length over tau, if nothing moves
static constexpr int MOST_ROUNDS = 200;    // of a power law; errors of droplets fall by 1 - alpha
static constexpr int FEWEST = 2, FEWEST_FACTORED = 1;    // iterations whose gain tells what is left
static constexpr double INNER = 0.3;    // of the tolerance, for conjugate gradients of droplets
static constexpr double FORCING = 1e-8;    // of the energy of the error, which a step of Newton's may leave
static constexpr double LESS = 0.5;    // squared residual after such a step, over that before, that will do
static constexpr double SHORTEST = 0.01;      // part of such a step

// eight sums side by side, since each addition waits for the one before
JAMLAB_WIDE_VECTORS double LAMMPS_NS::field_dot(const Field &a, const Field &b, int n)
{
  constexpr int SUMS = 8;
  const double *const p = reinterpret_cast<const double *>(a.data());
  const double *const q = reinterpret_cast<const double *>(b.data());
  double sums[SUMS] = {};
  int k = 0;
  for (; k + SUMS <= 3 * n; k += SUMS)
    for (int m = 0; m < SUMS; m++) sums[m] += p[k + m] * q[k + m];
  for (; k < 3 * n; k++) sums[0] += p[k] * q[k];
  return std::accumulate(sums, sums + SUMS, 0.0);
}

JAMLAB_WIDE_VECTORS static void take_numbers(int n, double keep, double step, const double *__restrict z,
                                             const double *__restrict w, double *__restrict p, double *__restrict s,
                                             double *__restrict u, double *__restrict r)
{
  for (int k = 0; k < n; k++) {
    p[k] = z[k] + keep * p[k];
    s[k] = w[k] + keep * s[k];
    u[k] += step * p[k];
    r[k] -= step * s[k];
  }
}

double DragSolver::sum(double value) const
{
  MPI_Allreduce(MPI_IN_PLACE, &value, 1, MPI_DOUBLE, MPI_SUM, world);
  return value;
}

void DragSolver::make_room(int local, int ghost)
{
  nlocal = local;
  nghost = ghost;
  for (Field *each : {&residual, &direction, &product, &product_of_direction, &start, &descent})
    each->resize(local + ghost);
  inverse.resize(local);
}

/* squares: of the velocities of the contacts of this rank */
double DragSolver::speed_floor(double squares, double count) const
{
  double sums[2] = {squares, count};
  MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, world);
  return SLOWEST * SLOWEST * (sums[1] > 0.0 ? sums[0] / sums[1] : 0.0) + STANDSTILL * STANDSTILL;
}

/* x and y side by side, in the order of Block */
double DragSolver::precondition()
{
  using Pair = double __attribute__((vector_size(16), aligned(8), may_alias));
  const auto pair = [](const double &first) { return *reinterpret_cast<const Pair *>(&first); };
  Pair sums = {0.0, 0.0};
  double turning = 0.0;
  for (int i = 0; i < nlocal; i++) {
    const Block &m = inverse[i];
    const Vec3 &v = residual[i];
    const Pair flat = pair(m.xx) * v.x + pair(m.xy) * v.y + pair(m.xs) * v.spin;
    const Pair turn = pair(m.xs) * pair(v.x);
    descent[i] = {flat[0], flat[1], turn[0] + turn[1] + m.ss * v.spin};
    sums += flat * pair(v.x);
    turning += descent[i].spin * v.spin;
  }
  return sums[0] + sums[1] + turning;
}

/* of atoms whose velocities are not given */
double DragSolver::precondition_free()
{
  for (std::size_t i = 0; i < given.size(); i++)
    if (given[i]) residual[i] = Vec3();
  return precondition();
}

double DragSolver::follow(const Field &u, double rate, Field &force)
{
  if (!looks_ahead()) return 0.0;
  double power, flow, power_of_drag, flow_of_drag;
  for (int i = 0; i < nlocal; i++) direction[i] = u[i] - start[i];
  multiply_ahead(direction, rate - start_rate, product, power, flow);
  field_add(force, -1.0, product, nlocal);
  multiply(direction, rate - start_rate, product, power_of_drag, flow_of_drag);
  field_add(force, 1.0, product, nlocal);
  return flow - flow_of_drag;
}

void DragSolver::net_forces(Field &force, Field &u, double rate, Field &net)
{
  double power, flow;
  follow(u, rate, force);
  net.resize(nlocal + nghost);
  multiply(u, rate, net, power, flow);
  for (int i = 0; i < nlocal; i++)
    net[i] = {force[i].x - net[i].x, force[i].y - net[i].y, force[i].spin - net[i].spin};
}

/* residual = F - ahead K (u - start) - B u - b rate */
DragSolver::Residual DragSolver::find_residual(const Field &force, Field &u, const Load &load, bool moved)
{
  double power, flow;
  multiply(u, load.rate, product, power, flow);
  std::copy_n(force.begin(), nlocal, residual.begin());
  field_add(residual, -1.0, product, nlocal);
  const double followed = moved ? follow(u, load.rate, residual) : 0.0;
  const double fluid = settings.fluid * load.rate;
  const double dissipation = std::max(power, affine_drag * load.rate * load.rate) + fluid * load.rate;
  return {load.free_rate ? load.moment - flow - fluid - followed : 0.0, dissipation};
}

/* From the residual on, with the sums of an iteration in one exchange (Chronopoulos & Gear, J. Comput.
   Appl. Math. 25, 153 (1989)): products of directions follow from those of preconditioned residuals */
DragSolver::Energies DragSolver::conjugate_gradients(Field &u, Load &load, double r_flow, const Goal &goal,
                                                     Result &result)
{
  Energies found = {0.0, 0.0, goal.dissipation, false};
  const int first = result.iterations, fewest = factored ? FEWEST_FACTORED : FEWEST;
  double rho_first = 0.0, rho_before = 0.0, gain = 0.0, step = 0.0, p_flow = 0.0, product_flow = 0.0;
  for (Field *each : {&direction, &product_of_direction}) std::fill_n(each->begin(), nlocal, Vec3());
  needs_flow = load.free_rate;
  while (!found.reached && result.iterations < settings.iterations) {
    const double z_flow = inverse_flow * r_flow;
    double rho = precondition_free(), power, flow;
    multiply_ahead(descent, z_flow, product, power, flow, &rho);
    rho += r_flow * z_flow;
    if (!(rho > 0.0)) {    // no residual, but for rounding
      found.left = std::isnan(rho) ? rho : 0.0;
      found.reached = !std::isnan(rho);
      break;
    }
    if (result.iterations == first) rho_first = rho;
    if (result.iterations >= first + fewest) {
      found.left = rho * std::max(found.gained / rho_first, gain / rho_before);
      const double accurate = goal.accuracy * goal.accuracy * found.whole;
      found.reached = found.left <= std::max({accurate, goal.part * found.gained, goal.least});
    }
    if (looks_ahead()) {
      found.left = rho;
      found.reached = rho <= INNER * INNER * goal.least;
    }
    if (found.reached) break;
    flow += settings.fluid * z_flow;
    power += settings.fluid * z_flow * z_flow;
    result.positive = power > 0.0;
    if (!result.positive) break;
    double keep = result.iterations > first ? rho / rho_before : 0.0;
    if (keep * rho < step * power)
      power -= keep * rho / step;
    else
      keep = 0.0;    // the first direction, or where rounding leaves no conjugate one
    result.iterations++;
    rho_before = rho;
    step = rho / power;
    take_step(keep, step, u);
    p_flow = z_flow + keep * p_flow;
    product_flow = flow + keep * product_flow;
    if (load.free_rate) {
      load.rate += step * p_flow;
      r_flow -= step * product_flow;
    }
    gain = step * rho;
    found.gained += gain;
    found.whole += gain;
  }
  needs_flow = true;
  return found;
}

/* direction and its product from the last iteration's, and a step along it */
void DragSolver::take_step(double keep, double step, Field &u)
{
  if (nlocal == 0) return;
  take_numbers(3 * nlocal, keep, step, &descent[0].x, &product[0].x, &direction[0].x, &product_of_direction[0].x,
               &u[0].x, &residual[0].x);
}

/* squared norm, by the preconditioner, of what drives droplets: forces and the drag of the affine flow.
   Their response to a rate nearly cancels it: errors have far more energy than iterations take away */
double DragSolver::driving_norm(const Field &force, const Load &load)
{
  double power, flow;
  std::fill(direction.begin(), direction.end(), Vec3());
  multiply(direction, load.free_rate ? 0.0 : load.rate, product, power, flow);
  std::copy_n(force.begin(), nlocal, residual.begin());
  field_add(residual, -1.0, product, nlocal);
  return norm(load.free_rate ? load.moment : 0.0);
}

/* squared norm of the residual by the preconditioner: of two residuals it tells the smaller one */
double DragSolver::norm(double r_flow)
{
  return sum(precondition_free()) + inverse_flow * r_flow * r_flow;
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
    for (int i = 0; i < nlocal; i++) out[i] = a[i] + part * (b[i] - a[i]);
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
    return norm(find_residual(force, u, load, false).flow);
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
    const double driven = looks_ahead() ? driving_norm(force, load) : 0.0;
    const double least = std::max(settings.tolerance * settings.tolerance * driven, rounding());
    const Residual rest = find_residual(force, u, load, round > 0);
    const double rho = newton || looks_ahead() ? norm(rest.flow) : 0.0;
    if (looks_ahead()) {
      result.residual = driven > 0.0 ? sqrt(rho / driven) : 0.0;
      result.converged = rho <= least;
      if (result.converged || !std::isfinite(rho)) break;
    }
    if (newton) keep(before, force, u, load);
    const int earlier = result.iterations;
    const Goal goal = {settings.tolerance, newton ? FORCING : 0.0, least, rest.dissipation};
    const Energies found = conjugate_gradients(u, load, rest.flow, goal, result);
    if (!result.positive) break;
    if (newton) last_iterations = result.iterations - earlier;
    // of a power law, what this round took away is what the last one left
    const bool linear = law.alpha == 1.0;
    const double left = linear || looks_ahead() ? found.left : found.gained;
    const double whole = looks_ahead() ? driven : found.whole;
    result.residual = left > 0.0 ? sqrt(left / whole) : left;
    result.converged = found.reached && left <= std::max(settings.tolerance * settings.tolerance * whole, least) &&
        (linear || !looks_ahead());    // droplets are judged by the next drag coefficients
    const bool holds = enforce_constraints(force, u, load, result);
    if (!holds && (result.converged || linear)) break;
    if (newton) line_search(rho, force, u, load);
    result.converged = false;
    if (result.iterations >= settings.iterations || !std::isfinite(left)) break;
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
