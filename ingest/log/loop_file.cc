// SPDX-License-Identifier: Apache-2.0
#include "ingest/log/loop_file.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <tuple>
#include <utility>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_join.h"
#include "ingest/log/log_input.h"
#include "schema/base/status.h"
#include "schema/base/utf8.h"
#include "schema/model/delta_check.h"

namespace dsg::ingest {
namespace {

using Json = nlohmann::json;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

constexpr size_t kLoopLineBytesMax = size_t{1} << 16;
// Bounds the depth of what the parser builds.
constexpr int64_t kBracketsMax = 1024;
constexpr size_t kKeysNamedMax = 8;
constexpr size_t kKeyLengthMax = 40;
// A micrometre and a microradian; less is no measurement, and its information no number.
constexpr double kSigmaMin = 1e-6;
constexpr double kSigmaMax = 1e6;
constexpr double kInformationMax = 1e12;
constexpr size_t kInformationCount = 21;
constexpr std::array<const char*, 8> kKeys = {"from_ns",     "to_ns",   "translation", "rotation",
                                              "information", "sigma_m", "sigma_rad",   "score"};

bool HasTooManyBrackets(std::string_view text) {
  return std::count_if(text.begin(), text.end(), [](char c) { return c == '[' || c == '{'; }) >
         kBracketsMax;
}

absl::StatusOr<Json> ParseObject(const LinePosition& at, std::string_view line) {
  if (line.size() > kLoopLineBytesMax) {
    return at.Error(absl::StrCat("the line has ", line.size(),
                                 " bytes; a loop closure has at most ", kLoopLineBytesMax));
  }
  if (!IsUtf8(line)) return at.Error("the line is not UTF-8; is this a table of loop closures?");
  if (HasTooManyBrackets(line)) {
    return at.Error(absl::StrCat("the line has more than ", kBracketsMax, " brackets"));
  }
  Json object = Json::parse(line, nullptr, false);
  if (object.is_object()) return object;
  if (line.find("NaN") != std::string_view::npos ||
      line.find("Infinity") != std::string_view::npos) {
    return at.Error("holds NaN or Infinity, which are no numbers of JSON; remove the line");
  }
  return at.Error("is no JSON object; was the line cut? Correct or remove it");
}

std::string Show(const Json& value) {
  return value.is_structured() ? value.type_name()
                               : value.dump(-1, ' ', true, Json::error_handler_t::replace);
}

class LoopReader {
 public:
  LoopReader(const LinePosition& at, const Json& object) : at_(at), object_(object) {}

  absl::StatusOr<LoopMeasurement> Read() const {
    LoopMeasurement loop;
    DSG_ASSIGN_OR_RETURN(loop.from_ns, Stamp("from_ns"));
    DSG_ASSIGN_OR_RETURN(loop.time_ns, Stamp("to_ns"));
    if (loop.from_ns == loop.time_ns) {
      return at_.FieldError("to_ns", absl::StrCat(loop.time_ns),
                            "a loop closure joins two instants; from_ns is the same");
    }
    DSG_ASSIGN_OR_RETURN(const std::vector<double> t, List("translation", 3, kCoordinateMaxM));
    loop.from_T_to.position = {t[0], t[1], t[2]};
    DSG_ASSIGN_OR_RETURN(const std::vector<double> q, List("rotation", 4, 2.0));
    DSG_ASSIGN_OR_RETURN(loop.from_T_to.orientation, Normalize(at_, {q[3], q[0], q[1], q[2]}));
    DSG_ASSIGN_OR_RETURN(loop.information, Information());
    if (object_.contains("score")) {
      DSG_ASSIGN_OR_RETURN(loop.score, Number("score", object_["score"], -1e300, 1e300));
    }
    loop.origin = absl::StrCat(std::filesystem::path(at_.file).filename().string(), ":", at_.line);
    return loop;
  }

 private:
  absl::StatusOr<const Json*> Find(const char* key) const {
    const auto found = object_.find(key);
    if (found != object_.end()) return &*found;
    return at_.Error(
        absl::StrCat("the loop closure has no field \"", key, "\"; see docs/sensor_logs.md"));
  }

