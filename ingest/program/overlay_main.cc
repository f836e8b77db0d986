// SPDX-License-Identifier: Apache-2.0
// dsg-overlay: images of a log with what a map has there drawn over them, as PNG files.
// Refuses to change anything of the map; poses are the map's, calibration is the log's.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/config/option_flags.h"
#include "ingest/files/output_folder.h"
#include "ingest/log/log_source.h"
#include "ingest/overlay/draw_overlay.h"
#include "ingest/overlay/map_scene.h"
#include "ingest/program/progress.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"
#include "schema/program/command_line.h"
#include "schema/program/manual.h"
#include "schema/store/graph_store.h"

namespace dsg::ingest {
namespace {

struct OverlayFlags {
  std::string store;
  std::string map;
  std::string log;
  std::string out;
  std::string format = "auto";
  /// Empty = the first of kCameras that the log has.
  std::string camera;
  int64_t every = 10;
  /// Instants, each the first image at or after it; instead of `every`.
  std::vector<std::string> at;
  std::string robot;
  int64_t revision = 0;
  OverlayOptions options;
  bool is_forced = false;
  bool is_quiet = false;
};

constexpr const char* kCameras[] = {"cam0", "color0"};

void AddOverlayFlags(CLI::App* app, OverlayFlags* flags) {
  app->set_version_flag("--version", DSG_VERSION);
  app->add_option("LOG", flags->log, "The log that the map was made from, file or folder")
      ->required();
  app->add_option("--store", flags->store, "Folder of the store")->envname("DSG_STORE")->required();
  app->add_option("--map", flags->map, "Name of the map")->envname("DSG_MAP")->required();
  app->add_option("--out", flags->out, "Folder of the pictures; made if missing")->required();
  app->add_option(
      "--camera", flags->camera,
      "Channel of the images; default: cam0, of which detections mostly are, or color0");
  CLI::Option* every =
      app->add_option("--every", flags->every, "Draw the first image and every so manyth after it")
          ->check(CLI::Range(int64_t{1}, int64_t{1} << 40))
          ->capture_default_str();
  app->add_option("--at", flags->at,
                  "Draw the first image from this TIME on, as +12.5s; may be given several times")
      ->allow_extra_args(false)
      ->excludes(every);
  app->add_option("--robot", flags->robot,
                  "Name or id of the robot that carries the camera; default: the map's first one");
  app->add_option("--revision", flags->revision, "Revision of the map; default: the newest")
      ->check(CLI::Range(int64_t{1}, int64_t{1} << 60));
  app->add_option("--format", flags->format, "Format of the log, as dsg-ingest takes it")
      ->capture_default_str();
  app->add_flag("--force", flags->is_forced, "Replace existing pictures");
  app->add_flag("--quiet", flags->is_quiet, "Write nothing but errors");
  const OptionGroup group{"what is drawn", flags->options.Bind()};
  AddTuning({&group, 1}, app);
}

absl::StatusOr<const CameraCalibration*> ChooseCamera(const LogInfo& info,
                                                      const std::string& asked) {
  std::vector<std::string> known;
  for (const CameraCalibration& camera : info.rig.cameras) {
    // Depth and labels are no images of light.
    if (camera.name.starts_with("cam") || camera.name.starts_with("color")) {
      known.push_back(camera.name);
    }
  }
  for (const char* name : kCameras) {
    if (asked.empty() && std::count(known.begin(), known.end(), name) > 0) {
      return info.rig.FindCamera(name);
    }
  }
  if (std::count(known.begin(), known.end(), asked) > 0) return info.rig.FindCamera(asked);
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat(info.path, ": the log has no camera \"", asked, "\" to draw on; it has ",
                   known.empty() ? "none: give a log with images and a calibration"
                                 : absl::StrJoin(known, ", ")),
      {{"field", "--camera"}, {"value", asked}});
}

// An image that comes later than this after an instant does not show it.
constexpr TimeNs kNearNs = kNsPerSecond;

// Which images of a camera are drawn, in their order.
class ImagePicks {
 public:
  static absl::StatusOr<ImagePicks> Make(const OverlayFlags& flags, TimeNs epoch_ns) {
    ImagePicks picks;
    picks.every_ = flags.every;
    picks.is_timed_ = !flags.at.empty();
    for (const std::string& text : flags.at) {
      DSG_ASSIGN_OR_RETURN(const TimeNs at_ns, ParseTime(text, epoch_ns));
      picks.waiting_.push_back(at_ns);
    }
    std::sort(picks.waiting_.begin(), picks.waiting_.end());
    return picks;
  }

