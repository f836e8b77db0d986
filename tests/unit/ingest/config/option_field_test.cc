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
  *bound[1].value = 0.75;
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

}  // namespace
}  // namespace dsg::ingest
