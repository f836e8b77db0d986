// SPDX-License-Identifier: Apache-2.0
// What differs between revisions, as text for people. Only turns replies into words.
#pragma once

#include <string>

#include "query/cli/time_text.h"

namespace dsg::v1 {
class DiffRevisionsResponse;
class Node;
class Revision;
}  // namespace dsg::v1

namespace dsg::cli {

/// "moved 0.42 m, name, ended at +12s": what of a node is not as it was.
std::string DifferenceText(const v1::Node& before, const v1::Node& after, const TimeText& times);

/// A line a change.
std::string RenderChanges(const v1::DiffRevisionsResponse& reply, const TimeText& times);

/// RenderChanges and what was compared.
std::string RenderDiff(const v1::DiffRevisionsResponse& reply, const TimeText& times);

/// One line.
std::string RenderRevision(const v1::Revision& revision);

}  // namespace dsg::cli
