// SPDX-License-Identifier: Apache-2.0
// After a revert the head answers as the revision did that it went back to: random worlds, every
// part of the model, one batch or many, interrupted and begun again.
#include <gtest/gtest.h>

#include <regex>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/maintenance/revert_series.h"
#include "query/service/service_core.h"
#include "schema/base/random.h"
#include "schema/codec/trajectory_codec.h"
#include "tests/support/random_world.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

// All answers, but for which revision wrote a thing, and the record of the revision itself.
std::string Answers(const Snapshot& snapshot) {
  std::string all;
  for (const Answer& answer : AskEverything(snapshot)) {
    const std::string text = OrDie(answer.text);
    if (answer.question == "stats") continue;
    absl::StrAppend(&all, answer.question, "\n", text, "\n");
  }
  static const std::regex kWrittenBy(" revision [0-9]+");
  return std::regex_replace(all, kWrittenBy, "");
}

std::vector<int64_t> CountsOf(const Snapshot& snapshot) {
  const RevisionInfo at = OrDie(snapshot.Stats()).at;
  return {at.node_count, at.edge_count, at.agent_count,
          at.pose_count, at.stay_count, at.mesh_block_count};
}

// The first line that differs, for people.
void ExpectSame(const Snapshot& now, const Snapshot& then) {
  EXPECT_EQ(CountsOf(now), CountsOf(then));
  const std::string a = Answers(now);
  const std::string b = Answers(then);
  if (a == b) return;
  const std::vector<std::string> lines_a = absl::StrSplit(a, '\n');
  const std::vector<std::string> lines_b = absl::StrSplit(b, '\n');
  for (size_t i = 0; i < std::min(lines_a.size(), lines_b.size()); ++i) {
    if (lines_a[i] == lines_b[i]) continue;
    FAIL() << "line " << i << "\nis     " << lines_a[i].substr(0, 300) << "\nshould "
           << lines_b[i].substr(0, 300);
  }
  FAIL() << lines_a.size() << " lines instead of " << lines_b.size();
}

class Reverter {
 public:
  explicit Reverter(const std::string& folder)
      : core_(query::MakeServiceCore(OrDie(GraphStore::Open(folder, {})))) {}

  /// Ends after so many messages. The last of them.
  absl::StatusOr<v1::RevertResponse> Revert(Revision to, int message_max = 1'000'000) {
    v1::RevertRequest request;
    request.set_map(kMap);
    request.set_revision(to);
    v1::RevertResponse last;
    DSG_RETURN_IF_ERROR(query::ReadStream(query::CallContext(),
                                          core_->Revert(query::CallContext(), request),
                                          [&](const v1::RevertResponse& message) {
                                            last = message;
                                            return --message_max > 0;
                                          }));
    return last;
  }

  query::ServiceCore& core() { return *core_; }

 private:
  std::unique_ptr<query::ServiceCore> core_;
};

TEST(Revert, GoesBackOverEveryPartOfTheModel) {
  for (const TrajectoryCodec codec : {TrajectoryCodec::kLossless, TrajectoryCodec::kQuantized}) {
    TestMap map(Spec(codec));
    constexpr Revision kLast = 40;
    for (Revision r = 1; r <= kLast; ++r) OrDie(map.writer().Commit(DeltaOfStream({}, r)));
    map.Close();
    Reverter reverter(map.folder());
    map.Reopen();
    map.Close();
    for (const Revision to : {Revision{39}, Revision{17}, Revision{38}, Revision{1}, Revision{0}}) {
      const auto done = reverter.Revert(to);
      ASSERT_TRUE(done.ok()) << "to " << to << ": " << done.status();
      const auto reader = OrDie(OrDie(GraphStore::Open(map.folder(), {}))->OpenMap(kMap));
      SCOPED_TRACE(absl::StrCat("to ", to, ", codec ", static_cast<int>(codec)));
      ExpectSame(*OrDie(reader->Latest()), *OrDie(reader->At(to)));
      EXPECT_TRUE(OrDie(reader->Verify({}, {})).problems.empty());
    }
  }
}

