// SPDX-License-Identifier: Apache-2.0
// Maps as a whole taken away from their names: dropped, renamed.
#include <memory>
#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request.h"
#include "query/maintenance/archives.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {

absl::Status DropMap(Engine* engine, const CallContext& call, const v1::DropMapRequest& request,
                     v1::DropMapResponse* reply) {
  if (request.expected_head_revision() < 0) {
    return FieldError("expected_head_revision", absl::StrCat(request.expected_head_revision()),
                      "give the newest revision of the map, or none for any");
  }
  MapCondition condition;
  if (request.has_expected_head_revision()) condition.head = request.expected_head_revision();
  condition.incarnation = request.expected_incarnation();
  DSG_RETURN_IF_ERROR(engine->maps.TakeAway(request.map(), call.stop(), [&]() -> absl::Status {
    DSG_ASSIGN_OR_RETURN(const DropReport report,
                         engine->maps.store().DropMap(request.map(), condition));
    if (report.head.has_value()) reply->set_head_revision(*report.head);
    reply->set_bytes_on_disk(report.bytes_on_disk);
    return absl::OkStatus();
  }));
  // Copies on their way to readers are of the map, too.
  engine->archives->EndOf(request.map());
  return absl::OkStatus();
}

absl::Status RenameMap(Engine* engine, const CallContext& call, const v1::RenameMapRequest& request,
                       v1::RenameMapResponse* reply) {
  DSG_RETURN_IF_ERROR(CheckMapName(request.new_name()));
  DSG_RETURN_IF_ERROR(engine->maps.TakeAway(request.map(), call.stop(), [&] {
    return engine->maps.store().RenameMap(request.map(), request.new_name());
  }));
  DSG_ASSIGN_OR_RETURN(const std::shared_ptr<MapReader> reader,
                       engine->maps.Reader(request.new_name()));
  ToProto(reader->spec(), reply->mutable_map());
  return absl::OkStatus();
}

}  // namespace dsg::query
