// SPDX-License-Identifier: Apache-2.0
// Bodies come back within half a step, in few bytes, and bytes from elsewhere do no harm.
#include "schema/codec/shape_codec.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <random>

#include "schema/codec/checksum.h"
#include "tests/support/temp_folder.h"
#include "tests/unit/schema/codec/body_meshes.h"

namespace dsg {
namespace {

constexpr TimeNs kPeriodNs = 200'000'000;
constexpr size_t kVertexBytesMax = size_t{25} << 10;
constexpr size_t kCoefficientBytesMax = 400;
constexpr auto kQuantized = TrajectoryCodec::kQuantized;
constexpr auto kLossless = TrajectoryCodec::kLossless;

ShapeAppend WalkOf(const std::vector<float>& rest, int count) {
  ShapeAppend walk{NodeId('H', 1), ComputeSha256("faces"), {}};
  for (int i = 0; i < count; ++i) {
    BodyShape shape = test::AnyCoefficients(i * kPeriodNs, static_cast<uint64_t>(i));
    shape.vertices = test::Walking(rest, i);
    walk.shapes.push_back(std::move(shape));
  }
  return walk;
}

DecodedShapes Decoded(const std::string& bytes, bool with_vertices = true) {
  DecodedShapes shapes;
  EXPECT_TRUE(DecodeShapes(bytes, with_vertices, &shapes));
  return shapes;
}

void ExpectNear(const std::vector<float>& kept, const std::vector<float>& given, double step) {
  ASSERT_EQ(kept.size(), given.size());
  for (size_t i = 0; i < given.size(); ++i) {
    // A float of a few metres has itself an error of some 1e-7.
    ASSERT_NEAR(kept[i], given[i], 0.5 * step + 1e-6) << i;
  }
}

void ExpectWithinHalfAStep(const ShapeAppend& given, const DecodedShapes& kept) {
  ASSERT_EQ(kept.shapes.size(), given.shapes.size());
  EXPECT_EQ(kept.topology, given.topology);
  for (size_t i = 0; i < given.shapes.size(); ++i) {
    EXPECT_EQ(kept.shapes[i].time_ns, given.shapes[i].time_ns);
    EXPECT_EQ(kept.vertex_counts[i], given.shapes[i].vertices.size() / 3);
    ExpectNear(kept.shapes[i].pose_coefficients, given.shapes[i].pose_coefficients, 5e-4);
    ExpectNear(kept.shapes[i].shape_coefficients, given.shapes[i].shape_coefficients, 5e-4);
    ExpectNear(kept.shapes[i].joints, given.shapes[i].joints, 1e-3);
    ExpectNear(kept.shapes[i].vertices, given.shapes[i].vertices, 1e-3);
  }
}

ShapeAppend Alone(const ShapeAppend& all, size_t index) {
  return {all.agent, all.topology, {all.shapes[index]}};
}

double SecondsOf(const std::function<void()>& work) {
  const auto begin = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

// A whole body in 25 KiB, alone and among others; figures are left in the test's report.
void ExpectCompact(const std::string& what, const std::vector<float>& rest) {
  constexpr int kCount = 25;
  ShapeAppend walk = WalkOf(rest, kCount);
  std::string bytes;
  const double encode_s = SecondsOf([&] { bytes = EncodeShapes(walk, kQuantized); });
  DecodedShapes kept;
  const double decode_s = SecondsOf([&] { kept = Decoded(bytes); });
  ExpectWithinHalfAStep(walk, kept);
  size_t alone_max = 0;
  for (size_t i = 0; i < kCount; i += 6) {
    const std::string alone = EncodeShapes(Alone(walk, i), kQuantized);
    ExpectWithinHalfAStep(Alone(walk, i), Decoded(alone));
    alone_max = std::max(alone_max, alone.size());
  }
  EXPECT_LE(alone_max, kVertexBytesMax) << what;
  EXPECT_LE(bytes.size(), kCount * kVertexBytesMax) << what;
  testing::Test::RecordProperty(what + "_alone_bytes", static_cast<int>(alone_max));
  testing::Test::RecordProperty(what + "_batch_bytes", static_cast<int>(bytes.size() / kCount));
  std::printf("%s: alone %zu bytes, in a batch %zu, encode %.2f ms, decode %.2f ms a body\n",
              what.c_str(), alone_max, bytes.size() / kCount, 1e3 * encode_s / kCount,
              1e3 * decode_s / kCount);
}

TEST(ShapeCodec, KeepsARealBodyIn25KiBAlsoWhenItsVerticesStandInNoOrder) {
  const std::vector<float> rest = test::RealBody();
  if (rest.empty()) GTEST_SKIP() << "the body mesh is not there; set DSG_DATA";
  ASSERT_EQ(rest.size(), 3u * 6890u);
  ExpectCompact("real", rest);
  ExpectCompact("real_shuffled", test::Shuffled(rest, 1));
}

TEST(ShapeCodec, KeepsAMadeBodyIn25KiBAlsoWhenItsVerticesStandInNoOrder) {
  ExpectCompact("made", test::MadeBody(6890));
  ExpectCompact("made_shuffled", test::Shuffled(test::MadeBody(6890), 1));
}

TEST(ShapeCodec, KeepsCoefficientsAndJointsOfAnySizeIn400Bytes) {
  ShapeAppend all{NodeId('H', 1), ComputeSha256("faces"), {}};
  size_t alone_max = 0;
  for (int i = 0; i < 32; ++i) {
    all.shapes.push_back(test::AnyCoefficients(i * kPeriodNs, static_cast<uint64_t>(i)));
    alone_max =
        std::max(alone_max, EncodeShapes(Alone(all, all.shapes.size() - 1), kQuantized).size());
  }
  const std::string bytes = EncodeShapes(all, kQuantized);
  ExpectWithinHalfAStep(all, Decoded(bytes));
  EXPECT_LE(alone_max, kCoefficientBytesMax);
  EXPECT_LE(bytes.size(), 32 * kCoefficientBytesMax);
  std::printf("coefficients: alone %zu bytes, in a batch %zu\n", alone_max, bytes.size() / 32);
}

TEST(ShapeCodec, KeepsEveryBitWhereTheMapIsLossless) {
  ShapeAppend walk = WalkOf(test::MadeBody(500), 5);
  walk.shapes[2].vertices = {-0.0f, 1e-30f, 3e5f};
  walk.shapes[3].joints.clear();
  walk.shapes[4].time_ns = kTimeMax;
  const DecodedShapes kept = Decoded(EncodeShapes(walk, kLossless));
  ASSERT_EQ(kept.shapes.size(), 5u);
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(kept.shapes[i].time_ns, walk.shapes[i].time_ns);
    EXPECT_EQ(kept.shapes[i].pose_coefficients, walk.shapes[i].pose_coefficients);
    EXPECT_EQ(kept.shapes[i].shape_coefficients, walk.shapes[i].shape_coefficients);
    EXPECT_EQ(kept.shapes[i].joints, walk.shapes[i].joints);
    EXPECT_EQ(kept.shapes[i].vertices, walk.shapes[i].vertices);
  }
  EXPECT_TRUE(std::signbit(kept.shapes[2].vertices[0]));
}

TEST(ShapeCodec, GivesTheSameBytesForWhatItGaveBack) {
  const ShapeAppend walk = WalkOf(test::MadeBody(300), 4);
  const std::string bytes = EncodeShapes(walk, kQuantized);
  const ShapeAppend again{walk.agent, walk.topology, Decoded(bytes).shapes};
  EXPECT_EQ(EncodeShapes(again, kQuantized), bytes);
}

TEST(ShapeCodec, LeavesVerticesEncodedWhenTheyAreNotAskedFor) {
  for (const TrajectoryCodec codec : {kQuantized, kLossless}) {
    const ShapeAppend walk = WalkOf(test::MadeBody(100), 3);
    const DecodedShapes kept = Decoded(EncodeShapes(walk, codec), /*with_vertices=*/false);
    ASSERT_EQ(kept.shapes.size(), 3u);
    EXPECT_TRUE(kept.shapes[1].vertices.empty());
    EXPECT_EQ(kept.vertex_counts, (std::vector<uint32_t>{100, 100, 100}));
    EXPECT_EQ(kept.shapes[1].joints.size(), 72u);
  }
}

TEST(ShapeCodec, TakesBodiesOfDifferentPartsAndNone) {
  ShapeAppend mixed{NodeId('H', 1), std::nullopt, {}};
  for (int i = 0; i < 6; ++i) {
    BodyShape shape;
    shape.time_ns = kTimeMin + i;
    if (i % 2 == 1) shape.joints = {0.1f, 0.2f, 0.3f};
    if (i % 3 == 1) shape.vertices.assign(static_cast<size_t>(3 * i), 0.5f);
    mixed.shapes.push_back(shape);
  }
  for (const TrajectoryCodec codec : {kQuantized, kLossless}) {
    ExpectWithinHalfAStep(mixed, Decoded(EncodeShapes(mixed, codec)));
  }
  EXPECT_TRUE(Decoded(EncodeShapes({}, kQuantized)).shapes.empty());
}

TEST(ShapeCodec, KeepsTheLargestNumbersThatAMapTakes) {
  ShapeAppend large{NodeId('H', 1), std::nullopt, {BodyShape()}};
  large.shapes[0].pose_coefficients = {2e6f, -2e6f, 0.0f};
  large.shapes[0].vertices = {2e6f, -2e6f, 0.0f, -2e6f, 2e6f, 1e-4f};
  const DecodedShapes kept = Decoded(EncodeShapes(large, kQuantized));
  EXPECT_EQ(kept.shapes[0].pose_coefficients, large.shapes[0].pose_coefficients);
  EXPECT_EQ(kept.shapes[0].vertices, (std::vector<float>{2e6f, -2e6f, 0.0f, -2e6f, 2e6f, 0.0f}));
}

// Damage may give other numbers (checksums find that); it must give neither a crash nor more of
// them than the limits allow.
void ExpectHarmless(const std::string& bytes) {
  DecodedShapes shapes;
  std::vector<TimeNs> times;
  DecodeShapeTimes(bytes, &times);
  EXPECT_LE(times.size(), kShapesPerSegmentMax);
  if (!DecodeShapes(bytes, true, &shapes)) return;
  for (const BodyShape& shape : shapes.shapes) {
    EXPECT_LE(shape.vertices.size(), 300'000u);
    EXPECT_LE(shape.joints.size(), 4096u);
  }
}

TEST(ShapeCodec, SurvivesEveryKindOfDamage) {
  std::mt19937_64 random(test::TestSeed(1));
  for (const TrajectoryCodec codec : {kQuantized, kLossless}) {
    const std::string sound = EncodeShapes(WalkOf(test::MadeBody(60), 3), codec);
    for (size_t size = 0; size < sound.size(); ++size) ExpectHarmless(sound.substr(0, size));
    for (int round = 0; round < 3000; ++round) {
      std::string damaged = sound;
      for (uint64_t hits = 1 + random() % 4; hits > 0; --hits) {
        // The header is where damage does most.
        const size_t span =
            random() % 2 == 0 ? damaged.size() : std::min<size_t>(64, damaged.size());
        damaged[random() % span] = static_cast<char>(random());
      }
      ExpectHarmless(damaged);
    }
  }
  EXPECT_FALSE(DecodeShapes("", true, std::make_unique<DecodedShapes>().get()));
  EXPECT_FALSE(DecodeShapes("garbage", true, std::make_unique<DecodedShapes>().get()));
}

TEST(ShapeCodec, NoticesMissingBytes) {
  const std::string sound = EncodeShapes(WalkOf(test::MadeBody(1000), 3), kQuantized);
  DecodedShapes shapes;
  EXPECT_FALSE(DecodeShapes(sound.substr(0, sound.size() / 2), true, &shapes));
  EXPECT_FALSE(DecodeShapes(sound.substr(0, 30), true, &shapes));
}

}  // namespace
}  // namespace dsg
