// SPDX-License-Identifier: Apache-2.0
// What forgetting asks of the store: removals that old revisions do not see, corrections that touch
// no more than they must, models that are stored once.
#include <gtest/gtest.h>
#include <openssl/sha.h>

#include <cmath>
#include <cstdio>
#include <map>

#include "absl/strings/str_cat.h"
#include "schema/base/random.h"
#include "tests/unit/schema/retention/prune_test_util.h"

namespace dsg::test {
namespace {

std::vector<TimedPose> Walk(int count) {
  std::vector<TimedPose> poses;
  for (int i = 0; i < count; ++i) {
    poses.push_back(PoseAt(i * kSecond / 10, 0.01 * i, 0.1 * (i % 7), 1.0));
  }
  return poses;
}

TEST(Correction, OfTheBeginningOfALongTrackLeavesTheRestOfIt) {
  for (const auto codec : {TrajectoryCodec::kLossless, TrajectoryCodec::kQuantized}) {
    TestMap map(Spec(codec));
    map.MustCommit(DeltaOfNodes({MakeHuman(1, "walker")}));
    map.MustCommit(DeltaOfPoses(kWalker, Walk(20'000)));
    GraphDelta delta;
    delta.corrections = {{kWalker, 10 * kSecond, 20 * kSecond, {}}};
    map.MustCommit(std::move(delta));
    EXPECT_EQ(OrDie(map.Latest()->GetTrack(kWalker)).pose_count, 19'900);
    // The hole is wider than the gap; the box of what follows still finds the way into it.
    EXPECT_EQ(OrDie(map.Latest()->Locate(kWalker, 15 * kSecond)).quality, PoseQuality::kInGap);
    EXPECT_EQ(OrDie(map.At(2)->Locate(kWalker, 15 * kSecond)).quality, PoseQuality::kExact);
    EXPECT_EQ(map.Problems(), "");
    const CompactReport report = OrDie(map.writer().Compact(3, StopCheck(), Progress()));
    EXPECT_LE(report.row_count, 8);
    EXPECT_EQ(map.Problems(), "");
  }
}

// Shapes and factors kept the naive way.
struct NaiveBatches {
  std::map<TimeNs, float> shapes;
  std::vector<std::pair<TimeNs, TimeNs>> factors;
};

class BatchWorld {
 public:
  BatchWorld(uint64_t seed, uint64_t stream) : random_(seed, stream) {}

  GraphDelta Next() {
    GraphDelta delta;
    if (random_.Chance(0.6)) AddShapes(&delta);
    if (random_.Chance(0.6)) AddFactors(&delta);
    if (random_.Chance(0.5)) Remove(&delta);
    Apply(delta);
    return delta;
  }

  const NaiveBatches& now() const { return now_; }

 private:
  void AddShapes(GraphDelta* delta) {
    ShapeAppend append{kWalker, std::nullopt, {}};
    TimeNs time_ns = random_.Integer(0, 200) * kSecond;
    for (int i = random_.Integer(1, 80); i > 0; --i) {
      BodyShape shape;
      shape.time_ns = time_ns;
      shape.joints = {0.001f * static_cast<float>(++value_), 0.0f, 0.0f};
      append.shapes.push_back(shape);
      time_ns += random_.Integer(1, 3) * kSecond;
    }
    delta->shapes.push_back(append);
  }

  void AddFactors(GraphDelta* delta) {
    FactorAppend append{kWalker, {}};
    for (int i = random_.Integer(1, 30); i > 0; --i) {
      const TimeNs from_ns = random_.Integer(0, 400) * kSecond;
      const TimeNs to_ns = random_.Integer(0, 400) * kSecond;
      append.factors.push_back(
          {"odometry", std::min(from_ns, to_ns), std::max(from_ns, to_ns), {}, {}, {}});
    }
    delta->factors.push_back(append);
  }

  void Remove(GraphDelta* delta) {
    for (auto* spans : {&delta->shape_removals, &delta->factor_removals}) {
      for (int i = random_.Integer(0, 2); i > 0; --i) {
        const TimeNs from_ns = random_.Integer(-10, 400) * kSecond;
        spans->push_back({kWalker, from_ns, from_ns + random_.Integer(1, 60) * kSecond});
      }
    }
  }

  void Apply(const GraphDelta& delta) {
    for (const TrackSpan& span : delta.shape_removals) {
      std::erase_if(now_.shapes, [&](const auto& shape) {
        return span.from_ns <= shape.first && shape.first < span.to_ns;
      });
    }
    for (const TrackSpan& span : delta.factor_removals) {
      std::erase_if(now_.factors, [&](const auto& factor) {
        const auto holds = [&](TimeNs t) { return span.from_ns <= t && t < span.to_ns; };
        return holds(factor.first) || holds(factor.second);
      });
    }
    for (const ShapeAppend& append : delta.shapes) {
      for (const BodyShape& shape : append.shapes) now_.shapes[shape.time_ns] = shape.joints[0];
    }
    for (const FactorAppend& append : delta.factors) {
      for (const PoseFactor& factor : append.factors) {
        now_.factors.emplace_back(factor.from_ns, factor.to_ns);
      }
    }
  }

  Random random_;
  NaiveBatches now_;
  int value_ = 0;
};

void ExpectSame(const Snapshot& map, const NaiveBatches& naive) {
  std::map<TimeNs, float> shapes;
  for (const BodyShape& shape : OrDie(map.Shapes(kWalker, kTimeMin, kTimeMax))) {
    ASSERT_TRUE(shapes.emplace(shape.time_ns, shape.joints[0]).second);
  }
  EXPECT_EQ(shapes, naive.shapes);
  std::vector<std::pair<TimeNs, TimeNs>> factors;
  for (const PoseFactor& factor : OrDie(map.Factors(kWalker, kTimeMin, kTimeMax))) {
    factors.emplace_back(factor.from_ns, factor.to_ns);
  }
  auto expected = naive.factors;
  std::sort(factors.begin(), factors.end());
  std::sort(expected.begin(), expected.end());
  EXPECT_EQ(factors, expected);
}

TEST(Removals, OfShapesAndFactorsAreAsNaiveOnesAtEveryRevision) {
  const uint64_t seed = TestSeed(65);
  for (uint64_t stream = 0; stream < 6; ++stream) {
    SCOPED_TRACE(stream);
    TestMap map;
    map.MustCommit(DeltaOfNodes({MakeHuman(1, "walker")}));
    BatchWorld world(seed, stream);
    std::map<Revision, NaiveBatches> then;
    for (int i = 0; i < 25; ++i) then[map.MustCommit(world.Next())] = world.now();
    for (const auto& [revision, naive] : then) ExpectSame(*map.At(revision), naive);
    ASSERT_EQ(map.Problems(), "");
    OrDie(map.writer().Compact(20, StopCheck(), Progress()));
    for (auto it = then.find(20); it != then.end(); ++it)
      ExpectSame(*map.At(it->first), it->second);
    ASSERT_EQ(map.Problems(), "");
    // Gone, they leave shapes and factors behind at no later revision, even under the same id.
    GraphDelta gone;
    gone.retirements = {{kWalker, std::nullopt}};
    map.MustCommit(std::move(gone));
    map.MustCommit(DeltaOfNodes({MakeHuman(1, "another")}));
    ExpectSame(*map.Latest(), NaiveBatches());
    ASSERT_EQ(map.Problems(), "");
  }
}

TEST(Removals, OfStaysLeaveOldRevisionsAsTheyWere) {
  TestMap map;
  FillHouse(&map);
  GraphDelta delta;
  delta.stay_removals = {{kWalker, 0}, {kWalker, 12345}};
  map.MustCommit(std::move(delta));
  EXPECT_EQ(OrDie(map.Latest()->StaysOfAgent(kWalker, kTimeMin, kTimeMax)).size(), 2u);
  EXPECT_EQ(OrDie(map.At(1)->StaysOfAgent(kWalker, kTimeMin, kTimeMax)).size(), 3u);
  EXPECT_EQ(map.Problems(), "");
}

constexpr TimeNs kYear2023Ns = 1'700'000'000'000'000'000;

int64_t BytesWith(int chair_count, size_t model_bytes) {
  TestMap map(Spec(TrajectoryCodec::kQuantized));
  Asset model;
  model.media_type = "model/gltf-binary";
  Random random(9, 0);
  for (size_t i = 0; i < model_bytes; ++i) {
    model.content.push_back(static_cast<char>(random.Index(256)));
  }
  SHA256(reinterpret_cast<const uint8_t*>(model.content.data()), model.content.size(),
         model.sha256.data());
  GraphDelta delta;
  delta.assets = {model};
  for (int i = 1; i <= chair_count; ++i) {
    const double x = 0.7 * (i % 100);
    const double y = 0.7 * (i / 100);
    Node chair = MakeObject(static_cast<uint64_t>(i), absl::StrCat("chair ", i),
                            BoxOf(x, y, 0, x + 0.5, y + 0.5, 0.9));
    chair.class_id = 7;
    chair.class_name = "chair";
    // Turned about z as things stand on a floor; the model is registered elsewhere than the box.
    const double half_angle = 0.01 * i;
    chair.map_T_node.orientation = {std::cos(half_angle), 0, 0, std::sin(half_angle)};
    chair.object = ObjectInfo();
    chair.object->model = model.sha256;
    chair.object->map_T_model = chair.map_T_node;
    chair.object->map_T_model.position += Eigen::Vector3d(0.013, -0.021, -0.45);
    chair.object->registration_residual_m = 0.01;
    chair.observation_count = 12;
    chair.first_observed_ns = kYear2023Ns + i * kSecond;
    chair.last_observed_ns = kYear2023Ns + (i + 90) * kSecond;
    delta.nodes.push_back(chair);
  }
  map.MustCommit(std::move(delta));
  map.Close();
  map.Reopen();
  return OrDie(map.Latest()->Stats()).bytes_on_disk;
}

TEST(Chairs, OfOneModelCostTheModelOnceAndLittleEach) {
  constexpr size_t kModelBytes = 1'000'000;
  constexpr int kCount = 2'000;
  const int64_t empty = BytesWith(0, 0);
  const int64_t model = BytesWith(0, kModelBytes) - empty;
  const int64_t each = (BytesWith(kCount, kModelBytes) - empty - model) / kCount;
  std::printf("model of %zu bytes: %lld on disk; each of %d chairs: %lld bytes\n", kModelBytes,
              static_cast<long long>(model), kCount, static_cast<long long>(each));
  EXPECT_LE(model, static_cast<int64_t>(kModelBytes) * 103 / 100);
  // With its entries in all indexes.
  EXPECT_LE(each, 300);
}

}  // namespace
}  // namespace dsg::test
