// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/proto_convert.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "absl/strings/str_cat.h"
#include "dsg/v1/graph.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_internal.h"

namespace dsg {
namespace {

// Numbers in threes, one after the other, in one copy: a mesh has millions of them.
template <typename Triple, typename Number>
void CopyTriples(const std::vector<Triple>& from, google::protobuf::RepeatedField<Number>* to) {
  static_assert(sizeof(Triple) == 3 * sizeof(Number) && std::is_trivially_copyable_v<Number>);
  if (from.empty()) return;
  to->Resize(static_cast<int>(3 * from.size()), Number());
  std::memcpy(to->mutable_data(), from.data(), from.size() * sizeof(Triple));
}

template <typename Triple, typename Number>
void CopyTriples(const google::protobuf::RepeatedField<Number>& from, std::vector<Triple>* to) {
  static_assert(sizeof(Triple) == 3 * sizeof(Number) && std::is_trivially_copyable_v<Number>);
  if (from.empty()) return;
  to->resize(static_cast<size_t>(from.size()) / 3);
  std::memcpy(static_cast<void*>(to->data()), from.data(), to->size() * sizeof(Triple));
}

}  // namespace

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

void ToProto(const MeshBlock& block, v1::MeshBlock* out) {
  out->set_x(block.index.x);
  out->set_y(block.index.y);
  out->set_z(block.index.z);
  CopyTriples(block.positions_map, out->mutable_positions());
  CopyTriples(block.normals_map, out->mutable_normals());
  out->mutable_colors()->Add(block.colors.begin(), block.colors.end());
  out->mutable_labels()->Add(block.labels.begin(), block.labels.end());
  out->mutable_instance_ids()->Add(block.instance_ids.begin(), block.instance_ids.end());
  out->mutable_first_seen_ns()->Add(block.first_seen_ns.begin(), block.first_seen_ns.end());
  out->mutable_last_seen_ns()->Add(block.last_seen_ns.begin(), block.last_seen_ns.end());
  CopyTriples(block.faces, out->mutable_faces());
}

absl::StatusOr<MeshBlock> FromProto(const v1::MeshBlock& in) {
  if (in.positions_size() % 3 != 0 || in.normals_size() % 3 != 0 || in.faces_size() % 3 != 0) {
    return MakeError(Reason::kFieldInvalid,
                     "a mesh block has positions, normals or faces that are not in threes",
                     {{"field", "mesh_blocks"}});
  }
  MeshBlock block;
  block.index = {in.x(), in.y(), in.z()};
  CopyTriples(in.positions(), &block.positions_map);
  CopyTriples(in.normals(), &block.normals_map);
  block.colors.assign(in.colors().begin(), in.colors().end());
  block.labels.assign(in.labels().begin(), in.labels().end());
  block.instance_ids.assign(in.instance_ids().begin(), in.instance_ids().end());
  block.first_seen_ns.assign(in.first_seen_ns().begin(), in.first_seen_ns().end());
  block.last_seen_ns.assign(in.last_seen_ns().begin(), in.last_seen_ns().end());
  CopyTriples(in.faces(), &block.faces);
  return block;
}

void ToProto(const PoseFactor& factor, v1::PoseFactor* out) {
  out->set_type(factor.type);
  out->set_from_time_ns(factor.from_ns);
  out->set_to_time_ns(factor.to_ns);
  out->set_to_agent(ToString(factor.to_agent));
  ToProto(factor.relative_pose, out->mutable_relative_pose());
  if (factor.information.has_value()) {
    out->mutable_information()->Add(factor.information->begin(), factor.information->end());
  }
}

absl::StatusOr<PoseFactor> FromProto(const v1::PoseFactor& in) {
  PoseFactor factor;
  factor.type = in.type();
  factor.from_ns = in.from_time_ns();
  factor.to_ns = in.to_time_ns();
  DSG_ASSIGN_OR_RETURN(factor.to_agent, OptionalNodeId(in.to_agent()));
  factor.relative_pose = FromProto(in.relative_pose());
  if (in.information_size() != 0) {
    if (in.information_size() != 21) {
      return MakeError(Reason::kFieldInvalid, "a factor's information needs 21 numbers or none",
                       {{"field", "factors.information"}});
    }
    factor.information.emplace();
    std::copy(in.information().begin(), in.information().end(), factor.information->begin());
  }
  return factor;
}

void ToProto(const BodyShape& shape, v1::BodyShape* out) {
  out->set_time_ns(shape.time_ns);
  out->mutable_pose_coefficients()->Add(shape.pose_coefficients.begin(),
                                        shape.pose_coefficients.end());
  out->mutable_shape_coefficients()->Add(shape.shape_coefficients.begin(),
                                         shape.shape_coefficients.end());
  out->mutable_vertices()->Add(shape.vertices.begin(), shape.vertices.end());
  out->mutable_joints()->Add(shape.joints.begin(), shape.joints.end());
}

BodyShape FromProto(const v1::BodyShape& in) {
  BodyShape shape;
  shape.time_ns = in.time_ns();
  shape.pose_coefficients.assign(in.pose_coefficients().begin(), in.pose_coefficients().end());
  shape.shape_coefficients.assign(in.shape_coefficients().begin(), in.shape_coefficients().end());
  shape.vertices.assign(in.vertices().begin(), in.vertices().end());
  shape.joints.assign(in.joints().begin(), in.joints().end());
  return shape;
}

namespace {

void ToProto(const ObjectInfo& object, v1::ObjectComponent* out) {
  if (object.model.has_value()) {
    out->set_model_sha256(BytesOf(*object.model));
    dsg::ToProto(object.map_T_model, out->mutable_map_t_model());
  }
  out->set_registration_residual_m(object.registration_residual_m);
  if (object.color.has_value()) {
    out->mutable_color()->set_red((*object.color)[0]);
    out->mutable_color()->set_green((*object.color)[1]);
    out->mutable_color()->set_blue((*object.color)[2]);
    out->mutable_color()->set_alpha((*object.color)[3]);
  }
  if (!object.size.isZero(0.0)) dsg::ToProto(object.size, out->mutable_size());
  out->set_mesh_instance_id(object.mesh_instance_id);
}

absl::StatusOr<ObjectInfo> FromProto(const v1::ObjectComponent& in) {
  ObjectInfo object;
  DSG_ASSIGN_OR_RETURN(object.model, Sha256FromProto(in.model_sha256(), "object.model_sha256"));
  object.map_T_model = dsg::FromProto(in.map_t_model());
  object.registration_residual_m = in.registration_residual_m();
  if (in.has_color()) {
    object.color =
        Color{static_cast<uint8_t>(in.color().red()), static_cast<uint8_t>(in.color().green()),
              static_cast<uint8_t>(in.color().blue()), static_cast<uint8_t>(in.color().alpha())};
  }
  if (in.has_size()) object.size = dsg::FromProto(in.size());
  object.mesh_instance_id = in.mesh_instance_id();
  return object;
}

void ToProto(const AgentInfo& agent, v1::AgentComponent* out) {
  if (agent.body_model.has_value()) out->set_body_model_sha256(BytesOf(*agent.body_model));
  out->mutable_shape_coefficients()->Add(agent.shape_coefficients.begin(),
                                         agent.shape_coefficients.end());
  out->set_track_state(agent.track_state);
  out->set_gap_ns_max(agent.gap_ns_max);
  for (const Sha256& part : agent.place_memory) out->add_place_memory_sha256(BytesOf(part));
}

absl::StatusOr<AgentInfo> FromProto(const v1::AgentComponent& in) {
  AgentInfo agent;
  DSG_ASSIGN_OR_RETURN(agent.body_model,
                       Sha256FromProto(in.body_model_sha256(), "agent.body_model_sha256"));
  agent.shape_coefficients.assign(in.shape_coefficients().begin(), in.shape_coefficients().end());
  agent.track_state = in.track_state();
  agent.gap_ns_max = in.gap_ns_max();
  for (const std::string& bytes : in.place_memory_sha256()) {
    DSG_ASSIGN_OR_RETURN(const std::optional<Sha256> part,
                         Sha256FromProto(bytes, "agent.place_memory_sha256"));
    if (part.has_value()) agent.place_memory.push_back(*part);
  }
  return agent;
}

void ToProto(const PlaceInfo& place, v1::PlaceComponent* out) {
  out->set_clearance_m(place.clearance_m);
  if (!place.free_box.isEmpty()) dsg::ToProto(place.free_box, out->mutable_free_box());
  out->set_basis_point_count(place.basis_point_count);
}

absl::StatusOr<PlaceInfo> FromProto(const v1::PlaceComponent& in) {
  PlaceInfo place;
  place.clearance_m = in.clearance_m();
  if (in.has_free_box()) {
    DSG_ASSIGN_OR_RETURN(place.free_box, BoxFromProto(in.free_box(), "place.free_box"));
  }
  place.basis_point_count = in.basis_point_count();
  return place;
}

void ToProto(const StructureInfo& structure, v1::StructureComponent* out) {
  out->set_structure_type(structure.structure_type);
  if (!structure.plane_normal_map.isZero(0.0)) {
    dsg::ToProto(structure.plane_normal_map, out->mutable_plane_normal());
  }
  out->set_plane_offset_m(structure.plane_offset_m);
  out->set_mesh_instance_id(structure.mesh_instance_id);
}

StructureInfo FromProto(const v1::StructureComponent& in) {
  return {in.structure_type(), dsg::FromProto(in.plane_normal()), in.plane_offset_m(),
          in.mesh_instance_id()};
}

void ToProto(const RegionInfo& region, v1::RegionComponent* out) {
  for (const Eigen::Vector2d& corner : region.footprint_map) {
    out->mutable_footprint()->add_xy(corner.x());
    out->mutable_footprint()->add_xy(corner.y());
  }
  out->set_z_min_m(region.z_min_m);
  out->set_z_max_m(region.z_max_m);
  out->mutable_class_probabilities()->insert(region.class_probabilities.begin(),
                                             region.class_probabilities.end());
}

absl::StatusOr<RegionInfo> FromProto(const v1::RegionComponent& in) {
  RegionInfo region;
  const auto& xy = in.footprint().xy();
  if (xy.size() % 2 != 0) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("region.footprint has ", xy.size(), " numbers; x and y must come in pairs"),
        {{"field", "region.footprint"}});
  }
  for (int i = 0; i < xy.size(); i += 2) region.footprint_map.emplace_back(xy[i], xy[i + 1]);
  region.z_min_m = in.z_min_m();
  region.z_max_m = in.z_max_m();
  region.class_probabilities.insert(in.class_probabilities().begin(),
                                    in.class_probabilities().end());
  return region;
}

