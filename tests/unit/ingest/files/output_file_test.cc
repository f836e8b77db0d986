// SPDX-License-Identifier: Apache-2.0
// Numbers as text, and files that appear whole or not at all.
#include "ingest/files/output_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdio>
#include <filesystem>
#include <fstream>
#include <sstream>

#include "schema/base/random.h"
#include "schema/base/status.h"
#include "tests/support/full_disk.h"

namespace dsg::ingest {
namespace {

std::string Fixed(double value, int decimals) {
  std::string out;
  AppendFixed(value, decimals, &out);
  return out;
}

std::string TempPath(const std::string& name) {
  return testing::TempDir() + "/dsg_output_" + std::to_string(getpid()) + "_" + name;
}

TEST(AppendFixed, WritesSignPointAndLeadingZeros) {
  EXPECT_EQ(Fixed(0.0, 6), "0");
  EXPECT_EQ(Fixed(-0.0, 6), "0");
  EXPECT_EQ(Fixed(-1e-9, 6), "0");
  EXPECT_EQ(Fixed(1.5, 3), "1.500");
  EXPECT_EQ(Fixed(-0.000012, 6), "-0.000012");
  EXPECT_EQ(Fixed(12345.678901, 6), "12345.678901");
  EXPECT_EQ(Fixed(0.9999999, 6), "1.000000");
}

TEST(AppendFixed, AgreesWithPrintf) {
  const uint64_t seed = 3;
  SCOPED_TRACE(testing::Message() << "seed " << seed);
  Random random(seed, 0);
  for (int i = 0; i < 10'000; ++i) {
    const double value = random.Uniform(-1000.0, 1000.0);
    char expected[64];
    std::snprintf(expected, sizeof(expected), "%.6f", value);
    // Exact ties of the sixth decimal do not occur among these.
    EXPECT_EQ(Fixed(value, 6), expected);
  }
}

TEST(OutputFile, AppearsOnlyWhenCommitted) {
  const std::string path = TempPath("whole");
  {
    auto file = OutputFile::Create(path);
    ASSERT_TRUE(file.ok()) << file.status();
    file->buffer() += "hello\n";
    ASSERT_TRUE(file->Flush().ok());
    EXPECT_FALSE(std::filesystem::exists(path));
    ASSERT_TRUE(file->Commit().ok());
    EXPECT_EQ(file->byte_count(), 6);
  }
  std::ifstream in(path);
  std::stringstream text;
  text << in.rdbuf();
  EXPECT_EQ(text.str(), "hello\n");
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
  std::filesystem::remove(path);
}

TEST(OutputFile, LeavesNothingWhenDropped) {
  const std::string path = TempPath("dropped");
  {
    auto file = OutputFile::Create(path);
    ASSERT_TRUE(file.ok());
    file->buffer().assign(size_t{3} << 20, 'x');
    ASSERT_TRUE(file->Flush().ok());
    EXPECT_TRUE(std::filesystem::exists(path + ".part"));
  }
  EXPECT_FALSE(std::filesystem::exists(path));
  EXPECT_FALSE(std::filesystem::exists(path + ".part"));
}

TEST(OutputFile, SaysWhichFileCannotBeCreated) {
  const auto file = OutputFile::Create("/nonexistent-folder/file");
  EXPECT_EQ(ReasonOf(file.status()), Reason::kFieldInvalid);
  EXPECT_NE(std::string(file.status().message()).find("/nonexistent-folder/file"),
            std::string::npos);
}

TEST(OutputFile, ReportsAFullDisk) {
  const std::string path = TempPath("full");
  const test::FullDisk full;
  auto file = OutputFile::Create(path);
  ASSERT_TRUE(file.ok()) << file.status();
  file->buffer() = "does not fit";
  EXPECT_EQ(ReasonOf(file->Commit()), Reason::kDiskFull);
  EXPECT_FALSE(std::filesystem::exists(path));
}

}  // namespace
}  // namespace dsg::ingest
