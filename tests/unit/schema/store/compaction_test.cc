// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <map>

#include "absl/strings/match.h"
#include "schema/codec/checksum.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg {
namespace {

using test::OrDie;
using test::TestMap;

constexpr int kWrittenCount = 60;

// A map of the delta stream, and what each of its revisions says.
class Compaction : public test::OnEveryBackend {
 protected:
  Compaction() {
    for (int sequence = 1; sequence <= kWrittenCount; ++sequence) Write(sequence);
  }

  void Write(int sequence) {
    OrDie(map_.writer().Commit(test::DeltaOfStream({.seed = 5}, sequence)));
    said_[sequence] = OrDie(test::Dump(*map_.Latest()));
  }

  CompactReport Compact(Revision keep_from) {
    return OrDie(map_.writer().Compact(keep_from, {}, {}));
  }

  void ExpectSays(Revision revision) {
    SCOPED_TRACE("revision " + std::to_string(revision));
    const auto snapshot = map_.reader().At(revision);
    ASSERT_TRUE(snapshot.ok()) << snapshot.status();
    const auto dump = test::Dump(**snapshot);
    ASSERT_TRUE(dump.ok()) << dump.status();
    EXPECT_EQ(*dump, said_[revision]);
  }

  void ExpectSound() {
    const VerifyReport report = OrDie(map_.reader().Verify({}, {}));
    EXPECT_TRUE(report.problems.empty()) << report.problems.front();
  }

  TestMap map_{GetParam()};
  std::map<Revision, std::string> said_;
};

DSG_ON_EVERY_BACKEND(Compaction);

TEST_P(Compaction, KeepsWhatIsKeptAsItWas) {
  OrDie(map_.writer().SetTag("spring", 7, ""));
  OrDie(map_.writer().SetTag("summer", 23, ""));
  OrDie(map_.writer().SetTag("winter", 50, ""));
  const CompactReport report = Compact(40);
  EXPECT_EQ(report.oldest, 40);
  EXPECT_EQ(report.revision_count, 37);
  EXPECT_GT(report.row_count, 0);
  for (const Revision revision : {7, 23, 40, 41, 50, 59, 60}) ExpectSays(revision);
  ExpectSound();
}

TEST_P(Compaction, RefusesWhatIsGoneNamingWhatCanBeRead) {
  OrDie(map_.writer().SetTag("summer", 23, ""));
  Compact(40);
  for (const Revision revision : {0, 1, 22, 24, 39}) {
    const auto refused = map_.reader().At(revision).status();
    EXPECT_EQ(refused.code(), absl::StatusCode::kOutOfRange);
    EXPECT_EQ(ReasonOf(refused), Reason::kRevisionCompacted);
    EXPECT_EQ(MetadataOf(refused)["oldest"], "40");
    EXPECT_EQ(MetadataOf(refused)["newest"], "60");
    EXPECT_TRUE(absl::StrContains(refused.message(), "40 to 60 and the tagged 23")) << refused;
  }
  const auto future = map_.reader().At(61).status();
  EXPECT_EQ(ReasonOf(future), Reason::kRevisionInFuture);
  EXPECT_TRUE(absl::StrContains(future.message(), "40 to 60 and the tagged 23")) << future;
  EXPECT_EQ(OrDie(map_.reader().OldestRevision()), 40);
}

TEST_P(Compaction, ReachesReadersThatHoldAnOldSnapshot) {
  const auto gone = OrDie(map_.reader().At(20));
  const auto kept = OrDie(map_.reader().At(45));
  Compact(40);
  const auto nodes = gone->ScanNodes({}, {}, {}, [](const Node&) { return true; });
  EXPECT_EQ(ReasonOf(nodes), Reason::kRevisionCompacted);
  EXPECT_EQ(ReasonOf(gone->MeshBlocks().status()), Reason::kRevisionCompacted);
  EXPECT_EQ(OrDie(test::Dump(*kept)), said_[45]);
}

TEST_P(Compaction, LetsTheMapGoOnAndBeCompactedAgain) {
  OrDie(map_.writer().SetTag("summer", 23, ""));
  Compact(40);
  for (int sequence = kWrittenCount + 1; sequence <= kWrittenCount + 20; ++sequence) {
    Write(sequence);
  }
  for (const Revision revision : {23, 40, 60, 61, 80}) ExpectSays(revision);
  OrDie(map_.writer().RemoveTag("summer"));
  Compact(70);
  EXPECT_EQ(ReasonOf(map_.reader().At(23).status()), Reason::kRevisionCompacted);
  for (const Revision revision : {70, 80}) ExpectSays(revision);
  ExpectSound();
}

TEST_P(Compaction, KnowsDeltasOfRevisionsThatAreGone) {
  Compact(60);
  const auto again = OrDie(map_.writer().Commit(test::DeltaOfStream({.seed = 5}, 12)));
  EXPECT_TRUE(again.replayed);
  EXPECT_EQ(OrDie(map_.reader().Head()).revision, 60);
}

TEST_P(Compaction, TellsWhatWasTouchedAcrossTheGap) {
  OrDie(map_.writer().SetTag("summer", 23, ""));
  const Touched before = OrDie(map_.reader().TouchedBetween(23, 60, {}));
  Compact(40);
  const Touched after = OrDie(map_.reader().TouchedBetween(23, 60, {}));
  EXPECT_EQ(after.nodes, before.nodes);
  EXPECT_EQ(after.edges, before.edges);
  EXPECT_EQ(after.tracks, before.tracks);
  EXPECT_EQ(after.mesh_blocks, before.mesh_blocks);
  EXPECT_EQ(ReasonOf(map_.reader().TouchedBetween(22, 60, {}).status()),
            Reason::kRevisionCompacted);
}

TEST_P(Compaction, IsSoundWhereverItIsStoppedAndGoesOn) {
  OrDie(map_.writer().SetTag("summer", 23, ""));
  for (int steps = 0;; ++steps) {
    SCOPED_TRACE("stopped after " + std::to_string(steps) + " steps");
    int left = steps;
    const auto report = map_.writer().Compact(
        40, [&] { return left-- > 0 ? absl::OkStatus() : absl::CancelledError("enough"); }, {});
    for (const Revision revision : {23, 40, 60}) ExpectSays(revision);
    ExpectSound();
    if (report.ok()) break;
    ASSERT_EQ(report.status().code(), absl::StatusCode::kCancelled);
    ASSERT_LT(steps, 1000);
  }
}

TEST_P(Compaction, DoesNotBringBackWhatIsGone) {
  OrDie(map_.writer().SetTag("summer", 23, ""));
  Compact(40);
  EXPECT_EQ(ReasonOf(map_.writer().Compact(30, {}, {}).status()), Reason::kRevisionCompacted);
  EXPECT_EQ(ReasonOf(map_.writer().Compact(61, {}, {}).status()), Reason::kRevisionInFuture);
  EXPECT_EQ(Compact(23).oldest, 40);
  EXPECT_EQ(Compact(40).row_count, 0);
}

class CompactionOfAssets : public test::OnEveryBackend {
 protected:
  static Asset MakeAsset(const std::string& content) {
    return {ComputeSha256(content), "model/ply", content};
  }
  Node Chair(uint64_t index, const Asset& asset) {
    const double x = static_cast<double>(index);
    Node node = test::MakeObject(index, "chair", test::BoxOf(x, 0, 0, x + 0.5, 1, 1));
    node.object.emplace().model = asset.sha256;
    return node;
  }
  bool IsThere(const Asset& asset) {
    return OrDie(map_.reader().Latest())->ReadAsset(asset.sha256).ok();
  }

