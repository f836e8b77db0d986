// SPDX-License-Identifier: Apache-2.0
// What was erased is not in any file any more: bytes are planted, and looked for.
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>

#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "schema/store/sqlite/database.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

constexpr size_t kPatternBytes = 20;

class Traces : public testing::Test {
 protected:
  std::string Random(size_t size, bool is_text) {
    std::string bytes(size, '\0');
    for (char& c : bytes) {
      c = is_text ? static_cast<char>('a' + random_() % 26) : static_cast<char>(random_());
    }
    return bytes;
  }

  // Text that is nowhere else, and is remembered.
  std::string Plant() {
    planted_.push_back(Random(kPatternBytes, true));
    return planted_.back();
  }

  // Things of the room R1 with secrets in names, attributes, edges and assets; written several
  // times, so that their rows are moved about in the pages.
  GraphDelta Secrets(int round) {
    GraphDelta delta;
    for (uint64_t i = 0; i < 6; ++i) {
      const double x = 26.0 + static_cast<double>(i);
      Node node = MakeObject(5000 + i, Plant(), BoxOf(x, 10, 0, x + 0.5, 11, 1));
      node.attributes["note"] = Plant() + Random(static_cast<size_t>(30 * round), true);
      Asset asset;
      asset.media_type = "model/ply";
      asset.content = Plant() + Random(3000, false);
      asset.sha256 = ComputeSha256(asset.content);
      node.object.emplace().model = asset.sha256;
      delta.assets.push_back(asset);
      Edge edge = MakeEdge(NodeId('R', 1), relations::kContains, node.id);
      edge.attributes["why"] = Plant();
      delta.nodes.push_back(std::move(node));
      delta.edges.push_back(std::move(edge));
    }
    return delta;
  }

  // Bytes out of the middle of stored payloads, which compression has made of the content.
  // Those that stand in what `others` gives too are left out: agents that turn alike do.
  void PlantPayloads(const std::string& database, const std::string& sql,
                     const std::string& others) {
    const std::vector<std::string> kept = Payloads(database, others);
    for (const std::string& payload : Payloads(database, sql)) {
      if (payload.size() < 3 * kPatternBytes) continue;
      const std::string pattern = payload.substr(payload.size() / 2, kPatternBytes);
      const bool is_shared = std::any_of(kept.begin(), kept.end(), [&](const std::string& other) {
        return other.find(pattern) != other.npos;
      });
      if (!is_shared) planted_.push_back(pattern);
    }
  }

  static std::vector<std::string> Payloads(const std::string& database, const std::string& sql) {
    std::vector<std::string> payloads;
    sqlite3* db = nullptr;
    sqlite3_stmt* query = nullptr;
    if (sqlite3_open_v2(database.c_str(), &db, SQLITE_OPEN_READONLY, nullptr) != SQLITE_OK ||
        sqlite3_prepare_v2(db, sql.c_str(), -1, &query, nullptr) != SQLITE_OK) {
      std::abort();
    }
    while (sqlite3_step(query) == SQLITE_ROW) {
      payloads.emplace_back(static_cast<const char*>(sqlite3_column_blob(query, 0)),
                            static_cast<size_t>(sqlite3_column_bytes(query, 0)));
    }
    sqlite3_finalize(query);
    sqlite3_close(db);
    return payloads;
  }

  size_t CountHits(const std::vector<std::string>& files) {
    size_t hit_count = 0;
    for (const std::string& path : files) {
      const std::string bytes = fs::exists(path) ? ReadFile(path) : std::string();
      for (const std::string& pattern : planted_) {
        const std::boyer_moore_horspool_searcher searcher(pattern.begin(), pattern.end());
        if (std::search(bytes.begin(), bytes.end(), searcher) == bytes.end()) continue;
        ++hit_count;
        hits_.push_back(absl::StrCat(path, ": ", pattern));
      }
    }
    return hit_count;
  }

  // Nodes of the R*Tree that hold more than their entries.
  size_t CountStaleBoxes() const {
    constexpr size_t kEntryBytes = 40;
    size_t count = 0;
    for (const std::string& node :
         Payloads(map_.database_path(), "SELECT data FROM segment_box_node")) {
      const size_t entries =
          static_cast<uint8_t>(node[2]) * size_t{256} + static_cast<uint8_t>(node[3]);
      if (node.find_first_not_of('\0', 4 + entries * kEntryBytes) != node.npos) ++count;
    }
    return count;
  }

