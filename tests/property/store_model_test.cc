// SPDX-License-Identifier: Apache-2.0
// The store's central property: the snapshot at revision r is what a naive map holds after deltas
// 1 to r, whatever was committed later. Random worlds, both codecs.
#include <gtest/gtest.h>

#include <algorithm>

#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/codec/proto_convert.h"
#include "schema/store/graph_store.h"
#include "tests/support/random_world.h"
#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

using test::NaiveMap;
using test::RandomWorld;

constexpr int kRevisions = 120;

// Half a step on each axis; see trajectory_codec.h.
constexpr double kPositionBoundM = 1e-4;
constexpr double kRotationBoundRad = 6e-5;

struct Bounds {
  double position_m;
  double rotation_rad;
};

Bounds BoundsOf(TrajectoryCodec codec) {
  if (codec == TrajectoryCodec::kLossless) return {0.0, 0.0};
  return {kPositionBoundM, kRotationBoundRad};
}

void ExpectSamePose(const Pose3d& actual, const Pose3d& expected, const Bounds& bounds) {
  EXPECT_LE((actual.position - expected.position).norm(), bounds.position_m);
  EXPECT_LE(AngleBetween(actual.orientation, expected.orientation), bounds.rotation_rad + 1e-12);
}

class StoreModelTest : public testing::TestWithParam<TrajectoryCodec> {
 protected:
  void SetUp() override {
    auto opened = GraphStore::Open(folder_.path(), {});
    ASSERT_TRUE(opened.ok()) << opened.status();
    store_ = *std::move(opened);
    MapSpec spec;
    spec.name = "world";
    spec.codec = GetParam();
    ASSERT_TRUE(store_->CreateMap(spec).ok());
  }

  // Commits random deltas; history_[r] is the naive map at revision r.
  void Build(uint64_t seed) {
    RandomWorld world(seed);
    auto writer = store_->OpenWriter("world");
    ASSERT_TRUE(writer.ok()) << writer.status();
    history_.push_back({});
    for (int r = 1; r <= kRevisions; ++r) {
      const GraphDelta delta = r == 1 ? world.First() : world.Next(history_.back());
      deltas_.push_back(delta);
      const auto result = (*writer)->Commit(delta);
      ASSERT_TRUE(result.ok()) << "revision " << r << ": " << result.status();
      ASSERT_EQ(result->revision, r);
      history_.push_back(history_.back());
      history_.back().Apply(delta);
      // A writer that was restarted goes on as if it had not been.
      if (r % 37 == 0) {
        writer->reset();
        writer = store_->OpenWriter("world");
        ASSERT_TRUE(writer.ok()) << writer.status();
      }
    }
    auto opened = store_->OpenMap("world");
    ASSERT_TRUE(opened.ok()) << opened.status();
    map_ = *opened;
  }

  std::shared_ptr<const Snapshot> At(Revision revision) {
    auto snapshot = map_->At(revision);
    EXPECT_TRUE(snapshot.ok()) << snapshot.status();
    return *snapshot;
  }

  test::TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
  std::shared_ptr<MapReader> map_;
  std::vector<GraphDelta> deltas_;
  std::vector<NaiveMap> history_;
};

void ExpectSameGraph(const Snapshot& snapshot, const NaiveMap& expected) {
  auto node = expected.nodes.begin();
  ASSERT_TRUE(snapshot
                  .ScanNodes({}, NodeId(), {},
                             [&](const Node& actual) {
                               EXPECT_NE(node, expected.nodes.end());
                               if (node == expected.nodes.end()) return false;
                               EXPECT_EQ(ToString(actual.id), ToString(node->first));
                               EXPECT_EQ(EncodeNodePayload(actual),
                                         EncodeNodePayload(node->second));
                               ++node;
                               return true;
                             })
                  .ok());
  EXPECT_EQ(node, expected.nodes.end());
  auto edge = expected.edges.begin();
  ASSERT_TRUE(snapshot
                  .ScanEdges({}, std::nullopt, {},
                             [&](const Edge& actual) {
                               EXPECT_NE(edge, expected.edges.end());
                               if (edge == expected.edges.end()) return false;
                               EXPECT_EQ(actual.key(), edge->first);
                               EXPECT_EQ(actual.weight, edge->second.weight);
                               EXPECT_EQ(actual.valid, edge->second.valid);
                               ++edge;
                               return true;
                             })
                  .ok());
  EXPECT_EQ(edge, expected.edges.end());
}

