// SPDX-License-Identifier: Apache-2.0
#include "ingest/config/option_field.h"

#include <gtest/gtest.h>

#include <cmath>

namespace dsg::ingest {
namespace {

struct Inner {
  double share = 0.5;
};
constexpr OptionField<Inner> kInnerFields[] = {{"inner-share", &Inner::share, 0.0, 1.0, "A share"}};

struct Mixed {
  int count = 3;
  TimeNs wait_ns = 1'500'000'000;

  std::vector<BoundOption> Bind();
};
constexpr OptionField<Mixed> kMixedFields[] = {
    {"mixed-count", &Mixed::count, 1.0, 10.0, "A count"},
    {"mixed-wait", &Mixed::wait_ns, 0.0, 60.0, "A time, seconds"}};

std::vector<BoundOption> Mixed::Bind() {
  std::vector<BoundOption> bound;
  BindFields<Mixed>(kMixedFields, this, &bound);
  return bound;
}

struct Outer {
  double length_m = 0.1;
  Inner inner;

  std::vector<BoundOption> Bind();
};
constexpr OptionField<Outer> kOuterFields[] = {
    {"outer-length", &Outer::length_m, 0.05, 20.0, "A length, metres"}};

std::vector<BoundOption> Outer::Bind() {
  std::vector<BoundOption> bound;
  BindFields<Outer>(kOuterFields, this, &bound);
  BindFields<Inner>(kInnerFields, &inner, &bound);
  return bound;
}

TEST(OptionField, BindsToTheMembersOfOneStruct) {
  Outer outer;
  const std::vector<BoundOption> bound = outer.Bind();
  ASSERT_EQ(bound.size(), 2u);
  bound[1].Set(0.75);
  EXPECT_EQ(outer.inner.share, 0.75);
  EXPECT_STREQ(bound[0].help, "A length, metres");
}

TEST(OptionField, IsRefusedOutOfItsRangeWithNameValueAndBounds) {
  EXPECT_TRUE(ValidateOptions(Outer()).ok());
  EXPECT_TRUE(ValidateOptions(Outer{20.0, {0.0}}).ok());
  const absl::Status status = ValidateOptions(Outer{20.5, {}});
  EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument);
  EXPECT_EQ(status.message(), "outer-length is 20.5; give 0.05 to 20");
  EXPECT_EQ(ValidateOptions(Outer{1.0, {-0.1}}).message(), "inner-share is -0.1; give 0 to 1");
  EXPECT_FALSE(ValidateOptions(Outer{NAN, {}}).ok());
  EXPECT_FALSE(ValidateOptions(Outer{INFINITY, {}}).ok());
}

TEST(OptionField, DigestsTellAllNumbersApart) {
  EXPECT_EQ(DigestOptions(Outer()), "");
  EXPECT_EQ(DigestFields(Outer().Bind(), {}), "outer-length=0.1 inner-share=0.5");
  EXPECT_EQ(DigestOptions(Outer{0.2, {0.75}}), "outer-length=0.2 inner-share=0.75");
  EXPECT_EQ(DigestOptions(Outer{0.1, {std::nextafter(0.5, 1.0)}}),
            "inner-share=0.5000000000000001");
}

TEST(OptionField, CountsAreWholeAndTimesAreSeconds) {
  Mixed mixed;
  const std::vector<BoundOption> bound = mixed.Bind();
  EXPECT_EQ(DigestFields(bound, {}), "mixed-count=3 mixed-wait=1.5");
  EXPECT_TRUE(bound[0].IsCount());
  EXPECT_EQ(bound[0].Check(2.5).message(), "mixed-count is 2.5; give a whole number, 1 to 10");
  EXPECT_FALSE(bound[0].Check(NAN).ok());
  EXPECT_FALSE(bound[0].Check(11.0).ok());
  bound[0].Set(7.0);
  bound[1].Set(0.02);
  EXPECT_EQ(mixed.count, 7);
  EXPECT_EQ(mixed.wait_ns, 20'000'000);
  EXPECT_EQ(DigestOptions(mixed), "mixed-count=7 mixed-wait=0.02");
  EXPECT_EQ(bound[1].Check(61.0).message(), "mixed-wait is 61; give 0 to 60");
}

}  // namespace
}  // namespace dsg::ingest
