// SPDX-License-Identifier: Apache-2.0
#include "schema/model/delta_check.h"

#include <openssl/sha.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/model/map_fit.h"
#include "schema/model/value_check.h"

namespace dsg {
namespace {

// Ids that an error names, so that it fits into the trailer of a call.
constexpr size_t kMissingNodeCountMax = 200;

// Walks the parts of one delta against one graph. Facts of the delta's own nodes win over stored
// ones, because edges and trajectories of the same delta refer to them.
class DeltaChecker {
 public:
  DeltaChecker(const GraphDelta& delta, const GraphLookup& graph) : delta_(delta), graph_(graph) {}

  absl::Status Check() {
    DSG_RETURN_IF_ERROR(CheckHeader());
    DSG_RETURN_IF_ERROR(CheckLayers());
    DSG_RETURN_IF_ERROR(CheckAssets());
    for (const Node& node : delta_.nodes) DSG_RETURN_IF_ERROR(CheckNode(node));
    for (const Retirement& item : delta_.retirements) DSG_RETURN_IF_ERROR(CheckRetirement(item));
    for (const Edge& edge : delta_.edges) DSG_RETURN_IF_ERROR(CheckEdge(edge));
    for (const Node& node : delta_.nodes) DSG_RETURN_IF_ERROR(CheckFamily(node));
    for (const TrajectoryAppend& item : delta_.appends) DSG_RETURN_IF_ERROR(CheckAppend(item));
    for (const auto& item : delta_.corrections) DSG_RETURN_IF_ERROR(CheckCorrection(item));
    for (const TrackSpan& span : delta_.factor_removals) {
      DSG_RETURN_IF_ERROR(CheckSpan(span, "factors to remove"));
    }
    for (const TrackSpan& span : delta_.shape_removals) {
      DSG_RETURN_IF_ERROR(CheckSpan(span, "shapes to remove"));
    }
    for (const FactorAppend& item : delta_.factors) DSG_RETURN_IF_ERROR(CheckFactors(item));
    for (const ShapeAppend& item : delta_.shapes) DSG_RETURN_IF_ERROR(CheckShapes(item));
    for (const Stay& stay : delta_.stays) DSG_RETURN_IF_ERROR(CheckStay(stay));
    for (const MeshBlock& block : delta_.mesh_blocks)
      DSG_RETURN_IF_ERROR(values::CheckMeshBlock(block));
    return delta_.is_forgetting ? absl::OkStatus() : CheckFitsMap(delta_, graph_);
  }

 private:
  using Facts = GraphLookup::NodeFacts;

  absl::Status CheckHeader() const {
    if (delta_.session_id.empty() || delta_.session_id.size() > 256) {
      return values::Invalid("session_id must have 1 to 256 characters");
    }
    if (delta_.sequence < 1) {
      return values::Invalid(absl::StrCat("sequence is ", delta_.sequence, "; it counts from 1"));
    }
    DSG_RETURN_IF_ERROR(values::CheckText(delta_.session_id, 256, [] { return "session_id"; }));
    DSG_RETURN_IF_ERROR(values::CheckText(delta_.author, kNameLengthMax, [] { return "author"; }));
    DSG_RETURN_IF_ERROR(
        values::CheckText(delta_.message, kAttributeLengthMax, [] { return "message"; }));
    DSG_RETURN_IF_ERROR(
        values::CheckText(delta_.config_digest, kNameLengthMax, [] { return "config_digest"; }));
    return absl::OkStatus();
  }

