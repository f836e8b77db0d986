// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/session.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/simulator/motion/perturb.h"
#include "ingest/simulator/world/catalogue.h"
#include "schema/base/random.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

// Nobody is recognised farther away: 25 pixels high.
constexpr double kViewDistanceM = 30.0;

TriangleMesh Transformed(const TriangleMesh& mesh, const Pose3d& map_T_mesh) {
  TriangleMesh out = mesh;
  const Eigen::Matrix3f rotation = map_T_mesh.orientation.toRotationMatrix().cast<float>();
  const Eigen::Vector3f position = map_T_mesh.position.cast<float>();
  for (Eigen::Vector3f& vertex : out.vertices) vertex = rotation * vertex + position;
  return out;
}

PerturbOptions Scaled(double factor) {
  PerturbOptions options;
  options.pixel *= factor;
  options.rotation_rad *= factor;
  options.translation_m *= factor;
  options.time_offset_s *= factor;
  return options;
}

// Skin at head and hands, shoes, and a shirt and trousers of the person's own.
std::vector<Color> ClothesOf(int person, uint64_t seed) {
  constexpr uint64_t kClothesStream = uint64_t{1} << 40;
  Random random(seed, kClothesStream + static_cast<uint64_t>(person));
  const auto draw = [&](int low, int high) {
    const auto channel = [&] { return static_cast<uint8_t>(random.Integer(low, high)); };
    return Color{channel(), channel(), channel(), 255};
  };
  const Color shirt = draw(40, 230);
  const Color trousers = draw(20, 120);
  const Color shoes = draw(15, 70);
  const auto tone = static_cast<uint8_t>(random.Integer(110, 225));
  const Color skin = {tone, static_cast<uint8_t>(tone * 3 / 4), static_cast<uint8_t>(tone * 3 / 5),
                      255};
  std::vector<Color> colors;
  for (const uint8_t joint : BodyModel::VertexJoints()) {
    const bool is_bare = joint == 12 || joint == 15 || joint >= 20;
    const bool is_foot = joint == 7 || joint == 8 || joint == 10 || joint == 11;
    const bool is_leg = joint <= 5 && joint != 3;
    colors.push_back(is_bare ? skin : is_foot ? shoes : is_leg ? trousers : shirt);
  }
  return colors;
}

// Where most things are that people may take: there is something to see.
int LiveliestRoom(const World& world) {
  std::vector<int> counts(world.plan.rooms.size(), 0);
  for (const Furniture& item : world.furniture) {
    if (item.on >= 0) ++counts[static_cast<size_t>(item.room)];
  }
  return static_cast<int>(std::max_element(counts.begin(), counts.end()) - counts.begin());
}

}  // namespace

absl::StatusOr<std::unique_ptr<SensorSession>> SensorSession::Make(const SensorsOptions& options) {
  DSG_RETURN_IF_ERROR(options.Validate());
  std::unique_ptr<SensorSession> session(new SensorSession());
  session->options_ = options;
  DSG_ASSIGN_OR_RETURN(World world, GenerateWorld(options.world));
  session->world_ = std::make_unique<World>(std::move(world));
  session->robot_ = RobotMotion::Make(*session->world_,
                                      // Half of the logs begin with a standstill.
                                      {.duration_s = options.duration_s,
                                       .still_s = options.world.seed % 2 == 0 ? 1.5 : 0.0,
                                       .first_room = LiveliestRoom(*session->world_)},
                                      options.world.seed);
  const RobotMotion* robot = session->robot_.get();
  session->crowd_ =
      CrowdMotion::Make(session->world_.get(),
                        {.people_count = options.people_count,
                         .duration_s = options.duration_s,
                         .robot_at = [robot](TimeNs time_ns) -> Point {
                           // People's plans reach beyond the end of the log.
                           const TimeNs until_ns = std::min(time_ns, robot->duration_ns());
                           return robot->StateAt(until_ns).map_T_body.position.head<2>();
                         },
                         // A few people near the robot are enough; more would be a procession.
                         .meet_share = std::min(0.8, 4.0 / std::max(1, options.people_count))},
                        options.world.seed);
  session->scene_ = BuildScene(*session->world_, session->crowd_->movable());
  DSG_ASSIGN_OR_RETURN(session->renderer_, Renderer::Create(session->scene_));
  session->rig_ = ReferenceRig();
  for (ingest::CameraCalibration& camera : session->rig_.cameras) {
    const bool is_stereo = camera.name == "cam0" || camera.name == "cam1";
    camera.rate_hz = is_stereo ? options.rate_hz : options.rate_hz / options.keyframe_every;
  }
  const PerturbedRig perturbed =
      PerturbRig(session->rig_, Scaled(options.calibration_error_factor), options.world.seed);
  session->told_rig_ = perturbed.told;
  // The cameras' clock is that of the robot's true poses, so it is the inertial unit that differs.
  session->imu_delay_ns_ = -perturbed.camera_time_offset_ns;
  ImuModel model;
  model.noise_factor = options.imu_noise_factor;
  session->imu_ =
      SimulateImu(*session->robot_, model, session->rig_.imu->rate_hz, options.world.seed);
  session->human_class_id_ = ClassId("human");
  session->instances_ = FurnitureInstances(*session->world_);
  session->MakeLooks();
  return session;
}

