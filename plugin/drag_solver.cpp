// SPDX-License-Identifier: GPL-2.0-or-later
#include "drag_solver.h"

#include "wide_vectors.h"

#include <algorithm>
#include <cmath>
#include <numeric>

using namespace LAMMPS_NS;

static constexpr int MOST_ROUNDS = 200;    // of a power law; errors of droplets fall by 1 - alpha
static constexpr int FEWEST = 2, FEWEST_FACTORED = 1;    // iterations whose gain tells what is left
static constexpr double INNER = 0.3;    // of the tolerance, for conjugate gradients of droplets
static constexpr double FORCING = 1e-8;    // of the error's energy, that a Newton step may leave
static constexpr double LESS = 0.5;    // squared residual over that before a Newton step, to accept
static constexpr double SHORTEST = 0.01;    // part of a Newton step

/* Eight sums stand side by side, since each addition waits for the one before. */
JAMLAB_WIDE_VECTORS double LAMMPS_NS::field_dot(const Field &a, const Field &b, int n)
{
  constexpr int SUMS = 8;
  const double *const p = numbers(a), *const q = numbers(b);
  double sums[SUMS] = {};
  int k = 0;
  for (; k + SUMS <= 3 * n; k += SUMS)
    for (int m = 0; m < SUMS; m++) sums[m] += p[k + m] * q[k + m];
  for (; k < 3 * n; k++) sums[0] += p[k] * q[k];
  return std::accumulate(sums, sums + SUMS, 0.0);
}

/* One iteration: direction p and its product s follow from the preconditioned residual z and its
   product w; solution u and residual r take a step along them. All have n numbers. */
JAMLAB_WIDE_VECTORS static void
take_step(int n, double keep, double step, const double *__restrict z, const double *__restrict w,
          double *__restrict p, double *__restrict s, double *__restrict u, double *__restrict r)
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

void DragSolver::driving_forces(Field &force) const
{
  elastic_forces(force);
  for (std::size_t i = 0; i < body.size(); i++) force[i] += body[i];
}

double DragSolver::body_work(const Field &displacement) const
{
  double total = 0.0;
  for (std::size_t i = 0; i < body.size(); i++)
    total += body[i].x * displacement[i].x + body[i].y * displacement[i].y;
  return total;
}

void DragSolver::make_room(int local, int ghost)
{
  nlocal = local;
  nghost = ghost;
  for (Field *each :
       {&residual, &direction, &product, &product_of_direction, &initial_velocity, &descent})
    each->resize(local + ghost);
}

void DragSolver::hold(const std::vector<char> &atoms, const Field &per_rate)
{
  given = atoms;
  carried = per_rate;
  if (!carried.empty()) exchange.send_to_ghosts(carried);
}

double DragSolver::driven_moment(const Field &force) const
{
  const double elastic = elastic_moment();
  return carried.empty() ? elastic : elastic - sum(field_dot(force, carried, nlocal));
}

/* Atoms whose velocities are given keep them. */
double DragSolver::precondition_free()
{
  for (std::size_t i = 0; i < given.size(); i++)
    if (given[i]) residual[i] = Vec3();
  return precondition();
}

/* Takes forces to the end of the step, force - ahead K (u - u_initial); returns their stress. */
double DragSolver::advance_forces(const Field &u, double rate, Field &force)
{
  if (!looks_ahead()) return 0.0;
  for (int i = 0; i < nlocal; i++) direction[i] = u[i] - initial_velocity[i];
  const Product whole = multiply(direction, rate - initial_rate, TANGENT, product);
  field_add(force, -1.0, product, nlocal);
  const Product drag = multiply(direction, rate - initial_rate, DRAG, product);
  field_add(force, 1.0, product, nlocal);
  return whole.flow - drag.flow;
}

void DragSolver::net_forces(Field &force, Field &u, double rate, Field &net)
{
  advance_forces(u, rate, force);
  net.resize(nlocal + nghost);
  multiply(u, rate, DRAG, net);
  for (int i = 0; i < nlocal; i++) net[i] = force[i] - net[i];
}

