// SPDX-License-Identifier: Apache-2.0
// One node of a Spark-DSG file as a node of a map.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "schema/interop/spark_graph.h"
#include "schema/interop/spark_layers.h"
#include "schema/model/node.h"

namespace dsg {

/// Converts nodes and counts what it had to leave out.
class SparkNodeConverter {
 public:
  /// `graph` must outlive the converter.
  SparkNodeConverter(const SparkGraph& graph, std::string file);

  /// Position, box in the node's frame, class, times, components and attributes.
  /// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming the node and the field.
  absl::StatusOr<Node> Convert(const SparkNode& in, const SparkPlacement& placement);

  /// One sentence for each thing left out, with its count.
  std::vector<std::string> notes() const;

 private:
  absl::Status ConvertPose(const SparkNode& in, Node* out);
  absl::Status ConvertBox(const SparkNode& in, Node* out);
  absl::Status ConvertClass(const SparkNode& in, Node* out);
  void ConvertTimes(const SparkNode& in, Node* out);
  absl::Status ConvertComponents(const SparkNode& in, Node* out);
  void ConvertAttributes(const SparkNode& in, Node* out);
  absl::Status Fail(const SparkNode& in, const std::string& what) const;

  const SparkGraph& graph_;
  std::string file_;
  /// When the robots were there; stamps outside are not times.
  Interval plausible_;
  /// Reason -> count.
  std::map<std::string, int64_t> left_out_;
};

}  // namespace dsg
