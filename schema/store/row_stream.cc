// SPDX-License-Identifier: Apache-2.0
#include "schema/store/row_stream.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/value_check.h"

namespace dsg {

std::optional<RowShape> ShapeOfRow(char kind) {
  static constexpr struct {
    char kind;
    RowShape shape;
  } kShapes[] = {
      {row_kinds::kOldest, {1, 0}},    {row_kinds::kLayer, {3, 1}},
      {row_kinds::kLabel, {2, 1}},     {row_kinds::kRelation, {1, 1}},
      {row_kinds::kRevision, {14, 9}}, {row_kinds::kSession, {5, 1}},
      {row_kinds::kTag, {2, 2}},       {row_kinds::kAsset, {1, 2}},
      {row_kinds::kAssetPart, {1, 1}}, {row_kinds::kDroppedAsset, {1, 1}},
      {row_kinds::kNode, {4, 1}},      {row_kinds::kEdge, {6, 1}},
      {row_kinds::kStay, {7, 0}},      {row_kinds::kTrackEnd, {4, 0}},
      {row_kinds::kPoses, {3, 1}},     {row_kinds::kFactors, {5, 1}},
      {row_kinds::kShapes, {5, 1}},    {row_kinds::kMeshBlock, {5, 1}},
  };
  for (const auto& known : kShapes) {
    if (known.kind == kind) return known.shape;
  }
  return std::nullopt;
}

absl::Status BadRowError(const std::string& map, const StreamRow& row, std::string_view why) {
  const std::string key = row.numbers.empty() ? "" : absl::StrCat(" ", row.numbers.front());
  return MakeError(
      Reason::kStoreCorrupt,
      absl::StrCat("map \"", map, "\": row ", std::string(1, row.kind), key, " of its archive ",
                   std::string(why), "; take another copy of the archive"),
      {{"map", map}, {"table", std::string(1, row.kind)}});
}

std::optional<Sha256> DigestOfText(std::string_view text) {
  Sha256 digest{};
  if (text.size() != digest.size()) return std::nullopt;
  std::copy(text.begin(), text.end(), digest.begin());
  return digest;
}

StreamRow RowOfRevision(const StreamedRevision& revision) {
  const RevisionInfo& info = revision.record.info;
  const RowSums& sums = revision.record.sums;
  const bool has_poses =
      revision.record.first_pose_ns.has_value() && revision.record.last_pose_ns.has_value();
  return {row_kinds::kRevision,
          {info.revision, info.committed_ns, info.sequence, sums.node_count, sums.edge_count,
           sums.agent_count, sums.pose_count, sums.stay_count, sums.mesh_block_count,
           has_poses ? 1 : 0, has_poses ? *revision.record.first_pose_ns : 0,
           has_poses ? *revision.record.last_pose_ns : 0,
           revision.delta_checksum.has_value() ? 1 : 0, revision.delta_checksum.value_or(0)},
          {std::string(BytesOf(info.digest)), sums.content.bytes(),
           revision.parent.has_value() ? std::string(BytesOf(*revision.parent)) : "", info.author,
           info.message, info.session_id, info.config_digest, FormatLayerCounts(sums.layer_counts),
           revision.touched.has_value() ? EncodeTouched(*revision.touched) : ""}};
}

absl::StatusOr<StreamedRevision> RevisionOfRow(const std::string& map, const StreamRow& row) {
  StreamedRevision revision;
  RevisionInfo& info = revision.record.info;
  RowSums& sums = revision.record.sums;
  const std::optional<Sha256> digest = DigestOfText(row.texts[0]);
  revision.parent = DigestOfText(row.texts[2]);
  if (!row.texts[8].empty()) revision.touched.emplace();
  const bool is_sound = digest.has_value() && row.texts[1].size() == 16 &&
                        revision.parent.has_value() == !row.texts[2].empty() &&
                        ParseLayerCounts(row.texts[7], &sums.layer_counts) &&
                        (row.texts[8].empty() || DecodeTouched(row.texts[8], &*revision.touched));
  if (!is_sound) return BadRowError(map, row, "is no record of a revision");
  info.digest = *digest;
  sums.content = ContentDigest::FromBytes(row.texts[1]);
  info.author = row.texts[3];
  info.message = row.texts[4];
  info.session_id = row.texts[5];
  info.config_digest = row.texts[6];
  info.revision = row.numbers[0];
  info.committed_ns = row.numbers[1];
  info.sequence = row.numbers[2];
  sums.node_count = row.numbers[3];
  sums.edge_count = row.numbers[4];
  sums.agent_count = row.numbers[5];
  sums.pose_count = row.numbers[6];
  sums.stay_count = row.numbers[7];
  sums.mesh_block_count = row.numbers[8];
  FillCounts(&revision.record);
  if (row.numbers[9] != 0) {
    revision.record.first_pose_ns = row.numbers[10];
    revision.record.last_pose_ns = row.numbers[11];
  }
  if (row.numbers[12] != 0) revision.delta_checksum = row.numbers[13];
  return revision;
}

absl::StatusOr<Node> NodeOfRow(const std::string& map, const StreamRow& row) {
  Node node;
  const auto nothing = [] { return std::string("node"); };
  const bool is_sound = DecodeNodePayload(row.texts[0], &node) &&
                        values::IsSane(node.map_T_node.position) &&
                        node.map_T_node.orientation.coeffs().allFinite() &&
                        values::CheckBox(node.box_node, nothing).ok();
  if (!is_sound) return BadRowError(map, row, "is no node");
  node.id = IdOf(row.numbers[0]);
  node.revision = row.numbers[1];
  node.layer = static_cast<LayerId>(row.numbers[2]);
  return node;
}

absl::Status ErasurePendingError(const std::string& map) {
  return absl::FailedPreconditionError(absl::StrCat(
      "map \"", map,
      "\" has an erasure that is not complete, and its rows would still hold what is to be gone; "
      "end it first, as `dsg verify` says, then archive the map"));
}

}  // namespace dsg
