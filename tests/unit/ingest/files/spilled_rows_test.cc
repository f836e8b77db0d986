// SPDX-License-Identifier: Apache-2.0
// Long tables: every row comes back, short ones stay in memory, and a disk that fails is told.
#include "ingest/files/spilled_rows.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include "tests/support/full_disk.h"
#include "tests/support/open_files.h"
#include "tests/support/temp_folder.h"

namespace dsg::ingest {
namespace {

using test::TempFolder;

struct Pair {
  int64_t number = 0;
  double half = 0.0;
};
using Rows = SpilledRows<Pair>;

constexpr size_t kLong = Rows::kKeptCount + 3 * Rows::kPageSize + 77;

absl::Status Fill(size_t count, Rows* rows) {
  for (size_t i = rows->size(); i < count; ++i) {
    const absl::Status added = rows->Add({static_cast<int64_t>(i), 0.5 * static_cast<double>(i)});
    if (!added.ok()) return added;
  }
  return absl::OkStatus();
}

TEST(SpilledRows, GiveAllRowsBack) {
  const TempFolder folder;
  Rows rows(folder.path());
  ASSERT_TRUE(Fill(Rows::kKeptCount, &rows).ok());
  EXPECT_TRUE(test::OpenFilesIn(folder.path()).empty());
  ASSERT_TRUE(Fill(kLong, &rows).ok());
  EXPECT_EQ(test::OpenFilesIn(folder.path()).size(), 1u);
  ASSERT_EQ(rows.size(), kLong);
  // In order, as logs are read, and then from the end.
  for (const size_t step : {size_t{1}, size_t{9973}}) {
    for (size_t i = 0; i < kLong; i += step) {
      const size_t index = step == 1 ? i : kLong - 1 - i;
      const absl::StatusOr<Pair> row = rows.At(index);
      ASSERT_TRUE(row.ok()) << row.status();
      ASSERT_EQ(row->number, static_cast<int64_t>(index));
      ASSERT_EQ(row->half, 0.5 * static_cast<double>(index));
    }
  }
}

TEST(SpilledRows, TellThatTheDiskIsFullOrHasChanged) {
  const TempFolder folder;
  Rows rows(folder.path());
  ASSERT_TRUE(Fill(kLong, &rows).ok());
  {
    const test::FullDisk full;
    EXPECT_EQ(ReasonOf(Fill(kLong + Rows::kPageSize, &rows)), Reason::kDiskFull);
  }
  EXPECT_TRUE(rows.At(kLong - 1).ok());
  const std::vector<int> open = test::OpenFilesIn(folder.path());
  ASSERT_EQ(open.size(), 1u);
  ASSERT_EQ(pwrite(open[0], "x", 1, 3), 1);
  EXPECT_TRUE(rows.At(5).ok());
  EXPECT_TRUE(absl::IsDataLoss(rows.At(Rows::kKeptCount).status()));
}

}  // namespace
}  // namespace dsg::ingest
