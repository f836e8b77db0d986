// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export_csv.h"

#include <functional>
#include <initializer_list>
#include <map>
#include <nlohmann/json.hpp>
#include <utility>

#include "absl/strings/str_cat.h"
#include "dsg/v1/graph.pb.h"
#include "dsg/v1/query_service.pb.h"
#include "query/cli/answer_text.h"
#include "query/cli/csv.h"
#include "query/cli/values.h"
#include "schema/base/status.h"
#include "schema/files/atomic_file.h"
#include "schema/model/known_names.h"
#include "schema/model/trajectory.h"

namespace dsg::cli {
namespace {

// One record of a table, cell by cell.
class Record {
 public:
  explicit Record(bool has_dates) : has_dates_(has_dates) {}

  Record& Text(std::string text) {
    cells_.push_back(std::move(text));
    return *this;
  }
  Record& Count(int64_t count) { return Text(absl::StrCat(count)); }
  Record& Number(double number) { return Text(ExactNumber(number)); }
  Record& Empty(int count) {
    cells_.insert(cells_.end(), static_cast<size_t>(count), "");
    return *this;
  }
  /// The integer and, on a clock with dates, the date; empty for an open end.
  Record& Time(TimeNs time_ns) { return Time(time_ns != kTimeMin && time_ns != kTimeMax, time_ns); }
  Record& Time(bool is_known, TimeNs time_ns) {
    Text(is_known ? absl::StrCat(time_ns) : "");
    return has_dates_ ? Text(is_known ? FormatRfc3339(time_ns) : "") : *this;
  }
  Record& Point(const v1::Vector3& point) {
    return Number(point.x()).Number(point.y()).Number(point.z());
  }
  const std::vector<std::string>& cells() const { return cells_; }

