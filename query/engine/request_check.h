// SPDX-License-Identifier: Apache-2.0
// Checks of request fields that several questions share. Refuses to guess: a field out of its
// documented range is an INVALID_ARGUMENT naming the field and the value.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "absl/status/statusor.h"
#include "schema/base/time.h"
#include "schema/model/ids.h"
#include "schema/store/snapshot.h"

namespace dsg::v1 {
class NodeFilter;
class Vector3;
}  // namespace dsg::v1

namespace dsg::query {

/// A list's page holds this many entries when the caller does not say.
inline constexpr int kPageSizeDefault = 100;
/// Larger pages, and larger k, are not given.
inline constexpr int kPageSizeMax = 1000;
/// Agent and instant pairs in one batch.
inline constexpr int kBatchSizeMax = 10'000;
/// A page is cut once its encoded entries exceed this, so that an answer stays well below the
/// 4 MiB that a message may have.
inline constexpr size_t kPageBytesSoftMax = size_t{1} << 20;
/// An answer that cannot be cut is refused beyond this.
inline constexpr size_t kReplyBytesMax = size_t{3} << 20;

/// INVALID_ARGUMENT/FIELD_INVALID with `field` and `value` in the metadata.
absl::Status FieldError(std::string_view field, std::string_view value, std::string_view rule);

/// 0 becomes the default, more than the cap becomes the cap. Errors: FIELD_INVALID if negative.
absl::StatusOr<int> CheckPageSize(int32_t page_size);

/// Errors: TIME_RANGE_INVERTED unless from_ns < to_ns.
absl::Status CheckTimeRange(TimeNs from_ns, TimeNs to_ns);

/// Errors: NUMBER_NOT_FINITE naming `field`.
absl::StatusOr<Eigen::Vector3d> PointFromProto(const v1::Vector3& in, std::string_view field);

/// Names of layers and nodes become ids. Errors: LAYER_UNKNOWN, NODE_UNKNOWN, BOX_INVERTED,
/// NUMBER_NOT_FINITE.
absl::StatusOr<NodeFilter> FilterFromProto(const v1::NodeFilter& in, const Snapshot& snapshot);

}  // namespace dsg::query
