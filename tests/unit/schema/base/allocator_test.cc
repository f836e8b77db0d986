// SPDX-License-Identifier: Apache-2.0
#include "schema/base/allocator.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <cstring>
#include <memory>

namespace dsg {
namespace {

int64_t PageFaults() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return usage.ru_minflt;
}

TEST(Allocator, FreedMemoryIsUsedAgainWithoutPageFaults) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers have an allocator of their own";
#endif
  constexpr size_t kBytes = size_t{4} << 20;
  constexpr int kRounds = 100;
  KeepFreedMemory(size_t{16} << 20);
  const auto touch = [] {
    const auto block = std::make_unique_for_overwrite<char[]>(kBytes);
    std::memset(block.get(), 1, kBytes);
    // Else the compiler may leave out the block.
    EXPECT_EQ(static_cast<volatile char*>(block.get())[kBytes - 1], 1);
  };
  touch();
  const int64_t before = PageFaults();
  for (int i = 0; i < kRounds; ++i) touch();
  // A block that came from the kernel each time would have 1024 faults a round.
  EXPECT_LT(PageFaults() - before, 1024);
}

}  // namespace
}  // namespace dsg
