// SPDX-License-Identifier: Apache-2.0
#include "tests/e2e/year/year_questions.h"

#include <time.h>

#include <algorithm>
#include <functional>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "dsg/v1/search.pb.h"
#include "dsg/v1/space.pb.h"
#include "ingest/simulator/world/world_graph.h"
#include "schema/base/status.h"

namespace dsg::test {
namespace {

int64_t ThreadCpuNs() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return int64_t{now.tv_sec} * kNsPerSecond + now.tv_nsec;
}

// What a question may be about.
struct Day {
  query::ServiceCore* core;
  const YearWorld& world;
  const std::string& map;
  int number;
  std::vector<NodeId> things;

  TimeNs begin_ns() const { return YearWorld::BeginOf(number); }
  TimeNs SomeTime(Random* random) const {
    return begin_ns() + static_cast<TimeNs>(random->Uniform(
                            0.0, static_cast<double>(world.session_ns() - kNsPerSecond)));
  }
  std::string SomeAgent(Random* random) const {
    const int index = random->Index(4);
    if (index == 3) return ToString(YearWorld::Guest(number));
    return ToString(index == 2 ? YearWorld::Robot() : YearWorld::Inhabitant(index));
  }
  std::string SomeRoom(Random* random) const {
    return ToString(
        simulator::RoomId(random->Index(static_cast<int>(world.world().plan.rooms.size()))));
  }
  std::string SomeThing(Random* random) const {
    return ToString(things[static_cast<size_t>(random->Index(static_cast<int>(things.size())))]);
  }
  void SomePoint(Random* random, v1::Vector3* point) const {
    const auto high = world.world().Bounds().max();
    point->set_x(random->Uniform(0.0, high.x()));
    point->set_y(random->Uniform(0.0, high.y()));
    point->set_z(1.0);
  }
};

using Ask = std::function<absl::Status(const Day&, Random*)>;

struct Kind {
  const char* name;
  Ask ask;
};

template <typename Request, typename Reply>
using Method = absl::Status (query::Api::*)(const query::CallContext&, const Request&, Reply*);

template <typename Request, typename Reply, typename Fill>
Kind Unary(const char* name, Method<Request, Reply> method, const Fill& fill) {
  return {name, [method, fill](const Day& day, Random* random) {
            Request request;
            request.set_map(day.map);
            fill(day, random, &request);
            Reply reply;
            return (day.core->*method)(query::CallContext(), request, &reply);
          }};
}

absl::Status ReadMinute(const Day& day, Random* random) {
  v1::GetTrajectoryRequest request;
  request.set_map(day.map);
  request.set_agent(day.SomeAgent(random));
  request.set_from_ns(day.begin_ns() + 600 * kNsPerSecond);
  request.set_to_ns(day.begin_ns() + 660 * kNsPerSecond);
  return query::ReadStream(query::CallContext(),
                           day.core->GetTrajectory(query::CallContext(), request),
                           [](const v1::GetTrajectoryResponse&) { return true; });
}

absl::Status ReadMesh(const Day& day, Random* random) {
  v1::GetMeshRequest request;
  request.set_map(day.map);
  day.SomePoint(random, request.mutable_box()->mutable_min());
  *request.mutable_box()->mutable_max() = request.box().min();
  request.mutable_box()->mutable_min()->set_z(0.0);
  return query::ReadStream(query::CallContext(), day.core->GetMesh(query::CallContext(), request),
                           [](const v1::GetMeshResponse&) { return true; });
}

std::vector<Kind> AgentKinds() {
  using query::Api;
  return {Unary<v1::LocateAgentRequest, v1::LocateAgentResponse>(
              "where", &Api::LocateAgent,
              [](const Day& day, Random* random, v1::LocateAgentRequest* request) {
                request->set_agent(day.SomeAgent(random));
                request->set_at_ns(day.SomeTime(random));
              }),
          Unary<v1::BatchLocateAgentsRequest, v1::BatchLocateAgentsResponse>(
              "100 x where", &Api::BatchLocateAgents,
              [](const Day& day, Random* random, v1::BatchLocateAgentsRequest* request) {
                for (int i = 0; i < 100; ++i) {
                  v1::AgentInstant* instant = request->add_instants();
                  instant->set_agent(day.SomeAgent(random));
                  instant->set_at_ns(day.SomeTime(random));
                }
              }),
          Unary<v1::ListPresenceRequest, v1::ListPresenceResponse>(
              "who was in a room", &Api::ListPresence,
              [](const Day& day, Random* random, v1::ListPresenceRequest* request) {
                request->set_node_id(day.SomeRoom(random));
                request->set_from_ns(day.begin_ns());
                request->set_to_ns(day.begin_ns() + day.world.session_ns());
              }),
          Unary<v1::ListPresenceRequest, v1::ListPresenceResponse>(
              "who was in a box", &Api::ListPresence,
              [](const Day& day, Random* random, v1::ListPresenceRequest* request) {
                v1::Vector3* low = request->mutable_box()->mutable_min();
                day.SomePoint(random, low);
                v1::Vector3* high = request->mutable_box()->mutable_max();
                high->set_x(low->x() + 1.0);
                high->set_y(low->y() + 1.0);
                high->set_z(2.0);
                low->set_z(0.0);
                request->set_from_ns(day.SomeTime(random));
                request->set_to_ns(request->from_ns() + 60 * kNsPerSecond);
              }),
          {"a minute of a track", ReadMinute}};
}

std::vector<Kind> GraphKinds() {
  using query::Api;
  return {Unary<v1::GetNodeRequest, v1::GetNodeResponse>(
              "show a thing", &Api::GetNode,
              [](const Day& day, Random* random, v1::GetNodeRequest* request) {
                request->set_id(day.SomeThing(random));
              }),
          Unary<v1::ListNodesRequest, v1::ListNodesResponse>(
              "list rooms", &Api::ListNodes,
              [](const Day&, Random*, v1::ListNodesRequest* request) {
                request->mutable_filter()->set_layer("rooms");
              }),
          Unary<v1::ListNearestNodesRequest, v1::ListNearestNodesResponse>(
              "nearest things", &Api::ListNearestNodes,
              [](const Day& day, Random* random, v1::ListNearestNodesRequest* request) {
                day.SomePoint(random, request->mutable_position());
                request->mutable_filter()->set_layer("objects");
                request->mutable_filter()->set_at_ns(day.SomeTime(random));
                request->set_k(5);
              }),
          Unary<v1::SearchNodesRequest, v1::SearchNodesResponse>(
              "find chairs now", &Api::SearchNodes,
              [](const Day& day, Random*, v1::SearchNodesRequest* request) {
                request->set_query("chair in (room)");
                request->set_at_ns(day.begin_ns() + day.world.session_ns());
              }),
          Unary<v1::PlanPathRequest, v1::PlanPathResponse>(
              "the way to a room", &Api::PlanPath,
              [](const Day& day, Random* random, v1::PlanPathRequest* request) {
                request->mutable_from()->set_node(day.SomeRoom(random));
                request->mutable_to()->set_node(day.SomeRoom(random));
              }),
          {"mesh at a point", ReadMesh},
          Unary<v1::GetMapStatsRequest, v1::GetMapStatsResponse>(
              "statistics", &Api::GetMapStats, [](const Day&, Random*, v1::GetMapStatsRequest*) {}),
          Unary<v1::ListRevisionsRequest, v1::ListRevisionsResponse>(
              "revisions", &Api::ListRevisions,
              [](const Day&, Random*, v1::ListRevisionsRequest* request) {
                request->set_page_size(20);
              })};
}

double MedianUs(std::vector<int64_t> ns) {
  const auto middle = ns.begin() + static_cast<std::ptrdiff_t>(ns.size() / 2);
  std::nth_element(ns.begin(), middle, ns.end());
  return static_cast<double>(*middle) * 1e-3;
}

}  // namespace

absl::StatusOr<YearLatency> AskTheDay(query::ServiceCore* core, const YearWorld& world,
                                      const std::string& map, int day_number, int repeat_count) {
  const Day day{core, world, map, day_number, world.Things()};
  std::vector<Kind> kinds = AgentKinds();
  for (Kind& kind : GraphKinds()) kinds.push_back(std::move(kind));
  Random random(static_cast<uint64_t>(day_number), 9);
  YearLatency latency;
  for (const Kind& kind : kinds) {
    std::vector<int64_t> taken_ns;
    for (int i = 0; i <= repeat_count; ++i) {
      const int64_t begin_ns = ThreadCpuNs();
      const absl::Status status = kind.ask(day, &random);
      const int64_t end_ns = ThreadCpuNs();
      if (!status.ok()) return Annotate(status, absl::StrCat(kind.name, ", day ", day_number));
      if (i > 0) taken_ns.push_back(end_ns - begin_ns);
    }
    const double median_us = MedianUs(std::move(taken_ns));
    latency.round_us += median_us;
    if (median_us <= latency.slowest_us) continue;
    latency.slowest_us = median_us;
    latency.slowest = kind.name;
  }
  return latency;
}

}  // namespace dsg::test
