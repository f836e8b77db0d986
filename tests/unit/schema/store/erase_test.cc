// SPDX-License-Identifier: Apache-2.0
// Things wiped out of all revisions: they are gone, the rest is as it was, and the map is sound.
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "tests/support/random_world.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/everything.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

using Texts = std::vector<std::string>;

// What each revision says of that which is not left out.
using Told = std::map<Revision, Texts>;

class EraseTest : public testing::TestWithParam<std::tuple<std::string, TrajectoryCodec>> {
 protected:
  EraseTest() : map_(std::get<0>(GetParam()), Spec(std::get<1>(GetParam()))) {}

  void WriteStream(int64_t from, int64_t to) {
    for (int64_t s = from; s <= to; ++s) map_.MustCommit(DeltaOfStream({.seed = 5}, s));
  }

  Told Tell(const std::function<bool(const Line&)>& is_left_out) {
    Told told;
    const Revision oldest = OrDie(map_.reader().OldestRevision());
    const Revision newest = OrDie(map_.reader().Head()).revision;
    for (Revision revision = oldest; revision <= newest; ++revision) {
      Texts& texts = told[revision];
      for (const Line& line : LinesOf(*map_.At(revision))) {
        if (!is_left_out(line)) texts.push_back(line.text);
      }
      std::sort(texts.begin(), texts.end());
    }
    return told;
  }

  EraseReport Erase(const Erasure& erasure) {
    const EraseReport report = OrDie(map_.writer().Erase(erasure, {}, {}));
    EXPECT_EQ(map_.reader().IsCurrent(), report.row_count == 0);
    EXPECT_TRUE(report.is_clean);
    map_.Close();
    map_.Reopen();
    return report;
  }

  void ExpectSame(const Told& before, const Told& after) {
    for (const auto& [revision, texts] : before) {
      SCOPED_TRACE(absl::StrCat("revision ", revision));
      const auto now = after.find(revision);
      ASSERT_NE(now, after.end());
      Texts missing;
      Texts added;
      std::set_difference(texts.begin(), texts.end(), now->second.begin(), now->second.end(),
                          std::back_inserter(missing));
      std::set_difference(now->second.begin(), now->second.end(), texts.begin(), texts.end(),
                          std::back_inserter(added));
      EXPECT_EQ(missing, Texts());
      EXPECT_EQ(added, Texts());
      EXPECT_EQ(WrongCounts(*map_.At(revision)), "");
      if (HasFailure()) return;
    }
    EXPECT_EQ(map_.Problems(), "");
  }

  TestMap map_;
};

std::function<bool(const Line&)> Names(std::set<NodeId> nodes) {
  return [nodes = std::move(nodes)](const Line& line) {
    return std::any_of(line.nodes.begin(), line.nodes.end(),
                       [&](NodeId id) { return nodes.contains(id); });
  };
}

GraphDelta Forget(const std::vector<NodeId>& nodes) {
  GraphDelta delta;
  for (const NodeId id : nodes) delta.retirements.push_back({id, std::nullopt});
  delta.is_forgetting = true;
  return delta;
}

bool Holds(const Told& told, const std::string& text) {
  return std::any_of(told.begin(), told.end(), [&](const auto& one) {
    return std::any_of(one.second.begin(), one.second.end(),
                       [&](const std::string& line) { return line.find(text) != line.npos; });
  });
}

TEST_P(EraseTest, TakesNodesThatAreGoneOutOfAllRevisions) {
  WriteStream(1, 36);
  const std::vector<NodeId> nodes = {NodeId('O', 5), NodeId('O', 7), NodeId('H', 3), NodeId('p', 4),
                                     NodeId('O', 1005)};
  GraphDelta delta = Forget({NodeId('O', 5), NodeId('O', 7), NodeId('H', 3), NodeId('p', 4)});
  for (const NodeId agent : {NodeId('H', 0), NodeId('H', 1), NodeId('H', 2), NodeId('H', 4)}) {
    for (Stay stay : OrDie(map_.Latest()->StaysOfAgent(agent, kTimeMin, kTimeMax))) {
      if (stay.place != NodeId('p', 4)) continue;
      stay.place = NodeId();
      delta.stays.push_back(stay);
    }
  }
  map_.MustCommit(delta);
  const auto is_named = Names({nodes.begin(), nodes.end()});
  const Told before = Tell(is_named);
  const EraseReport report = Erase({.nodes = nodes});
  EXPECT_GT(report.row_count, 20);
  EXPECT_GT(report.pose_count, 300);
  if (!map_.store().folder().empty()) {
    EXPECT_LT(report.bytes_after, report.bytes_before);
  }
  const Told after = Tell([](const Line&) { return false; });
  ExpectSame(before, after);
  for (const NodeId id : nodes) EXPECT_FALSE(Holds(after, " " + ToString(id) + " "));
}

