// SPDX-License-Identifier: Apache-2.0
// Working memory on disk: what was put there comes back or is refused, and nothing is left behind.
#include "ingest/files/spill_file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <vector>

#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/support/full_disk.h"
#include "tests/support/open_files.h"
#include "tests/support/temp_folder.h"

namespace dsg::ingest {
namespace {

using test::TempFolder;

bool IsEmpty(const std::string& folder) {
  return std::filesystem::directory_iterator(folder) == std::filesystem::directory_iterator();
}

std::string RandomBytes(Random* random) {
  std::string bytes(static_cast<size_t>(random->Uniform(0.0, 5000.0)), '\0');
  for (char& byte : bytes) byte = static_cast<char>(static_cast<int>(random->Uniform(0.0, 127.9)));
  return bytes;
}

TEST(SpillFile, GivesBackWhatWasPutThere) {
  const uint64_t seed = test::TestSeed(7);
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Random random(seed, 0);
  const TempFolder folder;
  SpillFile file(folder.path());
  std::vector<SpillPiece> pieces(50);
  std::vector<std::string> wanted(50);
  for (int i = 0; i < 2000; ++i) {
    const auto at = static_cast<size_t>(random.Uniform(0.0, 49.99));
    if (random.Uniform(0.0, 1.0) < 0.2) {
      file.Free(&pieces[at]);
      EXPECT_TRUE(pieces[at].empty());
      continue;
    }
    wanted[at] = RandomBytes(&random);
    ASSERT_TRUE(file.Write(wanted[at], &pieces[at]).ok());
  }
  for (size_t i = 0; i < pieces.size(); ++i) {
    if (pieces[i].empty()) continue;
    std::string bytes;
    ASSERT_TRUE(file.Read(pieces[i], &bytes).ok());
    EXPECT_EQ(bytes, wanted[i]);
  }
  // Room is used again: 50 pieces of up to 5 steps, each of which may have been free at most.
  EXPECT_LE(file.byte_count(), 50 * 1024 * (1 + 2 + 3 + 4 + 5));
}

TEST(SpillFile, HasNoNameAndIsNobodyElses) {
  const TempFolder folder;
  SpillFile file(folder.path());
  EXPECT_TRUE(test::OpenFilesIn(folder.path()).empty());
  SpillPiece piece;
  ASSERT_TRUE(file.Write("who was where", &piece).ok());
  EXPECT_TRUE(IsEmpty(folder.path()));
  const std::vector<int> open = test::OpenFilesIn(folder.path());
  ASSERT_EQ(open.size(), 1u);
  struct stat facts;
  ASSERT_EQ(fstat(open[0], &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777, 0600u);
  EXPECT_EQ(facts.st_nlink, 0u);
  EXPECT_NE(fcntl(open[0], F_GETFD) & FD_CLOEXEC, 0);
}

TEST(SpillFile, IsGoneWhenTheProcessIsKilled) {
  const TempFolder folder;
  int pipe_ends[2];
  ASSERT_EQ(pipe(pipe_ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    SpillFile file(folder.path());
    SpillPiece piece;
    const char done = file.Write(std::string(100'000, 'x'), &piece).ok() ? 'y' : 'n';
    if (write(pipe_ends[1], &done, 1) == 1) pause();
    _exit(1);
  }
  char done = 0;
  ASSERT_EQ(read(pipe_ends[0], &done, 1), 1);
  EXPECT_EQ(done, 'y');
  kill(child, SIGKILL);
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFSIGNALED(status));
  EXPECT_TRUE(IsEmpty(folder.path()));
  close(pipe_ends[0]);
  close(pipe_ends[1]);
}

TEST(SpillFile, RefusesOtherBytesThanWereWritten) {
  const TempFolder folder;
  SpillFile file(folder.path());
  const std::string wanted(3000, 'a');
  SpillPiece piece;
  ASSERT_TRUE(file.Write(wanted, &piece).ok());
  const std::vector<int> open = test::OpenFilesIn(folder.path());
  ASSERT_EQ(open.size(), 1u);
  std::string bytes;
  for (const off_t at : {0, 1500, 2999}) {
    const char flipped = 'a' ^ 4;
    ASSERT_EQ(pwrite(open[0], &flipped, 1, at), 1);
    const absl::Status refused = file.Read(piece, &bytes);
    EXPECT_TRUE(absl::IsDataLoss(refused)) << refused;
    EXPECT_NE(refused.message().find(folder.path()), std::string::npos) << refused;
    ASSERT_EQ(pwrite(open[0], "a", 1, at), 1);
    EXPECT_TRUE(file.Read(piece, &bytes).ok());
  }
  for (const off_t size : {2999, 1, 0}) {
    ASSERT_EQ(ftruncate(open[0], size), 0);
    EXPECT_TRUE(absl::IsDataLoss(file.Read(piece, &bytes)));
  }
}

TEST(SpillFile, SaysThatTheDiskIsFullAndKeepsWhatItHas) {
  const TempFolder folder;
  SpillFile file(folder.path());
  SpillPiece first;
  ASSERT_TRUE(file.Write("first", &first).ok());
  SpillPiece second;
  {
    const test::FullDisk full;
    const absl::Status refused = file.Write(std::string(10'000, 'b'), &second);
    EXPECT_EQ(ReasonOf(refused), Reason::kDiskFull) << refused;
    EXPECT_NE(refused.message().find(folder.path()), std::string::npos) << refused;
  }
  EXPECT_TRUE(second.empty());
  std::string bytes;
  EXPECT_TRUE(file.Read(first, &bytes).ok());
  EXPECT_EQ(bytes, "first");
  // And goes on once there is room.
  ASSERT_TRUE(file.Write(std::string(10'000, 'b'), &second).ok());
  EXPECT_TRUE(file.Read(second, &bytes).ok());
  EXPECT_EQ(bytes, std::string(10'000, 'b'));
}

TEST(SpillFile, NamesTheFolderThatTakesNoFile) {
  SpillFile file("/nowhere/at/all");
  SpillPiece piece;
  const absl::Status refused = file.Write("x", &piece);
  EXPECT_TRUE(absl::IsUnavailable(refused)) << refused;
  EXPECT_NE(refused.message().find("/nowhere/at/all"), std::string::npos) << refused;
  EXPECT_TRUE(piece.empty());
}

}  // namespace
}  // namespace dsg::ingest
