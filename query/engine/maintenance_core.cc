// SPDX-License-Identifier: Apache-2.0
#include "query/engine/maintenance_core.h"

#include "dsg/v1/maintenance_service.pb.h"
#include "query/engine/archive_stream.h"
#include "query/engine/compact.h"
#include "query/engine/merge.h"
#include "query/engine/prune.h"
#include "query/engine/revert.h"
#include "query/engine/send_all.h"
#include "query/engine/tags.h"
#include "schema/base/status.h"

namespace dsg::query {

absl::StatusOr<std::unique_ptr<PruneCursor>> MaintenanceCore::OpenPrune(
    const v1::PruneRequest& request) {
  return query::OpenPrune(&maps_, request);
}

absl::Status MaintenanceCore::Prune(const CallContext& call, const v1::PruneRequest& request,
                                    const std::function<bool(const v1::PruneResponse&)>& send) {
  DSG_RETURN_IF_ERROR(call.Check());
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<PruneCursor> cursor, OpenPrune(request));
  return SendAll(call, cursor.get(), send);
}

absl::StatusOr<std::unique_ptr<CompactCursor>> MaintenanceCore::OpenCompact(
    const v1::CompactRequest& request) {
  return query::OpenCompact(&maps_, request);
}

absl::Status MaintenanceCore::Compact(const CallContext& call, const v1::CompactRequest& request,
                                      const std::function<bool(const v1::CompactResponse&)>& send) {
  DSG_RETURN_IF_ERROR(call.Check());
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<CompactCursor> cursor, OpenCompact(request));
  return SendAll(call, cursor.get(), send);
}

absl::StatusOr<std::unique_ptr<RevertCursor>> MaintenanceCore::OpenRevert(
    const v1::RevertRequest& request) {
  return query::OpenRevert(&maps_, request);
}

absl::Status MaintenanceCore::Revert(const CallContext& call, const v1::RevertRequest& request,
                                     const std::function<bool(const v1::RevertResponse&)>& send) {
  DSG_RETURN_IF_ERROR(call.Check());
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<RevertCursor> cursor, OpenRevert(request));
  return SendAll(call, cursor.get(), send);
}

absl::StatusOr<std::unique_ptr<MergeCursor>> MaintenanceCore::OpenMerge(
    const v1::MergeMapsRequest& request) {
  return query::OpenMerge(&maps_, request);
}

absl::Status MaintenanceCore::MergeMaps(
    const CallContext& call, const v1::MergeMapsRequest& request,
    const std::function<bool(const v1::MergeMapsResponse&)>& send) {
  DSG_RETURN_IF_ERROR(call.Check());
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<MergeCursor> cursor, OpenMerge(request));
  return SendAll(call, cursor.get(), send);
}

absl::StatusOr<std::unique_ptr<ArchiveCursor>> MaintenanceCore::OpenArchive(
    const v1::ReadArchiveRequest& request) {
  return query::OpenArchive(&maps_, request);
}

absl::Status MaintenanceCore::ReadArchive(
    const CallContext& call, const v1::ReadArchiveRequest& request,
    const std::function<bool(const v1::ReadArchiveResponse&)>& send) {
  DSG_RETURN_IF_ERROR(call.Check());
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<ArchiveCursor> cursor, OpenArchive(request));
  return SendAll(call, cursor.get(), send);
}

absl::Status MaintenanceCore::SetTag(const CallContext& call, const v1::SetTagRequest& request,
                                     v1::SetTagResponse* reply) {
  DSG_RETURN_IF_ERROR(call.Check());
  return query::SetTag(&maps_, call, request, reply);
}

absl::Status MaintenanceCore::RemoveTag(const CallContext& call,
                                        const v1::RemoveTagRequest& request,
                                        v1::RemoveTagResponse*) {
  DSG_RETURN_IF_ERROR(call.Check());
  return query::RemoveTag(&maps_, call, request);
}

absl::Status MaintenanceCore::ListTags(const CallContext& call, const v1::ListTagsRequest& request,
                                       v1::ListTagsResponse* reply) {
  DSG_RETURN_IF_ERROR(call.Check());
  return query::ListTags(&maps_, request, reply);
}

}  // namespace dsg::query