void ExpectSameTracks(const Snapshot& snapshot, const NaiveMap& expected) {
  const Bounds bounds = BoundsOf(snapshot.spec().codec);
  int64_t pose_count = 0;
  for (const auto& [agent, track] : expected.tracks) {
    auto pose = track.begin();
    ASSERT_TRUE(snapshot
                    .ReadPoses(agent, kTimeMin, kTimeMax, {},
                               [&](const TimedPose& actual) {
                                 EXPECT_NE(pose, track.end());
                                 if (pose == track.end()) return false;
                                 EXPECT_EQ(actual.time_ns, pose->first);
                                 EXPECT_EQ(actual.flags, pose->second.flags);
                                 ExpectSamePose(actual.map_T_agent, pose->second.map_T_agent,
                                                bounds);
                                 ++pose;
                                 return true;
                               })
                    .ok());
    EXPECT_EQ(pose, track.end()) << ToString(agent);
    pose_count += static_cast<int64_t>(track.size());
  }
  const auto stats = snapshot.Stats();
  ASSERT_TRUE(stats.ok());
  EXPECT_EQ(stats->at.pose_count, pose_count);
  EXPECT_EQ(stats->at.node_count, std::ssize(expected.nodes));
  EXPECT_EQ(stats->at.edge_count, std::ssize(expected.edges));
  EXPECT_EQ(stats->at.stay_count, std::ssize(expected.stays));
}

void ExpectSameStays(const Snapshot& snapshot, const NaiveMap& expected) {
  for (uint64_t room = 0; room < 4; ++room) {
    std::vector<Stay> naive;
    for (const auto& [key, stay] : expected.stays) {
      if (stay.room != NodeId('R', room)) continue;
      Stay clipped = stay;
      const auto track = expected.tracks.find(stay.agent);
      if (stay.exit_ns == kTimeMax && track != expected.tracks.end() && !track->second.empty()) {
        clipped.exit_ns = std::max(stay.enter_ns, track->second.rbegin()->first) + 1;
      }
      naive.push_back(clipped);
    }
    std::sort(naive.begin(), naive.end(), [](const Stay& a, const Stay& b) {
      return std::tie(a.enter_ns, a.agent) < std::tie(b.enter_ns, b.agent);
    });
    const auto actual = snapshot.StaysInNode(NodeId('R', room), kTimeMin, kTimeMax, {});
    ASSERT_TRUE(actual.ok()) << actual.status();
    EXPECT_EQ(*actual, naive);
  }
}

TEST_P(StoreModelTest, SnapshotsEqualTheNaiveMapAtEveryRevision) {
  ASSERT_NO_FATAL_FAILURE(Build(test::TestSeed(11)));
  for (Revision r = 0; r <= kRevisions; ++r) {
    SCOPED_TRACE("revision " + std::to_string(r));
    const auto snapshot = At(r);
    ExpectSameGraph(*snapshot, history_[static_cast<size_t>(r)]);
    ExpectSameTracks(*snapshot, history_[static_cast<size_t>(r)]);
    ExpectSameStays(*snapshot, history_[static_cast<size_t>(r)]);
    if (HasFailure()) break;
  }
}

