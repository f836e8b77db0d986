// SPDX-License-Identifier: Apache-2.0
// What dropping and renaming do to the files of a store, and what the next opening of the store
// does about programs that were killed meanwhile.
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <set>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/database.h"
#include "schema/store/sqlite/map_file.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kLength = 4;

class DroppedFiles : public testing::Test {
 protected:
  DroppedFiles() {
    const auto store = Open();
    Make(*store, kMap);
    const auto writer = OrDie(store->OpenWriter(kMap));
    for (int64_t i = 1; i <= kLength; ++i) OrDie(writer->Commit(DeltaOfStream({}, i)));
  }

  std::unique_ptr<GraphStore> Open() const {
    return OrDie(GraphStore::Open(folder_.path(), {.create = true, .program = "files-test"}));
  }
  static void Make(GraphStore& store, const std::string& name) {
    MapSpec spec = Spec(TrajectoryCodec::kQuantized);
    spec.name = name;
    OrDie(store.CreateMap(spec));
  }

  std::string PathOf(const std::string& name) const { return folder_.path() + "/" + name; }
  void Write(const std::string& name, const std::string& content) const {
    fs::create_directories(fs::path(PathOf(name)).parent_path());
    std::ofstream(PathOf(name), std::ios::binary) << content;
  }
  std::set<std::string> Entries() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      names.insert(entry.path().filename().string());
    }
    return names;
  }
  Revision HeadOf(GraphStore& store, const std::string& map) const {
    const auto reader = OrDie(store.OpenMap(map));
    EXPECT_TRUE(OrDie(reader->Verify({}, {})).problems.empty());
    return OrDie(reader->Head()).revision;
  }
  // As a program that was killed after the name was written leaves it.
  void WriteNameInto(const std::string& map, const std::string& name) const {
    const auto db = OrDie(sqlite::Database::Open(sqlite::DatabasePath(folder_.path(), map),
                                                 sqlite::Database::Mode::kWrite, map));
    OrDie(sqlite::Query(*db, "UPDATE map SET name = ?1").Bind(name).Run());
  }

  TempFolder folder_;
};

