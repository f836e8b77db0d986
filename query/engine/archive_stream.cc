// SPDX-License-Identifier: Apache-2.0
#include "query/engine/archive_stream.h"

#include <string>
#include <utility>

#include "dsg/v1/maintenance_service.pb.h"
#include "schema/archive/archive_map.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

class ArchiveStream final : public ArchiveCursor {
 public:
  ArchiveStream(MapTable* maps, std::shared_ptr<MapReader> map)
      : maps_(maps), map_(std::move(map)) {}

  absl::Status Next(const CallContext& call, v1::ReadArchiveResponse* reply) override {
    DSG_RETURN_IF_ERROR(call.Check());
    if (encoder_ == nullptr) {
      // Beside the maps, where there is as much space as a map needs.
      DSG_ASSIGN_OR_RETURN(encoder_,
                           ArchiveMap(map_.get(), maps_->store().folder(), call.stop(), nullptr));
    }
    DSG_ASSIGN_OR_RETURN(*reply->mutable_content(), encoder_->Next(call.stop()));
    reply->set_progress(encoder_->progress());
    return absl::OkStatus();
  }

  bool done() const override { return encoder_->done(); }

 private:
  MapTable* const maps_;
  const std::shared_ptr<MapReader> map_;
  std::unique_ptr<ArchiveEncoder> encoder_;
};

}  // namespace

absl::StatusOr<std::unique_ptr<ArchiveCursor>> OpenArchive(MapTable* maps,
                                                           const v1::ReadArchiveRequest& request) {
  DSG_ASSIGN_OR_RETURN(std::shared_ptr<MapReader> map, maps->Reader(request.map()));
  return std::make_unique<ArchiveStream>(maps, std::move(map));
}

}  // namespace dsg::query
