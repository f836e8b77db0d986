// SPDX-License-Identifier: Apache-2.0
// Maps as files: made, listed, opened, refused.
#include <gtest/gtest.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <thread>

#include "absl/strings/match.h"
#include "absl/strings/str_cat.h"
#include "schema/store/sqlite/page_checksum.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

std::unique_ptr<GraphStore> NewStore(const std::string& folder) {
  StoreOptions options;
  options.create = true;
  options.program = "store-test";
  return OrDie(GraphStore::Open(folder, options));
}

MapSpec Named(const std::string& name) {
  MapSpec spec;
  spec.name = name;
  return spec;
}

// Through the maps' own file layer (which asking for its name makes known), or as any other
// program would.
void ExecuteSql(const std::string& path, const std::string& sql,
                const char* files = sqlite::SealedFilesName()) {
  sqlite3* db = nullptr;
  ASSERT_EQ(sqlite3_open_v2(path.c_str(), &db, SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE, files),
            SQLITE_OK);
  EXPECT_EQ(sqlite3_exec(db, sql.c_str(), nullptr, nullptr, nullptr), SQLITE_OK)
      << sqlite3_errmsg(db);
  sqlite3_close(db);
}

TEST(GraphStore, IsNotMadeUnlessAsked) {
  TempFolder folder;
  const auto store = GraphStore::Open(folder.path() + "/none", {});
  EXPECT_EQ(ReasonOf(store.status()), Reason::kMapUnknown);
  EXPECT_TRUE(absl::StrContains(store.status().message(), "/none")) << store.status();
}

TEST(GraphStore, IsMadeWithItsParentsWhenAsked) {
  TempFolder folder;
  NewStore(folder.path() + "/a/b");
  EXPECT_TRUE(fs::is_directory(folder.path() + "/a/b"));
}

TEST(GraphStore, RefusesAFileInPlaceOfAFolder) {
  TempFolder folder;
  std::ofstream(folder.path() + "/file") << "text";
  StoreOptions options;
  options.create = true;
  EXPECT_FALSE(GraphStore::Open(folder.path() + "/file", options).ok());
}

TEST(GraphStore, OfThoseWhoMakeOneMapAtOnceOneMakesItAndOthersSeeThatItIsThere) {
  for (int round = 0; round < 10; ++round) {
    const TempFolder folder;
    std::atomic<int> made_count = 0;
    std::vector<std::thread> threads;
    for (int i = 0; i < 8; ++i) {
      threads.emplace_back([&] {
        const auto store = OrDie(GraphStore::Open(folder.path(), {.create = true}));
        const absl::Status created = store->CreateMap(Spec(TrajectoryCodec::kQuantized));
        made_count += created.ok() ? 1 : 0;
        EXPECT_TRUE(created.ok() || ReasonOf(created) == Reason::kMapExists) << created;
        // Whoever sees the map can write it, also while another one is at the end of making it.
        const absl::Status opened = store->OpenWriter(kMap).status();
        EXPECT_TRUE(opened.ok() || MetadataOf(opened)["holder"].find("create") == std::string::npos)
            << opened;
      });
    }
    for (std::thread& thread : threads) thread.join();
    EXPECT_EQ(made_count, 1);
  }
}

TEST(GraphStore, ListsMapsByNameAndIgnoresWhatIsNone) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  EXPECT_TRUE(OrDie(store->ListMaps()).empty());
  for (const char* name : {"zoo", "a-1", "lab"}) ASSERT_TRUE(store->CreateMap(Named(name)).ok());
  fs::create_directory(folder.path() + "/empty");
  fs::create_directory(folder.path() + "/Not A Map");
  std::ofstream(folder.path() + "/readme") << "text";
  std::vector<std::string> names;
  for (const MapSpec& spec : OrDie(store->ListMaps())) names.push_back(spec.name);
  EXPECT_EQ(names, (std::vector<std::string>{"a-1", "lab", "zoo"}));
}

