// SPDX-License-Identifier: Apache-2.0
// The client against a real gRPC server on a unix socket, whose answers each test writes down:
// a server that fails on purpose is what a healthy dsg-server cannot be.
#include "query/client/remote_api.h"

#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <string>
#include <thread>

#include "dsg/v1/errors.pb.h"
#include "dsg/v1/query_service.grpc.pb.h"
#include "schema/base/status.h"
#include "schema/codec/status_decode.h"

namespace dsg::client {
namespace {

using query::CallContext;

class ScriptedService final : public v1::QueryService::Service {
 public:
  std::function<grpc::Status(grpc::ServerContext*, v1::LocateAgentResponse*)> locate;
  std::function<grpc::Status(grpc::ServerContext*, grpc::ServerWriter<v1::GetTrajectoryResponse>*)>
      stream;
  std::function<grpc::Status(const v1::GetAgentShapeRequest&,
                             grpc::ServerWriter<v1::GetAgentShapeResponse>*)>
      shapes;
  std::atomic<int> call_count{0};

 private:
  grpc::Status LocateAgent(grpc::ServerContext* context, const v1::LocateAgentRequest*,
                           v1::LocateAgentResponse* reply) override {
    ++call_count;
    return locate(context, reply);
  }
  grpc::Status GetTrajectory(grpc::ServerContext* context, const v1::GetTrajectoryRequest*,
                             grpc::ServerWriter<v1::GetTrajectoryResponse>* writer) override {
    ++call_count;
    return stream(context, writer);
  }
  grpc::Status GetAgentShape(grpc::ServerContext*, const v1::GetAgentShapeRequest* request,
                             grpc::ServerWriter<v1::GetAgentShapeResponse>* writer) override {
    ++call_count;
    return shapes(*request, writer);
  }
};

class RemoteApiTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "dsg-client-XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    address_ = "unix:" + folder_ + "/s";
  }
  void TearDown() override {
    release_.set_value();
    if (server_ != nullptr) server_->Shutdown(std::chrono::system_clock::now());
    std::filesystem::remove_all(folder_);
  }

  void StartServer() {
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address_, grpc::InsecureServerCredentials());
    builder.RegisterService(&service_);
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
  }
  std::unique_ptr<query::Api> Api() { return *Connect(address_); }

  absl::Status Locate(const CallContext& call, v1::LocateAgentResponse* reply) {
    return Api()->LocateAgent(call, v1::LocateAgentRequest(), reply);
  }

  // Lets handlers that were told to hang end with the test.
  void Hang() { released_.wait(); }

  std::string folder_;
  std::string address_;
  ScriptedService service_;
  std::unique_ptr<grpc::Server> server_;
  std::promise<void> release_;
  std::shared_future<void> released_ = release_.get_future().share();
};

grpc::Status Fail(grpc::ServerContext* context, v1::Reason reason, grpc::StatusCode code) {
  v1::ErrorDetail detail;
  detail.set_reason(reason);
  detail.set_domain("dsg");
  (*detail.mutable_metadata())["agent"] = "H12";
  context->AddTrailingMetadata(kErrorTrailer, detail.SerializeAsString());
  return grpc::Status(code, "agent H12 is unknown");
}

TEST_F(RemoteApiTest, CarriesReplies) {
  service_.locate = [](grpc::ServerContext*, v1::LocateAgentResponse* reply) {
    reply->set_agent_id("H12");
    return grpc::Status::OK;
  };
  StartServer();
  v1::LocateAgentResponse reply;
  const absl::Status status = Locate(CallContext(), &reply);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(reply.agent_id(), "H12");
}

