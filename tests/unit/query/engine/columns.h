// SPDX-License-Identifier: Apache-2.0
// Columns of packed replies as vectors, for tests.
#pragma once

#include <cstring>
#include <string>
#include <vector>

namespace dsg::test {

template <typename T>
std::vector<T> ValuesOf(const std::string& column) {
  std::vector<T> values(column.size() / sizeof(T));
  std::memcpy(values.data(), column.data(), values.size() * sizeof(T));
  return values;
}

}  // namespace dsg::test
