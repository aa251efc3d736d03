// Disks in a periodic parallelogram, sorted by cells, and who of them may touch whom until one has moved half a skin.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

struct Vector {
  double x, y;
};

struct Disk {
  double x, y, radius, lightness;  // one half of a cache line; lightness: 1/mass
};

// A box with rows (xx, 0) and (xy, yy), or the map of positions that the transposed matrix makes.
struct Triangle {
  double xx, xy, yy;

  Triangle after(const Triangle &f) const { return {f.xx * xx, f.xx * xy + f.xy * yy, f.yy * yy}; }
  Vector operator()(double x, double y) const { return {xx * x + xy * y, yy * y}; }
  double strain() const { return std::max(std::fabs(xx - 1), std::fabs(yy - 1)) + std::fabs(xy); }
};

// A part of the disks, [first, last) in sorted order, and its pairs: a disk of the share, and its neighbor's number
// with, above that, which image of it.
struct Share {
  std::int64_t first = 0, last = 0;
  std::vector<std::uint32_t> disk, neighbor;                  // both in the share: once
  std::vector<std::uint32_t> outer_disk, outer_neighbor;      // the neighbor in another share, which lists it as well
};

class DiskNeighbors {
 public:
  static constexpr std::uint32_t NUMBER = (1u << 28) - 1;
  static constexpr int IMAGE = 28;  // bits above: 3 sx + sy + 4 for shifts -1, 0, 1 by the two rows
  static constexpr std::int64_t MOST = NUMBER;
  // Disks above so many mean diameters have a mass in proportion to their diameter, as to the number of their contacts:
  // they would be the stiffest and hold back the time step of all. 4096 disks of 1:20 take a third fewer steps.
  static constexpr double HEAVY = 2.0;

  DiskNeighbors(std::int64_t n, const double *positions, const double *diameters, Triangle box, int shares)
      : box(box), disks(n), velocity(n), id(n), image_x(n), image_y(n), built(n), shares(shares)
  {
    double heavy = 0.0;
    for (std::int64_t i = 0; i < n; ++i) heavy += HEAVY * diameters[i] / static_cast<double>(n);
    for (std::int64_t i = 0; i < n; ++i) {
      disks[i] = {positions[2 * i], positions[2 * i + 1], 0.5 * diameters[i], std::min(1.0, heavy / diameters[i])};
      id[i] = i;
      largest = std::max(largest, diameters[i]);
    }
    set_box(box);
  }

  void set_box(Triangle to)
  {
    box = to;
    for (int k = 0; k < 9; ++k) shift[k] = {(k / 3 - 1) * box.xx + (k % 3 - 1) * box.xy, (k % 3 - 1) * box.yy};
  }

  // Whether cells as wide as the reach fit three times into the box either way: a pair then meets in one image only.
  bool fits(double skin)
  {
    const double reach = (largest + skin) * (1 + 1e-12);
    const double across = box.xx * box.yy / std::hypot(box.xy, box.yy);
    if (!(reach > 0) || !(across >= 3 * reach) || !(box.yy >= 3 * reach)) return false;
    const double most = std::sqrt(4.0 * static_cast<double>(disks.size())) + 3;  // wide empty boxes: larger cells
    columns = static_cast<std::int64_t>(std::min(across / reach, most));
    rows = static_cast<std::int64_t>(std::min(box.yy / reach, most));
    return true;
  }

  // Wrap and sort all disks. False: a position is not finite, or too far away to be told from its image.
  bool sort()
  {
    const std::int64_t n = static_cast<std::int64_t>(disks.size());
    std::vector<std::int64_t> cell(n);
    cell_start.assign(columns * rows + 1, 0);
    for (std::int64_t i = 0; i < n; ++i) {
      double up = disks[i].y / box.yy, along = (disks[i].x - box.xy * up) / box.xx;
      const double wrap_y = std::floor(up), wrap_x = std::floor(along);
      if (!(std::fabs(wrap_x) < 1e9) || !(std::fabs(wrap_y) < 1e9)) return false;
      disks[i].x -= wrap_x * box.xx + wrap_y * box.xy;
      disks[i].y -= wrap_y * box.yy;
      image_x[i] += static_cast<std::int64_t>(wrap_x);
      image_y[i] += static_cast<std::int64_t>(wrap_y);
      const auto place = [](double fraction, std::int64_t cells) {
        return std::clamp<std::int64_t>(static_cast<std::int64_t>(fraction * static_cast<double>(cells)), 0, cells - 1);
      };
      const std::int64_t row = place(up - wrap_y, rows), column = place(along - wrap_x, columns);
      cell[i] = row * columns + column;
      ++cell_start[cell[i] + 1];
    }
    for (std::int64_t c = 0; c < columns * rows; ++c) cell_start[c + 1] += cell_start[c];
    std::vector<std::int64_t> next(cell_start.begin(), cell_start.end() - 1), place(n);
    for (std::int64_t i = 0; i < n; ++i) place[i] = next[cell[i]]++;
    permute(disks, place);
    permute(velocity, place);
    permute(id, place);
    permute(image_x, place);
    permute(image_y, place);
    for (std::int64_t i = 0; i < n; ++i) built[i] = {disks[i].x, disks[i].y};
    const std::int64_t parts = static_cast<std::int64_t>(shares.size());
    for (std::int64_t k = 0; k < parts; ++k) {
      shares[k].first = n * k / parts;
      shares[k].last = n * (k + 1) / parts;
    }
    return true;
  }

