// SPDX-License-Identifier: Apache-2.0
#include "query/engine/walk_area.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iostream>
#include <string>
#include <thread>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/read.pb.h"
#include "dsg/v1/space.pb.h"
#include "schema/base/random.h"
#include "tests/unit/query/engine/office.h"

namespace dsg::test {
namespace {

constexpr uint64_t kSeed = 11;
constexpr int kColumnCount = 40;
constexpr int kRowCount = 14;
constexpr double kSpacingM = 1.5;
constexpr int kWalkerCount = 3;
constexpr TimeNs kBeginNs = 100 * kSecond;

// A floor of places over several tiles; some places, links and chairs are there for a while only.
class RandomFloor {
 public:
  RandomFloor() : random_(kSeed, 0) {}

  GraphDelta First() {
    GraphDelta delta;
    delta.author = "test";
    for (uint64_t room = 20; room < 24; ++room) {
      delta.nodes.push_back(MakeNode(NodeId('R', room), layers::kRooms, kinds::kRoom, "", Box3d()));
    }
    for (int i = 0; i < kColumnCount * kRowCount; ++i) AddPlace(i, &delta);
    for (int i = 0; i < kColumnCount * kRowCount; ++i) {
      if ((i + 1) % kColumnCount != 0) AddLink(i, i + 1, &delta);
      if (i + kColumnCount < kColumnCount * kRowCount) AddLink(i, i + kColumnCount, &delta);
    }
    AddChairs(&delta);
    for (uint64_t walker = 0; walker < kWalkerCount; ++walker) AddWalker(walker, &delta);
    return delta;
  }

  /// The same places with chairs elsewhere.
  GraphDelta OtherChairs() {
    GraphDelta delta;
    delta.author = "test";
    AddChairs(&delta);
    return delta;
  }

  GraphDelta OtherPlaces() {
    GraphDelta delta;
    delta.author = "test";
    for (int i = 0; i < 20; ++i) AddPlace(random_.Index(kColumnCount * kRowCount), &delta);
    return delta;
  }

  Random* random() { return &random_; }

 private:
  static Eigen::Vector3d PositionOf(int i) {
    return {200.0 + kSpacingM * (i % kColumnCount), 200.0 + kSpacingM * (i / kColumnCount), 1.0};
  }

  static NodeId PlaceId(int i) { return NodeId('p', 1000 + static_cast<uint64_t>(i)); }

  // For ever, mostly.
  Interval AnyValidity() {
    if (random_.Chance(0.9)) return {};
    const TimeNs from_ns = kBeginNs + random_.Integer(-10, 30) * kSecond;
    return {from_ns, random_.Chance(0.5) ? kTimeMax : from_ns + random_.Integer(1, 20) * kSecond};
  }

  void AddPlace(int i, GraphDelta* delta) {
    const Eigen::Vector3d centre = PositionOf(i);
    Node node = MakeNode(PlaceId(i), layers::kPlaces, kinds::kPlace, "",
                         Box3d(centre, centre + Eigen::Vector3d::Constant(1e-3)));
    node.place = PlaceInfo();
    node.place->clearance_m = random_.Uniform(0.3, 1.2);
    node.valid = AnyValidity();
    delta->nodes.push_back(std::move(node));
    const uint64_t room = 20 + static_cast<uint64_t>((i % kColumnCount) / 10);
    delta->edges.push_back({});
    delta->edges.back().source = NodeId('R', room);
    delta->edges.back().relation = relations::kContains;
    delta->edges.back().target = PlaceId(i);
  }

  void AddLink(int a, int b, GraphDelta* delta) {
    if (random_.Chance(0.15)) return;
    Edge edge;
    edge.source = PlaceId(a);
    edge.relation = relations::kTraversable;
    edge.target = PlaceId(b);
    edge.weight = random_.Uniform(0.2, 0.5);
    edge.valid = AnyValidity();
    delta->edges.push_back(edge);
  }

  void AddChairs(GraphDelta* delta) {
    for (uint64_t i = 0; i < 30; ++i) {
      const Eigen::Vector3d at = PositionOf(random_.Index(kColumnCount * kRowCount));
      Node node = MakeNode(NodeId('O', 100 + i), layers::kObjects, kinds::kObject, "",
                           Box3d(at, at + Eigen::Vector3d::Constant(0.5)));
      node.class_name = random_.Chance(0.5) ? "chair" : "plant";
      node.valid = AnyValidity();
      delta->nodes.push_back(std::move(node));
    }
  }