  absl::Status CheckLayers() {
    std::set<std::string> names;
    for (const Layer& layer : delta_.layers) {
      if (layer.id <= 0 || layer.name.empty() || layer.name.size() > 64 || layer.rank < 0) {
        return values::Invalid(
            absl::StrCat("layer ", layer.id, " \"", layer.name,
                         "\" needs a positive id, a name of 1 to 64 characters and a "
                         "rank of 0 or more"));
      }
      DSG_RETURN_IF_ERROR(values::CheckText(layer.name, 64, [] { return "a layer's name"; }));
      if (!names.insert(layer.name).second) {
        return values::Invalid("two layers are named \"" + layer.name + "\"");
      }
      DSG_ASSIGN_OR_RETURN(const auto known, graph_.FindLayer(layer.id));
      if (known.has_value() && !(*known == layer)) {
        return values::Invalid(absl::StrCat("layer ", layer.id, " is \"", known->name,
                                            "\" of rank ", known->rank, " and cannot become \"",
                                            layer.name, "\" of rank ", layer.rank));
      }
      layers_[layer.id] = layer;
    }
    for (const SemanticLabel& label : delta_.labels) {
      DSG_RETURN_IF_ERROR(
          values::CheckText(label.name, kNameLengthMax, [] { return "a label's name"; }));
    }
    return absl::OkStatus();
  }

  absl::Status CheckAssets() {
    for (const Asset& asset : delta_.assets) {
      if (asset.content.size() > kAssetBytesMax) {
        return values::Invalid(absl::StrCat("an asset has ", asset.content.size(),
                                            " bytes; at most ", kAssetBytesMax, " are kept"));
      }
      DSG_RETURN_IF_ERROR(values::CheckText(asset.media_type, kNameLengthMax,
                                            [] { return "an asset's media type"; }));
      Sha256 actual;
      SHA256(reinterpret_cast<const uint8_t*>(asset.content.data()), asset.content.size(),
             actual.data());
      if (actual != asset.sha256)
        return values::Invalid("an asset's content does not match its sha256");
      assets_.insert(asset.sha256);
    }
    return absl::OkStatus();
  }

  absl::StatusOr<Layer> LayerById(LayerId id, values::What what) {
    const auto cached = layers_.find(id);
    if (cached != layers_.end()) return cached->second;
    DSG_ASSIGN_OR_RETURN(const auto stored, graph_.FindLayer(id));
    if (!stored.has_value()) {
      return values::Invalid(absl::StrCat(what(), " is in layer ", id, ", which does not exist"));
    }
    layers_[id] = *stored;
    return *stored;
  }

  absl::Status CheckAssetKnown(const std::optional<Sha256>& sha256, values::What what) {
    if (!sha256.has_value() || assets_.contains(*sha256)) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const bool stored, graph_.HasAsset(*sha256));
    if (stored) return absl::OkStatus();
    return values::Invalid(what() +
                           " refers to an asset that is not stored; commit the asset first");
  }

