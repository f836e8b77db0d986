// SPDX-License-Identifier: Apache-2.0
// The faces that the bodies of a log's detections share, as docs/sensor_logs.md describes them.
// Refuses faces that no mesh of that many vertices has.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "absl/status/statusor.h"
#include "ingest/log/text_table.h"
#include "ingest/sensor/human_detection.h"
#include "schema/codec/topology.h"

namespace dsg::ingest {

/// A body has no more vertices.
inline constexpr size_t kBodyVertexCountMax = 20'000;

/// `{"vertex_count": n, "faces": [[a, b, c], ...]}` with indices from 0; `origin` names the text.
/// Errors: INVALID_ARGUMENT/FILE_MALFORMED naming origin, face and value.
absl::StatusOr<std::shared_ptr<const Topology>> ParseBodyTopology(const std::string& origin,
                                                                  std::string_view text);

/// Whether the faces of the topology are those of the body with these vertices, three numbers
/// each. False where `topology` is null.
bool FitsTopology(const Topology* topology, const std::vector<float>& vertices);

/// Errors: INVALID_ARGUMENT/FILE_MALFORMED at `at` for a body that the log's faces do not fit, in
/// a log that is read strictly.
absl::Status CheckBody(const LinePosition& at, const Topology* topology, bool is_strict,
                       const HumanDetection& detection);

}  // namespace dsg::ingest
