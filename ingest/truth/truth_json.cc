// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <nlohmann/json.hpp>

#include "absl/strings/str_cat.h"
#include "ingest/truth/truth_parts_internal.h"
#include "schema/base/status.h"
#include "schema/interop/json_cursor.h"
#include "schema/interop/json_fields.h"

namespace dsg::truth {
namespace {

using Json = nlohmann::json;

constexpr uint64_t kIndexMax = 10'000'000;
constexpr uint64_t kRowCountMax = 1'000'000'000;

template <typename Vector>
Json VectorJson(const Vector& vector) {
  Json out = Json::array();
  for (Eigen::Index i = 0; i < vector.size(); ++i) out.push_back(vector[i]);
  return out;
}

Json PoseJson(const Pose3d& pose) {
  return {{"position", VectorJson(pose.position)},
          {"orientation_xyzw", VectorJson(pose.orientation.coeffs())}};
}

Json CameraJson(const ingest::CameraCalibration& camera) {
  return {{"name", camera.name},
          {"width", camera.width},
          {"height", camera.height},
          {"rate_hz", camera.rate_hz},
          {"intrinsics_px", {camera.fx, camera.fy, camera.cx, camera.cy}},
          {"distortion", static_cast<int>(camera.distortion)},
          {"distortion_coefficients", camera.distortion_coefficients},
          {"body_T_camera", PoseJson(camera.body_T_camera)}};
}

Json RigJson(const ingest::RigCalibration& rig) {
  Json out = {{"cameras", Json::array()}};
  for (const auto& camera : rig.cameras) out["cameras"].push_back(CameraJson(camera));
  if (!rig.imu.has_value()) return out;
  const ingest::ImuCalibration& imu = *rig.imu;
  out["imu"] = {{"name", imu.name},
                {"rate_hz", imu.rate_hz},
                {"gyro_noise_density", imu.gyro_noise_density},
                {"gyro_random_walk", imu.gyro_random_walk},
                {"accel_noise_density", imu.accel_noise_density},
                {"accel_random_walk", imu.accel_random_walk},
                {"body_T_imu", PoseJson(imu.body_T_imu)}};
  return out;
}

Json ObjectJson(const Object& object) {
  return {{"name", object.name},
          {"class_name", object.class_name},
          {"class_id", object.class_id},
          {"instance", object.instance},
          {"room", object.room},
          {"map_T_object", PoseJson(object.map_T_object)},
          {"size", VectorJson(object.size)},
          {"cad_file", object.cad_file},
          {"symmetry_order", object.symmetry_order},
          {"observed", object.observed}};
}

Json RoomJson(const Room& room) {
  Json footprint = Json::array();
  for (const Eigen::Vector2d& corner : room.footprint_map) footprint.push_back(VectorJson(corner));
  return {{"name", room.name},
          {"class_name", room.class_name},
          {"footprint_map", footprint},
          {"ceiling_m", room.ceiling_m}};
}

Json PickJson(const Pick& pick) {
  Json out = {{"object", pick.object},
              {"human", pick.human},
              {"room", pick.room},
              {"pick_ns", pick.pick_ns},
              {"map_T_object_after", PoseJson(pick.map_T_object_after)},
              {"observed", pick.observed}};
  if (pick.place_ns != kTimeMax) out["place_ns"] = pick.place_ns;
  return out;
}

Json SceneJson(const Truth& truth) {
  Json labels = Json::array(), humans = Json::array(), objects = Json::array();
  Json rooms = Json::array(), doors = Json::array(), picks = Json::array();
  for (const auto& label : truth.labels) labels.push_back({{"id", label.id}, {"name", label.name}});
  for (const Human& human : truth.humans) {
    humans.push_back({{"name", human.name}, {"shape", human.shape}, {"height_m", human.height_m}});
  }
  for (const Object& object : truth.objects) objects.push_back(ObjectJson(object));
  for (const Room& room : truth.rooms) rooms.push_back(RoomJson(room));
  for (const Door& door : truth.doors) {
    doors.push_back({{"room_a", door.room_a},
                     {"room_b", door.room_b},
                     {"from_map", VectorJson(door.from_map)},
                     {"to_map", VectorJson(door.to_map)},
                     {"height_m", door.height_m}});
  }
  for (const Pick& pick : truth.picks) picks.push_back(PickJson(pick));
  return {{"labels", labels}, {"humans", humans}, {"objects", objects},
          {"rooms", rooms},   {"doors", doors},   {"picks", picks}};
}

/// Reads arrays of known length and what is made of them.
class Reader {
 public:
  explicit Reader(JsonSource* source) : source_(source) {}

