// SPDX-License-Identifier: GPL-2.0-or-later
#include "command_descend.h"

#include "atom.h"
#include "bond_line_tension.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix_polygon_area.h"
#include "fmt/format.h"
#include "force.h"
#include "group.h"
#include "input.h"
#include "modify.h"
#include "pair_circuloline.h"
#include "update.h"
#include "utils.h"
#include "variable.h"

#include <algorithm>
#include <cmath>
#include <cstring>

using namespace LAMMPS_NS;

static FixPolygonArea *area_of(LAMMPS *lmp)
{
  const auto found = lmp->modify->get_fix_by_style("^polygon/area$");
  return found.size() == 1 ? dynamic_cast<FixPolygonArea *>(found.front()) : nullptr;
}

CommandDescend::CommandDescend(LAMMPS *lmp) :
    CommandForces(lmp), numbers(), pair(dynamic_cast<PairCirculoline *>(force->pair)),
    stiff(lmp, area_of(lmp)), matrix(atom)
{
}

/* At the end LAMMPS has the energy, the forces and the stress of the final state.

   The string-style variable "descent" returns the numbers of steps, of evaluations of forces, of
   factorisations, of those refused because the matrix is not positive definite, of line searches
   without a lower energy, and of steps along which the force does not fall; then the largest force,
   the shift to try first the next time, and 1 if outlines crossed. */
void CommandDescend::command(int narg, char **arg)
{
  if (comm->nprocs > 1) error->all(FLERR, "jamlab/descend runs on one rank");
  if (!pair || !area_of(lmp) || !dynamic_cast<BondLineTension *>(force->bond))
    error->all(FLERR, "jamlab/descend needs pair style circuloline, bond style line/tension and "
               "one fix polygon/area");
  if (!atom->tag_consecutive())
    error->all(FLERR, "jamlab/descend needs atom IDs from 1 to the number of atoms");
  read(narg, arg);

  read_positions();
  evaluate();
  jamlab::LbfgsDescent<CommandDescend> descent(*this, numbers.method);
  descent.run(numbers.steps);
  const double largest = largest_force();
  put_positions();
  next_forces(true);
  const auto &c = descent.counts;
  input->variable->set(fmt::format(
      "descent string \"{} {} {} {} {} {} {:.17g} {:.17g} {}\"", c.steps, evaluations, c.factors,
      c.refused, c.stuck, c.bent, largest, c.shift, crossed ? 1 : 0));
}

void CommandDescend::read(int narg, char **arg)
{
  constexpr int count = sizeof(Numbers) / sizeof(double);
  if (narg != count) error->all(FLERR, "jamlab/descend needs {} numbers", count);
  const jamlab::LbfgsNumbers &n = numbers.method;
  double values[count];
  for (int k = 0; k < count; k++) values[k] = utils::numeric(FLERR, arg[k], false, lmp);
  std::memcpy(&numbers, values, sizeof(Numbers));
  if (n.refresh < 1.0 || n.definite <= 1.0)
    error->all(FLERR, "jamlab/descend: {} steps for one factorisation and a factor {} of the shift "
               "make no sense", n.refresh, n.definite);
}

/* Unwrapped positions are read by atom ID. Fix setforce must hold the atoms of a group "fixed". */
void CommandDescend::read_positions()
{
  x.resize(2 * atom->nlocal);
  const int found = group->find("fixed"), bit = found < 0 ? 0 : group->bitmask[found];
  still.assign(atom->nlocal, 0);
  for (int i = 0; i < atom->nlocal; i++) {
    still[atom->tag[i] - 1] = (atom->mask[i] & bit) != 0;
    double r[3];
    domain->unmap(atom->x[i], atom->image[i], r);
    std::copy_n(r, 2, &x[2 * (atom->tag[i] - 1)]);
  }
}

void CommandDescend::put_positions() const
{
  double zero[3] = {0.0, 0.0, 0.0}, shift[3];
  for (int i = 0; i < atom->nlocal; i++) {
    domain->unmap(zero, atom->image[i], shift);
    for (int d = 0; d < 2; d++) atom->x[i][d] = x[2 * (atom->tag[i] - 1) + d] - shift[d];
  }
}

void CommandDescend::evaluate()
{
  put_positions();
  present_energy = next_forces();
  present_forces.resize(x.size());
  for (int i = 0; i < atom->nlocal; i++)
    std::copy_n(atom->f[i], 2, &present_forces[2 * (atom->tag[i] - 1)]);
  evaluations++;
}

void CommandDescend::go(const Values &step, double length)
{
  x = marked;
  jamlab::add(x, length, step);
  evaluate();
}

void CommandDescend::back()
{
  x = marked;
  evaluate();
}

void CommandDescend::moved(Values &change) const
{
  change = x;
  jamlab::add(change, -1.0, marked);
}

double CommandDescend::largest_force() const
{
  const Values &f = present_forces;
  double largest = 0.0;
  for (std::size_t k = 0; k < f.size(); k += 2)
    largest = std::max(largest, f[k] * f[k] + f[k + 1] * f[k + 1]);
  return std::sqrt(largest);
}

/* The descent has converged, or forces are too small to press droplets together again. The energy
   of contacts that pull is negative. */
bool CommandDescend::ended() const
{
  const double largest = largest_force();
  return largest <= numbers.force ||
         (largest < numbers.loose_force && std::fabs(pair->eng_vdwl) < numbers.loose_energy);
}

bool CommandDescend::assemble(double beyond)
{
  crossed = !find_meetings(*pair, atom->x, meetings, beyond);
  if (crossed) return false;
  std::vector<int> rows(atom->nlocal);
  for (int i = 0; i < atom->nlocal; i++) rows[atom->tag[i] - 1] = i;
  if (rows != row) factors.forget_order();
  row = rows;
  for (DropletMeeting &m : meetings) m.stiffness = std::max(m.stiffness, 0.0);
  stiff.take(meetings);
  matrix = BlockAssembly<2>(atom);
  stiff.assemble(1.0, matrix);
  matrix.fill(factors);
  return filled = true;
}

bool CommandDescend::factorise(double shift)
{
  if (!filled) matrix.refill(factors);
  filled = false;
  return factors.factorise(shift);
}

void CommandDescend::solve(const Values &force, Values &step, bool roughly)
{
  column.resize(force.size());
  for (std::size_t k = 0; k < row.size(); k++) std::copy_n(&force[2 * k], 2, &column[2 * row[k]]);
  roughly ? factors.solve_roughly(column) : factors.solve(column);
  step.resize(force.size());
  for (std::size_t k = 0; k < row.size(); k++)
    if (still[k])
      step[2 * k] = step[2 * k + 1] = 0.0;
    else
      std::copy_n(&column[2 * row[k]], 2, &step[2 * k]);
}
