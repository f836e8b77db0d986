// SPDX-License-Identifier: Apache-2.0
// Logs that are committed while they grow: stopped, killed and taken up, the map ends up the same.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/pipeline/follow_fixture.h"

namespace dsg::ingest {
namespace {

using std::chrono::milliseconds;

std::string Rows(int from, int to) {
  std::string rows;
  for (int i = from; i < to; ++i) {
    for (const std::string agent : {"zoe", "bob", "eve"}) {
      absl::StrAppend(&rows, i, ".25,", agent, ",", 0.5 * i, ",", agent.size(), "\n");
    }
  }
  return rows;
}

const std::string kHeader = "time,id,x,y\n";

TEST_F(FollowTest, ATableIsCommittedWhileItGrows) {
  const std::string path = folder_.Write("log.csv", kHeader + Rows(0, 2));
  std::atomic<bool> stop = false;
  absl::StatusOr<IngestSummary> summary = absl::UnknownError("not run");
  std::thread run(
      [&] { summary = Ingest("office", path, FollowFor(milliseconds(60'000), &stop)); });
  const auto wait_for = [&](int64_t pose_count) {
    const auto begin = std::chrono::steady_clock::now();
    while (true) {
      const auto map = store_->OpenMap("office");
      if (map.ok() && (*(*map)->Head()).pose_count >= pose_count) break;
      if (std::chrono::steady_clock::now() - begin > std::chrono::seconds(30)) break;
      std::this_thread::sleep_for(milliseconds(20));
    }
    return std::chrono::steady_clock::now() - begin;
  };
  EXPECT_LT(wait_for(6), std::chrono::seconds(5));
  for (int i = 2; i < 4; ++i) {
    std::ofstream(path, std::ios::app) << Rows(i, i + 1);
    // Nothing is promised to the millisecond: rows wait for others of their instant, and to be
    // committed.
    EXPECT_LT(wait_for(3 * (i + 1)), std::chrono::seconds(5));
  }
  stop = true;
  run.join();
  ASSERT_TRUE(summary.ok()) << summary.status();
  EXPECT_FALSE(summary->is_paused);
  ASSERT_TRUE(Ingest("whole", path, {}).ok());
  EXPECT_EQ(TracksOf("office"), TracksOf("whole"));
}

TEST_F(FollowTest, ATableThatWasStoppedAnywhereGoesOn) {
  const std::string whole = folder_.Write("whole.csv", kHeader + Rows(0, 30));
  MakeRooms("whole");
  ASSERT_TRUE(Ingest("whole", whole, {}).ok());
  EXPECT_NE(TracksOf("whole").find("stay R2"), std::string::npos) << TracksOf("whole");
  for (const int cut : {1, 7, 29}) {
    for (const int commit_count_max : {0, 1, -1}) {
      const std::string map = absl::StrCat("cut", cut, "at", commit_count_max + 1);
      SCOPED_TRACE(map);
      MakeRooms(map);
      const std::string path = folder_.Write("log.csv", kHeader + Rows(0, cut));
      const auto first = Ingest(map, path, FollowFor(milliseconds(0)), commit_count_max);
      EXPECT_EQ(first.ok(), commit_count_max != 0 && !(commit_count_max == 1 && cut > 1));
      folder_.Write("log.csv", kHeader + Rows(0, 30));
      const auto rest = Ingest(map, path, FollowFor(milliseconds(0)));
      ASSERT_TRUE(rest.ok()) << rest.status();
      EXPECT_EQ(TracksOf(map), TracksOf("whole"));
      const Revision head = HeadOf(map).revision;
      ASSERT_TRUE(Ingest(map, path, FollowFor(milliseconds(0))).ok());
      ASSERT_TRUE(Ingest(map, whole, {}).ok());
      EXPECT_EQ(HeadOf(map).revision, head);
    }
  }
}

TEST_F(FollowTest, ATableOfOtherPosesIsRefused) {
  const std::string path = folder_.Write("log.csv", kHeader + Rows(0, 5));
  ASSERT_TRUE(Ingest("office", path, FollowFor(milliseconds(0))).ok());
  folder_.Write("log.csv", kHeader + Rows(0, 4) + "4.25,zoe,99,3\n");
  EXPECT_EQ(ReasonOf(Ingest("office", path, FollowFor(milliseconds(0))).status()),
            Reason::kTrackConflict);
}

TEST_F(FollowedRoom, EndsInTheSameMapHoweverOftenItWasStopped) {
  const auto whole = Ingest("whole", Begin(1.0), FollowFor(milliseconds(0)));
  ASSERT_TRUE(whole.ok()) << whole.status();
  ASSERT_TRUE(whole->mapping.has_value());
  const RevisionInfo expected = HeadOf("whole");
  EXPECT_GT(expected.revision, 6);
  EXPECT_EQ(expected.pose_count, kScanCount);
  // Stopped, with half of it and then with more.
  for (const double share : {0.5, 0.8}) {
    std::atomic<bool> stop = false;
    const std::string path = Begin(share);
    std::thread stopper([&] {
      std::this_thread::sleep_for(milliseconds(1500));
      stop = true;
    });
    const auto paused = Ingest("stopped", path, FollowFor(milliseconds(60'000), &stop));
    stopper.join();
    ASSERT_TRUE(paused.ok()) << paused.status();
    EXPECT_TRUE(paused->is_paused);
  }
  EXPECT_GT(HeadOf("stopped").pose_count, 2);
  EXPECT_LT(HeadOf("stopped").pose_count, kScanCount);
  ASSERT_TRUE(Ingest("stopped", Begin(1.0), FollowFor(milliseconds(0))).ok());
  EXPECT_EQ(HeadOf("stopped").revision, expected.revision);
  EXPECT_EQ(HeadOf("stopped").digest, expected.digest);
  // Killed at any commit, those of the end among them.
  for (const Revision cut : {Revision{1}, expected.revision / 2, expected.revision - 1}) {
    SCOPED_TRACE(cut);
    const std::string map = absl::StrCat("killed", cut);
    EXPECT_FALSE(Ingest(map, Begin(1.0), FollowFor(milliseconds(0)), static_cast<int>(cut)).ok());
    ASSERT_TRUE(Ingest(map, Begin(1.0), FollowFor(milliseconds(0))).ok());
    EXPECT_EQ(HeadOf(map).digest, expected.digest);
  }
  ASSERT_TRUE(Ingest("whole", Begin(1.0), FollowFor(milliseconds(0))).ok());
  EXPECT_EQ(HeadOf("whole").digest, expected.digest);
}

TEST_F(FollowedRoom, GivesWhatTheFinishedFileGives) {
  ASSERT_TRUE(Ingest("followed", Begin(1.0), FollowFor(milliseconds(0))).ok());
  ASSERT_TRUE(Ingest("finished", Begin(1.0), {}).ok());
  const auto followed = *(*store_->OpenMap("followed"))->Latest();
  const auto finished = *(*store_->OpenMap("finished"))->Latest();
  EXPECT_EQ(TracksOf("followed"), TracksOf("finished"));
  for (const LayerId layer : {layers::kBuildings, layers::kRooms, layers::kPlaces,
                              layers::kStructures, layers::kObjects, layers::kAgents}) {
    const std::vector<Node> a = NodesOf("followed", layer);
    const std::vector<Node> b = NodesOf("finished", layer);
    ASSERT_EQ(a.size(), b.size()) << layer;
    for (size_t i = 0; i < a.size(); ++i) {
      EXPECT_EQ(a[i].id, b[i].id);
      EXPECT_EQ(a[i].map_T_node.position, b[i].map_T_node.position);
    }
  }
  const std::vector<BlockIndex> blocks = *followed->MeshBlocks();
  EXPECT_EQ(blocks, *finished->MeshBlocks());
  for (const BlockIndex& index : blocks) {
    EXPECT_EQ(followed->ReadMeshBlock(index)->positions_map,
              finished->ReadMeshBlock(index)->positions_map);
  }
}

TEST_F(FollowedRoom, IsRefusedIfItGrowsAfterItsEndWasTold) {
  ASSERT_TRUE(Ingest("office", Begin(0.6), FollowFor(milliseconds(0))).ok());
  const RevisionInfo head = HeadOf("office");
  const auto again = Ingest("office", Begin(0.6), FollowFor(milliseconds(0)));
  ASSERT_TRUE(again.ok()) << again.status();
  EXPECT_EQ(HeadOf("office").digest, head.digest);
  const absl::Status refused = Ingest("office", Begin(1.0), FollowFor(milliseconds(0))).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(refused)) << refused;
  EXPECT_NE(refused.message().find("it has grown since"), std::string::npos) << refused;
  EXPECT_EQ(HeadOf("office").digest, head.digest);
}

TEST_F(FollowedRoom, IsRefusedIfItEndsBeforeWhatTheMapHolds) {
  ASSERT_TRUE(Ingest("whole", Begin(1.0), FollowFor(milliseconds(0))).ok());
  const int cut = static_cast<int>(HeadOf("whole").revision) * 3 / 4;
  EXPECT_FALSE(Ingest("office", Begin(1.0), FollowFor(milliseconds(0)), cut).ok());
  const RevisionInfo head = HeadOf("office");
  const absl::Status refused = Ingest("office", Begin(0.55), FollowFor(milliseconds(0))).status();
  EXPECT_TRUE(absl::IsFailedPrecondition(refused)) << refused;
  EXPECT_NE(refused.message().find("and it ends after"), std::string::npos) << refused;
  EXPECT_EQ(HeadOf("office").digest, head.digest);
  ASSERT_TRUE(Ingest("office", Begin(1.0), FollowFor(milliseconds(0))).ok());
  EXPECT_EQ(HeadOf("office").digest, HeadOf("whole").digest);
}

}  // namespace
}  // namespace dsg::ingest
