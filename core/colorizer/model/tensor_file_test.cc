#include "core/colorizer/model/tensor_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/random.h"
#include "core/weights/safetensors.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

constexpr TensorFormat kFormat = {"color3d.test", 3, "OLDFILE1", "create it again"};
constexpr char kDigestKey[] = "\"sha256\":\"";

TensorFile MakeFile() {
  TensorFile file;
  file.facts = {{"hello", 1}, {"text", "with \"sha256\":\" in it"}};
  file.arrays["one"] = {{2, 3}, {1, 2, 3, 4, 5, 6}};
  file.arrays["two"] = {{5}, {1, 0.5, -2, 0, 1024}};
  file.arrays["empty"] = {{0, 7}, {}};
  file.arrays["scalar"] = {{}, {0.1f}};
  file.half = {"two"};
  return file;
}

TensorFile Read(const std::string& bytes) {
  return ReadTensorFile(bytes, kFormat, "the test file");
}

std::string MessageOf(const std::string& bytes) {
  try {
    Read(bytes);
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
    return error.what();
  }
  return "";
}

// Corrects the checksum, to test the checks after it.
std::string Resign(std::string bytes) {
  const size_t key = bytes.find(kDigestKey);
  if (key == std::string::npos || key + 10 + 64 > bytes.size()) return bytes;
  bytes.replace(key + 10, 64, std::string(64, '0'));
  return bytes.replace(key + 10, 64, Sha256Hex(bytes));
}

TEST(TensorFileTest, ReadsWrittenFile) {
  const TensorFile file = MakeFile();
  const std::string bytes = WriteTensorFile(file, kFormat);
  EXPECT_EQ(Resign(bytes), bytes);
  const TensorFile read = Read(bytes);
  EXPECT_EQ(read.facts, file.facts);
  ASSERT_EQ(read.arrays.size(), file.arrays.size());
  for (const auto& [name, array] : file.arrays) {
    EXPECT_EQ(read.arrays.at(name).shape, array.shape);
    EXPECT_EQ(read.arrays.at(name).values, array.values);
  }
}

TEST(TensorFileTest, IsReadableAsSafetensors) {
  const WeightMap weights = ParseSafetensors(WriteTensorFile(MakeFile(), kFormat));
  EXPECT_EQ(weights.at("two").values, MakeFile().arrays.at("two").values);
}

TEST(TensorFileTest, RefusesEveryTruncation) {
  const std::string bytes = WriteTensorFile(MakeFile(), kFormat);
  for (size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_THROW(Read(bytes.substr(0, length)), Error) << length;
  }
  EXPECT_THROW(Read(bytes + "x"), Error);
}

TEST(TensorFileTest, RefusesEveryChangedByte) {
  const std::string bytes = WriteTensorFile(MakeFile(), kFormat);
  for (size_t i = 0; i < bytes.size(); ++i) {
    std::string changed = bytes;
    changed[i] = static_cast<char>(changed[i] ^ 0x40);
    EXPECT_THROW(Read(changed), Error) << i;
  }
}

TEST(TensorFileTest, SurvivesHostileBytesWithValidChecksum) {
  const std::string bytes = WriteTensorFile(MakeFile(), kFormat);
  Random random(1);
  int refused = 0;
  for (int round = 0; round < 5000; ++round) {
    std::string changed = bytes;
    const int changes = 1 + static_cast<int>(random.NextBelow(4));
    for (int i = 0; i < changes; ++i) {
      const size_t at = random.NextBelow(static_cast<uint32_t>(bytes.size()));
      changed[at] = static_cast<char>(random.NextUint32());
    }
    if (random.NextBelow(4) == 0) changed.erase(20, random.NextBelow(30));
    try {
      Read(Resign(changed));
    } catch (const Error& error) {
      EXPECT_EQ(error.code(), ErrorCode::kInvalidArgument);
      ++refused;
    }
  }
  EXPECT_GT(refused, 1000);
}

TEST(TensorFileTest, NamesOtherKindOrVersion) {
  TensorFormat other = kFormat;
  other.name = "color3d.other";
  EXPECT_THAT(MessageOf(WriteTensorFile(MakeFile(), other)), HasSubstr("another kind"));
  EXPECT_THAT(MessageOf(std::string(200, 'x')), HasSubstr("another kind"));
  EXPECT_THAT(MessageOf(SerializeSafetensors(MakeFile().arrays, false)), HasSubstr("another kind"));
  other = kFormat;
  other.version = 4;
  EXPECT_THAT(MessageOf(WriteTensorFile(MakeFile(), other)), HasSubstr("version 4"));
  EXPECT_THAT(MessageOf(WriteTensorFile(MakeFile(), other)), HasSubstr("create it again"));
}

TEST(TensorFileTest, RefusesOldFormatWithRemedy) {
  EXPECT_THAT(MessageOf("OLDFILE1 and more"), HasSubstr("earlier version"));
  EXPECT_THAT(MessageOf("OLDFILE1 and more"), HasSubstr("create it again"));
}

}  // namespace
}  // namespace color3d