  absl::Status CheckNode(const Node& node) {
    const auto what = [&] { return absl::StrCat("node ", ToString(node.id)); };
    if (!node.id.IsValid()) {
      return values::Invalid(
          absl::StrCat("node id ", node.id.value, " does not begin with a letter"));
    }
    DSG_ASSIGN_OR_RETURN(const Layer layer, LayerById(node.layer, what));
    const auto expected = LayerOfKind(node.kind);
    if (node.kind.empty() || node.kind.size() > 64 ||
        (expected.has_value() && *expected != node.layer)) {
      return values::Invalid(absl::StrCat(what(), " of kind \"", node.kind,
                                          "\" cannot be in layer \"", layer.name, "\""));
    }
    DSG_RETURN_IF_ERROR(values::CheckText(node.kind, 64, [&] { return "kind of " + what(); }));
    DSG_RETURN_IF_ERROR(
        values::CheckText(node.name, kNameLengthMax, [&] { return "name of " + what(); }));
    DSG_RETURN_IF_ERROR(
        values::CheckText(node.class_name, kNameLengthMax, [&] { return "class of " + what(); }));
    DSG_RETURN_IF_ERROR(values::CheckPose(node.map_T_node, what));
    DSG_RETURN_IF_ERROR(values::CheckBox(node.box_node, what));
    DSG_RETURN_IF_ERROR(values::CheckInterval(node.valid, what));
    DSG_RETURN_IF_ERROR(values::CheckAttributes(node.attributes, what));
    if (node.confidence.has_value() && !(*node.confidence >= 0.0 && *node.confidence <= 1.0)) {
      return values::Invalid(absl::StrCat("confidence of ", what(), " is ", *node.confidence,
                                          "; it must be from 0 to 1"));
    }
    if (node.first_observed_ns.has_value()) {
      DSG_RETURN_IF_ERROR(values::CheckInstant(*node.first_observed_ns,
                                               [&] { return "first_observed_ns of " + what(); }));
    }
    if (node.last_observed_ns.has_value()) {
      DSG_RETURN_IF_ERROR(values::CheckInstant(*node.last_observed_ns,
                                               [&] { return "last_observed_ns of " + what(); }));
    }
    DSG_RETURN_IF_ERROR(values::CheckNotNegative(static_cast<double>(node.observation_count),
                                                 [&] { return "observation_count of " + what(); }));
    DSG_RETURN_IF_ERROR(CheckComponents(node, what));
    facts_[node.id] = Facts{node.layer,
                            IsAgentKind(node.kind),
                            node.valid,
                            node.box_node.isEmpty() ? Box3d() : node.BoxMap(),
                            node.map_T_node.position,
                            node.first_observed_ns,
                            node.last_observed_ns};
    return absl::OkStatus();
  }

  absl::Status CheckComponents(const Node& node, values::What what) {
    if (node.object.has_value()) {
      DSG_RETURN_IF_ERROR(CheckAssetKnown(node.object->model, what));
      if (node.object->model.has_value()) {
        DSG_RETURN_IF_ERROR(
            values::CheckPose(node.object->map_T_model, [&] { return "the model of " + what(); }));
      }
      const double residual_m = node.object->registration_residual_m;
      if (!std::isfinite(residual_m))
        return values::NotFinite("registration residual of " + what());
      DSG_RETURN_IF_ERROR(values::CheckNotNegative(
          residual_m, [&] { return "registration residual of " + what(); }));
      const Eigen::Vector3d& size = node.object->size;
      if (!values::IsSane(size)) return values::NotFinite("size of " + what());
      DSG_RETURN_IF_ERROR(
          values::CheckNotNegative(size.minCoeff(), [&] { return "an edge length of " + what(); }));
    }
    if (node.agent.has_value()) {
      DSG_RETURN_IF_ERROR(CheckAssetKnown(node.agent->body_model, what));
      for (const Sha256& part : node.agent->place_memory) {
        DSG_RETURN_IF_ERROR(CheckAssetKnown(part, what));
      }
      DSG_RETURN_IF_ERROR(values::CheckText(node.agent->track_state, 64,
                                            [&] { return "track state of " + what(); }));
      if (node.agent->gap_ns_max < 0) {
        return values::Invalid(absl::StrCat("gap_ns_max of ", what(), " is ",
                                            node.agent->gap_ns_max,
                                            "; give nanoseconds above 0, or 0 for the map's"));
      }
      if (node.agent->shape_coefficients.size() > 1024) {
        return values::Invalid("shape coefficients of " + what() + " are more than 1024");
      }
    }
    if (node.place.has_value()) {
      const double clearance_m = node.place->clearance_m;
      if (!std::isfinite(clearance_m)) return values::NotFinite("clearance of " + what());
      if (clearance_m < 0.0) {
        return values::Invalid(absl::StrCat("clearance of ", what(), " is ", clearance_m,
                                            " m; it is a distance, 0 or more"));
      }
      DSG_RETURN_IF_ERROR(values::CheckBox(node.place->free_box, what));
      DSG_RETURN_IF_ERROR(values::CheckNotNegative(
          node.place->basis_point_count, [&] { return "basis_point_count of " + what(); }));
    }
    if (node.structure.has_value()) {
      DSG_RETURN_IF_ERROR(values::CheckText(node.structure->structure_type, 64,
                                            [&] { return "structure type of " + what(); }));
      if (!values::IsSane(node.structure->plane_normal_map) ||
          !(std::abs(node.structure->plane_offset_m) <= kCoordinateMaxM)) {
        return values::NotFinite("the plane of " + what());
      }
    }
    return node.region.has_value() ? values::CheckRegion(*node.region, what) : absl::OkStatus();
  }