TEST(GraphStore, ListsTheMapsBesideOneThatItCannotRead) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  for (const char* name : {"good", "newer"}) ASSERT_TRUE(store->CreateMap(Named(name)).ok());
  ExecuteSql(folder.path() + "/newer/graph.db",
             absl::StrCat("PRAGMA user_version=", kStoreFormatVersion + 1));
  const auto maps = OrDie(store->ListMaps());
  ASSERT_EQ(maps.size(), 1u);
  EXPECT_EQ(maps[0].name, "good");
  EXPECT_EQ(ReasonOf(store->OpenMap("newer").status()), Reason::kFormatTooNew);
}

TEST(GraphStore, RefusesAMapFolderUnderAnotherName) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  ASSERT_TRUE(store->CreateMap(Named("lab")).ok());
  fs::copy(folder.path() + "/lab", folder.path() + "/copy");
  const auto status = store->OpenMap("copy").status();
  EXPECT_EQ(ReasonOf(status), Reason::kNotAStore);
  EXPECT_TRUE(absl::StrContains(status.message(), "holds map \"lab\"")) << status;
  EXPECT_EQ(OrDie(store->ListMaps()).size(), 1u);
}

TEST(GraphStore, TellsAReaderWhoseFileWasReplaced) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  ASSERT_TRUE(store->CreateMap(Named("lab")).ok());
  const auto map = OrDie(store->OpenMap("lab"));
  EXPECT_TRUE(map->IsCurrent());
  fs::rename(folder.path() + "/lab", folder.path() + "/moved");
  EXPECT_FALSE(map->IsCurrent());
  ASSERT_TRUE(store->CreateMap(Named("lab")).ok());
  EXPECT_FALSE(map->IsCurrent());
  EXPECT_TRUE(OrDie(store->OpenMap("lab"))->IsCurrent());
}

TEST(GraphStore, KeepsTheSpecAMapWasMadeWith) {
  TempFolder folder;
  MapSpec spec = Named("lab");
  spec.frame = "odom";
  spec.epoch_ns = 1'403'715'524'907'143'168;
  spec.clock = Clock::kPtpTai;
  spec.codec = TrajectoryCodec::kLossless;
  spec.gap_ns_max = 3 * kSecond;
  spec.mesh_block_size_m = 0.7;
  ASSERT_TRUE(NewStore(folder.path())->CreateMap(spec).ok());
  const auto map = OrDie(OrDie(GraphStore::Open(folder.path(), {}))->OpenMap("lab"));
  const MapSpec& kept = map->spec();
  EXPECT_EQ(kept.name, "lab");
  EXPECT_EQ(kept.frame, "odom");
  EXPECT_EQ(kept.epoch_ns, spec.epoch_ns);
  EXPECT_EQ(kept.clock, Clock::kPtpTai);
  EXPECT_EQ(kept.codec, TrajectoryCodec::kLossless);
  EXPECT_EQ(kept.gap_ns_max, 3 * kSecond);
  EXPECT_EQ(kept.mesh_block_size_m, 0.7);
}

TEST(GraphStore, RefusesASecondMapOfTheSameName) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  ASSERT_TRUE(store->CreateMap(Named("lab")).ok());
  EXPECT_EQ(ReasonOf(store->CreateMap(Named("lab"))), Reason::kMapExists);
}

TEST(GraphStore, RefusesNamesThatAreNoNamesAndTouchesNothing) {
  TempFolder folder;
  const auto store = NewStore(folder.path() + "/store");
  for (const std::string& name :
       {std::string("../x"), std::string(".."), std::string("."), std::string(""),
        std::string("a/b"), std::string("/etc"), std::string("A"), std::string("-a"),
        std::string("_a"), std::string("a.b"), std::string("file:zz?mode=memory"),
        std::string("a\0b", 3), std::string("a b"), std::string("caf\xc3\xa9"),
        std::string(65, 'a')}) {
    SCOPED_TRACE(name);
    EXPECT_EQ(ReasonOf(store->CreateMap(Named(name))), Reason::kMapNameInvalid);
    EXPECT_EQ(ReasonOf(store->OpenMap(name).status()), Reason::kMapNameInvalid);
    EXPECT_EQ(ReasonOf(store->OpenWriter(name).status()), Reason::kMapNameInvalid);
  }
  EXPECT_TRUE(fs::is_empty(folder.path() + "/store"));
  EXPECT_FALSE(fs::exists(folder.path() + "/x"));
}

