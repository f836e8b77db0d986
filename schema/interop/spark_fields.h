// SPDX-License-Identifier: Apache-2.0
// The fields of Spark-DSG's attribute classes, as tables that all readers and writers walk.
// What a field means in a map is in spark_nodes.h.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "schema/interop/spark_graph.h"

namespace dsg {

/// How a field is written; in JSON, and with type bytes in the binary form.
enum class SparkFieldType {
  kVector3,
  kVector2,
  kMatrix2,
  kUnsigned64,
  kUnsigned32,
  kNodeId,
  kTime,
  kLabel,
  kNumber,
  kBool,
  kText,
  kColor,
  kBox,
  kFeature,
  kColumnUnsigned32,
  kColumnFloat,
  kQuaternion,
  kList64,
  kList8,
  kVectorList,
  kFloatVectorList,
  kCloudList,
  kMeshLinks,
  kProbabilities,
  kDetails,
  kMesh,
};

struct SparkField {
  const char* name;
  SparkFieldType type;
  /// The first version that has it.
  SparkVersion since = {1, 0, 0};
};

/// All fields of a class but "type" and "metadata", base class first: the order of the binary form.
const std::vector<SparkField>& FieldsOf(SparkClass type);

/// What a field holds in a node of that id when nothing is known of it; null for a time, which is
/// then left out.
nlohmann::json DefaultOf(SparkFieldType type, uint64_t node_id);

/// DefaultOf the field of that name, or an empty object for the metadata; nullptr for fields that
/// the class does not have, and for those whose default depends on the node's id.
const nlohmann::json* DefaultFor(SparkClass type, const std::string& name);

/// `fields` but for the "type" and for those that are what UpgradeFields would add; null stays
/// null.
nlohmann::json WithoutDefaults(SparkClass type, uint64_t node_id, nlohmann::json fields);

/// Defaults of the fields that a node of the class reads the same without, by name, as text without
/// blanks.
std::map<std::string, std::string, std::less<>> UsualTexts(SparkClass type);

/// Rewrites old forms of colours, boxes, features and meshes as those of kSparkVersionNewest, and
/// takes out fields that are null.
/// Requires: the attributes have been read without errors.
void UpgradeForms(SparkClass type, nlohmann::json* attributes);

/// Turns the attributes of a node of any version into those of kSparkVersionNewest: old forms of
/// colours, boxes and meshes are rewritten, missing fields added. What the format does not know is
/// left alone. Requires: the attributes have been read without errors.
void UpgradeFields(SparkClass type, uint64_t node_id, nlohmann::json* attributes);

/// The attributes that the members of a node say; lists that it keeps as lengths are empty.
nlohmann::json MakeFields(const SparkNode& node);
/// The same without fields of which the members say nothing, and without the "type".
nlohmann::json MakeSparseFields(const SparkNode& node);

}  // namespace dsg
