// SPDX-License-Identifier: Apache-2.0
// Body shapes in replies: the parts that a request asks for, and each topology once.
#pragma once

#include <set>

#include "absl/status/statusor.h"
#include "query/engine/request.h"
#include "schema/store/snapshot.h"

namespace google::protobuf {
template <typename Element>
class RepeatedField;
}  // namespace google::protobuf

namespace dsg::v1 {
class AgentShape;
class Asset;
}  // namespace dsg::v1

namespace dsg::query {

struct ShapeParts {
  bool coefficients = false;
  bool joints = false;
  bool vertices = false;
  bool topology = false;

  /// Numbers of v1.ShapePart; none stands for all. Errors: FIELD_INVALID.
  static absl::StatusOr<ShapeParts> Of(const google::protobuf::RepeatedField<int>& parts);
};

/// Fills the shapes and topologies of one stream.
///
/// Threads: one caller at a time.
class ShapeFiller {
 public:
  ShapeFiller(const ReadView& view, const ShapeParts& parts) : view_(view), parts_(parts) {}

  bool with_vertices() const { return parts_.vertices; }
  /// Whether the topology of a shape must be sent before it.
  bool WantsTopology(const ShownShape& shown) const;
  /// Everything but pose and quality.
  void Fill(const ShownShape& shown, v1::AgentShape* out) const;
  /// Errors: LIMIT_EXCEEDED if it is too large for one message; of the store.
  absl::Status AddTopology(NodeId agent, const Sha256& sha256, v1::Asset* out);

 private:
  ReadView view_;
  ShapeParts parts_;
  std::set<Sha256> sent_;
};

}  // namespace dsg::query
