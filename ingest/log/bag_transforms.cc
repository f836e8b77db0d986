// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_transforms.h"

#include <algorithm>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/ros_messages.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr char kStaticTopic[] = "/tf_static";
constexpr char kTopic[] = "/tf";
constexpr const char* kBodyFrames[] = {"base_link_gt", "base_link", "imu", "imu0",
                                       "base_footprint"};
// A humanoid has a few hundred.
constexpr size_t kFramesMax = 10'000;
// Chains of frames in a robot are short; a circle would not end.
constexpr size_t kChainMax = 64;

std::string WithoutSlash(const std::string& frame) {
  return frame.starts_with('/') ? frame.substr(1) : frame;
}

std::string Shown(const std::string& frame) {
  return absl::StrCat("\"", absl::Utf8SafeCHexEscape(frame.substr(0, 64)), "\"");
}

bool IsSame(const Pose3d& a, const Pose3d& b) {
  return a.position == b.position && a.orientation.coeffs() == b.orientation.coeffs();
}

// A frame over time.
struct StampedPoses {
  std::vector<TimeNs> times;
  std::vector<Pose3d> poses;
};

// Between the neighbours; before the first and after the last it stands.
Pose3d PoseAt(const StampedPoses& track, TimeNs time_ns) {
  const auto next = std::lower_bound(track.times.begin(), track.times.end(), time_ns);
  const auto index = static_cast<size_t>(next - track.times.begin());
  if (next == track.times.end()) return track.poses.back();
  if (index == 0 || *next == time_ns) return track.poses[index];
  const double share = static_cast<double>(time_ns - track.times[index - 1]) /
                       static_cast<double>(track.times[index] - track.times[index - 1]);
  const Pose3d& a = track.poses[index - 1];
  const Pose3d& b = track.poses[index];
  Pose3d pose;
  pose.position = a.position + share * (b.position - a.position);
  pose.orientation = a.orientation.slerp(share, b.orientation).normalized();
  return pose;
}

bool IsTransforms(const BagConnection& connection, std::string_view topic) {
  return connection.topic == topic &&
         (connection.type == "tf2_msgs/TFMessage" || connection.type == "tf/tfMessage");
}

// Calls visit(transform, origin) on each transform of a topic.
template <typename Visit>
absl::Status ForEachTransform(const Bag& bag, const std::string& topic, const Visit& visit) {
  int64_t number = 0;
  for (const BagMessageRef& ref : bag.messages()) {
    if (!IsTransforms(bag.connections()[ref.connection], topic)) continue;
    const std::string origin = BagOrigin(bag, topic, ++number);
    DSG_ASSIGN_OR_RETURN(const BagMessage message, bag.Read(ref));
    DSG_ASSIGN_OR_RETURN(const std::vector<RosPose> transforms,
                         ParseRosTransforms(message.data, origin));
    for (const RosPose& transform : transforms) {
      DSG_RETURN_IF_ERROR(visit(transform, origin));
    }
  }
  return absl::OkStatus();
}

}  // namespace

bool HasMovingTransforms(const Bag& bag) {
  return std::any_of(bag.connections().begin(), bag.connections().end(),
                     [](const BagConnection& connection) {
                       return IsTransforms(connection, kTopic) && connection.message_count > 0;
                     });
}

absl::StatusOr<TransformTree> TransformTree::Read(const Bag& bag, bool with_moving) {
  TransformTree tree;
  tree.path_ = bag.path();
  DSG_RETURN_IF_ERROR(
      ForEachTransform(bag, kStaticTopic, [&](const RosPose& transform, const std::string& origin) {
        return tree.Add(transform, /*is_static=*/true, origin);
      }));
  if (!with_moving) return tree;
  DSG_RETURN_IF_ERROR(
      ForEachTransform(bag, kTopic, [&](const RosPose& transform, const std::string& origin) {
        return tree.Add(transform, /*is_static=*/false, origin);
      }));
  return tree;
}

absl::Status TransformTree::Add(const RosPose& transform, bool is_static,
                                const std::string& origin) {
  const absl::StatusOr<Pose3d> parent_T_child = transform.ToPose(origin);
  if (!parent_T_child.ok()) return is_static ? parent_T_child.status() : absl::OkStatus();
  const std::string parent = WithoutSlash(transform.header.frame_id);
  const auto [entry, is_new] = edges_.try_emplace(WithoutSlash(transform.child_frame_id));
  Edge& edge = entry->second;
  if (is_new) {
    if (edges_.size() > kFramesMax) {
      return MalformedFile(
          origin, absl::StrCat("the bag has transforms of more than ", kFramesMax, " frames"));
    }
    edge = {.parent = parent,
            .other_parent = "",
            .parent_T_child = *parent_T_child,
            .is_dynamic = !is_static};
    return absl::OkStatus();
  }
  if (is_static) {
    edge = {.parent = parent, .other_parent = "", .parent_T_child = *parent_T_child};
    return absl::OkStatus();
  }
  edge.is_dynamic = true;
  if (edge.parent != parent) edge.other_parent = parent;
  if (!IsSame(edge.parent_T_child, *parent_T_child)) edge.is_moving = true;
  return absl::OkStatus();
}

