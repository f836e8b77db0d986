// SPDX-License-Identifier: Apache-2.0
// How long the client keeps a watch: for ever, unless its caller says otherwise or nothing is
// heard.
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <string>

#include "dsg/v1/map_service.grpc.pb.h"
#include "query/client/call.h"
#include "query/client/remote_api.h"

namespace dsg::client {
namespace {

using query::CallContext;
using std::chrono::milliseconds;
using std::chrono::system_clock;

class ScriptedMaps final : public v1::MapService::Service {
 public:
  std::function<grpc::Status(grpc::ServerContext*, grpc::ServerWriter<v1::WatchMapResponse>*)>
      watch;

 private:
  grpc::Status WatchMap(grpc::ServerContext* context, const v1::WatchMapRequest*,
                        grpc::ServerWriter<v1::WatchMapResponse>* writer) override {
    return watch(context, writer);
  }
};

class WatchClientTest : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "dsg-watch-XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    address_ = "unix:" + folder_ + "/socket";
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address_, grpc::InsecureServerCredentials());
    builder.RegisterService(&maps_);
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
  }
  void TearDown() override {
    release_.set_value();
    if (server_ != nullptr) server_->Shutdown(system_clock::now());
    std::filesystem::remove_all(folder_);
  }

  // Says one thing, then nothing until the test is over.
  void FallSilent() {
    maps_.watch = [this](grpc::ServerContext*, grpc::ServerWriter<v1::WatchMapResponse>* writer) {
      writer->Write(v1::WatchMapResponse());
      released_.wait();
      return grpc::Status::CANCELLED;
    };
  }

  ScriptedMaps maps_;
  std::string folder_;
  std::string address_;
  std::unique_ptr<grpc::Server> server_;
  std::promise<void> release_;
  std::shared_future<void> released_ = release_.get_future().share();
};

TEST_F(WatchClientTest, GivesAWatchNoDeadlineOfItsOwn) {
  auto deadline = system_clock::time_point::min();
  maps_.watch = [&](grpc::ServerContext* context, grpc::ServerWriter<v1::WatchMapResponse>*) {
    deadline = context->deadline();
    return grpc::Status::OK;
  };
  const auto api = Connect(address_);
  ASSERT_TRUE(api.ok()) << api.status();
  const auto send = [](const v1::WatchMapResponse&) { return true; };
  EXPECT_TRUE(query::ReadStream(CallContext(), (*api)->WatchMap(CallContext(), {}), send).ok());
  EXPECT_EQ(deadline, system_clock::time_point::max());
  const CallContext bounded(CallContext::Clock::now() + std::chrono::hours(1));
  EXPECT_TRUE(query::ReadStream(bounded, (*api)->WatchMap(bounded, {}), send).ok());
  EXPECT_LT(deadline, system_clock::now() + std::chrono::hours(2));
}

TEST_F(WatchClientTest, EndsAWatchWhenItsCallerHasEnoughOrCancels) {
  FallSilent();
  const auto api = Connect(address_);
  ASSERT_TRUE(api.ok()) << api.status();
  CallContext call;
  EXPECT_TRUE(query::ReadStream(call, (*api)->WatchMap(call, {}), [](const v1::WatchMapResponse&) {
                return false;
              }).ok());
  const absl::Status cancelled =
      query::ReadStream(call, (*api)->WatchMap(call, {}), [&](const v1::WatchMapResponse&) {
        call.Cancel();
        return true;
      });
  EXPECT_TRUE(absl::IsCancelled(cancelled)) << cancelled;
}

TEST_F(WatchClientTest, GivesUpAStreamThatGivesNoSignOfLife) {
  FallSilent();
  const CallContext call;
  const ServerAddress server{.address = address_};
  const auto channel = MakeChannel(server);
  v1::MapService::Stub stub(channel);
  CallInFlight flight(call, server, {std::chrono::seconds(0), milliseconds(150)});
  const auto rpc = stub.PrepareAsyncWatchMap(flight.context(), {}, flight.queue());
  rpc->StartCall(flight.tag());
  ASSERT_TRUE(flight.Wait(call));
  v1::WatchMapResponse message;
  rpc->Read(&message, flight.tag());
  EXPECT_TRUE(flight.Wait(call));
  rpc->Read(&message, flight.tag());
  EXPECT_FALSE(flight.Wait(call));
  grpc::Status status;
  rpc->Finish(&status, flight.tag());
  flight.Wait(call);
  const absl::Status outcome = flight.Outcome(status);
  EXPECT_TRUE(absl::IsUnavailable(outcome)) << outcome;
  EXPECT_NE(outcome.message().find("sign of life"), absl::string_view::npos);
}

}  // namespace
}  // namespace dsg::client
