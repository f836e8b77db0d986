// SPDX-License-Identifier: Apache-2.0
// What can be checked of a value without the rest of its map: finite numbers, text, lengths, order.
// The limits are in delta_check.h.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "schema/base/status.h"
#include "schema/model/mesh.h"
#include "schema/model/node.h"

/// Errors of all checks: INVALID_ARGUMENT/DELTA_INVALID or NUMBER_NOT_FINITE, naming the value.
namespace dsg::values {

/// Finite, and within kCoordinateMaxM of the origin on each axis.
bool IsSane(const Eigen::Vector3d& point);
bool AreSane(const std::vector<float>& numbers);

absl::Status Invalid(std::string_view what, ErrorMetadata metadata = {});
absl::Status NotFinite(std::string_view what);

/// Names the value; called only once something is wrong with it.
using What = absl::FunctionRef<std::string()>;

/// UTF-8 of at most `length_max` bytes: what protobuf cannot read back must not be stored.
absl::Status CheckText(std::string_view text, size_t length_max, What what);
absl::Status CheckPose(const Pose3d& pose, What what);
absl::Status CheckBox(const Box3d& box, What what);
/// Not a limit of 64 bits, which means an open end.
absl::Status CheckInstant(TimeNs time_ns, What what);
absl::Status CheckInterval(const Interval& interval, What what);
absl::Status CheckNotNegative(double number, What what);
/// An empty outline means that it is not known. Either sense is valid: inside is told by the
/// even-odd rule.
absl::Status CheckRegion(const RegionInfo& region, What what);
absl::Status CheckAttributes(const Attributes& attributes, What what);
/// Lengths of the channels, finite numbers, faces of vertices that exist; not where the block is.
absl::Status CheckMeshBlock(const MeshBlock& block);

}  // namespace dsg::values
