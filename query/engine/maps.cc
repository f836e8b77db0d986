// SPDX-License-Identifier: Apache-2.0
// Maps as a whole: list, measure, look back.
#include <set>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "dsg/v1/map_service.pb.h"
#include "query/engine/engine.h"
#include "query/engine/request_check.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {

absl::Status ListMaps(Engine* engine, const CallContext&, const v1::ListMapsRequest&,
                      v1::ListMapsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const std::vector<MapSpec> specs, engine->maps.store().ListMaps());
  std::set<std::string> readable;
  for (const MapSpec& spec : specs) {
    ToProto(spec, reply->add_maps());
    readable.insert(spec.name);
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> names, engine->maps.store().MapNames());
  for (const std::string& name : names) {
    if (!readable.contains(name)) reply->add_unreadable_maps(name);
  }
  return absl::OkStatus();
}

absl::Status GetMapStats(Engine* engine, const CallContext&, const v1::GetMapStatsRequest& request,
                         v1::GetMapStatsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, engine->Read(request));
  DSG_ASSIGN_OR_RETURN(const MapStats stats, view.snapshot().Stats());
  view.FillHeader(reply->mutable_header());
  ToProto(view.snapshot().spec(), reply->mutable_map());
  reply->set_head_revision(view.head_revision());
  for (const LayerCount& count : stats.layers) {
    v1::LayerStats* layer = reply->add_layers();
    layer->set_name(count.layer.name);
    layer->set_rank(count.layer.rank);
    layer->set_node_count(count.node_count);
  }
  reply->set_node_count(stats.at.node_count);
  reply->set_edge_count(stats.at.edge_count);
  reply->set_agent_count(stats.at.agent_count);
  reply->set_pose_count(stats.at.pose_count);
  reply->set_stay_count(stats.at.stay_count);
  reply->set_mesh_block_count(stats.at.mesh_block_count);
  reply->set_bytes_on_disk(stats.bytes_on_disk);
  if (stats.first_pose_ns.has_value()) reply->set_first_pose_ns(*stats.first_pose_ns);
  if (stats.last_pose_ns.has_value()) reply->set_last_pose_ns(*stats.last_pose_ns);
  reply->set_format_version(kStoreFormatVersion);
  DSG_ASSIGN_OR_RETURN(const auto pending, view.map().GetPendingErasure());
  if (pending.has_value()) {
    v1::PendingErasure* out = reply->mutable_pending_erasure();
    out->set_node_count(pending->node_count);
    out->set_edge_count(pending->edge_count);
    out->set_mesh_block_count(pending->mesh_block_count);
    out->set_span_count(pending->span_count);
  }
  return absl::OkStatus();
}

absl::Status ListRevisions(Engine* engine, const CallContext&,
                           const v1::ListRevisionsRequest& request,
                           v1::ListRevisionsResponse* reply) {
  DSG_ASSIGN_OR_RETURN(const ReadView view, ReadView::Open(&engine->maps, request.map(),
                                                           v1::ReadAt::default_instance()));
  DSG_ASSIGN_OR_RETURN(const int page_size, CheckPageSize(request.page_size()));
  if (request.before_revision() < 0) {
    return FieldError("before_revision", absl::StrCat(request.before_revision()),
                      "give a revision, or 0 to begin with the newest");
  }
  DSG_ASSIGN_OR_RETURN(const std::vector<RevisionInfo> revisions,
                       view.map().ListRevisions(request.before_revision(), page_size));
  view.FillHeader(reply->mutable_header());
  size_t bytes = 0;
  for (const RevisionInfo& revision : revisions) {
    v1::Revision* out = reply->add_revisions();
    ToProto(revision, out);
    bytes += out->ByteSizeLong();
    // The caller goes on below the last one anyway, so a short page needs no mark.
    if (bytes > kPageBytesSoftMax) break;
  }
  return absl::OkStatus();
}

absl::Status GetServerInfo(Engine*, const CallContext&, const v1::GetServerInfoRequest&,
                           v1::GetServerInfoResponse* reply) {
  reply->set_version(DSG_VERSION);
  reply->set_store_format_version(kStoreFormatVersion);
  return absl::OkStatus();
}

}  // namespace dsg::query
