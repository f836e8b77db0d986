// SPDX-License-Identifier: Apache-2.0
// A long table whose rows are read one after another: the first rows in memory, the others on disk.
#pragma once

#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/files/spill_file.h"
#include "schema/base/status.h"

namespace dsg::ingest {

/// Memory: kKeptCount + 2 * kPageSize rows at most, and 32 bytes a page.
///
/// Threads: one caller at a time, also of what is const.
template <typename Row>
class SpilledRows {
 public:
  static_assert(std::is_trivially_copyable_v<Row>);
  /// Short tables never go to disk.
  static constexpr size_t kKeptCount = size_t{1} << 18;
  static constexpr size_t kPageSize = 1 << 14;

  /// `folder`: of SpillFile.
  explicit SpilledRows(const std::string& folder = "") : file_(folder) {}

  size_t size() const { return first_.size() + pages_.size() * kPageSize + last_.size(); }

  /// Errors: of SpillFile.
  absl::Status Add(const Row& row) {
    if (first_.size() < kKeptCount) {
      first_.push_back(row);
      return absl::OkStatus();
    }
    last_.push_back(row);
    if (last_.size() < kPageSize) return absl::OkStatus();
    SpillPiece piece;
    DSG_RETURN_IF_ERROR(file_.Write(
        {reinterpret_cast<const char*>(last_.data()), kPageSize * sizeof(Row)}, &piece));
    pages_.push_back(piece);
    last_.clear();
    return absl::OkStatus();
  }

  /// Requires: index < size(). Errors: of SpillFile.
  absl::StatusOr<Row> At(size_t index) const {
    if (index < first_.size()) return first_[index];
    const size_t page = (index - first_.size()) / kPageSize;
    const size_t row = (index - first_.size()) % kPageSize;
    if (page == pages_.size()) return last_[row];
    if (page != read_page_) {
      std::string bytes;
      DSG_RETURN_IF_ERROR(file_.Read(pages_[page], &bytes));
      read_.resize(kPageSize);
      std::memcpy(static_cast<void*>(read_.data()), bytes.data(), bytes.size());
      read_page_ = page;
    }
    return read_[row];
  }

 private:
  SpillFile file_;
  std::vector<Row> first_;
  std::vector<SpillPiece> pages_;
  std::vector<Row> last_;
  mutable size_t read_page_ = SIZE_MAX;
  mutable std::vector<Row> read_;
};

}  // namespace dsg::ingest
