// SPDX-License-Identifier: Apache-2.0
// Dropping and renaming, killed before each system call that changes files: the map is there whole
// or not at all, under one name, and once the store was opened again nothing else is left.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <functional>
#include <set>

#include "absl/strings/str_cat.h"
#include "schema/codec/checksum.h"
#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/everything.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

constexpr int64_t kRevisions = 12;
constexpr int64_t kNever = 0;

// Those that SQLite, the C++ library and we change files by.
bool ChangesFiles(uint64_t number, const uint64_t* arguments) {
  constexpr std::array kChanging = {
#ifdef SYS_rename
      SYS_rename,   SYS_unlink,    SYS_rmdir,    SYS_mkdir,
#endif
      SYS_renameat, SYS_renameat2, SYS_unlinkat, SYS_mkdirat,   SYS_write,
      SYS_pwrite64, SYS_ftruncate, SYS_fsync,    SYS_fdatasync, SYS_fallocate};
  if (std::find(kChanging.begin(), kChanging.end(), static_cast<int>(number)) != kChanging.end()) {
    return true;
  }
#ifdef SYS_open
  if (number == SYS_open) return (arguments[1] & O_CREAT) != 0;
#endif
  return number == SYS_openat && (arguments[2] & O_CREAT) != 0;
}

// How a child came to its end.
struct Ending {
  bool was_killed = false;
  /// Calls that change files.
  int64_t call_count = 0;
};

// Follows the child from one system call to the next. Killed before call number `limit`.
Ending Follow(pid_t child, int64_t limit) {
  Ending ending;
  int status = 0;
  while (waitpid(child, &status, 0) == child && WIFSTOPPED(status)) {
    // The first stop is that by which the child waits for us.
    if (WSTOPSIG(status) == SIGSTOP) {
      ptrace(PTRACE_SETOPTIONS, child, 0, PTRACE_O_TRACESYSGOOD | PTRACE_O_EXITKILL);
    }
    __ptrace_syscall_info call{};
    const bool is_entry = WSTOPSIG(status) == (SIGTRAP | 0x80) &&
                          ptrace(PTRACE_GET_SYSCALL_INFO, child, sizeof(call), &call) > 0 &&
                          call.op == PTRACE_SYSCALL_INFO_ENTRY;
    if (is_entry && ChangesFiles(call.entry.nr, call.entry.args) && ++ending.call_count == limit) {
      kill(child, SIGKILL);
    }
    ptrace(PTRACE_SYSCALL, child, 0, 0);
  }
  ending.was_killed = WIFSIGNALED(status) && WTERMSIG(status) == SIGKILL;
  EXPECT_TRUE(ending.was_killed || (WIFEXITED(status) && WEXITSTATUS(status) == 0));
  return ending;
}

using Change = std::function<absl::Status(GraphStore&)>;

Ending RunTraced(const std::string& folder, const Change& work, int64_t limit) {
  const pid_t child = fork();
  if (child == 0) {
    if (ptrace(PTRACE_TRACEME, 0, 0, 0) != 0) _exit(2);
    raise(SIGSTOP);
    const auto store = OrDie(GraphStore::Open(folder, {}));
    _exit(work(*store).ok() ? 0 : 1);
  }
  return Follow(child, limit);
}

// The records of all revisions, and the newest in full.
std::string ContentOf(MapReader& map) {
  std::string text;
  for (const std::string& problem : OrDie(map.Verify({}, {})).problems) text += problem + "\n";
  for (const RevisionInfo& info : OrDie(map.ListRevisions(0, 1'000'000))) {
    absl::StrAppend(&text, info.revision, " ", ToHex(info.digest), "\n");
  }
  for (const Line& line : LinesOf(*OrDie(map.Latest()))) absl::StrAppend(&text, line.text, "\n");
  return text;
}

class KilledBetweenCalls : public testing::Test {
 protected:
  KilledBetweenCalls() {
    const auto store = OrDie(GraphStore::Open(PathOf("base"), {.create = true}));
    OrDie(store->CreateMap(Spec(TrajectoryCodec::kQuantized)));
    const auto writer = OrDie(store->OpenWriter(kMap));
    for (int64_t i = 1; i <= kRevisions; ++i) OrDie(writer->Commit(DeltaOfStream({}, i)));
    content_ = ContentOf(*OrDie(store->OpenMap(kMap)));
  }

  std::string PathOf(const std::string& name) const { return folder_.path() + "/" + name; }

  static std::set<std::string> Entries(const std::string& folder) {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder)) {
      names.insert(entry.path().filename().string());
    }
    return names;
  }

  // Kills `work` before each of its calls. Then the store is opened: it has just one of `before`
  // and `after`, and nothing else; and the work done again leaves `after`.
  void KillEverywhere(const Change& work, const std::set<std::string>& after) {
    const std::set<std::string> before = {kMap};
    const std::string undisturbed = PathOf("undisturbed");
    fs::copy(PathOf("base"), undisturbed, fs::copy_options::recursive);
    const Ending whole = RunTraced(undisturbed, work, kNever);
    ASSERT_FALSE(whole.was_killed);
    EXPECT_EQ(Entries(undisturbed), after);
    ASSERT_GT(whole.call_count, 3);
    int before_count = 0;
    int after_count = 0;
    for (int64_t at = 1; at <= whole.call_count && !HasFailure(); ++at) {
      SCOPED_TRACE(absl::StrCat("killed before call ", at, " of ", whole.call_count));
      const std::string folder = PathOf("try");
      fs::copy(PathOf("base"), folder, fs::copy_options::recursive);
      EXPECT_TRUE(RunTraced(folder, work, at).was_killed);
      const auto store = OrDie(GraphStore::Open(folder, {}));
      const std::set<std::string> found = Entries(folder);
      EXPECT_TRUE(found == before || found == after);
      (found == before ? before_count : after_count) += 1;
      for (const std::string& name : found) {
        EXPECT_EQ(ContentOf(*OrDie(store->OpenMap(name))), content_);
        EXPECT_TRUE(store->OpenWriter(name).ok());
      }
      if (found == before) {
        EXPECT_TRUE(work(*store).ok());
      }
      EXPECT_EQ(Entries(folder), after);
      fs::remove_all(folder);
    }
    // Otherwise it was not killed where it matters.
    EXPECT_GT(before_count, 0);
    EXPECT_GT(after_count, 0);
    std::printf("%lld kills: %d before it was done, %d after\n",
                static_cast<long long>(whole.call_count), before_count, after_count);
  }

  TempFolder folder_;
  std::string content_;
};

TEST_F(KilledBetweenCalls, ADropLeavesTheMapOrNothing) {
  KillEverywhere([](GraphStore& store) { return store.DropMap(kMap, {}).status(); }, {});
}

TEST_F(KilledBetweenCalls, ADropOfWhatIsExpectedLeavesTheMapOrNothing) {
  KillEverywhere(
      [](GraphStore& store) { return store.DropMap(kMap, {.head = kRevisions}).status(); }, {});
}

TEST_F(KilledBetweenCalls, ARenamingLeavesTheMapUnderOneName) {
  KillEverywhere([](GraphStore& store) { return store.RenameMap(kMap, "attic"); }, {"attic"});
}

}  // namespace
}  // namespace dsg::test
