// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/tracks/tracks_log.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ingest/files/output_file.h"
#include "ingest/files/output_folder.h"
#include "ingest/simulator/picture/preview.h"
#include "ingest/simulator/tracks/picks.h"
#include "ingest/simulator/tracks/presence.h"
#include "ingest/simulator/tracks/track_sensor.h"
#include "ingest/simulator/world/walker.h"
#include "ingest/simulator/world/world_graph.h"
#include "schema/base/status.h"
#include "schema/codec/proto_convert.h"
#include "schema/model/node.h"

namespace dsg::simulator {
namespace {

using ingest::AppendFixed;
using ingest::AppendInteger;
using ingest::OutputFile;

namespace fs = std::filesystem;

constexpr int kMetreDecimals = 6;
// Six would leave quaternions off unit length by more than readers should have to accept.
constexpr int kQuaternionDecimals = 9;

/// Everything that the parts of a log are made from.
struct Scene {
  const TracksOptions& options;
  const World& world;
  const Planner& planner;
  const std::vector<AgentSpec>& crowd;
  TimeNs duration_ns;

  uint64_t seed() const { return options.world.seed; }
  Walker NewWalker(const AgentSpec& agent) const { return Walker(&world, &planner, agent, seed()); }
};

/// All files of one log, so that they appear together at the end.
struct Files {
  OutputFile map;
  OutputFile tracks;
  OutputFile truth;
  OutputFile presence;
  OutputFile pauses;
  OutputFile picks;
  OutputFile readme;
  OutputFile preview;