TimeNs SensorSession::TimeOf(int64_t frame) const {
  return static_cast<TimeNs>(std::llround(static_cast<double>(frame) *
                                          static_cast<double>(kNsPerSecond) / options_.rate_hz));
}

Pose3d SensorSession::MapTCamera(const ingest::CameraCalibration& camera, int64_t frame) const {
  return robot_->StateAt(TimeOf(frame)).map_T_body * camera.body_T_camera;
}

void SensorSession::MakeLooks() {
  for (int person = 0; person < crowd_->count(); ++person) {
    BodyLook look;
    crowd_->body(person).Skin(Posture(), &look.rest_mesh);
    look.vertex_colors = ClothesOf(person, options_.world.seed);
    people_looks_.push_back(std::move(look));
  }
  for (const int object : crowd_->movable()) {
    const Furniture& item = world_->furniture[static_cast<size_t>(object)];
    object_looks_.push_back({FurnitureMesh(item.class_name, item.size), {}});
  }
}

std::unique_ptr<DrawnBody> SensorSession::DrawPerson(int person, TimeNs time_ns) const {
  const BodyLook& look = people_looks_[static_cast<size_t>(person)];
  const BodyState state = crowd_->StateAt(person, time_ns);
  auto drawn = std::make_unique<DrawnBody>();
  drawn->person = person;
  TriangleMesh skin;
  crowd_->body(person).Skin(state.pose, &skin);
  drawn->mesh_map = Transformed(skin, state.map_T_torso);
  drawn->body = {.mesh = &drawn->mesh_map,
                 .texture_points = &look.rest_mesh.vertices,
                 .vertex_colors = &look.vertex_colors,
                 .class_id = human_class_id_,
                 .instance = person + 1,
                 .texture_seed = static_cast<uint32_t>(person)};
  return drawn;
}

std::unique_ptr<DrawnBody> SensorSession::DrawObject(size_t movable_index, TimeNs time_ns) const {
  const BodyLook& look = object_looks_[movable_index];
  const int object = crowd_->movable()[movable_index];
  const Furniture& item = world_->furniture[static_cast<size_t>(object)];
  auto drawn = std::make_unique<DrawnBody>();
  drawn->object = object;
  drawn->mesh_map = Transformed(look.rest_mesh, crowd_->ObjectPoseAt(object, time_ns));
  drawn->body = {.mesh = &drawn->mesh_map,
                 .texture_points = &look.rest_mesh.vertices,
                 .class_id = ClassId(item.class_name),
                 .instance = instances_[static_cast<size_t>(object)],
                 .material = Material::kPlastic,
                 .color = item.color,
                 .texture_seed = static_cast<uint32_t>(1000 + object)};
  return drawn;
}

std::vector<std::unique_ptr<DrawnBody>> SensorSession::BodiesAt(
    int64_t frame, const Eigen::Vector3d& viewer_map) const {
  const TimeNs time_ns = TimeOf(frame);
  const auto is_near = [&](const Eigen::Vector3d& position_map) {
    return (position_map - viewer_map).norm() <= kViewDistanceM;
  };
  std::vector<std::unique_ptr<DrawnBody>> drawn;
  for (int person = 0; person < crowd_->count(); ++person) {
    if (!is_near(crowd_->StateAt(person, time_ns).map_T_torso.position)) continue;
    drawn.push_back(DrawPerson(person, time_ns));
  }
  for (size_t i = 0; i < crowd_->movable().size(); ++i) {
    if (!is_near(crowd_->ObjectPoseAt(crowd_->movable()[i], time_ns).position)) continue;
    drawn.push_back(DrawObject(i, time_ns));
  }
  return drawn;
}

}  // namespace dsg::simulator
