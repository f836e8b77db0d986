// SPDX-License-Identifier: Apache-2.0
// A bit of the database flips on the disk: it is found, or it changes no answer.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <random>

#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/database.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

void WriteFile(const std::string& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary | std::ios::trunc) << bytes;
}

// What a reader with no memory answers about a map at three revisions. Errors of opening, and of
// each question, stand where the answers would.
std::vector<Answer> AskMap(const std::string& folder, const std::vector<Revision>& revisions) {
  std::vector<Answer> answers;
  const auto fail = [&](const std::string& what, const absl::Status& status) {
    answers.push_back({what, status});
  };
  const auto store = OrDie(GraphStore::Open(folder, {}));
  const auto map = store->OpenMap(kMap);
  if (!map.ok()) {
    fail("open", map.status());
    return answers;
  }
  const auto listed = (*map)->ListRevisions(0, 1000);
  std::string list;
  for (const RevisionInfo& info : listed.ok() ? *listed : std::vector<RevisionInfo>()) {
    absl::StrAppend(&list, info.revision, " ", info.committed_ns, " ", info.author, " ",
                    info.message, " ", info.pose_count, "\n");
  }
  answers.push_back({"ListRevisions", listed.ok() ? absl::StatusOr<std::string>(list)
                                                  : absl::StatusOr<std::string>(listed.status())});
  for (const Revision revision : revisions) {
    const auto snapshot = (*map)->At(revision);
    if (!snapshot.ok()) {
      fail(absl::StrCat("revision ", revision), snapshot.status());
      continue;
    }
    for (Answer& answer : AskEverything(**snapshot)) {
      answer.question = absl::StrCat(answer.question, " at revision ", revision);
      answers.push_back(std::move(answer));
    }
  }
  return answers;
}

bool IsFoundByVerify(const std::string& folder) {
  const auto store = OrDie(GraphStore::Open(folder, {}));
  const auto map = store->OpenMap(kMap);
  if (!map.ok()) return true;
  const auto report = (*map)->Verify({}, {});
  return !report.ok() || !report->problems.empty();
}

// A closed map of the stream, and copies of it with one thing wrong.
class DamagedCopies {
 public:
  DamagedCopies() {
    TestMap map(Spec(TrajectoryCodec::kQuantized));
    for (int64_t s = 1; s <= 40; ++s) OrDie(map.writer().Commit(DeltaOfStream({}, s)));
    // With all behind it that a map of some years has.
    OrDie(map.writer().SetTag("summer", 23, ""));
    OrDie(map.writer().Compact(38, {}, {}));
    const std::vector<NodeId> gone = {NodeId('O', 5), NodeId('H', 3)};
    GraphDelta delta;
    for (const NodeId id : gone) delta.retirements.push_back({id, std::nullopt});
    map.MustCommit(delta);
    OrDie(map.writer().Erase({.nodes = gone, .assets = true}, {}, {}));
    map.Close();
    sound_ = ReadFile(map.database_path());
    std::filesystem::create_directory(folder_.path() + "/" + kMap);
    Write(sound_);
    for (Answer& answer : AskMap(folder_.path(), kRevisions)) {
      expected_[answer.question] = OrDie(std::move(answer.text));
    }
    if (IsFoundByVerify(folder_.path())) std::abort();
  }

  size_t size() const { return sound_.size(); }
  const std::string& sound() const { return sound_; }
  int found_count() const { return found_count_; }
  int harmless_count() const { return harmless_count_; }

  /// Puts `bytes` in place of the database: Verify must say so, or every answer be as before; and
  /// no answer may be another than before.
  void Check(const std::string& bytes, const std::string& what) {
    Write(bytes);
    const bool is_found = IsFoundByVerify(folder_.path());
    bool is_changed = false;
    for (const Answer& answer : AskMap(folder_.path(), kRevisions)) {
      const auto expected = expected_.find(answer.question);
      const bool is_equal =
          answer.text.ok() && expected != expected_.end() && *answer.text == expected->second;
      is_changed = is_changed || !is_equal;
      if (answer.text.ok() && !is_equal) {
        ADD_FAILURE() << what << ": wrong and served without a word: " << answer.question
                      << (is_found ? " (Verify finds it)" : " (nor does Verify find it)");
      }
    }
    EXPECT_TRUE(is_found || !is_changed) << what << ": Verify finds nothing, but answers fail";
    ++(is_found ? found_count_ : harmless_count_);
  }

