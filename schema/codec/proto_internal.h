// SPDX-License-Identifier: Apache-2.0
// Conversions shared by the .cc files of this folder only.
#pragma once

#include <google/protobuf/map.h>
#include <google/protobuf/message_lite.h>

#include "schema/codec/proto_convert.h"

namespace dsg::v1 {
class AttributeValue;
class Vector3;
}  // namespace dsg::v1

namespace dsg {

Eigen::Vector3d FromProto(const v1::Vector3& in);

void AttributesToProto(const Attributes& attributes,
                       google::protobuf::Map<std::string, v1::AttributeValue>* out);
Attributes AttributesFromProto(const google::protobuf::Map<std::string, v1::AttributeValue>& in);

std::string BytesOf(const Sha256& digest);
absl::StatusOr<std::optional<Sha256>> Sha256FromProto(const std::string& bytes,
                                                      std::string_view field);
/// The empty id for empty text.
absl::StatusOr<NodeId> OptionalNodeId(const std::string& text);

/// All of a node but id, layer and revision.
void NodeDetailsToProto(const Node& node, v1::Node* out);
absl::Status NodeDetailsFromProto(const v1::Node& in, Node* node);
/// What few nodes have: all but the fields that schema/codec/payload.cc writes itself.
void RareDetailsToProto(const Node& node, v1::Node* out);
/// The same without attributes.
void ComponentsOfFewToProto(const Node& node, v1::Node* out);
absl::Status RareDetailsFromProto(const v1::Node& in, Node* node);
/// Maps are written in order of their keys, so that equal content gives equal bytes and digests.
std::string SerializeInOrder(const google::protobuf::MessageLite& message);
/// Validity and attributes.
void EdgeDetailsToProto(const Edge& edge, v1::Edge* out);
void EdgeDetailsFromProto(const v1::Edge& in, Edge* edge);

}  // namespace dsg
