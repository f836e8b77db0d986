// SPDX-License-Identifier: Apache-2.0
#include "query/engine/archive_stream.h"

#include <string>
#include <utility>

#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/archive_copies.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

class ArchiveStream final : public ArchiveCursor {
 public:
  ArchiveStream(ArchiveCopies* copies, std::shared_ptr<ArchiveRead> read)
      : copies_(copies), read_(std::move(read)) {}
  ~ArchiveStream() override { copies_->Leave(read_.get()); }

  absl::Status Next(const CallContext& call, v1::ReadArchiveResponse* reply) override {
    DSG_RETURN_IF_ERROR(call.Check());
    DSG_ASSIGN_OR_RETURN(ArchiveRead::Piece piece, read_->Next(call.stop(), copies_->limits()));
    *reply->mutable_content() = std::move(piece.content);
    reply->set_progress(piece.progress);
    is_done_ = piece.is_last;
    if (is_done_) copies_->Leave(read_.get());
    return absl::OkStatus();
  }

  bool done() const override { return is_done_; }

 private:
  ArchiveCopies* const copies_;
  const std::shared_ptr<ArchiveRead> read_;
  bool is_done_ = false;
};

}  // namespace

absl::StatusOr<std::unique_ptr<ArchiveCursor>> OpenArchive(MapTable* maps,
                                                           const v1::ReadArchiveRequest& request) {
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> map, maps->Reader(request.map()));
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<ArchiveRead> read, maps->archives().Begin(std::move(map)));
  return std::make_unique<ArchiveStream>(&maps->archives(), std::move(read));
}

}  // namespace dsg::query
