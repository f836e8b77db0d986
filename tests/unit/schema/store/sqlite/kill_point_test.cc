// SPDX-License-Identifier: Apache-2.0
// Erasing, compacting and installing, killed at each kind of write: the map is sound, and the same
// call again ends like one that was never disturbed. DSG_KILLS kills an operation.
#include <gtest/gtest.h>
#include <signal.h>
#include <sqlite3.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <functional>
#include <random>

#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/everything.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

// The file layer of SQLite in a child process, counting what changes files; the last one allowed is
// followed by death.
int64_t write_count = 0;
int64_t write_limit = 0;
int (*plain_open)(sqlite3_vfs*, const char*, sqlite3_file*, int, int*) = nullptr;
// Databases and logs have methods of their own.
constexpr int kMethodsMax = 4;
const sqlite3_io_methods* plain_methods[kMethodsMax];
sqlite3_io_methods counting_methods[kMethodsMax];

void CountWrite() {
  if (++write_count == write_limit) kill(getpid(), SIGKILL);
}

const sqlite3_io_methods* Plain(sqlite3_file* file) {
  return plain_methods[file->pMethods - counting_methods];
}

// Half of the bytes come first: a write may be torn.
int Write(sqlite3_file* file, const void* bytes, int size, sqlite3_int64 at) {
  const int half = size / 2;
  const int torn = Plain(file)->xWrite(file, bytes, half, at);
  if (torn != SQLITE_OK) return torn;
  CountWrite();
  return Plain(file)->xWrite(file, static_cast<const char*>(bytes) + half, size - half, at + half);
}
int Truncate(sqlite3_file* file, sqlite3_int64 size) {
  CountWrite();
  return Plain(file)->xTruncate(file, size);
}
int Sync(sqlite3_file* file, int how) {
  CountWrite();
  return Plain(file)->xSync(file, how);
}

int CountingOpen(sqlite3_vfs* vfs, const char* name, sqlite3_file* file, int flags, int* out) {
  const int code = plain_open(vfs, name, file, flags, out);
  if (code != SQLITE_OK || file->pMethods == nullptr) return code;
  int slot = 0;
  while (slot < kMethodsMax - 1 && plain_methods[slot] != nullptr &&
         plain_methods[slot] != file->pMethods) {
    ++slot;
  }
  if (plain_methods[slot] == nullptr) {
    plain_methods[slot] = file->pMethods;
    counting_methods[slot] = *file->pMethods;
    counting_methods[slot].xWrite = Write;
    counting_methods[slot].xTruncate = Truncate;
    counting_methods[slot].xSync = Sync;
  }
  if (plain_methods[slot] == file->pMethods) file->pMethods = &counting_methods[slot];
  return code;
}

void CountWrites(int64_t limit) {
  write_limit = limit;
  sqlite3_initialize();
  sqlite3_vfs* const vfs = sqlite3_vfs_find(nullptr);
  plain_open = vfs->xOpen;
  vfs->xOpen = CountingOpen;
}

std::unique_ptr<GraphStore> OpenStore(const std::string& folder) {
  StoreOptions options;
  options.create = true;
  options.reserve_bytes = 0;
  return OrDie(GraphStore::Open(folder, options));
}

using Work = std::function<void(GraphStore&)>;

