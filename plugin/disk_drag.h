// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "disk_contact.h"
#include "drag_system.h"

#include <cmath>
#include <functional>
#include <map>
#include <utility>

namespace LAMMPS_NS {

/* Drag of disks: on approach and slip at the contacts among the pairs that pair_style disk/drag
   found. Which disks touch is held over a step, so that velocities change smoothly in it.

   The drag on a pair sets in at once where its gap closes. It may push two disks apart that would
   meet without it: the pair is marginal. Its disks then neither part nor meet, but rub. The gap
   stays zero and a part theta of the drag acts, such that the approach is zero. This is the limit
   of drag that sets in over a thin layer of overlap: there the pair rests at an overlap with this
   part of the drag. The layer would be an ordinary differential equation, but explicit steps would
   have to resolve it as long as any pair rubs: of 16 to 256 disks, a layer of 1e-4 diameters takes
   1.2 to 20 times the steps, one of 1e-2 diameters 2 to 12 times, and lowers the largest stress by
   up to 44 % (docs/explanation/drag.md); without background drag the flow comes to a stop, since
   the layer alone holds loose disks. marginal_contacts.cpp finds whether each marginal pair is
   open, closed or rubbing.

   The preconditioner is the block of each disk in B, or, where conjugate gradients take long with
   it, the Cholesky factor of B, of what each rank owns: contacts hardly resist some motions of many
   disks, the more so with little background drag and below jamming. */
class DiskDrag : public DragSystem<DiskRow> {
 public:
  enum State : int { OPEN, CLOSED, RUBBING };
  enum Revision { FITS, CHANGED, CYCLES };
  static constexpr double BASE = 0.5;    // part of the drag that keeps the matrix well conditioned
  struct MarginalContact {    // a pair whose gap, zero, does not tell its state; known to all ranks
    tagint first, second;
    int state;
    double theta = BASE;    // part of the drag of a rubbing pair
    double base = BASE;     // part of it in the matrix; the rest is the force `held` along the slip
    double held = 0.0;
    int tried = 0;          // states that do not fit at this instant, as bits
    bool free = false;      // no force along the slip changes its approach: a disk on one contact

    void set(int other) { *this = {first, second, other, BASE, BASE, 0.0, tried, false}; }
  };
  struct Change {    // of a pair whose state does not fit at the end of a step
    tagint first, second;
    int state;           // that fits
    double time;         // of the step, where the gap is zero
    double speed;        // of one disk past the other: the drag on it is wrong from then on
    double steepness;    // rate at which the wrong part of the drag grows; 0: all is wrong at once
  };
  using Ids = std::pair<tagint, tagint>;    // the smaller one first
  static Ids ids(tagint a, tagint b) { return std::minmax(a, b); }

  DiskDrag(MPI_Comm world, GhostExchange &exchange, const Settings &settings,
           class PairDiskDrag &pair, Atom *);
  void update_contacts(int nlocal, int nghost, double ahead) override;
  void zero_rattler_velocities(Field &u);
  double elastic_moment() const override;
  FlowSums add_up(const Field &u, double rate) override;
  double least_relaxation_time() const override;
  bool touched(int i) const override { return inverse[i].xx > 0.0; }

  void neighbors_are_new() { moved_between_ranks = true; }
  // from the positions of update_contacts, in coordinates that lean with the box by the strain
  void displace(const Field &moved, double strain);
  void elastic_forces(Field &force) const override;    // and those held, of this rank
  void expect(const std::vector<Change> &);    // their states from the next update_contacts on
  Revision revise(const Field &u, double rate, double least_speed);    // to states that fit better
  double misfit(const Field &u, double rate, double least_speed) const;    // the worst pair's
  bool marginal_pairs_change() const;          // a gap has closed or opened in the last step
  std::vector<double> parts_before() const;    // of the drag of marginal pairs that acted until now
  // States of several marginal pairs, each of which decides on the others: those that drag which
  // sets in over a thin layer comes to, from the parts that acted before. Load: a stress is the
  // whole one. false: the parts never come to rest
  bool relax_marginal_pairs(std::vector<double> parts, const Field &u, const Load &);
  bool close_rubbing();             // all, where no solution is found; false: there are none
  void forget_settled(bool all);    // pairs whose gap tells their state; or but for undecided ones
  void close_gaps(double per_time) { closing = per_time; }    // that steps leave to rubbing pairs
  // overlap over the mean one, as at which thinner contacts drag: with exponents above 2, drag sets
  // in from nothing, within a layer that steps would have to resolve
  void set_least_overlap(double part) { thinnest = part; }
  bool rubs() const { return rubbing > 0; }
  double marginal_pairs() const override { return static_cast<double>(marginal.size()); }
  bool rubs(const Field &u, double rate) const;    // a pair that is faster than the least speed
  void set_min_speed(double speed) { min_speed = speed; }    // slower pairs need not fit
  std::vector<double> thetas() const { return of_marginals(&MarginalContact::theta); }
  const std::vector<MarginalContact> &marginal_contacts() const { return marginal; }
  void set_marginal_contacts(const std::vector<MarginalContact> &earlier) { marginal = earlier; }
  bool is_linear() const { return law.is_linear(); }
  double spin_length() const { return length; }

