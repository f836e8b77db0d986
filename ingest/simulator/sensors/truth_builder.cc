// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/truth_builder.h"

#include <algorithm>
#include <map>
#include <set>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ingest/files/output_file.h"
#include "ingest/files/output_folder.h"
#include "ingest/simulator/body/body_skin.h"
#include "ingest/simulator/world/catalogue.h"
#include "ingest/truth/body_file.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

// The paper registers couches; one model serves all of them.
constexpr char kKnownClass[] = "couch";
// A person counts as seen while picking when a keyframe this near shows it.
constexpr TimeNs kWitnessNs = kNsPerSecond;

std::string CadFile(const std::string& class_name) { return absl::StrCat(class_name, ".ply"); }

std::vector<truth::RobotState> RobotStates(const SensorSession& session) {
  std::vector<truth::RobotState> states;
  states.reserve(session.imu().size());
  for (const ImuSample& sample : session.imu()) {
    const MotionState motion = session.robot().StateAt(sample.time_ns);
    states.push_back({session.begin_ns() + sample.time_ns, motion.map_T_body, motion.velocity_map,
                      sample.gyro_bias, sample.accel_bias});
  }
  return states;
}

void AddHumans(const SensorSession& session, truth::Truth* out) {
  const CrowdMotion& crowd = session.crowd();
  for (int person = 0; person < crowd.count(); ++person) {
    out->humans.push_back(
        {crowd.name(person), crowd.body(person).shape(), crowd.body(person).height_m()});
  }
  for (int64_t frame = 0; frame < session.frame_count(); ++frame) {
    if (!session.IsKeyframe(frame)) continue;
    for (int person = 0; person < crowd.count(); ++person) {
      const BodyState state = crowd.StateAt(person, session.TimeOf(frame));
      out->human_states.push_back(
          {session.StampOf(frame), person, state.map_T_torso, state.joints_map});
    }
  }
}

void AddMesh(const Scene& scene, truth::Truth* out) {
  MeshBlock& mesh = out->mesh;
  for (const Part& part : scene.parts) {
    const auto first = static_cast<uint32_t>(mesh.positions_map.size());
    const uint16_t label = LabelValue(part.class_id, part.instance);
    for (const Eigen::Vector3f& vertex : part.mesh.vertices) {
      mesh.positions_map.push_back(vertex);
      mesh.labels.push_back(static_cast<uint32_t>(part.class_id));
      mesh.instance_ids.push_back(label);
    }
    for (const std::array<uint32_t, 3>& face : part.mesh.faces) {
      mesh.faces.push_back({face[0] + first, face[1] + first, face[2] + first});
    }
  }
}

// Share of each instance's surface that was seen, by label value.
std::map<uint32_t, double> ObservedShares(const truth::Truth& truth) {
  std::map<uint32_t, std::pair<double, double>> areas;
  for (size_t i = 0; i < truth.mesh.faces.size(); ++i) {
    const auto& [a, b, c] = truth.mesh.faces[i];
    const auto& points = truth.mesh.positions_map;
    const double area = 0.5 * (points[b] - points[a]).cross(points[c] - points[a]).norm();
    auto& [seen, all] = areas[truth.mesh.instance_ids[a]];
    all += area;
    if (truth.face_observed[i] != 0) seen += area;
  }
  std::map<uint32_t, double> shares;
  for (const auto& [label, area] : areas) {
    shares[label] = area.second > 0.0 ? area.first / area.second : 0.0;
  }
  return shares;
}

void AddObjects(const SensorSession& session, const Observation& observation, truth::Truth* out) {
  const std::map<uint32_t, double> shares = ObservedShares(*out);
  const std::vector<int> instances = FurnitureInstances(session.world());
  std::set<int> sighted;
  for (const ObjectSighting& sighting : observation.sightings) sighted.insert(sighting.object);
  for (size_t i = 0; i < session.world().furniture.size(); ++i) {
    const Furniture& item = session.world().furniture[i];
    truth::Object object;
    object.name = item.name;
    object.class_name = item.class_name;
    object.class_id = ClassId(item.class_name);
    object.instance = instances[i];
    object.room = item.room;
    object.map_T_object = FurniturePose(item);
    object.size = item.size;
    if (item.class_name == kKnownClass) object.cad_file = CadFile(kKnownClass);
    const auto share = shares.find(LabelValue(object.class_id, object.instance));
    // Carried objects are not part of the static mesh: seen is seen.
    object.observed = share != shares.end() ? share->second : sighted.contains(static_cast<int>(i));
    out->objects.push_back(std::move(object));
  }
}

