#include "core/colorizer/archive.h"

#include <gtest/gtest.h>

#include <string>

#include "core/base/digest.h"
#include "core/base/error.h"
#include "core/base/random.h"

namespace color3d {
namespace {

constexpr char kMagic[] = "TESTFILE";

Archive MakeArchive() {
  Archive archive;
  archive.version = 3;
  archive.header = R"({"hello": 1})";
  archive.arrays["one"] = {ArchiveArray::Type::kFloat32, {2, 3}, std::string(24, 'x')};
  archive.arrays["two"] = {ArchiveArray::Type::kFloat16, {5}, std::string(10, 'y')};
  archive.arrays["empty"] = {ArchiveArray::Type::kFloat32, {0, 7}, ""};
  archive.arrays["scalar"] = {ArchiveArray::Type::kFloat32, {}, "1234"};
  return archive;
}

Archive Read(const std::string& bytes) { return ReadArchive(bytes, kMagic, 3, "the test file"); }

// Replaces the checksum, so that what lies behind it is tested.
std::string Resign(std::string bytes) {
  bytes.resize(bytes.size() - 64);
  return bytes + Sha256Hex(bytes);
}

TEST(ArchiveTest, RoundTrip) {
  const Archive archive = MakeArchive();
  const Archive read = Read(WriteArchive(archive, kMagic));
  EXPECT_EQ(read.header, archive.header);
  ASSERT_EQ(read.arrays.size(), archive.arrays.size());
  for (const auto& [name, array] : archive.arrays) {
    EXPECT_EQ(read.arrays.at(name).shape, array.shape);
    EXPECT_EQ(read.arrays.at(name).bytes, array.bytes);
    EXPECT_EQ(read.arrays.at(name).type, array.type);
  }
}

TEST(ArchiveTest, EveryTruncationIsRefused) {
  const std::string bytes = WriteArchive(MakeArchive(), kMagic);
  for (size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_THROW(Read(bytes.substr(0, length)), Error) << length;
  }
  EXPECT_THROW(Read(bytes + "x"), Error);
}

TEST(ArchiveTest, EveryChangedByteIsRefused) {
  const std::string bytes = WriteArchive(MakeArchive(), kMagic);
  for (size_t i = 0; i < bytes.size(); ++i) {
    std::string changed = bytes;
    changed[i] = static_cast<char>(changed[i] ^ 0x40);
    EXPECT_THROW(Read(changed), Error) << i;
  }
}

TEST(ArchiveTest, HostileBytesWithARightChecksumNeverCrash) {
  const std::string bytes = WriteArchive(MakeArchive(), kMagic);
  Random random(1);
  int refused = 0;
  for (int round = 0; round < 5000; ++round) {
    std::string changed = bytes;
    const int changes = 1 + static_cast<int>(random.NextBelow(4));
    for (int i = 0; i < changes; ++i) {
      const size_t at = 8 + random.NextBelow(static_cast<uint32_t>(bytes.size() - 8 - 64));
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

TEST(ArchiveTest, AnotherKindOrVersionIsNamed) {
  Archive archive = MakeArchive();
  try {
    ReadArchive(WriteArchive(archive, "OTHERONE"), kMagic, 3, "the test file");
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("another kind"), std::string::npos);
  }
  archive.version = 4;
  try {
    Read(WriteArchive(archive, kMagic));
    FAIL();
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("version 4"), std::string::npos);
  }
}

}  // namespace
}  // namespace color3d
