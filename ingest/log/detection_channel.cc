// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/detection_channel.h"

#include <filesystem>
#include <fstream>
#include <memory>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/strings/str_cat.h"
#include "ingest/log/body_topology.h"
#include "ingest/log/detection_json.h"
#include "ingest/log/file_bytes.h"
#include "schema/base/status.h"

namespace dsg::ingest {
namespace {

// Where the lines are in the file.
struct LineIndex {
  std::string path;
  std::vector<uint64_t> offsets;
  std::vector<uint32_t> lengths;
  std::vector<int64_t> numbers;
};

absl::StatusOr<Measurement> ReadAt(const LineIndex& lines, std::ifstream& file, size_t index) {
  const LinePosition at{lines.path, lines.numbers[index]};
  std::string text(lines.lengths[index], '\0');
  file.clear();
  file.seekg(static_cast<std::streamoff>(lines.offsets[index]));
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!file) return at.Error("cannot be read any more; did the log change meanwhile?");
  DSG_ASSIGN_OR_RETURN(HumanDetection detection, ParseDetection(at, text));
  return Measurement(std::move(detection));
}

absl::Status CheckFollows(const LinePosition& at, const HumanDetection& before,
                          const HumanDetection& detection) {
  if (std::pair(before.time_ns, before.id) < std::pair(detection.time_ns, detection.id)) {
    return absl::OkStatus();
  }
  return at.Error(absl::StrCat("detection ", detection.id, " at ", detection.time_ns,
                               " does not come after detection ", before.id, " at ", before.time_ns,
                               "; sort the lines by time_ns, then id"));
}

absl::Status ReadTopology(const std::string& path, const std::string& channel, LogDigest* digest,
                          LogInfo* info) {
  constexpr char kName[] = "topology.json";
  const std::filesystem::path beside = std::filesystem::path(path).parent_path() / kName;
  std::error_code error;
  const auto type = std::filesystem::symlink_status(beside, error).type();
  if (type == std::filesystem::file_type::not_found) return absl::OkStatus();
  if (!IsFile(beside)) {
    return MalformedFile(beside.string(),
                         "is no regular file, nor a link to one; copy it again, or remove it if "
                         "bodies have no faces");
  }
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile(beside.string()));
  digest->Add(absl::StrCat(channel, "/", kName), file.bytes);
  DSG_ASSIGN_OR_RETURN(info->body_topology, ParseBodyTopology(file.path, file.bytes));
  return absl::OkStatus();
}

}  // namespace

absl::StatusOr<SensorChannel> ReadDetectionChannel(const std::string& path,
                                                   const std::string& channel,
                                                   const LogOptions& options, LogDigest* digest,
                                                   LogInfo* info) {
  SensorChannel result{.name = channel, .rank = ChannelRank::kDetections, .times = {}, .make = {}};
  const std::string name = absl::StrCat(channel, "/data.jsonl");
  DSG_RETURN_IF_ERROR(ReadTopology(path, channel, digest, info));
  std::error_code error;
  if (std::filesystem::file_size(path, error) == 0 && !error) {
    digest->AddSize(name, 0);
    return result;
  }
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadLogFile(path));
  digest->Add(name, file.bytes);
  const auto index = std::make_shared<LineIndex>();
  index->path = path;
  LineReader lines(file.bytes);
  TextLine line;
  std::optional<HumanDetection> before;
  absl::flat_hash_map<int64_t, int64_t> line_of_id;
  while (lines.Next(&line)) {
    const LinePosition at{path, line.number};
    DSG_ASSIGN_OR_RETURN(HumanDetection detection, ParseDetection(at, line.text));
    DSG_RETURN_IF_ERROR(CheckBody(at, info->body_topology.get(), options.is_strict, detection));
    if (before.has_value()) DSG_RETURN_IF_ERROR(CheckFollows(at, *before, detection));
    const auto [first, is_new] = line_of_id.emplace(detection.id, line.number);
    if (!is_new) {
      return at.FieldError("id", absl::StrCat(detection.id),
                           absl::StrCat("line ", first->second,
                                        " has it already; an id is for one "
                                        "detection of the log"));
    }
    index->offsets.push_back(static_cast<uint64_t>(line.text.data() - file.bytes.data()));
    index->lengths.push_back(static_cast<uint32_t>(line.text.size()));
    index->numbers.push_back(line.number);
    result.times.push_back(detection.time_ns);
    before = std::move(detection);
  }
  const auto stream = std::make_shared<std::ifstream>(path, std::ios::binary);
  result.make = [index, stream](size_t i) { return ReadAt(*index, *stream, i); };
  return result;
}

}  // namespace dsg::ingest