  std::vector<std::string> Files() const {
    return {map_.database_path(), map_.database_path() + "-wal", map_.database_path() + "-shm"};
  }

  // The agent H1, its mesh and the things with secrets go, as one who forgets a room would do it.
  Erasure RetireSecrets() {
    Erasure erasure;
    erasure.assets = true;
    GraphDelta delta;
    for (uint64_t i = 0; i < 6; ++i) erasure.nodes.push_back(NodeId('O', 5000 + i));
    erasure.nodes.push_back(NodeId('H', 1));
    for (const NodeId id : erasure.nodes) delta.retirements.push_back({id, std::nullopt});
    for (int32_t x = 0; x < 12; x += 4) erasure.mesh_blocks.push_back({x, 0, 0});
    delta.mesh_removals = erasure.mesh_blocks;
    delta.is_forgetting = true;
    map_.MustCommit(std::move(delta));
    return erasure;
  }

  std::mt19937_64 random_{RecordSeed()};
  TestMap map_{Spec(TrajectoryCodec::kQuantized)};
  std::vector<std::string> planted_;
  std::vector<std::string> hits_;
};

TEST_F(Traces, OfWhatWasErasedAreInNoFile) {
  int64_t sequence = 0;
  const auto live = [&](int64_t count) {
    for (const int64_t end = sequence + count; sequence < end;) {
      map_.MustCommit(DeltaOfStream({}, ++sequence));
    }
  };
  live(20);
  for (int round = 0; round < 4; ++round) {
    map_.MustCommit(Secrets(round));
    live(15);
  }
  // Pages of old rows have been freed and filled again.
  OrDie(map_.writer().Compact(30, {}, {}));
  live(10);
  const size_t text_count = planted_.size();
  const Erasure erasure = RetireSecrets();
  const std::string of_agent = " WHERE id >> 42 = (SELECT slot FROM track WHERE agent = 256 + 72)";
  const std::string of_others =
      " WHERE id >> 42 <> (SELECT slot FROM track WHERE agent = 256 + 72)";
  PlantPayloads(map_.database_path(), "SELECT payload FROM trajectory_history" + of_agent,
                "SELECT payload FROM trajectory_history" + of_others +
                    " UNION ALL SELECT payload FROM trajectory_segment");
  PlantPayloads(map_.database_path(), "SELECT payload FROM mesh_block_history",
                "SELECT payload FROM mesh_block");
  PlantPayloads(map_.database_path(), "SELECT payload FROM shape_history WHERE agent = 256 + 72",
                "SELECT payload FROM shape_segment");
  ASSERT_GE(planted_.size(), 100u);
  // Those of rounds that were compacted away may be gone already.
  EXPECT_GT(CountHits(Files()), planted_.size() / 2);
  EXPECT_GT(CountStaleBoxes(), 0u);
  hits_.clear();
  const EraseReport report = OrDie(map_.writer().Erase(erasure, {}, {}));
  EXPECT_TRUE(report.is_clean);
  EXPECT_TRUE(report.other_files.empty());
  EXPECT_GE(report.asset_count, 6);
  const std::string copy = map_.folder() + "/copy";
  OrDie(OrDie(map_.store().OpenMap(kMap))->CopyTo(copy, {}, {}));
  std::vector<std::string> files = Files();
  files.push_back(copy);
  EXPECT_EQ(CountHits(files), 0u) << hits_.front();
  EXPECT_EQ(CountStaleBoxes(), 0u);
  EXPECT_EQ(map_.Problems(), "");
  std::printf("%zu patterns planted, %zu of them text; 0 left\n", planted_.size(), text_count);
}

