// Periodic images: translations in multiples of two lattice vectors.
#pragma once

#include <cstdint>

namespace jamlab {

using std::int64_t;

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

}  // namespace jamlab
