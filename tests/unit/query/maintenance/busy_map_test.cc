// SPDX-License-Identifier: Apache-2.0
// Merges and reverts of a map to which a robot commits without a pause.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <set>
#include <thread>

#include "dsg/v1/ingest_service.pb.h"
#include "schema/codec/patch.h"
#include "schema/codec/proto_convert.h"
#include "tests/unit/query/maintenance/two_halves.h"
#include "tests/unit/schema/merge/small_map.h"

namespace dsg::query {
namespace {

constexpr NodeId kRobot('r', 77);
// Ids that a merge does not give away.
constexpr char kLetter = 'T';
constexpr uint64_t kFirstThing = 1;

// Commits as fast as it may: a pose and a new thing each time, and one thing again and again.
class BusyRobot {
 public:
  BusyRobot(ServiceCore* core, std::string map) : core_(core), map_(std::move(map)) {
    GraphDelta first;
    Node robot;
    robot.id = kRobot;
    robot.layer = layers::kAgents;
    robot.kind = kinds::kRobot;
    robot.name = "busy";
    robot.agent.emplace();
    first.nodes = {robot};
    EXPECT_TRUE(Commit(std::move(first)).ok());
  }
  ~BusyRobot() { Stop(); }

  /// One round.
  void Step() {
    const auto i = static_cast<uint64_t>(++count_);
    GraphDelta delta;
    delta.appends = {{kRobot, {test::PoseAt(count_ * kNsPerSecond, 1, 2, 0)}}};
    delta.nodes = {Thing(NodeId(kLetter, kFirstThing)), Thing(NodeId(kLetter, kFirstThing + i))};
    delta.nodes[0].observation_count = count_;
    const absl::StatusOr<Revision> revision = Commit(std::move(delta));
    EXPECT_TRUE(revision.ok()) << revision.status();
    if (revision.ok()) revisions_.push_back(*revision);
  }
  void Start() {
    thread_ = std::thread([this] {
      while (!is_over_) Step();
    });
    Await(3);
  }
  /// Until it has begun so many more rounds.
  void Await(int64_t rounds) const {
    const int64_t end = count_ + rounds;
    while (count_ < end) std::this_thread::yield();
  }
  void Stop() {
    is_over_ = true;
    if (thread_.joinable()) thread_.join();
  }
  /// By round: the revision that it became. After Stop.
  const std::vector<Revision>& revisions() const { return revisions_; }

  static Node Thing(NodeId id) {
    return test::MakeNode(id, layers::kObjects, kinds::kObject, "thing",
                          Box3d(Eigen::Vector3d(-9, -9, 0), Eigen::Vector3d(-8, -8, 1)));
  }

 private:
  absl::StatusOr<Revision> Commit(GraphDelta delta) {
    delta.map = map_;
    delta.session_id = "busy";
    delta.sequence = ++sequence_;
    v1::CommitRequest request;
    ToProto(delta, LayerTable(), request.mutable_delta());
    v1::CommitResponse reply;
    DSG_RETURN_IF_ERROR(core_->Commit(CallContext(), request, &reply));
    return reply.revision();
  }

