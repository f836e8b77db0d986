// SPDX-License-Identifier: Apache-2.0
// Columns of packed replies (proto/dsg/v1/scene.proto): little-endian values one after the other.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

namespace dsg::query {

/// Appends a number to a column.
template <typename T>
void Append(T value, std::string* column) {
  static_assert(std::is_arithmetic_v<T> && std::endian::native == std::endian::little);
  column->append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// Appends numbers to a column, each as a T.
template <typename T, typename Derived>
void AppendRow(const Eigen::DenseBase<Derived>& values, std::string* column) {
  static_assert(std::endian::native == std::endian::little);
  const Eigen::Matrix<T, Derived::SizeAtCompileTime, 1> row = values.derived().template cast<T>();
  column->append(reinterpret_cast<const char*>(row.data()),
                 sizeof(T) * static_cast<size_t>(row.size()));
}

/// The bytes of numbers in memory, as a column has them.
template <typename T>
std::string_view BytesOf(const std::vector<T>& values) {
  static_assert(std::is_trivially_copyable_v<T> && std::endian::native == std::endian::little);
  return {reinterpret_cast<const char*>(values.data()), sizeof(T) * values.size()};
}

/// A column that is left out while all of its values are the same as `usual`.
///
/// `T` is a number, or some of them in an array without padding.
template <typename T>
class RareColumn {
 public:
  explicit RareColumn(const T& usual) : usual_(usual) {}

  void Add(const T& value) {
    if (std::memcmp(&value, &usual_, sizeof(T)) != 0) is_rare_ = true;
    values_.push_back(value);
  }
  size_t size_bytes() const { return sizeof(T) * values_.size(); }
  /// Empty if all values were usual. Empties the column, and keeps its memory.
  std::string Take() {
    std::string bytes(is_rare_ ? BytesOf(values_) : std::string_view());
    values_.clear();
    is_rare_ = false;
    return bytes;
  }

 private:
  T usual_;
  bool is_rare_ = false;
  std::vector<T> values_;
};

}  // namespace dsg::query