  void AddWalker(uint64_t walker, GraphDelta* delta) {
    const NodeId id('H', 30 + walker);
    delta->nodes.push_back(
        MakeNode(id, layers::kAgents, kinds::kHuman, absl::StrCat("walker", walker), Box3d()));
    TrajectoryAppend track{id, {}};
    Eigen::Vector3d at = PositionOf(random_.Index(kColumnCount * kRowCount));
    Eigen::Vector3d step(0.2, 0.0, 0.0);
    for (int i = 0; i < 150; ++i) {
      if (i % 20 == 0) {
        const double angle = random_.Uniform(-M_PI, M_PI);
        step = 0.25 * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0.0);
      }
      at = (at + step).cwiseMax(PositionOf(0)).cwiseMin(PositionOf(kColumnCount * kRowCount - 1));
      track.poses.push_back(PoseAt(kBeginNs + i * (kSecond / 5), at.x(), at.y(), 1.0));
    }
    delta->appends.push_back(track);
  }

  Random random_;
};

class WalkAreas : public testing::Test {
 protected:
  WalkAreas() {
    MakeOffice(folder_.path());
    CommitToOffice(folder_.path(), floor_.First());
    CommitToOffice(folder_.path(), floor_.OtherChairs());
    CommitToOffice(folder_.path(), floor_.OtherPlaces());
  }

  v1::PredictAgentRequest AnyQuestion() {
    Random* random = floor_.random();
    v1::PredictAgentRequest request;
    request.set_map(kMap);
    request.set_agent(absl::StrCat("walker", random->Index(kWalkerCount)));
    request.set_from_ns(kBeginNs + random->Integer(0, 320) * (kSecond / 10));
    request.set_horizon_ns(random->Integer(1, 150) * (kSecond / 10));
    request.set_path_count_max(random->Integer(1, 20));
    request.mutable_read_at()->set_exact_revision(random->Integer(2, 4));
    return request;
  }

  static std::string Answer(query::ServiceCore* core, const v1::PredictAgentRequest& request) {
    v1::PredictAgentResponse reply;
    const absl::Status status = core->PredictAgent(query::CallContext(), request, &reply);
    return status.ok() ? reply.SerializeAsString() : status.ToString();
  }

  /// Of a plain store, so that a cache can be looked at.
  std::shared_ptr<const query::GraphView> View(Revision revision) {
    if (store_ == nullptr) {
      store_ = *GraphStore::Open(folder_.path(), {});
      map_ = *store_->OpenMap(kMap);
    }
    const auto snapshot = *map_->At(revision);
    return *query::GraphView::Load(*snapshot, std::make_shared<query::SymbolTable>(), StopCheck());
  }

