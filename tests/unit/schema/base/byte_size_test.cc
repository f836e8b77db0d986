// SPDX-License-Identifier: Apache-2.0
#include "schema/base/byte_size.h"

#include <gtest/gtest.h>

#include "schema/base/status.h"

namespace dsg {
namespace {

TEST(ByteSize, ReadsUnits) {
  EXPECT_EQ(*ParseByteSize("0"), 0);
  EXPECT_EQ(*ParseByteSize("12"), 12);
  EXPECT_EQ(*ParseByteSize("12b"), 12);
  EXPECT_EQ(*ParseByteSize("3k"), 3'000);
  EXPECT_EQ(*ParseByteSize("500MiB"), int64_t{500} << 20);
  EXPECT_EQ(*ParseByteSize("10 GB"), 10'000'000'000);
  EXPECT_EQ(*ParseByteSize("1TiB"), int64_t{1} << 40);
  EXPECT_EQ(*ParseByteSize("9223372036854775807"), INT64_MAX);
}

TEST(ByteSize, RefusesSignsAndWhatIsNoSize) {
  for (const char* text : {"", "-1", "-5GB", "+3", "much", "GB", "1.5GB", "3x", "3ii", "1 2",
                           "9223372036854775808", "18446744073709551615", "9999999999999GB"}) {
    const auto bytes = ParseByteSize(text);
    EXPECT_EQ(ReasonOf(bytes.status()), Reason::kFieldInvalid) << text;
    std::string taken = text;
    EXPECT_NE(TakeByteSize(taken).find(text), std::string::npos);
    EXPECT_EQ(taken, text);
  }
  std::string taken = "2kB";
  EXPECT_EQ(TakeByteSize(taken), "");
  EXPECT_EQ(taken, "2000");
}

}  // namespace
}  // namespace dsg
