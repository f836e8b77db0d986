// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_calibration.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/ros_messages.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Chains of frames in a robot are short; a loop would not end.
constexpr int kChainMax = 16;
constexpr const char* kBodyFrames[] = {"base_link_gt", "base_link", "imu", "imu0"};

struct Transform {
  std::string parent;
  Pose3d parent_T_child;
};
using Transforms = std::map<std::string, Transform>;

std::string WithoutSlash(const std::string& frame) {
  return frame.starts_with('/') ? frame.substr(1) : frame;
}

absl::StatusOr<Transforms> ReadTransforms(const Bag& bag, const BagPlan& plan) {
  Transforms transforms;
  int64_t number = 0;
  for (const BagMessageRef& ref : bag.messages()) {
    const BagTopic& topic = plan.topics[plan.topic_of_connection[ref.connection]];
    if (topic.name != "/tf_static") continue;
    if (topic.type != "tf2_msgs/TFMessage" && topic.type != "tf/tfMessage") continue;
    const std::string origin = BagOrigin(bag, topic.name, ++number);
    DSG_ASSIGN_OR_RETURN(const BagMessage message, bag.Read(ref));
    DSG_ASSIGN_OR_RETURN(const std::vector<RosPose> poses,
                         ParseRosTransforms(message.data, origin));
    for (const RosPose& pose : poses) {
      DSG_ASSIGN_OR_RETURN(const Pose3d parent_T_child, pose.ToPose(origin));
      transforms[WithoutSlash(pose.child_frame_id)] = {WithoutSlash(pose.header.frame_id),
                                                       parent_T_child};
    }
  }
  return transforms;
}

std::optional<Pose3d> FindBodyTCamera(const Transforms& transforms, std::string frame) {
  Pose3d frame_T_camera;
  for (int i = 0; i < kChainMax; ++i) {
    if (std::find(std::begin(kBodyFrames), std::end(kBodyFrames), frame) != std::end(kBodyFrames)) {
      return frame_T_camera;
    }
    const auto found = transforms.find(frame);
    if (found == transforms.end()) return std::nullopt;
    frame_T_camera = found->second.parent_T_child * frame_T_camera;
    frame = found->second.parent;
  }
  return std::nullopt;
}

// Which camera info speaks of an image: the one with the most of its path.
size_t CommonLength(std::string_view a, std::string_view b) {
  size_t common = 0;
  for (size_t i = 0; i < std::min(a.size(), b.size()) && a[i] == b[i]; ++i) {
    if (a[i] == '/') common = i;
  }
  return common;
}

// Empty when none, or two as good as each other.
std::string FindInfoTopic(const BagPlan& plan, const BagTopic& image) {
  std::string best;
  size_t best_length = 0;
  bool is_tie = false;
  for (const BagTopic& topic : plan.topics) {
    if (topic.type != "sensor_msgs/CameraInfo" || topic.message_count == 0) continue;
    const size_t length = CommonLength(topic.name, image.name);
    is_tie = length == best_length;
    if (length <= best_length) continue;
    best = topic.name;
    best_length = length;
    is_tie = false;
  }
  return is_tie ? "" : best;
}

absl::StatusOr<RosCameraInfo> ReadInfo(const Bag& bag, const BagPlan& plan,
                                       const std::string& name) {
  for (const BagMessageRef& ref : bag.messages()) {
    if (plan.topics[plan.topic_of_connection[ref.connection]].name != name) continue;
    DSG_ASSIGN_OR_RETURN(const BagMessage message, bag.Read(ref));
    return ParseRosCameraInfo(message.data, BagOrigin(bag, name, 1));
  }
  return MakeError(Reason::kFileMalformed, absl::StrCat(bag.path(), ": topic ", name, " is empty"),
                   {{"file", bag.path()}});
}

// False when the model is unknown and bends something.
bool SetDistortion(const RosCameraInfo& info, CameraCalibration* camera) {
  const bool is_straight =
      std::all_of(info.d.begin(), info.d.end(), [](double value) { return value == 0.0; });
  if (is_straight) return true;
  camera->distortion_coefficients = info.d;
  if (info.distortion_model == "plumb_bob" || info.distortion_model == "radtan") {
    camera->distortion = Distortion::kRadialTangential;
    return true;
  }
  camera->distortion = Distortion::kEquidistant;
  return info.distortion_model == "equidistant" || info.distortion_model == "fisheye";
}

