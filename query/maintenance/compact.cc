// SPDX-License-Identifier: Apache-2.0
// Drops old revisions and gives their bytes back, a slice of time a message, so that commits wait
// for one slice at most.
#include <algorithm>
#include <chrono>
#include <optional>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "schema/base/status.h"

namespace dsg::query {
namespace {

// How long commits to the map wait, about.
constexpr std::chrono::milliseconds kCompactSlice{200};

class Compaction final : public EngineCursor<v1::CompactResponse> {
 public:
  Compaction(MapTable* maps, std::string map, std::optional<Revision> keep_from)
      : maps_(maps), map_(std::move(map)), keep_from_(keep_from) {}

  bool done() const override { return is_done_; }

 private:
  absl::Status Fill(const CallContext& call, v1::CompactResponse* reply) override {
    DSG_RETURN_IF_ERROR(maps_->WithWriter(
        map_, call.stop(), [&](MapWriter& writer) { return RunSlice(call, &writer, reply); }));
    reply->set_progress(progress_);
    reply->set_done(is_done_);
    return absl::OkStatus();
  }

  absl::Status RunSlice(const CallContext& call, MapWriter* writer, v1::CompactResponse* reply) {
    DSG_RETURN_IF_ERROR(SettleKeepFrom());
    const auto slice_end = CallContext::Clock::now() + kCompactSlice;
    bool slice_is_over = false;
    const StopCheck stop = [&]() -> absl::Status {
      DSG_RETURN_IF_ERROR(call.Check());
      slice_is_over = CallContext::Clock::now() >= slice_end;
      return slice_is_over ? absl::CancelledError("commits go first") : absl::OkStatus();
    };
    // A later slice passes again, quickly, over what earlier ones have done.
    const auto tell = [&](double fraction) { progress_ = std::max(progress_, fraction); };
    const absl::StatusOr<CompactReport> report = writer->Compact(*keep_from_, stop, tell);
    if (!report.ok()) {
      return slice_is_over && absl::IsCancelled(report.status()) ? absl::OkStatus()
                                                                 : report.status();
    }
    is_done_ = true;
    progress_ = 1.0;
    reply->set_oldest_revision(report->oldest);
    reply->set_revision_count(report->revision_count);
    reply->set_row_count(report->row_count);
    reply->set_file_bytes_before(report->bytes_before);
    reply->set_file_bytes_after(report->bytes_after);
    reply->set_shrunk(report->is_shrunk);
    return absl::OkStatus();
  }

  // The newest is that when the work begins.
  absl::Status SettleKeepFrom() {
    if (keep_from_.has_value()) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> map, maps_->Reader(map_));
    DSG_ASSIGN_OR_RETURN(const RevisionInfo head, map->Head());
    keep_from_ = head.revision;
    return absl::OkStatus();
  }

  MapTable* const maps_;
  const std::string map_;
  std::optional<Revision> keep_from_;
  double progress_ = 0.0;
  bool is_done_ = false;
};

}  // namespace

CursorOr<v1::CompactResponse> Compact(Engine* engine, const CallContext&,
                                      const v1::CompactRequest& request) {
  if (request.keep_from_revision() < 0) {
    return FieldError("keep_from_revision", absl::StrCat(request.keep_from_revision()),
                      "give a revision, or none for the newest");
  }
  DSG_RETURN_IF_ERROR(engine->maps.Reader(request.map()).status());
  std::optional<Revision> keep_from;
  if (request.has_keep_from_revision()) keep_from = request.keep_from_revision();
  return std::make_unique<Compaction>(&engine->maps, request.map(), keep_from);
}

}  // namespace dsg::query