 private:
  const std::vector<Revision> kRevisions = {41, 38, 23};

  void Write(const std::string& bytes) {
    const std::string path = folder_.path() + "/" + kMap + "/graph.db";
    for (const char* suffix : {"-wal", "-shm"}) std::filesystem::remove(path + suffix);
    WriteFile(path, bytes);
  }

  TempFolder folder_;
  std::string sound_;
  std::map<std::string, std::string> expected_;
  int found_count_ = 0;
  int harmless_count_ = 0;
};

// Flips are DSG_FLIPS; 2,000 for the long run.
TEST(Corruption, OfAnyBitIsFoundOrChangesNoAnswer) {
  DamagedCopies copies;
  std::mt19937_64 random(RecordSeed());
  const int64_t flip_count = EnvNumber("DSG_FLIPS", 100);
  for (int64_t i = 0; i < flip_count; ++i) {
    const size_t at = random() % copies.size();
    const int bit = static_cast<int>(random() % 8);
    std::string bytes = copies.sound();
    bytes[at] = static_cast<char>(bytes[at] ^ (1 << bit));
    copies.Check(bytes,
                 absl::StrCat("bit ", bit, " of byte ", at % 4096, " of page ", at / 4096 + 1));
  }
  std::printf("%lld flips in %zu bytes: %d found by verify, %d without effect\n",
              static_cast<long long>(flip_count), copies.size(), copies.found_count(),
              copies.harmless_count());
}

TEST(Corruption, ByTruncationIsFound) {
  DamagedCopies copies;
  std::mt19937_64 random(RecordSeed());
  for (int i = 0; i < 10; ++i) {
    const size_t size = i < 5 ? copies.size() / 4096 * static_cast<size_t>(i + 1) / 6 * 4096
                              : random() % copies.size();
    copies.Check(copies.sound().substr(0, size), absl::StrCat("cut at byte ", size));
  }
  EXPECT_EQ(copies.found_count(), 10);
}

TEST(Corruption, BySwappedOrEmptiedPagesIsFound) {
  DamagedCopies copies;
  std::mt19937_64 random(RecordSeed());
  const size_t page_count = copies.size() / 4096;
  for (int i = 0; i < 10; ++i) {
    const size_t a = 1 + random() % (page_count - 1);
    const size_t b = 1 + random() % (page_count - 1);
    std::string bytes = copies.sound();
    if (i % 2 == 0) {
      bytes.replace(a * 4096, 4096, copies.sound(), b * 4096, 4096);
      bytes.replace(b * 4096, 4096, copies.sound(), a * 4096, 4096);
    } else {
      bytes.replace(a * 4096, 4096, 4096, '\0');
    }
    copies.Check(bytes, absl::StrCat("pages ", a + 1, " and ", b + 1,
                                     i % 2 == 0 ? " swapped" : ", one empty"));
  }
}

// By a program that seals pages as we do, so that only the index can tell.
TEST(Corruption, OfAnIndexThatLacksARowIsFound) {
  TestMap map;
  map.MustCommit(DeltaOfNodes({MakeHuman(1, "ann"), MakeHuman(2, "bob")}));
  map.Close();
  {
    const auto db =
        OrDie(sqlite::Database::Open(map.database_path(), sqlite::Database::Mode::kWrite, kMap));
    const sqlite::Database::OpenTables open(db.get());
    for (const char* sql :
         {"CREATE TEMP TABLE row AS SELECT * FROM node WHERE name = 'ann'",
          "DELETE FROM node WHERE name = 'ann'", "PRAGMA writable_schema = ON",
          "CREATE TEMP TABLE hidden AS SELECT * FROM sqlite_master WHERE name = 'node_order'",
          "DELETE FROM sqlite_master WHERE name = 'node_order'", "PRAGMA writable_schema = RESET",
          "INSERT INTO node SELECT * FROM row", "PRAGMA writable_schema = ON",
          "INSERT INTO sqlite_master SELECT * FROM hidden", "PRAGMA writable_schema = RESET"}) {
      OrDie(db->Execute(sql));
    }
  }
  map.Reopen();
  EXPECT_NE(map.Problems().find("node_order"), std::string::npos) << map.Problems();
}

}  // namespace
}  // namespace dsg::test
