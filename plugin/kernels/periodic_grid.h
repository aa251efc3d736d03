// Points in a periodic parallelogram, sorted into bins of its reduced cell.
//
// The grid finds the points that may lie near a place, in every image. The lattice is first reduced
// to its shortest vectors (Lagrange-Gauss), so that few images are needed even in a strongly
// sheared box. Wrapping only serves the search: callers compute distances from the given points.
#pragma once

#include "vector.h"

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <utility>
#include <vector>

namespace jamlab {

enum Refusal : int64_t { TOO_MANY_IMAGES = -1, TOO_FAR = -2 };

// A periodic image is known by its translation in multiples of two lattice vectors.
struct Image {
  int64_t first, second;
  bool operator==(const Image &other) const { return (*this - other).home(); }
  bool operator<(const Image &other) const
  {
    return first != other.first ? first < other.first : second < other.second;
  }
  Image operator+(const Image &other) const { return {first + other.first, second + other.second}; }
  Image operator-(const Image &other) const { return {first - other.first, second - other.second}; }
  bool home() const { return first == 0 && second == 0; }
  bool positive() const { return Image{0, 0} < *this; }  // one of two opposite images
};

// Translations of points and copies, in vectors of the box, fit in 64 bits below 2^52 and 2^37.
constexpr double LARGEST_WRAP = 4503599627370496.0, LARGEST_COMBINATION = 137438953472.0;

// A place has fractions from 0 to 1 of the reduced cell; `wrap` counts the vectors to a point.
struct Place {
  double f[2];
  Image wrap;
};

inline double largest_coordinate(int64_t n, const double *points)
{
  double largest = 0.0;
  for (int64_t k = 0; k < 2 * n; ++k) largest = std::max(largest, std::fabs(points[k]));
  return largest;
}

class Lattice {
 public:
  Vector box[2], cell[2];  // rows: the vectors as given, and the shortest ones
  double height[2];        // of the cell across each pair of its sides
  double longest;          // coordinate of the box

  explicit Lattice(const double *rows)
  {
    for (int k = 0; k < 2; ++k) box[k] = cell[k] = point(rows, k);
    longest = largest_coordinate(2, rows);
    reduce();
    largest_wrap = std::min(LARGEST_WRAP, 128 * LARGEST_WRAP / largest_combination());
    density = 1 / cross(cell[0], cell[1]);
    for (int k = 0; k < 2; ++k)
      height[k] = 1 / (std::fabs(density) * std::hypot(cell[1 - k].x, cell[1 - k].y));
  }

  // Returns coordinates in vectors of the cell.
  Vector fraction(const Vector &p) const
  {
    return Vector{cross(p, cell[1]), cross(cell[0], p)} * density;
  }

  // Returns false for a point so far away that its image cannot be counted.
  bool locate(const Vector &p, Place &place) const
  {
    const Vector whole = fraction(p);
    const double f[2] = {whole.x, whole.y};
    double wrap[2];
    for (int k = 0; k < 2; ++k) {
      wrap[k] = std::floor(f[k]);
      if (!(std::fabs(wrap[k]) < largest_wrap)) return false;
      place.f[k] = f[k] - wrap[k];
    }
    place.wrap = {static_cast<int64_t>(wrap[0]), static_cast<int64_t>(wrap[1])};
    return true;
  }

  // Returns the translation in vectors of the box that is m vectors of the cell.
  Image in_box(const Image &m) const
  {
    return {m.first * combination[0].first + m.second * combination[1].first,
            m.first * combination[0].second + m.second * combination[1].second};
  }

  Vector translation(const Image &shift) const
  {
    return box[0] * static_cast<double>(shift.first) + box[1] * static_cast<double>(shift.second);
  }

  // Returns the part of the cell that a distance takes, beyond the rounding of fractions.
  double margin(double reach, int k) const { return reach / height[k] + 1e-9; }

  // Returns whether points have more copies within reach of the cell than a search may visit.
  bool too_many_images(double reach, int64_t points, double most) const
  {
    double copies = static_cast<double>(points);
    for (int k = 0; k < 2; ++k) copies *= 2 * std::ceil(margin(reach, k)) + 1;
    return !(copies <= most);
  }

  void report(double reach, double *search) const
  {
    const double values[5] = {reach, cell[0].x, cell[0].y, cell[1].x, cell[1].y};
    std::copy(values, values + 5, search);
  }

 private:
  Image combination[2] = {{1, 0}, {0, 1}};  // cell = combination @ box
  double largest_wrap;
  double density;  // of lattice points, negative for a cell whose vectors turn clockwise

  double largest_combination() const
  {
    int64_t largest = 1;
    for (const auto &[a, b] : combination) largest = std::max({largest, std::abs(a), std::abs(b)});
    return static_cast<double>(largest);
  }

