// SPDX-License-Identifier: Apache-2.0
// Two robots walk the two halves of an office; their maps become one. Prints the figures of each
// building; DSG_MERGE_SEEDS="11 12" names others than those that parameters were chosen on.
#include <gtest/gtest.h>

#include <chrono>
#include <cstdio>
#include <set>

#include "schema/merge/merge.h"
#include "schema/merge/merge_deltas.h"
#include "schema/merge/refine.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/schema/merge/perceived_half.h"

namespace dsg::merge {
namespace {

using test::Newest;
using test::PerceivedHalf;

struct Figures {
  double error_m = 0.0;
  double error_degrees = 0.0;
  int object_count = 0;
  int duplicate_count = 0;
  int wrong_count = 0;
  int missed_fusion_count = 0;
  int duplicate_rooms = 0;
  int wrong_rooms = 0;
  int gone_count = 0;
  double rival_share = 0.0;
  int agreeing_count = 0;
};

class Halves {
 public:
  Halves(simulator::WorldKind kind, uint64_t seed)
      : world_(test::MakeWorld(kind, seed)), store_(*GraphStore::Open(folder_.path(), {})) {
    test::PerceiveOptions first;
    first.to = 0.6;
    first.seed = 1000 + seed;
    west_ = test::Perceive(world_, first);
    test::PerceiveOptions second;
    second.from = 0.4;
    second.seed = 2000 + seed;
    second.map_T_world = test::SomeTransform(seed);
    east_ = test::Perceive(world_, second);
    test::StoreMap(store_.get(), "west", west_.delta);
    test::StoreMap(store_.get(), "east", east_.delta);
  }

  GraphStore* store() { return store_.get(); }
  const PerceivedHalf& west() const { return west_; }
  const PerceivedHalf& east() const { return east_; }

  Pose3d True() const { return east_.map_T_world.Inverse(); }

  absl::StatusOr<Alignment> Align() {
    return FindTransform(*Newest(store(), "west"), *Newest(store(), "east"), {}, {});
  }

  // The largest shift of a thing of the eastern half, and the turn.
  void Compare(const Alignment& alignment, Figures* figures) const {
    for (const Node& node : east_.delta.nodes) {
      const Eigen::Vector3d& at = node.map_T_node.position;
      figures->error_m =
          std::max(figures->error_m, (alignment.map_T_other * at - True() * at).norm());
    }
    figures->error_degrees =
        AngleBetween(alignment.map_T_other.orientation, True().orientation) * 57.2957795;
    figures->rival_share = alignment.rival_share;
    figures->agreeing_count = alignment.agreeing_count;
  }

  void Commit(MergePlan plan) {
    MergeDeltas deltas(Newest(store(), "west"), Newest(store(), "east"), std::move(plan), "test");
    auto writer = *store()->OpenWriter("west");
    while (true) {
      auto delta = deltas.Next({});
      ASSERT_TRUE(delta.ok()) << delta.status();
      if (!delta->has_value()) break;
      const auto result = writer->Commit(**std::move(delta));
      ASSERT_TRUE(result.ok()) << result.status();
    }
  }

  void Judge(const MergePlan& plan, Figures* figures) const {
    std::map<int, std::set<NodeId>> nodes_of_thing;
    std::map<NodeId, std::set<int>> things_of_node;
    const auto count = [&](NodeId mine, int thing) {
      nodes_of_thing[thing].insert(mine);
      things_of_node[mine].insert(thing);
    };
    for (const auto& [id, thing] : west_.thing_of) count(id, thing);
    for (const auto& [id, thing] : east_.thing_of) count(plan.node_ids.at(id), thing);
    figures->object_count = static_cast<int>(nodes_of_thing.size());
    for (const auto& [thing, nodes] : nodes_of_thing) {
      figures->duplicate_count += static_cast<int>(nodes.size()) - 1;
    }
    for (const auto& [node, things] : things_of_node) {
      figures->wrong_count += static_cast<int>(things.size()) - 1;
    }
    std::map<int, std::set<NodeId>> nodes_of_room;
    std::map<NodeId, std::set<int>> rooms_of_node;
    for (const auto& [id, room] : west_.room_of) {
      nodes_of_room[room].insert(id);
      rooms_of_node[id].insert(room);
    }
    for (const auto& [id, room] : east_.room_of) {
      nodes_of_room[room].insert(plan.node_ids.at(id));
      rooms_of_node[plan.node_ids.at(id)].insert(room);
    }
    for (const auto& [room, nodes] : nodes_of_room) {
      figures->duplicate_rooms += static_cast<int>(nodes.size()) - 1;
    }
    for (const auto& [node, rooms] : rooms_of_node) {
      figures->wrong_rooms += static_cast<int>(rooms.size()) - 1;
    }
    figures->gone_count = static_cast<int>(plan.counts.gone_count);
  }

 private:
  test::TempFolder folder_;
  simulator::World world_;
  std::unique_ptr<GraphStore> store_;
  PerceivedHalf west_;
  PerceivedHalf east_;
};

TEST(OfficeHalves, BecomeOneMapWithoutDuplicates) {
  for (const uint64_t seed : test::MergeSeeds({1, 2})) {
    SCOPED_TRACE(seed);
    Halves halves(simulator::WorldKind::kOffice, seed);
    const auto begin = std::chrono::steady_clock::now();
    const auto alignment = halves.Align();
    const auto end = std::chrono::steady_clock::now();
    ASSERT_TRUE(alignment.ok()) << alignment.status();
    Figures figures;
    halves.Compare(*alignment, &figures);
    auto plan = PlanMerge(*Newest(halves.store(), "west"), *Newest(halves.store(), "east"),
                          alignment->map_T_other, {}, {});
    ASSERT_TRUE(plan.ok()) << plan.status();
    halves.Judge(*plan, &figures);
    std::printf(
        "office %2d: error %.3f m %.3f deg, %d agree, rival %.2f, %.1f s; %d things, %d twice, "
        "%d confused, rooms %d twice %d confused, %d gone; fused %d objects %d places %d rooms\n",
        static_cast<int>(seed), figures.error_m, figures.error_degrees, figures.agreeing_count,
        figures.rival_share, std::chrono::duration<double>(end - begin).count(),
        figures.object_count, figures.duplicate_count, figures.wrong_count, figures.duplicate_rooms,
        figures.wrong_rooms, figures.gone_count, static_cast<int>(plan->counts.fused_object_count),
        static_cast<int>(plan->counts.fused_place_count),
        static_cast<int>(plan->counts.fused_room_count));
    EXPECT_LE(figures.error_m, 0.1);
    EXPECT_LE(figures.error_degrees, 1.0);
    EXPECT_LE(figures.duplicate_count, 0.02 * figures.object_count);
    EXPECT_EQ(figures.duplicate_rooms, 0);
    EXPECT_EQ(figures.wrong_rooms, 0);
    EXPECT_EQ(figures.gone_count, 0);
    halves.Commit(*std::move(plan));
    const auto report = (*halves.store()->OpenMap("west"))->Verify({}, {});
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_TRUE(report->problems.empty()) << report->problems.front();
  }
}

}  // namespace
}  // namespace dsg::merge
