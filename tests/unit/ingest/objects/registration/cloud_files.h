// SPDX-License-Identifier: Apache-2.0
// Points of the recorded clouds: PLY and PCD as far as those files use them.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

namespace dsg::ingest {

/// A file below the folder of recorded registration data; empty when it is not there.
std::string RegistrationFile(const std::string& name);

/// x, y, z of every vertex; ASCII or little-endian floats. Empty when the file is not of that kind.
std::vector<Eigen::Vector3d> ReadPlyPoints(const std::string& path);

/// x, y, z of every finite point; ASCII, binary or compressed. Empty when the file is not of that
/// kind.
std::vector<Eigen::Vector3d> ReadPcdPoints(const std::string& path);

/// All numbers of a text file, whatever stands between them.
std::vector<double> ReadNumbers(const std::string& path);

}  // namespace dsg::ingest
