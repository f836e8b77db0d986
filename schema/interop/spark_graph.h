// SPDX-License-Identifier: Apache-2.0
// What a Spark-DSG file says, in the file's own terms: readers fill it, writers write it. What no
// map can hold is found later, in spark_to_delta.h.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <compare>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "schema/interop/file_errors.h"
#include "schema/model/layer.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"

namespace dsg {

struct SparkVersion {
  uint8_t major = 1;
  uint8_t minor = 0;
  uint8_t patch = 0;
  auto operator<=>(const SparkVersion&) const = default;
};

/// "1.1.3".
std::string ToString(const SparkVersion& version);

/// The newest version whose files are known in full.
inline constexpr SparkVersion kSparkVersionNewest = {1, 1, 3};

/// Layer and partition; partition 0 is the primary one. A larger layer holds a smaller one.
struct SparkLayerKey {
  int64_t layer = 0;
  uint32_t partition = 0;
  auto operator<=>(const SparkLayerKey&) const = default;
};

/// The attribute classes, each extending an earlier one.
enum class SparkClass {
  kNode,
  kSemantic,
  kObject,
  kKhronosObject,
  kRoom,
  kPlace,
  kPlace2d,
  kAgent,
  kTraversability,
};

/// nullopt for a name that the format does not have.
std::optional<SparkClass> SparkClassOf(std::string_view name);
std::string_view NameOf(SparkClass type);
/// All but nodes, agents and traversability carry the semantic fields.
bool IsSemantic(SparkClass type);

/// Bounds in the world frame, metres.
struct SparkBox {
  enum class Type { kInvalid = 0, kAligned = 1, kOriented = 2, kYawOnly = 3 };
  Type type = Type::kInvalid;
  Eigen::Vector3f dimensions = Eigen::Vector3f::Zero();
  Eigen::Vector3f center = Eigen::Vector3f::Zero();
  /// From the box's frame to the world.
  Eigen::Matrix3f rotation = Eigen::Matrix3f::Identity();
};

/// In JSON, by SparkBox::Type.
inline constexpr const char* kSparkBoxNames[] = {"INVALID", "AABB", "OBB", "RAABB"};

/// Opaque black, which the format has where nobody gave a colour.
inline constexpr Color kSparkNoColor = {0, 0, 0, 255};

/// The key in the metadata of nodes, edges and graph under which exports of maps keep what the
/// format has no words for. Readers take it out of the metadata, writers put it back.
inline constexpr char kOwnMetadata[] = "dsgdb";

struct SparkNode {
  uint64_t id = 0;
  SparkLayerKey key;
  SparkClass type = SparkClass::kNode;
  /// When the robot was there; from the node before 1.1.0 and from its attributes since.
  std::optional<int64_t> stamp_ns;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  uint64_t last_update_ns = 0;
  bool is_predicted = false;
  std::string name;
  std::optional<Color> color;
  SparkBox box;
  std::optional<uint32_t> label;
  /// world_R_body, world_R_object or a frontier's orientation; not normalised.
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  double distance = 0.0;
  uint32_t basis_point_count = 0;
  std::vector<Eigen::Vector3d> boundary;
  std::map<std::string, double> class_probabilities;
  std::vector<uint64_t> first_observed_ns;
  std::vector<uint64_t> last_observed_ns;
  /// Lengths of lists (none when empty), flags (only true ones), metadata as JSON text.
  Attributes attributes;
  /// All attributes as the newest version has them in JSON, "type" and "metadata" among them;
  /// null in nodes that were not read from a file, and in those whose fields are packed.
  nlohmann::json fields;
  /// Instead of `fields`, in a tenth of the memory: CBOR of those that are not what they are in any
  /// node of the class. See SparseFieldsOf.
  std::vector<uint8_t> packed_fields;
  /// What of our own stood, or is to stand, in the metadata; see kOwnMetadata.
  nlohmann::json own;
};

struct SparkEdge {
  uint64_t source = 0;
  uint64_t target = 0;
  bool weighted = false;
  double weight = 1.0;
  /// JSON text; "" for none.
  std::string metadata;
  /// As SparkNode::own.
  nlohmann::json own;
};

struct SparkGraph {
  SparkVersion version;
  std::vector<SparkNode> nodes;
  std::vector<SparkEdge> edges;
  std::map<std::string, SparkLayerKey> layer_names;
  /// Also layers without nodes.
  std::vector<SparkLayerKey> layer_keys;
  std::map<SparkLayerKey, std::vector<SemanticLabel>> label_spaces;
  /// All of the graph's metadata, label spaces among it; null for none.
  nlohmann::json metadata;
  /// As SparkNode::own.
  nlohmann::json own;
  /// One piece; its index is unused, stamps are in last_seen_ns.
  std::optional<MeshBlock> mesh;
  std::vector<std::string> notes;
  /// What was not read.
  Skips skips;
};

/// The last step of reading a node: its `fields` are those of `attributes` in their newest form,
/// without what is our own. Fields that are missing may stay so.
void FinishNode(nlohmann::json attributes, SparkNode* node);
/// Turns `fields` into `packed_fields`.
void PackFields(SparkNode* node);
/// `fields`, or what they were before PackFields; null if there were none.
nlohmann::json AllFieldsOf(const SparkNode& node);
/// The same, but for the "type" and fields that hold what DefaultOf says.
nlohmann::json SparseFieldsOf(const SparkNode& node);

/// Keeps the length of a list that is not empty.
void AddLength(const char* name, size_t length, SparkNode* node);
/// Keeps a flag that is set.
void AddFlag(const char* name, bool value, SparkNode* node);
/// Keeps a number that is finite and not zero, nor so near to zero (below 2.3e-308) that it is
/// memory that nobody filled in.
void AddNumber(const std::string& name, double value, SparkNode* node);

/// Stamps are unsigned in Spark-DSG; one that does not fit a TimeNs is not a time and reads as 0.
TimeNs StampOrZero(uint64_t stamp_ns);
/// 0 for times before 1970.
uint64_t SparkStampOf(TimeNs time_ns);

/// Metadata as text and back: "" for null and {}; an object also for text that is none.
std::string MetadataText(const nlohmann::json& metadata);
nlohmann::json MetadataJson(const std::string& text);

/// Takes what is under kOwnMetadata out of metadata, null if there is nothing, and puts it back;
/// the result is an object also when `metadata` is not.
nlohmann::json TakeOwn(nlohmann::json* metadata);
nlohmann::json WithOwn(nlohmann::json metadata, const nlohmann::json& own);

/// Reads the metadata of a graph and its label spaces ("labelspaces": {"_l2p0": [[0, "chair"],
/// ...]}). Keys that are not understood are named in the graph's notes.
void ReadGraphMetadata(const nlohmann::json& metadata, SparkGraph* graph);

}  // namespace dsg