TEST_P(EraseTest, LeavesANodeThatIsThereAsItIsNow) {
  WriteStream(1, 36);
  const std::vector<NodeId> nodes = {NodeId('O', 5), NodeId('R', 1)};
  GraphDelta renamed;
  Node room = OrDie(map_.Latest()->GetNode(NodeId('R', 1)));
  room.name = "a room";
  renamed.nodes.push_back(room);
  const Revision since = map_.MustCommit(renamed);
  const auto is_named = Names({nodes.begin(), nodes.end()});
  const Told before = Tell(is_named);
  const std::string now = OrDie(Dump(*map_.Latest()));
  Erase({.nodes = nodes});
  ExpectSame(before, Tell(is_named));
  EXPECT_EQ(OrDie(map_.Latest()->GetNode(NodeId('R', 1))).name, "a room");
  EXPECT_EQ(ReasonOf(map_.At(since - 1)->GetNode(NodeId('R', 1)).status()), Reason::kNodeUnknown);
  // Edges do not outlive their ends at any revision.
  for (Revision revision = 1; revision <= since; ++revision) {
    const auto snapshot = map_.At(revision);
    OrDie(snapshot->ScanEdges({}, std::nullopt, {}, [&](const Edge& edge) {
      EXPECT_TRUE(snapshot->GetNode(edge.source).ok()) << ToString(edge.source);
      EXPECT_TRUE(snapshot->GetNode(edge.target).ok()) << ToString(edge.target);
      return true;
    }));
  }
}

TEST_P(EraseTest, TakesSpansOfTracksOutOfThePast) {
  WriteStream(1, 36);
  const NodeId agent('H', 2);
  const TrackSpan span{agent, 20 * kSecond, 50 * kSecond};
  GraphDelta delta;
  delta.corrections.push_back({agent, span.from_ns, span.to_ns, {}});
  delta.shape_removals = {span};
  delta.factor_removals = {span};
  for (const Stay& stay : OrDie(map_.Latest()->StaysOfAgent(agent, span.from_ns, span.to_ns))) {
    delta.stay_removals.push_back({agent, stay.enter_ns});
  }
  map_.MustCommit(delta);
  WriteStream(37, 42);
  const auto is_within = [&](const Line& line) {
    if (line.nodes.empty() || line.nodes.front() != agent || line.time_ns == kTimeMin) return false;
    const bool is_stay = line.text.starts_with("stay") || line.text.starts_with("factor");
    const TimeNs early = is_stay ? 10 * kSecond : 0;
    return span.from_ns - early <= line.time_ns && line.time_ns < span.to_ns;
  };
  const auto in_span = [&](const Line& line) {
    return !line.nodes.empty() && line.nodes.front() == agent && span.from_ns <= line.time_ns &&
           line.time_ns < span.to_ns;
  };
  const Told before = Tell(is_within);
  const EraseReport report = Erase({.tracks = {span}});
  EXPECT_GT(report.pose_count, 100);
  ExpectSame(before, Tell(is_within));
  const Told all = Tell([](const Line&) { return false; });
  const Told rest = Tell(in_span);
  EXPECT_EQ(all, rest);
}