TEST(GraphStore, TakesTheLongestNameThereIs) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  const std::string name(64, 'z');
  ASSERT_TRUE(store->CreateMap(Named(name)).ok());
  EXPECT_TRUE(store->OpenMap(name).ok());
}

TEST(GraphStore, NamesTheMapThatIsNotThereAndLeavesNothingBehind) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  for (const absl::Status& status :
       {store->OpenMap("lab").status(), store->OpenWriter("lab").status()}) {
    EXPECT_EQ(ReasonOf(status), Reason::kMapUnknown);
    EXPECT_TRUE(absl::StrContains(status.message(), "lab")) << status;
  }
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(GraphStore, RefusesASpecWithAnAbsurdGap) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  MapSpec spec = Named("lab");
  spec.gap_ns_max = 0;
  EXPECT_EQ(ReasonOf(store->CreateMap(spec)), Reason::kFieldInvalid);
  EXPECT_FALSE(fs::exists(folder.path() + "/lab"));
}

TEST(GraphStore, FinishesAMapWhoseMakingWasCutOff) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  fs::create_directory(folder.path() + "/lab");
  std::ofstream(folder.path() + "/lab/graph.db.new") << "half of a database";
  std::ofstream(folder.path() + "/lab/graph.db.new-wal") << "and its log";
  EXPECT_TRUE(OrDie(store->ListMaps()).empty());
  ASSERT_TRUE(store->CreateMap(Named("lab")).ok());
  EXPECT_EQ(OrDie(OrDie(store->OpenMap("lab"))->Head()).revision, 0);
}

TEST(WriterLock, RefusesASecondWriterOfThisProcessNamingIt) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  ASSERT_TRUE(store->CreateMap(Named("lab")).ok());
  const auto first = OrDie(store->OpenWriter("lab"));
  const auto second = store->OpenWriter("lab");
  EXPECT_EQ(ReasonOf(second.status()), Reason::kWriterLocked);
  EXPECT_EQ(second.status().code(), absl::StatusCode::kUnavailable);
  const std::string holder = absl::StrCat("store-test (process ", getpid(), ")");
  EXPECT_TRUE(absl::StrContains(second.status().message(), holder)) << second.status();
  EXPECT_EQ(MetadataOf(second.status())["holder"], holder);
}

TEST(WriterLock, IsFreeAgainOnceTheWriterIsGone) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  ASSERT_TRUE(store->CreateMap(Named("lab")).ok());
  OrDie(store->OpenWriter("lab")).reset();
  EXPECT_TRUE(store->OpenWriter("lab").ok());
}

TEST(WriterLock, HoldsOneMapOnly) {
  TempFolder folder;
  const auto store = NewStore(folder.path());
  ASSERT_TRUE(store->CreateMap(Named("lab")).ok());
  ASSERT_TRUE(store->CreateMap(Named("zoo")).ok());
  const auto first = OrDie(store->OpenWriter("lab"));
  EXPECT_TRUE(store->OpenWriter("zoo").ok());
  EXPECT_TRUE(store->OpenMap("lab").ok());
}

// A process that holds the writer of map "lab" until it is killed.
class HoldingProcess {
 public:
  explicit HoldingProcess(const std::string& folder) {
    int pipe_fds[2];
    if (pipe(pipe_fds) != 0) std::abort();
    pid_ = fork();
    if (pid_ == 0) {
      StoreOptions options;
      options.program = "other-program";
      const auto writer = OrDie(OrDie(GraphStore::Open(folder, options))->OpenWriter("lab"));
      if (write(pipe_fds[1], "x", 1) != 1) _exit(1);
      for (;;) pause();
    }
    char ready = 0;
    if (read(pipe_fds[0], &ready, 1) != 1) std::abort();
    close(pipe_fds[0]);
    close(pipe_fds[1]);
  }
  ~HoldingProcess() { Kill(); }
  void Kill() {
    if (pid_ <= 0) return;
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = 0;
  }
  pid_t pid() const { return pid_; }

 private:
  pid_t pid_ = 0;
};

