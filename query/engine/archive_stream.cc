// SPDX-License-Identifier: Apache-2.0
// A map as the bytes of an archive. Refuses to hold any lock on the map while they are read, and
// to go on with bytes that were erased from the map since.
#include <string>
#include <utility>

#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/archive_copies.h"
#include "query/engine/engine.h"
#include "query/engine/engine_cursor.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

class ArchiveStream final : public EngineCursor<v1::ReadArchiveResponse> {
 public:
  ArchiveStream(ArchiveCopies* copies, std::shared_ptr<ArchiveRead> read)
      : copies_(copies), read_(std::move(read)) {}
  ~ArchiveStream() override { copies_->Leave(read_.get()); }

  bool done() const override { return is_done_; }

 private:
  absl::Status Fill(const CallContext& call, v1::ReadArchiveResponse* reply) override {
    DSG_ASSIGN_OR_RETURN(ArchiveRead::Piece piece, read_->Next(call.stop(), copies_->limits()));
    *reply->mutable_content() = std::move(piece.content);
    reply->set_progress(piece.progress);
    is_done_ = piece.is_last;
    if (is_done_) copies_->Leave(read_.get());
    return absl::OkStatus();
  }

  ArchiveCopies* const copies_;
  const std::shared_ptr<ArchiveRead> read_;
  bool is_done_ = false;
};

}  // namespace

// The first message takes as long as copying the map does.
CursorOr<v1::ReadArchiveResponse> ReadArchive(Engine* engine, const CallContext&,
                                              const v1::ReadArchiveRequest& request) {
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> map, engine->maps.Reader(request.map()));
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<ArchiveRead> read,
                       engine->maps.archives().Begin(std::move(map)));
  return std::make_unique<ArchiveStream>(&engine->maps.archives(), std::move(read));
}

}  // namespace dsg::query
