// SPDX-License-Identifier: Apache-2.0
// Checks of internal invariants, active in all builds. External input never reaches one.
#pragma once

#include <cstdio>
#include <cstdlib>

/// Aborts the process if an invariant that protects data is broken.
#define DSG_CHECK(condition)                                                                 \
  do {                                                                                       \
    if (!(condition)) {                                                                      \
      std::fprintf(stderr, "%s:%d: broken invariant: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                          \
    }                                                                                        \
  } while (false)
