// SPDX-License-Identifier: Apache-2.0
// How far two states are from what the inertial unit measured between them, as a cost function.
// Source: Forster, Carlone, Dellaert, Scaramuzza, T-RO 2017, section VI.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "ingest/odometry/inertial/inertial_state.h"
#include "ingest/odometry/inertial/preintegration.h"

namespace ceres {
class CostFunction;
}

namespace dsg::ingest {

/// What the states say minus what was measured, not whitened; rows as in a state: position,
/// rotation and velocity in the frame at the beginning, then how far the biases moved. Its
/// covariance is measured.covariance(). Derivatives by a step of each state; both or none.
Vector15d InertialResidual(const Preintegration& measured, const InertialState& from,
                           const InertialState& to, const Eigen::Vector3d& gravity_map,
                           Matrix15d* by_from, Matrix15d* by_to);

/// The same, whitened: 15 residuals. Blocks: pose (pose_block.h) and speed (inertial_state.h) of
/// the state at the beginning, then those of the state at the end.
///
/// `measured` outlives the factor. It may be reintegrated between solves, and the factor follows.
std::unique_ptr<ceres::CostFunction> MakeInertialFactor(const Preintegration* measured,
                                                        const Eigen::Vector3d& gravity_map);

}  // namespace dsg::ingest