  TempFolder folder_;
  RandomFloor floor_;
  std::unique_ptr<GraphStore> store_;
  std::shared_ptr<MapReader> map_;
};

constexpr double kReachM = 25.0;

TEST_F(WalkAreas, GiveTheSameAnswerWhetherTheyWereKeptOrNot) {
  std::cout << "seed " << kSeed << "\n";
  const auto kept = OpenCore(folder_.path());
  int foreseen_count = 0;
  for (int i = 0; i < 1000; ++i) {
    const v1::PredictAgentRequest request = AnyQuestion();
    const std::string answer = Answer(kept.get(), request);
    ASSERT_EQ(answer, Answer(OpenCore(folder_.path()).get(), request))
        << "question " << i << ": " << request.ShortDebugString();
    v1::PredictAgentResponse reply;
    foreseen_count += reply.ParseFromString(answer) && reply.model() == v1::GOALS;
  }
  EXPECT_GT(foreseen_count, 500);
}

TEST_F(WalkAreas, AreMadeOnceATileAndWhileNothingChanges) {
  query::WalkAreaCache cache;
  const auto view = View(4);
  const Eigen::Vector3d here(230.0, 210.0, 1.0);
  const auto area = *cache.Get(view, here, kReachM, kBeginNs, {});
  EXPECT_GT(area->goal_nodes.size(), 10u);
  EXPECT_TRUE(area->valid.Contains(kBeginNs));
  EXPECT_EQ(*cache.Get(view, here + Eigen::Vector3d(2.0, 3.0, 0.5), kReachM, kBeginNs, {}), area);
  EXPECT_EQ(*cache.Get(view, here, kReachM, area->valid.to_ns - 1, {}), area);
  EXPECT_NE(*cache.Get(view, here, kReachM, area->valid.to_ns, {}), area);
  EXPECT_NE(*cache.Get(view, here + Eigen::Vector3d(20.0, 0.0, 0.0), kReachM, kBeginNs, {}), area);
  EXPECT_NE(*cache.Get(view, here, 40.0, kBeginNs, {}), area);
  EXPECT_EQ(cache.stats().hit_count, 2);
  EXPECT_EQ(cache.stats().made_count, 4);
}

TEST_F(WalkAreas, HoldWhatIsThereAtTheInstant) {
  const auto view = View(4);
  const auto places = *view->Places({});
  Random random(kSeed, 1);
  for (int i = 0; i < 50; ++i) {
    const TimeNs at_ns = kBeginNs + random.Integer(-20, 50) * kSecond;
    const query::WalkTile tile = query::TileOf({230.0, 210.0, 1.0}, kReachM);
    const query::WalkGrounds grounds = *query::MakeWalkGrounds(*places, tile, at_ns, {});
    EXPECT_TRUE(grounds.valid.Contains(at_ns));
    // At either end of the interval it is the same, beyond it is not.
    for (const TimeNs same_ns : {grounds.valid.from_ns, grounds.valid.to_ns - 1}) {
      const query::WalkGrounds same = *query::MakeWalkGrounds(*places, tile, same_ns, {});
      EXPECT_EQ(same.places, grounds.places);
      EXPECT_EQ(same.field.graph().links, grounds.field.graph().links);
    }
    for (const query::PlaceIndex place : grounds.places) {
      EXPECT_TRUE(places->valid(place).Contains(at_ns));
    }
  }
}

TEST_F(WalkAreas, AreWholeOrNotThere) {
  const auto view = View(4);
  const Eigen::Vector3d here(230.0, 210.0, 1.0);
  query::WalkAreaCache plain;
  const auto expected = *plain.Get(view, here, kReachM, kBeginNs, {});
  query::WalkAreaCache cache;
  for (int asked_max = 0;; ++asked_max) {
    int asked = 0;
    const StopCheck stop = [&] {
      return asked++ < asked_max ? absl::OkStatus() : absl::CancelledError("enough");
    };
    const auto area = cache.Get(view, here, kReachM, kBeginNs, stop);
    if (area.ok()) {
      EXPECT_GT(asked_max, 3);
      EXPECT_EQ((*area)->goal_nodes, expected->goal_nodes);
      EXPECT_EQ((*area)->field.graph().links, expected->field.graph().links);
      break;
    }
    EXPECT_TRUE(absl::IsCancelled(area.status()));
    EXPECT_EQ(cache.stats().area_count, 0);
  }
  EXPECT_EQ(cache.stats().made_count, 1);
}

TEST_F(WalkAreas, ShareThePlacesOfRevisionsWithoutOtherPlaces) {
  query::WalkAreaCache cache;
  const auto before = View(2);
  const auto after = *query::GraphView::Derive(before, map_.get(), **map_->At(3), StopCheck());
  ASSERT_EQ(*before->Places({}), *after->Places({}));
  const Eigen::Vector3d here(230.0, 210.0, 1.0);
  const auto first = *cache.Get(before, here, kReachM, kBeginNs, {});
  const auto second = *cache.Get(after, here, kReachM, kBeginNs, {});
  EXPECT_EQ(cache.stats().shared_count, 1);
  EXPECT_EQ(&first->field.graph(), &second->field.graph());
  EXPECT_NE(first->goal_nodes, second->goal_nodes);
}

TEST_F(WalkAreas, StayWithinTheirMemoryAndForgetGraphsThatAreGone) {
  const auto view = View(4);
  const Eigen::Vector3d here(230.0, 210.0, 1.0);
  query::WalkAreaCache small(1'000'000);
  for (int i = 0; i < 40; ++i) {
    ASSERT_TRUE(small.Get(view, here, kReachM, kBeginNs + (i - 10) * kSecond, {}).ok());
    EXPECT_TRUE(small.stats().bytes <= 1'000'000 || small.stats().area_count == 1);
  }
  EXPECT_LT(small.stats().area_count, small.stats().made_count);
  query::WalkAreaCache cache;
  ASSERT_TRUE(cache.Get(View(3), here, kReachM, kBeginNs, {}).ok());
  ASSERT_TRUE(cache.Get(view, here, kReachM, kBeginNs, {}).ok());
  EXPECT_EQ(cache.stats().area_count, 1);
}

TEST_F(WalkAreas, AnswerManyAtOnce) {
  const auto core = OpenCore(folder_.path());
  std::vector<v1::PredictAgentRequest> questions;
  std::vector<std::string> answers;
  for (int i = 0; i < 24; ++i) {
    questions.push_back(AnyQuestion());
    answers.push_back(Answer(OpenCore(folder_.path()).get(), questions.back()));
  }
  std::vector<std::thread> threads;
  for (size_t t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (size_t i = 0; i < questions.size(); ++i) {
        const size_t at = (i + 6 * t) % questions.size();
        EXPECT_EQ(Answer(core.get(), questions[at]), answers[at]);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace dsg::test
