// SPDX-License-Identifier: GPL-2.0-or-later
// jamlab: jammed packings of disks and deformable polygons

#ifndef JAMLAB_EDGE_CELLS_H
#define JAMLAB_EDGE_CELLS_H

#include "edge_geometry.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace LAMMPS_NS {

/* A grid of square cells, each with the edges that come within reach of it: where edges have
   outgrown the neighbor lists, these cells tell what is near a point or near another edge. */

class EdgeCells {
 public:
  struct Box {
    double lo[2], hi[2];
  };

  static Box around(const EdgeFrame &edge, double reach)
  {
    const double head[2] = {edge.x + edge.ex, edge.y + edge.ey};
    return {{std::min(edge.x, head[0]) - reach, std::min(edge.y, head[1]) - reach},
            {std::max(edge.x, head[0]) + reach, std::max(edge.y, head[1]) + reach}};
  }

  // numbers[k] stands for the edge in boxes[k]
  void build(const std::vector<int> &numbers, const std::vector<Box> &boxes)
  {
    count[0] = count[1] = 1;
    whole = boxes.empty() ? Box{{0.0, 0.0}, {0.0, 0.0}} : boxes.front();
    double sizes = 0.0;
    for (const Box &box : boxes) {
      for (int d = 0; d < 2; d++) {
        whole.lo[d] = std::min(whole.lo[d], box.lo[d]);
        whole.hi[d] = std::max(whole.hi[d], box.hi[d]);
      }
      sizes += std::max(box.hi[0] - box.lo[0], box.hi[1] - box.lo[1]);
    }
    const double width = whole.hi[0] - whole.lo[0], height = whole.hi[1] - whole.lo[1];
    const double edges = std::max<double>(1.0, boxes.size());
    const double cell = std::max({sizes / edges, std::sqrt(width * height / edges), std::max(width, height) / edges});
    per_cell = cell > 0.0 ? 1.0 / cell : 0.0;
    count[0] += static_cast<int>(width * per_cell);
    count[1] += static_cast<int>(height * per_cell);

    starts.assign(static_cast<std::size_t>(count[0]) * count[1] + 1, 0);
    for (const Box &box : boxes) visit(box, [&](std::size_t cell) { starts[cell + 1]++; });
    for (std::size_t k = 1; k < starts.size(); k++) starts[k] += starts[k - 1];
    held.resize(starts.back());
    filled.assign(starts.begin(), starts.end() - 1);
    for (std::size_t k = 0; k < boxes.size(); k++)
      visit(boxes[k], [&](std::size_t cell) { held[filled[cell]++] = numbers[k]; });
  }

  // of edges that are near more than one cell of a box, more than once
  template <class Act> void near(const Box &box, Act act) const
  {
    visit(box, [&](std::size_t cell) {
      for (std::size_t k = starts[cell]; k < starts[cell + 1]; k++) act(held[k]);
    });
  }

  double memory_usage() const
  {
    return (starts.capacity() + filled.capacity()) * sizeof(std::size_t) + held.capacity() * sizeof(int);
  }

 private:
  Box whole;
  double per_cell = 0.0;
  int count[2] = {1, 1};
  std::vector<std::size_t> starts, filled;
  std::vector<int> held;

  int place(double x, int d) const
  {
    const double cell = (x - whole.lo[d]) * per_cell;
    return static_cast<int>(std::min(std::max(cell, 0.0), count[d] - 1.0));
  }

  template <class Act> void visit(const Box &box, Act act) const
  {
    const int first = place(box.lo[0], 0), last = place(box.hi[0], 0);
    for (int row = place(box.lo[1], 1); row <= place(box.hi[1], 1); row++)
      for (int column = first; column <= last; column++) act(static_cast<std::size_t>(row) * count[0] + column);
  }
};

}    // namespace LAMMPS_NS

#endif
