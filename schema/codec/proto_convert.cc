// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/proto_convert.h"

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "dsg/v1/graph.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_internal.h"

namespace dsg {

const Layer* LayerTable::Find(LayerId id) const {
  const auto it = std::find_if(layers_.begin(), layers_.end(),
                               [&](const Layer& layer) { return layer.id == id; });
  return it == layers_.end() ? nullptr : &*it;
}

const Layer* LayerTable::Find(std::string_view name) const {
  const auto it = std::find_if(layers_.begin(), layers_.end(),
                               [&](const Layer& layer) { return layer.name == name; });
  return it == layers_.end() ? nullptr : &*it;
}

void ToProto(const Eigen::Vector3d& v, v1::Vector3* out) {
  out->set_x(v.x());
  out->set_y(v.y());
  out->set_z(v.z());
}

Eigen::Vector3d FromProto(const v1::Vector3& in) { return {in.x(), in.y(), in.z()}; }

void ToProto(const Pose3d& pose, v1::Pose* out) {
  ToProto(pose.position, out->mutable_position());
  v1::Quaternion* q = out->mutable_orientation();
  q->set_x(pose.orientation.x());
  q->set_y(pose.orientation.y());
  q->set_z(pose.orientation.z());
  q->set_w(pose.orientation.w());
}

Pose3d FromProto(const v1::Pose& in) {
  Pose3d pose;
  pose.position = FromProto(in.position());
  if (in.has_orientation()) {
    const v1::Quaternion& q = in.orientation();
    pose.orientation = Eigen::Quaterniond(q.w(), q.x(), q.y(), q.z());
  }
  return pose;
}

void ToProto(const Box3d& box, v1::Box* out) {
  ToProto(box.min(), out->mutable_min());
  ToProto(box.max(), out->mutable_max());
}

absl::StatusOr<Box3d> BoxFromProto(const v1::Box& in, std::string_view field) {
  const Box3d box(FromProto(in.min()), FromProto(in.max()));
  if (!box.min().allFinite() || !box.max().allFinite()) {
    return MakeError(Reason::kNumberNotFinite,
                     absl::StrCat(std::string(field), " has a corner that is not finite"),
                     {{"field", std::string(field)}});
  }
  if ((box.min().array() > box.max().array()).any()) {
    return MakeError(
        Reason::kBoxInverted,
        absl::StrCat(std::string(field), " is inverted: min (", box.min().x(), ", ", box.min().y(),
                     ", ", box.min().z(), ") exceeds max (", box.max().x(), ", ", box.max().y(),
                     ", ", box.max().z(), ") on some axis"),
        {{"field", std::string(field)}});
  }
  return box;
}

void AttributesToProto(const Attributes& attributes,
                       google::protobuf::Map<std::string, v1::AttributeValue>* out) {
  for (const auto& [name, value] : attributes) {
    v1::AttributeValue& to = (*out)[name];
    if (const auto* number = std::get_if<double>(&value)) {
      to.set_number(*number);
    } else if (const auto* text = std::get_if<std::string>(&value)) {
      to.set_text(*text);
    } else {
      to.set_flag(std::get<bool>(value));
    }
  }
}

Attributes AttributesFromProto(const google::protobuf::Map<std::string, v1::AttributeValue>& in) {
  Attributes attributes;
  for (const auto& [name, value] : in) {
    switch (value.value_case()) {
      case v1::AttributeValue::kNumber:
        attributes[name] = value.number();
        break;
      case v1::AttributeValue::kText:
        attributes[name] = value.text();
        break;
      default:
        attributes[name] = value.flag();
    }
  }
  return attributes;
}

absl::StatusOr<std::optional<Sha256>> Sha256FromProto(const std::string& bytes,
                                                      std::string_view field) {
  if (bytes.empty()) return std::optional<Sha256>();
  Sha256 digest;
  if (bytes.size() != digest.size()) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat(std::string(field), " has ", bytes.size(), " bytes; a SHA-256 has 32"),
        {{"field", std::string(field)}});
  }
  std::copy(bytes.begin(), bytes.end(), digest.begin());
  return std::optional<Sha256>(digest);
}

std::string BytesOf(const Sha256& digest) { return {digest.begin(), digest.end()}; }

absl::StatusOr<NodeId> OptionalNodeId(const std::string& text) {
  if (text.empty()) return NodeId();
  return ParseNodeId(text);
}

void ToProto(const TimedPose& pose, v1::TimedPose* out) {
  out->set_time_ns(pose.time_ns);
  ToProto(pose.map_T_agent, out->mutable_pose());
  out->set_flags(pose.flags);
  if (pose.covariance) {
    out->mutable_covariance()->Add(pose.covariance->begin(), pose.covariance->end());
  }
}

