// SPDX-License-Identifier: Apache-2.0
// MCAP files that are still written, as bags that get further messages.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/bag.h"
#include "ingest/log/growing_file.h"
#include "ingest/log/mcap_file.h"

namespace dsg::ingest {

/// The first messages of a bag, as a bag of their own, with the connections that come up to them.
/// Requires: `bag` outlives it.
class BagBegin : public Bag {
 public:
  BagBegin(const Bag& bag, size_t message_count);

  std::string_view format() const override { return bag_.format(); }
  const std::string& path() const override { return bag_.path(); }
  const std::vector<BagConnection>& connections() const override { return connections_; }
  const std::vector<BagMessageRef>& messages() const override { return messages_; }

 protected:
  absl::StatusOr<BagMessage> ReadFirst(const BagMessageRef& message,
                                       size_t byte_count_max) const override {
    return bag_.Read(message, byte_count_max);
  }

 private:
  const Bag& bag_;
  std::vector<BagConnection> connections_;
  std::vector<BagMessageRef> messages_;
};

/// How long bytes that are no record are waited for before it is told.
inline constexpr std::chrono::milliseconds kTellAfter(2000);

/// Threads: one caller at a time; messages of bag() may be read by others meanwhile.
class GrowingBag {
 public:
  /// Errors: of McapFile::OpenGrowing.
  static absl::StatusOr<std::unique_ptr<GrowingBag>> Open(std::unique_ptr<GrowingFile> file);

  const std::shared_ptr<McapFile>& bag() const { return bag_; }
  GrowingFile& file() { return *file_; }

  /// Waits for further messages. False: there will be none. Tells once (FollowOptions::tell) which
  /// bytes are no record, if nothing comes for kTellAfter.
  /// Errors: of GrowingFile::WaitBeyond and McapFile::GrowTo.
  absl::StatusOr<bool> Wait();

  /// How many bytes at the end of the file were no whole record, and where; empty if none were, or
  /// the bag has its own end.
  std::string RestNote() const;

  /// Waits until the first `begin_ns` are there, by the times of recording, or a shorter bag has
  /// been closed; how many messages they are.
  /// Errors: of Wait; INVALID_ARGUMENT/FILE_MALFORMED when there will be no more before.
  absl::StatusOr<size_t> WaitForBegin(TimeNs begin_ns);

 private:
  GrowingBag() = default;

  absl::StatusOr<bool> HasMoreBytes();
  void TellOnce();
  std::string RestText() const;

  std::shared_ptr<McapFile> bag_;
  std::unique_ptr<GrowingFile> file_;
  /// How much of the file the bag knows.
  uint64_t seen_ = 0;
  bool has_told_ = false;
};

}  // namespace dsg::ingest
