// SPDX-License-Identifier: Apache-2.0
// Body shapes in a store: who is believed at which revision, in how many bytes, found by time.
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>

#include "schema/codec/checksum.h"
#include "schema/codec/shape_codec.h"
#include "tests/unit/schema/codec/body_meshes.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

constexpr TimeNs kPeriodNs = 200'000'000;

// A body whose one joint says which estimate it is.
BodyShape Estimate(TimeNs time_ns, float number) {
  BodyShape shape;
  shape.time_ns = time_ns;
  shape.joints = {number, 0.0f, 0.0f};
  return shape;
}

GraphDelta DeltaOfShapes(std::vector<BodyShape> shapes) {
  GraphDelta delta;
  delta.shapes = {{kAnn, std::nullopt, std::move(shapes)}};
  return delta;
}

// "10=1 20=2": times and numbers.
std::string NumbersOf(const Snapshot& snapshot, TimeNs from_ns = kTimeMin,
                      TimeNs to_ns = kTimeMax) {
  std::string text;
  OrDie(snapshot.ReadShapes(kAnn, from_ns, to_ns, true, StopCheck(), [&](const ShownShape& shown) {
    if (!text.empty()) text += ' ';
    text += std::to_string(shown.shape.time_ns) + "=" +
            std::to_string(std::lround(shown.shape.joints[0]));
    return true;
  }));
  return text;
}

class Shapes : public testing::TestWithParam<std::tuple<std::string, TrajectoryCodec>> {
 protected:
  Shapes() : map_(std::get<0>(GetParam()), Spec(std::get<1>(GetParam()))) {
    map_.MustCommit(DeltaOfNodes({MakeHuman(1, "ann")}));
  }
  TestMap map_;
};

INSTANTIATE_TEST_SUITE_P(EveryBackend, Shapes,
                         testing::Combine(testing::ValuesIn(Backends()),
                                          testing::Values(TrajectoryCodec::kQuantized,
                                                          TrajectoryCodec::kLossless)),
                         NameOfBackendAndCodec);

TEST_P(Shapes, OfALaterRevisionReplaceThoseOfTheSameTimeAndOldRevisionsKeepTheirs) {
  const Revision first = map_.MustCommit(
      DeltaOfShapes({Estimate(10, 1), Estimate(20, 1), Estimate(30, 1), Estimate(40, 1)}));
  const Revision second = map_.MustCommit(DeltaOfShapes({Estimate(20, 2), Estimate(30, 2)}));
  const Revision third = map_.MustCommit(DeltaOfShapes({Estimate(25, 3), Estimate(30, 3)}));
  EXPECT_EQ(NumbersOf(*map_.At(first - 1)), "");
  EXPECT_EQ(NumbersOf(*map_.At(first)), "10=1 20=1 30=1 40=1");
  EXPECT_EQ(NumbersOf(*map_.At(second)), "10=1 20=2 30=2 40=1");
  EXPECT_EQ(NumbersOf(*map_.At(third)), "10=1 20=2 25=3 30=3 40=1");
  EXPECT_EQ(NumbersOf(*map_.Latest(), 20, 30), "20=2 25=3");
  EXPECT_EQ(NumbersOf(*map_.Latest(), 21, 25), "");
  EXPECT_EQ(map_.Problems(), "");
}

TEST_P(Shapes, SaidTwiceInOneDeltaAreThoseSaidLast) {
  GraphDelta delta = DeltaOfShapes({Estimate(10, 1), Estimate(20, 1)});
  delta.shapes.push_back({kAnn, std::nullopt, {Estimate(5, 2), Estimate(20, 2)}});
  map_.MustCommit(delta);
  EXPECT_EQ(NumbersOf(*map_.Latest()), "5=2 10=1 20=2");
}

TEST_P(Shapes, OnTwoTopologiesKeepEachItsOwn) {
  const auto asset = [](const std::string& content) {
    return Asset{ComputeSha256(content), "application/x-topology", content};
  };
  GraphDelta delta;
  delta.assets = {asset("one"), asset("two")};
  delta.shapes = {{kAnn, asset("one").sha256, {Estimate(10, 1), Estimate(30, 1)}},
                  {kAnn, asset("two").sha256, {Estimate(20, 2)}}};
  map_.MustCommit(delta);
  std::vector<std::optional<Sha256>> topologies;
  OrDie(map_.Latest()->ReadShapes(kAnn, kTimeMin, kTimeMax, false, StopCheck(),
                                  [&](const ShownShape& shown) {
                                    topologies.push_back(shown.topology);
                                    return true;
                                  }));
  EXPECT_EQ(topologies, (std::vector<std::optional<Sha256>>{
                            asset("one").sha256, asset("two").sha256, asset("one").sha256}));
  EXPECT_EQ(map_.Problems(), "");
}

