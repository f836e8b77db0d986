// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/sensors_log.h"

#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <thread>

#include "absl/strings/str_cat.h"
#include "ingest/files/output_file.h"
#include "ingest/files/output_folder.h"
#include "ingest/simulator/bag/bag_writer.h"
#include "ingest/simulator/sensors/frame_files.h"
#include "ingest/simulator/sensors/free_grid.h"
#include "ingest/simulator/sensors/log_layout.h"
#include "ingest/simulator/sensors/log_tables.h"
#include "ingest/simulator/sensors/observation.h"
#include "ingest/simulator/sensors/session.h"
#include "ingest/simulator/sensors/truth_builder.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

namespace fs = std::filesystem;

using ingest::WriteFile;

/// The folders of a run.
struct Folders {
  explicit Folders(const std::string& folder)
      : out(folder),
        log(out + "/log"),
        truth(out + "/truth"),
        bag(out + "/log.bag"),
        work(absl::StrCat(out, "/", kWorkFolder)),
        work_log(work + "/log"),
        work_truth(work + "/truth"),
        options(work + "/options.txt") {}

  std::string out, log, truth, bag, work, work_log, work_truth, options;
};

std::string ReadText(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

absl::Status Remove(const std::string& path) {
  std::error_code error;
  fs::remove_all(path, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(
      absl::StrCat("cannot remove ", path, ": ", error.message(), "; remove it by hand"));
}

absl::Status Rename(const std::string& from, const std::string& to) {
  std::error_code error;
  fs::rename(from, to, error);
  if (!error) return absl::OkStatus();
  return absl::UnavailableError(absl::StrCat("cannot rename ", from, " to ", to, ": ",
                                             error.message(), "; then run the command again"));
}

bool Exists(const std::string& path) {
  std::error_code error;
  return fs::exists(path, error);
}

// Whether the folder may be written to, or continued.
absl::Status CheckFolder(const Folders& folders, const SensorsOptions& options,
                         const SensorsRun& run) {
  DSG_RETURN_IF_ERROR(ingest::CheckIsFolderOrMissing(folders.out));
  if (run.force) return absl::OkStatus();
  if (Exists(folders.log)) {
    return absl::AlreadyExistsError(absl::StrCat(
        "--out ", folders.out, " holds a finished log; name another folder, or add --force"));
  }
  if (!Exists(folders.work)) {
    if (!ingest::HoldsFiles(folders.out)) return absl::OkStatus();
    return absl::AlreadyExistsError(absl::StrCat(
        "--out ", folders.out, " holds something already; name another folder or add --force"));
  }
  const std::string begun = ReadText(folders.options);
  if (begun.empty() || begun == options.CommandLine()) return absl::OkStatus();
  return absl::AlreadyExistsError(absl::StrCat("--out ", folders.out,
                                               " holds a log that was begun with other options (",
                                               begun, "); finish it with those, or add --force"));
}

absl::Status CheckSpace(const Folders& folders, const SensorsOptions& options,
                        const SensorsRun& run) {
  constexpr double kPairBytes = 560e3;
  constexpr double kKeyframeBytes = 900e3;
  constexpr double kRawPairBytes = 700e3;
  constexpr double kRawKeyframeBytes = 5.2e6;
  const auto frames = static_cast<double>(options.FrameCount());
  const double keyframes = frames / options.keyframe_every;
  double needed = frames * kPairBytes + keyframes * kKeyframeBytes;
  if (run.bag) needed += frames * kRawPairBytes + keyframes * kRawKeyframeBytes;
  return ingest::CheckDiskSpace(folders.out, needed, "--seconds or --rate");
}

absl::Status PrepareFolders(const Folders& folders, const SensorsOptions& options,
                            const SensorsRun& run) {
  if (run.force) {
    const bool continues = ReadText(folders.options) == options.CommandLine();
    for (const std::string& old : {folders.log, folders.truth, folders.bag}) {
      DSG_RETURN_IF_ERROR(Remove(old));
    }
    if (!continues) DSG_RETURN_IF_ERROR(Remove(folders.work));
  }
  for (const std::string& folder : {folders.work_log, folders.work_truth}) {
    DSG_RETURN_IF_ERROR(ingest::MakeFolder(folder));
  }
  if (Exists(folders.options)) return absl::OkStatus();
  // Two runs over two ranges may both find it missing, so each writes a file of its own name.
  const std::string own = absl::StrCat(folders.options, ".", getpid());
  DSG_RETURN_IF_ERROR(WriteFile(own, options.CommandLine()));
  return Rename(own, folders.options);
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
      session.options().world.seed, {});
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
absl::Status Finish(const SensorSession& session, const Folders& folders, int thread_count,
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
  DSG_RETURN_IF_ERROR(WriteLogTables(session, detections.outputs, folders.work_log));
  return WriteFile(folders.work_log + "/log.json", LogJson(session, detections.outputs.size()));
}

absl::Status Publish(const SensorsOptions& options, const Folders& folders) {
  DSG_RETURN_IF_ERROR(WriteFile(folders.out + "/README.txt", Readme(options)));
  // A run that was cut off between the two renames has moved the truth already.
  if (Exists(folders.work_truth + "/world.json")) {
    DSG_RETURN_IF_ERROR(Remove(folders.truth));
    DSG_RETURN_IF_ERROR(Rename(folders.work_truth, folders.truth));
  }
  DSG_RETURN_IF_ERROR(Rename(folders.work_log, folders.log));
  return Remove(folders.work);
}

void Count(const SensorSession& session, SensorsSummary* summary) {
  summary->frame_count = session.frame_count();
  for (int64_t frame = 0; frame < session.frame_count(); ++frame) {
    summary->keyframe_count += session.IsKeyframe(frame) ? 1 : 0;
  }
  summary->imu_count = static_cast<int64_t>(session.imu().size());
  summary->pick_count = static_cast<int64_t>(session.crowd().picks().size());
  summary->rooms_visited = session.robot().rooms_visited();
  for (const Room& room : session.world().plan.rooms) {
    summary->room_count += room.is_passage ? 0 : 1;
  }
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
  const Folders folders(run.out);
  DSG_RETURN_IF_ERROR(CheckFolder(folders, options, run));
  DSG_RETURN_IF_ERROR(CheckSpace(folders, options, run));
  DSG_RETURN_IF_ERROR(PrepareFolders(folders, options, run));
  if (progress) progress("making the world", 0.0);
  DSG_ASSIGN_OR_RETURN(const std::unique_ptr<SensorSession> session, SensorSession::Make(options));
  const int thread_count = run.thread_count > 0
                               ? run.thread_count
                               : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  DSG_RETURN_IF_ERROR(RenderFrames(*session, range, folders.work_log, thread_count, progress));
  SensorsSummary summary;
  Count(*session, &summary);
  if (run.frames.has_value()) return summary;
  DSG_RETURN_IF_ERROR(Finish(*session, folders, thread_count, progress, &summary));
  DSG_RETURN_IF_ERROR(Publish(options, folders));
  if (run.bag) {
    DSG_RETURN_IF_ERROR(WriteBag(folders.log, folders.bag, [&](double share) {
      if (progress) progress("writing the bag", share);
    }));
  }
  summary.is_finished = true;
  return summary;
}

}  // namespace dsg::simulator