  // Element by element, so that one wrong entry is named.
  template <typename Item>
  void Items(const JsonFields& fields, const char* name, std::vector<Item>* out) {
    if (!fields.Has(name)) fields.Fail(name, "is missing");
    const Json& array = fields.Array(name);
    for (size_t i = 0; i < array.size() && source_->ok(); ++i) {
      const JsonFields item(array[i], absl::StrCat(name, "[", i, "]"), source_);
      out->push_back(Read(item, static_cast<Item*>(nullptr)));
    }
  }

  std::vector<double> Numbers(const JsonFields& fields, const char* name, size_t count) {
    const Json& array = fields.Array(name);
    std::vector<double> out;
    for (const Json& value : array) {
      out.push_back(NumberOf(value, absl::StrCat(fields.where(), ".", name), source_));
    }
    if (count > 0 && out.size() != count) {
      fields.Fail(name, absl::StrCat("has ", out.size(), " numbers, not ", count));
      out.assign(count, 0.0);
    }
    return out;
  }

  Pose3d Pose(const JsonFields& fields, const char* name) {
    const JsonFields parts = fields.Object(name, true);
    Pose3d pose;
    pose.position = parts.Vector("position");
    const std::vector<double> q = Numbers(parts, "orientation_xyzw", 4);
    pose.orientation = Eigen::Quaterniond(q[3], q[0], q[1], q[2]);
    if (!IsValidPose(pose)) fields.Fail(name, "is not a finite pose with a unit quaternion");
    return pose;
  }

  ingest::RigCalibration Rig(const JsonFields& fields) {
    ingest::RigCalibration rig;
    Items(fields, "cameras", &rig.cameras);
    if (!fields.Has("imu")) return rig;
    const JsonFields in = fields.Object("imu", true);
    ingest::ImuCalibration imu;
    imu.name = in.Text("name");
    imu.rate_hz = in.Number("rate_hz");
    imu.gyro_noise_density = in.Number("gyro_noise_density");
    imu.gyro_random_walk = in.Number("gyro_random_walk");
    imu.accel_noise_density = in.Number("accel_noise_density");
    imu.accel_random_walk = in.Number("accel_random_walk");
    imu.body_T_imu = Pose(in, "body_T_imu");
    rig.imu = imu;
    return rig;
  }

