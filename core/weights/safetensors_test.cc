#include "core/weights/safetensors.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <limits>
#include <string>

#include "core/base/error.h"
#include "core/base/files.h"
#include "core/base/random.h"
#include "core/weights/element_type.h"
#include "core/weights/weight_file.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

std::string File(const std::string& header, const std::string& data) {
  const uint64_t length = header.size();
  return std::string(reinterpret_cast<const char*>(&length), 8) + header + data;
}

std::string RefusalOf(const std::string& bytes) {
  try {
    ParseSafetensors(bytes);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
  return "accepted";
}

WeightMap SomeWeights() {
  return {{"a.weight", {{2, 3}, {1.0f, -2.5f, 0.0f, 1e-6f, 65504.0f, -3.0f}}},
          {"b", {{}, {7.0f}}},
          {"empty", {{0, 4}, {}}}};
}

TEST(SafetensorsTest, RoundTripInSinglePrecision) {
  WeightMetadata metadata;
  const WeightMap read = ParseSafetensors(
      SerializeSafetensors(SomeWeights(), false, {{"card", "a \"b\""}}), &metadata);
  ASSERT_EQ(read.size(), 3u);
  for (const auto& [name, array] : SomeWeights()) {
    EXPECT_EQ(read.at(name).shape, array.shape) << name;
    EXPECT_EQ(read.at(name).values, array.values) << name;
  }
  EXPECT_EQ(metadata, (WeightMetadata{{"card", "a \"b\""}}));
}

TEST(SafetensorsTest, RoundTripInHalfPrecision) {
  const std::string bytes = SerializeSafetensors(SomeWeights(), true);
  const WeightMap read = ParseSafetensors(bytes);
  for (const auto& [name, array] : SomeWeights()) {
    for (size_t i = 0; i < array.values.size(); ++i) {
      EXPECT_NEAR(read.at(name).values[i],
                  array.values[i],
                  std::max(std::abs(array.values[i]) / 2048.0f, 3e-8f));
    }
  }
  EXPECT_EQ(SerializeSafetensors(read, true), bytes);
}

TEST(SafetensorsTest, RefusesValuesBeyondHalfPrecision) {
  const WeightMap weights{{"big", {{1}, {70000.0f}}}};
  EXPECT_THROW(SerializeSafetensors(weights, true), Error);
  EXPECT_NO_THROW(SerializeSafetensors(weights, false));
}

TEST(SafetensorsTest, RefusesToWriteShapeThatDoesNotFit) {
  EXPECT_THROW(SerializeSafetensors({{"a", {{2}, {1.0f}}}}, false), Error);
}

// Every half to float and back; and every tie between two neighbouring halves rounds to even.
TEST(ElementTypeTest, HalfConversionIsExactForAllValues) {
  for (uint32_t bits = 0; bits < 0x10000; ++bits) {
    const auto half = static_cast<uint16_t>(bits);
    const float value = FloatFromHalf(half);
    const int exponent = (bits >> 10) & 31, mantissa = bits & 1023;
    const double sign = bits & 0x8000 ? -1.0 : 1.0;
    if (exponent == 31) {
      EXPECT_EQ(std::isnan(value), mantissa != 0);
      if (mantissa == 0) {
        EXPECT_EQ(HalfFromFloat(value), half);
      }
      continue;
    }
    const double expected = exponent == 0 ? sign * std::ldexp(mantissa, -24)
                                          : sign * std::ldexp(1024 + mantissa, exponent - 25);
    ASSERT_EQ(value, expected) << bits;
    ASSERT_EQ(HalfFromFloat(value), half) << bits;
    if ((bits & 0x7fff) >= 0x7bff) continue;
    const float tie = 0.5f * (value + FloatFromHalf(static_cast<uint16_t>(bits + 1)));
    ASSERT_EQ(HalfFromFloat(tie), bits & 1 ? bits + 1 : bits) << bits;
  }
  EXPECT_EQ(HalfFromFloat(65519.99f), 0x7bff);
  EXPECT_EQ(HalfFromFloat(65520.0f), 0x7c00);
  EXPECT_EQ(HalfFromFloat(1e-8f), 0);
}

TEST(SafetensorsTest, ConvertsEveryTypeToFloat) {
  const std::string data(
      "\x00\x00\x80\x3f\x00\x3c\xc0\x3f\x00\x00\x00\x00\x00\x00\x04\x40"
      "\xff\xfe\x05\x00\xff\xff\xff\xff\x01",
      25);
  const WeightMap read =
      ParseSafetensors(File(R"({"f32":{"dtype":"F32","shape":[1],"data_offsets":[0,4]},)"
                            R"("f16":{"dtype":"F16","shape":[1],"data_offsets":[4,6]},)"
                            R"("bf16":{"dtype":"BF16","shape":[1],"data_offsets":[6,8]},)"
                            R"("f64":{"dtype":"F64","shape":[1],"data_offsets":[8,16]},)"
                            R"("i8":{"dtype":"I8","shape":[],"data_offsets":[16,17]},)"
                            R"("u8":{"dtype":"U8","shape":[],"data_offsets":[17,18]},)"
                            R"("i16":{"dtype":"I16","shape":[],"data_offsets":[18,20]},)"
                            R"("i32":{"dtype":"I32","shape":[],"data_offsets":[20,24]},)"
                            R"("bool":{"dtype":"BOOL","shape":[1,1],"data_offsets":[24,25]}})",
                            data));
  EXPECT_EQ(read.at("f32").values[0], 1.0f);
  EXPECT_EQ(read.at("f16").values[0], 1.0f);
  EXPECT_EQ(read.at("bf16").values[0], 1.5f);
  EXPECT_EQ(read.at("f64").values[0], 2.5f);
  EXPECT_EQ(read.at("i8").values[0], -1.0f);
  EXPECT_EQ(read.at("u8").values[0], 254.0f);
  EXPECT_EQ(read.at("i16").values[0], 5.0f);
  EXPECT_EQ(read.at("i32").values[0], -1.0f);
  EXPECT_EQ(read.at("bool").values[0], 1.0f);
}

TEST(SafetensorsTest, RefusesHostileHeaders) {
  const auto entry = [](const std::string& shape, const std::string& offsets) {
    return R"({"dtype":"F32","shape":)" + shape + R"(,"data_offsets":)" + offsets + "}";
  };
  const std::string four(4, '\0'), eight(8, '\0');
  const std::string good = entry("[1]", "[0,4]");
  EXPECT_EQ(RefusalOf(File("{\"a\":" + good + "}", four)), "accepted");
  EXPECT_EQ(RefusalOf(File("{}", "")), "accepted");
  EXPECT_THAT(RefusalOf(""), HasSubstr("cut short"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + good + ",\"b\":" + good + "}", four)),
              HasSubstr("\"b\" at [0, 4) overlaps"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + good + ",\"a\":" + entry("[1]", "[4,8]") + "}", eight)),
              HasSubstr("\"a\" is there twice"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + entry("[1]", "[4,8]") + "}", eight)), HasSubstr("gap"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + good + "}", eight)), HasSubstr("belong to no array"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + entry("[2]", "[0,8]") + "}", four)),
              HasSubstr("not inside"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + entry("[1]", "[4,0]") + "}", four)),
              HasSubstr("not inside"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + entry("[1073741824,1073741824]", "[0,4]") + "}", four)),
              HasSubstr("4 bytes for 1152921504606846976 elements"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + entry("[4294967296,4294967296]", "[0,4]") + "}", four)),
              HasSubstr("more elements than can be counted"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + entry("[4294967296,4294967296,0]", "[0,0]") + "}", "")),
              HasSubstr("more elements than can be counted"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + entry("[-1]", "[0,4]") + "}", four)),
              HasSubstr("negative number"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + entry("[1.5]", "[0,4]") + "}", four)),
              HasSubstr("fraction"));
  EXPECT_THAT(RefusalOf(File("{\"a\":{\"dtype\":\"F32\"}}", four)), HasSubstr("lacks"));
  EXPECT_THAT(RefusalOf(File("{\"a\":[]}", four)), HasSubstr("a list"));
  EXPECT_THAT(RefusalOf(File("[]", "")), HasSubstr("no safetensors header"));
  EXPECT_THAT(RefusalOf(File("{\"a\"", "")), HasSubstr("not JSON"));
  EXPECT_THAT(RefusalOf(File("{\"\\n\x1b\":{\"dtype\":\"F4\"}}", "")), HasSubstr("not JSON"));
  EXPECT_THAT(RefusalOf(File("{\"a\\n\":{\"dtype\":\"F4\"}}", "")),
              HasSubstr("\"a?\" has the number format \"F4\""));
  EXPECT_THAT(RefusalOf(File(std::string(100000, '['), "")), HasSubstr("no safetensors header"));
  EXPECT_THAT(RefusalOf(File("{\"a\":" + std::string(100000, '['), "")), HasSubstr("a list"));
  EXPECT_THAT(RefusalOf(std::string("\xff\xff\xff\xff\xff\xff\xff\x7f{}", 10)),
              HasSubstr("header claims"));
}

TEST(SafetensorsTest, AFileCutAnywhereIsRefused) {
  const std::string bytes = SerializeSafetensors(SomeWeights(), false);
  for (size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_NE(RefusalOf(bytes.substr(0, size)), "accepted") << size;
  }
}

TEST(SafetensorsTest, ReadsOrRefusesAnyFlippedBit) {
  const std::string bytes = SerializeSafetensors(SomeWeights(), false);
  for (size_t bit = 0; bit < bytes.size() * 8; ++bit) {
    std::string damaged = bytes;
    damaged[bit / 8] = static_cast<char>(damaged[bit / 8] ^ (1 << bit % 8));
    RefusalOf(damaged);
  }
}

TEST(WeightFileTest, NamesMissingFileAndFolder) {
  const ScratchFolder folder;
  for (const auto& path : {folder.path() / "none.safetensors", folder.path()}) {
    try {
      ReadWeightFile(path);
      FAIL();
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kNotFound);
      EXPECT_THAT(error.what(), HasSubstr(path.string()));
    }
  }
}

}  // namespace
}  // namespace color3d
