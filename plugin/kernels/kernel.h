// What every kernel shares: its interface is C, and visible although the library hides the rest.
#pragma once

#include <cstdint>

#define JAMLAB_KERNEL extern "C" __attribute__((visibility("default"))) std::int64_t
