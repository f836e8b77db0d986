// SPDX-License-Identifier: Apache-2.0
#include "schema/base/allocator.h"

#include <malloc.h>

namespace dsg {

void KeepFreedMemory(size_t bytes_an_arena) {
  // The largest that glibc takes.
  constexpr int kBlockBytesMax = 32 << 20;
  mallopt(M_TRIM_THRESHOLD, static_cast<int>(bytes_an_arena));
  mallopt(M_MMAP_THRESHOLD, kBlockBytesMax);
}

}  // namespace dsg
