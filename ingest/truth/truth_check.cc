// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>

#include "absl/strings/str_cat.h"
#include "ingest/truth/truth_parts_internal.h"
#include "schema/base/status.h"

namespace dsg::truth {
namespace {

absl::Status Wrong(const std::string& what) {
  return MakeError(Reason::kFieldInvalid, absl::StrCat("ground truth: ", what));
}

// Differences of times must not overflow, and no building is larger than the earth.
constexpr TimeNs kTimeNsMax = std::numeric_limits<TimeNs>::max() / 2;
constexpr double kMetresMax = 1e7;

bool IsNear(const Eigen::Vector3d& position_map) {
  return position_map.allFinite() && position_map.cwiseAbs().maxCoeff() <= kMetresMax;
}

// -1 stands for none where the caller says so.
absl::Status CheckIndex(int index, int low, size_t count, const std::string& what) {
  if (index >= low && index < static_cast<int64_t>(count)) return absl::OkStatus();
  return Wrong(absl::StrCat(what, " is ", index, "; there are ", count));
}

absl::Status CheckGrid(const FreeGrid& grid) {
  const bool is_sized = grid.width >= 0 && grid.height >= 0 && grid.width <= 20'000 &&
                        grid.height <= 20'000 && (grid.width == 0) == (grid.height == 0);
  if (!is_sized) {
    return Wrong(absl::StrCat("the free grid is ", grid.width, " x ", grid.height,
                              "; each side has 1 to 20000 cells, or both none"));
  }
  if (!(grid.cell_m >= 0.001 && grid.cell_m <= 10.0) || !grid.origin_map.allFinite()) {
    return Wrong(absl::StrCat("cells of the free grid are ", grid.cell_m,
                              " m, or its origin is not finite; 0.001 to 10 m"));
  }
  if (grid.cells.size() != static_cast<size_t>(grid.width) * static_cast<size_t>(grid.height)) {
    return Wrong(absl::StrCat("the free grid has ", grid.cells.size(), " cells, not ", grid.width,
                              " x ", grid.height));
  }
  for (const uint8_t cell : grid.cells) {
    if (cell > (kCellFree | kCellObserved | kCellDoorBand)) {
      return Wrong(absl::StrCat("a cell of the free grid is ", cell, "; there are three bits"));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckMesh(const Truth& truth) {
  const MeshBlock& mesh = truth.mesh;
  const size_t count = mesh.positions_map.size();
  if (mesh.labels.size() != count || mesh.instance_ids.size() != count ||
      truth.face_observed.size() != mesh.faces.size()) {
    return Wrong("labels, instance ids or observed faces of the mesh are not as many as needed");
  }
  for (size_t i = 0; i < count; ++i) {
    if (mesh.instance_ids[i] > 0xffff || mesh.labels[i] != mesh.instance_ids[i] >> 8 ||
        !mesh.positions_map[i].allFinite()) {
      return Wrong(absl::StrCat("mesh vertex ", i, " has label ", mesh.labels[i], " and instance ",
                                mesh.instance_ids[i],
                                "; an instance id is class << 8 | instance, positions finite"));
    }
  }
  for (const auto& face : mesh.faces) {
    for (const uint32_t corner : face) {
      if (corner >= count) return Wrong(absl::StrCat("a face has vertex ", corner, " of ", count));
    }
  }
  return absl::OkStatus();
}

absl::Status CheckObject(const Truth& truth, size_t i) {
  const Object& object = truth.objects[i];
  const std::string what = absl::StrCat("object ", i, " (", object.name, ")");
  DSG_RETURN_IF_ERROR(CheckIndex(object.room, -1, truth.rooms.size(), "room of " + what));
  if (!IsValidPose(object.map_T_object)) return Wrong("pose of " + what + " is not valid");
  if (!object.size.allFinite() || object.size.minCoeff() < 0.0) {
    return Wrong("size of " + what + " is negative or not finite");
  }
  if (object.symmetry_order < 1 || object.symmetry_order > 360) {
    return Wrong(absl::StrCat("symmetry_order of ", what, " is ", object.symmetry_order));
  }
  if (!(object.observed >= 0.0 && object.observed <= 1.0)) {
    return Wrong(absl::StrCat("observed of ", what, " is ", object.observed, "; 0 to 1"));
  }
  return absl::OkStatus();
}

absl::Status CheckScene(const Truth& truth) {
  for (size_t i = 0; i < truth.objects.size(); ++i) DSG_RETURN_IF_ERROR(CheckObject(truth, i));
  for (const Human& human : truth.humans) {
    bool is_finite = std::isfinite(human.height_m);
    for (const double coefficient : human.shape) is_finite &= std::isfinite(coefficient);
    if (!is_finite) return Wrong("shape or height of " + human.name + " is not finite");
  }
  for (const Room& room : truth.rooms) {
    bool is_sound = room.footprint_map.size() >= 3 && std::isfinite(room.ceiling_m);
    for (const Eigen::Vector2d& corner : room.footprint_map) is_sound &= corner.allFinite();
    if (!is_sound) return Wrong("footprint or ceiling of room " + room.name + " is not valid");
  }
  for (const Door& door : truth.doors) {
    DSG_RETURN_IF_ERROR(CheckIndex(door.room_a, 0, truth.rooms.size(), "room_a of a door"));
    DSG_RETURN_IF_ERROR(CheckIndex(door.room_b, 0, truth.rooms.size(), "room_b of a door"));
    if (!door.from_map.allFinite() || !door.to_map.allFinite() || !std::isfinite(door.height_m)) {
      return Wrong("an end or the height of a door is not finite");
    }
  }
  for (const Pick& pick : truth.picks) {
    DSG_RETURN_IF_ERROR(CheckIndex(pick.object, 0, truth.objects.size(), "object of a pick"));
    DSG_RETURN_IF_ERROR(CheckIndex(pick.human, 0, truth.humans.size(), "human of a pick"));
    DSG_RETURN_IF_ERROR(CheckIndex(pick.room, 0, truth.rooms.size(), "room of a pick"));
    if (!IsValidPose(pick.map_T_object_after)) return Wrong("pose after a pick is not valid");
  }
  return absl::OkStatus();
}

absl::Status CheckStates(const Truth& truth) {
  for (size_t i = 0; i < truth.robot.size(); ++i) {
    const RobotState& state = truth.robot[i];
    const bool is_sound = IsValidPose(state.map_T_body) && IsNear(state.map_T_body.position) &&
                          state.velocity_map.allFinite() && state.gyro_bias.allFinite() &&
                          state.accel_bias.allFinite() &&
                          (i == 0 || truth.robot[i - 1].time_ns < state.time_ns);
    if (!is_sound) {
      return Wrong(absl::StrCat("robot state ", i, " at ", state.time_ns,
                                " ns is not finite, not unit or not after the one before"));
    }
  }
  for (size_t i = 0; i < truth.human_states.size(); ++i) {
    const HumanState& state = truth.human_states[i];
    DSG_RETURN_IF_ERROR(CheckIndex(state.human, 0, truth.humans.size(), "human of a state"));
    bool is_sound = IsValidPose(state.map_T_torso) && IsNear(state.map_T_torso.position);
    // Joints are written with AppendFixed, which has a range.
    for (const auto& joint : state.joints_map) {
      is_sound &= joint.allFinite() && joint.cwiseAbs().maxCoeff() < 1e9;
    }
    if (i > 0) {
      const HumanState& before = truth.human_states[i - 1];
      is_sound &= std::pair(before.time_ns, before.human) < std::pair(state.time_ns, state.human);
    }
    if (!is_sound) {
      return Wrong(absl::StrCat("human state ", i, " at ", state.time_ns,
                                " ns is not finite, not unit or out of order"));
    }
  }
  for (const DetectionTruth& detection : truth.detections) {
    DSG_RETURN_IF_ERROR(CheckIndex(detection.human, -1, truth.humans.size(),
                                   absl::StrCat("human of detection ", detection.id)));
    const bool is_share = detection.visibility >= 0.0 && detection.visibility <= 1.0;
    if (!is_share || !std::isfinite(detection.distance_m) || !IsNear(detection.torso_map) ||
        !IsNear(detection.detected_torso_map)) {
      return Wrong(absl::StrCat("detection ", detection.id,
                                " has a position beyond 1e7 m, a visibility that is no share, or a "
                                "number that is not finite"));
    }
  }
  return absl::OkStatus();
}

}  // namespace

absl::Status CheckTruth(const Truth& truth) {
  if (truth.begin_ns < 0 || truth.end_ns > kTimeNsMax) {
    return Wrong(absl::StrCat("the log lasts from ", truth.begin_ns, " to ", truth.end_ns,
                              " ns; times are from 0 to ", kTimeNsMax));
  }
  if (truth.begin_ns > truth.end_ns) {
    return Wrong(absl::StrCat("begin_ns ", truth.begin_ns, " is after end_ns ", truth.end_ns));
  }
  for (const auto& camera : truth.rig.cameras) DSG_RETURN_IF_ERROR(camera.Validate());
  if (truth.rig.imu.has_value()) DSG_RETURN_IF_ERROR(truth.rig.imu->Validate());
  DSG_RETURN_IF_ERROR(CheckGrid(truth.free_grid));
  DSG_RETURN_IF_ERROR(CheckMesh(truth));
  DSG_RETURN_IF_ERROR(CheckScene(truth));
  return CheckStates(truth);
}

}  // namespace dsg::truth