 private:
  const bool has_dates_;
  std::vector<std::string> cells_;
};

// Names of columns; one that ends in _ns is followed by that of its dates.
std::vector<std::string> Headings(std::initializer_list<const char*> names, bool has_dates) {
  std::vector<std::string> headings;
  for (const std::string name : names) {
    headings.push_back(name);
    if (has_dates && name.ends_with("_ns")) {
      headings.push_back(absl::StrCat(name.substr(0, name.size() - 3), "_utc"));
    }
  }
  return headings;
}

// {"a":1}; empty without attributes.
template <class Attributes>
std::string AttributesJson(const Attributes& attributes) {
  if (attributes.empty()) return "";
  // Sorted by name: the order within the message is that of a hash.
  std::map<std::string, nlohmann::json> sorted;
  for (const auto& [name, value] : attributes) {
    switch (value.value_case()) {
      case v1::AttributeValue::kNumber:
        sorted[name] = value.number();
        break;
      case v1::AttributeValue::kText:
        sorted[name] = value.text();
        break;
      case v1::AttributeValue::kFlag:
        sorted[name] = value.flag();
        break;
      case v1::AttributeValue::VALUE_NOT_SET:
        sorted[name] = nullptr;
        break;
    }
  }
  return nlohmann::json(sorted).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

using TakeRecord = std::function<absl::Status(const Record& record)>;

Record NodeRecord(const v1::Node& node, bool has_dates) {
  Record record(has_dates);
  record.Text(node.id()).Text(node.kind()).Text(node.layer()).Text(node.name());
  record.Text(node.semantic_class().name()).Count(node.semantic_class().id());
  if (node.has_map_t_node()) {
    const v1::Quaternion& q = node.map_t_node().orientation();
    const bool is_turned = node.map_t_node().has_orientation();
    record.Point(node.map_t_node().position());
    record.Number(q.x()).Number(q.y()).Number(q.z()).Number(is_turned ? q.w() : 1.0);
  } else {
    record.Empty(7);
  }
  if (node.has_bounding_box()) {
    record.Point(node.bounding_box().min()).Point(node.bounding_box().max());
  } else {
    record.Empty(6);
  }
  record.Time(node.has_valid_from_ns(), node.valid_from_ns())
      .Time(node.has_valid_to_ns(), node.valid_to_ns());
  record.Time(node.has_first_observed_ns(), node.first_observed_ns())
      .Time(node.has_last_observed_ns(), node.last_observed_ns());
  record.Count(node.observation_count());
  if (node.has_confidence()) {
    record.Number(node.confidence());
  } else {
    record.Empty(1);
  }
  record.Text(ProvenanceText(node.provenance())).Count(node.revision());
  return record.Text(AttributesJson(node.attributes()));
}

Record EdgeRecord(const v1::Edge& edge, bool has_dates) {
  Record record(has_dates);
  record.Text(edge.source()).Text(edge.relation()).Text(edge.target()).Number(edge.weight());
  record.Time(edge.has_valid_from_ns(), edge.valid_from_ns())
      .Time(edge.has_valid_to_ns(), edge.valid_to_ns());
  return record.Count(edge.revision()).Text(AttributesJson(edge.attributes()));
}

Record PoseRecord(const AgentRow& agent, const v1::TimedPose& pose, bool has_dates) {
  Record record(has_dates);
  record.Text(agent.id).Text(agent.name).Text(agent.kind).Time(pose.time_ns());
  record.Point(pose.pose().position());
  if (pose.flags() & pose_flags::kNoOrientation) {
    record.Empty(4);
  } else {
    const v1::Quaternion& q = pose.pose().orientation();
    const double w = pose.pose().has_orientation() ? q.w() : 1.0;
    record.Number(q.x()).Number(q.y()).Number(q.z()).Number(w);
  }
  record.Count((pose.flags() & pose_flags::kCorrected) != 0);
  return record.Count((pose.flags() & pose_flags::kPredicted) != 0);
}

class TableWriter {
 public:
  TableWriter(const MapRows& map, const std::string& folder, bool force)
      : map_(map), folder_(folder), force_(force), has_dates_(map.session().times().has_dates()) {}

  absl::Status WriteNodes() {
    const auto rows = [this](const TakeRecord& take) {
      return map_.Nodes([&](const v1::Node& node) {
        if (node.kind() == kinds::kRoom || node.kind() == kinds::kPlace) {
          regions_.emplace_back(node.id(), node.kind());
        }
        return take(NodeRecord(node, has_dates_));
      });
    };
    return Write("nodes",
                 {"id",
                  "kind",
                  "layer",
                  "name",
                  "class",
                  "class_id",
                  "x_m",
                  "y_m",
                  "z_m",
                  "qx",
                  "qy",
                  "qz",
                  "qw",
                  "box_min_x_m",
                  "box_min_y_m",
                  "box_min_z_m",
                  "box_max_x_m",
                  "box_max_y_m",
                  "box_max_z_m",
                  "valid_from_ns",
                  "valid_to_ns",
                  "first_observed_ns",
                  "last_observed_ns",
                  "observation_count",
                  "confidence",
                  "provenance",
                  "revision",
                  "attributes"},
                 rows);
  }

  absl::Status WriteEdges() {
    const auto rows = [this](const TakeRecord& take) {
      return map_.Edges([&](const v1::Edge& edge) { return take(EdgeRecord(edge, has_dates_)); });
    };
    return Write("edges",
                 {"source", "relation", "target", "weight", "valid_from_ns", "valid_to_ns",
                  "revision", "attributes"},
                 rows);
  }

  absl::Status WriteTracks() {
    DSG_ASSIGN_OR_RETURN(const std::vector<AgentRow> agents, map_.Agents());
    const auto rows = [&](const TakeRecord& take) {
      for (const AgentRow& agent : agents) {
        DSG_RETURN_IF_ERROR(map_.Poses(agent.id, [&](const v1::TimedPose& pose) {
          return take(PoseRecord(agent, pose, has_dates_));
        }));
      }
      return absl::OkStatus();
    };
    return Write("tracks",
                 {"agent_id", "agent_name", "agent_kind", "time_ns", "x_m", "y_m", "z_m", "qx",
                  "qy", "qz", "qw", "corrected", "predicted"},
                 rows);
  }

  /// Requires: WriteNodes, which sees the rooms and places.
  absl::Status WriteStays() {
    const auto rows = [this](const TakeRecord& take) {
      for (const auto& [id, kind] : regions_) {
        DSG_RETURN_IF_ERROR(map_.Stays(id, [&](const v1::PresenceInterval& stay) {
          Record record(has_dates_);
          record.Text(stay.agent_id()).Text(stay.agent_name()).Text(id).Text(kind);
          return take(record.Time(stay.enter_ns()).Time(stay.exit_ns()));
        }));
      }
      return absl::OkStatus();
    };
    return Write("stays", {"agent_id", "agent_name", "node_id", "node_kind", "enter_ns", "exit_ns"},
                 rows);
  }

  std::string PathOf(const std::string& table) const {
    return absl::StrCat(folder_, "/", table, ".csv");
  }
  std::vector<Written> TakeFiles() { return std::move(files_); }

 private:
  absl::Status Write(const std::string& table, std::initializer_list<const char*> columns,
                     const std::function<absl::Status(const TakeRecord&)>& rows) {
    DSG_ASSIGN_OR_RETURN(AtomicFile file, AtomicFile::Create(PathOf(table), force_));
    std::string text;
    AppendCsvRecord(Headings(columns, has_dates_), &text);
    DSG_RETURN_IF_ERROR(file.Write(text));
    int64_t row_count = 0;
    DSG_RETURN_IF_ERROR(rows([&](const Record& record) {
      ++row_count;
      text.clear();
      AppendCsvRecord(record.cells(), &text);
      return file.Write(text);
    }));
    DSG_RETURN_IF_ERROR(file.Commit());
    files_.push_back({.format = "csv",
                      .path = file.path(),
                      .byte_count = file.byte_count(),
                      .counts = {{"rows", row_count}}});
    return absl::OkStatus();
  }

  const MapRows& map_;
  const std::string folder_;
  const bool force_;
  const bool has_dates_;
  /// Rooms and places, by id and kind.
  std::vector<std::pair<std::string, std::string>> regions_;
  std::vector<Written> files_;
};

}  // namespace

absl::StatusOr<std::vector<Written>> WriteCsvTables(const MapRows& map, const std::string& folder,
                                                    bool force) {
  DSG_RETURN_IF_ERROR(MakeFolder("--csv", folder));
  TableWriter writer(map, folder, force);
  for (const char* table : {"nodes", "edges", "tracks", "stays"}) {
    DSG_RETURN_IF_ERROR(CheckMayWrite(writer.PathOf(table), force));
  }
  DSG_RETURN_IF_ERROR(writer.WriteNodes());
  DSG_RETURN_IF_ERROR(writer.WriteEdges());
  DSG_RETURN_IF_ERROR(writer.WriteTracks());
  DSG_RETURN_IF_ERROR(writer.WriteStays());
  return writer.TakeFiles();
}

}  // namespace dsg::cli
