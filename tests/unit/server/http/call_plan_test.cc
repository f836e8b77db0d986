// SPDX-License-Identifier: Apache-2.0
#include "server/http/call_plan.h"

#include <gtest/gtest.h>

#include "query/api/api.h"

namespace dsg::server {
namespace {

using Fields = std::vector<std::pair<std::string_view, std::string_view>>;

constexpr char kListMaps[] = "/dsg.v1.MapService/ListMaps";
constexpr char kGetMesh[] = "/dsg.v1.QueryService/GetMesh";
constexpr char kCommit[] = "/dsg.v1.IngestService/Commit";

class CallPlanTest : public testing::Test {
 protected:
  // The status of the refusal, 0 for a plan, which is left in plan_.
  int Plan(std::string_view target, Fields fields, bool may_write = false) {
    const auto planned = PlanCall(methods_, {"POST", target, std::move(fields)}, may_write);
    if (const auto* const refusal = std::get_if<Refusal>(&planned)) return refusal->http_status;
    plan_ = std::get<CallPlan>(planned);
    return 0;
  }

  CallRuntime questions_;
  CallRuntime commits_;
  const MethodTable methods_{&questions_, &commits_};
  CallPlan plan_;
};

TEST_F(CallPlanTest, TakesEveryReadingMethodInItsTypesOnly) {
  int read_count = 0;
  query::ForEachMethod([&](const query::MethodInfo& info, auto) {
    const std::string path = "/dsg.v1." + std::string(info.service) + "/" + std::string(info.name);
    const bool is_stream = methods_.Find(path)->is_stream;
    const Fields right = {
        {"content-type", is_stream ? "application/connect+json" : "application/json"}};
    const Fields wrong = {
        {"content-type", is_stream ? "application/json" : "application/connect+json"}};
    EXPECT_EQ(Plan(path, right, /*may_write=*/true), 0) << path;
    EXPECT_EQ(Plan(path, wrong, /*may_write=*/true), 415) << path;
    EXPECT_EQ(Plan(path, right), info.may_repeat ? 0 : 403) << path;
    if (info.may_repeat) ++read_count;
  });
  EXPECT_GE(read_count, 20);
}

TEST_F(CallPlanTest, KnowsNoOtherPaths) {
  for (const char* path : {"/", "", "/dsg.v1.MapService/", "/dsg.v1.MapService/listMaps",
                           "/dsg.v1.MapService/ListMaps?x=1", "/dsg.v1.MapService/ListMaps/",
                           "//dsg.v1.MapService/ListMaps", "http://a/dsg.v1.MapService/ListMaps",
                           "/grpc.health.v1.Health/Check"}) {
    EXPECT_EQ(Plan(path, {{"content-type", "application/json"}}), 404) << path;
  }
}

TEST_F(CallPlanTest, RefusesOtherTypesEncodingsAndVersions) {
  EXPECT_EQ(Plan(kListMaps, {}), 415);
  EXPECT_EQ(Plan(kListMaps, {{"content-type", "text/plain"}}), 415);
  const auto with = [&](std::string_view name, std::string_view value) {
    return Plan(kListMaps, {{"content-type", "application/json"}, {name, value}});
  };
  EXPECT_EQ(with("connect-protocol-version", "1"), 0);
  EXPECT_EQ(with("connect-protocol-version", "2"), 400);
  EXPECT_EQ(with("content-encoding", "identity"), 0);
  EXPECT_EQ(with("content-encoding", "gzip"), 501);
  EXPECT_EQ(with("connect-content-encoding", "br"), 501);
  EXPECT_EQ(with("connect-timeout-ms", "soon"), 400);
}

TEST_F(CallPlanTest, ReadsDeadlinesAndBoundsBodies) {
  const auto before = CallerDeadline::clock::now();
  ASSERT_EQ(Plan(kGetMesh,
                 {{"content-type", "application/connect+proto"}, {"connect-timeout-ms", "5000"}}),
            0);
  EXPECT_GE(plan_.deadline, before + std::chrono::seconds(5));
  EXPECT_LE(plan_.deadline, CallerDeadline::clock::now() + std::chrono::seconds(5));
  EXPECT_EQ(plan_.body_bytes_max, size_t{1} << 20);
  EXPECT_FALSE(plan_.type.is_json);
  ASSERT_EQ(Plan(kListMaps, {{"content-type", "application/json"}}), 0);
  EXPECT_EQ(plan_.deadline, CallerDeadline::max());
  ASSERT_EQ(Plan(kCommit, {{"content-type", "application/proto"}}, true), 0);
  EXPECT_GE(plan_.body_bytes_max, size_t{4} << 20);
}

}  // namespace
}  // namespace dsg::server