  // List the pairs of one share, nearer than their contact distance and the skin.
  void list(Share &share, double skin) const
  {
    for (auto *list : {&share.disk, &share.neighbor, &share.outer_disk, &share.outer_neighbor}) list->clear();
    if (share.first == share.last) return;
    std::int64_t c = std::upper_bound(cell_start.begin(), cell_start.end(), share.first) - cell_start.begin() - 1;
    for (std::int64_t i = share.first; i < share.last; ++i) {
      while (cell_start[c + 1] <= i) ++c;
      const std::int64_t row = c / columns, column = c % columns;
      for (std::int64_t dy = -1; dy <= 1; ++dy)
        for (std::int64_t dx = -1; dx <= 1; ++dx) {
          std::int64_t r = row + dy, q = column + dx, sx = 0, sy = 0;
          if (r < 0) r += rows, sy = -1;
          if (r >= rows) r -= rows, sy = 1;
          if (q < 0) q += columns, sx = -1;
          if (q >= columns) q -= columns, sx = 1;
          const std::uint32_t image = static_cast<std::uint32_t>(3 * sx + sy + 4);
          for (std::int64_t j = cell_start[r * columns + q]; j < cell_start[r * columns + q + 1]; ++j) {
            const bool mine = j >= share.first && j < share.last;
            if (mine ? j <= i : j == i) continue;
            const double x = disks[j].x + shift[image].x - disks[i].x, y = disks[j].y + shift[image].y - disks[i].y;
            const double reach = disks[i].radius + disks[j].radius + skin;
            if (x * x + y * y > reach * reach) continue;
            const std::uint32_t neighbor = static_cast<std::uint32_t>(j) | image << IMAGE;
            (mine ? share.disk : share.outer_disk).push_back(static_cast<std::uint32_t>(i));
            (mine ? share.neighbor : share.outer_neighbor).push_back(neighbor);
          }
        }
    }
  }

  // How far a disk of a share has moved at most since the disks were sorted, and half a pair by the strain of the box.
  double moved(const Share &share, const Triangle &since, double skin) const
  {
    double most = 0.0;
    for (std::int64_t i = share.first; i < share.last; ++i) {
      const Vector along = since(built[i].x, built[i].y);
      const double x = disks[i].x - along.x, y = disks[i].y - along.y;
      most = std::max(most, x * x + y * y);
    }
    return std::sqrt(most) + strained(since, skin);
  }

  double strained(const Triangle &map, double skin) const { return 0.5 * map.strain() * (largest + skin); }

  // Positions in the order given at first, unwrapped.
  void unwrapped(double *positions) const
  {
    for (std::size_t i = 0; i < disks.size(); ++i) {
      const double right = static_cast<double>(image_x[i]), up = static_cast<double>(image_y[i]);
      positions[2 * id[i]] = disks[i].x + right * box.xx + up * box.xy;
      positions[2 * id[i] + 1] = disks[i].y + up * box.yy;
    }
  }

  Triangle box;
  std::vector<Disk> disks;
  std::vector<Vector> velocity;
  std::vector<std::int64_t> id, image_x, image_y;
  std::vector<Vector> built;
  std::vector<Share> shares;
  Vector shift[9];

 private:
  double largest = 0.0;
  std::int64_t columns = 0, rows = 0;
  std::vector<std::int64_t> cell_start;

  template <class Value> static void permute(std::vector<Value> &values, const std::vector<std::int64_t> &place)
  {
    std::vector<Value> sorted(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) sorted[place[i]] = values[i];
    values.swap(sorted);
  }
};