  // nullptr if there is no such node.
  absl::StatusOr<const Facts*> Find(NodeId id) {
    const auto found = facts_.find(id);
    if (found != facts_.end()) return &found->second;
    DSG_ASSIGN_OR_RETURN(const auto stored, graph_.FindNode(id));
    return stored.has_value() ? &facts_.emplace(id, *stored).first->second : nullptr;
  }

  absl::Status CheckRetirement(const Retirement& item) {
    const auto what = [&] { return absl::StrCat("node ", ToString(item.id)); };
    const bool upserted = std::any_of(delta_.nodes.begin(), delta_.nodes.end(),
                                      [&](const Node& node) { return node.id == item.id; });
    if (upserted) return values::Invalid(what() + " is both written and retired");
    DSG_ASSIGN_OR_RETURN(const auto facts, Find(item.id));
    if (facts == nullptr) {
      DSG_ASSIGN_OR_RETURN(ErrorMetadata missing, Missing());
      return values::Invalid(what() + " is to be retired but does not exist", std::move(missing));
    }
    if (item.valid_to_ns.has_value() && *item.valid_to_ns <= facts->valid.from_ns) {
      return values::Invalid(absl::StrCat(what(), " cannot leave the world at ", *item.valid_to_ns,
                                          ": it came at ", facts->valid.from_ns));
    }
    if (!item.valid_to_ns.has_value()) gone_.insert(item.id);
    return absl::OkStatus();
  }

  absl::StatusOr<const Facts*> FindEnd(NodeId id, values::What what) {
    DSG_ASSIGN_OR_RETURN(const auto facts, Find(id));
    if (facts == nullptr || gone_.contains(id)) {
      DSG_ASSIGN_OR_RETURN(ErrorMetadata missing, Missing());
      return values::Invalid(
          absl::StrCat(what(), " refers to node ", ToString(id), ", which does not exist"),
          std::move(missing));
    }
    return facts;
  }

  // All nodes that the delta refers to and that do not exist: who sent it can leave them out, or
  // bring them, at one go.
  absl::StatusOr<ErrorMetadata> Missing() {
    std::set<NodeId> named;
    for (const Retirement& item : delta_.retirements) named.insert(item.id);
    for (const Edge& edge : delta_.edges) named.insert({edge.source, edge.target});
    for (const TrajectoryAppend& item : delta_.appends) named.insert(item.agent);
    for (const TrajectoryCorrection& item : delta_.corrections) named.insert(item.agent);
    for (const TrackSpan& span : delta_.factor_removals) named.insert(span.agent);
    for (const TrackSpan& span : delta_.shape_removals) named.insert(span.agent);
    for (const FactorAppend& item : delta_.factors) {
      named.insert(item.agent);
      for (const PoseFactor& factor : item.factors) named.insert(factor.to_agent);
    }
    for (const ShapeAppend& item : delta_.shapes) named.insert(item.agent);
    for (const Stay& stay : delta_.stays) named.insert({stay.agent, stay.place, stay.room});
    std::string text;
    size_t count = 0;
    for (const NodeId id : named) {
      if (id.empty() || count == kMissingNodeCountMax) continue;
      DSG_ASSIGN_OR_RETURN(const auto facts, Find(id));
      if (facts != nullptr) continue;
      absl::StrAppend(&text, count == 0 ? "" : " ", ToString(id));
      ++count;
    }
    return text.empty() ? ErrorMetadata() : ErrorMetadata{{"missing_nodes", text}};
  }

