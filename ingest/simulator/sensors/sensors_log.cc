// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/sensors_log.h"

#include <algorithm>
#include <filesystem>
#include <thread>

#include "absl/strings/str_cat.h"
#include "ingest/files/output_file.h"
#include "ingest/files/output_folder.h"
#include "ingest/simulator/bag/bag_writer.h"
#include "ingest/simulator/sensors/frame_files.h"
#include "ingest/simulator/sensors/free_grid.h"
#include "ingest/simulator/sensors/log_folder.h"
#include "ingest/simulator/sensors/log_layout.h"
#include "ingest/simulator/sensors/log_tables.h"
#include "ingest/simulator/sensors/observation.h"
#include "ingest/simulator/sensors/session.h"
#include "ingest/simulator/sensors/truth_builder.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

using ingest::WriteFile;

absl::Status CheckSpace(const LogPaths& paths, const SensorsOptions& options,
                        const SensorsRun& run) {
  constexpr double kPairBytes = 560e3;
  constexpr double kKeyframeBytes = 900e3;
  constexpr double kRawPairBytes = 700e3;
  constexpr double kRawKeyframeBytes = 5.2e6;
  const auto frames = static_cast<double>(options.FrameCount());
  const double keyframes = frames / options.keyframe_every;
  double needed = frames * kPairBytes + keyframes * kKeyframeBytes - BytesBelow(paths.work_log);
  if (run.bag) needed += frames * kRawPairBytes + keyframes * kRawKeyframeBytes;
  return ingest::CheckDiskSpace(paths.out, needed, "--seconds or --rate");
}

DetectorResult Detect(const SensorSession& session, const Observation& observation) {
  std::vector<ShapeCoefficients> shapes;
  for (int i = 0; i < session.crowd().count(); ++i) {
    shapes.push_back(session.crowd().body(i).shape());
  }
  const ingest::CameraCalibration& camera = *session.rig().FindCamera(kLeftChannel);
  return MakeDetections(
      observation.views,
      [&](const BodyView& view) { return session.MapTCamera(camera, view.frame); }, camera, shapes,
      session.options().world.seed, {.has_bodies = session.options().has_bodies});
}

double ObservedShare(const truth::FreeGrid& grid) {
  int64_t free_count = 0;
  int64_t seen_count = 0;
  for (const uint8_t cell : grid.cells) {
    if ((cell & truth::kCellFree) == 0) continue;
    ++free_count;
    seen_count += (cell & truth::kCellObserved) != 0 ? 1 : 0;
  }
  return free_count == 0 ? 0.0 : static_cast<double>(seen_count) / static_cast<double>(free_count);
}

std::string Readme(const SensorsOptions& options) {
  return absl::StrCat(
      "A generated sensor log with its ground truth.\nMade by ", options.CommandLine(),
      "\n\nlog/    what the sensors recorded; give this folder to dsg-ingest\n"
      "truth/  what really was; for dsg-eval only\n"
      "The format of both is described in docs/sensor_logs.md and docs/evaluation.md.\n"
      "Look at it: dsg-simulate preview this folder.\n");
}

// Everything but the images. Whole at the end, or begun anew by the next run.
absl::Status Finish(const SensorSession& session, const LogPaths& folders, int thread_count,
                    const SensorsProgress& progress, SensorsSummary* summary) {
  const Eigen::Vector3d start = session.robot().StateAt(0).map_T_body.position;
  truth::FreeGrid grid = MakeFreeGrid(session.world(), session.scene(), start.head<2>());
  DSG_ASSIGN_OR_RETURN(const Observation observation,
                       Observe(session, thread_count, progress, &grid));
  const DetectorResult detections = Detect(session, observation);
  summary->detections = detections.statistics;
  summary->free_observed_share = ObservedShare(grid);
  if (progress) progress("writing the truth", 0.0);
  const truth::Truth truth = BuildTruth(session, observation, detections.outputs, std::move(grid));
  DSG_RETURN_IF_ERROR(truth::WriteTruth(truth, folders.work_truth));
  DSG_RETURN_IF_ERROR(WriteCadModels(session, folders.work_truth));
  DSG_RETURN_IF_ERROR(WriteTrueBodies(session, detections.outputs, folders.work_truth));
  DSG_RETURN_IF_ERROR(WriteLogTables(session, detections.outputs, folders.work_log));
  return WriteFile(folders.work_log + "/log.json", LogJson(session, detections.outputs.size()));
}