absl::StatusOr<TimedPose> FromProto(const v1::TimedPose& in) {
  TimedPose pose;
  pose.time_ns = in.time_ns();
  pose.map_T_agent = FromProto(in.pose());
  pose.flags = in.flags();
  if (in.covariance_size() != 0) {
    if (in.covariance_size() != 21) {
      return MakeError(Reason::kFieldInvalid,
                       absl::StrCat("covariance at ", in.time_ns(), " ns has ",
                                    in.covariance_size(), " numbers; send 21 or none"),
                       {{"field", "covariance"}});
    }
    auto covariance = std::make_shared<Covariance6>();
    std::copy(in.covariance().begin(), in.covariance().end(), covariance->begin());
    pose.covariance = std::move(covariance);
  }
  return pose;
}

void EdgeDetailsToProto(const Edge& edge, v1::Edge* out) {
  if (edge.valid.from_ns != kTimeMin) out->set_valid_from_ns(edge.valid.from_ns);
  if (edge.valid.to_ns != kTimeMax) out->set_valid_to_ns(edge.valid.to_ns);
  AttributesToProto(edge.attributes, out->mutable_attributes());
}

void EdgeDetailsFromProto(const v1::Edge& in, Edge* edge) {
  edge->valid.from_ns = in.has_valid_from_ns() ? in.valid_from_ns() : kTimeMin;
  edge->valid.to_ns = in.has_valid_to_ns() ? in.valid_to_ns() : kTimeMax;
  edge->attributes = AttributesFromProto(in.attributes());
}

void ToProto(const Edge& edge, v1::Edge* out) {
  out->set_source(ToString(edge.source));
  out->set_relation(edge.relation);
  out->set_target(ToString(edge.target));
  out->set_weight(edge.weight);
  EdgeDetailsToProto(edge, out);
  out->set_revision(edge.revision);
}

absl::StatusOr<Edge> FromProto(const v1::Edge& in) {
  Edge edge;
  DSG_ASSIGN_OR_RETURN(edge.source, ParseNodeId(in.source()));
  DSG_ASSIGN_OR_RETURN(edge.target, ParseNodeId(in.target()));
  edge.relation = in.relation();
  edge.weight = in.weight();
  EdgeDetailsFromProto(in, &edge);
  return edge;
}

void ToProto(const MapSpec& spec, v1::MapSpec* out) {
  out->set_name(spec.name);
  out->set_frame(spec.frame);
  out->set_epoch_ns(spec.epoch_ns);
  out->set_clock(static_cast<v1::Clock>(spec.clock));
  out->set_codec(static_cast<v1::TrajectoryCodec>(spec.codec));
  out->set_gap_ns_max(spec.gap_ns_max);
  out->set_mesh_block_size_m(spec.mesh_block_size_m);
}

absl::StatusOr<MapSpec> FromProto(const v1::MapSpec& in) {
  MapSpec spec;
  spec.name = in.name();
  if (!in.frame().empty()) spec.frame = in.frame();
  spec.epoch_ns = in.epoch_ns();
  if (in.clock() != v1::CLOCK_UNSPECIFIED) spec.clock = static_cast<Clock>(in.clock());
  if (in.codec() != v1::TRAJECTORY_CODEC_UNSPECIFIED) {
    spec.codec = static_cast<TrajectoryCodec>(in.codec());
  }
  if (!v1::Clock_IsValid(in.clock()) || !v1::TrajectoryCodec_IsValid(in.codec())) {
    return MakeError(Reason::kFieldInvalid, "clock or codec of the map is unknown",
                     {{"field", "map"}});
  }
  if (in.gap_ns_max() != 0) spec.gap_ns_max = in.gap_ns_max();
  if (in.mesh_block_size_m() != 0.0) spec.mesh_block_size_m = in.mesh_block_size_m();
  DSG_RETURN_IF_ERROR(spec.Validate());
  return spec;
}

void ToProto(const RevisionInfo& revision, v1::Revision* out) {
  out->set_revision(revision.revision);
  out->set_committed_ns(revision.committed_ns);
  out->set_author(revision.author);
  out->set_message(revision.message);
  out->set_session_id(revision.session_id);
  out->set_sequence(revision.sequence);
  out->set_digest(BytesOf(revision.digest));
  out->set_node_count(revision.node_count);
  out->set_edge_count(revision.edge_count);
  out->set_agent_count(revision.agent_count);
  out->set_pose_count(revision.pose_count);
  out->set_config_digest(revision.config_digest);
}

}  // namespace dsg
