// SPDX-License-Identifier: Apache-2.0
// True bodies read back one by one as they were written, and nothing else reads as some.
#include "ingest/truth/body_file.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "schema/base/status.h"
#include "tests/support/temp_folder.h"

namespace dsg::truth {
namespace {

const std::vector<Eigen::Vector3f> kBody = {{0.1F, -1.2345F, 0.5F}, {2.0F, 0.0F, -3.0F}};

class BodyFiles : public testing::Test {
 protected:
  void WriteTwo() const {
    auto file = BodyFileWriter::Create(folder_.path(), 2);
    ASSERT_TRUE(file.ok()) << file.status();
    ASSERT_TRUE(file->Add(7, kBody).ok());
    ASSERT_TRUE(file->Add(-9, {{1.0F, 1.0F, 1.0F}, {0.0F, 0.0F, 0.0F}}).ok());
    ASSERT_TRUE(file->Commit().ok());
  }
  std::string path() const { return folder_.path() + "/bodies.bin"; }

  test::TempFolder folder_;
};

TEST_F(BodyFiles, ReadBackByTheirDetection) {
  WriteTwo();
  auto bodies = BodyFile::Open(folder_.path());
  ASSERT_TRUE(bodies.ok()) << bodies.status();
  ASSERT_TRUE(bodies->has_value());
  EXPECT_EQ((*bodies)->vertex_count(), 2U);
  EXPECT_EQ((*bodies)->body_count(), 2U);
  const auto last = (*bodies)->Read(-9);
  ASSERT_TRUE(last.ok() && last->has_value());
  EXPECT_EQ((**last)[0], Eigen::Vector3f(1.0F, 1.0F, 1.0F));
  const auto first = (*bodies)->Read(7);
  ASSERT_TRUE(first.ok() && first->has_value());
  for (size_t i = 0; i < kBody.size(); ++i) EXPECT_LT(((**first)[i] - kBody[i]).norm(), 1e-4F);
  const auto nobody = (*bodies)->Read(8);
  ASSERT_TRUE(nobody.ok());
  EXPECT_FALSE(nobody->has_value());
}

TEST_F(BodyFiles, MayBeMissingButNotBroken) {
  const auto missing = BodyFile::Open(folder_.path());
  ASSERT_TRUE(missing.ok());
  EXPECT_FALSE(missing->has_value());
  WriteTwo();
  const auto size = std::filesystem::file_size(path());
  for (const uintmax_t cut : {size - 1, size - 12, uintmax_t{11}, uintmax_t{0}}) {
    std::filesystem::resize_file(path(), cut);
    EXPECT_EQ(ReasonOf(BodyFile::Open(folder_.path()).status()), Reason::kFileMalformed) << cut;
    WriteTwo();
  }
  std::ofstream(path(), std::ios::binary) << "DSGBODY2" << std::string(4, '\1');
  EXPECT_EQ(ReasonOf(BodyFile::Open(folder_.path()).status()), Reason::kFileMalformed);
  std::ofstream(path(), std::ios::binary) << "DSGBODY1" << std::string(4, '\xff');
  EXPECT_EQ(ReasonOf(BodyFile::Open(folder_.path()).status()), Reason::kFileMalformed);
}

}  // namespace
}  // namespace dsg::truth