  absl::StatusOr<TimeNs> Stamp(const char* key) const {
    DSG_ASSIGN_OR_RETURN(const Json* value, Find(key));
    const bool fits = value->is_number_integer() &&
                      (!value->is_number_unsigned() || value->get<uint64_t>() < INT64_MAX) &&
                      value->get<int64_t>() >= 0;
    if (fits) return value->get<int64_t>();
    return at_.FieldError(key, Show(*value), "an integer of nanoseconds from 0 is due");
  }

  absl::StatusOr<double> Number(const char* key, const Json& value, double min, double max) const {
    const double number = value.is_number() ? value.get<double>() : NAN;
    if (number >= min && number <= max) return number;
    return at_.FieldError(key, Show(value),
                          absl::StrCat("a number from ", min, " to ", max, " is due"));
  }

  absl::StatusOr<std::vector<double>> List(const char* key, size_t count, double max) const {
    DSG_ASSIGN_OR_RETURN(const Json* value, Find(key));
    if (!value->is_array() || value->size() != count) {
      return at_.FieldError(key, absl::StrCat(value->type_name(), " of ", value->size()),
                            absl::StrCat("a list of ", count, " numbers is due"));
    }
    std::vector<double> numbers;
    for (const Json& item : *value) {
      DSG_ASSIGN_OR_RETURN(const double number, Number(key, item, -max, max));
      numbers.push_back(number);
    }
    return numbers;
  }

  absl::StatusOr<Matrix6d> Information() const {
    if (object_.contains("information")) return WholeInformation();
    Matrix6d information = Matrix6d::Zero();
    DSG_ASSIGN_OR_RETURN(const Json* sigma_m, Find("sigma_m"));
    DSG_ASSIGN_OR_RETURN(const double m, Number("sigma_m", *sigma_m, kSigmaMin, kSigmaMax));
    DSG_ASSIGN_OR_RETURN(const Json* sigma_rad, Find("sigma_rad"));
    DSG_ASSIGN_OR_RETURN(const double rad, Number("sigma_rad", *sigma_rad, kSigmaMin, kSigmaMax));
    information.diagonal().head<3>().setConstant(1.0 / (m * m));
    information.diagonal().tail<3>().setConstant(1.0 / (rad * rad));
    return information;
  }

  absl::StatusOr<Matrix6d> WholeInformation() const {
    if (object_.contains("sigma_m") || object_.contains("sigma_rad")) {
      return at_.Error("has both \"information\" and \"sigma_m\" or \"sigma_rad\"; give one kind");
    }
    DSG_ASSIGN_OR_RETURN(const std::vector<double> values,
                         List("information", kInformationCount, kInformationMax));
    Matrix6d information;
    size_t next = 0;
    for (int row = 0; row < 6; ++row) {
      for (int column = row; column < 6; ++column) {
        information(row, column) = information(column, row) = values[next++];
      }
    }
    if (information.llt().info() == Eigen::Success) return information;
    return at_.FieldError("information", absl::StrJoin(values, " "),
                          "the matrix is not positive definite; 21 numbers of the upper triangle, "
                          "row by row, translation before rotation, are due");
  }

