// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/bag_folder.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <utility>

#include "absl/strings/str_cat.h"
#include "ingest/log/file_bytes.h"
#include "schema/base/status.h"
#include "schema/files/yaml_text.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

constexpr char kList[] = "metadata.yaml";
constexpr char kListKey[] = "rosbag2_bagfile_information";
// A list of a hundred thousand topics; what is larger is no list.
constexpr size_t kListBytesMax = size_t{64} << 20;

bool IsBagName(const fs::path& path) {
  return path.extension() == ".mcap" || path.extension() == ".db3";
}

// "bag_10.db3" comes after "bag_9.db3".
std::pair<uint64_t, std::string> RecordingOrder(const fs::path& path) {
  const std::string stem = path.stem().string();
  const size_t digits = stem.find_last_not_of("0123456789") + 1;
  uint64_t number = 0;
  std::from_chars(stem.data() + digits, stem.data() + stem.size(), number);
  return {number, stem};
}

std::vector<std::string> FindBagNames(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (IsBagName(entry.path()) && IsFile(entry.path())) found.push_back(entry.path());
  }
  std::sort(found.begin(), found.end(), [](const fs::path& a, const fs::path& b) {
    return RecordingOrder(a) < RecordingOrder(b);
  });
  std::vector<std::string> names;
  for (const fs::path& path : found) names.push_back(path.filename().string());
  return names;
}

absl::StatusOr<std::vector<std::string>> ReadList(const std::string& path) {
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile(path));
  if (file.bytes.size() > kListBytesMax || YamlNestsTooDeep(file.bytes)) {
    return MalformedFile(path, "is too large, or nests too deep, for a list of bags");
  }
  try {
    const YAML::Node info = YAML::Load(file.bytes)[kListKey];
    if (!info.IsDefined() || !info.IsMap())
      return MalformedFile(path, absl::StrCat("has no field ", kListKey));
    // Messages that are compressed one by one are unpacked when they are read.
    const YAML::Node mode = info["compression_mode"];
    if (mode.IsDefined() && mode.IsScalar() &&
        (mode.Scalar() == "file" || mode.Scalar() == "FILE")) {
      return MalformedFile(path,
                           "says that the files of the bag are compressed; unpack them with "
                           "\"ros2 bag convert\"");
    }
    std::vector<std::string> names;
    const YAML::Node list = info["relative_file_paths"];
    if (!list.IsDefined() || !list.IsSequence())
      return MalformedFile(path, "has no list relative_file_paths");
    for (const YAML::Node& name : list) {
      // Some recorders wrote the name of the folder before it.
      names.push_back(fs::path(name.as<std::string>()).filename().string());
    }
    return names;
  } catch (const YAML::Exception& error) {
    return MalformedFile(
        path, absl::StrCat("line ", error.mark.line + 1, " does not parse as YAML: ", error.msg,
                           "; run \"ros2 bag reindex\" on the folder"));
  }
}

}  // namespace

bool IsBagFolder(const std::string& folder) {
  if (!FindBagNames(folder).empty()) return true;
  const std::string list = (fs::path(folder) / kList).string();
  if (!IsFile(list)) return false;
  const absl::StatusOr<LogFile> file = ReadLogFile(list);
  return file.ok() && file->bytes.find(kListKey) != std::string::npos;
}

absl::StatusOr<std::vector<std::string>> ListBagFolder(const std::string& folder) {
  const fs::path list = fs::path(folder) / kList;
  std::vector<std::string> names;
  if (IsFile(list)) {
    DSG_ASSIGN_OR_RETURN(names, ReadList(list.string()));
  } else {
    names = FindBagNames(folder);
  }
  if (names.empty()) return MalformedFile(folder, "lists no file of a bag");
  std::vector<std::string> files;
  for (const std::string& name : names) {
    files.push_back((fs::path(folder) / name).string());
    if (!IsFile(files.back())) {
      return MalformedFile(files.back(), absl::StrCat(list.string(),
                                                      " lists this file, but it is not there; "
                                                      "copy the bag again, or run \"ros2 bag "
                                                      "reindex\" on its folder"));
    }
  }
  return files;
}

}  // namespace dsg::ingest