TEST(Revert, OfRandomWorldsFromAnywhereToAnywhere) {
  for (uint64_t seed = 1; seed <= 4; ++seed) {
    TestMap map;
    RandomWorld world(TestSeed(seed));
    NaiveMap naive;
    for (Revision r = 1; r <= 30; ++r) {
      GraphDelta delta = r == 1 ? world.First() : world.Next(naive);
      naive.Apply(delta);
      delta.map = kMap;
      OrDie(map.writer().Commit(std::move(delta)));
    }
    map.Close();
    Reverter reverter(map.folder());
    Random random(seed, 5);
    const auto reader = OrDie(OrDie(GraphStore::Open(map.folder(), {}))->OpenMap(kMap));
    for (int i = 0; i < 8; ++i) {
      const auto to = static_cast<Revision>(random.Index(31));
      const auto done = reverter.Revert(to);
      ASSERT_TRUE(done.ok()) << "seed " << seed << " to " << to << ": " << done.status();
      SCOPED_TRACE(absl::StrCat("seed ", seed, " to ", to));
      ExpectSame(*OrDie(reader->Latest()), *OrDie(reader->At(to)));
    }
    EXPECT_TRUE(OrDie(reader->Verify({}, {})).problems.empty());
  }
}

TEST(Revert, InManyBatchesInterruptedAndBegunAgain) {
  TestMap map;
  for (Revision r = 1; r <= 30; ++r) {
    OrDie(map.writer().Commit(DeltaOfStream({.poses_per_append = 400}, r)));
  }
  map.Close();
  const auto reader = OrDie(OrDie(GraphStore::Open(map.folder(), {}))->OpenMap(kMap));
  for (int message_max = 2; message_max < 6; ++message_max) {
    const auto part = OrDie(Reverter(map.folder()).Revert(3, message_max));
    EXPECT_FALSE(part.done());
    EXPECT_GT(part.revision(), 0);
    EXPECT_TRUE(OrDie(reader->Verify({}, {})).problems.empty());
  }
  const auto last = OrDie(Reverter(map.folder()).Revert(3));
  EXPECT_TRUE(last.done());
  EXPECT_EQ(last.progress(), 1.0);
  ExpectSame(*OrDie(reader->Latest()), *OrDie(reader->At(3)));
  EXPECT_TRUE(OrDie(reader->Verify({}, {})).problems.empty());
  // And forth again.
  OrDie(Reverter(map.folder()).Revert(30));
  ExpectSame(*OrDie(reader->Latest()), *OrDie(reader->At(30)));
}

TEST(Revert, OfTheHeadWritesNothing) {
  TestMap map;
  for (Revision r = 1; r <= 5; ++r) OrDie(map.writer().Commit(DeltaOfStream({}, r)));
  map.Close();
  Reverter reverter(map.folder());
  const auto done = OrDie(reverter.Revert(5));
  EXPECT_TRUE(done.done());
  EXPECT_EQ(done.revision(), 0);
  const auto back = OrDie(reverter.Revert(4));
  EXPECT_EQ(back.revision(), 6);
  EXPECT_GT(back.removed().pose_count(), 0);
  EXPECT_EQ(OrDie(reverter.Revert(4)).revision(), 0);
}