  void reduce()
  {
    while (true) {
      if (dot(cell[1], cell[1]) < dot(cell[0], cell[0])) {
        std::swap(cell[0], cell[1]);
        std::swap(combination[0], combination[1]);
      }
      const double times = std::rint(dot(cell[0], cell[1]) / dot(cell[0], cell[0]));
      const double largest = std::fabs(times) * largest_combination();
      if (!(std::fabs(times) >= 1 && largest < LARGEST_COMBINATION)) return;
      const Vector shorter = cell[1] - cell[0] * times;
      if (!(dot(shorter, shorter) < dot(cell[1], cell[1]))) return;
      cell[1] = shorter;
      const int64_t whole = static_cast<int64_t>(times);
      combination[1] = {combination[1].first - whole * combination[0].first,
                        combination[1].second - whole * combination[0].second};
    }
  }
};

inline bool locate_all(const Lattice &lattice, int64_t n, const double *points,
                       std::vector<Place> &places)
{
  places.resize(n);
  for (int64_t i = 0; i < n; ++i)
    if (!lattice.locate(point(points, i), places[i])) return false;
  return true;
}

// Bins of a periodic cell hold points, which their owner sorts by bin.
class PeriodicBins {
 public:
  int64_t count[2] = {1, 1};  // along both sides of the cell

  // The bin of a place with fractions from 0 to 1 of the cell.
  int64_t at(double first, double second) const
  {
    return along(first, count[0]) * count[1] + along(second, count[1]);
  }

  // Returns where each point comes in the order of bins, given the bin of each.
  std::vector<int64_t> sort(const std::vector<int64_t> &bin)
  {
    start.assign(count[0] * count[1] + 1, 0);
    for (const int64_t b : bin) ++start[b + 1];
    std::partial_sum(start.begin(), start.end(), start.begin());
    std::vector<int64_t> next(start.begin(), start.end() - 1), place(bin.size());
    for (std::size_t i = 0; i < bin.size(); ++i) place[i] = next[bin[i]]++;
    return place;
  }

  // The bin of a point in this order.
  int64_t of(int64_t point) const
  {
    return std::upper_bound(start.begin(), start.end(), point) - start.begin() - 1;
  }
  int64_t end(int64_t bin) const { return start[bin + 1]; }

  // Calls visit(first, last, image) for the points of all bins from one to another, in the images
  // in which these lie.
  template <class Visit> void visit(const int64_t *from, const int64_t *to, Visit &&visit) const
  {
    for (int64_t row = from[0]; row <= to[0]; ++row) {
      const int64_t first = whole_cells(row, count[0]);
      const int64_t offset = (row - first * count[0]) * count[1];
      for (int64_t column = from[1]; column <= to[1];) {
        const int64_t second = whole_cells(column, count[1]), zero = second * count[1];
        const int64_t last = std::min(to[1], zero + count[1] - 1);
        visit(start[offset + column - zero], start[offset + last - zero + 1], Image{first, second});
        column = last + 1;
      }
    }
  }

 private:
  std::vector<int64_t> start;  // first point of each bin, and the end

  static int64_t along(double fraction, int64_t bins)
  {
    return std::clamp<int64_t>(static_cast<int64_t>(fraction * bins), 0, bins - 1);
  }

  static int64_t whole_cells(int64_t bin, int64_t bins)
  {
    if (bin >= 0 && bin < bins) return 0;  // a division takes as long as four distances
    return bin >= 0 ? bin / bins : -((bins - 1 - bin) / bins);
  }
};

// The grid finds points at their places by their numbers.
class PeriodicGrid {
 public:
  struct Entry {
    double f[2];
    int64_t number;
  };

  // Bins are as large as the reach, or as the mean distance of places if that is larger.
  PeriodicGrid(const Lattice &lattice, const std::vector<Place> &places, double reach)
  {
    const int64_t n = static_cast<int64_t>(places.size());
    const double spread =
        std::sqrt(lattice.height[0] / std::max<double>(n, 1)) * std::sqrt(lattice.height[1]);
    for (int k = 0; k < 2; ++k) {
      const double wanted = std::min(lattice.height[k] / std::max(reach, spread), 4.0 * n + 4.0);
      bins.count[k] = wanted >= 1 ? static_cast<int64_t>(wanted) : 1;
    }
    std::vector<int64_t> bin(n);
    for (int64_t i = 0; i < n; ++i) bin[i] = bins.at(places[i].f[0], places[i].f[1]);
    const std::vector<int64_t> place = bins.sort(bin);
    entries.resize(n);
    for (int64_t i = 0; i < n; ++i) entries[place[i]] = {{places[i].f[0], places[i].f[1]}, i};
  }

  // Calls visit(entry, image) for every point that may lie between two fractions, and its image.
  template <class Visit> void search(const double *low, const double *high, Visit &&visit) const
  {
    int64_t from[2], to[2];
    for (int k = 0; k < 2; ++k) {
      from[k] = static_cast<int64_t>(std::floor(low[k] * bins.count[k]));
      to[k] = static_cast<int64_t>(std::floor(high[k] * bins.count[k]));
    }
    bins.visit(from, to, [&](int64_t first, int64_t last, const Image &image) {
      for (int64_t k = first; k < last; ++k) visit(entries[k], image);
    });
  }

 private:
  PeriodicBins bins;
  std::vector<Entry> entries;
};

}  // namespace jamlab
