// SPDX-License-Identifier: Apache-2.0
// Comma-separated values as RFC 4180 has them.
#pragma once

#include <string>
#include <vector>

namespace dsg::cli {

/// Appends a record with its line end, CR LF. Cells with commas, quotes or line ends are quoted.
void AppendCsvRecord(const std::vector<std::string>& cells, std::string* text);

/// The shortest decimal text that reads back as the same number, with a point in every locale.
std::string ExactNumber(double value);

}  // namespace dsg::cli
