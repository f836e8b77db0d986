// SPDX-License-Identifier: Apache-2.0
// Calls every method of the protos over the wire, from the table that server and client are
// generated from: the client's Api of a server must answer like the engine.
#include "query/api/api.h"

#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <vector>

#include "dsg/v1/ingest_service.pb.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/client/remote_api.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "server/server.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::server {
namespace {

using query::Api;
using query::CallContext;
using query::CursorOr;
using test::kMap;

// One answer: its status, and the bytes of all messages.
struct Answer {
  absl::Status status;
  std::vector<std::string> messages;
};

template <class Request, class Reply>
Answer Ask(Api* api, absl::Status (Api::*ask)(const CallContext&, const Request&, Reply*),
           const Request& request) {
  Reply reply;
  Answer answer;
  answer.status = (api->*ask)(CallContext(), request, &reply);
  if (answer.status.ok()) answer.messages.push_back(reply.SerializeAsString());
  return answer;
}

template <class Request, class Reply>
Answer Ask(Api* api, CursorOr<Reply> (Api::*open)(const CallContext&, const Request&),
           const Request& request) {
  Answer answer;
  const CallContext call;
  answer.status = query::ReadStream(call, (api->*open)(call, request), [&](const Reply& message) {
    answer.messages.push_back(message.SerializeAsString());
    return true;
  });
  return answer;
}

// A request of the type that a function of Api takes.
template <class Request, class Reply>
Request RequestOf(absl::Status (Api::*)(const CallContext&, const Request&, Reply*)) {
  return Request();
}
template <class Request, class Reply>
Request RequestOf(CursorOr<Reply> (Api::*)(const CallContext&, const Request&)) {
  return Request();
}

class ApiOverTheWire : public testing::Test {
 protected:
  ApiOverTheWire() {
    test::MakeOffice(folder_.path());
    GraphDelta delta;
    delta.assets = {{ComputeSha256(content_), "model/obj", content_}};
    FactorAppend factors{NodeId('H', 12), {}};
    for (int i = 0; i < 1500; ++i) {
      PoseFactor factor;
      factor.type = "odometry";
      factor.from_ns = i * test::kSecond / 100;
      factor.to_ns = factor.from_ns + test::kSecond / 100;
      factors.factors.push_back(factor);
    }
    delta.factors = {factors};
    test::CommitToOffice(folder_.path(), std::move(delta));
    ServerOptions options;
    options.listen = "unix:" + folder_.path() + "/server.sock";
    auto server = Server::Start(test::OpenCore(folder_.path()), options);
    EXPECT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
    auto remote = client::Connect(server_->address());
    EXPECT_TRUE(remote.ok()) << remote.status();
    remote_ = *std::move(remote);
    engine_ = test::OpenCore(folder_.path());
  }

  template <class Method, class Request>
  void ExpectSame(const query::MethodInfo& info, Method method, const Request& request) {
    SCOPED_TRACE(std::string(info.name));
    const Answer local = Ask(engine_.get(), method, request);
    const Answer remote = Ask(remote_.get(), method, request);
    EXPECT_EQ(local.status, remote.status);
    // The incarnation changes only when a map is replaced.
    EXPECT_EQ(local.messages, remote.messages);
  }

  const std::string content_ = std::string(1'500'000, 'a') + "z";
  test::TempFolder folder_;
  std::unique_ptr<Server> server_;
  std::unique_ptr<Api> remote_;
  std::unique_ptr<query::ServiceCore> engine_;
};

TEST_F(ApiOverTheWire, EveryMethodIsServedAndRefusesAnEmptyRequestAsTheEngineDoes) {
  int count = 0;
  query::ForEachMethod([&](const query::MethodInfo& info, auto method) {
    ExpectSame(info, method, RequestOf(method));
    const absl::Status status = Ask(remote_.get(), method, RequestOf(method)).status;
    EXPECT_FALSE(absl::IsUnimplemented(status)) << info.name;
    ++count;
  });
  EXPECT_GE(count, 39);
}

TEST_F(ApiOverTheWire, FactorsComeAsTheEngineMakesThem) {
  v1::ListFactorsRequest request;
  request.set_map(kMap);
  request.set_agent("12");
  ExpectSame(query::methods::kListFactors, &Api::ListFactors, request);
  EXPECT_EQ(Ask(remote_.get(), &Api::ListFactors, request).messages.size(), 2u);
  request.set_agent("nobody");
  ExpectSame(query::methods::kListFactors, &Api::ListFactors, request);
}

TEST_F(ApiOverTheWire, AssetsComeAsTheEngineMakesThem) {
  v1::GetAssetRequest request;
  request.set_map(kMap);
  const Sha256 sha256 = ComputeSha256(content_);
  request.set_sha256(std::string(sha256.begin(), sha256.end()));
  ExpectSame(query::methods::kGetAsset, &Api::GetAsset, request);
  EXPECT_EQ(Ask(remote_.get(), &Api::GetAsset, request).messages.size(), 2u);
  request.mutable_sha256()->front() ^= 1;
  ExpectSame(query::methods::kGetAsset, &Api::GetAsset, request);
  EXPECT_EQ(ReasonOf(Ask(remote_.get(), &Api::GetAsset, request).status), Reason::kAssetUnknown);
}

TEST(MethodTable, SaysWhatTheProtosSay) {
  using namespace query::methods;
  EXPECT_TRUE(kGetNode.may_repeat);
  EXPECT_EQ(kGetNode.service, "QueryService");
  for (const auto& writing : {kCommit, kCreateMap, kSetTag, kRemoveTag, kPrune, kRevert}) {
    EXPECT_FALSE(writing.may_repeat) << writing.name;
  }
  EXPECT_TRUE(kCommit.writes);
  EXPECT_TRUE(kCommit.waits_for_memory);
  EXPECT_FALSE(kGetSession.waits_for_memory);
  EXPECT_TRUE(kListTags.writes);
  EXPECT_FALSE(kListMaps.writes);
  EXPECT_EQ(kWatchMap.lifetime, query::Lifetime::kWatch);
  EXPECT_EQ(kReadArchive.lifetime, query::Lifetime::kWork);
  EXPECT_EQ(kGetMesh.lifetime, query::Lifetime::kAnswer);
}

}  // namespace
}  // namespace dsg::server
