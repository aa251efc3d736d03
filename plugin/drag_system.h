// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

#include "block_assembly.h"
#include "drag_solver.h"
#include "slip_row.h"

#include <algorithm>
#include <cmath>

namespace LAMMPS_NS {

/* Drag of disks and of droplets: B = J^T W J + background, by the rows J of slips at contacts. Products,
   sums of stress, weights of a power law and Cholesky factors as a preconditioner serve both. */
template <class Row> class DragSystem : public DragSolver {
 public:
  double memory_usage() const override
  {
    return DragSolver::memory_usage() + rows.capacity() * (sizeof(Row) + sizeof(Contact) + sizeof(double)) +
        factors.memory_usage();
  }

  void hold(const std::vector<char> &atoms) override
  {
    DragSolver::hold(atoms);
    for (std::size_t i = 0; i < given.size(); i++)
      if (given[i]) background[i] = 0.0;
  }

 protected:
  static constexpr int D = Row::D;
  using Part = RowPart<D>;
  using Block = typename BlockCholesky<D>::Block;
  struct Contact {    // what products do not need of a row
    double distance, stiffness;
    double force = 0.0, energy = 0.0;    // elastic, a push
    double share = 1.0;                  // 1/2 of a contact that two ranks see
    double part = 1.0, held = 0.0;    // of the drag in the matrix; force along the slip beside it
  };
  std::vector<Row> rows;
  std::vector<Contact> contacts;
  std::vector<double> weights;       // drag over velocity of approach
  std::vector<double> background;    // drag of each owned atom on the affine flow
  std::vector<Slip> bends;    // of a power law: the slope of the drag is the weights less bend bend^T
  BlockCholesky<D> factors;
  bool rows_are_own = false;    // no row has a ghost, on any rank

  using DragSolver::DragSolver;

  double lever(std::size_t k) const { return rows[k].ny * contacts[k].distance; }
  Slip slip(std::size_t k, const Field &u, double rate) const
  {
    return slip_of(rows[k], passing(rows[k], u.data(), rate * lever(k)));
  }

  // droplets: spins follow from vertices, torques are forces on these; forces ahead in time
  virtual void find_spins(Field &, double /*rate*/) {}
  virtual double turn_back(Field &, FlowSums *) { return 0.0; }
  virtual double add_forces_ahead(const Field &, double /*rate*/, double /*ahead*/, Field &) { return 0.0; }
  virtual void project(Field &) const {}    // on what the drag resists

  // B, or with ahead > 0 also ahead K; bent: the slope of the drag instead of the drag
  void apply(Field &p, double rate, double ahead, bool bent, Field &out, double &power, double &flow,
             double *also = nullptr, FlowSums *drag = nullptr)
  {
    if (!rows_are_own) exchange.send_to_ghosts(p);
    find_spins(p, rate);
    std::fill_n(out.begin(), rows_are_own ? nlocal : nlocal + nghost, Vec3());
    if (drag) add_row_sums(p, rate, *drag);
    double sums[3] = {0.0, 0.0, also ? *also : 0.0};
    const bool isotropic = law.beta == 1.0 && !bent;
    if (needs_flow || rate != 0.0)
      sums[1] = isotropic ? add_rows<true, true>(p, rate, bent, out) : add_rows<false, true>(p, rate, bent, out);
    else
      isotropic ? add_rows<true, false>(p, rate, bent, out) : add_rows<false, false>(p, rate, bent, out);
    sums[1] += add_forces_ahead(p, rate, ahead, out);
    if (!rows_are_own) exchange.add_from_ghosts(out);
    sums[1] += turn_back(out, drag);
    for (int i = 0; i < nlocal && settings.background > 0.0; i++) {
      out[i].x += background[i] * p[i].x;
      out[i].y += background[i] * p[i].y;
    }
    sums[0] += field_dot(out, p, nlocal);
    MPI_Allreduce(MPI_IN_PLACE, sums, 3, MPI_DOUBLE, MPI_SUM, world);
    flow = sums[1];
    power = sums[0] + rate * flow;
    if (also) *also = sums[2];
  }

  void multiply(Field &p, double rate, Field &out, double &power, double &flow) override
  {
    apply(p, rate, 0.0, false, out, power, flow);
  }

  void find_weights(const Field &u, double rate) override
  {
    const bool linear = law.alpha == 1.0;
    bends.clear();
    weights.resize(rows.size());
    double sums[2] = {0.0, 0.0};
    if (!linear) {
      spun.assign(u.begin(), u.begin() + nlocal + nghost);
      find_spins(spun, rate);
    }
    for (std::size_t k = 0; k < rows.size() && !linear; k++) {
      const Slip s = slip(k, spun, rate);
      weights[k] = law.square(s.approach, s.slide);
      sums[0] += contacts[k].share * weights[k];
      sums[1] += contacts[k].share;
    }
    const double slowest = linear ? 0.0 : speed_floor(sums[0], sums[1]);
    for (std::size_t k = 0; k < rows.size(); k++)
      weights[k] = contacts[k].part * contacts[k].stiffness * law.weight(weights[k], slowest);
  }

  // of this rank, beside the elastic stress of forces that no row knows
  void add_row_sums(const Field &u, double rate, FlowSums &sums) const
  {
    for (std::size_t k = 0; k < rows.size(); k++) {
      const Row &row = rows[k];
      const Contact &c = contacts[k];
      const Slip s = slip(k, u, rate);
      const double push = weights[k] * s.approach, rub = law.beta * weights[k] * s.slide + c.held;
      const Vec3 drag = force_of(row, push, rub);
      const double length = c.share * c.distance;
      sums.elastic -= length * c.force * row.nx * row.ny;
      sums.viscous += length * drag.x * row.ny;
      sums.xx += length * (drag.x - c.force * row.nx) * row.nx;
      sums.yy += length * (drag.y - c.force * row.ny) * row.ny;
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
  }

  virtual void find_parts(std::size_t k, std::vector<Part> &parts) const
  {
    parts.clear();
    for (int a = 0; a < Row::SITES; a++) {
      const double c = rows[k].coefficient(a);
      Part part = {rows[k].site(a), {c * rows[k].nx, c * rows[k].ny}, {-c * rows[k].ny, c * rows[k].nx}};
      if (D == 3) part.slide[D - 1] = -rows[k].arm(a);
      parts.push_back(part);
    }
  }

  // the block of two parts of a row in the slope of the drag
  Block block(std::size_t k, const Part &p, const Part &q) const
  {
    const double w = weights[k], v = law.beta * w;
    const Slip bend = bends.empty() ? Slip{0.0, 0.0} : bends[k];
    const auto bent = [&](const Part &part, int a) {
      return bend.approach * part.approach[a] + bend.slide * part.slide[a];
    };
    Block found;
    for (int a = 0; a < D; a++)
      for (int b = 0; b < D; b++)
        found[D * a + b] = contacts[k].share *
            (w * p.approach[a] * q.approach[b] + v * p.slide[a] * q.slide[b] - bent(p, a) * bent(q, b));
    return found;
  }

  // one part for each atom of this rank
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
    if (!factored) return DragSolver::precondition();
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
  Field spun;
  std::vector<double> column;

  template <bool ISOTROPIC, bool FLOW> double add_rows(const Field &p, double rate, bool bent, Field &out) const
  {
    const Vec3 *const __restrict u = p.data();
    Vec3 *const __restrict sums = out.data();
    const Row *const __restrict all = rows.data();
    const double *const __restrict weight = weights.data(), beta = law.beta;
    double flow = 0.0;
    for (std::size_t k = 0, size = rows.size(); k < size; k++) {
      const Row &row = all[k];
      const Vec3 v = passing(row, u, FLOW ? rate * lever(k) : 0.0);
      Vec3 force;
      if (ISOTROPIC) {
        force = {weight[k] * (v.x + v.spin * row.ny), weight[k] * (v.y - v.spin * row.nx), 0.0};
        force.spin = force.y * row.nx - force.x * row.ny;
      } else {
        const Slip s = slip_of(row, v), bend = bent ? bends[k] : Slip{0.0, 0.0};
        const double change = bend.approach * s.approach + bend.slide * s.slide;
        force = force_of(row, weight[k] * s.approach - change * bend.approach,
                         beta * weight[k] * s.slide - change * bend.slide);
      }
      add_forces(row, force, sums);
      if (FLOW) flow += contacts[k].share * force.x * lever(k);
    }
    return flow;
  }
};

}    // namespace LAMMPS_NS
