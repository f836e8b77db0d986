// SPDX-License-Identifier: Apache-2.0
// MCAP files: the recordings of ROS 2, and of other programs.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/bag.h"
#include "ingest/log/random_file.h"
#include "schema/base/cache.h"

namespace dsg::ingest {

inline constexpr std::string_view kMcapMagic = "\x89MCAP0\r\n";

/// Chunks may be plain, lz4 or zstd; what has no index is looked through. Checksums that are there
/// are checked: of the data and the summary when a file is opened, of a chunk when it is unpacked.
/// Attachments and metadata are passed over.
///
/// Source: "MCAP Format Specification", version 0, mcap.dev.
class McapFile : public Bag {
 public:
  /// Every length is checked against the bytes that are left.
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the byte offset; a file that was not closed
  /// names `mcap recover`.
  static absl::StatusOr<std::shared_ptr<const McapFile>> Open(const std::string& path);
  ~McapFile() override;

  /// Opens a file that is still written. It holds no messages before GrowTo.
  static absl::StatusOr<std::shared_ptr<McapFile>> OpenGrowing(const std::string& path);
  /// Adds the messages of the records and chunks that are whole within the first `size` bytes, as
  /// they stand in the file; `size` does not shrink from call to call. No record begins with a
  /// zero: where one stands the writer has set space aside. A record before it may be written in
  /// part, so it counts when another byte stands there. Threads: one caller, while others read
  /// messages. Errors: of Open; what was added before stays.
  absl::Status GrowTo(uint64_t size);
  /// Whether the end of the data has been seen: there will be no more messages.
  bool is_closed() const { return is_closed_; }
  /// Of a file that grows: up to here GrowTo has taken all of it...
  uint64_t taken_size() const { return taken_size_; }
  /// ...and where it has met a zero in the place of a record.
  std::optional<uint64_t> zero_at() const { return zero_at_; }

  std::string_view format() const override { return "mcap"; }
  const std::string& path() const override { return file_->path(); }
  const std::vector<BagConnection>& connections() const override { return connections_; }
  const std::vector<BagMessageRef>& messages() const override { return messages_; }

 protected:
  absl::StatusOr<BagMessage> ReadFirst(const BagMessageRef& message,
                                       size_t byte_count_max) const override;

 private:
  struct Chunk {
    uint64_t data_at = 0;
    uint64_t data_size = 0;
    uint64_t declared_size = 0;
    /// 0 = none.
    uint32_t crc = 0;
    std::string compression;
  };
  class Builder;

  explicit McapFile(std::unique_ptr<RandomFile> file);

  Chunk ChunkAt(uint32_t index) const;
  absl::StatusOr<std::shared_ptr<const std::string>> LoadChunk(uint32_t index) const;
  absl::StatusOr<BagMessage> ReadPlain(const BagMessageRef& message, RosEncoding encoding,
                                       size_t byte_count_max) const;

  std::unique_ptr<RandomFile> file_;
  /// Of a file that grows; null once it is read whole.
  std::unique_ptr<Builder> builder_;
  bool is_closed_ = false;
  uint64_t taken_size_ = 0;
  std::optional<uint64_t> zero_at_;
  /// Pictures are read by any thread while a growing file gets further channels and chunks.
  mutable std::mutex growth_mutex_;
  std::vector<BagConnection> connections_;
  std::vector<Chunk> chunks_;
  std::vector<BagMessageRef> messages_;
  mutable Cache<uint32_t, std::shared_ptr<const std::string>> unpacked_;
};

}  // namespace dsg::ingest
