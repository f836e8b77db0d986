// SPDX-License-Identifier: Apache-2.0
// Files appear whole or not at all, and never in place of another unasked.
#include "schema/files/atomic_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "schema/base/status.h"
#include "tests/support/full_disk.h"
#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

namespace fs = std::filesystem;

std::string Read(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class AtomicFileTest : public testing::Test {
 protected:
  test::TempFolder folder_;
  const std::string path_ = folder_.path() + "/mesh.ply";
};

TEST_F(AtomicFileTest, AppearsWithItsLastCallOnly) {
  auto file = AtomicFile::Create(path_);
  ASSERT_TRUE(file.ok()) << file.status();
  ASSERT_TRUE(file->Write("abc").ok());
  EXPECT_FALSE(fs::exists(path_));
  ASSERT_TRUE(file->Write(std::string("d\0e", 3)).ok());
  ASSERT_TRUE(file->Commit().ok());
  EXPECT_EQ(file->byte_count(), 6);
  EXPECT_EQ(Read(path_), std::string("abcd\0e", 6));
  EXPECT_FALSE(fs::exists(path_ + kPartSuffix));
}

TEST_F(AtomicFileTest, LeavesNothingWhenDropped) {
  {
    auto file = AtomicFile::Create(path_);
    ASSERT_TRUE(file.ok() && file->Write(std::string(3 << 20, 'x')).ok());
    EXPECT_TRUE(fs::exists(path_ + kPartSuffix));
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(AtomicFileTest, ReplacesAFileOnlyWhenAllowed) {
  std::ofstream(path_) << "old";
  const absl::Status refused = CheckMayWrite(path_, false, "add --force");
  EXPECT_EQ(ReasonOf(refused), Reason::kFieldInvalid);
  EXPECT_NE(refused.message().find("--force"), std::string::npos);
  EXPECT_TRUE(CheckMayWrite(path_, true).ok());
  ASSERT_TRUE(WriteAtomically(path_, "new").ok());
  EXPECT_EQ(Read(path_), "new");
}

TEST_F(AtomicFileTest, NeverReplacesWhatIsNoPlainFile) {
  EXPECT_EQ(ReasonOf(CheckMayWrite(folder_.path(), true)), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(CheckMayWrite("/dev/full", true)), Reason::kFieldInvalid);
}

TEST_F(AtomicFileTest, SaysWhichFileCannotBeCreated) {
  const auto file = AtomicFile::Create(folder_.path() + "/no/a.ply");
  EXPECT_EQ(ReasonOf(file.status()), Reason::kFieldInvalid);
  EXPECT_NE(file.status().message().find("/no/a.ply"), std::string::npos);
}

TEST_F(AtomicFileTest, AFullDiskIsAnErrorAndLeavesNoFile) {
  const test::FullDisk full;
  EXPECT_EQ(ReasonOf(WriteAtomically(path_, std::string(1 << 20, 'x'))), Reason::kDiskFull);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
  // Few bytes stay in the buffer until the end, and fail there.
  EXPECT_EQ(ReasonOf(WriteAtomically(path_, "x")), Reason::kDiskFull);
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(AtomicFileTest, NeverWritesWhereALinkPoints) {
  const std::string other = folder_.path() + "/other";
  std::ofstream(other) << "mine";
  fs::create_symlink(other, path_ + kPartSuffix);
  ASSERT_TRUE(WriteAtomically(path_, "new").ok());
  EXPECT_EQ(Read(other), "mine");
  EXPECT_EQ(Read(path_), "new");
  EXPECT_FALSE(fs::is_symlink(path_));
}

TEST_F(AtomicFileTest, NeverWritesIntoAFileThatHasAnotherName) {
  const std::string other = folder_.path() + "/other";
  std::ofstream(other) << "mine";
  fs::create_hard_link(other, path_ + kPartSuffix);
  ASSERT_TRUE(WriteAtomically(path_, "new").ok());
  EXPECT_EQ(Read(other), "mine");
}

TEST_F(AtomicFileTest, BeginsAnewWhereAKilledRunLeftAPart) {
  std::ofstream(path_ + kPartSuffix) << "a longer one, cut off";
  ASSERT_TRUE(WriteAtomically(path_, "new").ok());
  EXPECT_EQ(Read(path_), "new");
}

TEST_F(AtomicFileTest, OfTwoWritersOfOnePathTheLaterOneIsWhole) {
  auto first = AtomicFile::Create(path_);
  ASSERT_TRUE(first.ok() && first->Write("first").ok());
  auto second = AtomicFile::Create(path_);
  ASSERT_TRUE(second.ok() && second->Write("sec").ok());
  EXPECT_FALSE(first->Commit().ok());
  EXPECT_FALSE(fs::exists(path_));
  { const AtomicFile dropped = *std::move(first); }
  ASSERT_TRUE(second->Write("ond").ok());
  ASSERT_TRUE(second->Commit().ok());
  EXPECT_EQ(Read(path_), "second");
}

TEST_F(AtomicFileTest, WhatCannotTakeItsNameLeavesNoPart) {
  auto file = AtomicFile::Create(path_);
  ASSERT_TRUE(file.ok() && file->Write("abc").ok());
  fs::create_directories(path_ + "/taken");
  EXPECT_FALSE(file->Commit().ok());
  EXPECT_FALSE(fs::exists(path_ + kPartSuffix));
}

}  // namespace
}  // namespace dsg
