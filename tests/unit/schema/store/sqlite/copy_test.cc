// SPDX-License-Identifier: Apache-2.0
// Maps copied out of a store as one file, and taken into one.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "absl/strings/str_cat.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

class Copy : public testing::Test {
 protected:
  void SetUp() override {
    Write(1, 40);
    OrDie(map_.writer().SetTag("summer", 17, "a note"));
  }

  void Write(int64_t from, int64_t to) {
    for (int64_t s = from; s <= to; ++s) map_.MustCommit(DeltaOfStream({}, s));
  }
  std::string PathOf(const std::string& name) const {
    return absl::StrCat(away_.path(), "/", name);
  }
  std::string CopyOf(MapReader& map, const std::string& name) {
    OrDie(map.CopyTo(PathOf(name), {}, {}));
    return PathOf(name);
  }
  // Into the store of the map that was copied, as InstallMap wants it.
  std::string CopyInStore(const std::string& name) {
    const std::string path = absl::StrCat(map_.folder(), "/", name);
    OrDie(map_.reader().CopyTo(path, {}, {}));
    return path;
  }
  static std::string Problems(MapReader& map) {
    std::string text;
    for (const std::string& problem : OrDie(map.Verify({}, {})).problems) text += problem + "\n";
    return text;
  }

  TestMap map_;
  TempFolder away_;
};

// Without what names the map or its size on the disk.
std::string Said(const Snapshot& snapshot) {
  const std::string text = OrDie(Dump(snapshot));
  return text.substr(text.find("ScanNodes:"));
}

TEST_F(Copy, BecomesAMapThatAnswersAsTheOriginal) {
  const std::string file = CopyInStore("carried");
  ASSERT_TRUE(map_.store().InstallMap("other", file, false).ok());
  EXPECT_FALSE(fs::exists(file));
  const auto other = OrDie(map_.store().OpenMap("other"));
  EXPECT_EQ(Problems(*other), "");
  EXPECT_EQ(OrDie(other->Head()).digest, OrDie(map_.reader().Head()).digest);
  for (const Revision revision : {1, 17, 40}) {
    EXPECT_EQ(Said(*OrDie(other->At(revision))), Said(*map_.At(revision)));
  }
  ASSERT_EQ(OrDie(other->Tags()).size(), 1u);
  GraphDelta more = DeltaOfStream({}, 41);
  more.map = "other";
  more.session_id = "test";
  const auto committed = OrDie(map_.store().OpenWriter("other"))->Commit(more);
  ASSERT_TRUE(committed.ok()) << committed.status();
  EXPECT_EQ(OrDie(other->Head()).revision, 41);
  EXPECT_EQ(OrDie(map_.reader().Head()).revision, 40);
}

TEST_F(Copy, DependsOnTheContentAlone) {
  const std::string first = ReadFile(CopyOf(map_.reader(), "first"));
  EXPECT_TRUE(first == ReadFile(CopyOf(map_.reader(), "again")));
  ASSERT_TRUE(map_.store().InstallMap("other", CopyInStore("carried"), false).ok());
  // Under the old name: the name is content.
  TempFolder elsewhere;
  const auto store = OrDie(GraphStore::Open(elsewhere.path(), {}));
  const std::string carried = elsewhere.path() + "/carried";
  fs::copy_file(PathOf("first"), carried);
  ASSERT_TRUE(store->InstallMap(kMap, carried, false).ok());
  const auto restored = OrDie(store->OpenMap(kMap));
  EXPECT_TRUE(first == ReadFile(CopyOf(*restored, "second")));
}

TEST_F(Copy, DoesNotDependOnHowOftenTheMapWasErasedFromOrReplaced) {
  const std::string first = ReadFile(CopyOf(map_.reader(), "first"));
  GraphDelta delta;
  delta.nodes.push_back(MakeObject(7777, "thing", BoxOf(0, 0, 0, 1, 1, 1)));
  map_.MustCommit(delta);
  const std::string file = CopyInStore("carried");
  map_.Close();
  const auto store = OrDie(GraphStore::Open(map_.folder(), {}));
  const std::string second = ReadFile(file);
  for (int i = 0; i < 2; ++i) {
    ASSERT_TRUE(store->InstallMap(kMap, file, true).ok());
    const auto map = OrDie(store->OpenMap(kMap));
    OrDie(map->CopyTo(file, {}, {}));
    EXPECT_TRUE(ReadFile(file) == second) << "installed " << i + 1 << " times";
  }
  EXPECT_FALSE(first == second);
  map_.Reopen();
}

