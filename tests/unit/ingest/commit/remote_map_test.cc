// SPDX-License-Identifier: Apache-2.0
// Ingest through a real server on a socket of its own.
#include <gtest/gtest.h>

#include <functional>
#include <thread>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "ingest/commit/remote_writer.h"
#include "ingest/pipeline/ingest_log.h"
#include "query/api/api.h"
#include "query/api/stream_cursor.h"
#include "query/client/remote_api.h"
#include "schema/base/status.h"
#include "schema/store/graph_store.h"
#include "server/server.h"
#include "tests/unit/ingest/log/log_test_util.h"
#include "tests/unit/ingest/pipeline/pipeline_test_util.h"

namespace dsg::ingest {
namespace {

class RemoteMapTest : public testing::Test {
 protected:
  void StartServer(int64_t quota_bytes = 0) {
    StoreOptions options;
    options.create = true;
    options.quota_bytes = quota_bytes;
    absl::StatusOr<std::unique_ptr<GraphStore>> store =
        GraphStore::Open(folder_.Path("store"), options);
    ASSERT_TRUE(store.ok()) << store.status();
    server::ServerOptions server_options;
    server_options.listen = address();
    absl::StatusOr<std::unique_ptr<server::Server>> server =
        server::Server::Start(query::MakeServiceCore(*std::move(store)), server_options);
    ASSERT_TRUE(server.ok()) << server.status();
    server_ = *std::move(server);
  }

  std::string address() const { return "unix:" + folder_.Path("s"); }

  std::unique_ptr<RemoteMap> OpenMap() {
    MapSpec spec;
    spec.name = "test";
    spec.epoch_ns = 77;
    absl::StatusOr<std::unique_ptr<RemoteMap>> map = OpenRemoteMap(address(), spec);
    EXPECT_TRUE(map.ok()) << map.status();
    return map.ok() ? *std::move(map) : nullptr;
  }

  absl::StatusOr<IngestSummary> Ingest(const std::string& path, RemoteMap& map) {
    return Ingest(path, map, map.writer());
  }

  absl::StatusOr<IngestSummary> Ingest(const std::string& path, RemoteMap& map, GraphWriter& writer,
                                       bool tells_undone_again = false) {
    LogOptions options;
    options.epoch_ns = map.spec().epoch_ns;
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<LogSource> log, OpenLog(path, options));
    const std::unique_ptr<MapView> view = MakeRemoteMapView(map);
    IngestOptions ingest;
    ingest.poses_per_delta = 50;
    ingest.tells_undone_again = tells_undone_again;
    return IngestLog(*log, options, ingest, *view, writer, {});
  }

  absl::Status Revert(Revision revision) {
    DSG_ASSIGN_OR_RETURN(const std::unique_ptr<query::Api> api, client::Connect(address()));
    v1::RevertRequest request;
    request.set_map("test");
    request.set_revision(revision);
    request.set_author("ann");
    const query::CallContext call;
    return query::ReadStream(call, api->Revert(call, request),
                             [](const v1::RevertResponse&) { return true; });
  }

  static GraphDelta Rooms(int count, const std::string& session, int64_t sequence) {
    GraphDelta delta;
    delta.map = "test";
    delta.session_id = session;
    delta.sequence = sequence;
    for (int i = 0; i < count; ++i) {
      delta.nodes.push_back(MakeRoom(static_cast<uint64_t>(i), 5.0 * i, 0, 5.0 * i + 5, 5));
    }
    delta.nodes.push_back(MakePlace(1, 2, 2, 1));
    Edge edge;
    edge.source = NodeId('R', 0);
    edge.relation = relations::kContains;
    edge.target = NodeId('p', 1);
    delta.edges.push_back(edge);
    return delta;
  }

