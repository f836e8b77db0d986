// SPDX-License-Identifier: Apache-2.0
// Which calls are repeated, and what their errors say.
#include "query/client/retry.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>
#include <stdlib.h>

#include <algorithm>
#include <condition_variable>
#include <filesystem>
#include <mutex>
#include <vector>

#include "dsg/v1/errors.pb.h"
#include "dsg/v1/ingest_service.grpc.pb.h"
#include "query/client/remote_api.h"
#include "schema/base/status.h"
#include "schema/codec/status_decode.h"

namespace dsg::client {
namespace {

using query::CallContext;

// Runs a call whose attempts end as `answers` say, the last one for ever after.
absl::Status CallAnswered(const std::vector<absl::Status>& answers, int* attempt_count) {
  *attempt_count = 0;
  PatientCaller caller("unix:/nowhere", kNsPerSecond / 5, {});
  return caller.Call([&](const CallContext&) {
    const size_t i = std::min(static_cast<size_t>(*attempt_count), answers.size() - 1);
    ++*attempt_count;
    return answers[i];
  });
}

TEST(PatientCaller, RepeatsTransportFailures) {
  int attempt_count = 0;
  EXPECT_TRUE(
      CallAnswered({absl::UnavailableError("connection refused"), absl::OkStatus()}, &attempt_count)
          .ok());
  EXPECT_EQ(attempt_count, 2);
}

TEST(PatientCaller, GivesUpInTimeNamingTheAddress) {
  int attempt_count = 0;
  const absl::Status status =
      CallAnswered({absl::UnavailableError("connection refused")}, &attempt_count);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_GE(attempt_count, 2);
  EXPECT_NE(std::string(status.message()).find("unix:/nowhere"), std::string::npos);
}

TEST(PatientCaller, DoesNotRepeatWhatTheServerAnswered) {
  int attempt_count = 0;
  for (const absl::StatusCode code :
       {absl::StatusCode::kInvalidArgument, absl::StatusCode::kAlreadyExists,
        absl::StatusCode::kDataLoss, absl::StatusCode::kResourceExhausted}) {
    EXPECT_EQ(CallAnswered({absl::Status(code, "no")}, &attempt_count).code(), code);
    EXPECT_EQ(attempt_count, 1);
  }
}

TEST(PatientCaller, RepeatsWhatABrokenLinkOrAnEndingServerMakesOfACall) {
  int attempt_count = 0;
  for (const absl::StatusCode code :
       {absl::StatusCode::kDeadlineExceeded, absl::StatusCode::kCancelled,
        absl::StatusCode::kInternal, absl::StatusCode::kUnknown}) {
    EXPECT_TRUE(
        CallAnswered({absl::Status(code, "stream removed"), absl::OkStatus()}, &attempt_count)
            .ok());
    EXPECT_EQ(attempt_count, 2);
  }
}

TEST(PatientCaller, DoesNotRepeatForEverWhatMayBeTheServersOwnError) {
  int attempt_count = 0;
  EXPECT_EQ(CallAnswered({absl::InternalError("a bug")}, &attempt_count).code(),
            absl::StatusCode::kInternal);
  EXPECT_LE(attempt_count, 5);
}

// A server of a later version, which knows a reason that this build does not.
class NewerServer final : public v1::IngestService::Service {
 public:
  grpc::Status GetSession(grpc::ServerContext* context, const v1::GetSessionRequest*,
                          v1::GetSessionResponse*) override {
    v1::ErrorDetail detail;
    detail.set_reason(static_cast<v1::Reason>(199));
    detail.set_domain("dsg");
    context->AddTrailingMetadata(kErrorTrailer, detail.SerializeAsString());
    return {grpc::StatusCode::FAILED_PRECONDITION, "session is sealed; begin another"};
  }
};

TEST(PatientCaller, KeepsCodeAndMessageOfAReasonThatItDoesNotKnow) {
  std::string folder = "/tmp/dsg_newer_XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const std::string address = "unix:" + folder + "/s";
  NewerServer service;
  grpc::ServerBuilder builder;
  builder.AddListeningPort(address, grpc::InsecureServerCredentials());
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  const auto api = Connect(ServerAddress{.address = address, .repeats = false});
  ASSERT_TRUE(api.ok()) << api.status();
  PatientCaller caller(address, kNsPerSecond, {});
  const absl::Status status = caller.Call([&](const CallContext& call) {
    v1::GetSessionResponse reply;
    return (*api)->GetSession(call, {}, &reply);
  });
  EXPECT_EQ(status, absl::FailedPreconditionError("session is sealed; begin another"));
  EXPECT_EQ(ReasonOf(status), Reason::kUnspecified);
  server->Shutdown();
  std::filesystem::remove_all(folder);
}

TEST(PatientCaller, SaysAtOnceThatItWaitsAndThatItIsOver) {
  std::vector<std::string> told;
  int attempt_count = 0;
  {
    PatientCaller caller("unix:/nowhere", kNsPerSecond,
                         [&](const std::string& sentence) { told.push_back(sentence); });
    const auto answer = [&](const CallContext&) {
      return ++attempt_count < 3 ? absl::UnavailableError("refused") : absl::OkStatus();
    };
    EXPECT_TRUE(caller.Call(answer).ok());
    EXPECT_TRUE(caller.Call(answer).ok());
  }
  ASSERT_EQ(told.size(), 2u);
  EXPECT_NE(told[0].find("unix:/nowhere"), std::string::npos) << told[0];
  EXPECT_NE(told[0].find("refused"), std::string::npos) << told[0];
  EXPECT_NE(told[1].find("answers again"), std::string::npos) << told[1];
}

// Waits for the sentences instead of for a time.
class Listener {
 public:
  void Hear(const std::string& sentence) {
    const std::lock_guard lock(mutex_);
    sentences_.push_back(sentence);
    heard_.notify_all();
  }
  std::vector<std::string> WaitFor(size_t count) {
    std::unique_lock lock(mutex_);
    heard_.wait(lock, [&] { return sentences_.size() >= count; });
    return sentences_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable heard_;
  std::vector<std::string> sentences_;
};

TEST(WaitNotes, SpeaksAgainAndAgainOfACallThatHangs) {
  Listener listener;
  WaitNotes notes(
      "host:1", [&](const std::string& sentence) { listener.Hear(sentence); },
      {.silence_max = std::chrono::milliseconds(5), .repeat_every = std::chrono::milliseconds(5)});
  notes.CallBegins(WaitNotes::Clock::now() + std::chrono::hours(1));
  for (const std::string& sentence : listener.WaitFor(3)) {
    EXPECT_NE(sentence.find("waiting for server host:1"), std::string::npos) << sentence;
  }
  notes.CallEnds(/*is_answered=*/true);
  EXPECT_NE(listener.WaitFor(4).back().find("answers again"), std::string::npos);
}

}  // namespace
}  // namespace dsg::client
