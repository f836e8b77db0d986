// SPDX-License-Identifier: Apache-2.0
#include <Eigen/LU>
#include <Eigen/SVD>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>

#include "ingest/odometry/frontend/five_point_internal.h"
#include "schema/base/check.h"

namespace dsg::ingest {
namespace {

constexpr int kFive = 5;

// The essential matrices one below the other. OpenCV draws no samples of five points: it gives all
// solutions of that one.
cv::Mat SolveFive(const cv::Mat& first, const cv::Mat& second) {
  try {
    return cv::findEssentialMat(second, first, cv::Mat::eye(3, 3, CV_64F), cv::RANSAC,
                                /*prob=*/0.99, /*threshold=*/1.0, /*maxIters=*/1, cv::noArray());
  } catch (const cv::Exception&) {
    // Of samples that are singular.
    return {};
  }
}

void AddMotionsOf(const Eigen::Matrix3d& essential, std::vector<TurnAndWay>* motions) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU();
  Eigen::Matrix3d v = svd.matrixV();
  if (u.determinant() < 0.0) u = -u;
  if (v.determinant() < 0.0) v = -v;
  Eigen::Matrix3d quarter;
  quarter << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
  const Eigen::Matrix3d turns[] = {u * quarter * v.transpose(),
                                   u * quarter.transpose() * v.transpose()};
  for (const Eigen::Matrix3d& turn : turns) {
    for (const double sign : {1.0, -1.0}) motions->push_back({turn, sign * u.col(2)});
  }
}

}  // namespace

std::vector<TurnAndWay> FivePointMotions(std::span<const BearingPair> five) {
  DSG_CHECK(five.size() == kFive);
  cv::Mat first(kFive, 2, CV_64F);
  cv::Mat second(kFive, 2, CV_64F);
  for (int i = 0; i < kFive; ++i) {
    const BearingPair& pair = five[static_cast<size_t>(i)];
    for (int k = 0; k < 2; ++k) {
      first.at<double>(i, k) = pair.first[k] / pair.first.z();
      second.at<double>(i, k) = pair.second[k] / pair.second.z();
    }
  }
  const cv::Mat solved = SolveFive(first, second);
  std::vector<TurnAndWay> motions;
  for (int row = 0; row + 3 <= solved.rows; row += 3) {
    Eigen::Matrix3d essential;
    for (int i = 0; i < 3; ++i) {
      for (int k = 0; k < 3; ++k) essential(i, k) = solved.at<double>(row + i, k);
    }
    if (essential.allFinite()) AddMotionsOf(essential, &motions);
  }
  return motions;
}

}  // namespace dsg::ingest