TEST_F(Copy, HoldsOneRevisionWhileOthersWrite) {
  Revision seen = 0;
  int64_t sequence = 40;
  const auto write_more = [&](double) {
    if (sequence < 60) Write(sequence + 1, sequence + 1), ++sequence;
  };
  const std::string file = absl::StrCat(map_.folder(), "/carried");
  ASSERT_TRUE(map_.reader().CopyTo(file, {}, write_more).ok());
  ASSERT_TRUE(map_.store().InstallMap("other", file, false).ok());
  const auto other = OrDie(map_.store().OpenMap("other"));
  seen = OrDie(other->Head()).revision;
  EXPECT_GE(seen, 40);
  EXPECT_EQ(Problems(*other), "");
  EXPECT_EQ(Said(*OrDie(other->Latest())), Said(*map_.At(seen)));
}

TEST_F(Copy, StopsWhenToldAndLeavesNothing) {
  const auto stop = [] { return absl::CancelledError("enough"); };
  EXPECT_EQ(map_.reader().CopyTo(PathOf("copy"), stop, {}).code(), absl::StatusCode::kCancelled);
  EXPECT_TRUE(fs::is_empty(away_.path()));
}

TEST_F(Copy, TouchesNoFileThatIsThere) {
  std::ofstream(PathOf("taken")) << "mine";
  const absl::Status refused = map_.reader().CopyTo(PathOf("taken"), {}, {});
  EXPECT_EQ(ReasonOf(refused), Reason::kFieldInvalid) << refused;
  EXPECT_EQ(ReadFile(PathOf("taken")), "mine");
  EXPECT_EQ(ReasonOf(map_.reader().CopyTo(PathOf("no/such/folder"), {}, {})),
            Reason::kFieldInvalid);
}

TEST_F(Copy, IsReadWithoutBeingChanged) {
  const std::string file = PathOf(absl::StrCat(kMap, "/graph.db"));
  fs::create_directory(PathOf(kMap));
  ASSERT_TRUE(map_.reader().CopyTo(file, {}, {}).ok());
  const std::string bytes = ReadFile(file);
  const auto store = OrDie(GraphStore::Open(away_.path(), {}));
  const auto copy = OrDie(store->OpenMap(kMap));
  EXPECT_EQ(Said(*OrDie(copy->Latest())), Said(*map_.Latest()));
  EXPECT_EQ(Problems(*copy), "");
  EXPECT_TRUE(bytes == ReadFile(file));
}

TEST_F(Copy, ReplacesAMapOnlyWhenToldAndNotUnderAWriter) {
  const std::string file = CopyInStore("carried");
  Write(41, 45);
  EXPECT_EQ(ReasonOf(map_.store().InstallMap(kMap, file, true)), Reason::kWriterLocked);
  const auto reader = OrDie(map_.store().OpenMap(kMap));
  const auto old = OrDie(reader->Latest());
  map_.Close();
  const auto store = OrDie(GraphStore::Open(map_.folder(), {}));
  EXPECT_EQ(ReasonOf(store->InstallMap(kMap, file, false)), Reason::kMapExists);
  EXPECT_TRUE(reader->IsCurrent());
  ASSERT_TRUE(store->InstallMap(kMap, file, true).ok());
  EXPECT_FALSE(reader->IsCurrent());
  map_.Reopen();
  EXPECT_EQ(OrDie(map_.reader().Head()).revision, 40);
  EXPECT_EQ(map_.Problems(), "");
  Write(41, 42);
}

TEST_F(Copy, OfADamagedFileIsRefused) {
  const std::string file = CopyInStore("carried");
  std::string bytes = ReadFile(file);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 4);
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
  const absl::Status damaged = map_.store().InstallMap("other", file, false);
  EXPECT_EQ(ReasonOf(damaged), Reason::kStoreCorrupt) << damaged;
  std::ofstream(file, std::ios::binary | std::ios::trunc) << "no database";
  EXPECT_EQ(ReasonOf(map_.store().InstallMap("other", file, false)), Reason::kNotAStore);
  fs::remove(file);
  EXPECT_EQ(ReasonOf(map_.store().InstallMap("other", file, false)), Reason::kNotAStore);
  EXPECT_EQ(OrDie(map_.store().ListMaps()).size(), 1u);
  EXPECT_EQ(ReasonOf(map_.store().InstallMap("../other", file, false)), Reason::kMapNameInvalid);
}

}  // namespace
}  // namespace dsg::test
