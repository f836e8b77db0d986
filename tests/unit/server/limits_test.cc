// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "schema/base/status.h"
#include "server/call_deadline.h"
#include "server/call_log.h"
#include "server/server.h"

namespace dsg::server {
namespace {

using std::chrono::seconds;
using std::chrono::system_clock;
using Steady = query::CallContext::Clock;

TEST(CallDeadline, GivesFiveSecondsToCallersThatGaveNone) {
  const auto before = Steady::now();
  const auto deadline = BoundDeadline(system_clock::time_point::max());
  EXPECT_GE(deadline, before + kDeadlineDefault);
  EXPECT_LE(deadline, Steady::now() + kDeadlineDefault);
}

TEST(CallDeadline, KeepsTheCallersUpToTheCap) {
  // The two clocks are not read at the same time, so a second of difference is allowed.
  const auto before = Steady::now();
  const auto minute = BoundDeadline(system_clock::now() + seconds(60)) - before;
  EXPECT_GT(minute, seconds(59));
  EXPECT_LT(minute, seconds(61));
  const auto capped = BoundDeadline(system_clock::now() + seconds(100'000));
  EXPECT_LE(capped, Steady::now() + kDeadlineMax);
  EXPECT_LT(BoundDeadline(system_clock::now() - seconds(1)), before);
}

TEST(CallLog, WantsErrorsAndSlowCallsAndAllOthersOnlyIfAsked) {
  const std::chrono::milliseconds quick(1);
  const std::chrono::milliseconds slow(101);
  EXPECT_FALSE(CallLog(false).Wants(absl::OkStatus(), quick));
  EXPECT_TRUE(CallLog(false).Wants(absl::OkStatus(), slow));
  EXPECT_TRUE(CallLog(false).Wants(absl::NotFoundError("x"), quick));
  EXPECT_TRUE(CallLog(true).Wants(absl::OkStatus(), quick));
}

TEST(CallLog, WritesOneLineThatTextFromCallersCannotBreak) {
  testing::internal::CaptureStderr();
  CallLog(false).Write({"LocateAgent", "a\nb", MakeError(Reason::kAgentUnknown, "no \"x\"\n"), 3, 1,
                        std::chrono::microseconds(250), "unix:"});
  const std::string line = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::count(line.begin(), line.end(), '\n'), 1);
  for (const char* field : {"rpc method=LocateAgent", "code=NOT_FOUND", "reason=AGENT_UNKNOWN",
                            "revision=3", "us=250", "peer=unix:"}) {
    EXPECT_NE(line.find(field), std::string::npos) << field << " in " << line;
  }
}

TEST(ServerOptions, RefusesNumbersOutOfRange) {
  ServerOptions options;
  EXPECT_TRUE(options.Validate().ok());
  options.worker_count = -1;
  EXPECT_EQ(ReasonOf(options.Validate()), Reason::kFieldInvalid);
  options.worker_count = 0;
  options.in_flight_max = 0;
  EXPECT_EQ(ReasonOf(options.Validate()), Reason::kFieldInvalid);
  options.in_flight_max = 1;
  options.open_stream_max = 0;
  EXPECT_EQ(ReasonOf(options.Validate()), Reason::kFieldInvalid);
  options.open_stream_max = 1;
  options.connection_max = 0;
  EXPECT_EQ(ReasonOf(options.Validate()), Reason::kFieldInvalid);
  options.connection_max = 1;
  options.call_memory_bytes = 1;
  EXPECT_EQ(ReasonOf(options.Validate()), Reason::kFieldInvalid);
  options.call_memory_bytes = size_t{16} << 20;
  EXPECT_TRUE(options.Validate().ok());
}

}  // namespace
}  // namespace dsg::server
