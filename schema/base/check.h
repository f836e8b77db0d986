// SPDX-License-Identifier: Apache-2.0
// Always-on checks for broken invariants of our own. Input from outside never reaches one.
#pragma once

#include <cstdio>
#include <cstdlib>

/// Stops the process when an invariant that protects data is broken.
#define DSG_CHECK(condition)                                                                 \
  do {                                                                                       \
    if (!(condition)) {                                                                      \
      std::fprintf(stderr, "%s:%d: broken invariant: %s\n", __FILE__, __LINE__, #condition); \
      std::abort();                                                                          \
    }                                                                                        \
  } while (false)