  ServiceCore* const core_;
  const std::string map_;
  int64_t sequence_ = 0;
  std::atomic<int64_t> count_ = 0;
  std::vector<Revision> revisions_;
  std::atomic<bool> is_over_ = false;
  std::thread thread_;
};

// What the robot wrote after `after` is in the map.
void ExpectThere(const Snapshot& map, const BusyRobot& robot, Revision after) {
  int64_t pose_count = 0;
  for (size_t i = 0; i < robot.revisions().size(); ++i) {
    if (robot.revisions()[i] <= after) continue;
    ++pose_count;
    EXPECT_TRUE(map.GetNode(NodeId(kLetter, kFirstThing + i + 1)).ok()) << "round " << i;
  }
  EXPECT_EQ(map.GetTrack(kRobot)->pose_count, pose_count);
  const auto last = static_cast<int64_t>(robot.revisions().size());
  EXPECT_EQ(map.GetNode(NodeId(kLetter, kFirstThing))->observation_count, last);
}

void ExpectSound(const std::string& folder, const std::string& map) {
  const auto report = (*(*GraphStore::Open(folder, {}))->OpenMap(map))->Verify({}, {});
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->problems.empty());
}

TEST(BusyMap, IsMergedAndLosesNothingOfTheRobot) {
  test::TwoHalves halves;
  const auto core = test::OpenCore(halves.folder());
  BusyRobot robot(core.get(), "west");
  robot.Start();
  v1::MergeMapsResponse last;
  const absl::Status merged =
      query::ReadStream(CallContext(), core->MergeMaps(CallContext(), test::WestWithEast()),
                        [&](const v1::MergeMapsResponse& message) {
                          last = message;
                          return true;
                        });
  robot.Stop();
  ASSERT_TRUE(merged.ok()) << merged;
  EXPECT_TRUE(last.done());
  EXPECT_GT(last.fused_object_count(), 10);
  const auto store = *GraphStore::Open(halves.folder(), {});
  ExpectThere(*test::Newest(store.get(), "west"), robot, 0);
  ExpectSound(halves.folder(), "west");
}

TEST(BusyMap, IsMergedByANewPlanWhenTheRobotWritesWhatTheOldOneChanges) {
  test::TwoHalves halves;
  const auto core = test::OpenCore(halves.folder());
  const auto cursor = core->MergeMaps(CallContext(), test::WestWithEast());
  ASSERT_TRUE(cursor.ok());
  v1::MergeMapsResponse message;
  ASSERT_TRUE((*cursor)->Next(CallContext(), &message).ok());
  const int64_t added_count = message.added_node_count();
  // Takes the next free id, which the plan has given away.
  const auto store = *GraphStore::Open(halves.folder(), {});
  uint64_t largest = 0;
  ASSERT_TRUE(test::Newest(store.get(), "west")
                  ->ReadAllNodes({},
                                 [&](const Node& node) {
                                   if (node.id.letter() == 'O') {
                                     largest = std::max(largest, node.id.index());
                                   }
                                 })
                  .ok());
  GraphDelta delta;
  delta.map = "west";
  delta.session_id = "robot";
  delta.sequence = 1;
  delta.nodes = {BusyRobot::Thing(NodeId('O', largest + 1))};
  v1::CommitRequest request;
  ToProto(delta, LayerTable(), request.mutable_delta());
  v1::CommitResponse reply;
  ASSERT_TRUE(core->Commit(CallContext(), request, &reply).ok());
  std::set<std::string> ids;
  while (!(*cursor)->done()) {
    message.Clear();
    const absl::Status status = (*cursor)->Next(CallContext(), &message).status();
    ASSERT_TRUE(status.ok()) << status;
    for (const auto& [theirs, mine] : message.node_ids()) ids.insert(mine);
  }
  EXPECT_EQ(message.added_node_count(), added_count);
  EXPECT_FALSE(ids.contains(ToString(NodeId('O', largest + 1))));
  const auto west = test::Newest(store.get(), "west");
  EXPECT_EQ(west->GetNode(NodeId('O', largest + 1))->name, "thing");
  for (const std::string& id : ids) EXPECT_TRUE(west->ResolveNode(id).ok()) << id;
}

// A map "b" of so many chairs in a hall that a merge writes them in several parts, to be merged
// into map "a", which has the hall (R1) and a closet (R2).
class LargeMerge : public testing::Test {
 protected:
  LargeMerge() : core_(test::OpenCore(folder_.path())) {
    const auto store = *GraphStore::Open(folder_.path(), {});
    GraphDelta a;
    a.nodes = {Room(1, 0.0), Room(2, 1000.0)};
    test::StoreMap(store.get(), "a", std::move(a));
    GraphDelta b;
    b.nodes = {Room(5, 0.0), Room(6, 1000.0)};
    for (int i = 0; i < 5000; ++i) {
      b.nodes.push_back(test::MakeObject(i, "chair", {2.0 * (i % 70), 2.0 * (i / 70), 0.4}));
      b.edges.push_back(test::MakeEdge(test::R(5), relations::kContains, test::O(i)));
    }
    test::StoreMap(store.get(), "b", std::move(b));
    v1::MergeMapsRequest request;
    request.set_map("a");
    request.set_other("b");
    ToProto(Pose3d(), request.mutable_map_t_other());
    cursor_ = *core_->MergeMaps(CallContext(), request);
  }

