// SPDX-License-Identifier: Apache-2.0
#include "ingest/simulator/sensors/contact_sheet.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "ingest/files/output_file.h"
#include "ingest/files/output_folder.h"
#include "ingest/simulator/picture/preview.h"
#include "ingest/simulator/sensors/image_codec.h"
#include "ingest/simulator/sensors/label_colors.h"
#include "ingest/simulator/sensors/log_layout.h"
#include "ingest/simulator/world/world.h"
#include "ingest/truth/truth.h"
#include "schema/base/status.h"

namespace dsg::simulator {
namespace {

namespace fs = std::filesystem;

using ingest::Image;
using ingest::PixelFormat;

constexpr double kDepthShownM = 10.0;

const ImageChannel& ChannelNamed(std::string_view name) {
  const auto& channels = ImageChannels();
  return *std::find_if(channels.begin(), channels.end(),
                       [&](const ImageChannel& channel) { return channel.name == name; });
}

absl::StatusOr<std::vector<TimeNs>> KeyframeStamps(const std::string& log_folder) {
  std::error_code error;
  std::vector<TimeNs> stamps;
  for (const auto& entry :
       fs::directory_iterator(ChannelFolder(log_folder, kColorChannel) + "/data", error)) {
    const std::string stem = entry.path().stem().string();
    TimeNs stamp = 0;
    const auto [end, parsed] = std::from_chars(stem.data(), stem.data() + stem.size(), stamp);
    if (parsed == std::errc() && end == stem.data() + stem.size()) stamps.push_back(stamp);
  }
  std::sort(stamps.begin(), stamps.end());
  if (!stamps.empty()) return stamps;
  return absl::NotFoundError(
      absl::StrCat(log_folder,
                   " holds no finished log with colour images; give the folder that dsg-simulate "
                   "sensors --out named, after it has finished"));
}

// In the middles of `count` equal parts of the log.
std::vector<TimeNs> Spread(const std::vector<TimeNs>& stamps, int count) {
  std::vector<TimeNs> chosen;
  for (int i = 0; i < count; ++i) {
    const size_t index =
        stamps.size() * static_cast<size_t>(2 * i + 1) / static_cast<size_t>(2 * count);
    if (chosen.empty() || chosen.back() != stamps[index]) chosen.push_back(stamps[index]);
  }
  return chosen;
}

std::multimap<TimeNs, cv::Rect> DetectionBoxes(const std::string& log_folder) {
  std::multimap<TimeNs, cv::Rect> boxes;
  std::ifstream in(ChannelFolder(log_folder, "detections0") + "/data.jsonl");
  for (std::string line; std::getline(in, line);) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (!json.is_object() || !json.contains("box") || !json.contains("time_ns")) continue;
    const auto box = json["box"].get<std::vector<double>>();
    boxes.emplace(json["time_ns"].get<TimeNs>(),
                  cv::Rect(cv::Point2d(box[0], box[1]), cv::Point2d(box[2], box[3])));
  }
  return boxes;
}

cv::Mat ToMat(Image& image) {
  return {image.height, image.width, image.format == PixelFormat::kRgb8 ? CV_8UC3 : CV_16UC1,
          image.bytes.data()};
}

cv::Mat ColoredDepth(Image& depth) {
  cv::Mat near_bright;
  ToMat(depth).convertTo(near_bright, CV_8UC1, -255.0 / (1000.0 * kDepthShownM), 255.0);
  cv::Mat colored;
  cv::applyColorMap(near_bright, colored, cv::COLORMAP_TURBO);
  cv::cvtColor(colored, colored, cv::COLOR_BGR2RGB);
  colored.setTo(cv::Scalar(0, 0, 0), ToMat(depth) == 0);
  cv::putText(colored, absl::StrFormat("red 0 m, blue %g m, black: no reading", kDepthShownM),
              cv::Point(8, colored.rows - 10), cv::FONT_HERSHEY_SIMPLEX, 0.5,
              cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
  return colored;
}

// The class gives the colour, the instance a shade of it.
cv::Mat ColoredLabels(const Image& labels) {
  cv::Mat colored(labels.height, labels.width, CV_8UC3);
  for (int row = 0; row < labels.height; ++row) {
    for (int column = 0; column < labels.width; ++column) {
      const uint16_t label = ingest::LabelAt(labels, column, row);
      const Color color = LabelColor(label >> 8);
      const double shade = 1.0 - 0.4 * ((label & 0xff) * 37 % 8) / 7.0;
      colored.at<cv::Vec3b>(row, column) = cv::Vec3b(cv::saturate_cast<uint8_t>(shade * color[0]),
                                                     cv::saturate_cast<uint8_t>(shade * color[1]),
                                                     cv::saturate_cast<uint8_t>(shade * color[2]));
    }
  }
  return colored;
}

absl::Status WritePng(const std::string& path, const cv::Mat& rgb) {
  Image image{rgb.cols, rgb.rows, PixelFormat::kRgb8, {}};
  const cv::Mat whole = rgb.isContinuous() ? rgb : rgb.clone();
  image.bytes.assign(whole.datastart, whole.dataend);
  DSG_ASSIGN_OR_RETURN(std::string png, EncodePng(image));
  return ingest::WriteFile(path, std::move(png));
}

/// Camera, depth and labels of some instants, one below the other.
struct Columns {
  std::vector<cv::Mat> camera, depth, labels;
};

absl::Status CheckSize(const Image& image, const Image& first, TimeNs stamp) {
  if (image.width == first.width && image.height == first.height) return absl::OkStatus();
  return absl::DataLossError(absl::StrCat("the images of ", stamp, " ns are of different sizes, ",
                                          first.width, " x ", first.height, " and ", image.width,
                                          " x ", image.height, "; simulate the log again"));
}

absl::StatusOr<Columns> ReadColumns(const std::string& log_folder,
                                    const std::vector<TimeNs>& stamps, TimeNs begin_ns) {
  const std::multimap<TimeNs, cv::Rect> boxes = DetectionBoxes(log_folder);
  Columns columns;
  for (const TimeNs stamp : stamps) {
    DSG_ASSIGN_OR_RETURN(
        Image color,
        DecodeFile(ImagePath(log_folder, ChannelNamed(kColorChannel), stamp), PixelFormat::kRgb8));
    DSG_ASSIGN_OR_RETURN(Image depth,
                         DecodeFile(ImagePath(log_folder, ChannelNamed(kDepthChannel), stamp),
                                    PixelFormat::kDepth16));
    DSG_ASSIGN_OR_RETURN(const Image labels,
                         DecodeFile(ImagePath(log_folder, ChannelNamed(kLabelsChannel), stamp),
                                    PixelFormat::kLabel16));
    DSG_RETURN_IF_ERROR(CheckSize(depth, color, stamp));
    DSG_RETURN_IF_ERROR(CheckSize(labels, color, stamp));
    cv::Mat camera = ToMat(color).clone();
    if (!columns.camera.empty() && columns.camera.front().size() != camera.size()) {
      return absl::DataLossError(absl::StrCat("the image of ", stamp, " ns is of another size"));
    }
    const auto [first, last] = boxes.equal_range(stamp);
    for (auto box = first; box != last; ++box) {
      cv::rectangle(camera, box->second, cv::Scalar(255, 210, 0), 2);
    }
    const std::string time =
        absl::StrFormat("t = %.2f s", static_cast<double>(stamp - begin_ns) * 1e-9);
    cv::putText(camera, time, cv::Point(8, 22), cv::FONT_HERSHEY_SIMPLEX, 0.6,
                cv::Scalar(255, 255, 255), 2, cv::LINE_AA);
    columns.camera.push_back(camera);
    columns.depth.push_back(ColoredDepth(depth));
    columns.labels.push_back(ColoredLabels(labels));
  }
  return columns;
}

absl::Status WriteImages(const Columns& columns, const std::string& out,
                         std::vector<std::string>* paths) {
  std::vector<cv::Mat> stacked;
  for (const auto& [name, images] :
       {std::pair("camera.png", &columns.camera), std::pair("depth.png", &columns.depth),
        std::pair("labels.png", &columns.labels)}) {
    cv::Mat column;
    cv::vconcat(*images, column);
    stacked.push_back(column);
    paths->push_back(absl::StrCat(out, "/", name));
    DSG_RETURN_IF_ERROR(WritePng(paths->back(), column));
  }
  cv::Mat sheet;
  cv::hconcat(stacked, sheet);
  cv::resize(sheet, sheet, cv::Size(), 0.5, 0.5, cv::INTER_AREA);
  paths->push_back(out + "/sheet.png");
  return WritePng(paths->back(), sheet);
}

// A few people are enough; more would be a scribble.
std::vector<PreviewTrack> Tracks(const truth::Truth& truth) {
  constexpr int kPeopleMax = 11;
  constexpr size_t kRobotStride = 40;
  std::vector<PreviewTrack> tracks;
  for (const truth::Human& human : truth.humans) {
    if (static_cast<int>(tracks.size()) < kPeopleMax) tracks.push_back({human.name, {}});
  }
  for (const truth::HumanState& state : truth.human_states) {
    if (state.human >= static_cast<int>(tracks.size())) continue;
    tracks[static_cast<size_t>(state.human)].points.push_back(state.map_T_torso.position.head<2>());
  }
  PreviewTrack robot{"robot", {}};
  for (size_t i = 0; i < truth.robot.size(); i += kRobotStride) {
    robot.points.push_back(truth.robot[i].map_T_body.position.head<2>());
  }
  tracks.push_back(std::move(robot));
  return tracks;
}

absl::Status WriteTopView(const std::string& folder, const std::string& out,
                          std::vector<std::string>* paths) {
  DSG_ASSIGN_OR_RETURN(const truth::Truth truth, truth::ReadTruth(folder + "/truth"));
  DSG_ASSIGN_OR_RETURN(const WorldKind kind, ParseWorldKind(truth.world));
  DSG_ASSIGN_OR_RETURN(const World world, GenerateWorld({kind, truth.seed}));
  paths->push_back(out + "/top.png");
  DSG_ASSIGN_OR_RETURN(std::string png, DrawPreview(world, Tracks(truth)));
  return ingest::WriteFile(paths->back(), std::move(png));
}

}  // namespace

absl::StatusOr<std::vector<std::string>> WriteContactSheet(const std::string& folder, int count,
                                                           const std::string& out) {
  DSG_ASSIGN_OR_RETURN(const std::vector<TimeNs> stamps, KeyframeStamps(folder + "/log"));
  DSG_RETURN_IF_ERROR(ingest::MakeFolder(out));
  DSG_ASSIGN_OR_RETURN(const Columns columns,
                       ReadColumns(folder + "/log", Spread(stamps, count), stamps.front()));
  std::vector<std::string> paths;
  DSG_RETURN_IF_ERROR(WriteImages(columns, out, &paths));
  DSG_RETURN_IF_ERROR(WriteTopView(folder, out, &paths));
  return paths;
}

}  // namespace dsg::simulator
