// SPDX-License-Identifier: Apache-2.0
#include "schema/store/revision_record.h"

#include <charconv>

#include "absl/strings/str_cat.h"

namespace dsg {

void FillCounts(RevisionRecord* record) {
  RevisionInfo& info = record->info;
  info.node_count = record->sums.node_count;
  info.edge_count = record->sums.edge_count;
  info.agent_count = record->sums.agent_count;
  info.pose_count = record->sums.pose_count;
  info.stay_count = record->sums.stay_count;
  info.mesh_block_count = record->sums.mesh_block_count;
}

std::string FormatLayerCounts(const std::map<LayerId, int64_t>& counts) {
  std::string text;
  for (const auto& [layer, count] : counts) {
    if (count == 0) continue;
    absl::StrAppend(&text, text.empty() ? "" : " ", layer, ":", count);
  }
  return text;
}

bool ParseLayerCounts(std::string_view text, std::map<LayerId, int64_t>* counts) {
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at < end) {
    LayerId layer = 0;
    int64_t count = 0;
    const auto colon = std::from_chars(at, end, layer);
    if (colon.ec != std::errc() || colon.ptr == end || *colon.ptr != ':') return false;
    const auto stop = std::from_chars(colon.ptr + 1, end, count);
    if (stop.ec != std::errc()) return false;
    (*counts)[layer] = count;
    at = stop.ptr < end ? stop.ptr + 1 : end;
  }
  return true;
}

Sha256 DigestOf(const Sha256& parent, const RevisionRecord& record) {
  const RevisionInfo& info = record.info;
  std::string text(BytesOf(parent));
  absl::StrAppend(&text, info.revision, "\n", info.session_id, "\n", info.sequence, "\n",
                  info.author, "\n", info.message, "\n", info.config_digest, "\n");
  absl::StrAppend(&text, info.node_count, " ", info.edge_count, " ", info.agent_count, " ",
                  info.pose_count, " ", info.stay_count, " ", info.mesh_block_count, "\n",
                  FormatLayerCounts(record.sums.layer_counts), "\n");
  text += record.sums.content.bytes();
  return ComputeSha256(text);
}

void Seal(const Sha256& parent, RevisionRecord* record) {
  FillCounts(record);
  record->info.digest = DigestOf(parent, *record);
}

RevisionRecord NextRecord(const RevisionRecord& head, const GraphDelta& delta, TimeNs now_ns) {
  RevisionRecord next = head;
  ++next.info.revision;
  next.info.committed_ns = now_ns;
  next.info.author = delta.author;
  next.info.message = delta.message;
  next.info.session_id = delta.session_id;
  next.info.sequence = delta.sequence;
  next.info.config_digest = delta.config_digest;
  return next;
}

MapStats StatsOf(const RevisionRecord& record, const std::vector<Layer>& layers) {
  MapStats stats;
  stats.at = record.info;
  stats.first_pose_ns = record.first_pose_ns;
  stats.last_pose_ns = record.last_pose_ns;
  for (const Layer& layer : layers) {
    const auto count = record.sums.layer_counts.find(layer.id);
    stats.layers.push_back({layer, count == record.sums.layer_counts.end() ? 0 : count->second});
  }
  return stats;
}

}  // namespace dsg