TEST_F(DroppedFiles, AreAllRemovedWithCopiesOfUpgradesToo) {
  Write("office/graph.db.format2", "an older map, with what was dropped in it");
  const DropReport report = OrDie(Open()->DropMap(kMap, {}));
  EXPECT_GT(report.bytes_on_disk, 10'000);
  EXPECT_EQ(Entries(), std::set<std::string>{});
}

TEST_F(DroppedFiles, AreRemovedUnderAReaderWhoGoesOnWithWhatItHas) {
  const auto store = Open();
  auto reader = OrDie(store->OpenMap(kMap));
  auto snapshot = OrDie(reader->Latest());
  const std::string before = OrDie(Dump(*snapshot));
  OrDie(store->DropMap(kMap, {}).status());
  Make(*store, kMap);
  EXPECT_EQ(OrDie(Dump(*snapshot)), before);
  // Closing the old one must not touch the log of the new one.
  const auto writer = OrDie(store->OpenWriter(kMap));
  OrDie(writer->Commit(DeltaOfStream({}, 1)));
  snapshot.reset();
  reader.reset();
  OrDie(writer->Commit(DeltaOfStream({}, 2)));
  EXPECT_EQ(HeadOf(*store, kMap), 2);
}

TEST_F(DroppedFiles, ThatAKilledProgramLeftGoWhenTheStoreIsOpened) {
  const std::string number(32, 'a');
  Write(".dropped-" + number + "/graph.db", "what is left of a map");
  Write(".dropped-" + number + "/reserve", "");
  Write(".dropped-notes/keep", "of somebody else");
  Write(".dropped-" + std::string(32, 'b'), "a file");
  const auto store = Open();
  EXPECT_EQ(Entries(), (std::set<std::string>{".dropped-notes", ".dropped-" + std::string(32, 'b'),
                                              "office"}));
  EXPECT_EQ(HeadOf(*store, kMap), kLength);
}

TEST_F(DroppedFiles, OfOthersStay) {
  // Some database that is no map.
  OrDie(
      OrDie(sqlite::Database::Open(PathOf("office/graph.db"), sqlite::Database::Mode::kWrite, kMap))
          ->Execute("PRAGMA application_id=7"));
  const absl::Status refused = Open()->DropMap(kMap, {}).status();
  EXPECT_EQ(ReasonOf(refused), Reason::kNotAStore);
  EXPECT_TRUE(absl::StrContains(refused.message(), "by hand")) << refused;
  EXPECT_TRUE(fs::exists(PathOf("office/graph.db")));
}

TEST_F(DroppedFiles, BesideThoseOfSomebodyElseStay) {
  Write("office/notes/plan.txt", "mine");
  const auto store = Open();
  const absl::Status refused = store->DropMap(kMap, {}).status();
  EXPECT_EQ(ReasonOf(refused), Reason::kNotAStore) << refused;
  EXPECT_TRUE(absl::StrContains(refused.message(), "office/notes is no file of a map")) << refused;
  EXPECT_EQ(HeadOf(*store, kMap), kLength);
  fs::remove_all(PathOf("office/notes"));
  for (const std::string copy : {"graph.db.bak", "graph.db.format2.mine", "graph.db-old"}) {
    Write("office/" + copy, "a copy that somebody made");
    EXPECT_EQ(ReasonOf(store->DropMap(kMap, {}).status()), Reason::kNotAStore) << copy;
    fs::remove(PathOf("office/" + copy));
  }
  Write("office/graph.db.format2.new", "half a copy");
  EXPECT_TRUE(store->DropMap(kMap, {}).ok());
}

TEST_F(DroppedFiles, ThatAreLinksStay) {
  TempFolder elsewhere;
  fs::rename(PathOf("office/graph.db"), elsewhere.path() + "/graph.db");
  fs::create_symlink(elsewhere.path() + "/graph.db", PathOf("office/graph.db"));
  EXPECT_EQ(ReasonOf(Open()->DropMap(kMap, {}).status()), Reason::kNotAStore);
  EXPECT_TRUE(fs::exists(elsewhere.path() + "/graph.db"));
}

TEST_F(DroppedFiles, AndALinkDoesNotMakeRoomForARenamedMap) {
  TempFolder elsewhere;
  fs::create_directory_symlink(elsewhere.path(), PathOf("attic"));
  fs::create_directory_symlink(elsewhere.path() + "/nowhere", PathOf("cellar"));
  const auto store = Open();
  for (const std::string to : {"attic", "cellar"}) {
    const absl::Status refused = store->RenameMap(kMap, to);
    EXPECT_EQ(ReasonOf(refused), Reason::kMapExists) << refused;
    EXPECT_TRUE(absl::StrContains(refused.message(), "is a link")) << refused;
  }
  EXPECT_EQ(HeadOf(*store, kMap), kLength);
}

TEST_F(DroppedFiles, ThatALinkLeadsToStay) {
  TempFolder elsewhere;
  fs::rename(PathOf("office"), elsewhere.path() + "/office");
  fs::create_directory_symlink(elsewhere.path() + "/office", PathOf("office"));
  const auto store = Open();
  EXPECT_EQ(ReasonOf(store->DropMap(kMap, {}).status()), Reason::kNotAStore);
  EXPECT_EQ(ReasonOf(store->RenameMap(kMap, "attic")), Reason::kNotAStore);
  EXPECT_TRUE(fs::exists(elsewhere.path() + "/office/graph.db"));
}

TEST_F(DroppedFiles, OfADamagedMapGoUnlessSomethingIsExpectedOfIt) {
  const std::string path = PathOf("office/graph.db");
  // The first page alone, without the tables that follow.
  fs::resize_file(path, 4096);
  const auto store = Open();
  EXPECT_FALSE(store->OpenMap(kMap).ok());
  EXPECT_FALSE(store->DropMap(kMap, {.head = kLength}).ok());
  EXPECT_TRUE(fs::exists(path));
  EXPECT_EQ(OrDie(store->DropMap(kMap, {})).head, std::nullopt);
  EXPECT_EQ(Entries(), std::set<std::string>{});
}

TEST_F(DroppedFiles, OfACreationThatWasKilledMakeRoomForARenamedMap) {
  Write("attic/writer.lock", "create (process 1)\n");
  Write("attic/graph.db.new", "half a map");
  Write("attic/graph.db.new-journal", "");
  const auto store = Open();
  OrDie(store->RenameMap(kMap, "attic"));
  EXPECT_EQ(Entries(), std::set<std::string>{"attic"});
  EXPECT_EQ(HeadOf(*store, "attic"), kLength);
}

TEST_F(DroppedFiles, OfSomebodyElseDoNotMakeRoomForARenamedMap) {
  Write("attic/notes.txt", "mine");
  const auto store = Open();
  const absl::Status refused = store->RenameMap(kMap, "attic");
  EXPECT_EQ(ReasonOf(refused), Reason::kMapExists);
  EXPECT_TRUE(absl::StrContains(refused.message(), "notes.txt")) << refused;
  EXPECT_TRUE(fs::exists(PathOf("attic/notes.txt")));
  EXPECT_EQ(HeadOf(*store, kMap), kLength);
}

// ---- Renamings that were cut off, as the next opening of the store finds them.

TEST_F(DroppedFiles, OfARenamingThatHadNotBegunKeepTheOldName) {
  Write(".renaming.office.attic", "");
  const auto store = Open();
  EXPECT_EQ(Entries(), std::set<std::string>{"office"});
  EXPECT_EQ(HeadOf(*store, kMap), kLength);
}

TEST_F(DroppedFiles, OfARenamingThatWasCutOffGetTheNewName) {
  Write(".renaming.office.attic", "");
  WriteNameInto(kMap, "attic");
  const auto store = Open();
  EXPECT_EQ(Entries(), std::set<std::string>{"attic"});
  EXPECT_EQ(HeadOf(*store, "attic"), kLength);
}

TEST_F(DroppedFiles, OfARenamingThatWasCutOffAreFoundByAStoreThatIsOpenAlready) {
  const auto store = Open();
  Write(".renaming.office.attic", "");
  WriteNameInto(kMap, "attic");
  EXPECT_EQ(ReasonOf(store->OpenMap(kMap).status()), Reason::kMapUnknown);
  EXPECT_EQ(HeadOf(*store, "attic"), kLength);
  EXPECT_EQ(Entries(), std::set<std::string>{"attic"});
}

TEST_F(DroppedFiles, OfARenamingThatWasDoneLoseTheMark) {
  OrDie(Open()->RenameMap(kMap, "attic"));
  Write(".renaming.office.attic", "");
  const auto store = Open();
  EXPECT_EQ(Entries(), std::set<std::string>{"attic"});
  EXPECT_EQ(HeadOf(*store, "attic"), kLength);
}

TEST_F(DroppedFiles, OfARenamingThatCameTooLateGetTheOldNameBack) {
  Write(".renaming.office.attic", "");
  WriteNameInto(kMap, "attic");
  TempFolder elsewhere;
  {
    const auto other = OrDie(GraphStore::Open(elsewhere.path(), {.create = true}));
    Make(*other, "attic");
  }
  fs::rename(elsewhere.path() + "/attic", PathOf("attic"));
  const auto store = Open();
  EXPECT_EQ(Entries(), (std::set<std::string>{"attic", "office"}));
  EXPECT_EQ(HeadOf(*store, kMap), kLength);
  EXPECT_EQ(HeadOf(*store, "attic"), 0);
}

TEST_F(DroppedFiles, OfAMapThatWasCopiedByHandAreNotMoved) {
  fs::copy(PathOf("office"), PathOf("attic"), fs::copy_options::recursive);
  Write(".renaming.attic.lab", "");
  const auto store = Open();
  EXPECT_EQ(ReasonOf(store->OpenMap("attic").status()), Reason::kNotAStore);
  EXPECT_EQ(Entries(), (std::set<std::string>{"attic", "office"}));
}

// ---- Many at once.

TEST_F(DroppedFiles, AreNeverThoseOfAMapThatWasMadeMeanwhile) {
  std::atomic<bool> is_over = false;
  std::atomic<int> drop_count = 0;
  const auto drop = [&] {
    const auto store = Open();
    while (!is_over) {
      const absl::StatusOr<DropReport> report = store->DropMap("lab", {});
      if (report.ok()) ++drop_count;
      const Reason reason = ReasonOf(report.status());
      ASSERT_TRUE(report.ok() || reason == Reason::kMapUnknown || reason == Reason::kWriterLocked)
          << report.status();
    }
  };
  std::thread one(drop);
  std::thread other(drop);
  const auto store = Open();
  MapSpec spec = Spec(TrajectoryCodec::kQuantized);
  spec.name = "lab";
  int commit_count = 0;
  for (int i = 0; i < 60; ++i) {
    const absl::Status made = store->CreateMap(spec);
    ASSERT_TRUE(made.ok() || ReasonOf(made) == Reason::kMapExists) << made;
    const auto writer = store->OpenWriter("lab");
    if (!writer.ok()) {
      const Reason reason = ReasonOf(writer.status());
      ASSERT_TRUE(reason == Reason::kMapUnknown || reason == Reason::kWriterLocked)
          << writer.status();
      continue;
    }
    // With the lock held nobody takes the map away.
    for (int64_t k = 1; k <= 3; ++k) {
      GraphDelta delta = DeltaOfStream({}, k);
      delta.map = "lab";
      const auto committed = (*writer)->Commit(std::move(delta));
      ASSERT_TRUE(committed.ok()) << committed.status();
      EXPECT_EQ(committed->revision, k);
    }
    EXPECT_EQ(HeadOf(*store, "lab"), 3);
    ++commit_count;
  }
  is_over = true;
  one.join();
  other.join();
  EXPECT_GT(commit_count, 0);
  EXPECT_GT(drop_count, 0);
  EXPECT_EQ(HeadOf(*store, kMap), kLength);
}

}  // namespace
}  // namespace dsg::test
