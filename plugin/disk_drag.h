// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_DISK_DRAG_H
#define JAMLAB_DISK_DRAG_H

#include "block_cholesky.h"
#include "disk_contact.h"
#include "drag_solver.h"
#include "lmptype.h"

#include <cmath>

namespace LAMMPS_NS {

/* Drag of disks: on approach and slip at their contacts, among the pairs that pair_style disk/drag has
   found. Who touches whom is held over a step, so that velocities change smoothly in it.

   Drag that sets in where a gap closes may push the two apart that would meet without it. They neither
   part nor meet then, but rub: the gap stays zero, and a part theta of the drag acts, whose approach is
   none and whose slip keeps the gap as it is.

   The preconditioner is each disk's own block of B, or, where conjugate gradients with it cost more than that, the
   Cholesky factor of B, of what each rank owns: drag at contacts alone hardly resists some motions of many disks,
   the more so with little background drag and below jamming. */

class DiskDrag : public DragSolver {
 public:
  enum State : int { OPEN, CLOSED, RUBBING };
  enum Revision { FITS, CHANGED, CYCLES };
  struct Edge {    // a pair with a gap of zero, known to all ranks: its state is not seen from its gap
    tagint first, second;
    int state;
    double theta;    // part of the drag of a rubbing pair
    double base;     // part of it that stands in the matrix; the rest is the force `held` along the slip
    double held;
    int tried;    // states that do not fit at this instant, as bits
    bool free;    // slips without an answer in its approach, as a disk on one contact: no force keeps its gap
  };
  struct Change {    // of a pair whose state does not fit at the end of a step
    tagint first, second;
    int state;       // that fits
    double time;     // of the step, where the gap is zero
    double speed;    // of one past the other: what is dragged too much or too little later on
    double steepness;    // that part grows in time from zero on, at this rate; 0: at once
  };

  DiskDrag(MPI_Comm world, GhostExchange &exchange, const Settings &settings, const class PairDiskDrag &pair,
           const tagint *const &tags);
  void take(int nlocal, int nghost, double ahead) override;
  void let_go_of_loose(Motions &u) override;
  double elastic_moment() const override;
  FlowSums add_up(const Motions &u, double rate) override;
  double least_relaxation_time() const override;
  double memory_usage() const override;

  // from the positions of `take`, in coordinates that lean with the box by the strain
  void displace(const Motions &moved, double strain);
  void push(Motions &force) const;    // elastic forces, and those held; of the contacts of this rank
  void expect(const Change &);        // its state from the next `take` on
  // states of edges that fit the velocities better
  Revision revise(const Motions &u, double rate, double least_speed);
  double misfit(const Motions &u, double rate, double least_speed) const;    // the worst of the edges
  bool edges_change() const;          // a gap has closed or opened in the last step
  std::vector<double> parts_before() const;    // of the drag of edges that acted until now
  // States of several edges, each of which decides on the others: those that drag comes to which sets in over a thin
  // layer, from what acted before. A load of a stress: all of it. false: they never come to rest
  bool relax_edges(std::vector<double> parts, const Motions &u, const Load &);
  bool close_rubbing();               // all of them, where no solution is found; false: there are none
  void forget_settled(bool all);      // edges whose gap tells their state; but for those that are to be decided
  void keep_gaps(double per_time) { closing = per_time; }    // of rubbing pairs, which a step leaves not quite zero
  // overlap over the mean one at which thinner contacts drag: that of exponents above 2 sets in from nothing, and within
  // a layer that steps would have to resolve
  void thicken(double part) { thinnest = part; }
  bool rubs() const { return rubbing > 0; }
  bool rubs(const Motions &u, double rate) const;    // a pair that is not left alone
  void leave_alone(double speed) { alone = speed; }    // pairs with a gap of zero that slip at less
  std::vector<double> thetas() const;
  const std::vector<Edge> &edges() const { return edged; }
  void take_over(const std::vector<Edge> &earlier) { edged = earlier; }
  bool drags() const { return law.tau > 0.0; }
  bool is_linear() const { return law.alpha == 1.0; }

  // pairs of this rank whose state does not fit after a displacement
  template <typename Moved> void find_changes(const Motions &u, double rate, double time, const Moved &,
                                              std::vector<Change> &) const;
  // rubbing pairs that part or meet by then; thetas of the start and of a later time
  void find_exits(const Motions &u, double rate, const std::vector<double> &first, const std::vector<double> &later,
                  double time, double end, std::vector<Change> &found) const;
  double contact_speed(const DiskPair &, const Motions &u, double rate) const;

