// SPDX-License-Identifier: Apache-2.0
#include "schema/interop/region_json.h"

#include <charconv>
#include <cmath>
#include <optional>
#include <unordered_set>
#include <vector>

#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"
#include "schema/base/status.h"
#include "schema/interop/json_fields.h"
#include "schema/model/delta_check.h"

namespace dsg {
namespace {

using Json = nlohmann::json;

// "O(470)".
std::optional<NodeId> IdOf(std::string_view text, char letter) {
  if (text.size() < 4 || text[0] != letter || text[1] != '(' || text.back() != ')') {
    return std::nullopt;
  }
  uint64_t index = 0;
  const char* const end = text.data() + text.size() - 1;
  const auto result = std::from_chars(text.data() + 2, end, index);
  if (result.ec != std::errc() || result.ptr != end || index > NodeId::kIndexMax) {
    return std::nullopt;
  }
  return NodeId(letter, index);
}

// "(5.938, -0.921)".
std::optional<Eigen::Vector3d> CenterOf(std::string_view text) {
  if (text.size() < 2 || text.front() != '(' || text.back() != ')') return std::nullopt;
  const std::string inner(text.substr(1, text.size() - 2));
  const std::vector<std::string> parts = absl::StrSplit(inner, ',');
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  const bool is_pair = parts.size() == 2 && absl::SimpleAtod(parts[0], &center.x()) &&
                       absl::SimpleAtod(parts[1], &center.y());
  if (!is_pair || !center.allFinite() || center.cwiseAbs().maxCoeff() > kCoordinateMaxM) {
    return std::nullopt;
  }
  return center;
}

class RegionReader {
 public:
  explicit RegionReader(const std::string& file) : source_{file, absl::OkStatus()} {}

  absl::StatusOr<ImportedGraph> Read(const Json& json) {
    const JsonFields root(json, "", &source_);
    ReadNodes(root, "regions", 'R');
    ReadNodes(root, "objects", 'O');
    if (!source_.ok()) return source_.status;
    GraphDelta& delta = result_.delta;
    result_.format = "region-json";
    result_.node_count = static_cast<int64_t>(delta.nodes.size());
    result_.edge_count = static_cast<int64_t>(delta.edges.size());
    result_.notes.push_back("the file has no heights, extents or times; z is 0");
    result_.skipped = skips_.all();
    FitBoxesToChildren(&delta);
    return std::move(result_);
  }

 private:
  void ReadNodes(const JsonFields& root, const char* name, char letter) {
    const JsonFields items = root.Object(name, true);
    if (!source_.ok()) return;
    for (const auto& [key, value] : root.Find(name)->items()) {
      if (!source_.ok()) return;
      const std::string where = absl::StrCat(name, ".", key.substr(0, 64));
      const auto id = IdOf(key, letter);
      if (!id.has_value()) {
        return source_.Fail(where, absl::StrCat("is not named ", std::string(1, letter), "(n)"));
      }
      ReadNode(JsonFields(value, where, &source_), *id);
    }
  }

  void ReadNode(const JsonFields& fields, NodeId id) {
    const bool is_region = id.letter() == 'R';
    Node node;
    node.id = id;
    node.layer = is_region ? layers::kRooms : layers::kObjects;
    node.kind = is_region ? kinds::kRoom : kinds::kObject;
    node.provenance = Provenance::kImported;
    node.class_name = fields.Text("semantic_label", "");
    if (node.class_name.size() > kNameLengthMax) fields.Fail("semantic_label", "is too long");
    const auto center = CenterOf(fields.Text("center"));
    if (!center.has_value()) return fields.Fail("center", "is not \"(x, y)\" in metres");
    node.map_T_node.position = *center;
    if (is_region) {
      node.region = RegionInfo{};
    } else {
      node.object = ObjectInfo{};
      AddParent(fields, id);
    }
    ids_.insert(id);
    result_.delta.nodes.push_back(std::move(node));
  }

  void AddParent(const JsonFields& fields, NodeId id) {
    const Json* parent = fields.Find("parent_region");
    if (parent == nullptr || parent->is_null() || *parent == "none") return;
    const auto region = IdOf(fields.Text("parent_region"), 'R');
    if (!region.has_value() || !ids_.contains(*region)) {
      return skips_.Add(SkipKind::kDanglingEdge, absl::StrCat(fields.where(), ".parent_region"),
                        "is no region of the file");
    }
    Edge edge;
    edge.source = *region;
    edge.relation = relations::kContains;
    edge.target = id;
    result_.delta.edges.push_back(std::move(edge));
  }

  JsonSource source_;
  Skips skips_;
  ImportedGraph result_;
  std::unordered_set<NodeId> ids_;
};

}  // namespace

absl::StatusOr<ImportedGraph> ReadRegionJson(const Json& root, const std::string& file) {
  return RegionReader(file).Read(root);
}

}  // namespace dsg
