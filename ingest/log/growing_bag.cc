// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/growing_bag.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {

BagBegin::BagBegin(const Bag& bag, size_t message_count)
    : bag_(bag),
      connections_(bag.connections()),
      messages_(bag.messages().begin(),
                bag.messages().begin() + static_cast<std::ptrdiff_t>(message_count)) {
  // A file that has been written further has no more of them here.
  size_t connection_count = 0;
  for (const BagMessageRef& ref : messages_) {
    connection_count = std::max<size_t>(connection_count, ref.connection + 1);
  }
  connections_.resize(connection_count);
  for (BagConnection& connection : connections_) connection.message_count = 0;
  for (const BagMessageRef& ref : messages_) ++connections_[ref.connection].message_count;
}

absl::StatusOr<std::unique_ptr<GrowingBag>> GrowingBag::Open(std::unique_ptr<GrowingFile> file) {
  std::unique_ptr<GrowingBag> growing(new GrowingBag);
  DSG_ASSIGN_OR_RETURN(growing->bag_, McapFile::OpenGrowing(file->path()));
  growing->file_ = std::move(file);
  return growing;
}

absl::StatusOr<bool> GrowingBag::Wait() {
  const size_t known = bag_->messages().size();
  while (bag_->messages().size() == known) {
    if (bag_->is_closed()) return false;
    const auto begin = std::chrono::steady_clock::now();
    const auto has_more = [&]() -> absl::StatusOr<bool> {
      if (std::chrono::steady_clock::now() - begin >= kTellAfter) TellOnce();
      return HasMoreBytes();
    };
    DSG_ASSIGN_OR_RETURN(const GrowingFile::Wait wait, file_->WaitUntil(has_more));
    if (wait == GrowingFile::Wait::kEnd) return false;
    seen_ = file_->size();
    DSG_RETURN_IF_ERROR(bag_->GrowTo(seen_));
  }
  return true;
}

// A writer that has set space aside writes without making the file longer.
absl::StatusOr<bool> GrowingBag::HasMoreBytes() {
  if (file_->size() > seen_) return true;
  if (!bag_->zero_at().has_value()) return false;
  const uint64_t taken_size = bag_->taken_size();
  DSG_RETURN_IF_ERROR(bag_->GrowTo(seen_));
  return bag_->taken_size() > taken_size;
}

void GrowingBag::TellOnce() {
  if (bag_->taken_size() >= seen_ || std::exchange(has_told_, true)) return;
  file_->Tell(absl::StrCat(RestText(), "; waiting for what is to stand there"));
}

std::string GrowingBag::RestText() const {
  return absl::StrCat("the ", seen_ - bag_->taken_size(), " bytes from byte ", bag_->taken_size(),
                      " on are no whole record",
                      bag_->zero_at().has_value() ? " (zeros, as in space that is set aside)" : "");
}

std::string GrowingBag::RestNote() const {
  if (bag_->is_closed() || bag_->taken_size() >= seen_) return "";
  return absl::StrCat(RestText(), " and were not read");
}

absl::StatusOr<size_t> GrowingBag::WaitForBegin(TimeNs begin_ns) {
  for (size_t count = 0;; ++count) {
    if (count == bag_->messages().size()) {
      DSG_ASSIGN_OR_RETURN(const bool has_more, Wait());
      if (!has_more && bag_->is_closed()) return count;
      if (!has_more) {
        const std::string rest = RestNote();
        return MalformedFile(
            file_->path(),
            absl::StrCat("ends, without having been closed, within the first ",
                         begin_ns / kNsPerSecond, " s, which tell what is in it; nothing was read",
                         rest.empty() ? "" : "; ", rest));
      }
    }
    const std::vector<BagMessageRef>& messages = bag_->messages();
    if (messages[count].bag_time_ns - messages.front().bag_time_ns >= begin_ns) return count;
  }
}

}  // namespace dsg::ingest
