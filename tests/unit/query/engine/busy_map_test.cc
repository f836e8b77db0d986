// SPDX-License-Identifier: Apache-2.0
// Merges and reverts of a map to which a robot commits without a pause.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <set>
#include <thread>

#include "dsg/v1/ingest_service.pb.h"
#include "schema/codec/proto_convert.h"
#include "tests/unit/query/engine/two_halves.h"

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
  const auto report = (*(*GraphStore::Open(folder, {}))->OpenMap(map))->Verify(nullptr);
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_TRUE(report->problems.empty());
}

v1::MergeMapsRequest WestWithEast() {
  v1::MergeMapsRequest request;
  request.set_map("west");
  request.set_other("east");
  return request;
}

TEST(BusyMap, IsMergedAndLosesNothingOfTheRobot) {
  test::TwoHalves halves;
  const auto core = test::OpenCore(halves.folder());
  BusyRobot robot(core.get(), "west");
  robot.Start();
  v1::MergeMapsResponse last;
  const absl::Status merged =
      core->MergeMaps(CallContext(), WestWithEast(), [&](const v1::MergeMapsResponse& message) {
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
  const auto cursor = core->OpenMerge(WestWithEast());
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
    const absl::Status status = (*cursor)->Next(CallContext(), &message);
    ASSERT_TRUE(status.ok()) << status;
    for (const auto& [theirs, mine] : message.node_ids()) ids.insert(mine);
  }
  EXPECT_EQ(message.added_node_count(), added_count);
  EXPECT_FALSE(ids.contains(ToString(NodeId('O', largest + 1))));
  const auto west = test::Newest(store.get(), "west");
  EXPECT_EQ(west->GetNode(NodeId('O', largest + 1))->name, "thing");
  for (const std::string& id : ids) EXPECT_TRUE(west->ResolveNode(id).ok()) << id;
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
        core->Revert(CallContext(), request, [&](const v1::RevertResponse& message) {
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
