// SPDX-License-Identifier: Apache-2.0
// Whole deltas, model <-> protobuf and JSON.
#include <google/protobuf/util/field_mask_util.h>
#include <google/protobuf/util/json_util.h>

#include "absl/strings/str_cat.h"
#include "dsg/v1/graph.pb.h"
#include "schema/base/check.h"
#include "schema/base/status.h"
#include "schema/codec/proto_internal.h"

namespace dsg {
namespace {

void HeaderToProto(const GraphDelta& delta, v1::GraphDelta* out) {
  out->set_map(delta.map);
  out->set_session_id(delta.session_id);
  out->set_sequence(delta.sequence);
  if (delta.parent_revision.has_value()) out->set_parent_revision(*delta.parent_revision);
  out->set_author(delta.author);
  out->set_message(delta.message);
  out->set_config_digest(delta.config_digest);
  out->set_is_forgetting(delta.is_forgetting);
}

void HeaderFromProto(const v1::GraphDelta& in, GraphDelta* delta) {
  delta->map = in.map();
  delta->session_id = in.session_id();
  delta->sequence = in.sequence();
  if (in.has_parent_revision()) delta->parent_revision = in.parent_revision();
  delta->author = in.author();
  delta->message = in.message();
  delta->config_digest = in.config_digest();
  delta->is_forgetting = in.is_forgetting();
}

void StayToProto(const Stay& stay, v1::Stay* out) {
  out->set_agent(ToString(stay.agent));
  out->set_place(ToString(stay.place));
  out->set_room(ToString(stay.room));
  out->set_enter_ns(stay.enter_ns);
  out->set_exit_ns(stay.exit_ns);
}

absl::StatusOr<Stay> StayFromProto(const v1::Stay& in) {
  Stay stay;
  DSG_ASSIGN_OR_RETURN(stay.agent, ParseNodeId(in.agent()));
  DSG_ASSIGN_OR_RETURN(stay.place, OptionalNodeId(in.place()));
  DSG_ASSIGN_OR_RETURN(stay.room, OptionalNodeId(in.room()));
  stay.enter_ns = in.enter_ns();
  stay.exit_ns = in.exit_ns();
  return stay;
}

void SpansToProto(const std::vector<TrackSpan>& spans,
                  google::protobuf::RepeatedPtrField<v1::TrackSpan>* out) {
  for (const TrackSpan& span : spans) {
    v1::TrackSpan* to = out->Add();
    to->set_agent(ToString(span.agent));
    to->set_from_ns(span.from_ns);
    to->set_to_ns(span.to_ns);
  }
}

absl::Status SpansFromProto(const google::protobuf::RepeatedPtrField<v1::TrackSpan>& in,
                            std::vector<TrackSpan>* spans) {
  for (const v1::TrackSpan& span : in) {
    DSG_ASSIGN_OR_RETURN(const NodeId agent, ParseNodeId(span.agent()));
    spans->push_back({agent, span.from_ns(), span.to_ns()});
  }
  return absl::OkStatus();
}

void RemovalsToProto(const GraphDelta& delta, v1::GraphDelta* out) {
  SpansToProto(delta.factor_removals, out->mutable_factor_removals());
  SpansToProto(delta.shape_removals, out->mutable_shape_removals());
  for (const StayKey& key : delta.stay_removals) {
    v1::StayKey* to = out->add_stay_removals();
    to->set_agent(ToString(key.agent));
    to->set_enter_ns(key.enter_ns);
  }
}

absl::Status RemovalsFromProto(const v1::GraphDelta& in, GraphDelta* delta) {
  DSG_RETURN_IF_ERROR(SpansFromProto(in.factor_removals(), &delta->factor_removals));
  DSG_RETURN_IF_ERROR(SpansFromProto(in.shape_removals(), &delta->shape_removals));
  for (const v1::StayKey& key : in.stay_removals()) {
    DSG_ASSIGN_OR_RETURN(const NodeId agent, ParseNodeId(key.agent()));
    delta->stay_removals.push_back({agent, key.enter_ns()});
  }
  return absl::OkStatus();
}

bool IsWhole(const google::protobuf::FieldMask& mask) {
  return mask.paths_size() == 1 && mask.paths(0) == "*";
}

std::vector<std::string> PathsOf(const google::protobuf::FieldMask& mask) {
  return {mask.paths().begin(), mask.paths().end()};
}

// Whether it is one of `in` that is to be written field by field.
template <typename Proto>
bool IsPatch(const Proto& in, Unmasked unmasked) {
  return in.has_update_mask() ? !IsWhole(in.update_mask()) : unmasked == Unmasked::kPatch;
}

// The fields of a patch, serialized, and its paths.
template <typename Proto, typename Patch>
absl::Status FillPatch(Proto in, std::string_view field, Patch* patch) {
  patch->mask = PathsOf(in.update_mask());
  for (const std::string& path : patch->mask) {
    if (!path.empty() && google::protobuf::util::FieldMaskUtil::IsValidPath<Proto>(path)) continue;
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat(std::string(field), ".update_mask has path \"", path,
                     "\", which is no field of it; name fields as in graph.proto, or "
                     "\"*\" alone for all"),
        {{"field", absl::StrCat(std::string(field), ".update_mask")}, {"value", path}});
  }
  in.clear_update_mask();
  in.clear_revision();
  patch->fields = SerializeInOrder(in);
  return absl::OkStatus();
}

template <typename Patch, typename Proto>
void PatchToProto(const Patch& patch, Proto* out) {
  // What was serialized here is read here.
  DSG_CHECK(out->ParseFromString(patch.fields));
  for (const std::string& path : patch.mask) out->mutable_update_mask()->add_paths(path);
}

void GraphToProto(const GraphDelta& delta, const LayerTable& layers, v1::GraphDelta* out) {
  for (const Layer& layer : delta.layers) {
    v1::Layer* to = out->add_layers();
    to->set_id(layer.id);
    to->set_name(layer.name);
    to->set_rank(layer.rank);
  }
  for (const SemanticLabel& label : delta.labels) {
    v1::SemanticLabel* to = out->add_labels();
    to->set_id(label.id);
    to->set_name(label.name);
  }
  for (const Node& node : delta.nodes) ToProto(node, layers, out->add_nodes());
  for (const NodePatch& patch : delta.node_patches) PatchToProto(patch, out->add_nodes());
  for (const Retirement& item : delta.retirements) {
    v1::Retirement* to = out->add_retirements();
    to->set_id(ToString(item.id));
    if (item.valid_to_ns.has_value()) to->set_valid_to_ns(*item.valid_to_ns);
  }
  for (const Edge& edge : delta.edges) ToProto(edge, out->add_edges());
  for (const EdgePatch& patch : delta.edge_patches) PatchToProto(patch, out->add_edges());
  for (const EdgeKey& key : delta.edge_removals) {
    v1::EdgeKey* to = out->add_edge_removals();
    to->set_source(ToString(key.source));
    to->set_relation(key.relation);
    to->set_target(ToString(key.target));
  }
}

absl::Status GraphFromProto(const v1::GraphDelta& in, LayerTable layers, Unmasked unmasked,
                            GraphDelta* delta) {
  for (const v1::Layer& layer : in.layers()) {
    delta->layers.push_back({layer.id(), layer.name(), layer.rank()});
    layers.Add(delta->layers.back());
  }
  for (const v1::SemanticLabel& label : in.labels()) {
    delta->labels.push_back({label.id(), label.name()});
  }
  for (const v1::Node& node : in.nodes()) {
    if (IsPatch(node, unmasked)) {
      NodePatch& patch = delta->node_patches.emplace_back();
      DSG_ASSIGN_OR_RETURN(patch.id, ParseNodeId(node.id()));
      DSG_RETURN_IF_ERROR(FillPatch(node, "nodes", &patch));
      continue;
    }
    DSG_ASSIGN_OR_RETURN(Node made, FromProto(node, layers));
    delta->nodes.push_back(std::move(made));
  }
  for (const v1::Retirement& item : in.retirements()) {
    Retirement made;
    DSG_ASSIGN_OR_RETURN(made.id, ParseNodeId(item.id()));
    if (item.has_valid_to_ns()) made.valid_to_ns = item.valid_to_ns();
    delta->retirements.push_back(made);
  }
  for (const v1::Edge& edge : in.edges()) {
    if (IsPatch(edge, unmasked)) {
      EdgePatch& patch = delta->edge_patches.emplace_back();
      DSG_ASSIGN_OR_RETURN(patch.key.source, ParseNodeId(edge.source()));
      DSG_ASSIGN_OR_RETURN(patch.key.target, ParseNodeId(edge.target()));
      patch.key.relation = edge.relation();
      DSG_RETURN_IF_ERROR(FillPatch(edge, "edges", &patch));
      continue;
    }
    DSG_ASSIGN_OR_RETURN(Edge made, FromProto(edge));
    delta->edges.push_back(std::move(made));
  }
  for (const v1::EdgeKey& key : in.edge_removals()) {
    EdgeKey made;
    DSG_ASSIGN_OR_RETURN(made.source, ParseNodeId(key.source()));
    DSG_ASSIGN_OR_RETURN(made.target, ParseNodeId(key.target()));
    made.relation = key.relation();
    delta->edge_removals.push_back(std::move(made));
  }
  return absl::OkStatus();
}

void PosesToProto(const std::vector<TimedPose>& poses,
                  google::protobuf::RepeatedPtrField<v1::TimedPose>* out) {
  out->Reserve(static_cast<int>(poses.size()));
  for (const TimedPose& pose : poses) ToProto(pose, out->Add());
}

absl::Status PosesFromProto(const google::protobuf::RepeatedPtrField<v1::TimedPose>& in,
                            std::vector<TimedPose>* poses) {
  poses->reserve(static_cast<size_t>(in.size()));
  for (const v1::TimedPose& pose : in) {
    DSG_ASSIGN_OR_RETURN(TimedPose made, FromProto(pose));
    poses->push_back(std::move(made));
  }
  return absl::OkStatus();
}

void TracksToProto(const GraphDelta& delta, v1::GraphDelta* out) {
  for (const TrajectoryAppend& item : delta.appends) {
    v1::TrajectoryAppend* to = out->add_appends();
    to->set_agent(ToString(item.agent));
    PosesToProto(item.poses, to->mutable_poses());
  }
  for (const TrajectoryCorrection& item : delta.corrections) {
    v1::TrajectoryCorrection* to = out->add_corrections();
    to->set_agent(ToString(item.agent));
    to->set_from_ns(item.from_ns);
    to->set_to_ns(item.to_ns);
    PosesToProto(item.poses, to->mutable_poses());
  }
  for (const FactorAppend& item : delta.factors) {
    v1::FactorAppend* to = out->add_factors();
    to->set_agent(ToString(item.agent));
    for (const PoseFactor& factor : item.factors) ToProto(factor, to->add_factors());
  }
  for (const ShapeAppend& item : delta.shapes) {
    v1::ShapeAppend* to = out->add_shapes();
    to->set_agent(ToString(item.agent));
    if (item.topology.has_value()) to->set_topology_sha256(BytesOf(*item.topology));
    for (const BodyShape& shape : item.shapes) ToProto(shape, to->add_shapes());
  }
  for (const Stay& stay : delta.stays) StayToProto(stay, out->add_stays());
}

absl::Status TracksFromProto(const v1::GraphDelta& in, GraphDelta* delta) {
  for (const v1::TrajectoryAppend& item : in.appends()) {
    TrajectoryAppend made;
    DSG_ASSIGN_OR_RETURN(made.agent, ParseNodeId(item.agent()));
    DSG_RETURN_IF_ERROR(PosesFromProto(item.poses(), &made.poses));
    delta->appends.push_back(std::move(made));
  }
  for (const v1::TrajectoryCorrection& item : in.corrections()) {
    TrajectoryCorrection made;
    DSG_ASSIGN_OR_RETURN(made.agent, ParseNodeId(item.agent()));
    made.from_ns = item.from_ns();
    made.to_ns = item.to_ns();
    DSG_RETURN_IF_ERROR(PosesFromProto(item.poses(), &made.poses));
    delta->corrections.push_back(std::move(made));
  }
  for (const v1::FactorAppend& item : in.factors()) {
    FactorAppend made;
    DSG_ASSIGN_OR_RETURN(made.agent, ParseNodeId(item.agent()));
    for (const v1::PoseFactor& factor : item.factors()) {
      DSG_ASSIGN_OR_RETURN(PoseFactor one, FromProto(factor));
      made.factors.push_back(std::move(one));
    }
    delta->factors.push_back(std::move(made));
  }
  for (const v1::ShapeAppend& item : in.shapes()) {
    ShapeAppend made;
    DSG_ASSIGN_OR_RETURN(made.agent, ParseNodeId(item.agent()));
    DSG_ASSIGN_OR_RETURN(made.topology,
                         Sha256FromProto(item.topology_sha256(), "shapes.topology_sha256"));
    for (const v1::BodyShape& shape : item.shapes()) made.shapes.push_back(FromProto(shape));
    delta->shapes.push_back(std::move(made));
  }
  for (const v1::Stay& stay : in.stays()) {
    DSG_ASSIGN_OR_RETURN(const Stay made, StayFromProto(stay));
    delta->stays.push_back(made);
  }
  return absl::OkStatus();
}

void BlobsToProto(const GraphDelta& delta, v1::GraphDelta* out) {
  for (const MeshBlock& block : delta.mesh_blocks) ToProto(block, out->add_mesh_blocks());
  for (const BlockIndex& index : delta.mesh_removals) {
    v1::MeshBlockIndex* to = out->add_mesh_removals();
    to->set_x(index.x);
    to->set_y(index.y);
    to->set_z(index.z);
  }
  for (const Asset& asset : delta.assets) {
    v1::Asset* to = out->add_assets();
    to->set_sha256(BytesOf(asset.sha256));
    to->set_media_type(asset.media_type);
    to->set_content(asset.content);
  }
}

absl::Status BlobsFromProto(const v1::GraphDelta& in, GraphDelta* delta) {
  for (const v1::MeshBlock& block : in.mesh_blocks()) {
    DSG_ASSIGN_OR_RETURN(MeshBlock made, FromProto(block));
    delta->mesh_blocks.push_back(std::move(made));
  }
  for (const v1::MeshBlockIndex& index : in.mesh_removals()) {
    delta->mesh_removals.push_back({index.x(), index.y(), index.z()});
  }
  for (const v1::Asset& asset : in.assets()) {
    DSG_ASSIGN_OR_RETURN(const auto sha256, Sha256FromProto(asset.sha256(), "assets.sha256"));
    if (!sha256.has_value()) {
      return MakeError(Reason::kFieldInvalid, "an asset has no sha256",
                       {{"field", "assets.sha256"}});
    }
    delta->assets.push_back({*sha256, asset.media_type(), asset.content()});
  }
  return absl::OkStatus();
}

}  // namespace

