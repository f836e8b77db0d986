// SPDX-License-Identifier: Apache-2.0
// Columns of packed replies (proto/dsg/v1/scene.proto): little-endian values one after the other.
#pragma once

#include <Eigen/Core>
#include <bit>
#include <cstring>
#include <string>
#include <type_traits>
#include <utility>

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

/// A column that is left out while all of its values are the same as `usual`.
///
/// `T` is a number, or some of them in an array without padding.
template <typename T>
class RareColumn {
 public:
  explicit RareColumn(const T& usual) : usual_(usual) {}

  void Add(const T& value) {
    if (std::memcmp(&value, &usual_, sizeof(T)) != 0) is_rare_ = true;
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  size_t size_bytes() const { return bytes_.size(); }
  /// Empty if all values were usual.
  std::string Take() { return is_rare_ ? std::move(bytes_) : std::string(); }

 private:
  T usual_;
  bool is_rare_ = false;
  std::string bytes_;
};

}  // namespace dsg::query
