// SPDX-License-Identifier: Apache-2.0
#include "query/engine/shape_filler.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "dsg/v1/query_service.pb.h"
#include "schema/base/status.h"
#include "schema/codec/checksum.h"
#include "schema/codec/proto_convert.h"

namespace dsg::query {
namespace {

std::string BytesOf(const Sha256& digest) {
  return std::string(reinterpret_cast<const char*>(digest.data()), digest.size());
}

}  // namespace

absl::StatusOr<ShapeParts> ShapeParts::Of(const google::protobuf::RepeatedField<int>& numbers) {
  if (numbers.empty()) return ShapeParts{true, true, true, true};
  ShapeParts parts;
  for (const int part : numbers) {
    switch (part) {
      case v1::SHAPE_PART_COEFFICIENTS:
        parts.coefficients = true;
        break;
      case v1::SHAPE_PART_JOINTS:
        parts.joints = true;
        break;
      case v1::SHAPE_PART_VERTICES:
        parts.vertices = true;
        break;
      case v1::SHAPE_PART_TOPOLOGY:
        parts.topology = true;
        break;
      default:
        return FieldError("parts", absl::StrCat(part),
                          "name coefficients, joints, vertices or topology, or nothing for all");
    }
  }
  return parts;
}

bool ShapeFiller::WantsTopology(const ShownShape& shown) const {
  return parts_.topology && shown.vertex_count > 0 && shown.topology.has_value() &&
         !sent_.contains(*shown.topology);
}

void ShapeFiller::Fill(const ShownShape& shown, v1::AgentShape* out) const {
  v1::BodyShape* shape = out->mutable_shape();
  ToProto(shown.shape, shape);
  if (!parts_.coefficients) {
    shape->clear_pose_coefficients();
    shape->clear_shape_coefficients();
  }
  if (!parts_.joints) shape->clear_joints();
  out->set_vertex_count(static_cast<int32_t>(shown.vertex_count));
  if (shown.topology.has_value()) out->set_topology_sha256(BytesOf(*shown.topology));
}

absl::Status ShapeFiller::AddTopology(NodeId agent, const Sha256& sha256, v1::Asset* out) {
  DSG_ASSIGN_OR_RETURN(const Asset asset, view_.snapshot().ReadAsset(sha256));
  if (asset.content.size() > kReplyBytesMax) {
    return MakeError(Reason::kLimitExceeded,
                     absl::StrCat("topology ", ToHex(asset.sha256), " of agent ", ToString(agent),
                                  " has ", asset.content.size(), " bytes, more than the ",
                                  kReplyBytesMax, " of one message; ask for the other parts only"),
                     {{"agent", ToString(agent)}, {"asset", ToHex(asset.sha256)}});
  }
  out->set_sha256(BytesOf(asset.sha256));
  out->set_media_type(asset.media_type);
  out->set_content(asset.content);
  sent_.insert(sha256);
  return absl::OkStatus();
}

}  // namespace dsg::query