TEST_F(RemoteApiTest, CarriesBodyShapesUntilTheCallerHasEnough) {
  service_.shapes = [](const v1::GetAgentShapeRequest& request,
                       grpc::ServerWriter<v1::GetAgentShapeResponse>* writer) {
    for (int i = 0; i < 1000; ++i) {
      v1::GetAgentShapeResponse message;
      message.set_agent_id(request.agent());
      message.add_shapes()->mutable_shape()->set_time_ns(i);
      if (!writer->Write(message)) break;
    }
    return grpc::Status::OK;
  };
  StartServer();
  v1::GetAgentShapeRequest request;
  request.set_agent("H12");
  std::vector<int64_t> times;
  const absl::Status status =
      query::ReadStream(CallContext(), Api()->GetAgentShape(CallContext(), request),
                        [&](const v1::GetAgentShapeResponse& message) {
                          EXPECT_EQ(message.agent_id(), "H12");
                          times.push_back(message.shapes(0).shape().time_ns());
                          return times.size() < 3;
                        });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(times, (std::vector<int64_t>{0, 1, 2}));
}

TEST_F(RemoteApiTest, CarriesReasonAndMetadataOfErrors) {
  service_.locate = [](grpc::ServerContext* context, v1::LocateAgentResponse*) {
    return Fail(context, v1::AGENT_UNKNOWN, grpc::StatusCode::NOT_FOUND);
  };
  StartServer();
  v1::LocateAgentResponse reply;
  EXPECT_EQ(Locate(CallContext(), &reply),
            MakeError(Reason::kAgentUnknown, "agent H12 is unknown", {{"agent", "H12"}}));
  EXPECT_EQ(service_.call_count, 1);
}

TEST_F(RemoteApiTest, KeepsTheWordsOfANewerServersReason) {
  service_.locate = [](grpc::ServerContext* context, v1::LocateAgentResponse*) {
    return Fail(context, static_cast<v1::Reason>(139), grpc::StatusCode::UNAVAILABLE);
  };
  StartServer();
  v1::LocateAgentResponse reply;
  EXPECT_EQ(Locate(CallContext(), &reply), absl::UnavailableError("agent H12 is unknown"));
}

TEST_F(RemoteApiTest, RepeatsReadsThatAServerInShutdownRefused) {
  service_.locate = [this](grpc::ServerContext* context, v1::LocateAgentResponse* reply) {
    if (service_.call_count < 3) {
      return Fail(context, v1::SHUTTING_DOWN, grpc::StatusCode::UNAVAILABLE);
    }
    reply->set_agent_id("H12");
    return grpc::Status::OK;
  };
  StartServer();
  v1::LocateAgentResponse reply;
  const absl::Status status = Locate(CallContext(), &reply);
  ASSERT_TRUE(status.ok()) << status;
  EXPECT_EQ(reply.agent_id(), "H12");
  EXPECT_EQ(service_.call_count, 3);
}

TEST_F(RemoteApiTest, GivesUpAfterThreeRepeats) {
  service_.locate = [](grpc::ServerContext* context, v1::LocateAgentResponse*) {
    return Fail(context, v1::SHUTTING_DOWN, grpc::StatusCode::UNAVAILABLE);
  };
  StartServer();
  v1::LocateAgentResponse reply;
  EXPECT_EQ(ReasonOf(Locate(CallContext(), &reply)), Reason::kShuttingDown);
  EXPECT_EQ(service_.call_count, 4);
}

TEST_F(RemoteApiTest, NamesTheAddressAndTheCommandWhenNoServerListens) {
  v1::LocateAgentResponse reply;
  const absl::Status status = Locate(CallContext(), &reply);
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  const std::string message(status.message());
  EXPECT_NE(message.find("dsg-server --store DIR --listen " + address_), std::string::npos)
      << message;
}

TEST_F(RemoteApiTest, DeadlineEndsACallThatHangs) {
  service_.locate = [this](grpc::ServerContext*, v1::LocateAgentResponse*) {
    Hang();
    return grpc::Status::OK;
  };
  StartServer();
  v1::LocateAgentResponse reply;
  const CallContext call(CallContext::Clock::now() + std::chrono::milliseconds(100));
  const absl::Status status = Locate(call, &reply);
  EXPECT_EQ(status.code(), absl::StatusCode::kDeadlineExceeded);
  EXPECT_NE(status.message().find(address_), absl::string_view::npos) << status;
}

