// SPDX-License-Identifier: Apache-2.0
// What standard gRPC clients ask of any server: the health of each service, and reflection. Both
// are asked as such a client asks, over a socket; the messages of reflection are those of gRPC's
// own library, which has no headers for them.
#include <gtest/gtest.h>

#include <chrono>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/escaping.h"
#include "google/protobuf/descriptor.h"
#include "google/protobuf/descriptor.pb.h"
#include "google/protobuf/message.h"
#include "grpcpp/generic/generic_stub.h"
#include "grpcpp/grpcpp.h"
#include "query/api/message_json.h"
#include "server/server.h"
#include "tests/unit/query/engine/office.h"
#include "tests/unit/server/server_test_util.h"

namespace dsg::server {
namespace {

using google::protobuf::DescriptorPool;
using nlohmann::json;
using std::chrono::milliseconds;
using std::chrono::seconds;
using std::chrono::steady_clock;
using std::chrono::system_clock;

/// A call by its path whose messages are bytes, of any kind.
class ByteStream {
 public:
  ByteStream(const std::shared_ptr<grpc::Channel>& channel, const std::string& path)
      : stub_(channel) {
    // Ends a test that goes wrong.
    context_.set_deadline(system_clock::now() + seconds(60));
    call_ = stub_.PrepareCall(&context_, path, &queue_);
    call_->StartCall(nullptr);
    Wait();
  }
  ~ByteStream() {
    context_.TryCancel();
    if (!is_finished_) Finish();
  }
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  bool Write(const std::string& message) {
    const grpc::Slice slice(message);
    call_->Write(grpc::ByteBuffer(&slice, 1), nullptr);
    return Wait();
  }
  bool Read(std::string* message) {
    grpc::ByteBuffer bytes;
    call_->Read(&bytes, nullptr);
    if (!Wait()) return false;
    grpc::Slice slice;
    if (!bytes.DumpToSingleSlice(&slice).ok()) return false;
    message->assign(reinterpret_cast<const char*>(slice.begin()), slice.size());
    return true;
  }
  void EndWrites() {
    call_->WritesDone(nullptr);
    Wait();
  }
  grpc::Status Finish() {
    is_finished_ = true;
    grpc::Status status;
    call_->Finish(&status, nullptr);
    Wait();
    return status;
  }
  void Cancel() { context_.TryCancel(); }

 private:
  bool Wait() {
    void* tag = nullptr;
    bool ok = false;
    return queue_.Next(&tag, &ok) && ok;
  }

  grpc::GenericStub stub_;
  grpc::CompletionQueue queue_;
  grpc::ClientContext context_;
  std::unique_ptr<grpc::GenericClientAsyncReaderWriter> call_;
  bool is_finished_ = false;
};

class StandardServices : public testing::Test {
 protected:
  StandardServices() { test::MakeOffice(folder_.path()); }

