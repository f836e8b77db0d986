// SPDX-License-Identifier: Apache-2.0
// Node filters from options, and why a list that passed one is empty.
#pragma once

#include "absl/status/status.h"
#include "query/cli/session.h"
#include "schema/model/layer.h"

namespace dsg::v1 {
class NodeFilter;
}  // namespace dsg::v1

namespace dsg::cli {

/// Errors: INVALID_ARGUMENT naming --at.
absl::Status FillFilter(const FilterOptions& options, const MapSpec& map, v1::NodeFilter* filter);

/// For lists that came out empty: an error if a word that was asked for is none that the map knows;
/// empty words are no question. Errors: NOT_FOUND/CLASS_UNKNOWN, RELATION_UNKNOWN, LAYER_UNKNOWN.
absl::Status CheckWords(Session* session, const std::string& layer, const std::string& class_name,
                        const std::string& relation);

}  // namespace dsg::cli