TEST_P(StoreModelTest, LocateEqualsNaiveInterpolationAtAnyRevision) {
  const uint64_t seed = test::TestSeed(12);
  ASSERT_NO_FATAL_FAILURE(Build(seed));
  RandomWorld random(seed + 1);
  const Bounds bounds = BoundsOf(GetParam());
  for (int i = 0; i < 3000 && !HasFailure(); ++i) {
    const Revision r = random.Int(1, kRevisions);
    const NodeId agent = RandomWorld::Person(static_cast<int>(random.Int(0, 4)));
    const NaiveMap& naive = history_[static_cast<size_t>(r)];
    const auto found = naive.tracks.find(agent);
    if (found == naive.tracks.end() || found->second.empty()) continue;
    const auto& track = found->second;
    TimeNs t = random.Int(track.begin()->first - 10, track.rbegin()->first + 10);
    if (i % 5 == 0) {
      auto stored = track.begin();
      std::advance(stored, random.Int(0, std::ssize(track) - 1));
      t = stored->first;
    }
    const auto located = At(r)->Locate(agent, t);
    if (t < track.begin()->first || t > track.rbegin()->first) {
      EXPECT_EQ(ReasonOf(located.status()), Reason::kTimeOutsideTrack);
      continue;
    }
    ASSERT_TRUE(located.ok()) << located.status();
    const auto after = track.lower_bound(t);
    if (after->first == t) {
      EXPECT_EQ(located->quality, PoseQuality::kExact);
      ExpectSamePose(located->map_T_agent, after->second.map_T_agent, bounds);
      continue;
    }
    const auto before = std::prev(after);
    EXPECT_EQ(located->before_ns, before->first);
    EXPECT_EQ(located->after_ns, after->first);
    if (after->first - before->first > 2 * kNsPerSecond) {
      EXPECT_EQ(located->quality, PoseQuality::kInGap);
      continue;
    }
    EXPECT_EQ(located->quality, PoseQuality::kInterpolated);
    const double fraction =
        static_cast<double>(t - before->first) / static_cast<double>(after->first - before->first);
    // Slerp amplifies the error of its ends by less than two for the small turns of this world.
    ExpectSamePose(located->map_T_agent,
                   Interpolate(before->second.map_T_agent, after->second.map_T_agent, fraction),
                   {bounds.position_m + 1e-12, 2 * bounds.rotation_rad});
  }
}

TEST_P(StoreModelTest, VisitsToABoxEqualDenseSampling) {
  const uint64_t seed = test::TestSeed(13);
  ASSERT_NO_FATAL_FAILURE(Build(seed));
  RandomWorld random(seed + 1);
  int64_t inside_count = 0;
  for (int i = 0; i < 60 && !HasFailure(); ++i) {
    const Revision r = i % 2 == 0 ? kRevisions : random.Int(kRevisions / 2, kRevisions);
    const auto snapshot = At(r);
    const NodeId agent = RandomWorld::Person(static_cast<int>(random.Int(0, 4)));
    const auto track = snapshot->GetTrack(agent);
    ASSERT_TRUE(track.ok());
    if (track->pose_count < 2) continue;
    const TimeNs from = random.Int(track->first_ns, track->last_ns);
    const TimeNs to = from + 20 * kNsPerSecond;
    // A box around a pose of the track, so that there is something to find.
    const auto center = snapshot->Locate(agent, random.Int(track->first_ns, track->last_ns));
    ASSERT_TRUE(center.ok());
    if (center->quality == PoseQuality::kInGap) continue;
    const Eigen::Vector3d half(random.Real(.1, 2), random.Real(.1, 2), random.Real(.1, 2));
    const Box3d box(center->map_T_agent.position - half, center->map_T_agent.position + half);
    const auto visits = snapshot->VisitsToBox(box, from, to, {});
    ASSERT_TRUE(visits.ok()) << visits.status();
    for (TimeNs t = from; t < std::min(to, track->last_ns); t += 13'000'001) {
      const auto at = snapshot->Locate(agent, t);
      ASSERT_TRUE(at.ok());
      const bool inside =
          at->quality != PoseQuality::kInGap && box.contains(at->map_T_agent.position);
      const bool listed = std::any_of(visits->begin(), visits->end(), [&](const BoxVisit& visit) {
        return visit.agent == agent && visit.enter_ns <= t && t < visit.exit_ns;
      });
      // On the very face of the box, rounding may decide either way.
      const Box3d grown(box.min().array() - 1e-7, box.max().array() + 1e-7);
      const Box3d shrunk(box.min().array() + 1e-7, box.max().array() - 1e-7);
      if (grown.contains(at->map_T_agent.position) && !shrunk.contains(at->map_T_agent.position)) {
        continue;
      }
      EXPECT_EQ(inside, listed) << "revision " << r << " time " << t;
      inside_count += inside ? 1 : 0;
    }
  }
  EXPECT_GT(inside_count, 100);
}