  void Start(Reflection reflection) {
    ServerOptions options;
    options.listen = "unix:" + folder_.path() + "/server.sock";
    options.reflection = reflection;
    auto server = Server::Start(test::OpenCore(folder_.path()), options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    channel_ = ConnectAlone(server_->address());
  }

  test::TempFolder folder_;
  std::unique_ptr<Server> server_;
  std::shared_ptr<grpc::Channel> channel_;
};

constexpr const char* kServices[] = {"dsg.v1.QueryService", "dsg.v1.MapService",
                                     "dsg.v1.IngestService", "dsg.v1.MaintenanceService"};

// Health: HealthCheckRequest{service} and HealthCheckResponse{status} of grpc.health.v1, as bytes.
constexpr char kCheck[] = "/grpc.health.v1.Health/Check";
constexpr char kWatch[] = "/grpc.health.v1.Health/Watch";
const std::string kServing("\x08\x01");
const std::string kNotServing("\x08\x02");
const std::string kServiceUnknown("\x08\x03");

std::string HealthRequest(const std::string& service) {
  if (service.empty()) return "";
  return std::string("\x0a") + static_cast<char>(service.size()) + service;
}

TEST_F(StandardServices, TellTheHealthOfEachService) {
  Start(Reflection::kLocal);
  std::set<std::string> names(std::begin(kServices), std::end(kServices));
  names.insert("");
  for (const std::string& name : names) {
    ByteStream check(channel_, kCheck);
    ASSERT_TRUE(check.Write(HealthRequest(name)));
    check.EndWrites();
    std::string reply;
    EXPECT_TRUE(check.Read(&reply)) << name;
    EXPECT_EQ(reply, kServing) << name;
    const grpc::Status status = check.Finish();
    EXPECT_TRUE(status.ok()) << name << ": " << status.error_message();
  }
  for (const char* name : {"dsg.v1.NoService", "QueryService", "dsg.v1.QueryService/GetNode"}) {
    ByteStream check(channel_, kCheck);
    ASSERT_TRUE(check.Write(HealthRequest(name)));
    check.EndWrites();
    EXPECT_EQ(check.Finish().error_code(), grpc::StatusCode::NOT_FOUND) << name;
  }
}

TEST_F(StandardServices, TellWatchersOfTheirHealthThatTheServerStops) {
  Start(Reflection::kLocal);
  std::string reply;
  ByteStream unknown(channel_, kWatch);
  ASSERT_TRUE(unknown.Write(HealthRequest("dsg.v1.NoService")));
  unknown.EndWrites();
  ASSERT_TRUE(unknown.Read(&reply));
  EXPECT_EQ(reply, kServiceUnknown);
  unknown.Cancel();

  ByteStream whole(channel_, kWatch);
  ByteStream one(channel_, kWatch);
  ASSERT_TRUE(whole.Write(HealthRequest("")));
  ASSERT_TRUE(one.Write(HealthRequest("dsg.v1.IngestService")));
  for (ByteStream* watch : {&whole, &one}) {
    watch->EndWrites();
    ASSERT_TRUE(watch->Read(&reply));
    EXPECT_EQ(reply, kServing);
  }
  const auto begin = steady_clock::now();
  std::thread stopping([&] { server_->Shutdown(seconds(20)); });
  for (ByteStream* watch : {&whole, &one}) {
    EXPECT_TRUE(watch->Read(&reply));
    EXPECT_EQ(reply, kNotServing);
    watch->Cancel();
  }
  stopping.join();
  // Nobody watches any more, so the grace is not used up.
  EXPECT_LT(steady_clock::now() - begin, seconds(15));
}

constexpr char kReflection[] = "/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo";

// Asks in the JSON of ServerReflectionRequest, and returns that of the response.
json AskReflection(ByteStream* call, const json& question) {
  const auto* const pool = DescriptorPool::generated_pool();
  const auto* const type =
      pool->FindMessageTypeByName("grpc.reflection.v1alpha.ServerReflectionRequest");
  const auto bytes = query::BytesOfJson(question.dump(), *type);
  EXPECT_TRUE(bytes.ok()) << bytes.status();
  std::string reply;
  EXPECT_TRUE(call->Write(*bytes));
  if (!call->Read(&reply)) {
    ADD_FAILURE() << question << ": " << call->Finish().error_message();
    return json::object();
  }
  const std::unique_ptr<google::protobuf::Message> told(
      google::protobuf::MessageFactory::generated_factory()
          ->GetPrototype(
              pool->FindMessageTypeByName("grpc.reflection.v1alpha.ServerReflectionResponse"))
          ->New());
  EXPECT_TRUE(told->ParseFromString(reply));
  const auto text = query::JsonOfMessage(*told, query::JsonLayout::kOneLine);
  EXPECT_TRUE(text.ok()) << text.status();
  return json::parse(*text);
}

// The files of an answer by name: the one asked for, and all that it imports.
std::map<std::string, google::protobuf::FileDescriptorProto> FilesOf(const json& answer) {
  std::map<std::string, google::protobuf::FileDescriptorProto> files;
  if (!answer.contains("file_descriptor_response")) {
    ADD_FAILURE() << answer;
    return files;
  }
  for (const json& text : answer["file_descriptor_response"]["file_descriptor_proto"]) {
    std::string bytes;
    google::protobuf::FileDescriptorProto file;
    EXPECT_TRUE(absl::Base64Unescape(text.get<std::string>(), &bytes));
    EXPECT_TRUE(file.ParseFromString(bytes));
    files[file.name()] = file;
  }
  return files;
}

// Builds a file in a client's own pool, after those that it imports.
void Build(const std::map<std::string, google::protobuf::FileDescriptorProto>& files,
           const std::string& name, DescriptorPool* pool) {
  if (pool->FindFileByName(name) != nullptr) return;
  const auto found = files.find(name);
  ASSERT_NE(found, files.end()) << name;
  for (const std::string& import : found->second.dependency()) Build(files, import, pool);
  ASSERT_NE(pool->BuildFile(found->second), nullptr) << name;
}

TEST_F(StandardServices, ListThemselvesToReflectionClients) {
  Start(Reflection::kLocal);
  ByteStream call(channel_, kReflection);
  const json listed = AskReflection(&call, {{"list_services", "*"}});
  std::set<std::string> names;
  for (const json& service : listed["list_services_response"]["service"]) {
    names.insert(service["name"].get<std::string>());
  }
  for (const char* name : kServices) EXPECT_TRUE(names.contains(name)) << listed;
  EXPECT_TRUE(names.contains("grpc.health.v1.Health"));
  EXPECT_FALSE(names.contains("grpc.channelz.v1.Channelz"));
}

TEST_F(StandardServices, LetAClientWithoutProtosMakeACall) {
  Start(Reflection::kLocal);
  DescriptorPool pool;
  {
    ByteStream call(channel_, kReflection);
    Build(FilesOf(AskReflection(&call, {{"file_containing_symbol", "dsg.v1.QueryService"}})),
          "dsg/v1/query_service.proto", &pool);
    const json unknown = AskReflection(&call, {{"file_containing_symbol", "dsg.v1.NoService"}});
    EXPECT_EQ(unknown["error_response"]["error_code"], grpc::StatusCode::NOT_FOUND);
    call.EndWrites();
    EXPECT_TRUE(call.Finish().ok());
  }
  const auto* const service = pool.FindServiceByName("dsg.v1.QueryService");
  ASSERT_NE(service, nullptr);
  const auto* const method = service->FindMethodByName("GetNode");
  ASSERT_NE(method, nullptr);
  EXPECT_FALSE(method->server_streaming());
  const auto request =
      query::BytesOfJson(R"({"map": "office", "id": "R1"})", *method->input_type());
  ASSERT_TRUE(request.ok()) << request.status();
  ByteStream call(channel_, "/dsg.v1.QueryService/GetNode");
  ASSERT_TRUE(call.Write(*request));
  call.EndWrites();
  std::string reply;
  ASSERT_TRUE(call.Read(&reply));
  EXPECT_NE(reply.find("kitchen"), std::string::npos);
  EXPECT_TRUE(call.Finish().ok());
}

TEST_F(StandardServices, BoundTheStreamsOfReflectionAndNothingElse) {
  Start(Reflection::kLocal);
  std::vector<std::unique_ptr<ByteStream>> idle;
  for (int i = 0; i < 20; ++i) idle.push_back(std::make_unique<ByteStream>(channel_, kReflection));
  EXPECT_EQ(idle.back()->Finish().error_code(), grpc::StatusCode::RESOURCE_EXHAUSTED);
  {
    ByteStream check(channel_, kCheck);
    ASSERT_TRUE(check.Write(""));
    check.EndWrites();
    std::string reply;
    ASSERT_TRUE(check.Read(&reply));
    EXPECT_EQ(reply, kServing);
  }
  // When they have left, the next one is answered.
  idle.clear();
  const auto deadline = steady_clock::now() + seconds(30);
  bool is_answered = false;
  while (!is_answered && steady_clock::now() < deadline) {
    ByteStream call(channel_, kReflection);
    std::string reply;
    is_answered = call.Write("\x3a\x01*") && call.Read(&reply);
  }
  EXPECT_TRUE(is_answered);
}

TEST_F(StandardServices, EndOpenStreamsOfReflectionWhenTheServerStops) {
  Start(Reflection::kLocal);
  ByteStream idle(channel_, kReflection);
  AskReflection(&idle, {{"list_services", "*"}});
  const auto begin = steady_clock::now();
  server_->Shutdown(milliseconds(100));
  EXPECT_LT(steady_clock::now() - begin, seconds(10));
}

TEST_F(StandardServices, HideThemselvesWithoutReflection) {
  Start(Reflection::kOff);
  ByteStream call(channel_, kReflection);
  call.EndWrites();
  EXPECT_EQ(call.Finish().error_code(), grpc::StatusCode::UNIMPLEMENTED);
}

}  // namespace
}  // namespace dsg::server
