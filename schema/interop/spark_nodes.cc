// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_nodes.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_join.h"
#include "schema/base/counted.h"
#include "schema/model/delta_check.h"
#include "schema/model/value_check.h"

namespace dsg {
namespace {

// Nodes are updated a little after the last pose was taken.
constexpr TimeNs kUpdateDelayMaxNs = 10 * kNsPerSecond;
// Without poses to compare with: 2100-01-01, later is no time that anybody has recorded.
constexpr TimeNs kPlausibleEndNs = 4'102'444'800 * kNsPerSecond;
constexpr size_t kBoundaryCornersMax = 65536;
// The peer keeps boxes in single precision.
constexpr double kBoxSlackM = 1e-3;

Interval PlausibleTimes(const SparkGraph& graph) {
  Interval times = {kTimeMax, kTimeMin};
  for (const SparkNode& node : graph.nodes) {
    if (node.type != SparkClass::kAgent || !node.stamp_ns.has_value()) continue;
    times.from_ns = std::min(times.from_ns, *node.stamp_ns);
    times.to_ns = std::max(times.to_ns, *node.stamp_ns);
  }
  if (times.from_ns > times.to_ns) return {1, kPlausibleEndNs};
  times.to_ns = std::min(times.to_ns, kTimeMax - kUpdateDelayMaxNs) + kUpdateDelayMaxNs;
  return times;
}

Polygon2d OutlineOf(const Box3d& box) {
  return {{box.min().x(), box.min().y()},
          {box.max().x(), box.min().y()},
          {box.max().x(), box.max().y()},
          {box.min().x(), box.max().y()}};
}

RegionInfo RegionOfBoundary(const std::vector<Eigen::Vector3d>& boundary) {
  RegionInfo region;
  Box3d bounds;
  for (const Eigen::Vector3d& corner : boundary) {
    region.footprint_map.emplace_back(corner.x(), corner.y());
    bounds.extend(corner);
  }
  region.z_min_m = bounds.min().z();
  region.z_max_m = bounds.max().z();
  return region;
}

std::string ColorText(const Color& color) {
  return absl::StrFormat("#%02x%02x%02x%02x", color[0], color[1], color[2], color[3]);
}

// Khronos: the n-th presence lasts from the n-th first to the n-th last observation.
std::string PresenceText(const SparkNode& in) {
  std::vector<std::string> spans;
  const size_t count = std::min(in.first_observed_ns.size(), in.last_observed_ns.size());
  for (size_t i = 0; i < count; ++i) {
    spans.push_back(absl::StrCat(in.first_observed_ns[i], "-", in.last_observed_ns[i]));
  }
  return absl::StrJoin(spans, " ");
}

bool IsIdentity(const Eigen::Quaterniond& q) {
  return q.coeffs() == Eigen::Quaterniond::Identity().coeffs();
}

SparkBox BoxOf(const Node& node) {
  SparkBox box;
  if (node.box_node.isEmpty()) return box;
  const Pose3d& pose = node.map_T_node;
  box.type = IsIdentity(pose.orientation) ? SparkBox::Type::kAligned : SparkBox::Type::kOriented;
  box.dimensions = node.box_node.sizes().cast<float>();
  box.center = (pose * node.box_node.center()).cast<float>();
  if (box.type == SparkBox::Type::kOriented) {
    box.rotation = pose.orientation.toRotationMatrix().cast<float>();
  }
  return box;
}

// "#rrggbbaa", as imports write it.
std::optional<Color> ColorFromText(const Attributes& attributes) {
  const auto* text = FindAttribute<std::string>(attributes, "color");
  if (text == nullptr || text->size() != 9 || text->front() != '#') return std::nullopt;
  Color color;
  for (size_t i = 0; i < 4; ++i) {
    const char* const begin = text->data() + 1 + 2 * i;
    const auto [end, error] = std::from_chars(begin, begin + 2, color[i], 16);
    if (error != std::errc() || end != begin + 2) return std::nullopt;
  }
  return color;
}

void AddPresence(const Node& node, SparkNode* out) {
  const bool has_begin = node.valid.from_ns != kTimeMin;
  const bool has_end = node.valid.to_ns != kTimeMax;
  const TimeNs first_ns = has_begin ? node.valid.from_ns : node.first_observed_ns.value_or(0);
  const TimeNs last_ns = has_end ? node.valid.to_ns : node.last_observed_ns.value_or(first_ns);
  out->first_observed_ns = {SparkStampOf(first_ns)};
  out->last_observed_ns = {SparkStampOf(std::max(first_ns, last_ns))};
}

}  // namespace

SparkNodeConverter::SparkNodeConverter(const SparkGraph& graph, Skips* skips)
    : graph_(graph), skips_(*skips), plausible_(PlausibleTimes(graph)) {}

void SparkNodeConverter::SkipField(const SparkNode& in, const std::string& what) {
  skips_.Add(SkipKind::kNodeField, absl::StrCat("node ", ToString(NodeId(in.id))), what);
}

std::optional<Node> SparkNodeConverter::Convert(const SparkNode& in,
                                                const SparkPlacement& placement) {
  Node out;
  out.id = NodeId(in.id);
  if (!out.id.IsValid()) {
    skips_.Add(SkipKind::kNode, absl::StrCat("node id ", in.id),
               "has no letter in its top 8 bits; ids are a letter and an index, as O42");
    return std::nullopt;
  }
  if (!values::IsSane(in.position)) {
    skips_.Add(SkipKind::kNode, absl::StrCat("node ", ToString(out.id)),
               absl::StrCat("position (", in.position.x(), ", ", in.position.y(), ", ",
                            in.position.z(), ") is not finite or beyond ", kCoordinateMaxM, " m"));
    return std::nullopt;
  }
  out.layer = placement.layer.id;
  out.kind = placement.kind;
  out.provenance = in.is_predicted ? Provenance::kPredicted : Provenance::kImported;
  ConvertPose(in, &out);
  ConvertBox(in, &out);
  ConvertClass(in, &out);
  ConvertTimes(in, &out);
  ConvertComponents(in, &out);
  ConvertAttributes(in, &out);
  return out;
}

void SparkNodeConverter::ConvertPose(const SparkNode& in, Node* out) {
  out->map_T_node.position = in.position;
  const double norm = in.orientation.norm();
  if (std::isfinite(norm) && norm > 1e-6) {
    out->map_T_node.orientation = in.orientation.normalized();
  } else {
    ++left_out_["orientations that are no rotation"];
  }
}

void SparkNodeConverter::ConvertBox(const SparkNode& in, Node* out) {
  if (in.box.type == SparkBox::Type::kInvalid) return;
  const Eigen::Vector3d center = in.box.center.cast<double>();
  const Eigen::Vector3d half = 0.5 * in.box.dimensions.cast<double>();
  const bool is_rotated = in.box.type != SparkBox::Type::kAligned;
  const std::string insane = absl::StrCat("bounding_box has numbers that are not finite or beyond ",
                                          kCoordinateMaxM, " m");
  if (!values::IsSane(center) || !values::IsSane(half) ||
      (is_rotated && !in.box.rotation.allFinite())) {
    return SkipField(in, insane);
  }
  if (half.minCoeff() < 0.0) {
    ++left_out_["boxes of negative size"];
    return;
  }
  Pose3d map_T_box = {center, Eigen::Quaterniond::Identity()};
  if (is_rotated) {
    map_T_box.orientation = Eigen::Quaterniond(in.box.rotation.cast<double>());
    if (!(map_T_box.orientation.norm() > 1e-6)) {
      return SkipField(in, "bounding_box has no rotation");
    }
    map_T_box.orientation.normalize();
  }
  const Box3d box = TransformBox(out->map_T_node.Inverse() * map_T_box, Box3d(-half, half));
  if (!values::IsSane(box.min()) || !values::IsSane(box.max())) return SkipField(in, insane);
  // An object's box is measured from its points. Elsewhere boxes are often left at a default
  // around the origin, which would blow up every ancestor's box.
  const Eigen::Vector3d slack = Eigen::Vector3d::Constant(kBoxSlackM);
  const bool is_object = out->kind == kinds::kObject;
  if (!is_object &&
      !Box3d(box.min() - slack, box.max() + slack).contains(Eigen::Vector3d(0, 0, 0))) {
    ++left_out_["boxes that do not hold their own node"];
    return;
  }
  out->box_node = box;
}

void SparkNodeConverter::ConvertClass(const SparkNode& in, Node* out) {
  if (in.name.size() > kNameLengthMax) {
    SkipField(in, absl::StrCat("name has ", in.name.size(), " bytes; at most ", kNameLengthMax,
                               " are kept"));
  } else {
    out->name = in.name;
  }
  if (!in.label.has_value()) return;
  if (*in.label > uint32_t{INT32_MAX}) {
    return SkipField(in, absl::StrCat("semantic_label is ", *in.label, "; at most 2147483647"));
  }
  out->class_id = static_cast<int32_t>(*in.label);
  const auto space = graph_.label_spaces.find(in.key);
  if (space != graph_.label_spaces.end()) {
    const auto label = std::find_if(space->second.begin(), space->second.end(),
                                    [&](const auto& item) { return item.id == out->class_id; });
    if (label != space->second.end()) out->class_name = label->name;
  }
  if (out->class_name.empty() && out->kind == kinds::kObject) ++unnamed_class_count_;
}

void SparkNodeConverter::ConvertTimes(const SparkNode& in, Node* out) {
  if (in.type == SparkClass::kAgent) {
    // The instant of the pose, whatever clock it is of.
    out->first_observed_ns = in.stamp_ns;
    out->last_observed_ns = in.stamp_ns;
    return;
  }
  const auto keep = [this](uint64_t time, bool earliest, std::optional<TimeNs>* kept) {
    if (time == 0) return;
    const bool is_time = time <= static_cast<uint64_t>(kTimeMax) &&
                         static_cast<TimeNs>(time) >= plausible_.from_ns &&
                         static_cast<TimeNs>(time) <= plausible_.to_ns;
    if (!is_time) {
      ++left_out_["update times outside the time of the poses or of this century"];
      return;
    }
    const auto time_ns = static_cast<TimeNs>(time);
    if (!kept->has_value() || (earliest ? time_ns < **kept : time_ns > **kept)) *kept = time_ns;
  };
  keep(in.last_update_ns, false, &out->last_observed_ns);
  for (const uint64_t time : in.first_observed_ns) keep(time, true, &out->first_observed_ns);
  for (const uint64_t time : in.last_observed_ns) keep(time, false, &out->last_observed_ns);
}

double SparkNodeConverter::DistanceOf(const SparkNode& in) {
  if (std::isfinite(in.distance) && in.distance >= 0.0) return in.distance;
  SkipField(in, absl::StrCat("distance ", in.distance, " is not 0 or more"));
  return 0.0;
}

std::vector<Eigen::Vector3d> SparkNodeConverter::BoundaryOf(const SparkNode& in) {
  if (in.boundary.size() > kBoundaryCornersMax) {
    SkipField(in, absl::StrCat("boundary has ", in.boundary.size(), " corners; at most ",
                               kBoundaryCornersMax));
    return {};
  }
  if (std::all_of(in.boundary.begin(), in.boundary.end(), values::IsSane)) return in.boundary;
  SkipField(in, absl::StrCat("boundary has a corner not finite or beyond ", kCoordinateMaxM, " m"));
  return {};
}

RegionInfo SparkNodeConverter::RegionOf(const SparkNode& in,
                                        const std::vector<Eigen::Vector3d>& boundary,
                                        const Node& out) {
  RegionInfo region;
  if (!out.box_node.isEmpty()) {
    const Box3d box_map = out.BoxMap();
    region = {OutlineOf(box_map), box_map.min().z(), box_map.max().z(), {}};
  } else if (!boundary.empty()) {
    region = RegionOfBoundary(boundary);
  }
  for (const auto& [name, probability] : in.class_probabilities) {
    if (std::isfinite(probability) && name.size() <= kNameLengthMax) {
      region.class_probabilities[name] = probability;
    } else {
      SkipField(in, absl::StrCat("probability of class \"", name.substr(0, 64),
                                 "\" is not finite, or the name too long"));
    }
  }
  return region;
}

void SparkNodeConverter::ConvertComponents(const SparkNode& in, Node* out) {
  const double distance = DistanceOf(in);
  const std::vector<Eigen::Vector3d> boundary = BoundaryOf(in);
  if (out->kind == kinds::kObject) {
    ObjectInfo object;
    if (in.color != kSparkNoColor) object.color = in.color;
    if (!out->box_node.isEmpty()) object.size = in.box.dimensions.cast<double>();
    out->object = object;
  } else if (out->kind == kinds::kPlace) {
    out->place =
        PlaceInfo{distance, out->box_node,
                  static_cast<int32_t>(std::min<uint32_t>(in.basis_point_count, INT32_MAX))};
    if (!boundary.empty()) out->region = RegionOfBoundary(boundary);
  } else if (out->kind != kAgentPoseKind) {
    out->region = RegionOf(in, boundary, *out);
  }
  if (!out->place.has_value() && distance != 0.0) out->attributes["distance"] = distance;
}

void SparkNodeConverter::ConvertAttributes(const SparkNode& in, Node* out) {
  for (const auto& [name, value] : in.attributes) out->attributes[name] = value;
  if (in.color.has_value() && in.color != kSparkNoColor && !out->object.has_value()) {
    out->attributes["color"] = ColorText(*in.color);
  }
  if (in.type == SparkClass::kKhronosObject && !in.first_observed_ns.empty()) {
    out->attributes["presence_ns"] = PresenceText(in);
  }
  std::erase_if(out->attributes, [this](const auto& item) {
    const auto* text = std::get_if<std::string>(&item.second);
    const bool is_long = text != nullptr && text->size() > kAttributeLengthMax;
    if (is_long) ++left_out_[absl::StrCat("texts \"", item.first, "\" longer than 64 KiB")];
    return is_long;
  });
}

std::vector<std::string> SparkNodeConverter::notes() const {
  std::vector<std::string> notes;
  for (const auto& [reason, count] : left_out_) {
    notes.push_back(absl::StrCat("left out: ", count, " ", reason));
  }
  if (unnamed_class_count_ > 0) {
    notes.push_back(absl::StrCat("the file has no names for the labels of ",
                                 Counted(unnamed_class_count_, "object"),
                                 ": no question by class finds them"));
  }
  return notes;
}

SparkClass ClassFor(const Node& node) {
  if (node.kind == kAgentPoseKind) return SparkClass::kAgent;
  if (IsAgentKind(node.kind)) return SparkClass::kKhronosObject;
  if (node.kind == kinds::kObject) {
    const bool is_lasting = node.valid.from_ns == kTimeMin && node.valid.to_ns == kTimeMax;
    return is_lasting ? SparkClass::kObject : SparkClass::kKhronosObject;
  }
  if (node.kind == kinds::kPlace) return SparkClass::kPlace;
  if (node.kind == kinds::kRoom) return SparkClass::kRoom;
  return SparkClass::kSemantic;
}

SparkNode ToSpark(const Node& node, SparkClass type, SparkLayerKey key) {
  SparkNode out;
  out.id = node.id.value;
  out.key = key;
  out.type = type;
  out.position = node.map_T_node.position;
  out.orientation = node.map_T_node.orientation;
  out.is_predicted = node.provenance == Provenance::kPredicted;
  out.attributes = node.attributes;
  if (type == SparkClass::kAgent) {
    out.stamp_ns = node.first_observed_ns;
    return out;
  }
  out.last_update_ns = SparkStampOf(node.last_observed_ns.value_or(0));
  out.name = node.name;
  out.color = node.object.has_value() && node.object->color.has_value()
                  ? node.object->color
                  : ColorFromText(node.attributes);
  out.box = BoxOf(node);
  if (node.class_id >= 0) out.label = static_cast<uint32_t>(node.class_id);
  if (node.place.has_value()) {
    out.distance = node.place->clearance_m;
    out.basis_point_count = static_cast<uint32_t>(std::max(0, node.place->basis_point_count));
  } else if (const auto* distance = FindAttribute<double>(node.attributes, "distance")) {
    out.distance = *distance;
  }
  if (node.region.has_value()) out.class_probabilities = node.region->class_probabilities;
  if (type == SparkClass::kKhronosObject || type == SparkClass::kTraversability) {
    AddPresence(node, &out);
  }
  return out;
}

}  // namespace dsg
