// SPDX-License-Identifier: Apache-2.0
// Text of logs, files and callers that is fit for a terminal: it cannot control it, nor pass for
// other text.
#pragma once

#include <string>

namespace dsg {

/// `text` with control characters shown as '?', and marks that turn the direction of writing (such
/// as U+202E) and bytes that are no UTF-8 as escapes like "\u202e" and "\x9b".
std::string Printable(const std::string& text);

/// The same of a message: what is longer than some pages is cut, and ends with "...".
std::string PrintableMessage(const std::string& text);

}  // namespace dsg
