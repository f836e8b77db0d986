// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_binary_writer.h"

#include <iterator>

#include "schema/base/status.h"
#include "schema/interop/json_peek.h"
#include "schema/interop/spark_byte_writer.h"
#include "schema/interop/spark_field_writer.h"
#include "schema/interop/spark_fields.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

constexpr size_t kPieceBytes = size_t{256} << 10;

// A node's type byte is an index into this list, which the file carries.
constexpr SparkClass kClasses[] = {
    SparkClass::kAgent,  SparkClass::kKhronosObject, SparkClass::kNode,
    SparkClass::kObject, SparkClass::kPlace,         SparkClass::kPlace2d,
    SparkClass::kRoom,   SparkClass::kSemantic,      SparkClass::kTraversability};

uint8_t IndexOf(SparkClass type) {
  for (uint8_t i = 0; i < std::size(kClasses); ++i) {
    if (kClasses[i] == type) return i;
  }
  return 0;
}

std::string Dump(const Json& value) {
  return value.dump(-1, ' ', false, Json::error_handler_t::replace);
}

class GraphWriter {
 public:
  explicit GraphWriter(const ByteSink& sink) : sink_(sink) {}

  absl::Status Write(const SparkGraph& graph) {
    WriteHead(graph);
    out_.ListBegin();
    for (const SparkNode& node : graph.nodes) {
      WriteNode(node);
      DSG_RETURN_IF_ERROR(Flush(kPieceBytes));
    }
    out_.ListEnd();
    out_.ListBegin();
    for (const SparkEdge& edge : graph.edges) {
      WriteEdge(edge);
      DSG_RETURN_IF_ERROR(Flush(kPieceBytes));
    }
    out_.ListEnd();
    out_.Bool(graph.mesh.has_value());
    if (graph.mesh.has_value()) DSG_RETURN_IF_ERROR(WriteMesh(*graph.mesh));
    return Flush(0);
  }

 private:
  absl::Status Flush(size_t limit) {
    if (out_.bytes().size() < limit) return absl::OkStatus();
    DSG_RETURN_IF_ERROR(sink_(out_.bytes()));
    out_.bytes().clear();
    return absl::OkStatus();
  }

  void WriteHead(const SparkGraph& graph) {
    out_.Text("SPARK_DSG");
    out_.Text("main");
    out_.Unsigned8(kSparkVersionNewest.major);
    out_.Unsigned8(kSparkVersionNewest.minor);
    out_.Unsigned8(kSparkVersionNewest.patch);
    out_.Array(graph.layer_keys.size());
    for (const SparkLayerKey& key : graph.layer_keys) WriteKey(key);
    out_.Array(std::size(kClasses));
    for (const SparkClass type : kClasses) out_.Text(NameOf(type));
    out_.Array(1);
    out_.Text("EdgeAttributes");
    out_.Array(graph.layer_names.size());
    for (const auto& [name, key] : graph.layer_names) {
      out_.Text(name);
      WriteKey(key);
    }
    out_.Text(Dump(WithOwn(graph.metadata, graph.own)));
  }

  void WriteKey(const SparkLayerKey& key) {
    out_.Array(2);
    out_.Signed64(key.layer);
    out_.Unsigned32(key.partition);
  }

  void WriteNode(const SparkNode& node) {
    const Json read = AllFieldsOf(node);
    const Json fields = read.is_null() ? MakeFields(node) : read;
    out_.Array(4);
    out_.Signed64(node.key.layer);
    out_.Unsigned64(node.id);
    out_.Unsigned32(node.key.partition);
    out_.Unsigned8(IndexOf(node.type));
    out_.Text(Dump(WithOwn(Peek(fields, "metadata"), node.own)));
    for (const SparkField& field : FieldsOf(node.type)) {
      WriteSparkField(field.type, Peek(fields, field.name), &out_);
    }
  }

  void WriteEdge(const SparkEdge& edge) {
    out_.Array(3);
    out_.Unsigned64(edge.source);
    out_.Unsigned64(edge.target);
    out_.Unsigned8(0);
    out_.Text(Dump(WithOwn(MetadataJson(edge.metadata), edge.own)));
    out_.Bool(edge.weighted);
    out_.Double(edge.weight);
  }

  template <typename T, typename WriteOne>
  absl::Status Channel(const std::vector<T>& items, const WriteOne& write) {
    out_.Array(items.size());
    for (const T& item : items) {
      write(item);
      DSG_RETURN_IF_ERROR(Flush(kPieceBytes));
    }
    return absl::OkStatus();
  }

  absl::Status WriteMesh(const MeshBlock& mesh) {
    out_.Bool(!mesh.colors.empty());
    out_.Bool(!mesh.last_seen_ns.empty());
    out_.Bool(!mesh.labels.empty());
    out_.Bool(!mesh.first_seen_ns.empty());
    DSG_RETURN_IF_ERROR(Channel(mesh.positions_map, [this](const Eigen::Vector3f& point) {
      for (int i = 0; i < 3; ++i) out_.Float(point[i]);
    }));
    DSG_RETURN_IF_ERROR(Channel(mesh.colors, [this](uint32_t rgb) {
      for (const int shift : {16, 8, 0}) out_.Unsigned8(static_cast<uint8_t>(rgb >> shift));
      out_.Unsigned8(255);
    }));
    const auto stamp = [this](TimeNs time_ns) {
      out_.Unsigned64(time_ns < 0 ? 0 : static_cast<uint64_t>(time_ns));
    };
    DSG_RETURN_IF_ERROR(Channel(mesh.last_seen_ns, stamp));
    DSG_RETURN_IF_ERROR(Channel(mesh.labels, [this](uint32_t label) { out_.Unsigned32(label); }));
    DSG_RETURN_IF_ERROR(Channel(mesh.first_seen_ns, stamp));
    return Channel(mesh.faces, [this](const std::array<uint32_t, 3>& face) {
      out_.Array(3);
      for (const uint32_t vertex : face) out_.Unsigned64(vertex);
    });
  }

  const ByteSink& sink_;
  SparkByteWriter out_;
};

}  // namespace

absl::Status WriteSparkAsBinary(const SparkGraph& graph, const ByteSink& sink) {
  return GraphWriter(sink).Write(graph);
}

}  // namespace dsg
