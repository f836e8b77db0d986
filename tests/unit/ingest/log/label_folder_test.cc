// SPDX-License-Identifier: Apache-2.0
// Label pictures beside RGB-D folders: which picture they belong to, what their numbers mean, and
// what is wrong with them.
#include "ingest/log/label_folder.h"

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>

#include "absl/strings/str_cat.h"
#include "ingest/log/label_table.h"
#include "schema/base/status.h"
#include "tests/unit/ingest/log/log_test_util.h"

namespace dsg::ingest {
namespace {

LabelIds Ids(const std::string& text) {
  const auto ids = ReadLabelIds({.path = "labels.csv", .name = "", .bytes = text});
  EXPECT_TRUE(ids.ok()) << ids.status();
  return ids.ok() ? *ids : LabelIds();
}

std::string ClassesOf(const LabelIds& ids) {
  std::string text;
  for (const SemanticLabel& label : ids.classes) absl::StrAppend(&text, label.id, label.name, " ");
  return text;
}

TEST(LabelIds, ReadsTablesOfManyForms) {
  EXPECT_EQ(ClassesOf(Ids("id,name\n3,chair\n1,wall\n")), "1wall 3chair ");
  EXPECT_EQ(ClassesOf(Ids("1,wall\n3,chair\n")), "1wall 3chair ");
  EXPECT_EQ(ClassesOf(Ids("# of ours\n1 wall\n3 dining table\n")), "1wall 3dining table ");
  EXPECT_EQ(ClassesOf(Ids("Name;red;ID\nwall;255;1\nunlabeled;0;2\n")), "1wall ");
  EXPECT_EQ(ClassesOf(Ids("name,red,green,blue,alpha,id\nunknown,0,0,0,255,0\nsofa,1,2,3,255,9\n")),
            "9sofa ");
  const LabelIds ids = Ids("id,name\n3,chair\n1,wall\n7,unknown\n");
  EXPECT_EQ(ids.label_of_id[3], 3 << 8);
  EXPECT_EQ(ids.label_of_id[7], 0);
  EXPECT_TRUE(ids.is_listed[7]);
  EXPECT_FALSE(ids.is_listed[4]);
  EXPECT_FALSE(ids.is_renumbered);
}

TEST(LabelIds, RenumbersIdsThatDoNotFit) {
  const LabelIds from_zero = Ids("id,name\n0,wall\n1,floor\n");
  EXPECT_TRUE(from_zero.is_renumbered);
  EXPECT_EQ(ClassesOf(from_zero), "1wall 2floor ");
  EXPECT_EQ(from_zero.label_of_id[0], 1 << 8);
  const LabelIds large = Ids("id,name\n1163,picture\n40,wall\n");
  EXPECT_EQ(ClassesOf(large), "1wall 2picture ");
  EXPECT_EQ(large.label_of_id[1163], 2 << 8);
}

TEST(LabelIds, MakesOneClassOfOneName) {
  const LabelIds ids = Ids("id,name\n2,chair\n3,table\n9,chair\n");
  EXPECT_EQ(ClassesOf(ids), "2chair 3table ");
  EXPECT_EQ(ids.label_of_id[9], 2 << 8);
  const LabelIds large = Ids("id,name\n20,chair\n300,chair\n301,table\n");
  EXPECT_EQ(ClassesOf(large), "1chair 2table ");
  EXPECT_EQ(large.label_of_id[300], 1 << 8);
}

TEST(LabelIds, ReadsTheClassesOfANetwork) {
  const auto read = [](const std::string& text) {
    const auto list = ReadClassList({.path = "classes.txt", .name = "", .bytes = text});
    EXPECT_TRUE(list.ok()) << list.status();
    return absl::StrCat(list->count, ": ", ClassesOf(list->ids));
  };
  EXPECT_EQ(read("wall\ndining table\nunknown\nchair, or stool\n"),
            "4: 1wall 2dining table 3chair, or stool ");
  EXPECT_EQ(read("background\nchair\n"), "2: 1chair ");
  EXPECT_EQ(read("id,name\n3,chair\n1,wall\n"), "4: 1wall 3chair ");
  EXPECT_EQ(read("0 background\n1 wall\n"), "2: 1wall ");
  ExpectMalformedFile(ReadClassList({.path = "classes.txt", .name = "", .bytes = ""}).status(),
                      {"classes.txt", "names 0 classes"});
}

TEST(LabelIds, RefusesWrongTables) {
  const auto refuse = [](const std::string& text, const std::vector<std::string>& words) {
    ExpectMalformedFile(ReadLabelIds({.path = "labels.csv", .name = "", .bytes = text}).status(),
                        words);
  };
  refuse("", {"labels.csv", "names 0 classes"});
  refuse("number,word\n1,wall\n", {"labels.csv:1", "\"id\" and \"name\""});
  refuse("id,name\n1,wall\n1,floor\n", {"labels.csv:3", "stands twice"});
  refuse("id,name\n65536,wall\n", {"labels.csv:2", "65536"});
  refuse("id,name\n-1,wall\n", {"labels.csv:2", "-1"});
  refuse("id,name\n1\n", {"labels.csv:2", "an id and a name"});
  refuse("id,name\n1,\n", {"labels.csv:2", "name"});
  refuse("id,name\n1,\xff\xfe\n", {"labels.csv:2", "UTF-8"});
  std::string many = "id,name\n";
  for (int i = 1; i <= 256; ++i) absl::StrAppend(&many, i, ",thing", i, "\n");
  refuse(many, {"names 256 classes"});
}

std::string Picture(const cv::Mat& mat) {
  std::vector<uint8_t> bytes;
  EXPECT_TRUE(cv::imencode(".png", mat, bytes));
  return {bytes.begin(), bytes.end()};
}

// Four columns, of which the first has the value.
std::string Labels(int type, int value, int columns = 4) {
  cv::Mat mat = cv::Mat::zeros(3, columns, type);
  mat.col(0).setTo(value);
  return Picture(mat);
}

class LabelFolderTest : public testing::Test {
 protected:
  void SetUp() override {
    folder_.Write("labels/labels.csv", "id,name\n2,floor\n3,chair\n");
    options_.label_folder = folder_.Path("labels");
    strict_ = options_;
    strict_.is_strict = true;
  }
  // Three frames of TUM's form, a tenth of a second apart, colour 10 ms after depth.
  std::string TumLog() const {
    std::string color;
    std::string depth;
    for (int i = 0; i < 3; ++i) {
      absl::StrAppend(&color, "160000000", i, ".11 rgb/160000000", i, ".11.png\n");
      absl::StrAppend(&depth, "160000000", i, ".10 depth/160000000", i, ".10.png\n");
      folder_.Write(absl::StrCat("log/rgb/160000000", i, ".11.png"),
                    Picture(cv::Mat(3, 4, CV_8UC3, cv::Scalar(9, 9, 9))));
      folder_.Write(absl::StrCat("log/depth/160000000", i, ".10.png"),
                    Picture(cv::Mat(3, 4, CV_16UC1, cv::Scalar(5000))));
    }
    folder_.Write("log/rgb.txt", color);
    folder_.Write("log/depth.txt", depth);
    folder_.Write("log/groundtruth.txt", "1600000000 1 2 3 0 0 0 1\n1600000003 2 2 3 0 0 0 1\n");
    return folder_.Path("log");
  }
  std::string SevenScenesLog() const {
    folder_.Write("seven/camera-intrinsics.txt", "500 0 2\n0 500 1\n0 0 1\n");
    for (int i = 0; i < 3; ++i) {
      const std::string frame = absl::StrCat("seven/frames/frame-00000", i);
      folder_.Write(frame + ".color.jpg", Picture(cv::Mat(3, 4, CV_8UC3, cv::Scalar(9, 9, 9))));
      folder_.Write(frame + ".depth.png", Picture(cv::Mat(3, 4, CV_16UC1, cv::Scalar(1000))));
      folder_.Write(frame + ".pose.txt", "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
    }
    return folder_.Path("seven");
  }
  std::vector<TimeNs> LabelTimes(const absl::StatusOr<WholeLog>& log) const {
    std::vector<TimeNs> times;
    EXPECT_TRUE(log.ok()) << log.status();
    for (size_t i = 0; log.ok() && i < log->images.size(); ++i) {
      if (log->images[i].channel == "label0") times.push_back(log->images[i].time_ns);
    }
    return times;
  }
  static Image LoadLabel(const WholeLog& log) {
    for (const ImageMeasurement& image : log.images) {
      if (image.channel == "label0") return *image.load();
    }
    return {};
  }

  TempFolder folder_;
  LogOptions options_;
  LogOptions strict_;
};

TEST_F(LabelFolderTest, BelongToThePicturesOfTheirNames) {
  const std::string log_path = TumLog();
  folder_.Write("labels/1600000000.10.png", Labels(CV_8UC1, 3));
  folder_.Write("labels/1600000001.11.png", Labels(CV_16UC1, 2));
  folder_.Write("labels/1600000002.10.png", Labels(CV_8UC1, 2));
  const auto log = ReadAll(log_path, options_);
  const TimeNs second = kNsPerSecond;
  EXPECT_EQ(LabelTimes(log),
            (std::vector<TimeNs>{1'600'000'000 * second + second / 10,
                                 1'600'000'001 * second + second / 10 + second / 100,
                                 1'600'000'002 * second + second / 10}));
  const Image label = LoadLabel(*log);
  EXPECT_EQ(LabelAt(label, 0, 0), 3 << 8);
  EXPECT_EQ(LabelAt(label, 1, 0), 0);
  ASSERT_EQ(log->info.labels.size(), 2u);
  EXPECT_EQ(log->info.labels[1].name, "chair");
  ASSERT_NE(log->info.rig.FindCamera("label0"), nullptr);
  EXPECT_EQ(log->info.rig.FindCamera("label0")->width, 4);
  EXPECT_NE(ReadAll(log_path)->info.content_sha256, log->info.content_sha256);
}

TEST_F(LabelFolderTest, BelongToTheNearestStampWithinHalfAFrame) {
  const std::string log_path = TumLog();
  folder_.Write("labels/label_1600000000.500000.png", Labels(CV_8UC1, 3));
  folder_.Write("labels/1600000002400000000.png", Labels(CV_8UC1, 3));
  const auto log = ReadAll(log_path, options_);
  EXPECT_EQ(LabelTimes(log),
            (std::vector<TimeNs>{1'600'000'000'100'000'000, 1'600'000'002'100'000'000}));
  EXPECT_TRUE(HasNote(log->info, "1 of 3 pictures of depth0 have no label picture"));
  ExpectMalformedFile(ReadAll(log_path, strict_).status(), {"1 of 3 pictures of depth0"});
  // More than half a frame after the last one.
  folder_.Write("labels/1600000002.65.png", Labels(CV_8UC1, 3));
  EXPECT_TRUE(HasNote(ReadAll(log_path, options_)->info, "1 of 3 label pictures belong to no"));
}

TEST_F(LabelFolderTest, BelongToTheFramesOfTheirNumbers) {
  const std::string log_path = SevenScenesLog();
  folder_.Write("labels/frame-000000.label.png", Labels(CV_8UC1, 3));
  folder_.Write("labels/frame-000001.color.png", Labels(CV_8UC1, 3));
  folder_.Write("labels/2.png", Labels(CV_16UC1, 3));
  const auto log = ReadAll(log_path, strict_);
  EXPECT_EQ(LabelTimes(log), (std::vector<TimeNs>{0, 33'333'333, 66'666'666}));
  folder_.Write("labels/002.png", Labels(CV_16UC1, 3));
  ExpectMalformedFile(ReadAll(log_path, options_).status(),
                      {"2.png", "the same picture of the log"});
}

TEST_F(LabelFolderTest, CountsIdsThatNobodyKnows) {
  const std::string log_path = SevenScenesLog();
  for (int i = 0; i < 3; ++i) {
    folder_.Write(absl::StrCat("labels/", i, ".png"), Labels(CV_16UC1, i == 0 ? 3 : 700 + i));
  }
  const auto log = ReadAll(log_path, options_);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_TRUE(HasNote(log->info, "the ids 701, 702, of 6 pixels in 2 pictures"));
  ExpectMalformedFile(ReadAll(log_path, strict_).status(), {"ids 701, 702"});
}

TEST_F(LabelFolderTest, SaysWhatIsWrong) {
  const std::string log_path = SevenScenesLog();
  const auto refuse = [&](const std::vector<std::string>& words) {
    ExpectMalformedFile(ReadAll(log_path, options_).status(), words);
  };
  refuse({"has no label pictures"});
  folder_.Write("labels/other.png", Labels(CV_8UC1, 3));
  refuse({"none of 1 label pictures", "other.png", "frame-000000.depth.png"});
  folder_.Write("labels/0.png", Labels(CV_8UC1, 3, 5));
  refuse({"0.png", "is 5x3", "depth0 4x3"});
  folder_.Write("labels/0.png", Labels(CV_8UC1, 3));
  folder_.Write("labels/1.png", Labels(CV_8UC1, 3, 5));
  refuse({"1.png", "is 5x3", "4x3"});
  folder_.Write("labels/1.png", Labels(CV_8UC3, 3));
  refuse({"1.png", "3 channels"});
  std::vector<uchar> bits;
  cv::imencode(".png", cv::Mat(3, 4, CV_8UC1, cv::Scalar(1)), bits, {cv::IMWRITE_PNG_BILEVEL, 1});
  folder_.Write("labels/1.png", std::string(bits.begin(), bits.end()));
  refuse({"1.png", "of 1 bits", "8 or 16 bits"});
  const std::string whole = Labels(CV_8UC1, 3);
  folder_.Write("labels/1.png", whole.substr(0, whole.size() / 2));
  refuse({"1.png"});
  std::filesystem::remove(folder_.Path("labels/labels.csv"));
  refuse({"neither labels.csv nor labels.txt"});
  options_.label_folder = folder_.Path("nowhere");
  EXPECT_EQ(ReasonOf(ReadAll(log_path, options_).status()), Reason::kFieldInvalid);
  const absl::Status refused =
      ReadAll(folder_.Write("log.txt", "1.5 1 2 3 0 0 0 1\n"), options_).status();
  EXPECT_NE(refused.message().find("takes no --labels"), std::string::npos) << refused;
}

// Two pictures of a real apartment, whose 350 instances have 106 categories.
TEST_F(LabelFolderTest, ReadsRealPictures) {
  const std::filesystem::path images = DataFolder() / "adt-apartment" / "images";
  if (DataFolder().empty() || !std::filesystem::is_directory(images)) {
    GTEST_SKIP() << "the real data is not there; set DSG_DATA";
  }
  std::ifstream in(images / "segmentation_ids.csv");
  std::string table = "id,name\n";
  std::string line;
  std::set<std::string> categories;
  std::getline(in, line);
  while (std::getline(in, line)) {
    // index,instance_uid,instance_name,category,motion_type
    std::vector<std::string> fields(1);
    for (const char c : line) {
      if (c == ',') fields.emplace_back();
      if (c != ',') fields.back() += c;
    }
    if (fields[3].empty()) continue;
    absl::StrAppend(&table, fields[0], ",", fields[3], "\n");
    categories.insert(fields[3]);
  }
  folder_.Write("labels/labels.csv", table);
  std::string color, depth;
  for (const std::string stamp : {"87551170", "87551204"}) {
    const std::string at = stamp.substr(0, 5) + "." + stamp.substr(5);
    absl::StrAppend(&color, at, " rgb/", stamp, ".jpg\n");
    absl::StrAppend(&depth, at, " depth/", stamp, ".png\n");
    folder_.Write("log/rgb/none", "");
    folder_.Write("log/depth/none", "");
    const std::string name = "rgb_" + stamp + "ms";
    // The colour of the second instant is not there in this size; any picture does.
    std::filesystem::copy_file(images / "rgb_87551170ms.jpg",
                               folder_.Path("log/rgb/" + stamp + ".jpg"));
    std::filesystem::copy_file(images / (name + "_depth.png"),
                               folder_.Path("log/depth/" + stamp + ".png"));
    std::filesystem::copy_file(images / (name + "_segmentation.png"),
                               folder_.Path("labels/" + at + ".png"));
  }
  folder_.Write("log/rgb.txt", color);
  folder_.Write("log/depth.txt", depth);
  const auto log = ReadAll(folder_.Path("log"), strict_);
  ASSERT_TRUE(log.ok()) << log.status();
  EXPECT_EQ(log->info.labels.size(), categories.size());
  ASSERT_EQ(log->ImageCount("label0"), 2);
  const Image label = LoadLabel(*log);
  std::set<int> seen;
  for (int row = 0; row < label.height; row += 8) {
    for (int column = 0; column < label.width; column += 8) {
      seen.insert(LabelAt(label, column, row) >> 8);
    }
  }
  std::set<std::string> names;
  for (const SemanticLabel& known : log->info.labels) {
    if (seen.contains(known.id)) names.insert(known.name);
  }
  EXPECT_GE(names.size(), 15u);
}

}  // namespace
}  // namespace dsg::ingest