  TempFolder folder_;
  std::unique_ptr<server::Server> server_;
};

std::string WalkRows(int step_count) {
  std::string rows;
  for (int step = 0; step < step_count; ++step) {
    for (int person = 1; person <= 3; ++person) {
      absl::StrAppend(&rows, step, " ", person, " ", 0.05 * step * person, " ", person, "\n");
    }
  }
  return rows;
}

TEST_F(RemoteMapTest, CreatesAMissingMapAndFindsItAgain) {
  StartServer();
  ASSERT_NE(OpenMap(), nullptr);
  MapSpec other;
  other.name = "test";
  other.epoch_ns = 99;
  const auto again = OpenRemoteMap(address(), other);
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ((*again)->spec().epoch_ns, 77) << "the map's own spec holds";
}

TEST_F(RemoteMapTest, RobotsThatStartOneNewMapTogetherBothGoOn) {
  StartServer();
  for (int round = 0; round < 6; ++round) {
    MapSpec spec;
    spec.name = absl::StrCat("new", round);
    std::vector<std::thread> robots;
    for (int i = 0; i < 4; ++i) {
      robots.emplace_back([&, i] {
        const auto map = OpenRemoteMap(address(), spec);
        ASSERT_TRUE(map.ok()) << map.status();
        GraphDelta delta;
        delta.map = spec.name;
        delta.session_id = absl::StrCat("robot", i);
        delta.sequence = 1;
        delta.labels = {{100 + i, "label"}};
        const auto result = (*map)->writer().Commit(delta);
        EXPECT_TRUE(result.ok()) << result.status();
      });
    }
    for (std::thread& robot : robots) robot.join();
  }
}

TEST_F(RemoteMapTest, DoesNotWriteOverAnAgentThatAnotherRobotBroughtMeanwhile) {
  StartServer();
  const auto bring = [](const std::string& session, const std::string& name) {
    GraphDelta delta;
    delta.map = "test";
    delta.session_id = session;
    delta.sequence = 1;
    Node node;
    node.id = NodeId('H', 0);
    node.layer = layers::kAgents;
    node.kind = kinds::kHuman;
    node.name = name;
    delta.nodes = {node};
    return delta;
  };
  const auto first = OpenMap();
  const auto second = OpenMap();
  ASSERT_TRUE(first->writer().Commit(bring("a", "ann")).ok());
  const auto refused = second->writer().Commit(bring("b", "bob"));
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kParentRevisionStale);
  EXPECT_EQ(MetadataOf(refused.status())["agent"], "H0");
  // The same agent may come of two logs.
  EXPECT_TRUE(second->writer().Commit(bring("b", "ann")).ok());
  const auto agents = first->ListAgents();
  ASSERT_TRUE(agents.ok()) << agents.status();
  ASSERT_EQ(agents->size(), 1u);
  EXPECT_EQ(agents->front().name, "ann");
}

TEST_F(RemoteMapTest, CommitsAndListsOverManyPages) {
  StartServer();
  const auto map = OpenMap();
  const auto result = map->writer().Commit(Rooms(1100, "s", 1));
  ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(result->revision, 1);
  EXPECT_FALSE(result->replayed);
  const auto again = map->writer().Commit(Rooms(1100, "s", 1));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_TRUE(again->replayed);
  EXPECT_EQ(map->writer().GetSession("s")->last_sequence, 1);
  const auto rooms = map->ListNodes("rooms");
  ASSERT_TRUE(rooms.ok()) << rooms.status();
  ASSERT_EQ(rooms->size(), 1100u);
  EXPECT_EQ((*rooms)[7].region->footprint_map.at(0), Eigen::Vector2d(35, 0));
  EXPECT_EQ(*map->ListChildren(NodeId('R', 0)), std::vector<NodeId>{NodeId('p', 1)});
  EXPECT_TRUE(map->ListAgents()->empty());
}

TEST_F(RemoteMapTest, GivesErrorsWithTheirReasons) {
  StartServer();
  const auto map = OpenMap();
  const absl::Status gap = map->writer().Commit(Rooms(1, "s", 5)).status();
  EXPECT_EQ(ReasonOf(gap), Reason::kSequenceGap) << gap;
  EXPECT_EQ(gap.code(), absl::StatusCode::kAborted);
  MapSpec bad;
  bad.name = "../x";
  EXPECT_EQ(ReasonOf(OpenRemoteMap(address(), bad).status()), Reason::kMapNameInvalid);
}

