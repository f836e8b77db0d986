// SPDX-License-Identifier: Apache-2.0
// Nodes of Spark-DSG and nodes of a map, in both directions.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "schema/interop/spark_graph.h"
#include "schema/interop/spark_layers.h"
#include "schema/model/node.h"

namespace dsg {

/// Converts nodes and counts what it had to leave out.
class SparkNodeConverter {
 public:
  /// `graph` and `skips` must outlive the converter.
  SparkNodeConverter(const SparkGraph& graph, Skips* skips);

  /// Position, box in the node's frame, class, times, components and attributes. Fields that a map
  /// cannot hold are left out and counted in `skips`; nullopt, counted too, if the id or the
  /// position is such a field.
  std::optional<Node> Convert(const SparkNode& in, const SparkPlacement& placement);

  /// One sentence for each thing left out, with its count.
  std::vector<std::string> notes() const;

 private:
  void ConvertPose(const SparkNode& in, Node* out);
  void ConvertBox(const SparkNode& in, Node* out);
  void ConvertClass(const SparkNode& in, Node* out);
  void ConvertTimes(const SparkNode& in, Node* out);
  void ConvertComponents(const SparkNode& in, Node* out);
  RegionInfo RegionOf(const SparkNode& in, const std::vector<Eigen::Vector3d>& boundary,
                      const Node& out);
  void ConvertAttributes(const SparkNode& in, Node* out);
  double DistanceOf(const SparkNode& in);
  std::vector<Eigen::Vector3d> BoundaryOf(const SparkNode& in);
  void SkipField(const SparkNode& in, const std::string& what);

  const SparkGraph& graph_;
  Skips& skips_;
  /// When the robots were there; stamps outside are not times.
  Interval plausible_;
  /// Reason -> count.
  std::map<std::string, int64_t> left_out_;
  /// Objects whose label has no name.
  int64_t unnamed_class_count_ = 0;
};

/// The class for a node that does not remember one. Things whose validity begins or ends are
/// Khronos objects, which have presence; so are humans, whose viewer shows their ways.
SparkClass ClassFor(const Node& node);

/// Pose, box, name, class, times and components in the format's terms; `fields` stays null.
SparkNode ToSpark(const Node& node, SparkClass type, SparkLayerKey key);

}  // namespace dsg