void ComponentsToProto(const Node& node, v1::Node* out) {
  if (node.object.has_value()) ToProto(*node.object, out->mutable_object());
  if (node.place.has_value()) ToProto(*node.place, out->mutable_place());
}

absl::Status ComponentsFromProto(const v1::Node& in, Node* node) {
  if (in.has_object()) {
    DSG_ASSIGN_OR_RETURN(node->object, FromProto(in.object()));
  }
  if (in.has_place()) {
    DSG_ASSIGN_OR_RETURN(node->place, FromProto(in.place()));
  }
  return absl::OkStatus();
}

}  // namespace

void ComponentsOfFewToProto(const Node& node, v1::Node* out) {
  if (node.agent.has_value()) ToProto(*node.agent, out->mutable_agent());
  if (node.structure.has_value()) ToProto(*node.structure, out->mutable_structure());
  if (node.region.has_value()) ToProto(*node.region, out->mutable_region());
}

void RareDetailsToProto(const Node& node, v1::Node* out) {
  ComponentsOfFewToProto(node, out);
  AttributesToProto(node.attributes, out->mutable_attributes());
}

absl::Status RareDetailsFromProto(const v1::Node& in, Node* node) {
  if (in.has_agent()) {
    DSG_ASSIGN_OR_RETURN(node->agent, FromProto(in.agent()));
  }
  if (in.has_structure()) node->structure = FromProto(in.structure());
  if (in.has_region()) {
    DSG_ASSIGN_OR_RETURN(node->region, FromProto(in.region()));
  }
  node->attributes = AttributesFromProto(in.attributes());
  return absl::OkStatus();
}