  // displacement of j against i at a time within the step, and the strain of the box by then
  using Displacement = std::function<void(const DiskPair &, double time, double &x, double &y,
                                          double &strain)>;
  // pairs of this rank whose state does not fit after a displacement
  void find_changes(const Field &u, double rate, double time, const Displacement &,
                    std::vector<Change> &) const;
  // rubbing pairs that part or meet by then; thetas of the start and of a later time
  void find_exits(const Field &u, double rate, const std::vector<double> &first,
                  const std::vector<double> &later, double time, double end,
                  std::vector<Change> &found) const;

 private:
  struct SymmetricBlock {    // of one disk
    double xx = 0.0, xy = 0.0, yy = 0.0, xs = 0.0, ys = 0.0, ss = 0.0;

    void add(double c, const Vec3 &a)    // c a a^T
    {
      xx += c * a.x * a.x, xy += c * a.x * a.y, yy += c * a.y * a.y;
      xs += c * a.x * a.spin, ys += c * a.y * a.spin, ss += c * a.spin * a.spin;
    }
    void operator+=(const SymmetricBlock &o)
    {
      xx += o.xx, xy += o.xy, yy += o.yy, xs += o.xs, ys += o.ys, ss += o.ss;
    }
  };
  struct MarginalSlip : Slip {
    double gap;
  };
  const class PairDiskDrag &pair;
  Atom *atom;
  const double length;    // spins are velocities at this distance, so that all numbers compare
  const double slow;    // iterations from which on factors pay
  std::vector<int> states;     // of pairs
  std::vector<int> pair_of;    // of rows
  std::vector<MarginalContact> marginal;
  // of marginal contacts, on this rank; two halves across the box, newton off; rows of rubbing ones
  std::vector<std::vector<int>> pairs_of, rows_of;
  double flow_relaxation = HUGE_VAL;    // time in which a free rate relaxes in affine flow
  double thinnest = 0.0, least_overlap = 0.0;
  double closing = 0.0;
  int rubbing = 0;
  double min_speed = 0.0;
  std::vector<SymmetricBlock> blocks, inverse;    // of B, of each disk
  Field rest;
  int answer_iterations = 100;   // of the last answer to forces on a pair without factors
  struct Answer {    // to forces on a marginal pair
    Field force, velocity;
    double moment, rate;    // the part of the forces in A stress, where the rate is free
  };
  std::vector<Answer> answers;    // to a unit force along the slip of each rubbing pair

  double contact_speed(const DiskPair &, const Field &u, double rate) const;
  void contact_of(const DiskPair &, double x, double y, DiskRow &, Contact &) const;
  void find_contacts();
  void find_weights(const Field &u, double rate) override;
  bool find_tangent(const Field &u, double rate) override;
  double rounding() const override;
  void find_preconditioner(bool free_rate) override;
  double precondition() override;
  void add_blocks_from_ghosts();
  void factorise_for_answers();
  void factorise();

  std::map<Ids, std::size_t> marginal_numbers() const;
  void find_pairs();
  double against(const MarginalContact &, const MarginalSlip &) const;
  double misfit(const MarginalContact &, const MarginalSlip &, double least_speed) const;
  double speed_of(const Slip &s) const
  {
    return sqrt(s.approach * s.approach + law.beta * s.slide * s.slide);
  }
  std::vector<MarginalSlip> marginal_slips(const Field &u, double rate) const;
  bool enforce_constraints(Field &force, Field &u, Load &, Result &) override;
  std::vector<double> of_marginals(double MarginalContact::*value) const;
  std::vector<double> multipliers() const override { return of_marginals(&MarginalContact::held); }
  void set_multipliers(const std::vector<double> &) override;
  double add_pair_forces(std::size_t e, double back, double rub, Field &force) const;
  struct PairForces {    // on a marginal pair, against parting and slip
    std::size_t pair;
    double back, rub;
  };
  struct Pending;
  static constexpr std::size_t TOGETHER = 4;    // answers that factors find at once
  std::vector<Answer> answers_to(const std::vector<PairForces> &, double accuracy, bool free_rate,
                                 Result &);
  void find_together(Pending *some, std::size_t count, Result &);
  void precondition_together(const std::vector<Pending *> &);
  std::vector<double> whole_weights() const;
  void update_thetas(const std::vector<std::size_t> &rubs, const std::vector<MarginalSlip> &);
};

}    // namespace LAMMPS_NS
