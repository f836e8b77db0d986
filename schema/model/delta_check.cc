// SPDX-License-Identifier: Apache-2.0
#include "schema/model/delta_check.h"

#include <openssl/sha.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <unordered_map>

#include "absl/functional/function_ref.h"
#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"
#include "schema/model/map_fit.h"

namespace dsg {
namespace {

// Ids that an error names, so that it fits into the trailer of a call.
constexpr size_t kMissingNodeCountMax = 200;

absl::Status Invalid(std::string_view what, ErrorMetadata metadata = {}) {
  return MakeError(Reason::kDeltaInvalid, absl::StrCat("delta refused: ", std::string(what)),
                   std::move(metadata));
}

absl::Status NotFinite(std::string_view what) {
  return MakeError(Reason::kNumberNotFinite,
                   absl::StrCat("delta refused: ", std::string(what),
                                " is not a finite number of at most ", kCoordinateMaxM));
}

bool IsSane(const Eigen::Vector3d& v) {
  return v.allFinite() && v.cwiseAbs().maxCoeff() <= kCoordinateMaxM;
}

bool AreSane(const std::vector<float>& numbers) {
  // Not-a-number is below nothing.
  return std::all_of(numbers.begin(), numbers.end(), [](float number) {
    return std::abs(static_cast<double>(number)) <= kCoordinateMaxM;
  });
}

// Names what is checked, in words that are only put together once something is wrong with it.
using What = absl::FunctionRef<std::string()>;

// What protobuf could not read back must not be stored.
absl::Status CheckText(std::string_view text, size_t length_max, What what) {
  if (text.size() > length_max) {
    return Invalid(
        absl::StrCat(what(), " has ", text.size(), " bytes; at most ", length_max, " are kept"));
  }
  if (!IsUtf8(text)) return Invalid(what() + " is not UTF-8; convert it");
  return absl::OkStatus();
}

absl::Status CheckPose(const Pose3d& pose, What what) {
  if (!IsSane(pose.position)) {
    return NotFinite(absl::StrCat("position (", pose.position.x(), ", ", pose.position.y(), ", ",
                                  pose.position.z(), ") of ", what()));
  }
  if (!IsValidPose(pose)) {
    return Invalid(absl::StrCat("orientation of ", what(), " has norm ", pose.orientation.norm(),
                                "; it must be a unit quaternion, normalise it"));
  }
  return absl::OkStatus();
}

absl::Status CheckBox(const Box3d& box, What what) {
  if (box.isEmpty()) return absl::OkStatus();
  if (!IsSane(box.min()) || !IsSane(box.max()))
    return NotFinite("a corner of the box of " + what());
  return absl::OkStatus();
}

// The limits of 64 bits mean an open end, which no instant is.
absl::Status CheckInstant(TimeNs time_ns, What what) {
  if (time_ns != kTimeMin && time_ns != kTimeMax) return absl::OkStatus();
  return Invalid(absl::StrCat(what(), " is ", time_ns,
                              " ns, a limit of 64 bits, which means an open end; give an instant, "
                              "or leave it out"));
}

absl::Status CheckNotNegative(double number, What what) {
  if (!(number < 0.0)) return absl::OkStatus();
  return Invalid(absl::StrCat(what(), " is ", number, "; it must be 0 or more"));
}

// Twice the area of an outline; its sign tells the sense.
double TwiceArea(const Polygon2d& outline) {
  double twice = 0.0;
  for (size_t i = 0; i < outline.size(); ++i) {
    // From the first corner: far from the origin the products would swallow the area.
    const Eigen::Vector2d a = outline[i] - outline[0];
    const Eigen::Vector2d b = outline[(i + 1) % outline.size()] - outline[0];
    twice += a.x() * b.y() - b.x() * a.y();
  }
  return twice;
}

// No outline means that it is not known. Either sense is taken: inside is told by even and odd.
absl::Status CheckRegion(const RegionInfo& region, What what) {
  for (const auto& [name, probability] : region.class_probabilities) {
    DSG_RETURN_IF_ERROR(CheckText(name, kNameLengthMax, [&] { return "a class of " + what(); }));
    if (!std::isfinite(probability)) return NotFinite("a class probability of " + what());
  }
  const Polygon2d& outline = region.footprint_map;
  if (outline.size() > 65536)
    return Invalid("footprint of " + what() + " has more than 65536 corners");
  for (const Eigen::Vector2d& corner : outline) {
    if (!IsSane({corner.x(), corner.y(), 0.0})) return NotFinite("footprint of " + what());
  }
  if (!outline.empty() && (outline.size() < 3 || TwiceArea(outline) == 0.0)) {
    return Invalid(absl::StrCat("footprint of ", what(), " has ", outline.size(),
                                " corners and no area; give at least 3 that are not on a line, or "
                                "none if it is not known"));
  }
  if (!IsSane({region.z_min_m, region.z_max_m, 0.0})) {
    return NotFinite(
        absl::StrCat("height ", region.z_min_m, " or ", region.z_max_m, " of ", what()));
  }
  if (region.z_min_m <= region.z_max_m) return absl::OkStatus();
  return Invalid(absl::StrCat("footprint of ", what(), " is inverted: z_min_m ", region.z_min_m,
                              " is above z_max_m ", region.z_max_m, "; swap them"));
}

absl::Status CheckInterval(const Interval& interval, What what) {
  if (interval.from_ns < interval.to_ns) return absl::OkStatus();
  return Invalid(absl::StrCat("validity [", interval.from_ns, ", ", interval.to_ns, ") of ", what(),
                              " is empty; from must be before to"));
}

absl::Status CheckAttributes(const Attributes& attributes, What what) {
  if (attributes.size() > kAttributeCountMax) {
    return Invalid(absl::StrCat(what(), " has ", attributes.size(), " attributes; at most ",
                                kAttributeCountMax, " are kept"));
  }
  for (const auto& [name, value] : attributes) {
    const auto* text = std::get_if<std::string>(&value);
    const auto* number = std::get_if<double>(&value);
    if (name.empty() || name.size() > kNameLengthMax ||
        (text != nullptr && text->size() > kAttributeLengthMax)) {
      return Invalid(absl::StrCat("attribute \"", name.substr(0, 64), "\" of ", what(),
                                  " is empty or too long"));
    }
    if (!IsUtf8(name) || (text != nullptr && !IsUtf8(*text))) {
      return Invalid(absl::StrCat("an attribute of ", what(), " is not UTF-8; convert it"));
    }
    if (number != nullptr && !std::isfinite(*number)) {
      return NotFinite(absl::StrCat("attribute \"", name, "\" of ", what()));
    }
  }
  return absl::OkStatus();
}

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
    for (const MeshBlock& block : delta_.mesh_blocks) DSG_RETURN_IF_ERROR(CheckMesh(block));
    return delta_.is_forgetting ? absl::OkStatus() : CheckFitsMap(delta_, graph_);
  }

