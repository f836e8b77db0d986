// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_identity.h"

#include <cstdint>
#include <iterator>
#include <map>
#include <string_view>

#include "absl/strings/str_cat.h"
#include "ingest/log/ros_cloud.h"
#include "schema/codec/topology.h"

namespace dsg::ingest {
namespace {

// The same numbers are the same bytes, whoever wrote them; lengths keep neighbours apart.
class ContentHash {
 public:
  template <typename... Numbers>
  void Numbers64(Numbers... numbers) {
    (AddBytes(numbers), ...);
  }
  void Text(std::string_view text) {
    AddBytes(static_cast<uint64_t>(text.size()));
    hash_.Add(text);
  }
  void Vector(const double* numbers, int count) {
    for (int i = 0; i < count; ++i) AddBytes(numbers[i]);
  }
  void Pose(const Pose3d& pose) {
    Vector(pose.position.data(), 3);
    Vector(pose.orientation.coeffs().data(), 4);
  }
  std::string Hex() { return hash_.Hex(); }

 private:
  template <typename Number>
  void AddBytes(Number number) {
    static_assert(sizeof(number) == 8);
    hash_.Add({reinterpret_cast<const char*>(&number), sizeof(number)});
  }

  Sha256Stream hash_;
};

std::string HashOf(const BagPlan& plan) {
  ContentHash hash;
  for (const CameraCalibration& camera : plan.rig.cameras) {
    hash.Text(camera.name);
    hash.Numbers64(int64_t{camera.width}, int64_t{camera.height}, camera.fx, camera.fy, camera.cx,
                   camera.cy, static_cast<int64_t>(camera.distortion));
    hash.Vector(camera.distortion_coefficients.data(),
                static_cast<int>(camera.distortion_coefficients.size()));
    hash.Pose(camera.body_T_camera);
  }
  if (plan.rig.lidar.has_value()) {
    hash.Text(plan.rig.lidar->name);
    hash.Pose(plan.rig.lidar->body_T_lidar);
  }
  for (const SemanticLabel& label : plan.labels) {
    hash.Numbers64(int64_t{label.id});
    hash.Text(label.name);
  }
  for (const auto& [color, class_id] : plan.class_of_color) {
    hash.Numbers64(int64_t{color}, int64_t{class_id});
  }
  // Logs without it keep the identity that they had before bodies were read.
  if (plan.body_topology != nullptr) hash.Text(EncodeTopology(*plan.body_topology));
  return hash.Hex();
}

bool AddImage(const RosBytes& data, ContentHash* hash) {
  const absl::StatusOr<RosImage> image = ParseRosImage(data, "");
  if (!image.ok()) return false;
  hash->Numbers64(image->header.stamp_ns, uint64_t{image->width}, uint64_t{image->height},
                  uint64_t{image->step}, static_cast<uint64_t>(image->is_big_endian));
  hash->Text(image->encoding);
  hash->Text(image->data);
  return true;
}

bool AddCompressed(const RosBytes& data, ContentHash* hash) {
  const absl::StatusOr<RosCompressedImage> image = ParseRosCompressedImage(data, "");
  if (!image.ok()) return false;
  hash->Numbers64(image->header.stamp_ns);
  hash->Text(image->format);
  hash->Text(image->data);
  return true;
}

bool AddCloud(const RosBytes& data, ContentHash* hash) {
  const absl::StatusOr<RosHeader> header = ParseRosHeader(data, "");
  const absl::StatusOr<Image> points = ParseRosPointCloud(data, "");
  if (!header.ok() || !points.ok()) return false;
  hash->Numbers64(header->stamp_ns);
  hash->Text({reinterpret_cast<const char*>(points->bytes.data()), points->bytes.size()});
  return true;
}

bool AddImu(const RosBytes& data, ContentHash* hash) {
  const absl::StatusOr<RosImu> imu = ParseRosImu(data, "");
  if (!imu.ok()) return false;
  hash->Numbers64(imu->header.stamp_ns);
  hash->Vector(imu->angular_velocity.data(), 3);
  hash->Vector(imu->acceleration.data(), 3);
  return true;
}

bool AddString(const RosBytes& data, ContentHash* hash) {
  const absl::StatusOr<std::string_view> text = ParseRosString(data, "");
  if (text.ok()) hash->Text(*text);
  return text.ok();
}

bool AddPose(const BagTopic& topic, const RosBytes& data, ContentHash* hash) {
  const absl::StatusOr<RosPose> pose = ParseRosPoseOf(topic.type, data, "");
  if (!pose.ok()) return false;
  hash->Numbers64(pose->header.stamp_ns);
  hash->Vector(pose->position.data(), 3);
  hash->Vector(pose->xyzw.data(), 4);
  return true;
}

bool AddMessage(const BagTopic& topic, const RosBytes& data, ContentHash* hash) {
  switch (topic.use) {
    case TopicUse::kImage:
      return AddImage(data, hash);
    case TopicUse::kCompressedImage:
      return AddCompressed(data, hash);
    case TopicUse::kCloud:
      return AddCloud(data, hash);
    case TopicUse::kImu:
      return AddImu(data, hash);
    case TopicUse::kDetections:
    case TopicUse::kLoops:
      return AddString(data, hash);
    case TopicUse::kTruth:
    case TopicUse::kExternal:
      return AddPose(topic, data, hash);
    case TopicUse::kNone:
      break;
  }
  return true;
}

std::string HashOf(const TrackTable& poses) {
  ContentHash hash;
  for (const TrackRow& row : poses.rows) {
    hash.Numbers64(row.time_ns);
    hash.Pose(row.map_T_agent);
  }
  return hash.Hex();
}

}  // namespace

void AddBagContent(const Bag& bag, const BagPlan& plan,
                   const std::optional<TrackTable>& transform_poses, const PassCallback& on_read,
                   LogDigest* digest) {
  std::map<size_t, ContentHash> hash_of_topic;
  int64_t done = 0;
  for (const BagMessageRef& ref : bag.messages()) {
    if (on_read) on_read(++done, std::ssize(bag.messages()));
    const size_t index = plan.topic_of_connection[ref.connection];
    const BagTopic& topic = plan.topics[index];
    if (topic.use == TopicUse::kNone) continue;
    ContentHash& hash = hash_of_topic[index];
    const absl::StatusOr<BagMessage> message = bag.Read(ref);
    // What cannot be read is for the reader of the log to tell.
    if (!message.ok()) {
      hash.Text("unreadable");
    } else if (!AddMessage(topic, message->data, &hash)) {
      hash.Text(message->data.bytes);
    }
  }
  digest->AddSha256("bag", HashOf(plan));
  for (auto& [index, hash] : hash_of_topic) {
    digest->AddSha256(absl::StrCat("bag/", plan.topics[index].channel), hash.Hex());
  }
  if (transform_poses.has_value()) digest->AddSha256("bag/tf", HashOf(*transform_poses));
}

}  // namespace dsg::ingest
