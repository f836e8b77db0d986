// SPDX-License-Identifier: Apache-2.0
// Reading a whole map, and ending that early.
#include <gtest/gtest.h>

#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

TEST(Verify, EndsWhereverItIsToldTo) {
  TestMap map;
  for (int64_t sequence = 1; sequence <= 150; ++sequence) {
    map.MustCommit(DeltaOfStream({}, sequence));
  }
  int question_count = 0;
  ASSERT_TRUE(map.reader()
                  .Verify(
                      [&] {
                        ++question_count;
                        return absl::OkStatus();
                      },
                      {})
                  .ok());
  // Between its steps, and within the statement that checks the structure.
  ASSERT_GT(question_count, 12);
  for (int end = 1; end <= question_count; ++end) {
    int count = 0;
    const auto report = map.reader().Verify(
        [&] { return ++count < end ? absl::OkStatus() : absl::CancelledError("enough"); }, {});
    EXPECT_EQ(report.status(), absl::CancelledError("enough")) << end;
  }
  EXPECT_TRUE(OrDie(map.reader().Verify({}, {})).problems.empty());
}

}  // namespace
}  // namespace dsg::test
