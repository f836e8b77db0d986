// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_json_writer.h"

#include <charconv>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/spark_fields.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

// Handed over in pieces of about this size.
constexpr size_t kPieceBytes = size_t{256} << 10;

std::string Dump(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Json HeaderJson() {
  return {{"project_name", "main"},
          {"version",
           {{"major", kSparkVersionNewest.major},
            {"minor", kSparkVersionNewest.minor},
            {"patch", kSparkVersionNewest.patch}}}};
}

Json KeyJson(const SparkLayerKey& key) {
  return {{"layer", key.layer}, {"partition", key.partition}};
}

class JsonWriter {
 public:
  explicit JsonWriter(const ByteSink& sink) : sink_(sink) {}

  absl::Status Write(const SparkGraph& graph) {
    out_ = absl::StrCat("{\"SPARK_DSG_header\":", Dump(HeaderJson()),
                        ",\"directed\":false,\"multigraph\":false,\"layer_keys\":");
    Json keys = Json::array();
    for (const SparkLayerKey& key : graph.layer_keys) keys.push_back(KeyJson(key));
    Json names = Json::object();
    for (const auto& [name, key] : graph.layer_names) names[name] = KeyJson(key);
    const Json metadata = WithOwn(graph.metadata, graph.own);
    absl::StrAppend(&out_, Dump(keys), ",\"layer_names\":", Dump(names),
                    ",\"metadata\":", Dump(metadata), ",\n\"nodes\":");
    DSG_RETURN_IF_ERROR(Each(graph.nodes, [this](const SparkNode& node) { AddNode(node); }));
    out_ += ",\n\"edges\":";
    DSG_RETURN_IF_ERROR(Each(graph.edges, [this](const SparkEdge& edge) { AddEdge(edge); }));
    if (graph.mesh.has_value()) DSG_RETURN_IF_ERROR(WriteMesh(*graph.mesh));
    out_ += "}\n";
    return Flush(0);
  }

 private:
  absl::Status Flush(size_t limit) {
    if (out_.size() < limit) return absl::OkStatus();
    DSG_RETURN_IF_ERROR(sink_(out_));
    out_.clear();
    return absl::OkStatus();
  }

  // A list with one item a line, so that two exports can be compared by eye.
  template <typename T, typename Add>
  absl::Status Each(const std::vector<T>& items, const Add& add) {
    const char* before = "[\n";
    for (const T& item : items) {
      out_ += before;
      add(item);
      DSG_RETURN_IF_ERROR(Flush(kPieceBytes));
      before = ",\n";
    }
    out_ += items.empty() ? "[]" : "]";
    return absl::OkStatus();
  }

  void AddNode(const SparkNode& node) {
    Json fields = AllFieldsOf(node);
    if (fields.is_null()) fields = MakeFields(node);
    if (!node.own.is_null()) fields["metadata"] = WithOwn(fields["metadata"], node.own);
    absl::StrAppend(&out_, "{\"id\":", node.id, ",\"layer\":", node.key.layer,
                    ",\"partition\":", node.key.partition, ",\"attributes\":", Dump(fields), "}");
  }

  void AddEdge(const SparkEdge& edge) {
    const Json info = {{"type", "EdgeAttributes"},
                       {"metadata", WithOwn(MetadataJson(edge.metadata), edge.own)},
                       {"weighted", edge.weighted},
                       {"weight", edge.weight}};
    absl::StrAppend(&out_, "{\"source\":", edge.source, ",\"target\":", edge.target,
                    ",\"info\":", Dump(info), "}");
  }

  // The fewest digits that read back as the same single-precision number.
  void AddFloat(float value) {
    if (!std::isfinite(value)) {
      out_ += "null";
      return;
    }
    char digits[32];
    const auto [end, error] = std::to_chars(digits, digits + sizeof(digits), value);
    out_.append(digits, end);
  }

  template <typename T, typename Add>
  absl::Status Channel(const char* name, const std::vector<T>& items, const Add& add) {
    if (items.empty()) return absl::OkStatus();
    absl::StrAppend(&out_, ",\n\"", name, "\":");
    return Each(items, add);
  }

  absl::Status WriteMesh(const MeshBlock& mesh) {
    const auto flag = [](bool value) { return value ? "true" : "false"; };
    absl::StrAppend(&out_, ",\n\"mesh\":{\"header\":", Dump(HeaderJson()),
                    ",\"has_colors\":", flag(!mesh.colors.empty()),
                    ",\"has_timestamps\":", flag(!mesh.last_seen_ns.empty()),
                    ",\"has_labels\":", flag(!mesh.labels.empty()),
                    ",\"has_first_seen_stamps\":", flag(!mesh.first_seen_ns.empty()));
    const auto number = [this](auto value) { absl::StrAppend(&out_, value); };
    DSG_RETURN_IF_ERROR(Channel("points", mesh.positions_map, [this](const auto& point) {
      for (int i = 0; i < 3; ++i) {
        out_ += i == 0 ? '[' : ',';
        AddFloat(point[i]);
      }
      out_ += ']';
    }));
    DSG_RETURN_IF_ERROR(Channel("colors", mesh.colors, [this](uint32_t rgb) {
      absl::StrAppend(&out_, "{\"r\":", rgb >> 16 & 255, ",\"g\":", rgb >> 8 & 255,
                      ",\"b\":", rgb & 255, ",\"a\":255}");
    }));
    DSG_RETURN_IF_ERROR(Channel("stamps", mesh.last_seen_ns, number));
    DSG_RETURN_IF_ERROR(Channel("first_seen_stamps", mesh.first_seen_ns, number));
    DSG_RETURN_IF_ERROR(Channel("labels", mesh.labels, number));
    DSG_RETURN_IF_ERROR(Channel("faces", mesh.faces, [this](const auto& face) {
      absl::StrAppend(&out_, "[", face[0], ",", face[1], ",", face[2], "]");
    }));
    out_ += "}";
    return absl::OkStatus();
  }

  const ByteSink& sink_;
  std::string out_;
};

}  // namespace

absl::Status WriteSparkAsJson(const SparkGraph& graph, const ByteSink& sink) {
  return JsonWriter(sink).Write(graph);
}

}  // namespace dsg