  absl::Status CheckEdge(const Edge& edge) {
    const auto what = [&] {
      return absl::StrCat("edge ", ToString(edge.source), " ", edge.relation, " ",
                          ToString(edge.target));
    };
    if (edge.relation.empty() || edge.relation.size() > 64) {
      return values::Invalid(what() + " needs a relation of 1 to 64 characters");
    }
    DSG_RETURN_IF_ERROR(values::CheckText(edge.relation, 64, [] { return "a relation's name"; }));
    if (edge.source == edge.target) return values::Invalid(what() + " ends where it begins");
    if (!std::isfinite(edge.weight)) return values::NotFinite("weight of " + what());
    DSG_RETURN_IF_ERROR(values::CheckInterval(edge.valid, what));
    DSG_RETURN_IF_ERROR(values::CheckAttributes(edge.attributes, what));
    DSG_ASSIGN_OR_RETURN(const Facts* const source, FindEnd(edge.source, what));
    DSG_ASSIGN_OR_RETURN(const Facts* const target, FindEnd(edge.target, what));
    if (edge.relation != relations::kContains) return absl::OkStatus();
    return CheckContainment(*source, *target, what);
  }

  // Ranks grow strictly from child to parent, so containment cannot be circular.
  absl::Status CheckContainment(const Facts& parent, const Facts& child, values::What what) {
    DSG_ASSIGN_OR_RETURN(const Layer parent_layer, LayerById(parent.layer, what));
    DSG_ASSIGN_OR_RETURN(const Layer child_layer, LayerById(child.layer, what));
    if (parent_layer.rank <= child_layer.rank) {
      return values::Invalid(absl::StrCat(
          what(), ": parent layer \"", parent_layer.name, "\" of rank ", parent_layer.rank,
          " must outrank child layer \"", child_layer.name, "\" of rank ", child_layer.rank));
    }
    if (parent.box_map.isEmpty() || child.is_agent) return absl::OkStatus();
    const Box3d bound(parent.box_map.min().array() - kBoxToleranceM,
                      parent.box_map.max().array() + kBoxToleranceM);
    const Box3d inner = child.box_map.isEmpty() ? Box3d(child.position_map) : child.box_map;
    if (bound.contains(inner)) return absl::OkStatus();
    return values::Invalid(what() +
                           ": the child's box sticks out of the parent's; grow the parent's box");
  }

  // A moved or resized node must still fit its stored parents and hold its stored children.
  absl::Status CheckFamily(const Node& node) {
    DSG_ASSIGN_OR_RETURN(const auto stored, graph_.FindNode(node.id));
    if (!stored.has_value()) return absl::OkStatus();
    const Facts& facts = facts_[node.id];
    const auto what = [&] { return absl::StrCat("node ", ToString(node.id)); };
    DSG_ASSIGN_OR_RETURN(const auto parents, graph_.FindParents(node.id));
    for (const NodeId parent : parents) {
      DSG_RETURN_IF_ERROR(CheckStoredContainment(parent, node.id, what));
    }
    const bool holds_as_before = facts.layer == stored->layer && !stored->box_map.isEmpty() &&
                                 facts.box_map.contains(stored->box_map);
    if (holds_as_before) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const auto children, graph_.FindChildren(node.id));
    for (const NodeId child : children) {
      DSG_RETURN_IF_ERROR(CheckStoredContainment(node.id, child, what));
    }
    return absl::OkStatus();
  }

