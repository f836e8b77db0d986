// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/rgbd_log.h"

#include <algorithm>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/image_channel.h"
#include "ingest/log/label_folder.h"
#include "ingest/log/loop_file.h"
#include "ingest/log/rgbd_layout.h"
#include "ingest/log/sensor_log.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// When a frame was taken.
absl::StatusOr<TimeNs> TimeOfFrame(const std::string& folder, const RgbdFrames& frames,
                                   const LogOptions& options, int64_t number) {
  if (!frames.stamps.empty()) {
    const auto found = frames.stamps.find(number);
    if (found != frames.stamps.end()) return found->second;
    return MakeError(Reason::kFileMalformed,
                     absl::StrCat(folder, "/poses.csv: frame ", number, " has no row; add it"),
                     {{"file", folder}});
  }
  TimeNs offset_ns = 0;
  TimeNs time_ns = 0;
  if (__builtin_mul_overflow(number, options.image_period_ns, &offset_ns) ||
      __builtin_add_overflow(offset_ns, options.epoch_ns, &time_ns) || time_ns == kTimeMax ||
      time_ns == kTimeMin) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat(folder, ": frame ", number,
                                  " times --frame-period does not fit in 64 bits of nanoseconds"),
                     {{"field", "frame_period"}, {"value", absl::StrCat(options.image_period_ns)}});
  }
  return time_ns;
}

absl::StatusOr<SensorChannel> MakeFrameChannel(const std::string& folder, const RgbdFrames& frames,
                                               const LogOptions& options, const FrameSet& set) {
  std::vector<std::pair<TimeNs, std::string>> images;
  for (const auto& [number, name] : set.names) {
    DSG_ASSIGN_OR_RETURN(const TimeNs time_ns, TimeOfFrame(folder, frames, options, number));
    images.emplace_back(time_ns, name);
  }
  // Numbers need not follow the stamps.
  std::sort(images.begin(), images.end());
  ImageList list;
  list.folder = set.folder;
  for (auto& [time_ns, name] : images) {
    DSG_RETURN_IF_ERROR(CheckGrows(folder, 1, set.channel, list.times, time_ns));
    list.times.push_back(time_ns);
    list.names.push_back(std::move(name));
  }
  return MakeImageChannel(set.channel, set.decoding, std::move(list));
}

absl::StatusOr<TrackTable> MakePoses(const std::string& folder, const RgbdFrames& frames,
                                     const LogOptions& options) {
  TrackTable table;
  table.file = folder;
  const int32_t agent = table.FindOrAdd(RobotName(options), kinds::kRobot);
  for (const auto& [number, map_T_body] : frames.map_T_body) {
    DSG_ASSIGN_OR_RETURN(const TimeNs time_ns, TimeOfFrame(folder, frames, options, number));
    table.rows.push_back({.time_ns = time_ns,
                          .line = number,
                          .agent = agent,
                          .flags = 0,
                          .map_T_agent = map_T_body});
  }
  std::sort(table.rows.begin(), table.rows.end(),
            [](const TrackRow& a, const TrackRow& b) { return a.time_ns < b.time_ns; });
  return table;
}

absl::StatusOr<LabelledPictures> PicturesOf(const std::string& folder, const RgbdFrames& frames,
                                            const LogOptions& options, const FrameSet& set) {
  LabelledPictures pictures;
  pictures.channel = set.channel;
  std::map<TimeNs, std::string> name_at;
  for (const auto& [number, name] : set.names) {
    DSG_ASSIGN_OR_RETURN(const TimeNs time_ns, TimeOfFrame(folder, frames, options, number));
    pictures.time_of_frame[number] = time_ns;
    name_at[time_ns] = name;
  }
  for (auto& [time_ns, name] : name_at) {
    pictures.times.push_back(time_ns);
    pictures.names.push_back(std::move(name));
  }
  return pictures;
}

absl::StatusOr<SensorChannel> ReadRgbdLabels(const std::string& folder, const RgbdFrames& frames,
                                             const LogOptions& options, LogDigest* digest,
                                             LogInfo* info) {
  std::vector<LabelledPictures> pictures;
  for (const char* const channel : {"depth0", "color0"}) {
    for (const FrameSet& set : frames.sets) {
      if (set.channel != channel) continue;
      DSG_ASSIGN_OR_RETURN(LabelledPictures some, PicturesOf(folder, frames, options, set));
      pictures.push_back(std::move(some));
    }
  }
  if (pictures.empty()) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("--labels ", options.label_folder, ": ", folder,
                                  " has neither depth nor colour pictures that labels may go with"),
                     {{"field", "labels"}, {"value", options.label_folder}});
  }
  return ReadLabelFolder(options, pictures, /*stamp_offset_ns=*/0, digest, info);
}

}  // namespace

OpenedLog OpenRgbdFolder(const std::string& folder, const LogOptions& options) {
  LogDigest digest;
  DSG_ASSIGN_OR_RETURN(RgbdFrames frames, ReadRgbdFolder(folder, FindRgbdLayout(folder), &digest));
  LogInfo info;
  info.format = "rgbd";
  info.path = folder;
  info.has_clock = !frames.stamps.empty();
  info.rig = std::move(frames.rig);
  info.notes = frames.notes;
  if (!info.has_clock) {
    info.notes.push_back("the frames have no stamps: frame number times --frame-period");
  }
  std::vector<SensorChannel> channels;
  for (const FrameSet& set : frames.sets) {
    DSG_ASSIGN_OR_RETURN(SensorChannel channel, MakeFrameChannel(folder, frames, options, set));
    channels.push_back(std::move(channel));
  }
  if (!options.label_folder.empty()) {
    DSG_ASSIGN_OR_RETURN(SensorChannel labels,
                         ReadRgbdLabels(folder, frames, options, &digest, &info));
    channels.push_back(std::move(labels));
  }
  PoseTables tables;
  if (!frames.map_T_body.empty()) {
    DSG_ASSIGN_OR_RETURN(tables.external, MakePoses(folder, frames, options));
  }
  DSG_ASSIGN_OR_RETURN(std::optional<TrackTable> poses,
                       ChoosePoses(options, std::move(tables), &digest, &info));
  if (poses.has_value()) channels.push_back(MakePoseChannel(*std::move(poses)));
  DSG_ASSIGN_OR_RETURN(std::optional<SensorChannel> loops,
                       ReadLoopChannel(options, /*log_path=*/"", &digest, &info));
  if (loops.has_value()) channels.push_back(*std::move(loops));
  info.content_sha256 = digest.Hex();
  return MakeSensorLog(std::move(channels), options, std::move(info));
}

}  // namespace dsg::ingest