 private:
  using Facts = GraphLookup::NodeFacts;

  absl::Status CheckHeader() const {
    if (delta_.session_id.empty() || delta_.session_id.size() > 256) {
      return Invalid("session_id must have 1 to 256 characters");
    }
    if (delta_.sequence < 1) {
      return Invalid(absl::StrCat("sequence is ", delta_.sequence, "; it counts from 1"));
    }
    DSG_RETURN_IF_ERROR(CheckText(delta_.session_id, 256, [] { return "session_id"; }));
    DSG_RETURN_IF_ERROR(CheckText(delta_.author, kNameLengthMax, [] { return "author"; }));
    DSG_RETURN_IF_ERROR(CheckText(delta_.message, kAttributeLengthMax, [] { return "message"; }));
    DSG_RETURN_IF_ERROR(
        CheckText(delta_.config_digest, kNameLengthMax, [] { return "config_digest"; }));
    return absl::OkStatus();
  }

  absl::Status CheckLayers() {
    std::set<std::string> names;
    for (const Layer& layer : delta_.layers) {
      if (layer.id <= 0 || layer.name.empty() || layer.name.size() > 64 || layer.rank < 0) {
        return Invalid(absl::StrCat("layer ", layer.id, " \"", layer.name,
                                    "\" needs a positive id, a name of 1 to 64 characters and a "
                                    "rank of 0 or more"));
      }
      DSG_RETURN_IF_ERROR(CheckText(layer.name, 64, [] { return "a layer's name"; }));
      if (!names.insert(layer.name).second) {
        return Invalid("two layers are named \"" + layer.name + "\"");
      }
      DSG_ASSIGN_OR_RETURN(const auto known, graph_.FindLayer(layer.id));
      if (known.has_value() && !(*known == layer)) {
        return Invalid(absl::StrCat("layer ", layer.id, " is \"", known->name, "\" of rank ",
                                    known->rank, " and cannot become \"", layer.name, "\" of rank ",
                                    layer.rank));
      }
      layers_[layer.id] = layer;
    }
    for (const SemanticLabel& label : delta_.labels) {
      DSG_RETURN_IF_ERROR(CheckText(label.name, kNameLengthMax, [] { return "a label's name"; }));
    }
    return absl::OkStatus();
  }

