// SPDX-License-Identifier: Apache-2.0
// Files and folders are for whom the folder above is for.
#include "schema/base/folder_mode.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>

#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

mode_t ModeOf(const std::string& path) {
  struct stat found {};
  EXPECT_EQ(stat(path.c_str(), &found), 0) << path;
  return found.st_mode & 0777;
}

TEST(FolderMode, NobodyGetsMoreThanTheFolderGives) {
  const test::TempFolder folder;
  const struct {
    mode_t folder;
    mode_t file_in;
    mode_t folder_in;
  } cases[] = {{0700, 0600, 0700},
               {0755, 0644, 0755},
               {0770, 0660, 0770},
               {0777, 0666, 0777},
               {0500, 0600, 0700}};
  for (const auto& one : cases) {
    chmod(folder.path().c_str(), one.folder);
    EXPECT_EQ(FileModeIn(folder.path()), one.file_in) << std::oct << one.folder;
    EXPECT_EQ(FolderModeIn(folder.path()), one.folder_in) << std::oct << one.folder;
  }
  chmod(folder.path().c_str(), 0700);
  EXPECT_EQ(FileModeIn(folder.path() + "/none"), 0600u);
}

TEST(FolderMode, AFolderOfItsOwnIsPrivateAndOneThatIsThereStays) {
  const test::TempFolder folder;
  const std::string above = folder.path() + "/a/b";
  ASSERT_TRUE(MakePrivateFolder(above + "/c/").ok());
  EXPECT_EQ(ModeOf(above + "/c"), 0700u);
  EXPECT_NE(ModeOf(above), 0700u);
  chmod(above.c_str(), 0755);
  ASSERT_TRUE(MakePrivateFolder(above).ok());
  EXPECT_EQ(ModeOf(above), 0755u);
  std::ofstream(folder.path() + "/file") << "x";
  EXPECT_FALSE(MakePrivateFolder(folder.path() + "/file/d").ok());
}

}  // namespace
}  // namespace dsg
