// This file sorts disks in a periodic parallelogram by bins, and lists which of them may touch
// until one has moved half a skin.
#pragma once

#include "periodic_grid.h"

using jamlab::Vector;

struct Disk {
  Vector at;
  double radius, lightness;  // one half of a cache line in all; lightness: 1/mass
};

// A triangle is a box with rows (xx, 0) and (xy, yy), or the map of positions by the transposed
// matrix.
struct Triangle {
  double xx, xy, yy;

  Triangle after(const Triangle &f) const { return {f.xx * xx, f.xx * xy + f.xy * yy, f.yy * yy}; }
  Vector operator()(const Vector &r) const { return {xx * r.x + xy * r.y, yy * r.y}; }
  double strain() const { return std::max(std::fabs(xx - 1), std::fabs(yy - 1)) + std::fabs(xy); }
};

// A share is a part of the disks, [first, last) in sorted order, with its pairs: a disk of the
// share, and the number of its neighbor with, above that, the image of the neighbor.
struct Share {
  std::int64_t first = 0, last = 0;
  std::vector<std::uint32_t> disk, neighbor;              // both in the share: listed once
  std::vector<std::uint32_t> outer_disk, outer_neighbor;  // pairs that another share lists as well
};

class DiskNeighbors {
 public:
  static constexpr std::uint32_t NUMBER = (1u << 28) - 1;
  static constexpr int IMAGE = 28;  // bits above: 3 sx + sy + 4 for shifts -1, 0, 1 by the two rows
  static constexpr std::int64_t MOST = NUMBER;
  // Disks above so many mean diameters have a mass in proportion to their diameter, as to the
  // number of their contacts: otherwise they would be the stiffest and limit the time step of all.
  // 4096 disks of 1:20 take a third fewer steps.
  static constexpr double HEAVY = 2.0;

  DiskNeighbors(std::int64_t n, const double *positions, const double *diameters, Triangle box,
                int shares)
      : box(box), disks(n), velocity(n), id(n), image_x(n), image_y(n), built(n), shares(shares)
  {
    double heavy = 0.0;
    for (std::int64_t i = 0; i < n; ++i) heavy += HEAVY * diameters[i] / static_cast<double>(n);
    for (std::int64_t i = 0; i < n; ++i) {
      const double lightness = std::min(1.0, heavy / diameters[i]);
      disks[i] = {jamlab::point(positions, i), 0.5 * diameters[i], lightness};
      id[i] = i;
      largest = std::max(largest, diameters[i]);
    }
    set_box(box);
  }

  void set_box(Triangle to)
  {
    box = to;
    for (int k = 0; k < 9; ++k) shift[k] = box({k / 3 - 1.0, k % 3 - 1.0});
  }

  // Returns whether bins as wide as the reach fit three times into the box either way: then a pair
  // can touch in one image only.
  bool fits(double skin)
  {
    const double reach = (largest + skin) * (1 + 1e-12);
    const double across = box.xx * box.yy / std::hypot(box.xy, box.yy);
    if (!(reach > 0) || !(across >= 3 * reach) || !(box.yy >= 3 * reach)) return false;
    // bins are larger in wide empty boxes
    const double most = std::sqrt(4.0 * static_cast<double>(disks.size())) + 3;
    bins.count[UP] = static_cast<std::int64_t>(std::min(box.yy / reach, most));
    bins.count[ALONG] = static_cast<std::int64_t>(std::min(across / reach, most));
    return true;
  }

