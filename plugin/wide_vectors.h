// SPDX-License-Identifier: GPL-2.0-or-later
#pragma once

/* JAMLAB_WIDE_VECTORS compiles a function twice, for wider vectors too. The loader chooses one,
   which other systems and processors cannot. No product is fused, so both give the same digits. */

#if defined(__x86_64__) && defined(__linux__) && __has_include(<gnu/libc-version.h>)
#define JAMLAB_WIDE_VECTORS __attribute__((target_clones("avx2", "default")))
#else
#define JAMLAB_WIDE_VECTORS
#endif