TEST_P(StoreModelTest, AnswersGivenThenAreGivenAgainLater) {
  const uint64_t seed = test::TestSeed(14);
  RandomWorld world(seed);
  RandomWorld random(seed + 1);
  auto writer = store_->OpenWriter("world");
  ASSERT_TRUE(writer.ok());
  auto map = store_->OpenMap("world");
  ASSERT_TRUE(map.ok());
  struct Answer {
    Revision revision;
    NodeId agent;
    TimeNs at_ns;
    Eigen::Vector3d position;
    PoseQuality quality;
  };
  std::vector<Answer> answers;
  NaiveMap naive;
  for (int r = 1; r <= kRevisions; ++r) {
    const GraphDelta delta = r == 1 ? world.First() : world.Next(naive);
    ASSERT_TRUE((*writer)->Commit(delta).ok());
    naive.Apply(delta);
    const auto latest = (*map)->Latest();
    ASSERT_TRUE(latest.ok());
    ASSERT_EQ((*latest)->revision(), r);
    for (int i = 0; i < 10; ++i) {
      const NodeId agent = RandomWorld::Person(static_cast<int>(random.Int(0, 4)));
      const auto track = (*latest)->GetTrack(agent);
      ASSERT_TRUE(track.ok());
      if (track->pose_count == 0) continue;
      const TimeNs t = random.Int(track->first_ns, track->last_ns);
      const auto located = (*latest)->Locate(agent, t);
      ASSERT_TRUE(located.ok());
      answers.push_back({r, agent, t, located->map_T_agent.position, located->quality});
    }
  }
  ASSERT_GT(answers.size(), 1000u);
  // A fresh reader, with nothing cached.
  map = store_->OpenMap("world");
  for (const Answer& answer : answers) {
    const auto located = (*(*map)->At(answer.revision))->Locate(answer.agent, answer.at_ns);
    ASSERT_TRUE(located.ok()) << located.status();
    EXPECT_EQ(located->quality, answer.quality);
    EXPECT_EQ(located->map_T_agent.position, answer.position);
  }
}

TEST_P(StoreModelTest, ReplayGivesTheSameDigestsAndVerifies) {
  ASSERT_NO_FATAL_FAILURE(Build(test::TestSeed(15)));
  MapSpec spec = map_->spec();
  spec.name = "replayed";
  ASSERT_TRUE(store_->CreateMap(spec).ok());
  {
    auto writer = store_->OpenWriter("replayed");
    ASSERT_TRUE(writer.ok());
    for (const GraphDelta& delta : deltas_) ASSERT_TRUE((*writer)->Commit(delta).ok());
    // Again: every delta is known.
    for (const GraphDelta& delta : deltas_) {
      const auto result = (*writer)->Commit(delta);
      ASSERT_TRUE(result.ok());
      EXPECT_TRUE(result->replayed);
      EXPECT_EQ(result->revision, delta.sequence);
    }
  }
  auto replayed = store_->OpenMap("replayed");
  ASSERT_TRUE(replayed.ok());
  const auto first = map_->ListRevisions(0, 1000);
  const auto second = (*replayed)->ListRevisions(0, 1000);
  ASSERT_TRUE(first.ok());
  ASSERT_TRUE(second.ok());
  ASSERT_EQ(first->size(), size_t{kRevisions});
  ASSERT_EQ(second->size(), size_t{kRevisions});
  for (size_t i = 0; i < first->size(); ++i) EXPECT_EQ((*first)[i].digest, (*second)[i].digest);
  for (const auto& map : {map_, *replayed}) {
    const auto report = map->Verify({}, {});
    ASSERT_TRUE(report.ok()) << report.status();
    EXPECT_TRUE(report->problems.empty()) << report->problems.front();
    EXPECT_EQ(report->revision_count, kRevisions);
  }
}

INSTANTIATE_TEST_SUITE_P(Codecs, StoreModelTest,
                         testing::Values(TrajectoryCodec::kQuantized, TrajectoryCodec::kLossless),
                         [](const auto& param_info) {
                           return param_info.param == TrajectoryCodec::kLossless ? "Lossless"
                                                                                 : "Quantized";
                         });

}  // namespace
}  // namespace dsg