void NodeDetailsToProto(const Node& node, v1::Node* out) {
  out->set_kind(node.kind);
  out->set_name(node.name);
  if (node.class_id >= 0 || !node.class_name.empty()) {
    out->mutable_semantic_class()->set_id(node.class_id);
    out->mutable_semantic_class()->set_name(node.class_name);
  }
  ToProto(node.map_T_node, out->mutable_map_t_node());
  if (!node.box_node.isEmpty()) ToProto(node.box_node, out->mutable_bounding_box());
  if (node.valid.from_ns != kTimeMin) out->set_valid_from_ns(node.valid.from_ns);
  if (node.valid.to_ns != kTimeMax) out->set_valid_to_ns(node.valid.to_ns);
  if (node.first_observed_ns.has_value()) out->set_first_observed_ns(*node.first_observed_ns);
  if (node.last_observed_ns.has_value()) out->set_last_observed_ns(*node.last_observed_ns);
  out->set_observation_count(node.observation_count);
  if (node.confidence.has_value()) out->set_confidence(*node.confidence);
  out->set_provenance(static_cast<v1::Provenance>(node.provenance));
  ComponentsToProto(node, out);
  RareDetailsToProto(node, out);
}

absl::Status NodeDetailsFromProto(const v1::Node& in, Node* node) {
  node->kind = in.kind();
  node->name = in.name();
  if (in.has_semantic_class()) {
    node->class_id = in.semantic_class().id();
    node->class_name = in.semantic_class().name();
  }
  node->map_T_node = FromProto(in.map_t_node());
  if (in.has_bounding_box()) {
    DSG_ASSIGN_OR_RETURN(node->box_node, BoxFromProto(in.bounding_box(), "bounding_box"));
  }
  if (in.has_valid_from_ns()) node->valid.from_ns = in.valid_from_ns();
  if (in.has_valid_to_ns()) node->valid.to_ns = in.valid_to_ns();
  if (in.has_first_observed_ns()) node->first_observed_ns = in.first_observed_ns();
  if (in.has_last_observed_ns()) node->last_observed_ns = in.last_observed_ns();
  node->observation_count = in.observation_count();
  if (in.has_confidence()) node->confidence = in.confidence();
  node->provenance = static_cast<Provenance>(in.provenance());
  DSG_RETURN_IF_ERROR(ComponentsFromProto(in, node));
  return RareDetailsFromProto(in, node);
}

void ToProto(const Node& node, const LayerTable& layers, v1::Node* out) {
  out->set_id(ToString(node.id));
  const Layer* layer = layers.Find(node.layer);
  out->set_layer(layer == nullptr ? absl::StrCat(node.layer) : layer->name);
  NodeDetailsToProto(node, out);
  out->set_revision(node.revision);
}

absl::StatusOr<Node> FromProto(const v1::Node& in, const LayerTable& layers) {
  Node node;
  DSG_ASSIGN_OR_RETURN(node.id, ParseNodeId(in.id()));
  const Layer* layer = layers.Find(in.layer());
  if (layer == nullptr) {
    return MakeError(Reason::kLayerUnknown,
                     absl::StrCat("node ", in.id(), " is in layer \"", in.layer(),
                                  "\", which the map does not have; add the layer first"),
                     {{"node", in.id()}, {"layer", in.layer()}});
  }
  node.layer = layer->id;
  DSG_RETURN_IF_ERROR(Annotate(NodeDetailsFromProto(in, &node), "node " + in.id()));
  return node;
}

}  // namespace dsg