  static Node Room(uint64_t index, double x) {
    Node room = test::MakeRoom(index, {x, 0, 0}, {150, 150, 3});
    room.box_node = Box3d(Eigen::Vector3d(-3000, -3000, -3), Eigen::Vector3d(3000, 3000, 9));
    return room;
  }

  void Next() {
    v1::MergeMapsResponse message;
    const absl::Status status = cursor_->Next(CallContext(), &message).status();
    ASSERT_TRUE(status.ok()) << status;
  }
  void ToTheEnd() {
    while (!cursor_->done()) ASSERT_NO_FATAL_FAILURE(Next());
    ExpectSound(folder_.path(), "a");
  }
  // The hall too, which the merge has still to write: it plans anew.
  void CommitToA(GraphDelta delta) {
    delta.nodes.push_back(Room(1, 0.0));
    delta.nodes.back().name = "hall";
    delta.map = "a";
    delta.session_id = "robot";
    delta.sequence = 1;
    v1::CommitRequest request;
    ToProto(delta, LayerTable(), request.mutable_delta());
    MarkWhole(request.mutable_delta());
    v1::CommitResponse reply;
    const absl::Status status = core_->Commit(CallContext(), request, &reply);
    ASSERT_TRUE(status.ok()) << status;
  }
  std::shared_ptr<const Snapshot> Newest() {
    return test::Newest(GraphStore::Open(folder_.path(), {})->get(), "a");
  }
  int64_t CountThings() {
    int64_t count = 0;
    EXPECT_TRUE(Newest()
                    ->ReadAllNodes({}, [&](const Node& node) { count += node.id.letter() == 'O'; })
                    .ok());
    return count;
  }