// Of q and -q the one near the pose before is stored, so what comes back after a hole may have the
// other sign.
TEST(Revert, OfATurningAgentArrives) {
  TestMap map(Spec(TrajectoryCodec::kQuantized));
  constexpr NodeId kDancer('H', 1);
  const auto at = [](int i) {
    TimedPose pose = PoseAt(i * kNsPerSecond / 10, 0.01 * i, 0.0, 0.0);
    pose.flags = 0;
    pose.map_T_agent.orientation =
        Eigen::Quaterniond(Eigen::AngleAxisd(0.05 * i, Eigen::Vector3d::UnitZ()));
    if (pose.map_T_agent.orientation.w() < 0.0) pose.map_T_agent.orientation.coeffs() *= -1.0;
    return pose;
  };
  GraphDelta first = DeltaOfNodes({MakeHuman(1, "dancer")});
  TrajectoryAppend dance{kDancer, {}};
  for (int i = 0; i < 2'000; ++i) dance.poses.push_back(at(i));
  first.appends.push_back(dance);
  const Revision then = map.MustCommit(std::move(first));
  for (int i = 50; i < 1'900; i += 170) {
    GraphDelta hole;
    hole.corrections.push_back({kDancer, at(i).time_ns, at(i + 90).time_ns, {}});
    map.MustCommit(std::move(hole));
  }
  map.Close();
  Reverter reverter(map.folder());
  EXPECT_GT(OrDie(reverter.Revert(then)).revision(), 0);
  EXPECT_EQ(OrDie(reverter.Revert(then)).revision(), 0);
}

// Others write between plan and batch: the rest is planned anew, so that what is left is the wanted
// revision and no mixture.
TEST(Revert, DoesNotMixWithTheWritesOfOthers) {
  TestMap map;
  for (Revision r = 1; r <= 30; ++r) {
    OrDie(map.writer().Commit(DeltaOfStream({.poses_per_append = 400}, r)));
  }
  map.Close();
  Reverter reverter(map.folder());
  const auto reader = OrDie(OrDie(GraphStore::Open(map.folder(), {}))->OpenMap(kMap));
  for (const int batch_count : {0, 1, 3}) {
    v1::RevertRequest request;
    request.set_map(kMap);
    request.set_revision(2);
    const auto cursor = OrDie(reverter.core().Revert(query::CallContext(), request));
    v1::RevertResponse message;
    for (int i = 0; i <= batch_count; ++i) {
      message.Clear();
      ASSERT_TRUE(OrDie(cursor->Next(query::CallContext(), &message)));
      ASSERT_FALSE(message.done());
    }
    OrDie(reverter.Revert(30));
    const Revision others = OrDie(reader->Head()).revision;
    while (!cursor->done()) {
      message.Clear();
      ASSERT_TRUE(OrDie(cursor->Next(query::CallContext(), &message)));
    }
    EXPECT_GT(message.revision(), others);
    ExpectSame(*OrDie(reader->Latest()), *OrDie(reader->At(2)));
    OrDie(reverter.Revert(30));
  }
  EXPECT_TRUE(OrDie(reader->Verify({}, {})).problems.empty());
}

TEST(Revert, CountsARowThatChangesOnce) {
  TestMap map;
  map.MustCommit(DeltaOfNodes({MakeHuman(1, "anna"), MakeHuman(2, "bert")}));
  GraphDelta walk;
  walk.appends = {
      {NodeId('H', 1),
       {PoseAt(1 * kNsPerSecond, 1.0, 0.0, 0.0), PoseAt(2 * kNsPerSecond, 2.0, 0.0, 0.0)}}};
  const Revision then = map.MustCommit(std::move(walk));
  GraphDelta changes = DeltaOfNodes({MakeHuman(1, "anne"), MakeHuman(3, "carl")});
  changes.corrections = {
      {NodeId('H', 1), 1, 3 * kNsPerSecond, {PoseAt(1 * kNsPerSecond, 1.5, 0.0, 0.0)}}};
  map.MustCommit(std::move(changes));
  map.Close();
  Reverter reverter(map.folder());
  const auto back = OrDie(reverter.Revert(then));
  EXPECT_EQ(back.added().node_count(), 1);
  EXPECT_EQ(back.removed().node_count(), 1);
  EXPECT_EQ(back.added().pose_count(), 2);
  EXPECT_EQ(back.removed().pose_count(), 0);
}

TEST(StoredAsBefore, GivesWhatTheCodecStoresAsTheSameNumbers) {
  Random random(TestSeed(3), 0);
  std::vector<Eigen::Quaterniond> orientations = {
      Eigen::Quaterniond::Identity(), Eigen::Quaterniond(0, 0, 0, 1),
      Eigen::Quaterniond(1, 0, 0, 1).normalized(), Eigen::Quaterniond(1, -1, 1, 1).normalized()};
  for (int i = 0; i < 200'000; ++i) {
    const auto part = [&] { return random.Chance(0.2) ? 0.0 : random.Normal(); };
    const Eigen::Quaterniond q(part() + 1e-3, part(), part(), part());
    orientations.push_back(q.normalized());
  }
  for (const Eigen::Quaterniond& orientation : orientations) {
    TimedPose pose;
    pose.map_T_agent.orientation = orientation;
    const StoredPose stored = ToStored(pose, TrajectoryCodec::kQuantized);
    pose = FromStored(stored, TrajectoryCodec::kQuantized);
    pose.map_T_agent.orientation = query::StoredAsBefore(pose.map_T_agent.orientation);
    ASSERT_TRUE(IsValidPose(pose.map_T_agent));
    ASSERT_EQ(ToStored(pose, TrajectoryCodec::kQuantized).columns, stored.columns)
        << orientation.coeffs().transpose();
  }
}

}  // namespace
}  // namespace dsg::test