  bool Takes(TimeNs image_ns) {
    if (!is_timed_) return count_++ % every_ == 0;
    bool is_due = false;
    while (!waiting_.empty() && waiting_.front() <= image_ns) {
      const bool is_near = image_ns - waiting_.front() <= kNearNs;
      waiting_.erase(waiting_.begin());
      is_due |= is_near;
      missed_count_ += is_near ? 0 : 1;
    }
    return is_due;
  }
  /// No later image will be taken.
  bool IsDone() const { return is_timed_ && waiting_.empty(); }
  /// Instants that no image was near.
  size_t missed_count() const { return missed_count_ + waiting_.size(); }

 private:
  int64_t every_ = 1;
  int64_t count_ = 0;
  bool is_timed_ = false;
  /// Ascending.
  std::vector<TimeNs> waiting_;
  size_t missed_count_ = 0;
};

// Draws the images of a log as they come.
class OverlayRun {
 public:
  OverlayRun(const OverlayFlags& flags, const MapScene& scene, const CameraCalibration& camera)
      : flags_(flags), scene_(scene), camera_(camera) {}

  absl::Status Read(LogSource& log, ImagePicks picks) {
    Progress progress(std::filesystem::path(flags_.log).filename().string(),
                      log.info().measurement_count, flags_.is_quiet);
    // Detections have the stamp of their image, and come before or after it.
    std::optional<ImageMeasurement> waiting;
    std::vector<HumanDetection> detections;
    const auto finish = [&]() -> absl::Status {
      if (!waiting.has_value()) return absl::OkStatus();
      const ImageMeasurement image = *std::exchange(waiting, std::nullopt);
      std::erase_if(detections, [&](const HumanDetection& detection) {
        return detection.time_ns != image.time_ns;
      });
      return DrawImage(image, std::exchange(detections, {}));
    };
    for (int64_t count = 1; !picks.IsDone() || waiting.has_value(); ++count) {
      DSG_ASSIGN_OR_RETURN(std::optional<Measurement> next, log.Next());
      if (!next.has_value()) break;
      if (waiting.has_value() && StampOf(*next) > waiting->time_ns) DSG_RETURN_IF_ERROR(finish());
      if (auto* image = std::get_if<ImageMeasurement>(&*next)) {
        if (image->channel == camera_.name && picks.Takes(image->time_ns)) waiting = *image;
      }
      if (auto* detection = std::get_if<HumanDetection>(&*next)) {
        if (!detections.empty() && detections.front().time_ns < detection->time_ns) {
          detections.clear();
        }
        if (detection->camera == camera_.name) detections.push_back(std::move(*detection));
      }
      progress.Update(count);
    }
    DSG_RETURN_IF_ERROR(finish());
    missed_count_ = picks.missed_count();
    return absl::OkStatus();
  }

  /// Errors: OUT_OF_RANGE when nothing was drawn.
  absl::Status Tell() const {
    if (drawn_count_ == 0 && lost_count_ == 0 && missed_count_ > 0) {
      return absl::OutOfRangeError(
          absl::StrCat(camera_.name, " of ", flags_.log, " has no image within a second after ",
                       missed_count_, missed_count_ == 1 ? " time" : " times",
                       " of --at; give times of the log, as \"+3s\" from the epoch of the map"));
    }
    if (drawn_count_ == 0) {
      return absl::OutOfRangeError(absl::StrCat(
          "no image of ", camera_.name, " of ", flags_.log, " was drawn: of ", lost_count_,
          " the place of ", ToString(scene_.robot().node.id), " (", scene_.robot().node.name,
          ") is not known in map ", flags_.map,
          "; give the log that the map was made from, or another --at, --camera or --robot"));
    }
    if (flags_.is_quiet) return absl::OkStatus();
    std::string out = absl::StrCat(
        "wrote ", drawn_count_, drawn_count_ == 1 ? " picture of " : " pictures of ", camera_.name,
        " to ", flags_.out, " (revision ", scene_.snapshot().revision(), ")\n");
    if (lost_count_ > 0) {
      absl::StrAppend(&out, "left out where the robot was is not known: ", lost_count_, "\n");
    }
    if (missed_count_ > 0) {
      absl::StrAppend(
          &out, "times of --at without an image within a second after them: ", missed_count_, "\n");
    }
    std::fputs(out.c_str(), stdout);
    return absl::OkStatus();
  }

