// SPDX-License-Identifier: Apache-2.0
// Maps of older formats, as they were written by the programs of their time.
#include <gtest/gtest.h>
#include <zstd.h>

#include <filesystem>
#include <fstream>

#include "absl/strings/match.h"
#include "schema/codec/checksum.h"
#include "schema/store/sqlite/database.h"
#include "schema/store/sqlite/map_file.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg {
namespace {

namespace fs = std::filesystem;
using test::kMap;
using test::OrDie;
using test::ReadFile;

// A store that holds the map of format 1: 24 deltas of the delta stream with these options.
class Format1 : public ::testing::Test {
 protected:
  static constexpr test::DeltaStreamOptions kOptions = {
      .seed = 7, .mesh_vertex_count = 4, .asset_bytes = 60, .poses_per_append = 6};

  Format1() {
    const std::string packed =
        ReadFile(std::string(DSG_SOURCE_DIR) + "/tests/data/store_format_1.db.zst");
    std::string bytes(ZSTD_getFrameContentSize(packed.data(), packed.size()), '\0');
    EXPECT_EQ(ZSTD_decompress(bytes.data(), bytes.size(), packed.data(), packed.size()),
              bytes.size());
    fs::create_directory(folder_.path() + "/" + kMap);
    std::ofstream(path(), std::ios::binary) << bytes;
    store_ = OrDie(GraphStore::Open(folder_.path(), {}));
  }

  std::string path() const { return folder_.path() + "/" + kMap + "/graph.db"; }

  void RunSql(const char* sql) {
    const auto db = OrDie(sqlite::Database::Open(path(), sqlite::Database::Mode::kWrite, kMap));
    OrDie(db->Execute(sql));
  }

  static std::string DigestAt(MapReader& map, Revision revision) {
    return ToHex(OrDie(OrDie(map.At(revision))->Stats()).at.digest);
  }

  void ExpectIsWhatItWas() {
    const auto map = OrDie(store_->OpenMap(kMap));
    EXPECT_EQ(DigestAt(*map, 1),
              "7f8d90b53f0cc75ac37c47deab9e9a101654d431afe91e12f50045a64657f583");
    EXPECT_EQ(DigestAt(*map, 8),
              "c6dc36182990d8f519a2938a978b75c56c0b9171972744a82610312100bec41a");
    EXPECT_EQ(DigestAt(*map, 24),
              "0c3c38c0397be6112958784e0277bc33462d6da178e6c39b4a89c1e0d0ec6662");
    const VerifyReport report = OrDie(map->Verify({}, {}));
    EXPECT_TRUE(report.problems.empty()) << report.problems.front();
    EXPECT_EQ(report.revision_count, 24);
  }

