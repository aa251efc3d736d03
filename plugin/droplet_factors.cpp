// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

/* The preconditioner of droplets: Cholesky factors of B + ahead K, of the vertices of each rank. */

#include "droplet_drag.h"

#include "atom.h"
#include "block_assembly.h"
#include "error.h"
#include "update.h"

#include <algorithm>

using namespace LAMMPS_NS;

static constexpr double SHIFT = 1e-8;    // of the diagonal, over its mean: droplets drift as a whole

/* ---------------------------------------------------------------------- */

void DropletDrag::find_preconditioner(bool free_rate)
{
  int anew = stale || atoms_moved_between_ranks;
  MPI_Allreduce(MPI_IN_PLACE, &anew, 1, MPI_INT, MPI_MAX, world);
  if (anew) factorise();
  stale = law.alpha != 1.0;
  inverse_flow = 0.0;
  if (!free_rate) return;
  double power, flow;
  std::fill(still.begin(), still.end(), Motion());
  Motions out(still.size());
  multiply_ahead(still, 1.0, out, power, flow);
  flow += settings.fluid;
  inverse_flow = flow > 0.0 ? 1.0 / flow : 0.0;
}

/* ----------------------------------------------------------------------
   with less of K, if what can be negative in it makes the whole so
------------------------------------------------------------------------- */

void DropletDrag::factorise()
{
  factors_ahead = ahead;
  if (atoms_moved_between_ranks) factors.forget_order();
  atoms_moved_between_ranks = false;
  for (const bool whole : {true, false}) {
    BlockAssembly matrix(lmp->atom);
    assemble_drag(matrix);
    if (ahead > 0.0) stiffness.assemble(ahead, whole, matrix);
    matrix.fill(factors);
    mean_diagonal = factors.mean_diagonal();
    if (factors.factorise(mean_diagonal > 0.0 ? SHIFT * mean_diagonal : 1.0)) return;
  }
  lmp->error->one(FLERR, "Fix overdamped: the matrix of drag has no Cholesky factor at step {}: are positions finite?",
                  lmp->update->ntimestep);
}

/* ----------------------------------------------------------------------
   what approach and slip of a meeting depend on: one part for each vertex of this rank
------------------------------------------------------------------------- */

struct Part {
  int i;
  double approach[2], slide[2];
};

static void merge(std::vector<Part> &parts, const BlockAssembly &matrix)
{
  std::size_t kept = 0;
  for (const Part part : parts) {
    const int own = matrix.owner(part.i);
    if (own < 0) continue;
    std::size_t k = 0;
    while (k < kept && parts[k].i != own) k++;
    if (k == kept)
      parts[kept++] = {own, {part.approach[0], part.approach[1]}, {part.slide[0], part.slide[1]}};
    else
      for (int d = 0; d < 2; d++) {
        parts[k].approach[d] += part.approach[d];
        parts[k].slide[d] += part.slide[d];
      }
  }
  parts.resize(kept);
}

/* ----------------------------------------------------------------------
   approach and slip of every meeting as rows over the vertices that they depend on
------------------------------------------------------------------------- */

void DropletDrag::assemble_drag(BlockAssembly &matrix) const
{
  std::vector<Part> parts;
  for (std::size_t k = 0; k < meetings.size(); k++) {
    const DropletMeeting &m = meetings[k];
    const int site[3] = {m.vertex, m.tail, m.head};
    const double c[3] = {1.0, m.t - 1.0, -m.t}, q[3] = {1.0, 1.0 - m.t, m.t};
    parts.clear();
    for (int a = 0; a < 3; a++)
      parts.push_back({site[a], {c[a] * m.nx, c[a] * m.ny}, {-c[a] * m.ny, c[a] * m.nx}});
    for (int a = 0; a < 3; a++) {
      const int own = matrix.owner(site[a]);
      if (own < 0) continue;
      const Turn &t = turns[own];
      const double arm = 0.5 * m.distance * q[a] * t.per_square;
      parts.push_back({own, {0.0, 0.0}, {arm * (t.in_y - t.out_y), arm * (t.out_x - t.in_x)}});
      parts.push_back({t.prev, {0.0, 0.0}, {-arm * t.in_y, arm * t.in_x}});
      parts.push_back({t.next, {0.0, 0.0}, {arm * t.out_y, -arm * t.out_x}});
    }
    merge(parts, matrix);
    const double w = weights[k], v = law.beta * w;
    for (std::size_t a = 0; a < parts.size(); a++)
      for (std::size_t b = a; b < parts.size(); b++) {
        const Part &p = parts[a], &r = parts[b];
        const auto part = [&](int i, int j) { return w * p.approach[i] * r.approach[j] + v * p.slide[i] * r.slide[j]; };
        matrix.add(p.i, r.i, {part(0, 0), part(0, 1), part(1, 0), part(1, 1)});
      }
  }
  for (int i = 0; i < nlocal; i++) matrix.add(i, i, {turns[i].drag, 0.0, 0.0, turns[i].drag});
}

/* ---------------------------------------------------------------------- */

double DropletDrag::precondition(double r_flow, double &z_flow)
{
  if (settings.background == 0.0) remove_mean(residual);    // contacts leave all of it free to drift
  column.resize(2 * nlocal);
  for (int i = 0; i < nlocal; i++) {
    column[2 * i] = residual[i].x;
    column[2 * i + 1] = residual[i].y;
  }
  factors.solve(column);
  for (int i = 0; i < nlocal; i++) descent[i] = {column[2 * i], column[2 * i + 1], 0.0};
  if (settings.background == 0.0) remove_mean(descent);
  double product = 0.0;
  for (int i = 0; i < nlocal; i++) product += residual[i].x * descent[i].x + residual[i].y * descent[i].y;
  z_flow = inverse_flow * r_flow;
  return sum(product) + r_flow * z_flow;
}

/* ---------------------------------------------------------------------- */

void DropletDrag::remove_mean(Motions &motions) const
{
  double mean[2] = {0.0, 0.0};
  for (int i = 0; i < nlocal; i++) {
    mean[0] += motions[i].x;
    mean[1] += motions[i].y;
  }
  MPI_Allreduce(MPI_IN_PLACE, mean, 2, MPI_DOUBLE, MPI_SUM, world);
  for (int i = 0; i < nlocal; i++) {
    motions[i].x -= mean[0] / lmp->atom->natoms;
    motions[i].y -= mean[1] / lmp->atom->natoms;
  }
}