void ToProto(const GraphDelta& delta, const LayerTable& layers, v1::GraphDelta* out) {
  LayerTable known = layers;
  for (const Layer& layer : delta.layers) known.Add(layer);
  HeaderToProto(delta, out);
  GraphToProto(delta, known, out);
  TracksToProto(delta, out);
  RemovalsToProto(delta, out);
  BlobsToProto(delta, out);
}

absl::StatusOr<GraphDelta> FromProto(const v1::GraphDelta& in, const LayerTable& layers,
                                     Unmasked unmasked) {
  GraphDelta delta;
  HeaderFromProto(in, &delta);
  DSG_RETURN_IF_ERROR(GraphFromProto(in, layers, unmasked, &delta));
  DSG_RETURN_IF_ERROR(TracksFromProto(in, &delta));
  DSG_RETURN_IF_ERROR(RemovalsFromProto(in, &delta));
  DSG_RETURN_IF_ERROR(BlobsFromProto(in, &delta));
  return delta;
}

std::string DeltaToJson(const GraphDelta& delta) {
  v1::GraphDelta message;
  ToProto(delta, LayerTable(), &message);
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.add_whitespace = true;
  std::string json;
  const auto printed = google::protobuf::util::MessageToJsonString(message, &json, options);
  // Printing a message of a known type to a string cannot fail.
  DSG_CHECK(printed.ok());
  return json;
}

absl::StatusOr<GraphDelta> DeltaFromJson(std::string_view json) {
  v1::GraphDelta message;
  const auto parsed = google::protobuf::util::JsonStringToMessage(
      google::protobuf::StringPiece(json.data(), json.size()), &message);
  if (!parsed.ok()) {
    return MakeError(Reason::kFileMalformed, absl::StrCat("not a graph delta in protobuf JSON: ",
                                                          std::string(parsed.message())));
  }
  return FromProto(message, LayerTable());
}

}  // namespace dsg
