// SPDX-License-Identifier: Apache-2.0
// ROS bags of version 2.0: what is in them, and any message by its place in the index.
// Refuses bags without an index, and to hold more than a few chunks in memory.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/base/time.h"

namespace dsg::ingest {

inline constexpr std::string_view kBagMagic = "#ROSBAG V2.0\n";

/// One publisher of one topic.
struct BagConnection {
  uint32_t id = 0;
  std::string topic;
  /// "sensor_msgs/Imu".
  std::string type;
  int64_t message_count = 0;
};

struct BagMessageRef {
  /// When it was recorded, by the recorder's clock.
  TimeNs bag_time_ns = 0;
  /// Index into connections().
  uint32_t connection = 0;
  uint32_t chunk = 0;
  /// Within the chunk, decompressed.
  uint32_t offset = 0;
};

/// The bytes of one message, kept alive.
struct BagMessage {
  std::shared_ptr<const std::string> owner;
  std::string_view data;
};

/// Source: "Bags/Format/2.0" of the ROS wiki.
/// Threads: any number of callers once open.
class BagFile {
 public:
  /// Reads the index. Every length is checked against the bytes that are left.
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the byte offset; a bag that was not closed
  /// names `rosbag reindex`.
  static absl::StatusOr<std::shared_ptr<const BagFile>> Open(const std::string& path);
  ~BagFile();
  BagFile(const BagFile&) = delete;
  BagFile& operator=(const BagFile&) = delete;

  const std::string& path() const { return path_; }
  const std::vector<BagConnection>& connections() const { return connections_; }
  /// In the order in which they were recorded.
  const std::vector<BagMessageRef>& messages() const { return messages_; }

  /// A message's bytes, or the first `byte_count_max` of them; the latter reads less of a bag
  /// that is not compressed.
  absl::StatusOr<BagMessage> Read(const BagMessageRef& message,
                                  size_t byte_count_max = SIZE_MAX) const;

 private:
  struct Chunk {
    uint64_t data_at = 0;
    uint32_t data_size = 0;
    uint32_t declared_size = 0;
    std::string compression;
  };
  struct Record;
  class Builder;

  BagFile(std::string path, int descriptor, uint64_t size)
      : path_(std::move(path)), descriptor_(descriptor), size_(size) {}

  absl::Status Fail(uint64_t at, const std::string& message) const;
  absl::StatusOr<std::string> ReadBytes(uint64_t at, uint64_t size) const;
  absl::StatusOr<std::shared_ptr<const std::string>> LoadChunk(uint32_t index) const;
  absl::StatusOr<BagMessage> ReadPlain(const BagMessageRef& message, size_t byte_count_max) const;
  absl::Status CheckMessageHeader(const BagMessageRef& message, std::string_view header) const;

  std::string path_;
  int descriptor_;
  uint64_t size_;
  std::vector<BagConnection> connections_;
  std::vector<Chunk> chunks_;
  std::vector<BagMessageRef> messages_;

  mutable std::mutex mutex_;
  /// Newest first, decompressed.
  mutable std::list<std::pair<uint32_t, std::shared_ptr<const std::string>>> cache_;
  mutable size_t cache_bytes_ = 0;
};

}  // namespace dsg::ingest