  // Wraps and sorts all disks. Returns false if a position is not finite, or so far away that it
  // cannot be told from its image.
  bool sort()
  {
    const std::int64_t n = static_cast<std::int64_t>(disks.size());
    std::vector<std::int64_t> bin(n);
    for (std::int64_t i = 0; i < n; ++i) {
      const double up = disks[i].at.y / box.yy, along = (disks[i].at.x - box.xy * up) / box.xx;
      const double wrap_y = std::floor(up), wrap_x = std::floor(along);
      if (!(std::fabs(wrap_x) < 1e9) || !(std::fabs(wrap_y) < 1e9)) return false;
      disks[i].at -= box({wrap_x, wrap_y});
      image_x[i] += static_cast<std::int64_t>(wrap_x);
      image_y[i] += static_cast<std::int64_t>(wrap_y);
      bin[i] = bins.at(up - wrap_y, along - wrap_x);
    }
    const std::vector<std::int64_t> place = bins.sort(bin);
    permute(disks, place);
    permute(velocity, place);
    permute(id, place);
    permute(image_x, place);
    permute(image_y, place);
    for (std::int64_t i = 0; i < n; ++i) built[i] = disks[i].at;
    const std::int64_t parts = static_cast<std::int64_t>(shares.size());
    for (std::int64_t k = 0; k < parts; ++k) {
      shares[k].first = n * k / parts;
      shares[k].last = n * (k + 1) / parts;
    }
    return true;
  }

  // Lists the pairs of one share that are nearer than their contact distance and the skin.
  void list(Share &share, double skin) const
  {
    for (auto *list : {&share.disk, &share.neighbor, &share.outer_disk, &share.outer_neighbor})
      list->clear();
    if (share.first == share.last) return;
    std::int64_t bin = bins.of(share.first);
    for (std::int64_t i = share.first; i < share.last; ++i) {
      while (bins.end(bin) <= i) ++bin;
      const std::int64_t row = bin / bins.count[ALONG], column = bin % bins.count[ALONG];
      const std::int64_t from[2] = {row - 1, column - 1}, to[2] = {row + 1, column + 1};
      bins.visit(from, to, [&](std::int64_t begin, std::int64_t end, const jamlab::Image &of) {
        const std::uint32_t image = static_cast<std::uint32_t>(3 * of.second + of.first + 4);
        for (std::int64_t j = begin; j < end; ++j) {
          const bool mine = j >= share.first && j < share.last;
          if (mine ? j <= i : j == i) continue;
          const Vector apart = disks[j].at + shift[image] - disks[i].at;
          const double reach = disks[i].radius + disks[j].radius + skin;
          if (dot(apart, apart) > reach * reach) continue;
          const std::uint32_t neighbor = static_cast<std::uint32_t>(j) | image << IMAGE;
          (mine ? share.disk : share.outer_disk).push_back(static_cast<std::uint32_t>(i));
          (mine ? share.neighbor : share.outer_neighbor).push_back(neighbor);
        }
      });
    }
  }

  // Returns how far a disk of the share has moved at most since the disks were sorted, and half a
  // pair by the strain of the box.
  double moved(const Share &share, const Triangle &since, double skin) const
  {
    double most = 0.0;
    for (std::int64_t i = share.first; i < share.last; ++i) {
      const Vector moved = disks[i].at - since(built[i]);
      most = std::max(most, dot(moved, moved));
    }
    return std::sqrt(most) + strained(since, skin);
  }

  double strained(const Triangle &map, double skin) const
  {
    return 0.5 * map.strain() * (largest + skin);
  }

  // Writes unwrapped positions in the order given at first.
  void unwrapped(double *positions) const
  {
    for (std::size_t i = 0; i < disks.size(); ++i) {
      const double right = static_cast<double>(image_x[i]), up = static_cast<double>(image_y[i]);
      const Vector turned = disks[i].at + Vector{right * box.xx, 0.0};
      jamlab::put(positions, id[i], turned + Vector{up * box.xy, up * box.yy});
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
  enum Side { UP, ALONG };
  double largest = 0.0;
  jamlab::PeriodicBins bins;  // first up the box, then along x

  template <class Value>
  static void permute(std::vector<Value> &values, const std::vector<std::int64_t> &place)
  {
    std::vector<Value> sorted(values.size());
    for (std::size_t i = 0; i < values.size(); ++i) sorted[place[i]] = values[i];
    values.swap(sorted);
  }
};
