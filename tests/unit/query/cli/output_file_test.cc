// SPDX-License-Identifier: Apache-2.0
// Files appear whole or not at all, and never in place of another unasked.
#include "query/cli/export/output_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "schema/base/status.h"
#include "tests/support/temp_folder.h"

namespace dsg::cli {
namespace {

namespace fs = std::filesystem;

std::string Read(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class OutputFileTest : public testing::Test {
 protected:
  dsg::test::TempFolder folder_;
  const std::string path_ = folder_.path() + "/mesh.ply";
};

TEST_F(OutputFileTest, AppearsWithItsLastCallOnly) {
  auto file = OutputFile::Create(path_, false);
  ASSERT_TRUE(file.ok()) << file.status();
  ASSERT_TRUE(file->Write("abc").ok());
  EXPECT_FALSE(fs::exists(path_));
  ASSERT_TRUE(file->Write("de").ok());
  ASSERT_TRUE(file->Commit().ok());
  EXPECT_EQ(file->byte_count(), 5);
  EXPECT_EQ(Read(path_), "abcde");
  EXPECT_FALSE(fs::exists(path_ + ".part"));
}

TEST_F(OutputFileTest, LeavesNothingWhenDropped) {
  {
    auto file = OutputFile::Create(path_, false);
    ASSERT_TRUE(file.ok() && file->Write("abc").ok());
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
}

TEST_F(OutputFileTest, ReplacesAFileOnlyWhenForced) {
  std::ofstream(path_) << "old";
  const auto refused = OutputFile::Create(path_, false);
  EXPECT_EQ(ReasonOf(refused.status()), Reason::kFieldInvalid);
  EXPECT_NE(refused.status().message().find("--force"), std::string::npos);
  EXPECT_EQ(Read(path_), "old");
  auto file = OutputFile::Create(path_, true);
  ASSERT_TRUE(file.ok() && file->Write("new").ok() && file->Commit().ok());
  EXPECT_EQ(Read(path_), "new");
}

TEST_F(OutputFileTest, NeverReplacesWhatIsNoPlainFile) {
  EXPECT_EQ(ReasonOf(OutputFile::Create(folder_.path(), true).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(OutputFile::Create("/dev/full", true).status()), Reason::kFieldInvalid);
  EXPECT_EQ(ReasonOf(OutputFile::Create(folder_.path() + "/no/a.ply", true).status()),
            Reason::kFieldInvalid);
}

TEST_F(OutputFileTest, AFullDiskIsAnErrorAndLeavesNoFile) {
  fs::create_symlink("/dev/full", path_ + ".part");
  {
    auto file = OutputFile::Create(path_, false);
    ASSERT_TRUE(file.ok()) << file.status();
    absl::Status status = file->Write(std::string(1 << 20, 'x'));
    if (status.ok()) status = file->Commit();
    EXPECT_EQ(ReasonOf(status), Reason::kDiskFull) << status;
  }
  EXPECT_TRUE(fs::is_empty(folder_.path()));
  // Few bytes stay in the buffer until the end, and fail there.
  fs::create_symlink("/dev/full", path_ + ".part");
  auto file = OutputFile::Create(path_, false);
  ASSERT_TRUE(file.ok() && file->Write("x").ok());
  EXPECT_EQ(ReasonOf(file->Commit()), Reason::kDiskFull);
  EXPECT_FALSE(fs::exists(path_));
}

}  // namespace
}  // namespace dsg::cli