TEST_P(EraseTest, LeavesARevisionThatLosesAllItsPosesWithoutTheirTimes) {
  const NodeId agent('H', 1);
  GraphDelta first;
  first.nodes.push_back(MakeNode(agent, layers::kAgents, kinds::kHuman, "ann", Box3d()));
  GraphDelta second;
  for (int t = 0; t <= 20; ++t) {
    GraphDelta& delta = t <= 10 ? first : second;
    if (delta.appends.empty()) delta.appends.push_back({agent, {}});
    delta.appends.back().poses.push_back(PoseAt(t * kSecond, t, 0, 0));
  }
  map_.MustCommit(first);
  map_.MustCommit(second);
  // What is left begins in the segment that the first revision began.
  const TrackSpan span{agent, 0, 15 * kSecond};
  GraphDelta third;
  third.corrections.push_back({agent, span.from_ns, span.to_ns, {}});
  map_.MustCommit(third);
  Erase({.tracks = {span}});
  const MapStats lost = OrDie(map_.At(1)->Stats());
  EXPECT_EQ(lost.at.pose_count, 0);
  EXPECT_EQ(lost.first_pose_ns, std::nullopt);
  EXPECT_EQ(lost.last_pose_ns, std::nullopt);
  const MapStats kept = OrDie(map_.At(2)->Stats());
  EXPECT_EQ(kept.at.pose_count, 6);
  EXPECT_EQ(kept.first_pose_ns, 15 * kSecond);
  EXPECT_EQ(kept.last_pose_ns, 20 * kSecond);
}

TEST_P(EraseTest, TakesEdgesAndMeshBlocksOutOfThePast) {
  WriteStream(1, 36);
  GraphDelta delta;
  const EdgeKey edge{NodeId('p', 3), relations::kTraversable, NodeId('p', 4)};
  delta.edge_removals.push_back(edge);
  delta.mesh_removals.push_back({8, 0, 0});
  map_.MustCommit(delta);
  const auto is_named = [](const Line& line) {
    return line.text.starts_with("edge p3 TRAVERSABLE p4") || line.text.starts_with("mesh 8,0,0") ||
           line.text.starts_with("mesh 0,0,0");
  };
  const Told before = Tell(is_named);
  const Texts head_before = Tell([](const Line&) { return false; }).rbegin()->second;
  Erase({.edges = {edge}, .mesh_blocks = {{8, 0, 0}, {0, 0, 0}}});
  ExpectSame(before, Tell(is_named));
  const Told after = Tell([](const Line&) { return false; });
  EXPECT_FALSE(Holds(after, "edge p3 TRAVERSABLE p4"));
  EXPECT_FALSE(Holds(after, "mesh 8,0,0"));
  EXPECT_EQ(head_before, after.rbegin()->second);
}

TEST_P(EraseTest, WorksOnACompactedMapWithTagsAndBothGoOn) {
  WriteStream(1, 36);
  OrDie(map_.writer().SetTag("summer", 17, ""));
  OrDie(map_.writer().Compact(28, {}, {}));
  map_.MustCommit(Forget({NodeId('O', 5), NodeId('H', 1)}));
  const std::set<NodeId> nodes = {NodeId('O', 5), NodeId('H', 1)};
  const Told before = Tell(Names(nodes));
  Erase({.nodes = {nodes.begin(), nodes.end()}, .assets = true});
  ExpectSame(before, Tell([](const Line&) { return false; }));
  EXPECT_EQ(WrongCounts(*map_.At(17)), "");
  // Agent 1 comes again, as one that was never there.
  GraphDelta again;
  again.nodes.push_back(MakeHuman(1, "another"));
  map_.MustCommit(again);
  map_.MustCommit(DeltaOfPoses(NodeId('H', 1), {PoseAt(kSecond, 1, 2, 3)}));
  EXPECT_EQ(OrDie(map_.Latest()->GetTrack(NodeId('H', 1))).pose_count, 1);
  WriteStream(37, 45);
  OrDie(map_.writer().Compact(39, {}, {}));
  EXPECT_EQ(map_.Problems(), "");
}

