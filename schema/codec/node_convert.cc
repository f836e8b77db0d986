// SPDX-License-Identifier: Apache-2.0
// Nodes and their components, model <-> protobuf.
#include "absl/strings/str_cat.h"
#include "dsg/v1/graph.pb.h"
#include "schema/base/status.h"
#include "schema/codec/proto_internal.h"

namespace dsg {
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
}

absl::StatusOr<AgentInfo> FromProto(const v1::AgentComponent& in) {
  AgentInfo agent;
  DSG_ASSIGN_OR_RETURN(agent.body_model,
                       Sha256FromProto(in.body_model_sha256(), "agent.body_model_sha256"));
  agent.shape_coefficients.assign(in.shape_coefficients().begin(), in.shape_coefficients().end());
  agent.track_state = in.track_state();
  agent.gap_ns_max = in.gap_ns_max();
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
