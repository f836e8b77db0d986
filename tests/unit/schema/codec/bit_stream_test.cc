// SPDX-License-Identifier: Apache-2.0
#include "schema/codec/bit_stream.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "schema/codec/shuffle.h"
#include "tests/support/temp_folder.h"

namespace dsg {
namespace {

TEST(BitStream, ReadsBackFieldsOfEveryWidth) {
  std::mt19937_64 random(test::TestSeed(3));
  for (int width = 0; width <= 64; ++width) {
    const uint64_t mask = width == 64 ? ~uint64_t{0} : (uint64_t{1} << width) - 1;
    std::vector<uint64_t> values(100);
    std::string bytes;
    BitWriter writer(&bytes);
    for (uint64_t& value : values) writer.Append(value = random() & mask, width);
    writer.Flush();
    EXPECT_EQ(bytes.size(), (100u * static_cast<size_t>(width) + 7) / 8);
    bytes.append(kBitPadding, '\0');
    for (size_t i = 0; i < values.size(); ++i) {
      ASSERT_EQ(ReadBits(bytes.data(), i, width), values[i]) << "width " << width;
    }
  }
}

TEST(BitStream, ReadsBackVarintsAndKnowsTheirSize) {
  for (const int64_t value : {int64_t{0}, int64_t{-1}, int64_t{63}, int64_t{64}, INT64_MIN,
                              INT64_MAX, int64_t{-1000000}}) {
    std::string bytes;
    AppendVarint(ZigZag(value), &bytes);
    EXPECT_EQ(VarintSize(ZigZag(value)), static_cast<int>(bytes.size()));
    ByteReader reader(bytes);
    EXPECT_EQ(UnZigZag(reader.Varint()), value);
    EXPECT_TRUE(reader.ok());
  }
}

// Near the end bytes are read one by one, before it a word at a time.
TEST(BitStream, ReadsVarintsOfEveryLengthWhateverFollows) {
  for (int bits = 0; bits < 64; ++bits) {
    for (const uint64_t value : {uint64_t{1} << bits, (uint64_t{2} << bits) - 1}) {
      for (const char* rest : {"", "\x01", "\xff\xff\xff\xff\xff\xff\xff\xff\xff"}) {
        std::string bytes;
        AppendVarint(value, &bytes);
        const size_t size = bytes.size();
        bytes += rest;
        ByteReader reader(bytes);
        EXPECT_EQ(reader.Varint(), value);
        EXPECT_EQ(reader.position(), size);
        EXPECT_TRUE(reader.ok());
      }
    }
  }
}

TEST(ByteReader, RemembersThatItReadPastTheEnd) {
  ByteReader reader("\x80\x80");
  reader.Varint();
  EXPECT_FALSE(reader.ok());
  ByteReader short_reader("ab");
  short_reader.Fixed<uint32_t>();
  EXPECT_FALSE(short_reader.ok());
}

TEST(Shuffle, RestoresAndRefusesTheWrongSize) {
  std::string bytes;
  for (int i = 0; i < 1000; ++i) AppendFixed(static_cast<uint64_t>(i) * 1000003, &bytes);
  const std::string packed = CompressShuffled(bytes, 8);
  EXPECT_LT(packed.size(), bytes.size() / 2);
  std::string restored;
  ASSERT_TRUE(DecompressShuffled(packed, 8, bytes.size(), &restored));
  EXPECT_EQ(restored, bytes);
  EXPECT_FALSE(DecompressShuffled(packed, 8, bytes.size() - 8, &restored));
  EXPECT_FALSE(Decompress(packed, 10, &restored));
  EXPECT_FALSE(Decompress("not a frame", 1000, &restored));
}

}  // namespace
}  // namespace dsg
