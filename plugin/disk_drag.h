// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "disk_contact.h"
#include "drag_system.h"

#include <cmath>

namespace LAMMPS_NS {

/* Drag of disks: on approach and slip at their contacts, among the pairs that pair_style disk/drag found.
   Which disks touch is held over a step, so that velocities change smoothly in it.

   The drag on a pair sets in at once where its gap closes. It may push two disks apart that would meet
   without it: the pair is marginal. Its disks then neither part nor meet, but rub. The gap stays zero
   and a part theta of the drag acts, such that the approach is zero. This is the limit of drag that sets
   in over a thin layer of overlap: there the pair rests at an overlap with this part of the drag. The
   layer would be an ordinary differential equation, but explicit steps would have to resolve it as long
   as any pair rubs: for 64 disks of linear drag, a layer of 1e-4 diameters takes 3 to 90 times the steps,
   one of 1e-2 diameters 4 to 10 times and misses up to 10 % of the stress; without background drag the
   flow comes to a stop, since the layer alone holds loose disks. marginal_contacts.cpp
   finds the state of each marginal pair: open, closed or rubbing.

   The preconditioner is each disk's own block of B, or, where conjugate gradients take long with it,
   the Cholesky factor of B, of what each rank owns: contacts hardly resist some motions of many disks,
   the more so with little background drag and below jamming. */
class DiskDrag : public DragSystem<DiskRow> {
 public:
  enum State : int { OPEN, CLOSED, RUBBING };
  enum Revision { FITS, CHANGED, CYCLES };
  struct MarginalContact {    // a pair whose gap, zero, does not tell its state; known to all ranks
    tagint first, second;
    int state;
    double theta;    // part of the drag of a rubbing pair
    double base;     // part of it in the matrix; the rest is the force `held` along the slip
    double held;
    int tried;    // states that do not fit at this instant, as bits
    bool free;    // its approach does not answer to forces along the slip: a disk on one contact
  };
  struct Change {    // of a pair whose state does not fit at the end of a step
    tagint first, second;
    int state;           // that fits
    double time;         // of the step, where the gap is zero
    double speed;        // of one disk past the other: the drag on it is wrong from then on
    double steepness;    // rate at which the wrong part of the drag grows; 0: all is wrong at once
  };

  DiskDrag(MPI_Comm world, GhostExchange &exchange, const Settings &settings, const class PairDiskDrag &pair, Atom *);
  void update_contacts(int nlocal, int nghost, double ahead) override;
  void zero_rattler_velocities(Field &u) override;
  double elastic_moment() const override;
  FlowSums add_up(const Field &u, double rate) override;
  double least_relaxation_time() const override;

  void neighbors_are_new() { moved_between_ranks = true; }
  // from the positions of update_contacts, in coordinates that lean with the box by the strain
  void displace(const Field &moved, double strain);
  void elastic_forces(Field &force) const override;    // and those held, of this rank
  void expect(const Change &);                // its state from the next update_contacts on
  Revision revise(const Field &u, double rate, double least_speed);    // to states that fit better
  double misfit(const Field &u, double rate, double least_speed) const;    // the worst pair's
  bool marginal_pairs_change() const;         // a gap has closed or opened in the last step
  std::vector<double> parts_before() const;    // of the drag of marginal pairs that acted until now
  // States of several marginal pairs, each of which decides on the others: those that drag which sets in
  // over a thin layer comes to, from the parts that acted before. Load: a stress is the whole one.
  // false: the parts never come to rest
  bool relax_marginal_pairs(std::vector<double> parts, const Field &u, const Load &);
  bool close_rubbing();             // all, where no solution is found; false: there are none
  void forget_settled(bool all);    // pairs whose gap tells their state; or but for undecided ones
  void close_gaps(double per_time) { closing = per_time; }    // that steps leave to rubbing pairs
  // overlap over the mean one, as at which thinner contacts drag: with exponents above 2, drag sets in
  // from nothing, within a layer that steps would have to resolve
  void set_least_overlap(double part) { thinnest = part; }
  bool rubs() const { return rubbing > 0; }
  bool rubs(const Field &u, double rate) const;    // a pair that is faster than the least speed
  void set_min_speed(double speed) { min_speed = speed; }    // slower pairs need not fit
  std::vector<double> thetas() const;
  const std::vector<MarginalContact> &marginal_contacts() const { return marginal; }
  void set_marginal_contacts(const std::vector<MarginalContact> &earlier) { marginal = earlier; }
  bool is_linear() const { return law.alpha == 1.0; }

