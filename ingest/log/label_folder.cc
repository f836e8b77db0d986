// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/label_folder.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <unordered_map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/image_channel.h"
#include "ingest/log/label_table.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

constexpr char kLabelChannel[] = "label0";
// Of ids that a note names.
constexpr size_t kNamedMax = 20;
// Where nobody can tell how far apart frames are.
constexpr TimeNs kFramePeriodNs = kNsPerSecond / 30;

// "frame-000001" of "frame-000001.color.jpg".
std::string KeyOf(const std::string& name) {
  fs::path stem = fs::path(name).filename().stem();
  const std::string last = stem.extension().string();
  for (const char* const ending : {".color", ".depth", ".label", ".labels"}) {
    if (last == ending) return stem.stem().string();
  }
  return stem.string();
}

// The last run of digits.
std::optional<int64_t> NumberIn(const std::string& key) {
  const size_t last = key.find_last_of("0123456789");
  if (last == std::string::npos) return std::nullopt;
  const size_t before = key.find_last_not_of("0123456789", last);
  const size_t first = before == std::string::npos ? 0 : before + 1;
  int64_t number = 0;
  const auto [end, error] = std::from_chars(key.data() + first, key.data() + last + 1, number);
  return error == std::errc() ? std::optional(number) : std::nullopt;
}

// Seconds with a point, or nanoseconds.
std::optional<TimeNs> StampIn(const std::string& key) {
  const size_t first = key.find_first_of("0123456789");
  const size_t last = key.find_last_of("0123456789");
  if (first == std::string::npos) return std::nullopt;
  const std::string text = key.substr(first, last + 1 - first);
  const std::string file;
  const LinePosition nowhere{file, 0};
  constexpr size_t kDigitsOfNanoseconds = 13;
  const bool is_ns = text.find('.') == std::string::npos && text.size() >= kDigitsOfNanoseconds;
  const absl::StatusOr<TimeNs> stamp = ParseSeconds(nowhere, "stamp", text, is_ns ? -9 : 0);
  return stamp.ok() ? std::optional(*stamp) : std::nullopt;
}