/* residual = F - ahead K (u - u_initial) - B u - b rate */
DragSolver::Residual DragSolver::find_residual(const Field &force, Field &u, const Load &load,
                                               bool moved)
{
  const Product drag = multiply(u, load.rate, DRAG, product);
  std::copy_n(force.begin(), nlocal, residual.begin());
  field_add(residual, -1.0, product, nlocal);
  const double stress_ahead = moved ? advance_forces(u, load.rate, residual) : 0.0;
  const double fluid = settings.fluid * load.rate;
  const double power = std::max(drag.power, affine_drag * load.rate * load.rate);
  return {load.free_rate ? load.moment - drag.flow - fluid - stress_ahead : 0.0,
          power + fluid * load.rate};
}

/* Conjugate gradients start from the residual. Products of directions follow from those of
   preconditioned residuals, so that one exchange holds the sums of an iteration (Chronopoulos &
   Gear, J. Comput. Appl. Math. 25, 153 (1989)). */
DragSolver::Energies DragSolver::conjugate_gradients(Field &u, Load &load, double r_flow,
                                                     const Goal &goal, Result &result)
{
  Descent so_far = begin_descent(goal, r_flow);
  for (Field *each : {&direction, &product_of_direction})
    std::fill_n(each->begin(), nlocal, Vec3());
  needs_flow = load.free_rate;
  while (goes_on(so_far, result) && iterate(so_far, precondition_free(), u, load, result)) {}
  needs_flow = true;
  return so_far.found;
}

bool DragSolver::iterate(Descent &d, double rho, Field &u, Load &load, Result &result)
{
  Energies &found = d.found;
  const double z_flow = inverse_flow * d.r_flow;
  for (std::size_t i = 0; i < given.size() && !carried.empty(); i++)
    if (given[i]) descent[i] = z_flow * carried[i];
  auto [power, flow, affine_flow] = multiply(descent, z_flow, TANGENT, product, &rho);
  rho += d.r_flow * z_flow;
  if (!(rho > 0.0)) {    // no residual, but for rounding
    found.left = std::isnan(rho) ? rho : 0.0;
    found.reached = !std::isnan(rho);
    return false;
  }
  if (d.taken == 0) d.rho_first = rho;
  if (d.taken >= (factored ? FEWEST_FACTORED : FEWEST)) {
    found.left = rho * std::max(found.gained / d.rho_first, d.gain / d.rho_before);
    const double accurate = d.goal.accuracy * d.goal.accuracy * found.whole;
    found.reached = found.left <= std::max({accurate, d.goal.part * found.gained, d.goal.least});
  }
  if (looks_ahead()) {
    found.left = rho;
    found.reached = rho <= INNER * INNER * d.goal.least;
  }
  if (found.reached) return false;
  flow += settings.fluid * z_flow;
  power += settings.fluid * z_flow * z_flow;
  result.positive = power > 0.0;
  if (!result.positive) return false;
  double keep = d.taken > 0 ? rho / d.rho_before : 0.0;
  if (keep * rho < d.step * power)
    power -= keep * rho / d.step;
  else
    keep = 0.0;    // the first direction, or where rounding leaves no conjugate one
  d.taken++;
  result.iterations++;
  d.rho_before = rho;
  d.step = rho / power;
  take_step(3 * nlocal, keep, d.step, numbers(descent), numbers(product), numbers(direction),
            numbers(product_of_direction), numbers(u), numbers(residual));
  d.p_flow = z_flow + keep * d.p_flow;
  d.product_flow = flow + keep * d.product_flow;
  if (load.free_rate) {
    load.rate += d.step * d.p_flow;
    d.r_flow -= d.step * d.product_flow;
  }
  d.gain = d.step * rho;
  found.gained += d.gain;
  found.whole += d.gain;
  return true;
}