  FreeGrid Grid(const JsonFields& fields) {
    FreeGrid grid;
    grid.origin_map = Point2(fields, "origin_map");
    grid.cell_m = fields.Number("cell_m");
    grid.width = static_cast<int>(fields.Unsigned("width", 20'000));
    grid.height = static_cast<int>(fields.Unsigned("height", 20'000));
    return grid;
  }

 private:
  Eigen::Vector2d Point2(const JsonFields& fields, const char* name) {
    const std::vector<double> xy = Numbers(fields, name, 2);
    return {xy[0], xy[1]};
  }

  static int Index(const JsonFields& fields, const char* name) {
    return static_cast<int>(fields.Unsigned(name, kIndexMax));
  }

  ingest::CameraCalibration Read(const JsonFields& in, ingest::CameraCalibration*) {
    ingest::CameraCalibration camera;
    camera.name = in.Text("name");
    camera.width = Index(in, "width");
    camera.height = Index(in, "height");
    camera.rate_hz = in.Number("rate_hz");
    const std::vector<double> intrinsics = Numbers(in, "intrinsics_px", 4);
    camera.fx = intrinsics[0];
    camera.fy = intrinsics[1];
    camera.cx = intrinsics[2];
    camera.cy = intrinsics[3];
    camera.distortion = static_cast<ingest::Distortion>(
        in.Unsigned("distortion", static_cast<uint64_t>(ingest::Distortion::kEquidistant)));
    camera.distortion_coefficients = Numbers(in, "distortion_coefficients", 0);
    camera.body_T_camera = Pose(in, "body_T_camera");
    return camera;
  }

  SemanticLabel Read(const JsonFields& in, SemanticLabel*) {
    return {Index(in, "id"), in.Text("name")};
  }

  Human Read(const JsonFields& in, Human*) {
    Human human;
    human.name = in.Text("name");
    const std::vector<double> shape = Numbers(in, "shape", ingest::kShapeCount);
    std::copy(shape.begin(), shape.end(), human.shape.begin());
    human.height_m = in.Number("height_m");
    return human;
  }

  Object Read(const JsonFields& in, Object*) {
    Object object;
    object.name = in.Text("name");
    object.class_name = in.Text("class_name");
    object.class_id = Index(in, "class_id");
    object.instance = Index(in, "instance");
    object.room = static_cast<int>(
        std::clamp<int64_t>(in.Signed("room"), -1, static_cast<int64_t>(kIndexMax)));
    object.map_T_object = Pose(in, "map_T_object");
    object.size = in.Vector("size");
    object.cad_file = in.Text("cad_file");
    object.symmetry_order = Index(in, "symmetry_order");
    object.observed = in.Number("observed");
    return object;
  }

  Room Read(const JsonFields& in, Room*) {
    Room room;
    room.name = in.Text("name");
    room.class_name = in.Text("class_name");
    for (const Json& corner : in.Array("footprint_map")) {
      const bool is_pair =
          corner.is_array() && corner.size() == 2 && corner[0].is_number() && corner[1].is_number();
      if (!is_pair) {
        in.Fail("footprint_map", "has a corner that is not [x, y]");
        break;
      }
      room.footprint_map.emplace_back(corner[0].get<double>(), corner[1].get<double>());
    }
    room.ceiling_m = in.Number("ceiling_m");
    return room;
  }

  Door Read(const JsonFields& in, Door*) {
    return {Index(in, "room_a"), Index(in, "room_b"), Point2(in, "from_map"), Point2(in, "to_map"),
            in.Number("height_m")};
  }

  Pick Read(const JsonFields& in, Pick*) {
    Pick pick;
    pick.object = Index(in, "object");
    pick.human = Index(in, "human");
    pick.room = Index(in, "room");
    pick.pick_ns = in.Signed("pick_ns");
    pick.place_ns = in.Signed("place_ns", kTimeMax);
    pick.map_T_object_after = Pose(in, "map_T_object_after");
    pick.observed = in.Bool("observed");
    return pick;
  }

  JsonSource* source_;
};

void ReadCounts(const JsonFields& in, RowCounts* counts) {
  counts->robot = in.Unsigned("robot", kRowCountMax);
  counts->human_states = in.Unsigned("human_states", kRowCountMax);
  counts->detections = in.Unsigned("detections", kRowCountMax);
  counts->vertices = in.Unsigned("vertices", kRowCountMax);
  counts->faces = in.Unsigned("faces", kRowCountMax);
}

}  // namespace

std::string TruthToJson(const Truth& truth) {
  Json out = SceneJson(truth);
  out["format"] = "dsg-truth";
  out["version"] = kTruthVersion;
  out["world"] = truth.world;
  out["seed"] = truth.seed;
  out["begin_ns"] = truth.begin_ns;
  out["end_ns"] = truth.end_ns;
  out["rig"] = RigJson(truth.rig);
  out["free_grid"] = {{"origin_map", VectorJson(truth.free_grid.origin_map)},
                      {"cell_m", truth.free_grid.cell_m},
                      {"width", truth.free_grid.width},
                      {"height", truth.free_grid.height}};
  out["row_counts"] = {{"robot", truth.robot.size()},
                       {"human_states", truth.human_states.size()},
                       {"detections", truth.detections.size()},
                       {"vertices", truth.mesh.positions_map.size()},
                       {"faces", truth.mesh.faces.size()}};
  return out.dump(1) + "\n";
}

absl::Status TruthFromJson(std::string_view bytes, const std::string& file, Truth* truth,
                           RowCounts* counts) {
  DSG_ASSIGN_OR_RETURN(const Json document, ParseJson(bytes, file));
  JsonSource source{file, absl::OkStatus()};
  const JsonFields in(document, "", &source);
  if (in.Text("format") != "dsg-truth") in.Fail("format", "is not \"dsg-truth\"");
  if (in.Unsigned("version", kIndexMax) != kTruthVersion) {
    in.Fail("version", absl::StrCat("is not ", kTruthVersion, "; simulate the log again"));
  }
  Reader reader(&source);
  truth->world = in.Text("world");
  truth->seed = in.Unsigned("seed", UINT64_MAX);
  truth->begin_ns = in.Signed("begin_ns");
  truth->end_ns = in.Signed("end_ns");
  truth->rig = reader.Rig(in.Object("rig", true));
  truth->free_grid = reader.Grid(in.Object("free_grid", true));
  ReadCounts(in.Object("row_counts", true), counts);
  reader.Items(in, "labels", &truth->labels);
  reader.Items(in, "humans", &truth->humans);
  reader.Items(in, "objects", &truth->objects);
  reader.Items(in, "rooms", &truth->rooms);
  reader.Items(in, "doors", &truth->doors);
  reader.Items(in, "picks", &truth->picks);
  return source.status;
}

}  // namespace dsg::truth
