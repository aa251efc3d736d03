// What every kernel shares: its interface is C, and visible although the library hides the rest.
//
//   JAMLAB_KERNEL name(arguments)
//   try {
//     ...
//   }
//   JAMLAB_OR_NO_MEMORY
#pragma once

#include <cstdint>
#include <new>
#include <stdexcept>

namespace jamlab {

constexpr std::int64_t NO_MEMORY = -1000;  // of any kernel; no exception may leave it

}  // namespace jamlab

#define JAMLAB_KERNEL extern "C" __attribute__((visibility("default"))) std::int64_t
#define JAMLAB_OR_NO_MEMORY \
  catch (const std::bad_alloc &) { return jamlab::NO_MEMORY; } \
  catch (const std::length_error &) { return jamlab::NO_MEMORY; }