  absl::Status CheckAssets() {
    for (const Asset& asset : delta_.assets) {
      if (asset.content.size() > kAssetBytesMax) {
        return Invalid(absl::StrCat("an asset has ", asset.content.size(), " bytes; at most ",
                                    kAssetBytesMax, " are kept"));
      }
      DSG_RETURN_IF_ERROR(
          CheckText(asset.media_type, kNameLengthMax, [] { return "an asset's media type"; }));
      Sha256 actual;
      SHA256(reinterpret_cast<const uint8_t*>(asset.content.data()), asset.content.size(),
             actual.data());
      if (actual != asset.sha256) return Invalid("an asset's content does not match its sha256");
      assets_.insert(asset.sha256);
    }
    return absl::OkStatus();
  }

  absl::StatusOr<Layer> LayerById(LayerId id, What what) {
    const auto cached = layers_.find(id);
    if (cached != layers_.end()) return cached->second;
    DSG_ASSIGN_OR_RETURN(const auto stored, graph_.FindLayer(id));
    if (!stored.has_value()) {
      return Invalid(absl::StrCat(what(), " is in layer ", id, ", which does not exist"));
    }
    layers_[id] = *stored;
    return *stored;
  }

  absl::Status CheckAssetKnown(const std::optional<Sha256>& sha256, What what) {
    if (!sha256.has_value() || assets_.contains(*sha256)) return absl::OkStatus();
    DSG_ASSIGN_OR_RETURN(const bool stored, graph_.HasAsset(*sha256));
    if (stored) return absl::OkStatus();
    return Invalid(what() + " refers to an asset that is not stored; commit the asset first");
  }

