// SPDX-License-Identifier: Apache-2.0
// One-to-one assignment of least total cost.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace dsg {

/// For each row its column; -1 for rows without one when there are fewer columns.
///
/// Requires: finite costs.
/// Cost:   O(rows^2 columns) for the smaller side as rows.
/// Source: Kuhn 1955, by shortest augmenting paths (Jonker and Volgenant 1987).
std::vector<int> MinimumAssignment(const Eigen::MatrixXd& cost);

/// Only pairs whose cost is at most `gate`: first as many pairs as possible, then the least cost.
/// Rows without a partner get -1.
/// Requires: 0 <= cost.
std::vector<int> GatedAssignment(const Eigen::MatrixXd& cost, double gate);

/// Pairs of the largest total weight; pairs of weight 0 are not made. Requires: 0 <= weight.
std::vector<int> MaximumAssignment(const Eigen::MatrixXd& weight);

}  // namespace dsg