void AddRooms(const FloorPlan& plan, truth::Truth* out) {
  for (const Room& room : plan.rooms) {
    const Rect& cell = room.cell;
    out->rooms.push_back({room.name,
                          room.class_name,
                          {cell.min(), Point(cell.max().x(), cell.min().y()), cell.max(),
                           Point(cell.min().x(), cell.max().y())},
                          room.ceiling_m});
  }
  for (const Door& door : plan.doors) {
    const Point half =
        door.walks_along_y ? Point(0.5 * door.width_m, 0.0) : Point(0.0, 0.5 * door.width_m);
    const double height =
        door.kind == OpeningKind::kDoor
            ? kDoorHeightM
            : std::min(plan.rooms[door.room_a].ceiling_m, plan.rooms[door.room_b].ceiling_m);
    out->doors.push_back(
        {door.room_a, door.room_b, door.center - half, door.center + half, height});
  }
}

bool IsWitnessed(const SensorSession& session, const PickEvent& pick,
                 const Observation& observation) {
  const bool before =
      std::any_of(observation.sightings.begin(), observation.sightings.end(),
                  [&](const ObjectSighting& sighting) {
                    return sighting.object == pick.object && sighting.time_ns < pick.pick_ns;
                  });
  return before &&
         std::any_of(observation.views.begin(), observation.views.end(), [&](const BodyView& view) {
           const TimeNs time_ns = view.time_ns - session.begin_ns();
           return view.person == pick.person && time_ns >= pick.pick_ns - kWitnessNs &&
                  time_ns <= pick.pick_ns + kWitnessNs;
         });
}

void AddPicks(const SensorSession& session, const Observation& observation, truth::Truth* out) {
  for (const PickEvent& pick : session.crowd().picks()) {
    const bool is_placed = pick.place_ns != kTimeMax;
    out->picks.push_back({pick.object, pick.person, pick.room, session.begin_ns() + pick.pick_ns,
                          is_placed ? session.begin_ns() + pick.place_ns : kTimeMax,
                          pick.map_T_object_after, IsWitnessed(session, pick, observation)});
  }
}

// In the frame that catalogues use: metres, z up, origin at the floor's centre.
std::string CadPly(const TriangleMesh& mesh) {
  std::string ply = absl::StrCat(
      "ply\nformat ascii 1.0\ncomment metres, z up, origin in the middle of the floor face\n",
      "element vertex ", mesh.vertices.size(), "\nproperty float x\nproperty float y\n",
      "property float z\nelement face ", mesh.faces.size(),
      "\nproperty list uchar int vertex_indices\nend_header\n");
  for (const Eigen::Vector3f& v : mesh.vertices) {
    absl::StrAppendFormat(&ply, "%.6f %.6f %.6f\n", v.x(), v.y(), v.z());
  }
  for (const auto& [a, b, c] : mesh.faces) absl::StrAppend(&ply, "3 ", a, " ", b, " ", c, "\n");
  return ply;
}

}  // namespace

truth::Truth BuildTruth(const SensorSession& session, const Observation& observation,
                        const std::vector<DetectionOutput>& detections, truth::FreeGrid grid) {
  truth::Truth out;
  out.world = Name(session.options().world.kind);
  out.seed = session.options().world.seed;
  out.begin_ns = session.begin_ns();
  out.end_ns = session.StampOf(session.frame_count() - 1);
  out.labels = Labels();
  out.rig = session.rig();
  out.robot = RobotStates(session);
  AddHumans(session, &out);
  for (const DetectionOutput& detection : detections) out.detections.push_back(detection.truth);
  AddMesh(session.scene(), &out);
  out.face_observed = observation.face_observed;
  AddObjects(session, observation, &out);
  AddRooms(session.world().plan, &out);
  AddPicks(session, observation, &out);
  out.free_grid = std::move(grid);
  return out;
}

const BodyModel& ModelOf(const SensorSession& session, const DetectedBody& body) {
  static const BodyModel mean{ShapeCoefficients()};
  return body.person < 0 ? mean : session.crowd().body(body.person);
}

absl::Status WriteTrueBodies(const SensorSession& session,
                             const std::vector<DetectionOutput>& detections,
                             const std::string& folder) {
  if (!session.options().has_bodies) return absl::OkStatus();
  DSG_ASSIGN_OR_RETURN(truth::BodyFileWriter file,
                       truth::BodyFileWriter::Create(folder, SkinTopologyOfAll().bindings.size()));
  for (const DetectionOutput& output : detections) {
    if (output.truth.human < 0) continue;
    const SkinPair skins =
        MakeSkins(*output.body, ModelOf(session, *output.body), output.detection.joints_root);
    DSG_RETURN_IF_ERROR(file.Add(output.truth.id, skins.true_root_map));
  }
  return file.Commit();
}

absl::Status WriteCadModels(const SensorSession& session, const std::string& folder) {
  for (const Furniture& item : session.world().furniture) {
    if (item.class_name != kKnownClass) continue;
    DSG_RETURN_IF_ERROR(ingest::MakeFolder(folder + "/cad"));
    return ingest::WriteFile(absl::StrCat(folder, "/cad/", CadFile(kKnownClass)),
                             CadPly(CadModel(kKnownClass, item.size)));
  }
  return absl::OkStatus();
}

}  // namespace dsg::simulator
