// Descents by limited-memory BFGS from the inverse of a Hessian: some directions are almost free,
// as vertices that slide along a flat, others as stiff as contacts. A shift makes the Hessian
// positive definite. Its factors serve for several steps, whose pairs correct them: Nocedal &
// Wright, Numerical Optimization, algorithm 7.4.
//
// Near a minimum the energy has no digits left for a line search. There the work of the force along
// the step, (F0 + F1) . s/2, replaces the fall of the energy.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace jamlab {

using Values = std::vector<double>;

// Eight sums do not wait for each other.
inline double dot(const Values &a, const Values &b)
{
  double sums[8] = {}, rest = 0.0;
  std::size_t k = 0;
  for (; k + 8 <= a.size(); k += 8)
#pragma omp simd
    for (int n = 0; n < 8; n++) sums[n] += a[k + n] * b[k + n];
  for (; k < a.size(); k++) rest += a[k] * b[k];
  for (const double sum : sums) rest += sum;
  return rest;
}

inline void add(Values &to, double factor, const Values &from)
{
  const double *const __restrict source = from.data();
  double *const __restrict target = to.data();
  for (std::size_t k = 0; k < to.size(); k++) target[k] += factor * source[k];
}

inline double longest_part(const Values &v)
{
  double longest = 0.0;
  for (const double one : v) longest = std::max(longest, std::fabs(one));
  return longest;
}

struct LbfgsNumbers {  // as in jamlab.protocols.preconditioned_lbfgs.LbfgsSettings, and two more
  double refresh, reach, longer, closing, trials, energy_digits, sufficient, curved;
  double shift, least_shift, first_shift, definite;
};

// A Model has an energy and a force at its place, and can go elsewhere:
//   bool ended()                   there is nothing left to do
//   double energy(), largest_force(); const Values &forces()
//   double rounding(digits)        of the energy
//   void mark(), back()            remembers this place, and returns there
//   void go(step, length)          from the marked place along a step
//   void moved(Values &change)     from the marked place
//   bool assemble(beyond)          the Hessian, with gaps up to `beyond` as if they were contacts
//   double stiffness()             a typical element of it
//   bool factorise(shift)          of its diagonal; false: it is not positive definite
//   void solve(force, step, roughly)
template <class Model> class LbfgsDescent {
 public:
  struct Counts {
    double steps = 0, factors = 0, refused = 0;  // refused: not positive definite
    double stuck = 0, bent = 0;  // steps without a lower energy, and such that bend upwards
    double shift;                // to be tried first
  } counts;

  LbfgsDescent(Model &model, const LbfgsNumbers &numbers) :
      model(model), numbers(numbers), pairs(static_cast<std::size_t>(numbers.refresh))
  {
    counts.shift = numbers.first_shift;
  }

  // Goes down from the place of the model until it has ended, by so many steps at most.
  void run(double steps)
  {
    const std::size_t most = pairs.size();
    std::size_t age = most;
    double longest = numbers.reach, move = 0.0;
    for (; !model.ended() && counts.steps < steps; age++) {
      counts.steps++;
      if (age >= most) {
        if (!factorise(numbers.closing * move)) return;
        age = known = 0;
      }
      force = model.forces();
      energy = model.energy();
      find_step();
      if (!search_line(longest)) {
        counts.stuck++;
        model.back();
        if (age == 0) return;  // not even a fresh Hessian shows the way down
        age = most;
        continue;
      }
      if (!add_pair()) {
        counts.bent++;
        if (age > 0) age = most;  // the Hessian is another one here
      }
      move = longest_part(change);
      longest = std::min(numbers.reach, numbers.longer * move);
    }
  }

 private:
  struct Pair {  // a step and the change of the force along it
    Values change, bend;
    double curvature, along;
  };
  // any finite matrix has factors with this shift, in units of its stiffness
  static constexpr double HIGHEST = 1e6;

  Model &model;
  const LbfgsNumbers numbers;
  std::vector<Pair> pairs;
  std::size_t known = 0;  // pairs
  Values force, rest, step, change;
  double energy = 0.0;

  // The least shift grows with the largest force; above it, the shift below the last one that held
  // is tried first. Gaps that steps will close are as stiff as contacts, or every step would end
  // where the first gap closes.
  bool factorise(double beyond)
  {
    if (!model.assemble(beyond)) return false;
    const double least = std::max(numbers.shift * model.largest_force(), numbers.least_shift);
    const double highest = HIGHEST * std::max(1.0, model.stiffness());
    for (double shift = std::max(least, counts.shift); shift < highest; shift *= numbers.definite) {
      counts.factors++;
      if (model.factorise(shift)) {
        counts.shift = shift / numbers.definite;
        return true;
      }
      counts.refused++;
    }
    return false;
  }

  // Beside pairs single precision does: steps are as many. Without them the step is Newton's.
  void find_step()
  {
    rest = force;
    for (std::size_t k = known; k-- > 0;) {
      pairs[k].along = dot(pairs[k].change, rest) / pairs[k].curvature;
      add(rest, -pairs[k].along, pairs[k].bend);
    }
    model.solve(rest, step, known > 0);
    for (std::size_t k = 0; k < known; k++)
      add(step, pairs[k].along - dot(pairs[k].bend, step) / pairs[k].curvature, pairs[k].change);
    if (dot(step, force) > 0.0) return;
    known = 0;
    model.solve(force, step, false);
  }

  // Follows the step, up to `longest`, until the energy falls enough; false: it does not.
  bool search_line(double longest)
  {
    const double slope = dot(force, step), noise = model.rounding(numbers.energy_digits);
    double length = std::min(1.0, longest / longest_part(step));
    model.mark();
    for (int k = 0; k < numbers.trials; k++) {
      model.go(step, length);
      const double new_slope = dot(model.forces(), step);
      double fall = energy - model.energy();
      if (std::fabs(fall) <= noise) fall = 0.5 * length * (slope + new_slope);
      if (fall > numbers.sufficient * length * slope) return true;
      // the secant of the force along the step gives the next length
      length *= new_slope < slope ? std::clamp(slope / (slope - new_slope), 0.1, 0.5) : 0.5;
    }
    return false;
  }

  // The pair is refused, with false, if the force does not fall along the step.
  bool add_pair()
  {
    Pair &next = pairs[known];
    model.moved(change);
    next.change = change;
    next.bend = force;
    add(next.bend, -1.0, model.forces());
    next.curvature = dot(next.change, next.bend);
    const double scale = std::sqrt(dot(next.change, next.change) * dot(next.bend, next.bend));
    if (!(next.curvature > numbers.curved * scale)) return false;
    known++;
    return true;
  }
};

}  // namespace jamlab
