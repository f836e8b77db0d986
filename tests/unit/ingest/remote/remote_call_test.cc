// SPDX-License-Identifier: Apache-2.0
// Which calls are repeated, and what their errors say.
#include "ingest/remote/remote_call.h"

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
#include "schema/base/status.h"
#include "schema/codec/status_decode.h"

namespace dsg::ingest {
namespace {

// Runs a call whose attempts end as `answers` say, the last one for ever after.
absl::Status CallAnswered(const std::vector<grpc::Status>& answers, int* attempt_count) {
  *attempt_count = 0;
  ServerCaller caller("unix:/nowhere", kNsPerSecond / 5, {});
  return caller.Call([&](grpc::ClientContext*) {
    const size_t i = std::min(static_cast<size_t>(*attempt_count), answers.size() - 1);
    ++*attempt_count;
    return answers[i];
  });
}

TEST(ServerCaller, RepeatsTransportFailures) {
  int attempt_count = 0;
  EXPECT_TRUE(
      CallAnswered({{grpc::StatusCode::UNAVAILABLE, "connection refused"}, grpc::Status::OK},
                   &attempt_count)
          .ok());
  EXPECT_EQ(attempt_count, 2);
}

TEST(ServerCaller, GivesUpInTimeNamingTheAddress) {
  int attempt_count = 0;
  const absl::Status status =
      CallAnswered({{grpc::StatusCode::UNAVAILABLE, "connection refused"}}, &attempt_count);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_GE(attempt_count, 2);
  EXPECT_NE(std::string(status.message()).find("unix:/nowhere"), std::string::npos);
}

TEST(ServerCaller, DoesNotRepeatWhatTheServerAnswered) {
  int attempt_count = 0;
  for (const grpc::StatusCode code :
       {grpc::StatusCode::INVALID_ARGUMENT, grpc::StatusCode::ALREADY_EXISTS,
        grpc::StatusCode::DATA_LOSS, grpc::StatusCode::RESOURCE_EXHAUSTED}) {
    EXPECT_EQ(static_cast<int>(CallAnswered({{code, "no"}}, &attempt_count).code()),
              static_cast<int>(code));
    EXPECT_EQ(attempt_count, 1);
  }
}

TEST(ServerCaller, RepeatsWhatABrokenLinkOrAnEndingServerMakesOfACall) {
  int attempt_count = 0;
  for (const grpc::StatusCode code :
       {grpc::StatusCode::DEADLINE_EXCEEDED, grpc::StatusCode::CANCELLED,
        grpc::StatusCode::INTERNAL, grpc::StatusCode::UNKNOWN}) {
    EXPECT_TRUE(CallAnswered({{code, "stream removed"}, grpc::Status::OK}, &attempt_count).ok());
    EXPECT_EQ(attempt_count, 2);
  }
}

TEST(ServerCaller, DoesNotRepeatForEverWhatMayBeTheServersOwnError) {
  int attempt_count = 0;
  EXPECT_EQ(CallAnswered({{grpc::StatusCode::INTERNAL, "a bug"}}, &attempt_count).code(),
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

TEST(ServerCaller, KeepsCodeAndMessageOfAReasonThatItDoesNotKnow) {
  std::string folder = "/tmp/dsg_newer_XXXXXX";
  ASSERT_NE(mkdtemp(folder.data()), nullptr);
  const std::string address = "unix:" + folder + "/s";
  NewerServer service;
  grpc::ServerBuilder builder;
  builder.AddListeningPort(address, grpc::InsecureServerCredentials());
  builder.RegisterService(&service);
  const std::unique_ptr<grpc::Server> server = builder.BuildAndStart();
  const auto stub = v1::IngestService::NewStub(OpenChannel(address));
  ServerCaller caller(address, kNsPerSecond, {});
  const absl::Status status = caller.Call([&](grpc::ClientContext* context) {
    v1::GetSessionResponse reply;
    return stub->GetSession(context, {}, &reply);
  });
  EXPECT_EQ(status, absl::FailedPreconditionError("session is sealed; begin another"));
  EXPECT_EQ(ReasonOf(status), Reason::kUnspecified);
  server->Shutdown();
  std::filesystem::remove_all(folder);
}

TEST(ServerCaller, SaysAtOnceThatItWaitsAndThatItIsOver) {
  std::vector<std::string> told;
  int attempt_count = 0;
  {
    ServerCaller caller("unix:/nowhere", kNsPerSecond,
                        [&](const std::string& sentence) { told.push_back(sentence); });
    const auto answer = [&](grpc::ClientContext*) {
      return ++attempt_count < 3 ? grpc::Status(grpc::StatusCode::UNAVAILABLE, "refused")
                                 : grpc::Status::OK;
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
}  // namespace dsg::ingest