  TestMap map_{GetParam()};
};

DSG_ON_EVERY_BACKEND(CompactionOfAssets);

TEST_P(CompactionOfAssets, DropsThoseThatNothingReadableRefersTo) {
  const Asset shared = MakeAsset(std::string(5000, 'a'));
  const Asset lonely = MakeAsset(std::string(3'000'000, 'b'));
  const Asset topology = MakeAsset("c");
  GraphDelta delta;
  delta.assets = {shared, lonely, topology};
  delta.nodes = {Chair(1, shared), Chair(2, shared), Chair(3, lonely), test::MakeHuman(1, "")};
  delta.shapes.push_back({NodeId('H', 1), topology.sha256, {{.time_ns = 5}}});
  map_.MustCommit(delta);
  delta = {};
  delta.retirements = {{NodeId('O', 1), std::nullopt}, {NodeId('O', 3), std::nullopt}};
  const Revision retired = map_.MustCommit(delta);
  OrDie(map_.writer().SetTag("with", retired - 1, ""));
  EXPECT_EQ(OrDie(map_.writer().Compact(retired, {}, {})).asset_count, 0);
  EXPECT_TRUE(IsThere(lonely)) << "a tagged revision shows who has it";
  OrDie(map_.writer().RemoveTag("with"));
  const auto report = OrDie(map_.writer().Compact(retired, {}, {}));
  EXPECT_EQ(report.asset_count, 1);
  if (!map_.store().folder().empty()) {
    EXPECT_LT(report.bytes_after, report.bytes_before - 2'900'000);
  }
  EXPECT_FALSE(IsThere(lonely));
  EXPECT_TRUE(IsThere(shared));
  EXPECT_TRUE(IsThere(topology));
  EXPECT_EQ(map_.Problems(), "");
  // It may come again.
  delta = {};
  delta.assets = {lonely};
  delta.nodes = {Chair(4, lonely)};
  map_.MustCommit(delta);
  EXPECT_TRUE(IsThere(lonely));
  EXPECT_EQ(map_.Problems(), "");
}

TEST_P(CompactionOfAssets, KeepsOneThatIsAboutToBeReferredTo) {
  const Asset asset = MakeAsset("model");
  GraphDelta delta;
  map_.MustCommit(delta);
  delta.assets = {asset};
  const Revision head = map_.MustCommit(delta);
  OrDie(map_.writer().Compact(head, {}, {}));
  EXPECT_TRUE(IsThere(asset));
  delta = {};
  delta.nodes = {Chair(1, asset)};
  map_.MustCommit(delta);
  EXPECT_EQ(map_.Problems(), "");
}

class CompactionOfAnEmptyMap : public test::OnEveryBackend {};
DSG_ON_EVERY_BACKEND(CompactionOfAnEmptyMap);

TEST_P(CompactionOfAnEmptyMap, DoesNothing) {
  TestMap map(GetParam());
  const auto report = map.writer().Compact(0, {}, {});
  ASSERT_TRUE(report.ok()) << report.status();
  EXPECT_EQ(report->row_count, 0);
}

}  // namespace
}  // namespace dsg