  // pairs of this rank whose state does not fit after a displacement: moved(pair, time, x, y, lean) is
  // that of j against i
  template <typename Moved> void find_changes(const Field &u, double rate, double time, const Moved &,
                                              std::vector<Change> &) const;
  // rubbing pairs that part or meet by then; thetas of the start and of a later time
  void find_exits(const Field &u, double rate, const std::vector<double> &first, const std::vector<double> &later,
                  double time, double end, std::vector<Change> &found) const;

 private:
  struct MarginalSlip {
    double approach, slide, gap;
  };
  const class PairDiskDrag &pair;
  Atom *atom;
  const double slow;    // iterations from which on factors pay
  std::vector<int> states;     // of pairs
  std::vector<int> pair_of;    // of rows
  std::vector<MarginalContact> marginal;
  std::vector<std::vector<int>>
      pairs_of;    // of marginal contacts, on this rank; two halves across the box, newton off
  std::vector<std::vector<int>> rows_of;     // of rubbing ones
  double flow_relaxation = HUGE_VAL;    // time in which a free rate relaxes in affine flow
  double thinnest = 0.0, least_overlap = 0.0;
  double closing = 0.0;
  int rubbing = 0;
  double min_speed = 0.0;
  Field blocks[2], rest;
  bool moved_between_ranks = true;
  int age = 0;                   // solutions with these factors
  int fresh_iterations = 0;      // of the first one
  int answer_iterations = 100;   // of the last answer to forces on a pair without factors
  std::vector<Field> answers;    // velocities, to a unit force along the slip of a rubbing pair
  std::vector<double> rate_answers;

  const std::vector<DiskPair> &near() const;
  double contact_speed(const DiskPair &, const Field &u, double rate) const;
  void contact_of(const DiskPair &, double x, double y, DiskRow &, Contact &) const;
  void find_contacts();
  void find_weights(const Field &u, double rate) override;
  bool find_slopes(const Field &u, double rate) override;
  void multiply_ahead(Field &p, double rate, Field &out, double &power, double &flow, double *also) override
  {
    apply(p, rate, 0.0, !bends.empty(), out, power, flow, also);
  }
  double rounding() const override;
  void find_preconditioner(bool free_rate) override;
  void choose_factors();
  void factorise_for_answers();
  void factorise();

  void find_pairs();
  void set_state(MarginalContact &, int state);
  double against(const MarginalContact &, const MarginalSlip &) const;
  double misfit(const MarginalContact &, const MarginalSlip &, double least_speed) const;
  double speed_of(const MarginalSlip &) const;
  std::vector<MarginalSlip> marginal_slips(const Field &u, double rate) const;
  bool enforce_constraints(Field &force, Field &u, Load &, Result &) override;
  std::vector<double> multipliers() const override;
  void set_multipliers(const std::vector<double> &) override;
  double add_pair_forces(std::size_t e, double back, double rub, Field &force) const;
  double answer_to(std::size_t e, double back, double rub, double accuracy, const Load &, Field &force, Field &answer,
                   double &rate, Result &);
  std::vector<double> whole_weights() const;
  void update_thetas(const std::vector<std::size_t> &rubs, const std::vector<MarginalSlip> &);
};

template <typename Moved>
void DiskDrag::find_changes(const Field &u, double rate, double time, const Moved &moved,
                            std::vector<Change> &found) const
{
  static constexpr double LOOK = 0.125;    // part of a step
  const std::vector<DiskPair> &pairs = near();
  for (std::size_t k = 0; k < pairs.size(); k++) {
    if (states[k] == RUBBING) continue;
    const DiskPair &p = pairs[k];
    const auto gap = [&](double t) {
      double x, y, strain;
      moved(p, t, x, y, strain);
      return hypot(p.flat() ? 0.0 : p.x + x + strain * (p.y + y), p.y + y) - p.reach;
    };
    const double sign = states[k] == CLOSED ? 1.0 : -1.0;
    if (!(sign * gap(time) > 0.0)) continue;
    double low = 0.0, high = time;
    if (sign * gap(0.0) > 0.0) {    // decided against its gap, which is zero but for rounding
      while (low < time && sign * gap(low) > 0.0) low += LOOK * time;
      if (!(low < time)) continue;
    }
    for (int n = 0; n < 60 && high - low > 1e-12 * time; n++) {
      const double middle = 0.5 * (low + high);
      (sign * gap(middle) > 0.0 ? high : low) = middle;
    }
    found.push_back({atom->tag[p.i], atom->tag[p.j], states[k] == CLOSED ? OPEN : CLOSED, high,
                     contact_speed(p, u, rate),
                     law.tau > 0.0 ? 0.0 : 2.0 * p.strength / settings.background});
  }
}

}    // namespace LAMMPS_NS
