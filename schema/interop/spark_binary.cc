// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/spark_binary.h"

#include <limits>

#include "absl/strings/str_cat.h"
#include "schema/base/status.h"
#include "schema/interop/file_error.h"
#include "schema/interop/json_document.h"
#include "schema/interop/json_fields.h"
#include "schema/interop/spark_attributes.h"
#include "schema/interop/spark_binary_fields.h"
#include "schema/interop/spark_byte_reader.h"
#include "schema/interop/spark_metadata.h"

namespace dsg {
namespace {

constexpr uint64_t kUint32Max = std::numeric_limits<uint32_t>::max();
constexpr uint64_t kUint64Max = std::numeric_limits<uint64_t>::max();
constexpr std::string_view kIdentifier = "SPARK_DSG";
constexpr SparkVersion kVersionOldest = {1, 0, 2};
constexpr size_t kTextBytesMax = size_t{1} << 20;
constexpr size_t kGraphTextBytesMax = size_t{64} << 20;

class SparkBinaryReader {
 public:
  SparkBinaryReader(std::string_view bytes, const std::string& file)
      : in_(bytes, file), file_(file) {}

  absl::StatusOr<SparkGraph> Read() {
    ReadHeader();
    if (in_.ok() && in_.NextIsBool()) {
      graph_.mesh = ReadBinaryMesh(&in_);
    } else {
      ReadGraph();
    }
    if (in_.left() > 0) in_.Fail("the file", "goes on after its end");
    DSG_RETURN_IF_ERROR(in_.status());
    return std::move(graph_);
  }

 private:
  bool Since(const SparkVersion& version) const { return graph_.version >= version; }

  void ReadHeader() {
    in_.Text("identifier", kIdentifier.size());
    in_.Text("project name", kTextBytesMax);
    graph_.version.major = static_cast<uint8_t>(in_.Unsigned("version", 255));
    graph_.version.minor = static_cast<uint8_t>(in_.Unsigned("version", 255));
    graph_.version.patch = static_cast<uint8_t>(in_.Unsigned("version", 255));
    if (graph_.version < kVersionOldest || graph_.version > kSparkVersionNewest) {
      in_.Fail("version",
               absl::StrCat("is ", ToString(graph_.version), "; binary files from ",
                            ToString(kVersionOldest), " to ", ToString(kSparkVersionNewest),
                            " are read. Save the graph as JSON instead"));
    }
  }

  void ReadGraph() {
    const size_t layer_count = in_.Array("layer keys", 2);
    for (size_t i = 0; i < layer_count && in_.ok(); ++i)
      graph_.layer_keys.push_back(ReadLayerKey());
    node_classes_ = ReadNames("node classes");
    edge_classes_ = ReadNames("edge classes");
    // Some files of 1.1.x lack the names; an array of texts cannot be mistaken for the text of the
    // metadata that follows.
    if (Since({1, 1, 0}) && in_.NextIsArrayOfArrays()) ReadLayerNames();
    if (Since({1, 0, 6})) {
      ReadGraphMetadata(ParseMetadata("graph metadata", kGraphTextBytesMax), &graph_);
    }
    // Before 1.1.0 the nodes with a time came in a list of their own.
    const int list_count = Since({1, 1, 0}) ? 1 : 2;
    for (int i = 0; i < list_count && in_.ok(); ++i) {
      in_.ListBegin("nodes");
      while (!in_.ListEnd()) ReadNode();
    }
    in_.ListBegin("edges");
    while (!in_.ListEnd()) ReadEdge();
    if (in_.Bool("mesh flag")) graph_.mesh = ReadBinaryMesh(&in_);
  }

  // A bare layer in files that predate partitions.
  SparkLayerKey ReadLayerKey() {
    if (in_.NextIsInteger()) return {in_.Signed("layer"), 0};
    in_.Marker("layer key", 2);
    const int64_t layer = in_.Signed("layer");
    return {layer, static_cast<uint32_t>(in_.Unsigned("partition", kUint32Max))};
  }

  std::vector<std::string> ReadNames(const char* field) {
    std::vector<std::string> names(in_.Array(field, 5));
    for (std::string& name : names) name = in_.Text(field, kTextBytesMax);
    return names;
  }

