// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_transforms.h"

#include <algorithm>
#include <iterator>
#include <utility>

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

bool IsTransforms(const BagConnection& connection, std::string_view topic) {
  return connection.topic == topic &&
         (connection.type == "tf2_msgs/TFMessage" || connection.type == "tf/tfMessage");
}

// Calls visit(transform, origin) on each transform of a topic.
template <typename Visit>
absl::Status ForEachTransform(const Bag& bag, const std::string& topic, const PassCallback& on_read,
                              const Visit& visit) {
  int64_t number = 0;
  int64_t done = 0;
  for (const BagMessageRef& ref : bag.messages()) {
    if (on_read) on_read(++done, std::ssize(bag.messages()));
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

bool IsMovingTransforms(const BagConnection& connection) {
  return IsTransforms(connection, kTopic);
}

bool HasMovingTransforms(const Bag& bag) {
  return std::any_of(bag.connections().begin(), bag.connections().end(),
                     [](const BagConnection& connection) {
                       return IsMovingTransforms(connection) && connection.message_count > 0;
                     });
}

absl::StatusOr<TransformTree> TransformTree::Read(const Bag& bag, bool with_moving,
                                                  const PassCallback& on_read) {
  TransformTree tree;
  tree.path_ = bag.path();
  DSG_RETURN_IF_ERROR(ForEachTransform(bag, kStaticTopic, on_read,
                                       [&](const RosPose& transform, const std::string& origin) {
                                         return tree.Add(transform, /*is_static=*/true, origin);
                                       }));
  if (!with_moving) return tree;
  DSG_RETURN_IF_ERROR(ForEachTransform(bag, kTopic, on_read,
                                       [&](const RosPose& transform, const std::string& origin) {
                                         return tree.Add(transform, /*is_static=*/false, origin);
                                       }));
  return tree;
}

absl::Status TransformTree::Add(const RosPose& transform, bool is_static,
                                const std::string& origin) {
  const absl::StatusOr<Pose3d> parent_T_child = transform.ToPose(origin);
  if (!parent_T_child.ok()) return is_static ? parent_T_child.status() : absl::OkStatus();
  const std::string parent = FrameName(transform.header.frame_id);
  const auto [entry, is_new] = edges_.try_emplace(FrameName(transform.child_frame_id));
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
  edge.is_repeated = edge.is_dynamic;
  edge.is_dynamic = true;
  if (edge.parent != parent) edge.other_parent = parent;
  if (!IsSamePose(edge.parent_T_child, *parent_T_child)) edge.is_moving = true;
  return absl::OkStatus();
}

std::optional<Pose3d> TransformTree::BodyTFrame(const std::string& frame) const {
  std::string name = FrameName(frame);
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
  return body.empty() ? std::vector<std::string>() : ChainFrom(body);
}

absl::StatusOr<std::vector<std::string>> TransformTree::ChainFrom(const std::string& body) const {
  std::vector<std::string> chain;
  for (std::string name = body;;) {
    const bool is_circle = std::find(chain.begin(), chain.end(), name) != chain.end();
    chain.push_back(name);
    if (is_circle || chain.size() > kChainMax) {
      std::vector<std::string> shown;
      for (const std::string& frame : chain) shown.push_back(ShownFrame(frame));
      return MalformedFile(
          path_, absl::StrCat("the transforms of /tf run in a circle: ",
                              absl::StrJoin(shown, " in "), "; correct their publishers"));
    }
    const auto found = edges_.find(name);
    if (found == edges_.end()) return chain;
    const Edge& edge = found->second;
    if (!edge.other_parent.empty()) {
      return MalformedFile(
          path_, absl::StrCat("frame ", ShownFrame(name), " of /tf is now in ",
                              ShownFrame(edge.parent), ", now in ", ShownFrame(edge.other_parent),
                              "; a frame has one parent: filter the bag"));
    }
    name = edge.parent;
  }
}

absl::StatusOr<std::optional<BodyTrack>> TransformTree::MakeTrack(Tracks tracks,
                                                                  size_t waiting_max) const {
  DSG_ASSIGN_OR_RETURN(const std::vector<std::string> names, BodyChain());
  if (names.empty()) return std::nullopt;
  const auto flag = Has(&Edge::is_moving, names.front()) ? &Edge::is_moving : &Edge::is_dynamic;
  const auto has_track = tracks == Tracks::kMoving ? flag : &Edge::is_dynamic;
  std::vector<ChainFrame> chain;
  std::optional<size_t> driver;
  for (const std::string& name : names) {
    const auto found = edges_.find(name);
    if (found == edges_.end()) {
      chain.push_back({.name = name, .parent = "", .parent_T_frame = {}});
      continue;
    }
    const Edge& edge = found->second;
    if (!driver.has_value() && edge.*flag) driver = chain.size();
    chain.push_back({.name = name,
                     .parent = edge.parent,
                     .parent_T_frame = edge.parent_T_child,
                     .has_track = edge.*has_track,
                     .is_repeated = edge.is_repeated && edge.*has_track});
  }
  if (!driver.has_value()) return std::nullopt;
  return BodyTrack(std::move(chain), *driver, waiting_max);
}

absl::StatusOr<std::optional<TrackTable>> TransformTree::ReadPoses(
    const Bag& bag, const std::string& robot_name, std::vector<std::string>* notes,
    const PassCallback& on_read) const {
  DSG_ASSIGN_OR_RETURN(std::optional<BodyTrack> track, MakeTrack(Tracks::kMoving));
  if (!track.has_value()) return std::nullopt;
  DSG_RETURN_IF_ERROR(ForEachTransform(bag, kTopic, on_read,
                                       [&](const RosPose& transform, const std::string& origin) {
                                         return track->Add(transform, origin);
                                       }));
  TrackTable table;
  table.file = track->Name();
  const int32_t agent = table.FindOrAdd(robot_name, kinds::kRobot);
  while (const std::optional<BodyPose> pose = track->NextAtEnd()) {
    table.rows.push_back({.time_ns = pose->time_ns,
                          .line = std::ssize(table.rows) + 1,
                          .agent = agent,
                          .flags = 0,
                          .map_T_agent = pose->root_T_body});
  }
  NotePassedOver(track->passed_over_count(), notes);
  return table;
}

void NotePassedOver(int64_t count, std::vector<std::string>* notes) {
  if (count == 0) return;
  notes->push_back(absl::StrCat(count,
                                " transforms of /tf are no pose, or have a stamp that is not "
                                "after the one before, and were passed over"));
}

}  // namespace dsg::ingest
