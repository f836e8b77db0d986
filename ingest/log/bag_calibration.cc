// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_calibration.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/bag_transforms.h"
#include "ingest/log/ros_messages.h"
#include "schema/base/status.h"
#include "schema/base/time.h"

namespace dsg::ingest {
namespace {

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

// Where a camera is on the robot. /tf is read only if /tf_static does not say it.
class Extrinsics {
 public:
  explicit Extrinsics(const Bag& bag) : bag_(bag) {}

  absl::StatusOr<std::optional<Pose3d>> Find(const std::string& frame) {
    if (!tree_.has_value()) {
      DSG_ASSIGN_OR_RETURN(tree_, TransformTree::Read(bag_, /*with_moving=*/false));
    }
    std::optional<Pose3d> body_T_camera = tree_->BodyTFrame(frame);
    if (body_T_camera.has_value() || has_moving_ || !HasMovingTransforms(bag_)) {
      return body_T_camera;
    }
    DSG_ASSIGN_OR_RETURN(tree_, TransformTree::Read(bag_, /*with_moving=*/true));
    has_moving_ = true;
    return tree_->BodyTFrame(frame);
  }

 private:
  const Bag& bag_;
  std::optional<TransformTree> tree_;
  bool has_moving_ = false;
};

std::string NotPlaced(const std::string& frame, const std::string& channel) {
  return absl::StrCat("no fixed transform leads from the robot's body to \"",
                      absl::Utf8SafeCHexEscape(frame.substr(0, 64)), "\": ", channel,
                      " is taken to sit at the body");
}

absl::Status AddCamera(const Bag& bag, const BagTopic& image, Extrinsics* extrinsics,
                       BagPlan* plan) {
  const std::string name = FindInfoTopic(*plan, image);
  if (name.empty()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const RosCameraInfo info, ReadInfo(bag, *plan, name));
  std::optional<CameraCalibration> camera = ToCalibration(info, image.channel, &plan->notes);
  if (!camera.has_value()) return absl::OkStatus();
  const std::string& frame = info.header.frame_id;
  DSG_ASSIGN_OR_RETURN(const std::optional<Pose3d> body_T_camera, extrinsics->Find(frame));
  if (body_T_camera.has_value()) {
    camera->body_T_camera = *body_T_camera;
  } else {
    plan->notes.push_back(NotPlaced(frame, image.channel));
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

absl::Status AddLidar(const Bag& bag, const BagTopic& cloud, Extrinsics* extrinsics,
                      BagPlan* plan) {
  const std::optional<BagMessageRef>& first = plan->FirstOf(cloud);
  if (!first.has_value()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const BagMessage message, bag.Read(*first));
  DSG_ASSIGN_OR_RETURN(const RosHeader header,
                       ParseRosHeader(message.data, BagOrigin(bag, cloud.name, 1)));
  DSG_ASSIGN_OR_RETURN(const std::optional<Pose3d> body_T_lidar, extrinsics->Find(header.frame_id));
  LidarCalibration& lidar = plan->rig.lidar.emplace();
  lidar.name = cloud.channel;
  if (body_T_lidar.has_value()) {
    lidar.body_T_lidar = *body_T_lidar;
  } else {
    plan->notes.push_back(NotPlaced(header.frame_id, cloud.channel));
  }
  return absl::OkStatus();
}

// Messages in a second, by the recorder's clock; nullopt of fewer than two.
std::optional<double> RateOf(const Bag& bag, const BagPlan& plan, const BagTopic& topic) {
  TimeNs first_ns = kTimeMax;
  TimeNs last_ns = kTimeMin;
  int64_t count = 0;
  for (const BagMessageRef& ref : bag.messages()) {
    if (&plan.topics[plan.topic_of_connection[ref.connection]] != &topic) continue;
    first_ns = std::min(first_ns, ref.bag_time_ns);
    last_ns = std::max(last_ns, ref.bag_time_ns);
    ++count;
  }
  if (count < 2 || last_ns <= first_ns) return std::nullopt;
  return 1e9 * static_cast<double>(count - 1) / static_cast<double>(last_ns - first_ns);
}

// Bags say nothing of the unit's noise.
absl::Status AddInertialUnit(const Bag& bag, const BagTopic& topic, Extrinsics* extrinsics,
                             BagPlan* plan) {
  const std::optional<BagMessageRef>& first = plan->FirstOf(topic);
  const std::optional<double> rate_hz = RateOf(bag, *plan, topic);
  if (!first.has_value() || !rate_hz.has_value()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const BagMessage message, bag.Read(*first));
  const absl::StatusOr<RosHeader> header =
      ParseRosHeader(message.data, BagOrigin(bag, topic.name, 1));
  // The reader of the log tells what is wrong with it.
  if (!header.ok()) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(const std::optional<Pose3d> body_T_imu, extrinsics->Find(header->frame_id));
  ImuCalibration& imu = plan->rig.imu.emplace();
  imu.name = topic.channel;
  imu.rate_hz = *rate_hz;
  if (body_T_imu.has_value()) {
    imu.body_T_imu = *body_T_imu;
  } else {
    plan->notes.push_back(NotPlaced(header->frame_id, topic.channel));
  }
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
  Extrinsics extrinsics(bag);
  std::set<std::string> channels;
  for (const BagTopic& topic : plan->topics) {
    if (topic.use == TopicUse::kCloud) {
      DSG_RETURN_IF_ERROR(AddLidar(bag, topic, &extrinsics, plan));
    }
    if (topic.use == TopicUse::kImu) {
      DSG_RETURN_IF_ERROR(AddInertialUnit(bag, topic, &extrinsics, plan));
    }
    if (topic.use != TopicUse::kImage && topic.use != TopicUse::kCompressedImage) continue;
    channels.insert(topic.channel);
    DSG_RETURN_IF_ERROR(AddCamera(bag, topic, &extrinsics, plan));
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