std::optional<Pose3d> TransformTree::BodyTFrame(const std::string& frame) const {
  std::string name = WithoutSlash(frame);
  Pose3d name_T_frame;
  for (size_t i = 0; i < kChainMax; ++i) {
    if (std::find(std::begin(kBodyFrames), std::end(kBodyFrames), name) != std::end(kBodyFrames)) {
      return name_T_frame;
    }
    const auto found = edges_.find(name);
    if (found == edges_.end() || found->second.is_moving) return std::nullopt;
    name_T_frame = found->second.parent_T_child * name_T_frame;
    name = found->second.parent;
  }
  return std::nullopt;
}

bool TransformTree::Has(bool Edge::*flag, const std::string& frame) const {
  std::string name = frame;
  for (size_t i = 0; i < kChainMax; ++i) {
    const auto found = edges_.find(name);
    if (found == edges_.end()) return false;
    if (found->second.*flag) return true;
    name = found->second.parent;
  }
  return false;
}

std::string TransformTree::FindBody() const {
  for (const char* const name : kBodyFrames) {
    if (Has(&Edge::is_moving, name)) return name;
  }
  std::string only;
  for (const auto& [child, edge] : edges_) {
    if (edge.is_moving) only = only.empty() ? child : "/";
  }
  if (!only.empty() && only != "/") return only;
  for (const char* const name : kBodyFrames) {
    if (Has(&Edge::is_dynamic, name)) return name;
  }
  return "";
}

absl::StatusOr<std::vector<std::string>> TransformTree::BodyChain() const {
  const std::string body = FindBody();
  std::vector<std::string> chain;
  if (body.empty()) return chain;
  for (std::string name = body;;) {
    const bool is_circle = std::find(chain.begin(), chain.end(), name) != chain.end();
    chain.push_back(name);
    if (is_circle || chain.size() > kChainMax) {
      std::vector<std::string> shown;
      for (const std::string& frame : chain) shown.push_back(Shown(frame));
      return MalformedFile(
          path_, absl::StrCat("the transforms of /tf run in a circle: ",
                              absl::StrJoin(shown, " in "), "; correct their publishers"));
    }
    const auto found = edges_.find(name);
    if (found == edges_.end()) return chain;
    const Edge& edge = found->second;
    if (!edge.other_parent.empty()) {
      return MalformedFile(
          path_,
          absl::StrCat("frame ", Shown(name), " of /tf is now in ", Shown(edge.parent), ", now in ",
                       Shown(edge.other_parent), "; a frame has one parent: filter the bag"));
    }
    name = edge.parent;
  }
}

absl::StatusOr<std::optional<TrackTable>> TransformTree::ReadPoses(
    const Bag& bag, const std::string& robot_name, std::vector<std::string>* notes) const {
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> chain, BodyChain());
  if (chain.empty()) return std::nullopt;
  const auto flag = Has(&Edge::is_moving, chain.front()) ? &Edge::is_moving : &Edge::is_dynamic;
  std::map<std::string, StampedPoses> moving;
  for (const std::string& frame : chain) {
    const auto found = edges_.find(frame);
    if (found != edges_.end() && found->second.*flag) moving[frame];
  }
  int64_t skipped_count = 0;
  DSG_RETURN_IF_ERROR(
      ForEachTransform(bag, kTopic, [&](const RosPose& transform, const std::string& origin) {
        const auto found = moving.find(WithoutSlash(transform.child_frame_id));
        if (found == moving.end()) return absl::OkStatus();
        StampedPoses& track = found->second;
        const absl::StatusOr<Pose3d> pose = transform.ToPose(origin);
        const TimeNs time_ns = transform.header.stamp_ns;
        if (!pose.ok() || (!track.times.empty() && time_ns <= track.times.back())) {
          const bool is_repeat =
              pose.ok() && time_ns == track.times.back() && IsSame(*pose, track.poses.back());
          skipped_count += is_repeat ? 0 : 1;
          return absl::OkStatus();
        }
        track.times.push_back(time_ns);
        track.poses.push_back(*pose);
        return absl::OkStatus();
      }));
  TrackTable table;
  table.file = absl::StrCat("/tf, frame ", Shown(chain.front()), " in ", Shown(chain.back()));
  const int32_t agent = table.FindOrAdd(robot_name, kinds::kRobot);
  const auto lowest = std::find_if(
      chain.begin(), chain.end(), [&](const std::string& frame) { return moving.contains(frame); });
  if (lowest == chain.end()) return std::nullopt;
  for (const TimeNs time_ns : moving[*lowest].times) {
    Pose3d root_T_body;
    for (const std::string& frame : chain) {
      const auto edge = edges_.find(frame);
      if (edge == edges_.end()) continue;
      const auto track = moving.find(frame);
      const Pose3d parent_T_frame =
          track == moving.end() ? edge->second.parent_T_child : PoseAt(track->second, time_ns);
      root_T_body = parent_T_frame * root_T_body;
    }
    root_T_body.orientation.normalize();
    table.rows.push_back({.time_ns = time_ns,
                          .line = static_cast<int64_t>(table.rows.size()) + 1,
                          .agent = agent,
                          .flags = 0,
                          .map_T_agent = root_T_body});
  }
  if (skipped_count > 0) {
    notes->push_back(absl::StrCat(skipped_count,
                                  " transforms of /tf are no pose, or have a stamp that is not "
                                  "after the one before, and were passed over"));
  }
  return table;
}

}  // namespace dsg::ingest
