// SPDX-License-Identifier: Apache-2.0
#include "ingest/pipeline/upright.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/strings/str_split.h"
#include "ingest/depth/frame_maker.h"
#include "ingest/log/moved_log.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

constexpr OptionField<UprightOptions> kUprightFields[] = {
    {"up-pictures", &UprightOptions::frame_count, 1, 1000,
     "With --up auto: pictures that are looked at, spread over the log: walls and floors of most "
     "of it"},
    {"up-aslant", &UprightOptions::upright_rad, 0.0, 3.2,
     "A log that stands aslant by less is left alone, radians: its poses know better than a look "
     "at the walls"},
};

// Farther away no map has anything.
constexpr double kShiftMaxM = 1e6;

// So many finite numbers with commas between them; nullopt of anything else.
std::optional<std::vector<double>> NumbersOf(const std::string& text, size_t count) {
  std::vector<double> numbers;
  for (const absl::string_view part : absl::StrSplit(text, ',')) {
    double number = 0.0;
    if (!absl::SimpleAtod(part, &number) || !std::isfinite(number)) return std::nullopt;
    numbers.push_back(number);
  }
  return numbers.size() == count ? std::optional(numbers) : std::nullopt;
}

absl::StatusOr<Eigen::Vector3d> ParseUp(const std::string& up) {
  for (int axis = 0; axis < 3; ++axis) {
    const std::string name(1, static_cast<char>('x' + axis));
    if (up == name || up == "+" + name) return Eigen::Vector3d::Unit(axis);
    if (up == "-" + name) return -Eigen::Vector3d::Unit(axis);
  }
  const std::optional<std::vector<double>> numbers = NumbersOf(up, 3);
  Eigen::Vector3d vector = Eigen::Vector3d::Zero();
  if (numbers.has_value()) vector = Eigen::Map<const Eigen::Vector3d>(numbers->data());
  if (vector.norm() > 1e-6 && vector.norm() < 1e6) return vector.normalized();
  return MakeError(
      Reason::kFieldInvalid,
      absl::StrCat("--up ", up,
                   " is no direction; give auto, none, x, -x, y, -y, z, -z or three numbers "
                   "\"x,y,z\" of a vector that points up in the log's frame"),
      {{"field", "up"}, {"value", up}});
}

// A few of the log's frames; depth pictures in between are never decoded.
absl::StatusOr<std::vector<DepthFrame>> SpreadFrames(LogSource& log, int frame_count) {
  RobotPath path;
  FrameMaker maker(log.info().rig, DepthOptions(), path);
  std::vector<DepthFrame> frames;
  const auto take = [&maker, &frames] {
    while (std::optional<DepthFrame> frame = maker.Next()) frames.push_back(*std::move(frame));
  };
  const auto depth = log.info().channel_counts.find("depth0");
  const int64_t depth_count = depth == log.info().channel_counts.end() ? 0 : depth->second;
  const int64_t stride = std::max<int64_t>(1, depth_count / frame_count);
  int64_t seen = 0;
  while (true) {
    DSG_ASSIGN_OR_RETURN(std::optional<Measurement> measurement, log.Next());
    if (!measurement.has_value()) break;
    if (const auto* pose = std::get_if<PoseMeasurement>(&*measurement)) {
      if (path.Add(pose->pose)) maker.NotePose();
    } else if (auto* image = std::get_if<ImageMeasurement>(&*measurement)) {
      if (image->channel != "depth0" || seen++ % stride != 0) continue;
      maker.AddPicture({image->time_ns, image->channel, image->origin, image->load});
    }
    take();
  }
  maker.Finish();
  take();
  return frames;
}

}  // namespace

std::vector<BoundOption> UprightOptions::Bind() {
  std::vector<BoundOption> bound;
  BindFields<UprightOptions>(kUprightFields, this, &bound);
  const std::vector<BoundOption> gravity_bound = gravity.Bind();
  bound.insert(bound.end(), gravity_bound.begin(), gravity_bound.end());
  return bound;
}

absl::StatusOr<Pose3d> ParseTransform(const std::string& text) {
  const std::optional<std::vector<double>> numbers = NumbersOf(text, 4);
  const std::vector<double> n = numbers.value_or(std::vector<double>());
  const bool is_within = !n.empty() &&
                         std::max({std::abs(n[0]), std::abs(n[1]), std::abs(n[2])}) <= kShiftMaxM &&
                         std::abs(n[3]) <= 2.0 * M_PI;
  if (!is_within) {
    return MakeError(
        Reason::kFieldInvalid,
        absl::StrCat("--transform ", text, " is no transform; write X,Y,Z,YAW: metres, at most ",
                     kShiftMaxM, ", and radians, at most a whole turn"),
        {{"field", "transform"}, {"value", text}});
  }
  return Pose3d{{n[0], n[1], n[2]},
                Eigen::Quaterniond(Eigen::AngleAxisd(n[3], Eigen::Vector3d::UnitZ()))};
}

absl::Status CheckUp(const std::string& up) {
  if (up == "auto" || up == "none") return absl::OkStatus();
  return ParseUp(up).status();
}

absl::StatusOr<std::unique_ptr<LogSource>> TurnUpright(
    std::unique_ptr<LogSource> log, const std::string& path, const LogOptions& options,
    const std::string& up, const UprightOptions& upright, std::string* note) {
  Eigen::Vector3d up_log = Eigen::Vector3d::UnitZ();
  if (up == "auto") {
    if (log->info().format != "rgbd" || !log->info().channel_counts.contains("depth0")) return log;
    DSG_ASSIGN_OR_RETURN(const std::vector<DepthFrame> frames,
                         SpreadFrames(*log, upright.frame_count));
    DSG_ASSIGN_OR_RETURN(log, OpenLog(path, options));
    const std::optional<Eigen::Vector3d> found = EstimateUp(frames, upright.gravity);
    if (!found.has_value()) {
      *note = "which way is up could not be told from the pictures; z is taken for up, give --up";
      return log;
    }
    up_log = *found;
  } else if (up != "none") {
    DSG_ASSIGN_OR_RETURN(up_log, ParseUp(up));
  }
  if (std::acos(std::clamp(up_log.z(), -1.0, 1.0)) < upright.upright_rad) return log;
  *note = absl::StrFormat("the log's (%.3f, %.3f, %.3f) points up; its poses are turned",
                          up_log.x(), up_log.y(), up_log.z());
  return MoveLog(std::move(log), {Eigen::Vector3d::Zero(), Eigen::Quaterniond::FromTwoVectors(
                                                               up_log, Eigen::Vector3d::UnitZ())});
}

}  // namespace dsg::ingest