// nullopt for a camera that says it is not calibrated, with a note.
std::optional<CameraCalibration> ToCalibration(const RosCameraInfo& info,
                                               const std::string& channel,
                                               std::vector<std::string>* notes) {
  CameraCalibration camera;
  camera.name = channel;
  camera.width = static_cast<int>(std::min<uint32_t>(info.width, 1 << 20));
  camera.height = static_cast<int>(std::min<uint32_t>(info.height, 1 << 20));
  const bool has_k = info.k[0] != 0.0;
  camera.fx = has_k ? info.k[0] : info.p[0];
  camera.fy = has_k ? info.k[4] : info.p[5];
  camera.cx = has_k ? info.k[2] : info.p[2];
  camera.cy = has_k ? info.k[5] : info.p[6];
  if (camera.fx == 0.0) {
    notes->push_back(absl::StrCat("the camera info of ", channel, " says: not calibrated"));
    return std::nullopt;
  }
  if (!SetDistortion(info, &camera)) {
    notes->push_back(absl::StrCat("the distortion model \"", info.distortion_model.substr(0, 64),
                                  "\" of ", channel,
                                  " is not known: no calibration; plumb_bob and equidistant are"));
    return std::nullopt;
  }
  return camera;
}

absl::Status AddCamera(const Bag& bag, const Transforms& transforms, const BagTopic& image,
                       BagPlan* plan) {
  const std::string name = FindInfoTopic(*plan, image);
  if (name.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const RosCameraInfo info, ReadInfo(bag, *plan, name));
  std::optional<CameraCalibration> camera = ToCalibration(info, image.channel, &plan->notes);
  if (!camera.has_value()) return absl::OkStatus();
  const std::string frame = WithoutSlash(info.header.frame_id);
  const std::optional<Pose3d> body_T_camera = FindBodyTCamera(transforms, frame);
  if (body_T_camera.has_value()) {
    camera->body_T_camera = *body_T_camera;
  } else {
    plan->notes.push_back(absl::StrCat("no static transform leads from base_link_gt to \"",
                                       frame.substr(0, 64), "\": ", image.channel,
                                       " is taken to sit at the body"));
  }
  const absl::Status valid = camera->Validate();
  if (!valid.ok()) {
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(BagOrigin(bag, name, 1), ": ", valid.message()),
                     {{"file", bag.path()}, {"topic", name}});
  }
  plan->rig.cameras.push_back(*std::move(camera));
  return absl::OkStatus();
}

// Depth, labels and colour are of the left camera unless they say otherwise.
void ShareLeftCamera(const std::set<std::string>& channels, RigCalibration* rig) {
  const CameraCalibration* left = rig->FindCamera("cam0");
  if (left == nullptr) left = rig->FindCamera("color0");
  if (left == nullptr) return;
  CameraCalibration shared = *left;
  for (const char* channel : {"color0", "depth0", "label0"}) {
    if (!channels.contains(channel) || rig->FindCamera(channel) != nullptr) continue;
    shared.name = channel;
    rig->cameras.push_back(shared);
  }
}

}  // namespace

absl::Status ReadBagCalibration(const Bag& bag, BagPlan* plan) {
  DSG_ASSIGN_OR_RETURN(const Transforms transforms, ReadTransforms(bag, *plan));
  std::set<std::string> channels;
  for (const BagTopic& topic : plan->topics) {
    if (topic.use != TopicUse::kImage && topic.use != TopicUse::kCompressedImage) continue;
    channels.insert(topic.channel);
    DSG_RETURN_IF_ERROR(AddCamera(bag, transforms, topic, plan));
  }
  ShareLeftCamera(channels, &plan->rig);
  std::sort(plan->rig.cameras.begin(), plan->rig.cameras.end(),
            [](const CameraCalibration& a, const CameraCalibration& b) { return a.name < b.name; });
  for (const CameraCalibration& camera : plan->rig.cameras) channels.erase(camera.name);
  if (!channels.empty()) {
    plan->notes.push_back(absl::StrCat("no calibration for ", absl::StrJoin(channels, ", ")));
  }
  return absl::OkStatus();
}

}  // namespace dsg::ingest