  const LinePosition& at_;
  const Json& object_;
};

// A file may hold keys of any length and any bytes; a terminal must not obey them.
std::string Shorten(const std::string& key) {
  return absl::Utf8SafeCHexEscape(key.substr(0, kKeyLengthMax));
}

}  // namespace

absl::StatusOr<LoopMeasurement> LoopLines::Read(const LinePosition& at, std::string_view line) {
  DSG_ASSIGN_OR_RETURN(const Json object, ParseObject(at, line));
  DSG_ASSIGN_OR_RETURN(LoopMeasurement loop, LoopReader(at, object).Read());
  if (count_ == kLoopCountMax) {
    return at.Error(absl::StrCat("is beyond the ", kLoopCountMax,
                                 " loop closures that a log may have; leave out the weak ones"));
  }
  ++count_;
  for (const auto& item : object.items()) {
    const bool is_known = std::find_if(kKeys.begin(), kKeys.end(), [&](const char* key) {
                            return item.key() == key;
                          }) != kKeys.end();
    if (is_known) continue;
    const std::string key = Shorten(item.key());
    if (unknown_keys_.size() < kKeysNamedMax || unknown_keys_.contains(key)) ++unknown_keys_[key];
  }
  return loop;
}

absl::Status LoopLines::Add(const LinePosition& at, std::string_view line) {
  DSG_ASSIGN_OR_RETURN(LoopMeasurement loop, Read(at, line));
  loops_.push_back(std::move(loop));
  return absl::OkStatus();
}

SensorChannel LoopLines::TakeChannel(std::vector<std::string>* notes) {
  std::stable_sort(loops_.begin(), loops_.end(),
                   [](const LoopMeasurement& a, const LoopMeasurement& b) {
                     return std::tie(a.time_ns, a.from_ns) < std::tie(b.time_ns, b.from_ns);
                   });
  SensorChannel channel{.name = "loops0", .rank = ChannelRank::kLoops, .times = {}, .make = {}};
  for (const LoopMeasurement& loop : loops_) channel.times.push_back(loop.time_ns);
  // Shared, since a std::function must be copyable.
  const auto shared = std::make_shared<const std::vector<LoopMeasurement>>(std::move(loops_));
  channel.make = [shared](size_t index) -> absl::StatusOr<Measurement> {
    return Measurement((*shared)[index]);
  };
  NoteKeys(notes);
  *this = LoopLines();
  return channel;
}

void LoopLines::NoteKeys(std::vector<std::string>* notes) const {
  if (unknown_keys_.empty()) return;
  notes->push_back(
      absl::StrCat("keys of loop closures that are not read: ",
                   absl::StrJoin(unknown_keys_, ", ", [](std::string* out, const auto& entry) {
                     absl::StrAppend(out, entry.first, " (", entry.second, ")");
                   })));
}

void LoopQueue::Add(LoopMeasurement loop) {
  const std::tuple<TimeNs, TimeNs, TimeNs> key(std::max(loop.time_ns, loop.from_ns), loop.time_ns,
                                               loop.from_ns);
  waiting_.emplace(key, std::move(loop));
}

LoopMeasurement LoopQueue::Take() { return std::move(waiting_.extract(waiting_.begin()).mapped()); }

absl::StatusOr<std::optional<SensorChannel>> ReadLoopChannel(const LogOptions& options,
                                                             const std::string& log_path,
                                                             LogDigest* digest, LogInfo* info) {
  const bool is_given = !options.loop_file.empty();
  const std::string& path = is_given ? options.loop_file : log_path;
  if (path.empty()) return std::nullopt;
  const std::string name = is_given ? "--loops" : "loop_closures0/data.jsonl";
  LoopLines loops;
  std::error_code error;
  if (std::filesystem::file_size(path, error) == 0 && !error) {
    digest->AddSize(name, 0);
    return loops.TakeChannel(&info->notes);
  }
  DSG_ASSIGN_OR_RETURN(const LogFile file, ReadInput(path));
  digest->Add(name, file.bytes);
  LineReader lines(file.bytes);
  TextLine line;
  while (lines.Next(&line)) {
    DSG_RETURN_IF_ERROR(loops.Add(LinePosition{file.path, line.number}, line.text));
  }
  return loops.TakeChannel(&info->notes);
}

std::string FormatLoop(const LoopMeasurement& loop) {
  nlohmann::ordered_json object;
  object["from_ns"] = loop.from_ns;
  object["to_ns"] = loop.time_ns;
  const Eigen::Vector3d& t = loop.from_T_to.position;
  object["translation"] = {t.x(), t.y(), t.z()};
  const Eigen::Quaterniond& q = loop.from_T_to.orientation;
  object["rotation"] = {q.x(), q.y(), q.z(), q.w()};
  std::vector<double> values;
  for (int row = 0; row < 6; ++row) {
    for (int column = row; column < 6; ++column) values.push_back(loop.information(row, column));
  }
  object["information"] = values;
  if (loop.score.has_value()) object["score"] = *loop.score;
  return object.dump();
}

}  // namespace dsg::ingest