// Some nodes that go, some that stay, a span of a track that stays; perhaps in a compacted map.
TEST_P(EraseTest, OfRandomThingsInRandomWorldsLeavesTheRest) {
  RandomWorld world(TestSeed(31));
  NaiveMap naive;
  for (int i = 0; i < 45; ++i) {
    GraphDelta delta = i == 0 ? world.First() : world.Next(naive);
    naive.Apply(delta);
    delta.map = kMap;
    OrDie(map_.writer().Commit(std::move(delta)));
  }
  if (world.Int(0, 1) == 0) {
    OrDie(map_.writer().SetTag("summer", world.Int(2, 20), ""));
    OrDie(map_.writer().Compact(world.Int(21, 45), {}, {}));
  }
  std::vector<NodeId> gone;
  std::set<NodeId> named;
  for (const auto& [id, node] : naive.nodes) {
    const bool is_agent = IsAgentKind(node.kind);
    if (world.Int(0, 3) != 0 || node.kind == kinds::kRoom || id == RandomWorld::Person(0)) continue;
    named.insert(id);
    if (is_agent || world.Int(0, 1) == 0) gone.push_back(id);
  }
  GraphDelta delta = Forget(gone);
  TrackSpan span{RandomWorld::Person(0), kTimeMin, kTimeMax};
  const TrackInfo track = OrDie(map_.Latest()->GetTrack(span.agent));
  if (track.pose_count > 0) {
    span.from_ns = world.Int(track.first_ns, track.last_ns);
    span.to_ns = span.from_ns + world.Int(1, 60) * kSecond;
    delta.corrections.push_back({span.agent, span.from_ns, span.to_ns, {}});
  }
  map_.MustCommit(delta);
  const auto is_touched = [&](const Line& line) {
    if (Names(named)(line)) return true;
    const bool is_of_agent = !line.nodes.empty() && line.nodes.front() == span.agent;
    return is_of_agent && (line.text.starts_with("stay") ||
                           (span.from_ns <= line.time_ns && line.time_ns < span.to_ns));
  };
  const Told before = Tell(is_touched);
  Erase({.nodes = {named.begin(), named.end()}, .tracks = {span}});
  ExpectSame(before, Tell(is_touched));
  const Told after = Tell([](const Line&) { return false; });
  for (const NodeId id : gone) EXPECT_FALSE(Holds(after, " " + ToString(id) + " "));
}

TEST_P(EraseTest, IsSoundWhereverItIsStoppedAndGoesOn) {
  WriteStream(1, 40);
  std::vector<NodeId> nodes = {NodeId('H', 3)};
  for (uint64_t i = 0; i < 30; ++i) nodes.push_back(NodeId('O', i));
  map_.MustCommit(Forget(nodes));
  for (int steps = 0;; ++steps) {
    int left = steps;
    const auto report = map_.writer().Erase(
        {.nodes = nodes, .assets = true},
        [&] { return left-- > 0 ? absl::OkStatus() : absl::CancelledError("enough"); }, {});
    EXPECT_EQ(map_.Problems(), "") << "stopped after " << steps << " steps";
    map_.MustCommit(GraphDelta());
    if (report.ok()) break;
    ASSERT_EQ(report.status().code(), absl::StatusCode::kCancelled);
    ASSERT_LT(steps, 1000);
  }
}

TEST_P(EraseTest, IsNoticedByReadersThatHoldASnapshot) {
  WriteStream(1, 10);
  map_.MustCommit(Forget({NodeId('O', 5)}));
  const auto old = map_.At(9);
  const auto newest = map_.Latest();
  OrDie(map_.writer().Erase({.nodes = {NodeId('O', 5)}}, {}, {}));
  for (const auto& snapshot : {old, newest}) {
    EXPECT_EQ(ReasonOf(snapshot->GetNode(NodeId('O', 5)).status()), Reason::kMapReplaced);
    EXPECT_EQ(ReasonOf(snapshot->MeshBlocks().status()), Reason::kMapReplaced);
  }
}

TEST_P(EraseTest, RefusesAgentsThatAreThere) {
  WriteStream(1, 10);
  const auto refused = map_.writer().Erase({.nodes = {NodeId('O', 5), NodeId('H', 1)}}, {}, {});
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kFieldInvalid) << refused.status();
  EXPECT_TRUE(map_.reader().Head().ok());
  EXPECT_TRUE(map_.reader().IsCurrent());
}

TEST_P(EraseTest, OfNothingAndOfWhatNeverWasChangesNoAnswer) {
  WriteStream(1, 20);
  const Told before = Tell([](const Line&) { return false; });
  Erase({});
  Erase({.nodes = {NodeId('O', 999'999)},
         .edges = {{NodeId('p', 1), "NEVER", NodeId('p', 9)}},
         .mesh_blocks = {{99, 99, 99}},
         .tracks = {{NodeId('H', 77), 0, kTimeMax}}});
  ExpectSame(before, Tell([](const Line&) { return false; }));
}

INSTANTIATE_TEST_SUITE_P(EveryBackend, EraseTest,
                         testing::Combine(testing::ValuesIn(Backends()),
                                          testing::Values(TrajectoryCodec::kLossless,
                                                          TrajectoryCodec::kQuantized)),
                         NameOfBackendAndCodec);

}  // namespace
}  // namespace dsg::test
