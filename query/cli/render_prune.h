// SPDX-License-Identifier: Apache-2.0
// What was forgotten, as text for people. Only turns replies into words: asks nothing.
#pragma once

#include <string>

namespace dsg::v1 {
class PruneResponse;
}  // namespace dsg::v1

namespace dsg::cli {

/// `reply`: what all messages of a prune say together.
std::string RenderPrune(const v1::PruneResponse& reply, bool is_dry_run, bool is_erase);

}  // namespace dsg::cli