TEST_P(Shapes, AreFoundAtEveryTimeHoweverTheyWereCommitted) {
  std::mt19937_64 random(RecordSeed());
  std::map<TimeNs, int> believed;
  for (int round = 1; round <= 12; ++round) {
    // Overlapping stretches, some longer than a segment, some with far gaps.
    std::vector<BodyShape> shapes;
    TimeNs time_ns = static_cast<TimeNs>(random() % 100) * kSecond;
    for (uint64_t left = 1 + random() % 80; left > 0; --left) {
      time_ns += static_cast<TimeNs>(random() % 50 == 0 ? 90 : random() % 3 + 1) * kSecond;
      shapes.push_back(Estimate(time_ns, static_cast<float>(round)));
      believed[time_ns] = round;
    }
    map_.MustCommit(DeltaOfShapes(std::move(shapes)));
  }
  const auto snapshot = map_.Latest();
  for (int question = 0; question < 200; ++question) {
    const TimeNs from_ns = static_cast<TimeNs>(random() % 400) * kSecond;
    const TimeNs to_ns = from_ns + static_cast<TimeNs>(1 + random() % 100) * kSecond;
    std::string wanted;
    for (const auto& [time_ns, round] : believed) {
      if (time_ns < from_ns || time_ns >= to_ns) continue;
      if (!wanted.empty()) wanted += ' ';
      wanted += std::to_string(time_ns) + "=" + std::to_string(round);
    }
    ASSERT_EQ(NumbersOf(*snapshot, from_ns, to_ns), wanted);
  }
  EXPECT_EQ(map_.Problems(), "");
}

TEST_P(Shapes, StopWhenTheVisitorOrTheCallerHasEnough) {
  std::vector<BodyShape> shapes;
  for (int i = 0; i < 100; ++i) shapes.push_back(Estimate(i, 1));
  map_.MustCommit(DeltaOfShapes(std::move(shapes)));
  const auto snapshot = map_.Latest();
  int count = 0;
  const auto three = [&](const ShownShape&) { return ++count < 3; };
  OrDie(snapshot->ReadShapes(kAnn, kTimeMin, kTimeMax, true, StopCheck(), three));
  EXPECT_EQ(count, 3);
  const auto stop = [&] {
    return count < 10 ? absl::OkStatus() : absl::DeadlineExceededError("late");
  };
  const auto all = [&](const ShownShape&) { return ++count > 0; };
  EXPECT_TRUE(
      absl::IsDeadlineExceeded(snapshot->ReadShapes(kAnn, kTimeMin, kTimeMax, true, stop, all)));
  EXPECT_EQ(count, 10);
}

TEST_P(Shapes, WithoutVerticesStillSayHowManyThereAre) {
  BodyShape body = Estimate(10, 1);
  body.vertices = {1, 2, 3, 4, 5, 6};
  map_.MustCommit(DeltaOfShapes({body}));
  OrDie(map_.Latest()->ReadShapes(kAnn, kTimeMin, kTimeMax, false, StopCheck(),
                                  [](const ShownShape& shown) {
                                    EXPECT_EQ(shown.vertex_count, 2u);
                                    EXPECT_TRUE(shown.shape.vertices.empty());
                                    EXPECT_EQ(shown.shape.joints.size(), 3u);
                                    return true;
                                  }));
}

class LosslessMap : public OnEveryBackend {};
class ShapesRefused : public OnEveryBackend {};
DSG_ON_EVERY_BACKEND(LosslessMap);
DSG_ON_EVERY_BACKEND(ShapesRefused);

TEST_P(LosslessMap, KeepsEveryBitOfABody) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfNodes({MakeHuman(1, "ann")}));
  const BodyShape body = AnyCoefficients(10, RecordSeed());
  map.MustCommit(DeltaOfShapes({body}));
  const auto kept = OrDie(map.Latest()->Shapes(kAnn, kTimeMin, kTimeMax));
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept[0].pose_coefficients, body.pose_coefficients);
  EXPECT_EQ(kept[0].shape_coefficients, body.shape_coefficients);
  EXPECT_EQ(kept[0].joints, body.joints);
}

TEST_P(ShapesRefused, WithNumbersThatAreNoneOrTooMany) {
  TestMap map(GetParam());
  map.MustCommit(DeltaOfNodes({MakeHuman(1, "ann")}));
  const auto reason_of = [&](const BodyShape& body) {
    return ReasonOf(map.Commit(DeltaOfShapes({body})).status());
  };
  BodyShape body;
  body.joints = {1.0f, 2.0f};
  EXPECT_EQ(reason_of(body), Reason::kDeltaInvalid);
  body.joints = {1.0f, 2.0f, std::nanf("")};
  EXPECT_EQ(reason_of(body), Reason::kNumberNotFinite);
  body.joints.assign(4098, 0.0f);
  EXPECT_EQ(reason_of(body), Reason::kDeltaInvalid);
  body = BodyShape();
  body.vertices = {0.0f, INFINITY, 0.0f};
  EXPECT_EQ(reason_of(body), Reason::kNumberNotFinite);
  body.vertices = {3e6f, 0.0f, 0.0f};
  EXPECT_EQ(reason_of(body), Reason::kNumberNotFinite);
  EXPECT_EQ(ReasonOf(map.Commit(DeltaOfShapes({Estimate(2, 1), Estimate(2, 1)})).status()),
            Reason::kDeltaInvalid);
}

}  // namespace
}  // namespace dsg::test
