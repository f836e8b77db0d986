// SPDX-License-Identifier: Apache-2.0
// Bytes that are no message, from a server that answers every call with the same bytes.
#include <grpcpp/generic/async_generic_service.h>
#include <grpcpp/grpcpp.h>
#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dsg/v1/query_service.pb.h"
#include "query/client/remote_api.h"

namespace dsg::client {
namespace {

using query::CallContext;

/// Sends the given messages when the request has come, and then OK.
class BytesReply final : public grpc::ServerGenericBidiReactor {
 public:
  explicit BytesReply(std::vector<std::string> messages) : messages_(std::move(messages)) {
    StartRead(&request_);
  }
  void OnReadDone(bool) override { SendNext(); }
  void OnWriteDone(bool) override { SendNext(); }
  void OnDone() override { delete this; }

 private:
  void SendNext() {
    if (sent_count_ == messages_.size()) {
      Finish(grpc::Status::OK);
      return;
    }
    const grpc::Slice slice(messages_[sent_count_++]);
    bytes_ = grpc::ByteBuffer(&slice, 1);
    StartWrite(&bytes_);
  }

  const std::vector<std::string> messages_;
  size_t sent_count_ = 0;
  grpc::ByteBuffer request_;
  grpc::ByteBuffer bytes_;
};

class BytesService final : public grpc::CallbackGenericService {
 public:
  std::vector<std::string> messages;

 private:
  grpc::ServerGenericBidiReactor* CreateReactor(grpc::GenericCallbackServerContext*) override {
    return new BytesReply(messages);
  }
};

class UnreadableReply : public testing::Test {
 protected:
  void SetUp() override {
    std::string pattern = testing::TempDir() + "dsg-bytes-XXXXXX";
    ASSERT_NE(mkdtemp(pattern.data()), nullptr);
    folder_ = pattern;
    const std::string address = "unix:" + folder_ + "/s";
    grpc::ServerBuilder builder;
    builder.AddListeningPort(address, grpc::InsecureServerCredentials());
    builder.RegisterCallbackGenericService(&service_);
    server_ = builder.BuildAndStart();
    ASSERT_NE(server_, nullptr);
    api_ = *Connect(address);
  }
  void TearDown() override {
    if (server_ != nullptr) server_->Shutdown(std::chrono::system_clock::now());
    std::filesystem::remove_all(folder_);
  }

  /// Reads a trajectory and counts its messages.
  absl::Status ReadTrajectory() {
    message_count_ = 0;
    const CallContext call(CallContext::Clock::now() + std::chrono::seconds(20));
    return query::ReadStream(
        call, api_->GetTrajectory(call, v1::GetTrajectoryRequest()),
        [this](const v1::GetTrajectoryResponse& message) {
          EXPECT_TRUE(message.GetReflection()->GetUnknownFields(message).empty());
          ++message_count_;
          return true;
        });
  }

  BytesService service_;
  std::string folder_;
  std::unique_ptr<grpc::Server> server_;
  std::unique_ptr<query::Api> api_;
  int message_count_ = 0;
};

void ExpectNames(const absl::Status& status, const std::string& method) {
  EXPECT_EQ(status.code(), absl::StatusCode::kInternal) << status;
  EXPECT_NE(status.message().find("in reply to " + method), std::string::npos) << status;
  EXPECT_NE(status.message().find("dsg.v1." + method + "Response"), std::string::npos) << status;
}

std::string Message() {
  v1::GetTrajectoryResponse message;
  message.add_poses()->set_time_ns(7);
  return message.SerializeAsString();
}

// A tag that no message may begin with; a field that is cut, at the top and in a nested message.
const char* const kNoMessages[] = {"\xff\xff\xff", "\x0a\x7f", "\x0a\x02\x0a\xff"};

TEST_F(UnreadableReply, IsAnErrorOfACallThatNamesIt) {
  for (const std::string bytes : kNoMessages) {
    service_.messages = {bytes};
    v1::LocateAgentResponse reply;
    ExpectNames(api_->LocateAgent(CallContext(), v1::LocateAgentRequest(), &reply), "LocateAgent");
  }
}

TEST_F(UnreadableReply, EndsAStreamWithAnErrorThatNamesTheCall) {
  for (const std::string bytes : kNoMessages) {
    service_.messages = {bytes};
    ExpectNames(ReadTrajectory(), "GetTrajectory");
    EXPECT_EQ(message_count_, 0);
    service_.messages = {Message(), Message(), bytes, Message()};
    ExpectNames(ReadTrajectory(), "GetTrajectory");
    EXPECT_EQ(message_count_, 2);
  }
}

TEST_F(UnreadableReply, AStreamThatIsReadableEndsWithoutAnError) {
  for (const auto& messages : {std::vector<std::string>{}, std::vector<std::string>{""},
                               std::vector<std::string>{Message(), "", Message()}}) {
    service_.messages = messages;
    EXPECT_TRUE(ReadTrajectory().ok());
    EXPECT_EQ(message_count_, static_cast<int>(messages.size()));
  }
}

// Many messages behind the one that cannot be read must not keep the client until its deadline.
TEST_F(UnreadableReply, EndsAStreamAtOnce) {
  service_.messages.assign(200, std::string(size_t{1} << 18, '\xff'));
  const auto begin = CallContext::Clock::now();
  ExpectNames(ReadTrajectory(), "GetTrajectory");
  EXPECT_LT(CallContext::Clock::now() - begin, std::chrono::seconds(10));
}

}  // namespace
}  // namespace dsg::client
