// SPDX-License-Identifier: Apache-2.0
// ROS 1 bags of version 2.0.
// Refuses bags without an index.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/bag.h"
#include "ingest/log/random_file.h"
#include "schema/base/cache.h"

namespace dsg::ingest {

inline constexpr std::string_view kBagMagic = "#ROSBAG V2.0\n";

/// Source: "Bags/Format/2.0" of the ROS wiki.
/// Threads: any number of callers once open.
class BagFile : public Bag {
 public:
  /// Reads the index. Every length is checked against the bytes that are left.
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the byte offset; a bag that was not closed
  /// names `rosbag reindex`.
  static absl::StatusOr<std::shared_ptr<const BagFile>> Open(const std::string& path);

  std::string_view format() const override { return "rosbag"; }
  const std::string& path() const override { return file_->path(); }
  const std::vector<BagConnection>& connections() const override { return connections_; }
  const std::vector<BagMessageRef>& messages() const override { return messages_; }

 protected:
  absl::StatusOr<BagMessage> ReadFirst(const BagMessageRef& message,
                                       size_t byte_count_max) const override;

 private:
  struct Chunk {
    uint64_t data_at = 0;
    uint32_t data_size = 0;
    uint32_t declared_size = 0;
    std::string compression;
  };
  struct Record;
  class Builder;

  explicit BagFile(std::unique_ptr<const RandomFile> file);

  absl::Status Fail(uint64_t at, const std::string& message) const {
    return file_->Fail(at, message);
  }
  absl::StatusOr<std::string> ReadBytes(uint64_t at, uint64_t size) const;
  absl::StatusOr<std::shared_ptr<const std::string>> LoadChunk(uint32_t index) const;
  absl::StatusOr<BagMessage> ReadPlain(const BagMessageRef& message, size_t byte_count_max) const;
  absl::Status CheckMessageHeader(const BagMessageRef& message, std::string_view header) const;

  std::unique_ptr<const RandomFile> file_;
  uint64_t size_;
  std::vector<BagConnection> connections_;
  std::vector<Chunk> chunks_;
  std::vector<BagMessageRef> messages_;
  mutable Cache<uint32_t, std::shared_ptr<const std::string>> unpacked_;
};

}  // namespace dsg::ingest
