// SPDX-License-Identifier: GPL-2.0-or-later
#include "outline_stiffness.h"

using namespace LAMMPS_NS;
using jamlab::Vector;

void OutlineStiffness::take()
{
  laws.clear();
  for (FixOutlineEnergy *const fix : FixOutlineEnergy::all_of(lmp))
    laws.push_back({fix, fix->corners()});
}

void OutlineStiffness::add_product(const Field &p, double strain, double factor, Field &out,
                                   Virial &virial) const
{
  for (const Law &law : laws) {
    for (const Corner &c : law.corners) {
      const Vector in = p[c.i].xy() - p[c.prev].xy() + Vector{strain * c.in.y, 0.0};
      const Vector away = p[c.next].xy() - p[c.i].xy() + Vector{strain * c.out.y, 0.0};
      const double u[4] = {in.x, in.y, away.x, away.y};
      double f[4] = {0.0, 0.0, 0.0, 0.0};
      for (int m = 0; m < 4; m++)
        for (int n = 0; n < 4; n++) f[m] += factor * c.second[m][n] * u[n];
      out[c.prev] += {-f[0], -f[1], 0.0};
      out[c.i] += {f[0] - f[2], f[1] - f[3], 0.0};
      out[c.next] += {f[2], f[3], 0.0};
      virial.add({f[0], f[1]}, c.in);
      virial.add({f[2], f[3]}, c.out);
    }
    if (law.fix->stiffness_of_sum() > 0.0) add_sums(law, p, strain, factor, out, virial);
  }
}

/* The Hessian of (k/2) (sum over a polygon)^2 along the gradient of the sum. */
void OutlineStiffness::add_sums(const Law &law, const Field &p, double strain, double factor,
                                Field &out, Virial &virial)
{
  const PolygonRings &rings = law.fix->outlines();
  std::vector<double> change(rings.polygons().size(), 0.0);
  for (const Corner &c : law.corners) {
    const Vector away = p[c.next].xy() - p[c.i].xy() + Vector{strain * c.out.y, 0.0};
    change[c.polygon] += dot(c.part, away);
  }
  rings.sum(change, 1);
  for (const Corner &c : law.corners) {
    const double push = factor * law.fix->stiffness_of_sum() * change[c.polygon];
    out[c.i] += {push * c.slope.x, push * c.slope.y, 0.0};
    virial.add(c.part * push, c.out);
  }
}

void OutlineStiffness::assemble(double factor, BlockAssembly<2> &matrix) const
{
  // weights of the edges in and out at the vertices before, here and next
  static constexpr double W[3][2] = {{-1.0, 0.0}, {1.0, -1.0}, {0.0, 1.0}};
  for (const Law &law : laws) {
    for (const Corner &c : law.corners) {
      const int site[3] = {c.prev, c.i, c.next};
      for (int a = 0; a < 3; a++)
        for (int b = a; b < 3; b++) {
          double block[4] = {0.0, 0.0, 0.0, 0.0};
          for (int k = 0; k < 4; k++)
            for (int s = 0; s < 2; s++)
              for (int t = 0; t < 2; t++)
                block[k] += factor * W[a][s] * W[b][t] * c.second[2 * s + k / 2][2 * t + k % 2];
          matrix.add(site[a], site[b], {block[0], block[1], block[2], block[3]});
        }
    }
    if (law.fix->stiffness_of_sum() > 0.0) assemble_sums(law, factor, matrix);
  }
}

void OutlineStiffness::assemble_sums(const Law &law, double factor, BlockAssembly<2> &matrix)
{
  // the next vertex of the same polygon, which the box may cut into several parts
  const std::vector<Corner> &corners = law.corners;
  std::vector<int> later(corners.size()), first(law.fix->outlines().polygons().size(), -1);
  for (std::size_t n = corners.size(); n-- > 0;) {
    later[n] = first[corners[n].polygon];
    first[corners[n].polygon] = static_cast<int>(n);
  }
  for (std::size_t n = 0; n < corners.size(); n++) {
    const Vector own = corners[n].slope * (factor * law.fix->stiffness_of_sum());
    for (int m = static_cast<int>(n); m >= 0; m = later[m]) {
      const Vector &other = corners[m].slope;
      matrix.add(corners[n].i, corners[m].i,
                 {own.x * other.x, own.x * other.y, own.y * other.x, own.y * other.y});
    }
  }
}