TEST_F(RemoteMapTest, RefusesADeltaThatNoServerTakes) {
  StartServer();
  const auto map = OpenMap();
  GraphDelta delta = Rooms(100, "s", 1);
  for (Node& node : delta.nodes) node.attributes["note"] = std::string(60'000, 'x');
  const absl::Status status = map->writer().Commit(delta).status();
  EXPECT_EQ(ReasonOf(status), Reason::kLimitExceeded) << status;
}

TEST_F(RemoteMapTest, WaitsForAServerThatIsStillComingUp) {
  std::unique_ptr<RemoteMap> map;
  std::thread client([&] { map = OpenMap(); });
  StartServer();
  client.join();
  EXPECT_NE(map, nullptr);
}

TEST_F(RemoteMapTest, NamesAnAddressWhereNobodyListens) {
  MapSpec spec;
  spec.name = "test";
  const absl::Status status =
      OpenRemoteMap(address(), spec, {.retry_ns_max = kNsPerSecond / 10}).status();
  EXPECT_EQ(status.code(), absl::StatusCode::kUnavailable);
  EXPECT_NE(std::string(status.message()).find(address()), std::string::npos) << status;
}

// Lets somebody else write to the map before its third delta.
class CrossedWriter : public GraphWriter {
 public:
  CrossedWriter(GraphWriter& writer, std::function<absl::Status()> crossing)
      : writer_(writer), crossing_(std::move(crossing)) {}

  absl::StatusOr<CommitResult> Commit(GraphDelta delta) override {
    if (++count_ == 3) DSG_RETURN_IF_ERROR(crossing_());
    return writer_.Commit(std::move(delta));
  }
  absl::StatusOr<SessionState> GetSession(const std::string& session_id) override {
    return writer_.GetSession(session_id);
  }

 private:
  GraphWriter& writer_;
  std::function<absl::Status()> crossing_;
  int count_ = 0;
};

TEST_F(RemoteMapTest, LogGoesOnWhenTheServerForgetsWhatItTold) {
  StartServer();
  const auto map = OpenMap();
  ASSERT_TRUE(map->writer().Commit(Rooms(2, "s", 1)).ok());
  GraphDelta prune;
  prune.map = "test";
  prune.session_id = "prune";
  prune.sequence = 1;
  prune.is_forgetting = true;
  for (const NodeId id : {NodeId('H', 1), NodeId('R', 0), NodeId('p', 1)}) {
    prune.retirements.push_back({id, std::nullopt});
  }
  CrossedWriter writer(map->writer(), [&] { return map->writer().Commit(prune).status(); });
  const auto summary = Ingest(folder_.Write("a.txt", WalkRows(100)), *map, writer);
  ASSERT_TRUE(summary.ok()) << summary.status();
  // Two deltas of fifty poses of three agents were told before.
  EXPECT_EQ((*map->FindTrack(NodeId('H', 1), std::nullopt))->pose_count, 100 - 34);
  EXPECT_EQ((*map->FindTrack(NodeId('H', 2), std::nullopt))->pose_count, 100);
  EXPECT_EQ((*map->FindTrack(NodeId('H', 3), std::nullopt))->pose_count, 100);
  const auto rooms = map->ListNodes("rooms");
  ASSERT_TRUE(rooms.ok()) << rooms.status();
  EXPECT_EQ(rooms->size(), 1u);
  const Node agent = map->ListAgents()->at(0);
  EXPECT_EQ(agent.observation_count, 100 - 34);
  EXPECT_EQ(agent.first_observed_ns, (*map->FindTrack(agent.id, std::nullopt))->first_ns);
}

TEST_F(RemoteMapTest, LogEndsWhenTheServerRevertsWhatItTold) {
  StartServer();
  const auto map = OpenMap();
  ASSERT_TRUE(map->writer().Commit(Rooms(2, "s", 1)).ok());
  const std::string log = folder_.Write("a.txt", WalkRows(100));
  // Between the look before a delta and its commit.
  CrossedWriter writer(map->writer(), [&] { return Revert(1); });
  const absl::Status ended = Ingest(log, *map, writer).status();
  EXPECT_EQ(ended.code(), absl::StatusCode::kAborted);
  EXPECT_EQ(std::string(ended.message()),
            "a.txt (trajnet): map \"test\" was reverted to revision 1 by \"ann\" (revision 4), and "
            "what this log had told it until revision 3 is no longer there: undo with \"dsg revert "
            "4\" what it has told since, and tell it again with --after-revert");
  // Nor does the same log say "nothing new".
  EXPECT_EQ(Ingest(log, *map).status(), ended);
  ASSERT_EQ(Revert(4), absl::OkStatus());
  const auto again = Ingest(log, *map, map->writer(), /*tells_undone_again=*/true);
  ASSERT_TRUE(again.ok()) << again.status();
  for (const uint64_t person : {1, 2, 3}) {
    EXPECT_EQ((*map->FindTrack(NodeId('H', person), std::nullopt))->pose_count, 100) << person;
  }
  const auto known = Ingest(log, *map);
  ASSERT_TRUE(known.ok()) << known.status();
  EXPECT_EQ(known->committed.revision_count, 0);
}

TEST_F(RemoteMapTest, LogGoesOnWhenARevertIsUndone) {
  StartServer();
  const auto map = OpenMap();
  ASSERT_TRUE(map->writer().Commit(Rooms(2, "s", 1)).ok());
  const std::string log = folder_.Write("a.txt", WalkRows(100));
  CrossedWriter stopped(map->writer(), [] { return absl::CancelledError("stopped"); });
  EXPECT_EQ(Ingest(log, *map, stopped).status().code(), absl::StatusCode::kCancelled);
  ASSERT_EQ(Revert(1), absl::OkStatus());
  const absl::Status refused = Ingest(log, *map).status();
  EXPECT_NE(std::string(refused.message()).find("bring it back with \"dsg revert 3\" and run"),
            std::string::npos)
      << refused;
  ASSERT_EQ(Revert(3), absl::OkStatus());
  const auto rest = Ingest(log, *map);
  ASSERT_TRUE(rest.ok()) << rest.status();
  EXPECT_EQ((*map->FindTrack(NodeId('H', 1), std::nullopt))->pose_count, 100);
}

TEST_F(RemoteMapTest, LogGoesOnWhenOthersRevertWhatIsTheirs) {
  StartServer();
  const auto map = OpenMap();
  ASSERT_TRUE(map->writer().Commit(Rooms(2, "s", 1)).ok());
  CrossedWriter writer(map->writer(), [&]() -> absl::Status {
    GraphDelta label;
    label.map = "test";
    label.session_id = "other";
    label.sequence = 1;
    label.nodes.push_back(MakeRoom(7, 90, 0, 95, 5));
    DSG_ASSIGN_OR_RETURN(const CommitResult result, map->writer().Commit(label));
    return Revert(result.revision - 1);
  });
  const auto summary = Ingest(folder_.Write("a.txt", WalkRows(100)), *map, writer);
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_EQ((*map->FindTrack(NodeId('H', 1), std::nullopt))->pose_count, 100);
}

TEST_F(RemoteMapTest, TakesALogAndItsContinuation) {
  StartServer();
  const auto map = OpenMap();
  ASSERT_TRUE(map->writer().Commit(Rooms(2, "s", 1)).ok());
  const auto first = Ingest(folder_.Write("a.txt", WalkRows(40)), *map);
  ASSERT_TRUE(first.ok()) << first.status();
  EXPECT_EQ(first->committed.pose_count, 120);
  EXPECT_GT(first->committed.stay_count, 3);
  const std::string longer = folder_.Write("b.txt", WalkRows(100));
  const auto second = Ingest(longer, *map);
  ASSERT_TRUE(second.ok()) << second.status();
  EXPECT_EQ(second->committed.skipped_pose_count, 120);
  EXPECT_EQ(second->committed.pose_count, 180);
  const auto third = Ingest(longer, *map);
  ASSERT_TRUE(third.ok()) << third.status();
  EXPECT_EQ(third->committed.revision_count, 0);
  const auto track = map->FindTrack(NodeId('H', 2), std::nullopt);
  ASSERT_TRUE(track.ok()) << track.status();
  EXPECT_EQ((*track)->pose_count, 100);
  EXPECT_EQ((*track)->first_ns, 77);
  EXPECT_EQ(map->ListAgents()->at(1).observation_count, 100);
  EXPECT_EQ(*map->FindTrack(NodeId('H', 9), std::nullopt), std::nullopt);
  EXPECT_EQ(map->ReadPoses(NodeId('H', 2), 77, 78)->size(), 1u);
  EXPECT_TRUE(map->ReadPoses(NodeId('H', 2), 0, 5)->empty());
}

TEST_F(RemoteMapTest, SaysInOneSentenceThatTheServersQuotaIsReached) {
  StartServer(/*quota_bytes=*/1);
  const auto map = OpenMap();
  const absl::Status refused = map->writer().Commit(Rooms(2'000, "s", 1)).status();
  EXPECT_EQ(ReasonOf(refused), Reason::kQuotaExceeded);
  const std::string message(refused.message());
  EXPECT_EQ(message.find("map \"test\" may have 1 bytes"), 0U) << message;
  EXPECT_NE(message.find("raise the quota of server " + address() + ", then run the same"),
            std::string::npos)
      << message;
  EXPECT_EQ(MetadataOf(refused)["quota_bytes"], "1");
}

TEST_F(RemoteMapTest, RefusesAContradictionThroughTheServer) {
  StartServer();
  const auto map = OpenMap();
  ASSERT_TRUE(Ingest(folder_.Write("a.txt", "0 1 1 2\n1 1 2 2\n"), *map).ok());
  EXPECT_EQ(ReasonOf(Ingest(folder_.Write("b.txt", "0 1 1 2\n1 1 2 3\n"), *map).status()),
            Reason::kTrackConflict);
}

TEST_F(RemoteMapTest, DropsOnlyTheMapThatOpeningHasMade) {
  StartServer();
  const std::unique_ptr<RemoteMap> map = OpenMap();
  ASSERT_NE(map, nullptr);
  EXPECT_TRUE(map->is_new());
  const std::unique_ptr<RemoteMap> other = OpenMap();
  ASSERT_NE(other, nullptr);
  EXPECT_FALSE(other->is_new());
  const auto committed = other->writer().Commit(Rooms(1, "other", 1));
  ASSERT_TRUE(committed.ok()) << committed.status();
  // Somebody else has committed to it.
  EXPECT_EQ(ReasonOf(map->Drop(0)), Reason::kParentRevisionStale);
  EXPECT_EQ(map->Drop(1), absl::OkStatus());
  EXPECT_EQ(ReasonOf(map->Drop(1)), Reason::kMapUnknown);
  // Another one of that name.
  const std::unique_ptr<RemoteMap> again = OpenMap();
  ASSERT_NE(again, nullptr);
  EXPECT_TRUE(again->is_new());
  EXPECT_EQ(ReasonOf(map->Drop(0)), Reason::kMapReplaced);
  EXPECT_EQ(again->Drop(0), absl::OkStatus());
}

TEST_F(RemoteMapTest, TellsAWriterThatItsMapIsGone) {
  StartServer();
  const std::unique_ptr<RemoteMap> map = OpenMap();
  ASSERT_NE(map, nullptr);
  ASSERT_TRUE(map->writer().Commit(Rooms(1, "robot", 1)).ok());
  ASSERT_EQ(map->Drop(1), absl::OkStatus());
  const absl::Status status = map->writer().Commit(Rooms(2, "robot", 2)).status();
  EXPECT_EQ(ReasonOf(status), Reason::kMapUnknown);
  EXPECT_NE(status.message().find("was dropped or renamed"), std::string::npos) << status;
}

}  // namespace
}  // namespace dsg::ingest