TEST(WriterLock, RefusesAWriterOfAnotherProcessNamingProgramAndProcess) {
  TempFolder folder;
  ASSERT_TRUE(NewStore(folder.path())->CreateMap(Named("lab")).ok());
  HoldingProcess holder(folder.path());
  const auto store = NewStore(folder.path());
  const auto refused = store->OpenWriter("lab");
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kWriterLocked);
  EXPECT_EQ(MetadataOf(refused.status())["holder"],
            absl::StrCat("other-program (process ", holder.pid(), ")"));
  EXPECT_TRUE(store->OpenMap("lab").ok());
  holder.Kill();
  EXPECT_TRUE(store->OpenWriter("lab").ok());
}

TEST(MapFormat, RefusesANewerFormatAndTouchesNothing) {
  TestMap map;
  map.Close();
  ExecuteSql(map.database_path(), absl::StrCat("PRAGMA user_version=", kStoreFormatVersion + 1));
  for (const absl::Status& status :
       {map.store().OpenMap(kMap).status(), map.store().OpenWriter(kMap).status()}) {
    EXPECT_EQ(ReasonOf(status), Reason::kFormatTooNew);
    EXPECT_TRUE(absl::StrContains(status.message(), absl::StrCat(kStoreFormatVersion + 1)) &&
                absl::StrContains(status.message(), absl::StrCat("up to ", kStoreFormatVersion)))
        << status;
  }
  ExecuteSql(map.database_path(), absl::StrCat("PRAGMA user_version=", kStoreFormatVersion));
  map.Reopen();
  EXPECT_EQ(map.Problems(), "");
}

TEST(MapFormat, RefusesAnOlderFormat) {
  TestMap map;
  map.Close();
  ExecuteSql(map.database_path(), "PRAGMA user_version=0");
  EXPECT_EQ(ReasonOf(map.store().OpenMap(kMap).status()), Reason::kFormatTooOld);
}

TEST(MapFormat, RefusesANewerFormatWhosePagesItCannotCheck) {
  TestMap map;
  map.Close();
  ExecuteSql(map.database_path(), "PRAGMA user_version=99", nullptr);
  EXPECT_EQ(ReasonOf(map.store().OpenMap(kMap).status()), Reason::kFormatTooNew);
}

TEST(MapFormat, ServesNothingThatAnotherProgramWrote) {
  TestMap map;
  map.MustCommit(DeltaOfNodes({MakeHuman(1, "ann")}));
  map.Close();
  ExecuteSql(map.database_path(), "UPDATE node SET name = 'bob'", nullptr);
  map.Reopen();
  EXPECT_EQ(ReasonOf(map.Latest()->GetNode(NodeId('H', 1)).status()), Reason::kStoreCorrupt);
  EXPECT_NE(map.Problems(), "");
}

TEST(MapFormat, RefusesDatabasesOfOthers) {
  TestMap map;
  map.Close();
  fs::remove(map.database_path());
  ExecuteSql(map.database_path(), "CREATE TABLE node (id INTEGER)", nullptr);
  EXPECT_EQ(ReasonOf(map.store().OpenMap(kMap).status()), Reason::kNotAStore);
  EXPECT_EQ(ReasonOf(map.store().OpenWriter(kMap).status()), Reason::kNotAStore);
}

TEST(MapFormat, RefusesFilesThatAreNoDatabase) {
  TestMap map;
  map.Close();
  for (const std::string& content : {std::string(), std::string(10'000, 'x')}) {
    std::ofstream(map.database_path(), std::ios::trunc) << content;
    EXPECT_EQ(ReasonOf(map.store().OpenMap(kMap).status()), Reason::kNotAStore);
    EXPECT_EQ(ReasonOf(map.store().OpenWriter(kMap).status()), Reason::kNotAStore);
  }
}

TEST(MapFormat, RefusesADatabaseWithTwoNames) {
  TestMap map;
  map.Close();
  fs::create_hard_link(map.database_path(), map.folder() + "/second-name");
  EXPECT_EQ(ReasonOf(map.store().OpenMap(kMap).status()), Reason::kNotAStore);
}

TEST(MapFormat, RefusesASymbolicLinkToADatabase) {
  TestMap map;
  map.Close();
  const std::string moved = map.folder() + "/moved.db";
  fs::rename(map.database_path(), moved);
  fs::create_symlink(moved, map.database_path());
  EXPECT_FALSE(map.store().OpenMap(kMap).ok());
}

}  // namespace
}  // namespace dsg::test