TEST_F(Traces, AreReportedWhileAReaderKeepsTheLog) {
  map_.MustCommit(DeltaOfStream({}, 1));
  map_.MustCommit(Secrets(0));
  std::ofstream(map_.database_path() + ".format1") << "old";
  GraphDelta delta;
  for (uint64_t i = 0; i < 6; ++i)
    delta.retirements.push_back({NodeId('O', 5000 + i), std::nullopt});
  map_.MustCommit(delta);
  Erasure erasure;
  erasure.assets = true;
  for (uint64_t i = 0; i < 6; ++i) erasure.nodes.push_back(NodeId('O', 5000 + i));
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open_v2(map_.database_path().c_str(), &db, SQLITE_OPEN_READONLY, nullptr),
            SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(db, "BEGIN; SELECT count(*) FROM node", nullptr, nullptr, nullptr),
            SQLITE_OK);
  const EraseReport kept = OrDie(map_.writer().Erase(erasure, {}, {}));
  EXPECT_FALSE(kept.is_clean);
  EXPECT_GT(CountHits(Files()), 0u);
  sqlite3_close(db);
  hits_.clear();
  EXPECT_TRUE(OrDie(map_.writer().Erase(erasure, {}, {})).is_clean);
  EXPECT_EQ(CountHits(Files()), 0u);
  EXPECT_EQ(kept.other_files, std::vector<std::string>{map_.database_path() + ".format1"});
}

// Rows that come, change size and move until their pages have been rearranged many times.
class Churn {
 public:
  Churn(sqlite::Database* db, uint64_t seed) : db_(*db), random_(seed) {}

  void Run(int step_count) {
    for (int step = 0; step < step_count; ++step) {
      if (step % 50 == 0) OrDie(db_.Execute("BEGIN"));
      const auto key = static_cast<int64_t>(random_() % 400);
      OrDie(sqlite::Query(db_,
                          "INSERT INTO past SELECT key, ?2, name, payload FROM now"
                          " WHERE key = ?1")
                .Bind(key, step)
                .Run());
      std::string name = Text(20);
      OrDie(sqlite::Query(db_, "INSERT OR REPLACE INTO now VALUES (?1, ?2, ?3)")
                .Bind(key, name, name + Text(random_() % 300))
                .Run());
      names_[key].push_back(std::move(name));
      if (step % 50 == 49) OrDie(db_.Execute("COMMIT"));
    }
  }

  /// Every other key goes; what its rows held.
  std::vector<std::string> DropHalf() {
    std::vector<std::string> gone;
    for (auto& [key, names] : names_) {
      if (key % 2 == 0) continue;
      for (const char* sql :
           {"DELETE FROM past WHERE key = ?1", "DELETE FROM now WHERE key = ?1"}) {
        OrDie(sqlite::Query(db_, sql).Bind(key).Run());
      }
      std::move(names.begin(), names.end(), std::back_inserter(gone));
    }
    return gone;
  }

 private:
  std::string Text(size_t size) {
    std::string text(size, '\0');
    for (char& c : text) c = static_cast<char>('a' + random_() % 26);
    return text;
  }

  sqlite::Database& db_;
  std::mt19937_64 random_;
  std::map<int64_t, std::vector<std::string>> names_;
};

TEST_F(Traces, AreNotInTheMiddleOfPagesEither) {
  TempFolder folder;
  for (uint64_t seed = 0; seed < 3; ++seed) {
    const std::string path = absl::StrCat(folder.path(), "/", seed, ".db");
    const auto db = OrDie(sqlite::Database::Open(path, sqlite::Database::Mode::kCreate, "churn"));
    // Not synced: nothing of it is to last.
    OrDie(
        db->Execute("PRAGMA synchronous=OFF;"
                    "CREATE TABLE now (key INTEGER PRIMARY KEY, name TEXT, payload BLOB);"
                    "CREATE INDEX now_name ON now (name);"
                    "CREATE TABLE past (key INTEGER, step INTEGER, name TEXT, payload BLOB);"
                    "CREATE UNIQUE INDEX past_key ON past (key, step);"));
    Churn churn(db.get(), seed);
    churn.Run(4000);
    planted_ = churn.DropHalf();
    OrDie(sqlite::Query(*db, "PRAGMA incremental_vacuum(100000)").Run());
    ASSERT_TRUE(db->Checkpoint(true));
    EXPECT_EQ(CountHits({path}), 0u) << "seed " << seed;
  }
}

}  // namespace
}  // namespace dsg::test