TEST_F(RemoteApiTest, CancellationEndsACallThatHangs) {
  std::promise<void> started;
  service_.locate = [&](grpc::ServerContext*, v1::LocateAgentResponse*) {
    started.set_value();
    Hang();
    return grpc::Status::OK;
  };
  StartServer();
  CallContext call;
  std::thread canceller([&] {
    started.get_future().wait();
    call.Cancel();
  });
  v1::LocateAgentResponse reply;
  EXPECT_EQ(Locate(call, &reply).code(), absl::StatusCode::kCancelled);
  canceller.join();
}

TEST_F(RemoteApiTest, StreamsMessagesInOrder) {
  service_.stream = [](grpc::ServerContext*,
                       grpc::ServerWriter<v1::GetTrajectoryResponse>* writer) {
    for (int64_t time_ns = 0; time_ns < 50; ++time_ns) {
      v1::GetTrajectoryResponse message;
      message.add_poses()->set_time_ns(time_ns);
      writer->Write(message);
    }
    return grpc::Status::OK;
  };
  StartServer();
  int64_t next_ns = 0;
  const absl::Status status = query::ReadStream(
      CallContext(), Api()->GetTrajectory(CallContext(), v1::GetTrajectoryRequest()),
      [&](const v1::GetTrajectoryResponse& message) {
        EXPECT_EQ(message.poses(0).time_ns(), next_ns++);
        return true;
      });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(next_ns, 50);
}

TEST_F(RemoteApiTest, ACallerThatHasEnoughStopsTheStreamWithoutAnError) {
  service_.stream = [](grpc::ServerContext*,
                       grpc::ServerWriter<v1::GetTrajectoryResponse>* writer) {
    while (writer->Write(v1::GetTrajectoryResponse())) {
    }
    return grpc::Status::OK;
  };
  StartServer();
  int message_count = 0;
  const absl::Status status = query::ReadStream(
      CallContext(), Api()->GetTrajectory(CallContext(), v1::GetTrajectoryRequest()),
      [&](const v1::GetTrajectoryResponse&) { return ++message_count < 2; });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(message_count, 2);
}

TEST_F(RemoteApiTest, AStreamThatBreaksIsNotStartedAgain) {
  service_.stream = [](grpc::ServerContext* context,
                       grpc::ServerWriter<v1::GetTrajectoryResponse>* writer) {
    writer->Write(v1::GetTrajectoryResponse());
    return Fail(context, v1::SHUTTING_DOWN, grpc::StatusCode::UNAVAILABLE);
  };
  StartServer();
  int message_count = 0;
  const absl::Status status = query::ReadStream(
      CallContext(), Api()->GetTrajectory(CallContext(), v1::GetTrajectoryRequest()),
      [&](const v1::GetTrajectoryResponse&) {
        ++message_count;
        return true;
      });
  EXPECT_EQ(ReasonOf(status), Reason::kShuttingDown);
  EXPECT_EQ(message_count, 1);
  EXPECT_EQ(service_.call_count, 1);
}

TEST_F(RemoteApiTest, AStreamRefusedAtOnceIsTriedAgain) {
  service_.stream = [this](grpc::ServerContext* context,
                           grpc::ServerWriter<v1::GetTrajectoryResponse>* writer) {
    if (service_.call_count == 1) {
      return Fail(context, v1::SHUTTING_DOWN, grpc::StatusCode::UNAVAILABLE);
    }
    writer->Write(v1::GetTrajectoryResponse());
    return grpc::Status::OK;
  };
  StartServer();
  int message_count = 0;
  const absl::Status status = query::ReadStream(
      CallContext(), Api()->GetTrajectory(CallContext(), v1::GetTrajectoryRequest()),
      [&](const v1::GetTrajectoryResponse&) {
        ++message_count;
        return true;
      });
  EXPECT_TRUE(status.ok()) << status;
  EXPECT_EQ(message_count, 1);
}

}  // namespace
}  // namespace dsg::client