TimeNs PeriodOf(const std::vector<TimeNs>& times) {
  std::vector<TimeNs> steps;
  for (size_t i = 1; i < times.size(); ++i) steps.push_back(times[i] - times[i - 1]);
  if (steps.empty()) return kFramePeriodNs;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

// Tells which picture of one channel a label belongs to.
class Matcher {
 public:
  Matcher(const LabelledPictures& pictures, TimeNs stamp_offset_ns)
      : pictures_(pictures),
        stamp_offset_ns_(stamp_offset_ns),
        half_period_ns_(PeriodOf(pictures.times) / 2) {
    for (size_t i = 0; i < pictures.times.size(); ++i) {
      time_of_key_.emplace(KeyOf(pictures.names[i]), pictures.times[i]);
    }
  }

  std::optional<TimeNs> FindByName(const std::string& key) const {
    const auto found = time_of_key_.find(key);
    return found == time_of_key_.end() ? std::nullopt : std::optional(found->second);
  }

  // By the number of the frame, or the stamp.
  std::optional<TimeNs> FindByNumber(const std::string& key) const {
    if (!pictures_.time_of_frame.empty()) {
      const std::optional<int64_t> number = NumberIn(key);
      const auto found = pictures_.time_of_frame.find(number.value_or(-1));
      return found == pictures_.time_of_frame.end() ? std::nullopt : std::optional(found->second);
    }
    const std::optional<TimeNs> stamp = StampIn(key);
    if (!stamp.has_value()) return std::nullopt;
    const TimeNs time_ns = *stamp + stamp_offset_ns_;
    const auto after = std::lower_bound(pictures_.times.begin(), pictures_.times.end(), time_ns);
    std::optional<TimeNs> nearest;
    for (const auto& at : {after, after == pictures_.times.begin() ? after : after - 1}) {
      if (at == pictures_.times.end() || std::abs(*at - time_ns) > half_period_ns_) continue;
      if (!nearest.has_value() || std::abs(*at - time_ns) < std::abs(*nearest - time_ns)) {
        nearest = *at;
      }
    }
    return nearest;
  }

 private:
  const LabelledPictures& pictures_;
  TimeNs stamp_offset_ns_;
  TimeNs half_period_ns_;
  std::unordered_map<std::string, TimeNs> time_of_key_;
};

class LabelFolderReader {
 public:
  LabelFolderReader(const LogOptions& options, const std::vector<LabelledPictures>& pictures,
                    TimeNs stamp_offset_ns, LogDigest* digest, LogInfo* info)
      : root_(options.label_folder),
        is_strict_(options.is_strict),
        pictures_(pictures),
        digest_(*digest),
        info_(*info),
        match_count_(pictures.size(), 0) {
    for (const LabelledPictures& some : pictures) matchers_.emplace_back(some, stamp_offset_ns);
  }

  absl::StatusOr<SensorChannel> Read() {
    DSG_RETURN_IF_ERROR(ReadTable());
    DSG_ASSIGN_OR_RETURN(const std::vector<std::string> names, ListPictures());
    DSG_RETURN_IF_ERROR(Match(names));
    DSG_RETURN_IF_ERROR(SetCamera());
    ImageList list;
    list.folder = root_.string();
    for (const auto& [time_ns, name] : name_at_) {
      DSG_RETURN_IF_ERROR(Check(name));
      list.times.push_back(time_ns);
      list.names.push_back(name);
    }
    DSG_RETURN_IF_ERROR(TellUnlisted());
    info_.labels = ids_->classes;
    ImageDecoding decoding;
    decoding.role = ImageRole::kLabel;
    decoding.label_of_id = std::shared_ptr<const std::vector<uint16_t>>(ids_, &ids_->label_of_id);
    return MakeImageChannel(kLabelChannel, decoding, std::move(list));
  }

 private:
  absl::Status ReadTable() {
    for (const char* const name : {"labels.csv", "labels.txt"}) {
      if (!IsFile(root_ / name)) continue;
      DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile((root_ / name).string()));
      digest_.Add(absl::StrCat("--labels/", name), file.bytes);
      DSG_ASSIGN_OR_RETURN(LabelIds ids, ReadLabelIds(file));
      if (ids.is_renumbered) {
        info_.notes.push_back(absl::StrCat(file.path,
                                           ": the ids do not fit 1 to 255, so classes "
                                           "are numbered in their order from 1"));
      }
      ids_ = std::make_shared<const LabelIds>(std::move(ids));
      return absl::OkStatus();
    }
    return MalformedFile(root_.string(),
                         "has neither labels.csv nor labels.txt, which say what the numbers of the "
                         "label pictures mean: a line \"id,name\", and one for each class");
  }

  absl::StatusOr<std::vector<std::string>> ListPictures() const {
    std::vector<std::string> names;
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(root_, error)) {
      if (entry.path().extension() == ".png") names.push_back(entry.path().filename().string());
    }
    if (names.empty()) return MalformedFile(root_.string(), "has no label pictures (PNG)");
    std::sort(names.begin(), names.end());
    return names;
  }

  std::optional<TimeNs> Find(const std::string& key) {
    for (const auto find : {&Matcher::FindByName, &Matcher::FindByNumber}) {
      for (size_t i = 0; i < matchers_.size(); ++i) {
        const std::optional<TimeNs> time_ns = (matchers_[i].*find)(key);
        if (!time_ns.has_value()) continue;
        ++match_count_[i];
        return time_ns;
      }
    }
    return std::nullopt;
  }

  absl::Status Match(const std::vector<std::string>& names) {
    int64_t stray_count = 0;
    for (const std::string& name : names) {
      const std::optional<TimeNs> time_ns = Find(KeyOf(name));
      if (!time_ns.has_value()) {
        ++stray_count;
        continue;
      }
      const auto [known, is_new] = name_at_.emplace(*time_ns, name);
      if (is_new) continue;
      return MalformedFile((root_ / name).string(),
                           absl::StrCat("belongs to the same picture of the log as ", known->second,
                                        "; remove one of them"));
    }
    if (name_at_.empty()) {
      return MalformedFile(
          root_.string(),
          absl::StrCat("none of ", names.size(),
                       " label pictures belongs to the log: they are "
                       "named as ",
                       names.front(), ", the pictures of the log as ",
                       pictures_.front().names.front(),
                       "; a label has the name, the number or the stamp of its picture"));
    }
    if (stray_count > 0) {
      DSG_RETURN_IF_ERROR(Tell(absl::StrCat(stray_count, " of ", names.size(),
                                            " label pictures belong to no picture of the log")));
    }
    return TellMissing();
  }

  // Of the channel that most labels belong to.
  absl::Status TellMissing() {
    const LabelledPictures& main = pictures_[MainIndex()];
    const auto missing_count =
        std::count_if(main.times.begin(), main.times.end(),
                      [&](TimeNs time_ns) { return !name_at_.contains(time_ns); });
    if (missing_count == 0) return absl::OkStatus();
    return Tell(absl::StrCat(missing_count, " of ", main.times.size(), " pictures of ",
                             main.channel, " have no label picture"));
  }

  size_t MainIndex() const {
    return static_cast<size_t>(std::max_element(match_count_.begin(), match_count_.end()) -
                               match_count_.begin());
  }

  absl::Status Tell(const std::string& what) {
    if (is_strict_) return MalformedFile(root_.string(), what);
    info_.notes.push_back(absl::StrCat(root_.string(), ": ", what, "; --strict refuses this"));
    return absl::OkStatus();
  }

  // Labels are seen by the camera of the pictures that they belong to, or of others of their size.
  absl::Status SetCamera() {
    const std::string first = (root_ / name_at_.begin()->second).string();
    DSG_ASSIGN_OR_RETURN(const ImageHeader header, LoadImageHeader(first));
    std::vector<std::string> channels = {pictures_[MainIndex()].channel};
    for (const LabelledPictures& some : pictures_) channels.push_back(some.channel);
    std::vector<std::string> sizes;
    for (const std::string& channel : channels) {
      const CameraCalibration* const camera = info_.rig.FindCamera(channel);
      if (camera == nullptr) continue;
      sizes.push_back(absl::StrCat(channel, " ", camera->width, "x", camera->height));
      if (camera->width != header.width || camera->height != header.height) continue;
      camera_ = *camera;
      camera_.name = kLabelChannel;
      info_.rig.cameras.push_back(camera_);
      std::sort(
          info_.rig.cameras.begin(), info_.rig.cameras.end(),
          [](const CameraCalibration& a, const CameraCalibration& b) { return a.name < b.name; });
      return absl::OkStatus();
    }
    sizes.erase(sizes.begin());
    return MalformedFile(
        first,
        absl::StrCat("is ", header.width, "x", header.height, ", the pictures of the log are ",
                     absl::StrJoin(sizes, ", "), "; labels have the size of one of them"));
  }

  absl::Status Check(const std::string& name) {
    const std::string path = (root_ / name).string();
    std::error_code error;
    digest_.AddSize(absl::StrCat("--labels/", name), fs::file_size(path, error));
    ImageDecoding decoding;
    decoding.role = ImageRole::kLabel;
    decoding.label_of_id = Identity();
    DSG_ASSIGN_OR_RETURN(const Image image, LoadImageFile(path, decoding));
    if (image.width != camera_.width || image.height != camera_.height) {
      return MalformedFile(
          path, absl::StrCat("is ", image.width, "x", image.height, ", other label pictures are ",
                             camera_.width, "x", camera_.height));
    }
    bool has_unlisted = false;
    for (int row = 0; row < image.height; ++row) {
      for (int column = 0; column < image.width; ++column) {
        const uint16_t id = LabelAt(image, column, row);
        if (id == 0 || ids_->is_listed[id]) continue;
        has_unlisted = true;
        ++unlisted_pixel_count_;
        unlisted_.insert(id);
      }
    }
    unlisted_picture_count_ += has_unlisted ? 1 : 0;
    return absl::OkStatus();
  }

  static std::shared_ptr<const std::vector<uint16_t>> Identity() {
    static const auto same = [] {
      std::vector<uint16_t> numbers(LabelIds::kCount);
      for (size_t i = 0; i < numbers.size(); ++i) numbers[i] = static_cast<uint16_t>(i);
      return std::make_shared<const std::vector<uint16_t>>(std::move(numbers));
    }();
    return same;
  }

  absl::Status TellUnlisted() {
    if (unlisted_.empty()) return absl::OkStatus();
    std::vector<std::string> named;
    for (const uint16_t id : unlisted_) {
      if (named.size() == kNamedMax) break;
      named.push_back(absl::StrCat(id));
    }
    const size_t more = unlisted_.size() - named.size();
    return Tell(absl::StrCat("the table does not have the ids ", absl::StrJoin(named, ", "),
                             more > 0 ? absl::StrCat(" and ", more, " more") : "", ", of ",
                             unlisted_pixel_count_, " pixels in ", unlisted_picture_count_,
                             " pictures: they count as unknown"));
  }

  fs::path root_;
  bool is_strict_;
  const std::vector<LabelledPictures>& pictures_;
  LogDigest& digest_;
  LogInfo& info_;
  std::vector<Matcher> matchers_;
  /// By index into `pictures_`.
  std::vector<int64_t> match_count_;
  std::shared_ptr<const LabelIds> ids_;
  std::map<TimeNs, std::string> name_at_;
  CameraCalibration camera_;
  std::set<uint16_t> unlisted_;
  int64_t unlisted_pixel_count_ = 0;
  int64_t unlisted_picture_count_ = 0;
};

}  // namespace

absl::StatusOr<SensorChannel> ReadLabelFolder(const LogOptions& options,
                                              const std::vector<LabelledPictures>& pictures,
                                              TimeNs stamp_offset_ns, LogDigest* digest,
                                              LogInfo* info) {
  std::error_code error;
  if (!fs::is_directory(options.label_folder, error)) {
    return MakeError(Reason::kFieldInvalid,
                     absl::StrCat("--labels ", options.label_folder, ": is no folder"),
                     {{"field", "labels"}, {"value", options.label_folder}});
  }
  return LabelFolderReader(options, pictures, stamp_offset_ns, digest, info).Read();
}

}  // namespace dsg::ingest