  absl::Status CheckNode(const Node& node) {
    const auto what = [&] { return absl::StrCat("node ", ToString(node.id)); };
    if (!node.id.IsValid()) {
      return Invalid(absl::StrCat("node id ", node.id.value, " does not begin with a letter"));
    }
    DSG_ASSIGN_OR_RETURN(const Layer layer, LayerById(node.layer, what));
    const auto expected = LayerOfKind(node.kind);
    if (node.kind.empty() || node.kind.size() > 64 ||
        (expected.has_value() && *expected != node.layer)) {
      return Invalid(absl::StrCat(what(), " of kind \"", node.kind, "\" cannot be in layer \"",
                                  layer.name, "\""));
    }
    DSG_RETURN_IF_ERROR(CheckText(node.kind, 64, [&] { return "kind of " + what(); }));
    DSG_RETURN_IF_ERROR(CheckText(node.name, kNameLengthMax, [&] { return "name of " + what(); }));
    DSG_RETURN_IF_ERROR(
        CheckText(node.class_name, kNameLengthMax, [&] { return "class of " + what(); }));
    DSG_RETURN_IF_ERROR(CheckPose(node.map_T_node, what));
    DSG_RETURN_IF_ERROR(CheckBox(node.box_node, what));
    DSG_RETURN_IF_ERROR(CheckInterval(node.valid, what));
    DSG_RETURN_IF_ERROR(CheckAttributes(node.attributes, what));
    if (node.confidence.has_value() && !(*node.confidence >= 0.0 && *node.confidence <= 1.0)) {
      return Invalid(absl::StrCat("confidence of ", what(), " is ", *node.confidence,
                                  "; it must be from 0 to 1"));
    }
    if (node.first_observed_ns.has_value()) {
      DSG_RETURN_IF_ERROR(
          CheckInstant(*node.first_observed_ns, [&] { return "first_observed_ns of " + what(); }));
    }
    if (node.last_observed_ns.has_value()) {
      DSG_RETURN_IF_ERROR(
          CheckInstant(*node.last_observed_ns, [&] { return "last_observed_ns of " + what(); }));
    }
    DSG_RETURN_IF_ERROR(CheckNotNegative(static_cast<double>(node.observation_count),
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

  absl::Status CheckComponents(const Node& node, What what) {
    if (node.object.has_value()) {
      DSG_RETURN_IF_ERROR(CheckAssetKnown(node.object->model, what));
      if (node.object->model.has_value()) {
        DSG_RETURN_IF_ERROR(
            CheckPose(node.object->map_T_model, [&] { return "the model of " + what(); }));
      }
      const Eigen::Vector3d& size = node.object->size;
      if (!IsSane(size)) return NotFinite("size of " + what());
      DSG_RETURN_IF_ERROR(
          CheckNotNegative(size.minCoeff(), [&] { return "an edge length of " + what(); }));
    }
    if (node.agent.has_value()) {
      DSG_RETURN_IF_ERROR(CheckAssetKnown(node.agent->body_model, what));
      DSG_RETURN_IF_ERROR(
          CheckText(node.agent->track_state, 64, [&] { return "track state of " + what(); }));
      if (node.agent->gap_ns_max < 0) {
        return Invalid(absl::StrCat("gap_ns_max of ", what(), " is ", node.agent->gap_ns_max,
                                    "; give nanoseconds above 0, or 0 for the map's"));
      }
      if (node.agent->shape_coefficients.size() > 1024) {
        return Invalid("shape coefficients of " + what() + " are more than 1024");
      }
    }
    if (node.place.has_value()) {
      const double clearance_m = node.place->clearance_m;
      if (!std::isfinite(clearance_m)) return NotFinite("clearance of " + what());
      if (clearance_m < 0.0) {
        return Invalid(absl::StrCat("clearance of ", what(), " is ", clearance_m,
                                    " m; it is a distance, 0 or more"));
      }
      DSG_RETURN_IF_ERROR(CheckBox(node.place->free_box, what));
      DSG_RETURN_IF_ERROR(CheckNotNegative(node.place->basis_point_count,
                                           [&] { return "basis_point_count of " + what(); }));
    }
    if (node.structure.has_value()) {
      DSG_RETURN_IF_ERROR(CheckText(node.structure->structure_type, 64,
                                    [&] { return "structure type of " + what(); }));
      if (!IsSane(node.structure->plane_normal_map) ||
          !(std::abs(node.structure->plane_offset_m) <= kCoordinateMaxM)) {
        return NotFinite("the plane of " + what());
      }
    }
    return node.region.has_value() ? CheckRegion(*node.region, what) : absl::OkStatus();
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
    if (upserted) return Invalid(what() + " is both written and retired");
    DSG_ASSIGN_OR_RETURN(const auto facts, Find(item.id));
    if (facts == nullptr) {
      DSG_ASSIGN_OR_RETURN(ErrorMetadata missing, Missing());
      return Invalid(what() + " is to be retired but does not exist", std::move(missing));
    }
    if (item.valid_to_ns.has_value() && *item.valid_to_ns <= facts->valid.from_ns) {
      return Invalid(absl::StrCat(what(), " cannot leave the world at ", *item.valid_to_ns,
                                  ": it came at ", facts->valid.from_ns));
    }
    if (!item.valid_to_ns.has_value()) gone_.insert(item.id);
    return absl::OkStatus();
  }

  absl::StatusOr<const Facts*> FindEnd(NodeId id, What what) {
    DSG_ASSIGN_OR_RETURN(const auto facts, Find(id));
    if (facts == nullptr || gone_.contains(id)) {
      DSG_ASSIGN_OR_RETURN(ErrorMetadata missing, Missing());
      return Invalid(
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
      return Invalid(what() + " needs a relation of 1 to 64 characters");
    }
    DSG_RETURN_IF_ERROR(CheckText(edge.relation, 64, [] { return "a relation's name"; }));
    if (edge.source == edge.target) return Invalid(what() + " ends where it begins");
    if (!std::isfinite(edge.weight)) return NotFinite("weight of " + what());
    DSG_RETURN_IF_ERROR(CheckInterval(edge.valid, what));
    DSG_RETURN_IF_ERROR(CheckAttributes(edge.attributes, what));
    DSG_ASSIGN_OR_RETURN(const Facts* const source, FindEnd(edge.source, what));
    DSG_ASSIGN_OR_RETURN(const Facts* const target, FindEnd(edge.target, what));
    if (edge.relation != relations::kContains) return absl::OkStatus();
    return CheckContainment(*source, *target, what);
  }

  // Ranks grow strictly from child to parent, so containment cannot be circular.
  absl::Status CheckContainment(const Facts& parent, const Facts& child, What what) {
    DSG_ASSIGN_OR_RETURN(const Layer parent_layer, LayerById(parent.layer, what));
    DSG_ASSIGN_OR_RETURN(const Layer child_layer, LayerById(child.layer, what));
    if (parent_layer.rank <= child_layer.rank) {
      return Invalid(absl::StrCat(what(), ": parent layer \"", parent_layer.name, "\" of rank ",
                                  parent_layer.rank, " must outrank child layer \"",
                                  child_layer.name, "\" of rank ", child_layer.rank));
    }
    if (parent.box_map.isEmpty() || child.is_agent) return absl::OkStatus();
    const Box3d bound(parent.box_map.min().array() - kBoxToleranceM,
                      parent.box_map.max().array() + kBoxToleranceM);
    const Box3d inner = child.box_map.isEmpty() ? Box3d(child.position_map) : child.box_map;
    if (bound.contains(inner)) return absl::OkStatus();
    return Invalid(what() + ": the child's box sticks out of the parent's; grow the parent's box");
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

  absl::Status CheckStoredContainment(NodeId parent, NodeId child, What what) {
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

  absl::Status CheckAgent(NodeId id, What what) {
    DSG_ASSIGN_OR_RETURN(const Facts* const facts, FindEnd(id, what));
    if (facts->is_agent) return absl::OkStatus();
    return Invalid(absl::StrCat(what(), " needs a human or robot, and ", ToString(id), " is none"));
  }

  absl::Status CheckPoses(const std::vector<TimedPose>& poses, What what) {
    TimeNs last_ns = kTimeMin;
    for (const TimedPose& pose : poses) {
      if (pose.time_ns <= last_ns) {
        return Invalid(absl::StrCat("times of ", what(), " do not grow: ", pose.time_ns,
                                    " comes after ", last_ns));
      }
      last_ns = pose.time_ns;
      if (!IsSane(pose.map_T_agent.position) || !IsValidPose(pose.map_T_agent)) {
        return CheckPose(pose.map_T_agent,
                         [&] { return absl::StrCat(what(), " at ", pose.time_ns, " ns"); });
      }
      if (pose.covariance != nullptr &&
          !std::all_of(pose.covariance->begin(), pose.covariance->end(),
                       [](float number) { return std::isfinite(number); })) {
        return NotFinite(absl::StrCat("covariance of ", what(), " at ", pose.time_ns, " ns"));
      }
      if ((pose.flags & ~pose_flags::kAll) != 0) {
        return Invalid(absl::StrCat("unknown flags ", pose.flags, " in ", what()));
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckAppend(const TrajectoryAppend& item) {
    const auto what = [&] { return absl::StrCat("trajectory of ", ToString(item.agent)); };
    DSG_RETURN_IF_ERROR(CheckAgent(item.agent, what));
    DSG_RETURN_IF_ERROR(CheckPoses(item.poses, what));
    if (item.poses.empty()) return Invalid(what() + " is appended without poses");
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
    DSG_RETURN_IF_ERROR(CheckInterval({item.from_ns, item.to_ns}, what));
    DSG_RETURN_IF_ERROR(CheckPoses(item.poses, what));
    DSG_ASSIGN_OR_RETURN(const auto end_ns, graph_.FindTrackEnd(item.agent));
    if (!end_ns.has_value()) {
      return Invalid(what() + ": the agent has no poses to correct",
                     {{"correction_of", ToString(item.agent)}});
    }
    for (const TimedPose& pose : item.poses) {
      if (pose.time_ns < item.from_ns || pose.time_ns >= item.to_ns || pose.time_ns > *end_ns) {
        return Invalid(
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
    return CheckInterval({span.from_ns, span.to_ns}, what);
  }

  absl::Status CheckFactors(const FactorAppend& item) {
    const auto what = [&] { return absl::StrCat("factors of ", ToString(item.agent)); };
    DSG_RETURN_IF_ERROR(CheckAgent(item.agent, what));
    for (const PoseFactor& factor : item.factors) {
      if (factor.type.empty()) return Invalid(what() + " need a type");
      DSG_RETURN_IF_ERROR(CheckText(factor.type, 64, [&] { return "type of " + what(); }));
      DSG_RETURN_IF_ERROR(CheckPose(factor.relative_pose, what));
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
      if (shape.time_ns <= last_ns) return Invalid("times of " + what() + " do not grow");
      last_ns = shape.time_ns;
      const auto which = [&] { return absl::StrCat(what(), " at ", shape.time_ns, " ns"); };
      if (shape.vertices.size() % 3 != 0 || shape.joints.size() % 3 != 0) {
        return Invalid(which() + " have vertices or joints that are not in threes");
      }
      if (shape.vertices.size() > kShapeVertexNumbersMax ||
          shape.joints.size() > kShapeNumbersMax ||
          shape.pose_coefficients.size() > kShapeNumbersMax ||
          shape.shape_coefficients.size() > kShapeNumbersMax) {
        return Invalid(which() + " have too many numbers");
      }
      for (const auto* part :
           {&shape.pose_coefficients, &shape.shape_coefficients, &shape.vertices, &shape.joints}) {
        if (!AreSane(*part)) return NotFinite("a number of " + which());
      }
    }
    return absl::OkStatus();
  }

  absl::Status CheckStay(const Stay& stay) {
    const auto what = [&] {
      return absl::StrCat("stay of ", ToString(stay.agent), " from ", stay.enter_ns, " ns");
    };
    DSG_RETURN_IF_ERROR(CheckAgent(stay.agent, what));
    DSG_RETURN_IF_ERROR(CheckInterval({stay.enter_ns, stay.exit_ns}, what));
    if (stay.place.empty() && stay.room.empty()) return Invalid(what() + " is nowhere");
    for (const NodeId id : {stay.place, stay.room}) {
      if (!id.empty()) DSG_RETURN_IF_ERROR(FindEnd(id, what).status());
    }
    return absl::OkStatus();
  }

  static absl::Status CheckMesh(const MeshBlock& block) {
    const auto what = [&] {
      return absl::StrCat("mesh block ", block.index.x, ",", block.index.y, ",", block.index.z);
    };
    const size_t count = block.positions_map.size();
    if (count > kMeshVertexCountMax || block.faces.size() > 2 * kMeshVertexCountMax) {
      return Invalid(what() + " has too many vertices or faces");
    }
    const auto fits = [count](size_t size) { return size == 0 || size == count; };
    if (!fits(block.normals_map.size()) || !fits(block.colors.size()) ||
        !fits(block.labels.size()) || !fits(block.instance_ids.size()) ||
        !fits(block.first_seen_ns.size()) || !fits(block.last_seen_ns.size())) {
      return Invalid(what() + " has a channel that is not as long as its positions");
    }
    for (const auto& position : block.positions_map) {
      if (!IsSane(position.cast<double>())) return NotFinite("a vertex of " + what());
    }
    for (const auto& normal : block.normals_map) {
      if (!normal.allFinite()) return NotFinite("a normal of " + what());
    }
    for (const auto& face : block.faces) {
      if (*std::max_element(face.begin(), face.end()) >= count) {
        return Invalid(what() + " has a face with a vertex that does not exist");
      }
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

// Sorts by key and keeps the last of equal keys: what was said last is what is meant.
template <typename T, typename KeyOf>
void SortKeepLast(std::vector<T>* items, KeyOf key_of) {
  const auto less = [&](const T& a, const T& b) { return key_of(a) < key_of(b); };
  if (!std::is_sorted(items->begin(), items->end(), less)) {
    std::stable_sort(items->begin(), items->end(), less);
  }
  size_t kept = 0;
  for (size_t i = 0; i < items->size(); ++i) {
    const bool superseded = i + 1 < items->size() && !less((*items)[i], (*items)[i + 1]);
    if (superseded) continue;
    if (kept != i) (*items)[kept] = std::move((*items)[i]);
    ++kept;
  }
  items->erase(items->begin() + static_cast<std::ptrdiff_t>(kept), items->end());
}

// Joins what is appended to one agent, in the order given.
template <typename T, typename Payload>
void MergeByAgent(std::vector<T>* items, Payload T::*payload) {
  std::stable_sort(items->begin(), items->end(),
                   [](const T& a, const T& b) { return a.agent < b.agent; });
  std::vector<T> merged;
  for (T& item : *items) {
    if (merged.empty() || merged.back().agent != item.agent) {
      merged.push_back(std::move(item));
      continue;
    }
    auto& into = merged.back().*payload;
    auto& from = item.*payload;
    into.insert(into.end(), std::make_move_iterator(from.begin()),
                std::make_move_iterator(from.end()));
  }
  *items = std::move(merged);
}

// Joins what is appended to one agent on one topology. Of two shapes of one time the later said
// stands, as between revisions: an estimate and its correction may come in one delta.
void MergeShapes(std::vector<ShapeAppend>* items) {
  const auto key = [](const ShapeAppend& item) { return std::tie(item.agent, item.topology); };
  std::stable_sort(items->begin(), items->end(),
                   [&](const auto& a, const auto& b) { return key(a) < key(b); });
  std::vector<ShapeAppend> merged;
  for (ShapeAppend& item : *items) {
    if (merged.empty() || key(merged.back()) != key(item)) {
      merged.push_back(std::move(item));
      continue;
    }
    std::vector<BodyShape>& into = merged.back().shapes;
    std::move(item.shapes.begin(), item.shapes.end(), std::back_inserter(into));
    SortKeepLast(&into, [](const BodyShape& shape) { return shape.time_ns; });
  }
  *items = std::move(merged);
}

}  // namespace

absl::Status CheckDelta(const GraphDelta& delta, const GraphLookup& graph) {
  return DeltaChecker(delta, graph).Check();
}

void Coalesce(GraphDelta* delta) {
  SortKeepLast(&delta->layers, [](const Layer& layer) { return layer.id; });
  SortKeepLast(&delta->labels, [](const SemanticLabel& label) { return label.id; });
  SortKeepLast(&delta->nodes, [](const Node& node) { return node.id; });
  SortKeepLast(&delta->retirements, [](const Retirement& item) { return item.id; });
  const auto edge_key = [](const Edge& edge) {
    return std::tie(edge.source, edge.relation, edge.target);
  };
  SortKeepLast(&delta->edges, edge_key);
  SortKeepLast(&delta->edge_removals, [](const EdgeKey& key) { return key; });
  if (!delta->edge_removals.empty()) {
    std::erase_if(delta->edges, [&](const Edge& edge) {
      return std::binary_search(delta->edge_removals.begin(), delta->edge_removals.end(),
                                edge.key());
    });
  }
  MergeByAgent(&delta->appends, &TrajectoryAppend::poses);
  MergeByAgent(&delta->factors, &FactorAppend::factors);
  MergeShapes(&delta->shapes);
  SortKeepLast(&delta->corrections, [](const TrajectoryCorrection& item) {
    return std::make_tuple(item.agent, item.from_ns);
  });
  const auto span_key = [](const TrackSpan& span) {
    return std::make_tuple(span.agent, span.from_ns, span.to_ns);
  };
  SortKeepLast(&delta->factor_removals, span_key);
  SortKeepLast(&delta->shape_removals, span_key);
  SortKeepLast(&delta->stay_removals, [](const StayKey& key) { return key; });
  SortKeepLast(&delta->stays,
               [](const Stay& stay) { return std::make_tuple(stay.agent, stay.enter_ns); });
  SortKeepLast(&delta->mesh_blocks, [](const MeshBlock& block) { return block.index; });
  SortKeepLast(&delta->mesh_removals, [](const BlockIndex& index) { return index; });
  SortKeepLast(&delta->assets, [](const Asset& asset) { return asset.sha256; });
}

}  // namespace dsg
