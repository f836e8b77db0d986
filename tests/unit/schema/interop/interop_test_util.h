// SPDX-License-Identifier: Apache-2.0
// What the tests of this folder share: an empty map, recorded files, a small graph of every class.
#pragma once

#include <gtest/gtest.h>

#include <string>

#include "schema/base/status.h"
#include "schema/interop/scene_graph_file.h"
#include "schema/interop/spark_graph.h"
#include "schema/model/delta_check.h"

namespace dsg {

/// A map that holds its default layers and nothing else.
class EmptyMap final : public GraphLookup {
 public:
  absl::StatusOr<std::optional<NodeFacts>> FindNode(NodeId id) const override;
  absl::StatusOr<std::optional<Layer>> FindLayer(LayerId id) const override;
  absl::StatusOr<std::vector<NodeId>> FindParents(NodeId id) const override;
  absl::StatusOr<std::vector<NodeId>> FindChildren(NodeId id) const override;
  absl::StatusOr<std::optional<TimeNs>> FindTrackEnd(NodeId agent) const override;
  absl::StatusOr<bool> HasAsset(const Sha256& sha256) const override;
};

/// CheckDelta on an empty map, with a session filled in.
absl::Status CheckImport(const ImportedGraph& imported);

/// The bytes of a recorded file; empty when the data folder is not there.
std::string ReadDataFile(const std::string& path);

/// The error is FILE_MALFORMED and its message holds `part`.
void ExpectMalformed(const absl::Status& status, const std::string& part);

/// One of the sentences about what was skipped holds `part`.
void ExpectSkipped(const std::vector<Skipped>& skipped, const std::string& part);

const Node& NodeNamed(const ImportedGraph& imported, const std::string& id);

/// Ten nodes of every class, with every kind of field set; seven edges; a mesh of one face.
SparkGraph SampleSparkGraph();

/// Equal field by field, but for version and notes.
void ExpectSameGraph(const SparkGraph& actual, const SparkGraph& expected);

}  // namespace dsg
