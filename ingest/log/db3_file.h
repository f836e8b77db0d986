// SPDX-License-Identifier: Apache-2.0
// Bags of ROS 2 in SQLite files (rosbag2_storage_sqlite3, schema versions 1 to 4).
#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/bag.h"

struct sqlite3;

namespace dsg::ingest {

inline constexpr std::string_view kSqliteMagic{"SQLite format 3\0", 16};

/// The file is not written. Tables that are views, or hold other than rows, are refused.
class Db3File : public Bag {
 public:
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming table, row and what SQLite says.
  static absl::StatusOr<std::shared_ptr<const Db3File>> Open(const std::string& path);
  ~Db3File() override;
  Db3File(const Db3File&) = delete;
  Db3File& operator=(const Db3File&) = delete;

  std::string_view format() const override { return "rosbag2"; }
  const std::string& path() const override { return path_; }
  const std::vector<BagConnection>& connections() const override { return connections_; }
  const std::vector<BagMessageRef>& messages() const override { return messages_; }

 protected:
  absl::StatusOr<BagMessage> ReadFirst(const BagMessageRef& message,
                                       size_t byte_count_max) const override;

 private:
  class Reader;

  explicit Db3File(std::string path) : path_(std::move(path)) {}

  std::string path_;
  sqlite3* database_ = nullptr;
  /// One statement at a time: a connection of SQLite is one.
  mutable std::mutex mutex_;
  std::vector<BagConnection> connections_;
  std::vector<BagMessageRef> messages_;
};

}  // namespace dsg::ingest