  absl::Status CheckStoredContainment(NodeId parent, NodeId child, values::What what) {
    const bool ends_now = gone_.contains(parent) || gone_.contains(child) ||
                          std::any_of(delta_.edge_removals.begin(), delta_.edge_removals.end(),
                                      [&](const EdgeKey& key) {
                                        return key.source == parent && key.target == child &&
                                               key.relation == relations::kContains;
                                      });
    if (ends_now) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const Facts* const parent_facts, FindEnd(parent, what));
    DSG_ASSIGN_OR_RETURN(const Facts* const child_facts, FindEnd(child, what));
    return CheckContainment(*parent_facts, *child_facts, [&] {
      return absl::StrCat("edge ", ToString(parent), " CONTAINS ", ToString(child));
    });
  }

  absl::Status CheckAgent(NodeId id, values::What what) {
    DSG_ASSIGN_OR_RETURN(const Facts* const facts, FindEnd(id, what));
    if (facts->is_agent) return absl::OkStatus();
    return values::Invalid(
        absl::StrCat(what(), " needs a human or robot, and ", ToString(id), " is none"));
  }

  absl::Status CheckPoses(const std::vector<TimedPose>& poses, values::What what) {
    TimeNs last_ns = kTimeMin;
    for (const TimedPose& pose : poses) {
      if (pose.time_ns <= last_ns) {
        return values::Invalid(absl::StrCat("times of ", what(), " do not grow: ", pose.time_ns,
                                            " comes after ", last_ns));
      }
      last_ns = pose.time_ns;
      if (!values::IsSane(pose.map_T_agent.position) || !IsValidPose(pose.map_T_agent)) {
        return values::CheckPose(pose.map_T_agent,
                                 [&] { return absl::StrCat(what(), " at ", pose.time_ns, " ns"); });
      }
      if (pose.covariance != nullptr &&
          !std::all_of(pose.covariance->begin(), pose.covariance->end(),
                       [](float number) { return std::isfinite(number); })) {
        return values::NotFinite(
            absl::StrCat("covariance of ", what(), " at ", pose.time_ns, " ns"));
      }
      if ((pose.flags & ~pose_flags::kAll) != 0) {
        return values::Invalid(absl::StrCat("unknown flags ", pose.flags, " in ", what()));
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckAppend(const TrajectoryAppend& item) {
    const auto what = [&] { return absl::StrCat("trajectory of ", ToString(item.agent)); };
    DSG_RETURN_IF_ERROR(CheckAgent(item.agent, what));
    DSG_RETURN_IF_ERROR(CheckPoses(item.poses, what));
    if (item.poses.empty()) return values::Invalid(what() + " is appended without poses");
    DSG_ASSIGN_OR_RETURN(const auto end_ns, graph_.FindTrackEnd(item.agent));
    if (!end_ns.has_value() || item.poses.front().time_ns > *end_ns) return absl::OkStatus();
    return MakeError(Reason::kTrackConflict,
                     absl::StrCat(what(), ": a pose at ", item.poses.front().time_ns,
                                  " ns is not later than the stored end ", *end_ns,
                                  " ns; send a correction to change the past"),
                     {{"agent", ToString(item.agent)},
                      {"time_ns", absl::StrCat(item.poses.front().time_ns)},
                      {"stored_end_ns", absl::StrCat(*end_ns)}});
  }

  absl::Status CheckCorrection(const TrajectoryCorrection& item) {
    const auto what = [&] { return absl::StrCat("correction of ", ToString(item.agent)); };
    DSG_RETURN_IF_ERROR(CheckAgent(item.agent, what));
    DSG_RETURN_IF_ERROR(values::CheckInterval({item.from_ns, item.to_ns}, what));
    DSG_RETURN_IF_ERROR(CheckPoses(item.poses, what));
    DSG_ASSIGN_OR_RETURN(const auto end_ns, graph_.FindTrackEnd(item.agent));
    if (!end_ns.has_value()) {
      return values::Invalid(what() + ": the agent has no poses to correct",
                             {{"correction_of", ToString(item.agent)}});
    }
    for (const TimedPose& pose : item.poses) {
      if (pose.time_ns < item.from_ns || pose.time_ns >= item.to_ns || pose.time_ns > *end_ns) {
        return values::Invalid(
            absl::StrCat(what(), ": pose at ", pose.time_ns, " ns is outside [", item.from_ns, ", ",
                         item.to_ns, ") or after the track's end ", *end_ns),
            {{"correction_of", ToString(item.agent)}, {"stored_end_ns", absl::StrCat(*end_ns)}});
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckSpan(const TrackSpan& span, const std::string& which) {
    const auto what = [&] { return absl::StrCat(which, " of ", ToString(span.agent)); };
    DSG_RETURN_IF_ERROR(CheckAgent(span.agent, what));
    return values::CheckInterval({span.from_ns, span.to_ns}, what);
  }

  absl::Status CheckFactors(const FactorAppend& item) {
    const auto what = [&] { return absl::StrCat("factors of ", ToString(item.agent)); };
    DSG_RETURN_IF_ERROR(CheckAgent(item.agent, what));
    for (const PoseFactor& factor : item.factors) {
      if (factor.type.empty()) return values::Invalid(what() + " need a type");
      DSG_RETURN_IF_ERROR(values::CheckText(factor.type, 64, [&] { return "type of " + what(); }));
      DSG_RETURN_IF_ERROR(values::CheckPose(factor.relative_pose, what));
      if (!factor.to_agent.empty()) DSG_RETURN_IF_ERROR(CheckAgent(factor.to_agent, what));
    }
    return absl::OkStatus();
  }

  absl::Status CheckShapes(const ShapeAppend& item) {
    const auto what = [&] { return absl::StrCat("shapes of ", ToString(item.agent)); };
    DSG_RETURN_IF_ERROR(CheckAgent(item.agent, what));
    DSG_RETURN_IF_ERROR(CheckAssetKnown(item.topology, what));
    TimeNs last_ns = kTimeMin;
    for (const BodyShape& shape : item.shapes) {
      if (shape.time_ns <= last_ns) return values::Invalid("times of " + what() + " do not grow");
      last_ns = shape.time_ns;
      const auto which = [&] { return absl::StrCat(what(), " at ", shape.time_ns, " ns"); };
      if (shape.vertices.size() % 3 != 0 || shape.joints.size() % 3 != 0) {
        return values::Invalid(which() + " have vertices or joints that are not in threes");
      }
      if (shape.vertices.size() > kShapeVertexNumbersMax ||
          shape.joints.size() > kShapeNumbersMax ||
          shape.pose_coefficients.size() > kShapeNumbersMax ||
          shape.shape_coefficients.size() > kShapeNumbersMax) {
        return values::Invalid(which() + " have too many numbers");
      }
      for (const auto* part :
           {&shape.pose_coefficients, &shape.shape_coefficients, &shape.vertices, &shape.joints}) {
        if (!values::AreSane(*part)) return values::NotFinite("a number of " + which());
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckStay(const Stay& stay) {
    const auto what = [&] {
      return absl::StrCat("stay of ", ToString(stay.agent), " from ", stay.enter_ns, " ns");
    };
    DSG_RETURN_IF_ERROR(CheckAgent(stay.agent, what));
    DSG_RETURN_IF_ERROR(values::CheckInterval({stay.enter_ns, stay.exit_ns}, what));
    if (stay.place.empty() && stay.room.empty()) return values::Invalid(what() + " is nowhere");
    for (const NodeId id : {stay.place, stay.room}) {
      if (!id.empty()) DSG_RETURN_IF_ERROR(FindEnd(id, what).status());
    }
    return absl::OkStatus();
  }

  const GraphDelta& delta_;
  const GraphLookup& graph_;
  std::unordered_map<LayerId, Layer> layers_;
  std::unordered_map<NodeId, Facts> facts_;
  std::set<NodeId> gone_;
  std::set<Sha256> assets_;
};

}  // namespace

absl::Status CheckDelta(const GraphDelta& delta, const GraphLookup& graph) {
  return DeltaChecker(delta, graph).Check();
}

}  // namespace dsg