  test::TempFolder folder_;
  std::unique_ptr<ServiceCore> core_;
  std::unique_ptr<StreamCursor<v1::MergeMapsResponse>> cursor_;
};

TEST_F(LargeMerge, LeavesWhatOthersWriteOfTheNodesThatItHasBrought) {
  Next();
  Next();
  Node chair = *Newest()->GetNode(test::O(7));
  chair.revision = 0;
  chair.observation_count = 50;
  chair.attributes["robot"] = std::string("saw it");
  Node bare = *Newest()->GetNode(test::O(8));
  bare.revision = 0;
  bare.attributes.clear();
  GraphDelta delta;
  delta.nodes = {chair, bare};
  CommitToA(std::move(delta));
  ToTheEnd();
  EXPECT_EQ(Newest()->GetNode(test::O(7))->observation_count, 50);
  EXPECT_TRUE(Newest()->GetNode(test::O(7))->attributes.contains("robot"));
  EXPECT_TRUE(Newest()->GetNode(test::O(8))->attributes.empty());
  EXPECT_EQ(Newest()->GetNode(test::R(1))->name, "hall");
  EXPECT_EQ(CountThings(), 5000);
}

TEST_F(LargeMerge, BringsNothingBackThatOthersRetireMeanwhile) {
  Next();
  Next();
  GraphDelta delta;
  delta.retirements = {{test::O(7), std::nullopt}};
  CommitToA(std::move(delta));
  ToTheEnd();
  EXPECT_EQ(CountThings(), 4999);
}

TEST_F(LargeMerge, LeavesParentsThatOthersGiveMeanwhile) {
  Next();
  Next();
  GraphDelta delta;
  delta.edges = {test::MakeEdge(test::R(2), relations::kContains, test::O(7))};
  CommitToA(std::move(delta));
  ToTheEnd();
  EXPECT_TRUE(Newest()->FindEdge({test::R(2), relations::kContains, test::O(7)})->has_value());
  EXPECT_FALSE(Newest()->FindEdge({test::R(1), relations::kContains, test::O(7)})->has_value());
  EXPECT_TRUE(Newest()->FindEdge({test::R(1), relations::kContains, test::O(8)})->has_value());
}

// 10,000 vertices and 19,602 faces.
MeshBlock Floor(int x) {
  constexpr uint32_t kSide = 100;
  MeshBlock block;
  block.index = {x, 0, 0};
  for (uint32_t j = 0; j < kSide; ++j) {
    for (uint32_t i = 0; i < kSide; ++i) {
      block.positions_map.push_back(
          Eigen::Vector3d(2.0 * x + 0.01 + 0.02 * i, 0.01 + 0.02 * j, 1.0).cast<float>());
    }
  }
  for (uint32_t j = 0; j + 1 < kSide; ++j) {
    for (uint32_t i = 0; i + 1 < kSide; ++i) {
      const uint32_t k = j * kSide + i;
      block.faces.push_back({k, k + 1, k + kSide});
      block.faces.push_back({k + 1, k + kSide + 1, k + kSide});
    }
  }
  return block;
}

TEST(BusyMap, IsMergedTwiceAtOnceAndHasAllOfTheMeshWhenOneOfThemIsCancelled) {
  constexpr int kBlockCount = 16;
  test::TempFolder folder;
  const auto store = *GraphStore::Open(folder.path(), {});
  GraphDelta a;
  a.nodes = {test::MakeObject(1, "chair", {500, 500, 0})};
  test::StoreMap(store.get(), "a", std::move(a));
  GraphDelta b;
  for (int x = 0; x < kBlockCount; ++x) b.mesh_blocks.push_back(Floor(x));
  test::StoreMap(store.get(), "b", std::move(b));
  const auto core = test::OpenCore(folder.path());
  v1::MergeMapsRequest request;
  request.set_map("a");
  request.set_other("b");
  ToProto(Pose3d(), request.mutable_map_t_other());
  auto one = *core->MergeMaps(CallContext(), request);
  const auto two = *core->MergeMaps(CallContext(), request);
  v1::MergeMapsResponse message;
  ASSERT_TRUE(one->Next(CallContext(), &message).ok());
  ASSERT_TRUE(two->Next(CallContext(), &message).ok());
  ASSERT_TRUE(one->Next(CallContext(), &message).ok());
  one.reset();
  while (!two->done()) {
    const absl::Status status = two->Next(CallContext(), &message).status();
    ASSERT_TRUE(status.ok()) << status;
  }
  const auto merged = test::Newest(store.get(), "a");
  EXPECT_EQ(merged->MeshBlocks()->size(), static_cast<size_t>(kBlockCount));
  EXPECT_EQ(merged->ReadMeshBlock({kBlockCount - 1, 0, 0})->faces.size(), 19'602u);
  ExpectSound(folder.path(), "a");
}

TEST(BusyMap, IsRevertedAndKeepsWhatTheRobotWritesAfterwards) {
  test::TempFolder folder;
  test::MakeOffice(folder.path());
  const auto core = test::OpenCore(folder.path());
  BusyRobot robot(core.get(), test::kMap);
  constexpr Revision kThen = 2;
  robot.Start();
  v1::RevertRequest request;
  request.set_map(test::kMap);
  request.set_revision(kThen);
  Revision reverted = 0;
  for (int i = 0; i < 3; ++i) {
    const absl::Status status =
        query::ReadStream(CallContext(), core->Revert(CallContext(), request),
                          [&](const v1::RevertResponse& message) {
                            reverted = message.revision();
                            return true;
                          });
    ASSERT_TRUE(status.ok()) << status;
    ASSERT_GT(reverted, 0);
    robot.Await(2);
  }
  robot.Stop();
  const auto reader = *(*GraphStore::Open(folder.path(), {}))->OpenMap(test::kMap);
  // For a moment the map was what it had been.
  const auto stats = (*reader->At(reverted))->Stats();
  EXPECT_EQ(stats->at.node_count, (*reader->At(kThen))->Stats()->at.node_count);
  EXPECT_EQ(stats->at.pose_count, (*reader->At(kThen))->Stats()->at.pose_count);
  ExpectThere(**reader->Latest(), robot, reverted);
  ExpectSound(folder.path(), test::kMap);
}

}  // namespace
}  // namespace dsg::query