  void ReadLayerNames() {
    const size_t count = in_.Array("layer names", 7);
    for (size_t i = 0; i < count && in_.ok(); ++i) {
      const std::string name = in_.Text("layer name", kTextBytesMax);
      graph_.layer_names[name] = ReadLayerKey();
    }
  }

  nlohmann::json ParseMetadata(const char* field, size_t max) {
    const std::string text = in_.Text(field, max);
    if (text.empty() || text == "null" || text == "{}") return nullptr;
    auto parsed = ParseJson(text, file_);
    if (parsed.ok()) return *std::move(parsed);
    in_.Fail(field, absl::StrCat("is not JSON: ", parsed.status().message()));
    return nullptr;
  }

  void ReadNode() {
    SparkNode node;
    const size_t part_count = in_.Array("node", 1);
    node.key.layer = in_.Signed("layer");
    node.id = in_.Unsigned("node id", kUint64Max);
    const bool is_untimed = part_count == 3 && !Since({1, 1, 0});
    if (part_count != 4 && !is_untimed) in_.Fail("node", "should be an array of 4");
    if (Since({1, 1, 0})) {
      node.key.partition = static_cast<uint32_t>(in_.Unsigned("partition", kUint32Max));
    } else if (!is_untimed && !in_.TakeNil()) {
      node.stamp_ns = in_.Signed("node time");
      node.key.partition = static_cast<uint32_t>(node.id >> 56);
    }
    const auto type = SparkClassOf(ReadClass(node_classes_));
    if (!type.has_value()) in_.Fail("node class", "is none that the format has");
    if (!in_.ok()) return;
    node.type = *type;
    ReadAttributes(&node);
    if (in_.ok()) graph_.nodes.push_back(std::move(node));
  }

  std::string ReadClass(const std::vector<std::string>& names) {
    const uint64_t index = in_.Unsigned("class", 255);
    if (index < names.size()) return names[index];
    in_.Fail("class", absl::StrCat("is ", index, "; the file names ", names.size(), " classes"));
    return "";
  }

  void ReadAttributes(SparkNode* node) {
    nlohmann::json metadata;
    if (Since({1, 0, 6})) metadata = ParseMetadata("metadata", kTextBytesMax);
    nlohmann::json fields = ReadBinaryFields(node->type, graph_.version, &in_);
    if (!in_.ok()) return;
    fields["metadata"] = std::move(metadata);
    const std::string where = absl::StrCat("node ", ToString(NodeId(node->id)));
    const absl::Status read = ReadWhatCanBeRead(file_, where, &fields, &graph_.skips, node);
    if (!read.ok()) return in_.Fail("attributes", std::string(read.message()));
    FinishNode(std::move(fields), node);
    PackFields(node);
  }

  void ReadEdge() {
    SparkEdge edge;
    in_.Marker("edge", 3);
    edge.source = in_.Unsigned("edge source", kUint64Max);
    edge.target = in_.Unsigned("edge target", kUint64Max);
    const std::string class_name = ReadClass(edge_classes_);
    if (class_name != "EdgeAttributes") in_.Fail("edge class", "is none that the format has");
    nlohmann::json metadata;
    if (Since({1, 0, 6})) metadata = ParseMetadata("metadata", kTextBytesMax);
    edge.own = TakeOwn(&metadata);
    edge.metadata = MetadataText(metadata);
    edge.weighted = in_.Bool("edge weighted");
    edge.weight = in_.Number("edge weight");
    if (in_.ok()) graph_.edges.push_back(std::move(edge));
  }

  SparkByteReader in_;
  std::string file_;
  SparkGraph graph_;
  std::vector<std::string> node_classes_;
  std::vector<std::string> edge_classes_;
};

}  // namespace

bool LooksLikeSparkBinary(std::string_view bytes) {
  return !bytes.empty() && (bytes[0] == '\xdd' || bytes[0] == '\xdb');
}

absl::StatusOr<SparkGraph> ReadSparkBinary(std::string_view bytes, const std::string& file) {
  constexpr size_t kCountBytes = 5;
  if (bytes.size() >= kCountBytes + kIdentifier.size() &&
      bytes.substr(kCountBytes, kIdentifier.size()) != kIdentifier) {
    return FileError(file, "byte 0",
                     "does not begin with \"SPARK_DSG\"; binary files from before version 1.0.2 "
                     "are not read, load the file with its own program and save it as JSON");
  }
  return SparkBinaryReader(bytes, file).Read();
}

}  // namespace dsg