  std::vector<OutputFile*> all() {
    return {&map, &truth, &presence, &pauses, &picks, &readme, &preview, &tracks};
  }
};

absl::Status CheckFolder(const TracksOptions& options) {
  DSG_RETURN_IF_ERROR(ingest::CheckIsFolderOrMissing(options.out));
  if (options.force || !ingest::HoldsFiles(options.out)) return absl::OkStatus();
  return absl::AlreadyExistsError(absl::StrCat(
      "--out ", options.out, " holds something already; name another folder or add --force"));
}

absl::Status CheckSpace(const TracksOptions& options) {
  constexpr double kRowBytes = 100.0;
  const double rows = static_cast<double>(options.crowd.people_count + 1) *
                      options.crowd.duration_s * options.sensor.rate_hz;
  return ingest::CheckDiskSpace(options.out, 2.0 * rows * kRowBytes,
                                "--people, --seconds or --rate");
}

absl::StatusOr<Files> CreateFiles(const std::string& out) {
  const fs::path folder(out);
  const auto create = [&](const char* name) {
    return OutputFile::Create((folder / name).string());
  };
  DSG_ASSIGN_OR_RETURN(OutputFile map, create("log/map.json"));
  DSG_ASSIGN_OR_RETURN(OutputFile tracks, create("log/tracks.csv"));
  DSG_ASSIGN_OR_RETURN(OutputFile truth, create("truth/tracks.csv"));
  DSG_ASSIGN_OR_RETURN(OutputFile presence, create("truth/presence.csv"));
  DSG_ASSIGN_OR_RETURN(OutputFile pauses, create("truth/pauses.csv"));
  DSG_ASSIGN_OR_RETURN(OutputFile picks, create("truth/picks.csv"));
  DSG_ASSIGN_OR_RETURN(OutputFile readme, create("README.txt"));
  DSG_ASSIGN_OR_RETURN(OutputFile preview, create("preview.png"));
  return Files{std::move(map),    std::move(tracks), std::move(truth),  std::move(presence),
               std::move(pauses), std::move(picks),  std::move(readme), std::move(preview)};
}

void AppendRow(TimeNs time_ns, const AgentSpec& agent, const Pose3d& pose, std::string* out) {
  AppendInteger(time_ns, out);
  out->push_back(',');
  out->append(agent.name);
  out->push_back(',');
  out->append(agent.is_robot ? kinds::kRobot : kinds::kHuman);
  for (int axis = 0; axis < 3; ++axis) {
    out->push_back(',');
    AppendFixed(pose.position[axis], kMetreDecimals, out);
  }
  for (int i = 0; i < 4; ++i) {
    out->push_back(',');
    AppendFixed(pose.orientation.coeffs()[i], kQuaternionDecimals, out);
  }
  out->push_back('\n');
}

absl::Status WriteTrackRows(const Scene& scene, const Progress& progress, Files* files,
                            TracksSummary* summary) {
  std::vector<Walker> walkers;
  std::vector<TrackSensor> sensors;
  for (const AgentSpec& agent : scene.crowd) {
    walkers.push_back(scene.NewWalker(agent));
    sensors.emplace_back(scene.options.sensor, agent, scene.seed());
  }
  for (OutputFile* file : {&files->tracks, &files->truth}) {
    absl::StrAppend(&file->buffer(), kTracksHeader, "\n");
  }
  // The crowd is sorted by name, so its indices sort as the names do.
  std::vector<std::pair<TimeNs, size_t>> samples(scene.crowd.size());
  const int64_t tick_count =
      TickCount(scene.options.crowd.duration_s, scene.options.sensor.rate_hz);
  for (int64_t tick = 0; tick < tick_count; ++tick) {
    for (size_t i = 0; i < sensors.size(); ++i) samples[i] = {sensors[i].SampleTime(tick), i};
    std::sort(samples.begin(), samples.end());
    for (const auto& [time_ns, i] : samples) {
      const AgentSpec& agent = scene.crowd[i];
      const FloorPose truth = walkers[i].PoseAt(time_ns);
      AppendRow(time_ns, agent, BodyPose(truth, agent.is_robot), &files->truth.buffer());
      ++summary->truth_pose_count;
      DSG_RETURN_IF_ERROR(files->truth.Flush());
      if (sensors[i].IsLost(time_ns)) continue;
      AppendRow(time_ns, agent, sensors[i].Measure(truth), &files->tracks.buffer());
      ++summary->pose_count;
      DSG_RETURN_IF_ERROR(files->tracks.Flush());
    }
    if (progress) progress(static_cast<double>(tick + 1) / static_cast<double>(tick_count));
  }
  for (const TrackSensor& sensor : sensors) summary->gap_count += sensor.loss_count();
  return absl::OkStatus();
}

absl::Status WritePresence(const Scene& scene, OutputFile* file, TracksSummary* summary) {
  absl::StrAppend(&file->buffer(), "agent,room_id,room_name,enter_ns,exit_ns\n");
  for (const AgentSpec& agent : scene.crowd) {
    Walker walker = scene.NewWalker(agent);
    for (const RoomVisit& visit : RoomVisits(scene.world.plan, scene.duration_ns, &walker)) {
      absl::StrAppend(&file->buffer(), agent.name, ",", ToString(RoomId(visit.room)), ",",
                      scene.world.plan.rooms[visit.room].name, ",", visit.enter_ns, ",",
                      visit.exit_ns, "\n");
      ++summary->visit_count;
      DSG_RETURN_IF_ERROR(file->Flush());
    }
  }
  return absl::OkStatus();
}

absl::Status WritePauses(const Scene& scene, OutputFile* file) {
  absl::StrAppend(&file->buffer(), "agent,room_id,place_id,x,y,begin_ns,end_ns\n");
  for (const AgentSpec& agent : scene.crowd) {
    Walker walker = scene.NewWalker(agent);
    for (; walker.leg().begin_ns < scene.duration_ns; walker.NextLeg()) {
      const Leg& leg = walker.leg();
      const int room = scene.world.plan.RoomAt(leg.start.position);
      absl::StrAppend(&file->buffer(), agent.name, ",", ToString(RoomId(room)), ",",
                      ToString(PlaceId(leg.start.place)), ",");
      AppendFixed(leg.start.position.x(), kMetreDecimals, &file->buffer());
      file->buffer().push_back(',');
      AppendFixed(leg.start.position.y(), kMetreDecimals, &file->buffer());
      absl::StrAppend(&file->buffer(), ",", leg.begin_ns, ",",
                      std::min(leg.depart_ns, scene.duration_ns), "\n");
      DSG_RETURN_IF_ERROR(file->Flush());
    }
  }
  return absl::OkStatus();
}

void WritePicks(const Scene& scene, const std::vector<Pick>& picks, OutputFile* file) {
  absl::StrAppend(&file->buffer(), "agent,object_id,object,room_id,seen_ns,at_ns,missed_ns\n");
  for (const Pick& pick : picks) {
    const Furniture& item = scene.world.furniture[pick.object];
    absl::StrAppend(&file->buffer(), scene.crowd[pick.agent].name, ",",
                    ToString(ObjectId(static_cast<int>(pick.object))), ",", item.name, ",",
                    ToString(RoomId(item.room)), ",", pick.seen_ns, ",", pick.at_ns, ",",
                    pick.missed_ns, "\n");
  }
}

// A few agents for a few minutes; more would be a scribble.
std::vector<PreviewTrack> PreviewTracks(const Scene& scene) {
  constexpr size_t kTrackCountMax = 12;
  constexpr TimeNs kDurationNsMax = 180 * kNsPerSecond;
  const TimeNs until_ns = std::min(scene.duration_ns, kDurationNsMax);
  std::vector<PreviewTrack> tracks;
  for (const AgentSpec& agent : scene.crowd) {
    // The robot comes last by name, but is always shown.
    if (tracks.size() + 1 >= kTrackCountMax && !agent.is_robot) continue;
    PreviewTrack track{agent.name, {}};
    Walker walker = scene.NewWalker(agent);
    for (TimeNs t = 0; t <= until_ns; t += kNsPerSecond / 10) {
      const Point position = walker.PoseAt(t).position;
      if (track.points.empty() || track.points.back() != position) track.points.push_back(position);
    }
    tracks.push_back(std::move(track));
  }
  return tracks;
}

std::string Readme(const TracksOptions& options) {
  return absl::StrFormat(
      "A generated log of tracked people and a robot, with its ground truth.\n"
      "Made by dsg-simulate tracks --world %s --seed %u --people %d --seconds %g --rate %g\n"
      "  --noise-m %g --noise-yaw %g --jitter-s %g --gap-rate %g --picks %d\n\n"
      "log/map.json       the building as a scene graph: rooms, places, objects, structures\n"
      "log/tracks.csv     what the tracker saw; give the folder log/ to dsg-ingest\n"
      "truth/tracks.csv   the same instants without noise and without gaps\n"
      "truth/presence.csv who was in which room, [enter_ns, exit_ns), exact\n"
      "truth/pauses.csv   where people stood still, and for how long\n"
      "truth/picks.csv    which things people took away, and when; --picks asks for them\n"
      "preview.png        the building from above, with the first minutes of some tracks\n\n"
      "Frame: one map frame, right-handed, x and y along the walls, z up, origin at a corner of\n"
      "the building on the floor. Metres. Orientation: Hamilton quaternion x y z w of the body, "
      "whose\n"
      "x axis points where it walks. People: a point on the floor (z = 0). Robot: its body, 0.2 m\n"
      "above the floor.\n"
      "Time: nanoseconds from the start of the recording, without a clock. Rows are sorted by\n"
      "time, then agent; stamps of one agent strictly grow. Stamps say when a sample was really\n"
      "taken: the sampling is uneven, the stamps are not wrong.\n"
      "Rooms reach to the middle of their walls. People do not avoid each other. A person's track\n"
      "is lost now and then for %g to %g s; the robot's never.\n",
      std::string(Name(options.world.kind)), options.world.seed, options.crowd.people_count,
      options.crowd.duration_s, options.sensor.rate_hz, options.sensor.position_noise_m,
      options.sensor.yaw_noise_rad, options.sensor.clock_jitter_s, options.sensor.gap_rate_per_min,
      options.pick_count, options.sensor.gap_s_min, options.sensor.gap_s_max);
}

}  // namespace

absl::StatusOr<TracksSummary> WriteTracks(const TracksOptions& options, const Progress& progress) {
  DSG_RETURN_IF_ERROR(options.Validate());
  DSG_RETURN_IF_ERROR(CheckFolder(options));
  DSG_RETURN_IF_ERROR(CheckSpace(options));
  DSG_ASSIGN_OR_RETURN(const World world, GenerateWorld(options.world));
  for (const char* folder : {"/log", "/truth"}) {
    DSG_RETURN_IF_ERROR(ingest::MakeFolder(options.out + folder));
  }
  DSG_ASSIGN_OR_RETURN(Files files, CreateFiles(options.out));

  const Planner planner(&world);
  const std::vector<AgentSpec> crowd = MakeCrowd(options.crowd.people_count);
  const auto duration_ns = static_cast<TimeNs>(
      std::llround(options.crowd.duration_s * static_cast<double>(kNsPerSecond)));
  const Scene scene{options, world, planner, crowd, duration_ns};

  TracksSummary summary;
  summary.room_count = static_cast<int64_t>(world.plan.rooms.size());
  summary.object_count = static_cast<int64_t>(world.furniture.size());
  summary.place_count = static_cast<int64_t>(world.places.places.size());
  summary.people_count = options.crowd.people_count;
  const std::vector<Pick> picks =
      DrawPicks(world, planner, crowd, scene.seed(), duration_ns, options.pick_count);
  summary.pick_count = static_cast<int64_t>(picks.size());
  GraphDelta graph = WorldGraph(world);
  ApplyPicks(picks, &graph);
  files.map.buffer() = DeltaToJson(graph);
  WritePicks(scene, picks, &files.picks);
  files.readme.buffer() = Readme(options);
  DSG_ASSIGN_OR_RETURN(files.preview.buffer(), DrawPreview(world, PreviewTracks(scene)));
  DSG_RETURN_IF_ERROR(WritePresence(scene, &files.presence, &summary));
  DSG_RETURN_IF_ERROR(WritePauses(scene, &files.pauses));
  DSG_RETURN_IF_ERROR(WriteTrackRows(scene, progress, &files, &summary));
  for (OutputFile* file : files.all()) {
    summary.byte_count += file->byte_count();
    DSG_RETURN_IF_ERROR(file->Commit());
  }
  return summary;
}

}  // namespace dsg::simulator
