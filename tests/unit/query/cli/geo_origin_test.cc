// SPDX-License-Identifier: Apache-2.0
#include "query/cli/export/geo_origin.h"

#include <gtest/gtest.h>

#include <cmath>

#include "schema/base/status.h"

namespace dsg::cli {
namespace {

// Of WGS84, metres.
constexpr double kSemiMajorM = 6378137.0;
constexpr double kSemiMinorM = 6356752.314245;

TEST(GeoOrigin, ReadsThreeNumbersInRange) {
  const auto origin = ParseOrigin("47.3769,8.5417,-90");
  ASSERT_TRUE(origin.ok()) << origin.status();
  EXPECT_EQ(origin->latitude_deg, 47.3769);
  EXPECT_EQ(origin->longitude_deg, 8.5417);
  EXPECT_EQ(origin->heading_deg, -90.0);
  for (const char* text : {"", "1,2", "1,2,3,4", "1,2,x", "91,0,0", "0,181,0", "0,0,400", "nan,0,0",
                           "0,0,inf", "1,,2,3"}) {
    EXPECT_EQ(ReasonOf(ParseOrigin(text).status()), Reason::kFieldInvalid) << text;
  }
}

// On the equator a degree of longitude is known from the radius, one of latitude from the radius of
// curvature of the meridian, b^2 / a.
TEST(GeoOrigin, LaysTheMapOnTheEarthByItsHeading) {
  const double east_deg = 180.0 / M_PI / kSemiMajorM;
  const double north_deg = 180.0 / M_PI * kSemiMajorM / (kSemiMinorM * kSemiMinorM);
  const GeoOrigin east{0.0, 10.0, 90.0};
  const Eigen::Vector3d x = ToWgs84(east, {1.0, 0.0, 0.0});
  EXPECT_NEAR(x.x() - 10.0, east_deg, 1e-11);
  EXPECT_NEAR(x.y(), 0.0, 1e-12);
  const Eigen::Vector3d y = ToWgs84(east, {0.0, 1.0, 0.0});
  EXPECT_NEAR(y.x() - 10.0, 0.0, 1e-12);
  EXPECT_NEAR(y.y(), north_deg, 1e-11);
  // The x axis to the north, so the y axis to the west.
  const GeoOrigin north{0.0, 10.0, 0.0};
  EXPECT_NEAR(ToWgs84(north, {1.0, 0.0, 0.0}).y(), north_deg, 1e-11);
  EXPECT_NEAR(ToWgs84(north, {0.0, 1.0, 0.0}).x() - 10.0, -east_deg, 1e-11);
}

TEST(GeoOrigin, TheOriginIsWhereItIsSaidToBe) {
  const Eigen::Vector3d point = ToWgs84({47.3769, 8.5417, 33.0}, {0.0, 0.0, 2.5});
  EXPECT_NEAR(point.x(), 8.5417, 1e-12);
  EXPECT_NEAR(point.y(), 47.3769, 1e-12);
  EXPECT_NEAR(point.z(), 2.5, 1e-8);
}

// The plane touches the Earth at one point: 1 km away the ground is d^2 / 2r lower.
TEST(GeoOrigin, ThePlaneLeavesTheEarthWithTheDistance) {
  const Eigen::Vector3d far = ToWgs84({0.0, 0.0, 90.0}, {1000.0, 0.0, 0.0});
  EXPECT_NEAR(far.z(), 1e6 / (2.0 * kSemiMajorM), 1e-6);
}

}  // namespace
}  // namespace dsg::cli