/* Droplets are driven by forces and the drag of the affine flow. This is their squared norm by the
   preconditioner. The response to a rate nearly cancels it: errors have far more energy than
   iterations take away. */
double DragSolver::driving_norm(const Field &force, const Load &load)
{
  std::fill(direction.begin(), direction.end(), Vec3());
  multiply(direction, load.free_rate ? 0.0 : load.rate, DRAG, product);
  std::copy_n(force.begin(), nlocal, residual.begin());
  field_add(residual, -1.0, product, nlocal);
  return norm(load.free_rate ? load.moment : 0.0);
}

DragSolver::State DragSolver::state(const Field &force, const Field &u, const Load &load) const
{
  const auto owned = [this](const Field &f) { return Field(f.begin(), f.begin() + nlocal); };
  return {owned(force), owned(u), load, multipliers()};
}

/* Goes back to a part of a Newton step that lessens the residual, whose squared norm was rho. The
   whole step throws contacts that should come to rest as far to the other side. */
void DragSolver::line_search(const State &before, double rho, Field &force, Field &u, Load &load)
{
  const State after = state(force, u, load);
  const auto between = [&](double part, const Field &a, const Field &b, Field &out) {
    for (int i = 0; i < nlocal; i++) out[i] = a[i] + part * (b[i] - a[i]);
  };
  const auto left = [&](double part) {
    between(part, before.force, after.force, force);
    between(part, before.u, after.u, u);
    load.rate = before.load.rate + part * (after.load.rate - before.load.rate);
    load.moment = before.load.moment + part * (after.load.moment - before.load.moment);
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

/* The force is that on owned atoms. The velocities u go in as a first guess and come out with those
   of ghosts. */
DragSolver::Result DragSolver::solve(Field &force, Field &u, Load &load)
{
  Result result = {0, false, 0.0, true};
  initial_rate = load.rate;
  std::copy_n(u.begin(), nlocal, initial_velocity.begin());
  const bool linear = law.is_linear();
  bool newton = false;
  for (int round = 0; round < MOST_ROUNDS; round++) {
    exchange.send_to_ghosts(u);
    find_weights(u, load.rate);
    newton = !linear && find_tangent(u, load.rate);
    if (round == 0 || !linear) find_preconditioner(load.free_rate);
    const double driven = looks_ahead() ? driving_norm(force, load) : 0.0;
    const double least = std::max(settings.tolerance * settings.tolerance * driven, rounding());
    const Residual rest = find_residual(force, u, load, round > 0);
    const double rho = newton || looks_ahead() ? norm(rest.flow) : 0.0;
    if (looks_ahead()) {
      result.residual = driven > 0.0 ? sqrt(rho / driven) : 0.0;
      result.converged = rho <= least;
      if (result.converged || !std::isfinite(rho)) break;
    }
    const State before = newton ? state(force, u, load) : State();
    const int earlier = result.iterations;
    const Goal goal = {settings.tolerance, newton ? FORCING : 0.0, least, rest.dissipation};
    const Energies found = conjugate_gradients(u, load, rest.flow, goal, result);
    if (!result.positive) break;
    if (newton) last_iterations = result.iterations - earlier;
    // with a power law, what this round took away is what the last one left
    const double left = linear || looks_ahead() ? found.left : found.gained;
    const double whole = looks_ahead() ? driven : found.whole;
    result.residual = left > 0.0 ? sqrt(left / whole) : left;
    const double small = std::max(settings.tolerance * settings.tolerance * whole, least);
    result.converged = found.reached && left <= small &&
        (linear || !looks_ahead());    // droplets are judged by the next drag coefficients
    const bool holds = enforce_constraints(force, u, load, result);
    if (!holds && (result.converged || linear)) break;
    if (newton) line_search(before, rho, force, u, load);
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
  std::copy_n(u.begin(), nlocal, initial_velocity.begin());
  initial_rate = rate;
  find_weights(u, rate);
}
