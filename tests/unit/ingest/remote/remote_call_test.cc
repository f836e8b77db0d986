// SPDX-License-Identifier: Apache-2.0
// Which calls are repeated, and what their errors say.
#include "ingest/remote/remote_call.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace dsg::ingest {
namespace {

// Runs a call whose attempts end as `answers` say, the last one for ever after.
absl::Status CallAnswered(const std::vector<grpc::Status>& answers, int* attempt_count) {
  *attempt_count = 0;
  return CallWithRetry("unix:/nowhere", kNsPerSecond / 5, [&](grpc::ClientContext*) {
    const size_t i = std::min(static_cast<size_t>(*attempt_count), answers.size() - 1);
    ++*attempt_count;
    return answers[i];
  });
}

TEST(CallWithRetry, RepeatsTransportFailures) {
  int attempt_count = 0;
  EXPECT_TRUE(
      CallAnswered({{grpc::StatusCode::UNAVAILABLE, "connection refused"}, grpc::Status::OK},
                   &attempt_count)
          .ok());
  EXPECT_EQ(attempt_count, 2);
}

TEST(CallWithRetry, GivesUpInTimeNamingTheAddress) {
  int attempt_count = 0;
  const absl::Status status =
      CallAnswered({{grpc::StatusCode::UNAVAILABLE, "connection refused"}}, &attempt_count);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_GE(attempt_count, 2);
  EXPECT_NE(std::string(status.message()).find("unix:/nowhere"), std::string::npos);
}

TEST(CallWithRetry, DoesNotRepeatWhatTheServerAnswered) {
  int attempt_count = 0;
  for (const grpc::StatusCode code :
       {grpc::StatusCode::INVALID_ARGUMENT, grpc::StatusCode::ALREADY_EXISTS,
        grpc::StatusCode::DATA_LOSS, grpc::StatusCode::DEADLINE_EXCEEDED}) {
    EXPECT_EQ(static_cast<int>(CallAnswered({{code, "no"}}, &attempt_count).code()),
              static_cast<int>(code));
    EXPECT_EQ(attempt_count, 1);
  }
}

}  // namespace
}  // namespace dsg::ingest