 private:
  const class PairDiskDrag &pair;
  const tagint *const &tags;
  std::vector<int> states;    // of pairs
  std::vector<DiskContact> contacts;
  std::vector<int> pair_of, edge_of;    // of contacts; -1: none
  std::vector<Edge> edged;
  std::vector<std::vector<int>> edge_pairs;    // of edges, on this rank; two halves across the box with newton off
  std::vector<double> weights;    // drag over velocity of approach
  struct Bend {
    double approach, slide;
  };
  std::vector<Bend> bends;    // of a power law, whose slope is that of the weights less the product of this with itself
  double flow_relaxation = HUGE_VAL;    // time in which a free rate relaxes while no disk leaves the affine flow
  double thinnest = 0.0, least_overlap = 0.0;
  double closing = 0.0;
  int rubbing = 0;
  double alone = 0.0;
  Motions blocks[2], rest;
  BlockCholesky<3> factors;
  bool factored = false, patterned = false;
  std::vector<tagint> factored_tags;    // of atoms and ghosts when the order of elimination was found
  std::vector<int> owners;              // of atoms and ghosts, -1: of another rank
  double spent = 0.0;      // on conjugate gradients since the last factors or neighbor lists
  int age = 0, serves = 0;    // solutions with these factors, and with how many they become too old
  double answer_iterations = 100.0;    // of the last answer to forces on a pair that was found without factors
  double amplified = 1.0;  // by the factors: the norm of rounding, compared with that of each disk's own block
  std::vector<double> column;
  std::vector<Motions> answers;    // of all velocities to a unit force along the slip of a rubbing pair
  std::vector<double> rate_answers;

  struct Slope {    // of the drag on approach and slip, by approach and slip
    double nn, nt, tt;
  };
  Slope slope_of(std::size_t contact) const;
  const std::vector<DiskPair> &near() const;
  struct Slip {
    double approach, slide, gap;
  };
  void find_contacts();
  void set_state(Edge &, int state);
  std::vector<int> find_pairs(const Edge &) const;
  double against(const Edge &, const Slip &) const;
  double misfit(const Edge &, const Slip &, double least_speed) const;
  double speed_of(const Slip &) const;
  std::vector<Slip> edge_slips(const Motions &u, double rate) const;
  DiskContact contact_of(const DiskPair &, double x, double y) const;
  void find_weights(const Motions &u, double rate) override;
  void find_preconditioner(bool free_rate) override;
  double precondition(double r_flow, double &z_flow) override;
  struct FactorCosts {
    bool moved;    // atoms or ghosts are other ones
    double iteration, solution, anew, order;
    double least;            // iterations with new factors
    double fresh() const;    // of velocities found with them
  };
  FactorCosts factor_costs(bool moved) const;
  void choose_factors();
  void factorise_for(std::size_t solutions);
  bool find_owners();
  void set_factor_pattern();
  void factorise();
  double find_amplified();
  void multiply(Motions &p, double rate, Motions &out, double &power, double &flow) override;
  void multiply_ahead(Motions &p, double rate, Motions &out, double &power, double &flow) override;
  void multiply_by(const std::vector<Bend> &, Motions &p, double rate, Motions &out, double &power, double &flow);
  bool find_slopes(const Motions &u, double rate) override;
  bool hold(Motions &force, Motions &u, Load &, Result &) override;
  std::vector<double> held() const override;
  void hold_at(const std::vector<double> &) override;
  double push_pair(std::size_t edge, double back, double rub, Motions &force) const;
  double answer_to(std::size_t edge, double back, double rub, double accuracy, const Load &, Motions &push, Motions &answer,
                   double &rate, Result &);
  std::vector<double> whole_weights() const;
  void update_thetas(const std::vector<std::size_t> &rubs, const std::vector<Slip> &);
  static void solve_dense(std::vector<double> &matrix, std::vector<double> &right, std::vector<bool> &free);
  double rounding() const override;
  static constexpr double LOOK = 0.125;    // part of a step
  static void slip(const DiskContact &, const Motions &u, double rate, double &approach, double &slide);
};

/* ----------------------------------------------------------------------
   moved(time) gives x and y of j against i beside the lean, and the lean, of a pair
------------------------------------------------------------------------- */

template <typename Moved>
void DiskDrag::find_changes(const Motions &u, double rate, double time, const Moved &moved,
                            std::vector<Change> &found) const
{
  const std::vector<DiskPair> &pairs = near();
  for (std::size_t k = 0; k < pairs.size(); k++) {
    if (states[k] == RUBBING) continue;
    const DiskPair &p = pairs[k];
    const auto gap = [&](double t) {
      double x, y, strain;
      moved(p, t, x, y, strain);
      return hypot(p.x + x + strain * (p.y + y), p.y + y) - p.reach;
    };
    const double sign = states[k] == CLOSED ? 1.0 : -1.0;
    if (!(sign * gap(time) > 0.0)) continue;
    double low = 0.0, high = time;
    if (sign * gap(0.0) > 0.0) {    // decided against its gap, which is zero but for rounding: it has to be told first
      while (low < time && sign * gap(low) > 0.0) low += LOOK * time;
      if (!(low < time)) continue;
    }
    for (int n = 0; n < 60 && high - low > 1e-12 * time; n++) {
      const double middle = 0.5 * (low + high);
      (sign * gap(middle) > 0.0 ? high : low) = middle;
    }
    found.push_back({tags[p.i], tags[p.j], states[k] == CLOSED ? OPEN : CLOSED, high,
                     contact_speed(p, u, rate),
                     law.tau > 0.0 ? 0.0 : 2.0 * p.strength / settings.background});
  }
}

}    // namespace LAMMPS_NS

#endif
