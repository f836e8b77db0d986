// SPDX-License-Identifier: Apache-2.0
#include "schema/base/exit_code.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg {
namespace {

TEST(ExitCode, FollowsReasonAndCode) {
  EXPECT_EQ(ExitCodeOf(absl::OkStatus()), 0);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kMapUnknown, "")), 1);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kTrackConflict, "")), 1);
  EXPECT_EQ(ExitCodeOf(absl::InvalidArgumentError("")), 1);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kFieldInvalid, "")), 2);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kMapNameInvalid, "")), 2);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kWriterLocked, "")), 3);
  EXPECT_EQ(ExitCodeOf(absl::DeadlineExceededError("")), 3);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kStoreCorrupt, "")), 4);
}

}  // namespace
}  // namespace dsg
