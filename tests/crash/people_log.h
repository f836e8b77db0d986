// SPDX-License-Identifier: Apache-2.0
// A made-up recording of people as text, in the TrajNet style: frame, person, x, y.
#pragma once

#include <cstdint>
#include <string>

namespace dsg::test {

/// `row_count` rows of people who come, walk about a hall of 95 m by 55 m, and go. The same seed
/// gives the same bytes.
std::string PeopleLog(uint64_t seed, int row_count);

}  // namespace dsg::test
