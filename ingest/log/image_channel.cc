// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/image_channel.h"

#include <algorithm>
#include <map>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "ingest/log/text_table.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

// Letters and digits with the kind in front: "cam" and "0".
bool IsNumbered(std::string_view name, std::string_view kind) {
  if (!name.starts_with(kind) || name.size() == kind.size()) return false;
  const std::string_view number = name.substr(kind.size());
  return number.size() <= 3 &&
         std::all_of(number.begin(), number.end(), [](char c) { return c >= '0' && c <= '9'; });
}

// A name never becomes a path.
bool IsPlainName(std::string_view name) {
  return !name.empty() && name.size() <= 255 && name != "." && name != ".." &&
         name.find('/') == std::string_view::npos && name.find('\0') == std::string_view::npos;
}

absl::StatusOr<ImageList> ReadRows(const LogFile& table, const std::string& channel) {
  ImageList list;
  LineReader lines(table.bytes);
  TextLine line;
  std::vector<std::string_view> fields;
  while (lines.Next(&line)) {
    if (line.text.starts_with('#')) continue;
    const LinePosition at{table.path, line.number};
    SplitAtCommas(line.text, &fields);
    DSG_RETURN_IF_ERROR(CheckFieldCount(at, line, fields.size(), 2, "timestamp, filename"));
    DSG_ASSIGN_OR_RETURN(const int64_t stamp, ParseInteger(at, "timestamp", fields[0]));
    if (stamp == kTimeMin || stamp == kTimeMax) {
      return at.FieldError("timestamp", fields[0], "nanoseconds are due");
    }
    DSG_RETURN_IF_ERROR(CheckGrows(table.path, line.number, channel, list.times, stamp));
    if (!IsPlainName(fields[1])) {
      return at.FieldError("filename", fields[1], "the name of a file in data/ is due");
    }
    list.times.push_back(stamp);
    list.names.emplace_back(fields[1]);
  }
  return list;
}

// Lists the folder once; asking for each file would take as long as reading them.
absl::Status CheckFiles(const fs::path& folder, const std::string& channel, const ImageList& list,
                        LogDigest* digest) {
  std::map<std::string, uintmax_t> sizes;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    std::error_code size_error;
    const uintmax_t size = entry.file_size(size_error);
    if (!size_error) sizes[entry.path().filename().string()] = size;
  }
  int64_t absent_count = 0;
  std::string first_absent;
  for (const std::string& name : list.names) {
    const auto found = sizes.find(name);
    if (found != sizes.end()) {
      digest->AddSize(absl::StrCat(channel, "/data/", name), found->second);
      continue;
    }
    if (absent_count++ == 0) first_absent = (folder / name).string();
  }
  if (absent_count == 0) return absl::OkStatus();
  return MakeError(
      Reason::kFileMalformed,
      absl::StrCat(first_absent, ": the table of channel ", channel,
                   " names this image, but it is "
                   "not there; ",
                   absent_count, " of ", list.names.size(),
                   " are absent: copy the log again, or remove the folder of the channel"),
      {{"file", first_absent}, {"count", absl::StrCat(absent_count)}});
}

// A broken image is left out; a log that is taken away while it is read has no end.
absl::Status CheckStillThere(const std::string& path) {
  std::error_code error;
  if (fs::exists(path, error)) return absl::OkStatus();
  return MakeError(Reason::kFileMalformed,
                   absl::StrCat(path,
                                " has gone since the log was opened; what was read before is "
                                "committed: put the log back and run the same again"),
                   {{"file", path}});
}

}  // namespace

bool IsImageChannel(std::string_view name) {
  return IsNumbered(name, "cam") || IsNumbered(name, "color") || IsNumbered(name, "depth") ||
         IsNumbered(name, "label");
}

ImageDecoding DecodingOf(std::string_view channel) {
  ImageDecoding decoding;
  if (channel.starts_with("color")) decoding.role = ImageRole::kColor;
  if (channel.starts_with("depth")) decoding.role = ImageRole::kDepth;
  if (channel.starts_with("label")) decoding.role = ImageRole::kLabel;
  return decoding;
}

SensorChannel MakeImageChannel(const std::string& channel, const ImageDecoding& decoding,
                               ImageList list) {
  SensorChannel result{.name = channel, .rank = ChannelRank::kImages, .times = {}, .make = {}};
  result.times = list.times;
  const auto shared = std::make_shared<const ImageList>(std::move(list));
  result.make = [shared, channel, decoding](size_t index) -> absl::StatusOr<Measurement> {
    ImageMeasurement image;
    image.time_ns = shared->times[index];
    image.channel = channel;
    image.origin = (fs::path(shared->folder) / shared->names[index]).string();
    DSG_RETURN_IF_ERROR(CheckStillThere(image.origin));
    image.load = [path = image.origin, decoding] { return LoadImageFile(path, decoding); };
    return Measurement(std::move(image));
  };
  return result;
}

absl::StatusOr<ImageList> ReadImageTable(const fs::path& folder, const std::string& channel,
                                         LogDigest* digest) {
  DSG_ASSIGN_OR_RETURN(const LogFile table, ReadLogFile((folder / "data.csv").string()));
  digest->Add(absl::StrCat(channel, "/data.csv"), table.bytes);
  DSG_ASSIGN_OR_RETURN(ImageList list, ReadRows(table, channel));
  list.folder = (folder / "data").string();
  DSG_RETURN_IF_ERROR(CheckFiles(folder / "data", channel, list, digest));
  return list;
}

}  // namespace dsg::ingest