  test::TempFolder folder_;
  std::unique_ptr<GraphStore> store_;
};

TEST_F(Format1, IsRefusedNamingTheUpgradeAndNotTouched) {
  const std::string before = ReadFile(path());
  for (const absl::Status& status :
       {store_->OpenMap(kMap).status(), store_->OpenWriter(kMap).status()}) {
    EXPECT_EQ(ReasonOf(status), Reason::kFormatTooOld);
    EXPECT_TRUE(absl::StrContains(status.message(), "dsg upgrade")) << status;
  }
  EXPECT_EQ(ReadFile(path()), before);
}

TEST_F(Format1, IsTheSameMapAfterItsUpgrade) {
  const std::string before = ReadFile(path());
  const UpgradeReport report = OrDie(store_->UpgradeMap(kMap));
  EXPECT_EQ(report.from_format, 1);
  EXPECT_EQ(report.to_format, kStoreFormatVersion);
  EXPECT_EQ(ReadFile(report.copy), before);
  ExpectIsWhatItWas();
}

TEST_F(Format1, IsNotKeptWhereALinkPoints) {
  const std::string victim = folder_.path() + "/victim";
  std::ofstream(victim) << "mine";
  std::filesystem::create_symlink(victim, path() + ".format1.new");
  const UpgradeReport report = OrDie(store_->UpgradeMap(kMap));
  EXPECT_EQ(ReadFile(victim), "mine");
  EXPECT_FALSE(std::filesystem::is_symlink(report.copy));
}

TEST_F(Format1, IsUpgradedOnce) {
  OrDie(store_->UpgradeMap(kMap));
  const UpgradeReport again = OrDie(store_->UpgradeMap(kMap));
  EXPECT_EQ(again.from_format, kStoreFormatVersion);
  EXPECT_EQ(again.copy, "");
  ExpectIsWhatItWas();
}

TEST_F(Format1, GoesOnAfterItsUpgrade) {
  OrDie(store_->UpgradeMap(kMap));
  const auto writer = OrDie(store_->OpenWriter(kMap));
  EXPECT_TRUE(OrDie(writer->Commit(test::DeltaOfStream(kOptions, 24))).replayed);
  EXPECT_EQ(OrDie(writer->Commit(test::DeltaOfStream(kOptions, 25))).revision, 25);
  OrDie(writer->SetTag("old", 8, ""));
  const CompactReport report = OrDie(writer->Compact(25, {}, {}));
  EXPECT_LT(report.bytes_after, report.bytes_before);
  const auto map = OrDie(store_->OpenMap(kMap));
  EXPECT_EQ(DigestAt(*map, 8), "c6dc36182990d8f519a2938a978b75c56c0b9171972744a82610312100bec41a");
  EXPECT_TRUE(OrDie(map->Verify({}, {})).problems.empty());
}

TEST_F(Format1, CanBeErasedFromAndSaysWhereTheOldCopyIs) {
  const UpgradeReport upgraded = OrDie(store_->UpgradeMap(kMap));
  const auto writer = OrDie(store_->OpenWriter(kMap));
  const std::vector<NodeId> nodes = {NodeId('O', 8), NodeId('H', 3)};
  GraphDelta delta;
  delta.session_id = "prune";
  delta.sequence = 1;
  for (const NodeId id : nodes) delta.retirements.push_back({id, std::nullopt});
  OrDie(writer->Commit(delta));
  const EraseReport report = OrDie(writer->Erase({.nodes = nodes, .assets = true}, {}, {}));
  EXPECT_TRUE(report.is_clean);
  EXPECT_EQ(report.other_files, std::vector<std::string>{upgraded.copy});
  const auto map = OrDie(store_->OpenMap(kMap));
  EXPECT_EQ(ReasonOf(OrDie(map->At(20))->GetNode(NodeId('O', 8)).status()), Reason::kNodeUnknown);
  const VerifyReport verified = OrDie(map->Verify({}, {}));
  EXPECT_TRUE(verified.problems.empty()) << verified.problems.front();
  // From now on it shrinks in steps.
  const auto db = OrDie(sqlite::Database::Open(path(), sqlite::Database::Mode::kRead, kMap));
  EXPECT_EQ(OrDie(db->QueryInt("PRAGMA auto_vacuum")), 2);
}

// Of a build before the first release.
TEST_F(Format1, GetsListsOfWhatWasTouchedIfItHasNone) {
  RunSql("DROP TABLE touched");
  OrDie(store_->UpgradeMap(kMap));
  ExpectIsWhatItWas();
}

TEST_F(Format1, IsNotUpgradedWhileItIsWritten) {
  const auto holder = sqlite::WriterLock::Acquire(folder_.path(), kMap, "robot");
  ASSERT_TRUE(holder.ok());
  EXPECT_EQ(ReasonOf(store_->UpgradeMap(kMap).status()), Reason::kWriterLocked);
}

// A map as the programs of format 2 left it: what format 3 brought is taken away again.
class Format2 : public ::testing::Test {
 protected:
  Format2() {
    for (int64_t sequence = 1; sequence <= 12; ++sequence) {
      map_.MustCommit(test::DeltaOfStream({.seed = 7}, sequence));
    }
    content_ = OrDie(test::Dump(*map_.Latest()));
    map_.Close();
    const auto db =
        OrDie(sqlite::Database::Open(map_.database_path(), sqlite::Database::Mode::kWrite, kMap));
    OrDie(
        db->Execute("ALTER TABLE revision DROP COLUMN delta_checksum;"
                    "ALTER TABLE session DROP COLUMN last_checksum;"
                    "ALTER TABLE map DROP COLUMN incarnation;"
                    "DROP TABLE noted_erasure;"
                    "DROP INDEX stay_room_long; DROP INDEX stay_place_long;"
                    "DROP INDEX stay_history_room_long; DROP INDEX stay_history_place_long;"
                    "PRAGMA user_version=2"));
    store_ = OrDie(GraphStore::Open(map_.folder(), {}));
  }

  test::TestMap map_{test::Spec(TrajectoryCodec::kQuantized)};
  std::string content_;
  std::unique_ptr<GraphStore> store_;
};

TEST_F(Format2, IsRefusedUntilItIsUpgradedAndIsTheSameMapThen) {
  EXPECT_EQ(ReasonOf(store_->OpenMap(kMap).status()), Reason::kFormatTooOld);
  const UpgradeReport report = OrDie(store_->UpgradeMap(kMap));
  EXPECT_EQ(report.from_format, 2);
  EXPECT_EQ(report.to_format, 3);
  const auto map = OrDie(store_->OpenMap(kMap));
  EXPECT_EQ(OrDie(test::Dump(*OrDie(map->Latest()))), content_);
  EXPECT_TRUE(OrDie(map->Verify({}, {})).problems.empty());
  EXPECT_NE(map->incarnation().front(), '-');
}

TEST_F(Format2, KnowsItsDeltasByTheirNamesAndNewOnesByTheirContentToo) {
  OrDie(store_->UpgradeMap(kMap));
  const auto writer = OrDie(store_->OpenWriter(kMap));
  GraphDelta other = test::DeltaOfStream({.seed = 8}, 12);
  other.session_id = "test";
  EXPECT_TRUE(OrDie(writer->Commit(other)).replayed);
  other.sequence = 13;
  other.labels = {{900, "new"}};
  GraphDelta plain;
  plain.session_id = "test";
  plain.sequence = 13;
  plain.labels = {{900, "new"}};
  OrDie(writer->Commit(plain));
  EXPECT_TRUE(OrDie(writer->Commit(plain)).replayed);
  EXPECT_EQ(ReasonOf(writer->Commit(other).status()), Reason::kSequenceReused);
}

}  // namespace
}  // namespace dsg
