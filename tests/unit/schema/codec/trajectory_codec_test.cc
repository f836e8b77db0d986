// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/trajectory_codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

// A walk with turns, pauses, noise and clock jitter; now and then a jump.
std::vector<TimedPose> Walk(uint64_t seed, int count) {
  std::mt19937_64 random(seed);
  const auto uniform = [&] { return static_cast<double>(random() >> 11) * 0x1p-53 * 2.0 - 1.0; };
  std::vector<TimedPose> poses;
  Pose3d pose;
  TimeNs t = 1403715524907143168;
  for (int i = 0; i < count; ++i) {
    t += 100'000'000 + static_cast<TimeNs>(uniform() * 500'000);
    pose.position += Eigen::Vector3d(0.1 * uniform(), 0.1 * uniform(), 0.003 * uniform());
    if (random() % 200 == 0) pose.position += Eigen::Vector3d(500 * uniform(), 0, 0);
    const Eigen::Quaterniond turn(1.0, 0.01 * uniform(), 0.01 * uniform(), 0.3 * uniform());
    pose.orientation = (pose.orientation * turn).normalized();
    TimedPose made;
    made.time_ns = random() % 3 == 0 ? t : t / 1000 * 1000;
    made.flags = random() % 50 == 0 ? pose_flags::kPredicted : 0;
    made.map_T_agent = pose;
    poses.push_back(made);
  }
  return poses;
}

std::vector<std::string> Encode(const std::vector<TimedPose>& poses, TrajectoryCodec codec) {
  std::vector<std::string> segments;
  SegmentEncoder encoder(codec);
  for (const TimedPose& pose : poses) {
    if (encoder.Add(ToStored(pose, codec))) continue;
    segments.push_back(encoder.Encode());
    encoder = SegmentEncoder(codec);
    EXPECT_TRUE(encoder.Add(ToStored(pose, codec)));
  }
  segments.push_back(encoder.Encode());
  return segments;
}

TEST(TrajectoryCodec, QuantisedStaysWithinItsBoundAndKeepsTimesAndFlags) {
  const auto poses = Walk(test::TestSeed(21), 5000);
  size_t at = 0;
  for (const std::string& bytes : Encode(poses, TrajectoryCodec::kQuantized)) {
    const auto reader = SegmentReader::Parse(bytes);
    ASSERT_NE(reader, nullptr);
    std::vector<StoredPose> decoded;
    ASSERT_TRUE(reader->DecodeAll(&decoded));
    for (const StoredPose& stored : decoded) {
      const TimedPose pose = FromStored(stored, TrajectoryCodec::kQuantized);
      const TimedPose& original = poses[at++];
      ASSERT_EQ(pose.time_ns, original.time_ns);
      ASSERT_EQ(pose.flags, original.flags);
      ASSERT_LE((pose.map_T_agent.position - original.map_T_agent.position).norm(), 1e-4);
      ASSERT_LE(AngleBetween(pose.map_T_agent.orientation, original.map_T_agent.orientation), 6e-5);
    }
  }
  EXPECT_EQ(at, poses.size());
}

TEST(TrajectoryCodec, QuantisedBoundHoldsForAnyRotation) {
  std::mt19937_64 random(test::TestSeed(22));
  std::normal_distribution<double> normal;
  for (int i = 0; i < 200000; ++i) {
    TimedPose pose;
    pose.map_T_agent.orientation =
        Eigen::Quaterniond(normal(random), normal(random), normal(random), normal(random))
            .normalized();
    const auto restored =
        FromStored(ToStored(pose, TrajectoryCodec::kQuantized), TrajectoryCodec::kQuantized);
    ASSERT_LE(AngleBetween(restored.map_T_agent.orientation, pose.map_T_agent.orientation), 6e-5);
  }
}

TEST(TrajectoryCodec, LosslessIsExactToTheBit) {
  const auto poses = Walk(test::TestSeed(23), 1000);
  size_t at = 0;
  for (const std::string& bytes : Encode(poses, TrajectoryCodec::kLossless)) {
    const auto reader = SegmentReader::Parse(bytes);
    ASSERT_NE(reader, nullptr);
    std::vector<StoredPose> decoded;
    ASSERT_TRUE(reader->DecodeAll(&decoded));
    for (const StoredPose& stored : decoded) {
      const TimedPose pose = FromStored(stored, TrajectoryCodec::kLossless);
      ASSERT_EQ(pose.time_ns, poses[at].time_ns);
      ASSERT_EQ(pose.map_T_agent.position, poses[at].map_T_agent.position);
      ASSERT_EQ(pose.map_T_agent.orientation.coeffs(), poses[at].map_T_agent.orientation.coeffs());
      ++at;
    }
  }
  EXPECT_EQ(at, poses.size());
}

TEST(TrajectoryCodec, FindBracketEqualsDecodingAll) {
  for (const auto codec : {TrajectoryCodec::kQuantized, TrajectoryCodec::kLossless}) {
    for (const std::string& bytes : Encode(Walk(test::TestSeed(24), 1500), codec)) {
      const auto reader = SegmentReader::Parse(bytes);
      ASSERT_NE(reader, nullptr);
      std::vector<StoredPose> all;
      ASSERT_TRUE(reader->DecodeAll(&all));
      for (size_t i = 0; i < all.size(); ++i) {
        for (const TimeNs offset : {TimeNs{0}, TimeNs{1}}) {
          int index = -2;
          StoredPose before;
          StoredPose after;
          ASSERT_TRUE(reader->FindBracket(all[i].time_ns + offset, &index, &before, &after));
          ASSERT_EQ(index, static_cast<int>(i));
          ASSERT_EQ(before.time_ns, all[i].time_ns);
          ASSERT_EQ(before.columns, all[i].columns);
          ASSERT_EQ(before.flags, all[i].flags);
          if (i + 1 == all.size()) continue;
          ASSERT_EQ(after.time_ns, all[i + 1].time_ns);
          ASSERT_EQ(after.columns, all[i + 1].columns);
        }
      }
      int index = -2;
      StoredPose before;
      StoredPose after;
      ASSERT_TRUE(reader->FindBracket(all[0].time_ns - 1, &index, &before, &after));
      EXPECT_EQ(index, -1);
    }
  }
}

TEST(TrajectoryCodec, DecodePositionsHoldsTheWindowAndItsNeighbours) {
  for (const auto codec : {TrajectoryCodec::kQuantized, TrajectoryCodec::kLossless}) {
    const std::string bytes = Encode(Walk(test::TestSeed(31), 300), codec).front();
    const auto reader = SegmentReader::Parse(bytes);
    ASSERT_NE(reader, nullptr);
    std::vector<StoredPose> all;
    ASSERT_TRUE(reader->DecodeAll(&all));
    for (size_t from = 0; from < all.size(); from += 7) {
      for (size_t to = from; to < all.size(); to += 41) {
        std::vector<TimedPosition> positions;
        ASSERT_TRUE(reader->DecodePositions(all[from].time_ns + 1, all[to].time_ns, &positions));
        auto at = std::find_if(all.begin(), all.end(), [&](const StoredPose& pose) {
          return pose.time_ns == positions.front().time_ns;
        });
        // One run of neighbours, from at or before the window to at or after it.
        ASSERT_LE(positions.front().time_ns, all[from].time_ns + 1);
        ASSERT_GE(positions.back().time_ns, all[to].time_ns);
        for (const TimedPosition& position : positions) {
          ASSERT_NE(at, all.end());
          ASSERT_EQ(position.time_ns, at->time_ns);
          ASSERT_EQ(position.position_map, PositionOf(*at, codec));
          ++at;
        }
      }
    }
  }
}

TEST(TrajectoryCodec, EncodingADecodedSegmentAgainGivesTheSameBytes) {
  for (const auto codec : {TrajectoryCodec::kQuantized, TrajectoryCodec::kLossless}) {
    for (const std::string& bytes : Encode(Walk(test::TestSeed(25), 2000), codec)) {
      std::vector<StoredPose> all;
      ASSERT_TRUE(SegmentReader::Parse(bytes)->DecodeAll(&all));
      SegmentEncoder again(codec);
      for (const StoredPose& pose : all) ASSERT_TRUE(again.Add(pose));
      ASSERT_EQ(again.Encode(), bytes);
    }
  }
}

TEST(TrajectoryCodec, KeepsCovariancesWhereTheyAreGiven) {
  auto covariance = std::make_shared<Covariance6>();
  for (size_t i = 0; i < covariance->size(); ++i) (*covariance)[i] = static_cast<float>(i) * 0.1f;
  for (const auto codec : {TrajectoryCodec::kQuantized, TrajectoryCodec::kLossless}) {
    auto poses = Walk(26, 70);
    poses[3].covariance = covariance;
    poses[69].covariance = covariance;
    const auto reader = SegmentReader::Parse(Encode(poses, codec).front());
    ASSERT_NE(reader, nullptr);
    std::vector<StoredPose> all;
    ASSERT_TRUE(reader->DecodeAll(&all));
    for (size_t i = 0; i < all.size(); ++i) {
      ASSERT_EQ(all[i].covariance != nullptr, i == 3 || i == 69);
    }
    EXPECT_EQ(*all[3].covariance, *covariance);
  }
}

TEST(TrajectoryCodec, PosesAtOnceAreThoseOneByOneToTheBit) {
  auto walk = Walk(30, 400);
  walk[7].covariance = std::make_shared<Covariance6>();
  for (const auto codec : {TrajectoryCodec::kQuantized, TrajectoryCodec::kLossless}) {
    for (const std::string& bytes : Encode(walk, codec)) {
      const auto reader = SegmentReader::Parse(bytes);
      std::vector<StoredPose> stored;
      // What was there goes.
      std::vector<TimedPose> poses(600);
      for (TimedPose& pose : poses) pose.covariance = walk[7].covariance;
      ASSERT_TRUE(reader->DecodeAll(&stored));
      ASSERT_TRUE(reader->DecodePoses(&poses));
      ASSERT_EQ(poses.size(), stored.size());
      for (size_t i = 0; i < poses.size(); ++i) {
        const TimedPose one = FromStored(stored[i], codec);
        EXPECT_EQ(poses[i].time_ns, one.time_ns);
        EXPECT_EQ(poses[i].flags, one.flags);
        EXPECT_EQ(poses[i].map_T_agent.position, one.map_T_agent.position);
        EXPECT_EQ(poses[i].map_T_agent.orientation.coeffs(), one.map_T_agent.orientation.coeffs());
        EXPECT_EQ(poses[i].covariance, one.covariance);
      }
    }
  }
}

TEST(TrajectoryCodec, IdentityDoesNotCareAboutTheSignOfAQuaternion) {
  TimedPose pose = Walk(27, 1).front();
  std::string scratch_a;
  std::string scratch_b;
  const auto a = ToStored(pose, TrajectoryCodec::kQuantized);
  pose.map_T_agent.orientation.coeffs() *= -1.0;
  const auto b = ToStored(pose, TrajectoryCodec::kQuantized);
  EXPECT_NE(a.columns, b.columns);
  EXPECT_EQ(PoseIdentity(NodeId('H', 1), a, TrajectoryCodec::kQuantized, &scratch_a),
            PoseIdentity(NodeId('H', 1), b, TrajectoryCodec::kQuantized, &scratch_b));
}

TEST(TrajectoryCodec, DamagedSegmentsNeverCrash) {
  std::mt19937_64 random(test::TestSeed(28));
  for (const auto codec : {TrajectoryCodec::kQuantized, TrajectoryCodec::kLossless}) {
    const std::string sound = Encode(Walk(29, 400), codec).front();
    for (int i = 0; i < 3000; ++i) {
      std::string bytes = sound;
      if (i % 3 == 0) bytes.resize(random() % bytes.size());
      for (int flips = 0; flips < 3 && !bytes.empty(); ++flips) {
        bytes[random() % bytes.size()] ^= static_cast<char>(1 << (random() % 8));
      }
      const auto reader = SegmentReader::Parse(bytes);
      if (reader == nullptr) continue;
      std::vector<StoredPose> all;
      int index = 0;
      StoredPose before;
      StoredPose after;
      // Structure may be found bad or not; the store's checksum finds bad numbers.
      const bool decoded = reader->DecodeAll(&all);
      std::vector<TimedPose> poses;
      EXPECT_EQ(reader->DecodePoses(&poses), decoded);
      const bool found =
          reader->FindBracket(reader->first_ns() + 5 * kNsPerSecond, &index, &before, &after);
      EXPECT_TRUE(!decoded || all.size() == static_cast<size_t>(reader->count()));
      EXPECT_TRUE(!found || index < reader->count());
    }
  }
}

TEST(TrajectoryCodec, ASegmentFitsADatabasePage) {
  for (const std::string& bytes : Encode(Walk(30, 5000), TrajectoryCodec::kQuantized)) {
    EXPECT_LE(bytes.size(), 4010u);
  }
}

}  // namespace
}  // namespace dsg