 private:
  absl::Status DrawImage(const ImageMeasurement& measured, std::vector<HumanDetection> detections) {
    DSG_ASSIGN_OR_RETURN(const std::optional<Pose3d> map_T_body, scene_.RobotAt(measured.time_ns));
    if (!map_T_body.has_value()) {
      ++lost_count_;
      return absl::OkStatus();
    }
    OverlayImage image{measured.time_ns, {}, std::move(detections)};
    DSG_ASSIGN_OR_RETURN(image.image, measured.load());
    const bool is_light =
        image.image.format == PixelFormat::kGray8 || image.image.format == PixelFormat::kRgb8;
    if (!is_light || image.image.width != camera_.width || image.image.height != camera_.height) {
      return MakeError(
          Reason::kFileMalformed,
          absl::StrCat(measured.origin, ": is a ", std::string(Name(image.image.format)),
                       " image of ", image.image.width, " x ", image.image.height,
                       " pixels; the calibration of ", camera_.name,
                       " says gray8 or "
                       "rgb8, ",
                       camera_.width, " x ", camera_.height),
          {{"file", measured.origin}});
    }
    DSG_ASSIGN_OR_RETURN(const picture::Picture picture,
                         DrawOverlayImage(scene_, *map_T_body, camera_, image, flags_.options));
    DSG_ASSIGN_OR_RETURN(const std::string png, picture::EncodePng(picture));
    const std::string path =
        absl::StrCat(flags_.out, "/", camera_.name, "_", measured.time_ns, ".png");
    DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(path, flags_.is_forced));
    DSG_RETURN_IF_ERROR(file.Write(png));
    ++drawn_count_;
    return file.Commit();
  }

  const OverlayFlags& flags_;
  const MapScene& scene_;
  const CameraCalibration& camera_;
  int64_t drawn_count_ = 0;
  int64_t lost_count_ = 0;
  size_t missed_count_ = 0;
};

absl::Status DrawOverlays(const OverlayFlags& flags) {
  DSG_RETURN_IF_ERROR(CheckIsFolderOrMissing(flags.out));
  DSG_RETURN_IF_ERROR(CheckMapName(flags.map));
  DSG_ASSIGN_OR_RETURN(const auto store, OpenStore(flags.store, {.program = "dsg-overlay"}));
  DSG_ASSIGN_OR_RETURN(const auto map, store->OpenMap(flags.map));
  DSG_ASSIGN_OR_RETURN(auto snapshot,
                       flags.revision == 0 ? map->Latest() : map->At(flags.revision));
  // Logs without a clock begin at the epoch of their map.
  const TimeNs epoch_ns = snapshot->spec().epoch_ns;
  DSG_ASSIGN_OR_RETURN(ImagePicks picks, ImagePicks::Make(flags, epoch_ns));
  // The map says where the robot was; the log need not.
  DSG_ASSIGN_OR_RETURN(
      const std::unique_ptr<LogSource> log,
      OpenLog(flags.log,
              {.format = flags.format, .epoch_ns = epoch_ns, .poses = PoseSource::kOdometry}));
  DSG_ASSIGN_OR_RETURN(const CameraCalibration* const camera,
                       ChooseCamera(log->info(), flags.camera));
  DSG_ASSIGN_OR_RETURN(const MapScene scene, MapScene::Read(std::move(snapshot), flags.robot));
  DSG_RETURN_IF_ERROR(MakeFolder(flags.out));
  OverlayRun run(flags, scene, *camera);
  DSG_RETURN_IF_ERROR(run.Read(*log, std::move(picks)));
  return run.Tell();
}

int OverlayMain(int argc, char** argv) {
  CLI::App app("dsg-overlay: draws what a map has over the images of its log", "dsg-overlay");
  OverlayFlags flags;
  AddOverlayFlags(&app, &flags);
  AddManual(&app, DSG_VERSION);
  return RunProgram(argc, argv, &app, [&] { return DrawOverlays(flags); });
}

}  // namespace
}  // namespace dsg::ingest

int main(int argc, char** argv) { return dsg::ingest::OverlayMain(argc, argv); }