// Runs `work` in a child that dies at write number `limit` (0 = never). The number of writes if it
// came to the end, -1 if it was killed.
int64_t RunInChild(const std::string& folder, const Work& work, int64_t limit) {
  int pipe_ends[2];
  if (pipe(pipe_ends) != 0) std::abort();
  const pid_t child = fork();
  if (child == 0) {
    CountWrites(limit);
    {
      const auto store = OpenStore(folder);
      work(*store);
    }
    const bool told = write(pipe_ends[1], &write_count, sizeof(write_count)) ==
                      static_cast<ssize_t>(sizeof(write_count));
    _exit(told ? 0 : 1);
  }
  close(pipe_ends[1]);
  int64_t count = -1;
  const ssize_t size = read(pipe_ends[0], &count, sizeof(count));
  close(pipe_ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  const bool was_killed = WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
  EXPECT_TRUE(was_killed || (WIFEXITED(status) && WEXITSTATUS(status) == 0));
  return size == static_cast<ssize_t>(sizeof(count)) ? count : -1;
}

// All that must be the same in two maps: the records of revisions, and the newest in full.
std::string StateOf(MapReader& map) {
  std::string text;
  for (const RevisionInfo& info : OrDie(map.ListRevisions(0, 1'000'000))) {
    absl::StrAppend(&text, info.revision, " ", ToHex(info.digest), " ", info.pose_count, "\n");
  }
  for (const Line& line : LinesOf(*OrDie(map.Latest()))) absl::StrAppend(&text, line.text, "\n");
  return text;
}

std::string ProblemsOf(MapReader& map) {
  std::string text;
  for (const std::string& problem : OrDie(map.Verify({}, {})).problems) text += problem + "\n";
  return text;
}

class KillPoints : public testing::Test {
 protected:
  std::string PathOf(const std::string& name) const { return folder_.path() + "/" + name; }

  std::string CopyOfBase(int number) {
    const std::string folder = PathOf(absl::StrCat("try-", number));
    fs::copy(PathOf("base"), folder, fs::copy_options::recursive);
    return folder;
  }

  void MakeBase(const Work& work) {
    const auto store = OpenStore(PathOf("base"));
    OrDie(store->CreateMap(Spec(TrajectoryCodec::kQuantized)));
    work(*store);
  }

  // Kills `work` at `kill_count` of its writes. After each the map is one of `states`, and sound;
  // then the work is done again, and leaves what an undisturbed run leaves.
  void Kill(const std::string& what, const Work& work) {
    const std::string undisturbed = CopyOfBase(0);
    const int64_t total = RunInChild(undisturbed, work, 0);
    ASSERT_GT(total, 0);
    const std::string expected = StateOf(*OrDie(OpenStore(undisturbed)->OpenMap(kMap)));
    std::mt19937_64 random(RecordSeed());
    const int64_t kill_count = EnvNumber("DSG_KILLS", 20);
    for (int64_t i = 0; i < kill_count && !HasFailure(); ++i) {
      // The first and last writes, and others spread evenly with some chance.
      const int64_t at = std::clamp<int64_t>(
          1 + total * i / kill_count + static_cast<int64_t>(random() % 3), 1, total);
      SCOPED_TRACE(absl::StrCat(what, " killed at write ", at, " of ", total));
      const std::string folder = CopyOfBase(static_cast<int>(i) + 1);
      EXPECT_EQ(RunInChild(folder, work, at), -1);
      EXPECT_EQ(ProblemsOf(*OrDie(OpenStore(folder)->OpenMap(kMap))), "");
      EXPECT_GE(RunInChild(folder, work, 0), 0);
      const auto map = OrDie(OpenStore(folder)->OpenMap(kMap));
      EXPECT_EQ(ProblemsOf(*map), "");
      EXPECT_TRUE(StateOf(*map) == expected) << "not as undisturbed";
      fs::remove_all(folder);
    }
    std::printf("%s: %lld kills over %lld writes, 0 violations\n", what.c_str(),
                static_cast<long long>(kill_count), static_cast<long long>(total));
  }

  TempFolder folder_;
};

void WriteStream(GraphStore& store, int64_t count) {
  const auto writer = OrDie(store.OpenWriter(kMap));
  for (int64_t s = 1; s <= count; ++s) OrDie(writer->Commit(DeltaOfStream({}, s)));
}

GraphDelta Retirements(const std::vector<NodeId>& nodes) {
  GraphDelta delta;
  delta.session_id = "prune";
  delta.sequence = 1;
  for (const NodeId id : nodes) delta.retirements.push_back({id, std::nullopt});
  return delta;
}

TEST_F(KillPoints, OfErasingLeaveASoundMapAndTheNextCallDoesTheRest) {
  const std::vector<NodeId> nodes = {NodeId('O', 5), NodeId('O', 16), NodeId('H', 3)};
  const TrackSpan span{NodeId('H', 2), 10 * kSecond, 30 * kSecond};
  MakeBase([&](GraphStore& store) {
    WriteStream(store, 24);
    GraphDelta delta = Retirements(nodes);
    delta.corrections.push_back({span.agent, span.from_ns, span.to_ns, {}});
    OrDie(OrDie(store.OpenWriter(kMap))->Commit(delta));
  });
  Kill("erase", [&](GraphStore& store) {
    const Erasure erasure{
        .nodes = nodes, .mesh_blocks = {{4, 0, 0}}, .tracks = {span}, .assets = true};
    OrDie(OrDie(store.OpenWriter(kMap))->Erase(erasure, {}, {}));
  });
}

TEST_F(KillPoints, OfCompactingLeaveASoundMapAndTheNextCallDoesTheRest) {
  MakeBase([&](GraphStore& store) {
    WriteStream(store, 30);
    const auto writer = OrDie(store.OpenWriter(kMap));
    OrDie(writer->Commit(Retirements({NodeId('O', 8), NodeId('O', 16)})));
    OrDie(writer->SetTag("summer", 11, ""));
  });
  Kill("compact",
       [&](GraphStore& store) { OrDie(OrDie(store.OpenWriter(kMap))->Compact(28, {}, {})); });
}

TEST_F(KillPoints, OfReplacingAMapLeaveTheOldOneOrTheNew) {
  MakeBase([&](GraphStore& store) {
    WriteStream(store, 20);
    OrDie(OrDie(store.OpenMap(kMap))->CopyTo(store.folder() + "/carried", {}, {}));
    const auto writer = OrDie(store.OpenWriter(kMap));
    OrDie(writer->Commit(Retirements({NodeId('O', 8)})));
  });
  Kill("install", [&](GraphStore& store) {
    // Gone once it is the map.
    if (!fs::exists(store.folder() + "/carried")) return;
    OrDie(store.InstallMap(kMap, store.folder() + "/carried", true));
  });
}

}  // namespace
}  // namespace dsg::test
