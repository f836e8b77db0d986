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
    DSG_ASSIGN_OR_RETURN(const GrowingFile::Wait wait, file_->WaitBeyond(seen_));
    if (wait == GrowingFile::Wait::kEnd) return false;
    seen_ = file_->size();
    DSG_RETURN_IF_ERROR(bag_->GrowTo(seen_));
  }
  return true;
}

absl::StatusOr<size_t> GrowingBag::WaitForBegin(TimeNs begin_ns) {
  for (size_t count = 0;; ++count) {
    if (count == bag_->messages().size()) {
      DSG_ASSIGN_OR_RETURN(const bool has_more, Wait());
      if (!has_more && bag_->is_closed()) return count;
      if (!has_more) {
        return MalformedFile(file_->path(),
                             absl::StrCat("ends, without having been closed, within the first ",
                                          begin_ns / kNsPerSecond,
                                          " s, which tell what is in it; nothing was read"));
      }
    }
    const std::vector<BagMessageRef>& messages = bag_->messages();
    if (messages[count].bag_time_ns - messages.front().bag_time_ns >= begin_ns) return count;
  }
}

}  // namespace dsg::ingest
