// SPDX-License-Identifier: GPL-2.0-or-later
#include "dense_panel.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#define ALWAYS_INLINE inline __attribute__((always_inline))

namespace LAMMPS_NS {

static constexpr int COLUMNS = 4;    // that wait for each other's pivots
static constexpr int DEPTH = 64;     // columns of a panel that are copied at once

using Two = double __attribute__((vector_size(16), aligned(8), may_alias));
using Four = double __attribute__((vector_size(32), aligned(8), may_alias));
using Eight = double __attribute__((vector_size(64), aligned(8), may_alias));
using Floats = float __attribute__((vector_size(16), aligned(4), may_alias));
using ManyFloats = float __attribute__((vector_size(32), aligned(4), may_alias));

namespace any_processor {
  using Wide = Two;
  using Double = Two;
  using Single = Floats;
  static constexpr int TILE = 4, TILE_ROWS = 4;
#include "dense_panel_code.h"
}    // namespace any_processor

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define JAMLAB_PROCESSORS
#pragma GCC push_options
#pragma GCC target("avx2")
namespace avx2 {
  using Wide = Four;
  using Double = Four;
  using Single = ManyFloats;
  static constexpr int TILE = 4, TILE_ROWS = 8;
#include "dense_panel_code.h"
}    // namespace avx2
#pragma GCC pop_options
#pragma GCC push_options
#pragma GCC target("avx512f,prefer-vector-width=256")
namespace avx512 {
  using Wide = Eight;
  using Double = Four;
  using Single = ManyFloats;
  static constexpr int TILE = 8, TILE_ROWS = 8;
#include "dense_panel_code.h"
}    // namespace avx512
#pragma GCC pop_options
#endif

const DensePanels &dense_panels()
{
#ifdef JAMLAB_PROCESSORS
  static const DensePanels &found = __builtin_cpu_supports("avx512f") ? avx512::FUNCTIONS
      : __builtin_cpu_supports("avx2")                                ? avx2::FUNCTIONS
                                                                      : any_processor::FUNCTIONS;
  return found;
#else
  return any_processor::FUNCTIONS;
#endif
}

}    // namespace LAMMPS_NS
