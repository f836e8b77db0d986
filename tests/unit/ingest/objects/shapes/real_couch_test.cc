// SPDX-License-Identifier: Apache-2.0
// The couch that the paper's authors reconstructed, against their CAD model of it.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <sstream>

#include "ingest/objects/shapes/cad_model.h"
#include "ingest/objects/shapes/mesh_file.h"
#include "ingest/objects/shapes/shape_fit.h"
#include "tests/support/temp_folder.h"

namespace dsg::ingest {
namespace {

namespace fs = std::filesystem;

constexpr double kDegree = std::numbers::pi / 180.0;

class RealCouch : public testing::Test {
 protected:
  void SetUp() override {
    const char* const given = std::getenv("DSG_DATA");
    folder_ =
        (given != nullptr ? fs::path(given) : fs::path(DSG_SOURCE_DIR) / ".." / "shared" / "data") /
        "kimera-objectdb";
    if (!fs::is_directory(folder_)) {
      GTEST_SKIP() << "the recorded couch is not there; set DSG_DATA";
    }
    fs::copy(folder_ / "cad" / "Couch_1seat.obj", cad_.path());
    fs::copy(folder_ / "cad" / "Couch_3seat.obj", cad_.path());
    std::ofstream(fs::path(cad_.path()) / "catalogue.json")
        << R"({"models": [{"file": "Couch_1seat.obj", "up": "y"},)"
        << R"( {"file": "Couch_3seat.obj", "up": "y"}]})";
    const auto catalogue = ReadCatalogue(cad_.path());
    ASSERT_TRUE(catalogue.ok()) << catalogue.status();
    catalogue_ = *catalogue;
    const std::string name = (folder_ / "recon" / "recons_1seat_only.ply").string();
    const auto cloud = ReadPly(Bytes(name), name);
    ASSERT_TRUE(cloud.ok()) << cloud.status();
    for (const Eigen::Vector3d& point : cloud->vertices) points_.push_back(point.cast<float>());
    truth_ = Truth();
  }

  static std::string Bytes(const fs::path& path) {
    std::stringstream out;
    out << std::ifstream(path, std::ios::binary).rdbuf();
    return out.str();
  }

  // Known for the file's own origin; the catalogue's is the middle of the floor face.
  Pose3d Truth() const {
    const fs::path path = folder_ / "cad" / "Couch_1seat.obj";
    const auto raw = ReadObj(Bytes(path), path.string());
    EXPECT_TRUE(raw.ok());
    Box3d box;
    for (const Eigen::Vector3d& v : raw->vertices)
      box.extend(Eigen::Vector3d(v.x(), -v.z(), v.y()));
    Pose3d truth;
    truth.orientation =
        Eigen::Quaterniond(Eigen::AngleAxisd(75.0 * kDegree, Eigen::Vector3d::UnitZ()));
    truth.position = {3.007, 18.902, -1.0};
    const Eigen::Vector3d origin(box.center().x(), box.center().y(), box.min().z());
    std::printf("origin of the catalogue in the file: %.3f %.3f %.3f\n", origin.x(), origin.y(),
                origin.z());
    truth.position = truth * origin;
    return truth;
  }

  double Report(const char* what, const std::optional<ShapeFit>& fit) const {
    if (!fit) {
      std::printf("%s: no fit\n", what);
      return INFINITY;
    }
    const Eigen::Vector3d miss = fit->map_T_model.position - truth_.position;
    std::printf(
        "%s: %s, off by %.3f m (%.3f %.3f %.3f) and %.2f deg, residual %.3f m, inliers %.2f\n",
        what, catalogue_[static_cast<size_t>(fit->model)].name.c_str(), miss.norm(), miss.x(),
        miss.y(), miss.z(),
        AngleBetween(fit->map_T_model.orientation, truth_.orientation) / kDegree, fit->residual_m,
        fit->inlier_share);
    return miss.norm();
  }

  fs::path folder_;
  test::TempFolder cad_;
  std::vector<CadModel> catalogue_;
  std::vector<Eigen::Vector3f> points_;
  Pose3d truth_;
};

TEST_F(RealCouch, IsFoundWhereItStands) {
  const ShapeFitter fitter(catalogue_, {});
  const auto fit = fitter.Fit("couch", points_, nullptr);
  EXPECT_LE(Report("all steps", fit), 0.2);
  ASSERT_TRUE(fit);
  EXPECT_EQ(catalogue_[static_cast<size_t>(fit->model)].name, "Couch_1seat");
  EXPECT_LE(AngleBetween(fit->map_T_model.orientation, truth_.orientation), 10.0 * kDegree);
  EXPECT_GE(fit->inlier_share, 0.9);
}

TEST_F(RealCouch, IsFoundWithoutGravity) {
  ShapeOptions options;
  options.is_upright = false;
  const auto fit = ShapeFitter(catalogue_, options).Fit("couch", points_, nullptr);
  EXPECT_LE(Report("six degrees of freedom", fit), 0.2);
}

TEST_F(RealCouch, PapersStepsAloneRun) {
  ShapeOptions options;
  options.is_paper = true;
  options.noise_bound_m = 0.1;
  options.inlier_share_min = 0.0;
  const auto fit = ShapeFitter({catalogue_[0]}, options).Fit("couch", points_, nullptr);
  Report("paper's steps", fit);
}

}  // namespace
}  // namespace dsg::ingest
