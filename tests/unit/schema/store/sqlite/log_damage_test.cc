// SPDX-License-Identifier: Apache-2.0
// A write-ahead log that a killed writer left behind: whole, it is the map; damaged in the middle,
// Verify must say so, although SQLite takes the damage for the end.
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

#include "tests/unit/schema/store/delta_stream.h"
#include "tests/unit/schema/store/store_test_util.h"

namespace dsg::test {
namespace {

namespace fs = std::filesystem;

constexpr int kCommits = 40;

// Commits in a process that ends without closing anything, so that all stays in the log.
void WriteAndVanish(const std::string& folder) {
  const auto store = OrDie(GraphStore::Open(folder, {.create = true}));
  OrDie(store->CreateMap(Spec(TrajectoryCodec::kQuantized)));
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    const auto writer = OrDie(store->OpenWriter(kMap));
    for (int i = 1; i <= kCommits; ++i) OrDie(writer->Commit(DeltaOfStream({}, i)));
    _exit(0);
  }
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  ASSERT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
}

std::vector<std::string> Problems(const std::string& folder) {
  const auto map = OrDie(OrDie(GraphStore::Open(folder, {}))->OpenMap(kMap));
  return OrDie(map->Verify({}, {})).problems;
}

TEST(WriteAheadLog, OfAKilledWriterIsWholeAndVerifies) {
  TempFolder folder;
  WriteAndVanish(folder.path());
  const auto map = OrDie(OrDie(GraphStore::Open(folder.path(), {}))->OpenMap(kMap));
  EXPECT_EQ(OrDie(map->Head()).revision, kCommits);
  EXPECT_TRUE(OrDie(map->Verify({}, {})).problems.empty());
}

TEST(WriteAheadLog, DamagedInTheMiddleIsFoundByVerify) {
  TempFolder folder;
  WriteAndVanish(folder.path());
  const std::string log = std::string("/") + kMap + "/graph.db-wal";
  const auto size = fs::file_size(folder.path() + log);
  for (const double part : {0.0001, 0.1, 0.3, 0.5, 0.8}) {
    TempFolder damaged;
    fs::copy(folder.path(), damaged.path(),
             fs::copy_options::recursive | fs::copy_options::overwrite_existing);
    fs::remove(damaged.path() + "/" + kMap + "/graph.db-shm");
    std::fstream file(damaged.path() + log, std::ios::in | std::ios::out | std::ios::binary);
    const auto at = static_cast<std::streamoff>(part * static_cast<double>(size)) + 5;
    file.seekg(at);
    const char byte = static_cast<char>(file.get() ^ 0x10);
    file.seekp(at);
    file.put(byte);
    file.close();
    EXPECT_FALSE(Problems(damaged.path()).empty()) << "byte " << at << " of " << size;
  }
}

}  // namespace
}  // namespace dsg::test