void Count(const SensorSession& session, SensorsSummary* summary) {
  summary->frame_count = session.frame_count();
  for (int64_t frame = 0; frame < session.frame_count(); ++frame) {
    summary->keyframe_count += session.IsKeyframe(frame) ? 1 : 0;
  }
  summary->imu_count = static_cast<int64_t>(session.imu().size());
  summary->pick_count = static_cast<int64_t>(session.crowd().picks().size());
  summary->rooms_visited = session.robot().rooms_visited();
  summary->room_count = static_cast<int64_t>(session.world().plan.rooms.size());
}

absl::Status MakeBag(const LogPaths& paths, const SensorsProgress& progress) {
  return WriteBag(paths.log, paths.bag, [&](double share) {
    if (progress) progress("writing the bag", share);
  });
}

// The log is there; all that can be missing is its bag.
absl::StatusOr<SensorsSummary> AddBag(const LogPaths& paths, const SensorsRun& run,
                                      const SensorsProgress& progress) {
  std::error_code error;
  if (!run.bag || std::filesystem::exists(paths.bag, error)) {
    return absl::AlreadyExistsError(
        absl::StrCat("--out ", paths.out,
                     " holds this very log, finished; name another folder, or add --force"));
  }
  DSG_RETURN_IF_ERROR(MakeBag(paths, progress));
  SensorsSummary summary;
  summary.is_bag_only = true;
  return summary;
}

absl::Status CheckFrames(const FrameRange& range, int64_t frame_count) {
  if (range.end <= frame_count) return absl::OkStatus();
  return MakeError(Reason::kFieldInvalid,
                   absl::StrCat("--frames ends at ", range.end, ", but the log has ", frame_count,
                                " frames; lower it or raise --seconds"),
                   {{"field", "--frames"}, {"value", absl::StrCat(range.end)}});
}

}  // namespace

absl::StatusOr<SensorsSummary> WriteSensors(const SensorsOptions& options, const SensorsRun& run,
                                            const SensorsProgress& progress) {
  DSG_RETURN_IF_ERROR(options.Validate());
  const FrameRange range = run.frames.value_or(FrameRange{0, options.FrameCount()});
  DSG_RETURN_IF_ERROR(CheckFrames(range, options.FrameCount()));
  const LogPaths paths(run.out);
  const std::string command = options.CommandLine();
  DSG_ASSIGN_OR_RETURN(const FolderState state, InspectFolder(paths, command, run.force));
  SensorsSummary summary;
  if (state == FolderState::kFinished) return AddBag(paths, run, progress);
  DSG_RETURN_IF_ERROR(CheckSpace(paths, options, run));
  DSG_RETURN_IF_ERROR(PrepareFolder(paths, command, run.force));
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<FolderLock> lock,
                       FolderLock::Take(paths, !run.frames.has_value()));
  if (progress) progress("making the world", 0.0);
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<SensorSession> session, SensorSession::Make(options));
  const int thread_count = run.thread_count > 0
                               ? run.thread_count
                               : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  DSG_RETURN_IF_ERROR(RenderFrames(*session, range, paths.work_log, thread_count, progress));
  Count(*session, &summary);
  if (run.frames.has_value()) return summary;
  DSG_RETURN_IF_ERROR(Finish(*session, paths, thread_count, progress, &summary));
  DSG_RETURN_IF_ERROR(WriteFile(paths.out + "/README.txt", Readme(options)));
  DSG_RETURN_IF_ERROR(PublishFolder(paths));
  if (run.bag) DSG_RETURN_IF_ERROR(MakeBag(paths, progress));
  summary.is_finished = true;
  return summary;
}

}  // namespace dsg::simulator
