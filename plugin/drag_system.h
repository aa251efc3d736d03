// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "block_assembly.h"
#include "drag_solver.h"
#include "slip_row.h"

#include <algorithm>
#include <cmath>

namespace LAMMPS_NS {

/* The drag of disks and of droplets: B = J^T W J + background, by the rows J of slips at contacts.
   Products, stresses, weights of a power law and factors for preconditioning serve both. */
template <class Row> class DragSystem : public DragSolver {
 public:
  double memory_usage() const override
  {
    const std::size_t each = sizeof(Row) + sizeof(Contact) + sizeof(double);
    return DragSolver::memory_usage() + rows.capacity() * each + factors.memory_usage();
  }

  void hold(const std::vector<char> &atoms, const Field &per_rate) override
  {
    DragSolver::hold(atoms, per_rate);
    for (std::size_t i = 0; i < given.size(); i++)
      if (given[i]) background[i] = 0.0;
  }

 protected:
  static constexpr int D = Row::D;
  using Part = RowPart<D>;
  using Block = typename BlockCholesky<D>::Block;
  struct Contact {    // numbers of a row that products do not need
    double distance, stiffness, drag;    // drag: the stiffness in its coefficient
    double force = 0.0, energy = 0.0;    // elastic, a push
    double share = 1.0;                  // 1/2 of a contact that two ranks see
    double part = 1.0, held = 0.0;    // of the drag in the matrix; force along the slip beside it
  };
  struct Correction {    // g of a power law, whose tangent is the weights less g g^T
    double approach, slide;
  };
  std::vector<Row> rows;
  std::vector<Contact> contacts;
  std::vector<double> weights;       // drag over velocity of approach
  std::vector<double> background;    // drag of each owned atom on the affine flow
  std::vector<Correction> corrections;    // empty: none, or the tangent is not known
  BlockCholesky<D> factors;
  bool rows_are_own = false;    // no row has a ghost, on any rank
  bool moved_between_ranks = true;
  int age = 0;    // solutions with these factors

  using DragSolver::DragSolver;

  double lever(std::size_t k) const { return rows[k].ny * contacts[k].distance; }
  Slip slip(std::size_t k, const Field &u, double rate) const
  {
    return slip_of(rows[k], relative_velocity(rows[k], u.data(), rate * lever(k)));
  }

  // of droplets: spins follow from vertices, torques are forces on these; ahead K; the last one
  // leaves only motion that the drag resists
  virtual void find_spins(Field &, double /*rate*/) {}
  virtual double turn_back(Field &, FlowSums *) { return 0.0; }
  virtual double add_forces_ahead(const Field &, double /*rate*/, Field &) { return 0.0; }
  virtual void project(Field &) const {}

  Product multiply(Field &p, double rate, Matrix matrix, Field &out, double *also,
                   FlowSums *drag) override
  {
    if (!rows_are_own) exchange.send_to_ghosts(p);
    find_spins(p, rate);
    std::fill_n(out.begin(), rows_are_own ? nlocal : nlocal + nghost, Vec3());
    if (drag) add_row_sums(p, rate, *drag);
    const bool corrected = matrix == TANGENT && !corrections.empty();
    const bool isotropic = law.beta == 1.0 && !corrected;
    double sums[4] = {0.0, 0.0, also ? *also : 0.0, 0.0};
    const bool flow = needs_flow || rate != 0.0;
    sums[1] = flow && isotropic ? add_rows<true, true>(p, rate, corrected, out)
        : flow                  ? add_rows<false, true>(p, rate, corrected, out)
        : isotropic             ? add_rows<true, false>(p, rate, corrected, out)
                                : add_rows<false, false>(p, rate, corrected, out);
    if (matrix == TANGENT && looks_ahead()) sums[1] += add_forces_ahead(p, rate, out);
    if (!rows_are_own) exchange.add_from_ghosts(out);
    sums[1] += turn_back(out, drag);
    for (int i = 0; i < nlocal && settings.background > 0.0; i++) {
      out[i].x += background[i] * p[i].x;
      out[i].y += background[i] * p[i].y;
    }
    sums[0] += field_dot(out, p, nlocal);
    if (!carried.empty()) sums[3] = field_dot(out, carried, nlocal);
    MPI_Allreduce(MPI_IN_PLACE, sums, 4, MPI_DOUBLE, MPI_SUM, world);
    if (also) *also = sums[2];
    return {sums[0] + rate * sums[1], sums[1] + sums[3], sums[1]};
  }

  void find_weights(const Field &u, double rate) override
  {
    corrections.clear();
    weights.resize(rows.size());
    double slowest = 0.0;
    if (!law.is_linear()) {
      double sums[2] = {0.0, 0.0};    // squares and their number
      spun.assign(u.begin(), u.begin() + nlocal + nghost);
      find_spins(spun, rate);
      for (std::size_t k = 0; k < rows.size(); k++) {
        const Slip s = slip(k, spun, rate);
        weights[k] = law.square(s.approach, s.slide);
        sums[0] += contacts[k].share * weights[k];
        sums[1] += contacts[k].share;
      }
      MPI_Allreduce(MPI_IN_PLACE, sums, 2, MPI_DOUBLE, MPI_SUM, world);
      slowest = LEAST + (sums[1] > 0.0 ? SLOWEST * (sums[0] / sums[1]) : 0.0);
    }
    for (std::size_t k = 0; k < rows.size(); k++)
      weights[k] = contacts[k].part * contacts[k].drag * law.weight(weights[k], slowest);
  }

  // The matrix is factorised where the last solution took more than `slow` iterations without
  // factors, or, with them, much longer than the first one. An outdated one is factorised too.
  bool factors_are_due(double slow, bool outdated)
  {
    if (moved_between_ranks) {
      moved_between_ranks = factored = false;
      factors.forget_order();
    }
    if (!factored) return last_iterations > slow;
    if (outdated) return true;
    if (++age == 1) fresh_iterations = last_iterations;
    return last_iterations > std::max(FEW, GROWN * fresh_iterations);
  }

  // sums of this rank, without the elastic stress of forces that no row knows
  void add_row_sums(const Field &u, double rate, FlowSums &sums) const
  {
    for (std::size_t k = 0; k < rows.size(); k++) {
      const Row &row = rows[k];
      const Contact &c = contacts[k];
      const Slip s = slip(k, u, rate);
      const double push = weights[k] * s.approach, rub = law.beta * weights[k] * s.slide + c.held;
      const Double2 drag = force_of(row, push, rub).xy;
      const double length = c.share * c.distance;
      sums.elastic -= length * c.force * row.nx * row.ny;
      sums.viscous += length * drag[0] * row.ny;
      sums.xx += length * (drag[0] - c.force * row.nx) * row.nx;
      sums.yy += length * (drag[1] - c.force * row.ny) * row.ny;
      sums.energy += c.share * c.energy;
      sums.dissipation += c.share * (push * s.approach + rub * s.slide);
      sums.contacts += c.share;
    }
  }

  void add_background_sums(const Field &u, FlowSums &sums) const
  {
    for (int i = 0; i < nlocal; i++) {
      const double square = u[i].x * u[i].x + u[i].y * u[i].y;
      sums.speed += sqrt(square);
      sums.dissipation += background[i] * square;
    }
    sums.pushed += body_work(u);
    for (std::size_t i = 0; i < body.size(); i++)
      if (background[i] > 0.0)
        sums.fall += (body[i].x * body[i].x + body[i].y * body[i].y) / background[i];
  }

  virtual void find_parts(std::size_t k, std::vector<Part> &parts) const
  {
    parts.clear();
    for (int a = 0; a < Row::SITES; a++) {
      const double c = rows[k].coefficient(a);
      Part part = {
          rows[k].site(a), {c * rows[k].nx, c * rows[k].ny}, {-c * rows[k].ny, c * rows[k].nx}};
      if (D == 3) part.slide[D - 1] = -rows[k].arm(a);
      parts.push_back(part);
    }
  }

  Correction correction(std::size_t k) const
  {
    return corrections.empty() ? Correction{0.0, 0.0} : corrections[k];
  }

  // the block of two parts of a row in the tangent of the drag
  Block block(std::size_t k, const Part &p, const Part &q) const
  {
    const double w = weights[k], v = law.beta * w;
    const auto g = [c = correction(k)](const Part &part, int a) {
      return c.approach * part.approach[a] + c.slide * part.slide[a];
    };
    Block found;
    for (int a = 0; a < D; a++)
      for (int b = 0; b < D; b++)
        found[D * a + b] = contacts[k].share *
            (w * p.approach[a] * q.approach[b] + v * p.slide[a] * q.slide[b] - g(p, a) * g(q, b));
    return found;
  }

  // leaves one part for each atom of this rank
  static void merge(std::vector<Part> &parts, const BlockAssembly<D> &matrix)
  {
    std::size_t kept = 0;
    for (const Part part : parts) {
      const int own = matrix.owner(part.site);
      if (own < 0) continue;
      std::size_t k = 0;
      while (k < kept && parts[k].site != own) k++;
      if (k == kept) parts[kept++] = {own, {}, {}};
      for (int d = 0; d < D; d++) {
        parts[k].approach[d] += part.approach[d];
        parts[k].slide[d] += part.slide[d];
      }
    }
    parts.resize(kept);
  }

  // diagonal: with the blocks of each atom with itself
  void assemble_rows(BlockAssembly<D> &matrix, bool diagonal) const
  {
    std::vector<Part> parts;
    for (std::size_t k = 0; k < rows.size(); k++) {
      find_parts(k, parts);
      if (diagonal) merge(parts, matrix);
      for (std::size_t a = 0; a < parts.size(); a++)
        for (std::size_t b = diagonal ? a : a + 1; b < parts.size(); b++)
          matrix.add(parts[a].site, parts[b].site, block(k, parts[a], parts[b]));
    }
  }

  double precondition() override
  {
    project(residual);
    column.resize(D * nlocal);
    for (int i = 0; i < nlocal; i++) {
      column[D * i] = residual[i].x;
      column[D * i + 1] = residual[i].y;
      if (D == 3) column[D * i + D - 1] = residual[i].spin;
    }
    factors.solve(column);
    for (int i = 0; i < nlocal; i++)
      descent[i] = {column[D * i], column[D * i + 1], D == 3 ? column[D * i + D - 1] : 0.0};
    project(descent);
    return field_dot(residual, descent, nlocal);
  }

 private:
  // Squared velocity over the mean one, below which contacts drag as if they moved so: power laws
  // below 1 diverge. The least one, of a unit of length and tau, is for disks of which none moves.
  static constexpr double SLOWEST = 1e-5 * 1e-5, LEAST = 1e-30 * 1e-30;
  static constexpr int GROWN = 2, FEW = 8;    // times the first solution; least
  int fresh_iterations = 0;                   // of the first solution with these factors
  Field spun;
  std::vector<double> column;

  // With beta = 1, approach and slide are resisted alike: the row need not be resolved into them.
  template <bool ISOTROPIC, bool FLOW>
  double add_rows(const Field &p, double rate, bool corrected, Field &out) const
  {
    const Vec3 *const __restrict u = p.data();
    Vec3 *const __restrict sums = out.data();
    const Row *const __restrict all = rows.data();
    const double *const __restrict weight = weights.data(), beta = law.beta;
    double flow = 0.0;
    for (std::size_t k = 0, size = rows.size(); k < size; k++) {
      const Row &row = all[k];
      WideVec3 force, v = relative_velocity(row, u, FLOW ? rate * lever(k) : 0.0);
      if (ISOTROPIC) {
        const Double2 along = {-row.ny, row.nx};
        force.xy = weight[k] * (v.xy - v.spin * along);
        force.spin = force.xy[1] * row.nx - force.xy[0] * row.ny;
      } else {
        const Slip s = slip_of(row, v);
        const Correction g = corrected ? corrections[k] : Correction{0.0, 0.0};
        const double change = g.approach * s.approach + g.slide * s.slide;
        force = force_of(row, weight[k] * s.approach - change * g.approach,
                         beta * weight[k] * s.slide - change * g.slide);
      }
      add_forces(row, force, sums);
      if (FLOW) flow += contacts[k].share * force.xy[0] * lever(k);
    }
    return flow;
  }
};

}    // namespace LAMMPS_NS
