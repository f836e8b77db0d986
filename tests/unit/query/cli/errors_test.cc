// SPDX-License-Identifier: Apache-2.0
#include "query/cli/errors.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg::cli {
namespace {

TEST(ExitCode, FollowsTheContract) {
  EXPECT_EQ(ExitCodeOf(absl::OkStatus()), 0);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kAgentUnknown, "")), 1);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kTimeOutsideTrack, "")), 1);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kFieldInvalid, "")), 2);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kFormatTooNew, "")), 2);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kWriterLocked, "")), 3);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kOverloaded, "")), 3);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kParentRevisionStale, "")), 3);
  EXPECT_EQ(ExitCodeOf(absl::DeadlineExceededError("")), 3);
  EXPECT_EQ(ExitCodeOf(MakeError(Reason::kStoreCorrupt, "")), 4);
}

TEST(ExitCode, ErrorIsOneLineWithItsReason) {
  EXPECT_EQ(ErrorLine(MakeError(Reason::kMapUnknown, "there is no map \"x\n\"")),
            "dsg: there is no map \"x?\" [MAP_UNKNOWN]\n");
  EXPECT_EQ(ErrorLine(absl::UnavailableError("no server")), "dsg: no server\n");
}

TEST(Errors, NameVerbsAndOptionsInsteadOfCallsAndFields) {
  const absl::Status status =
      MakeError(Reason::kFieldInvalid, "node is H1; ask GetAgentShape", {{"field", "node"}});
  EXPECT_EQ(InFlags(status).message(), "--node is H1; ask dsg shape");
}

TEST(Errors, OfRevisionsTellWhereTheyAreListed) {
  const std::string message(InFlags(MakeError(Reason::kRevisionCompacted, "gone")).message());
  EXPECT_EQ(message.find("gone; `dsg log`"), 0U) << message;
}

}  // namespace
}  // namespace dsg::cli
