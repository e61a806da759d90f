#include "core/zip/zip.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include "tests/support/formats/viewer_files.h"
#include "tests/support/networks/weight_files.h"

namespace color3d {
namespace {

using ::testing::HasSubstr;

// Reads record "a" of at most `max_bytes` bytes. Returns the content or the error.
std::string ReadA(const std::string& zip, uint64_t max_bytes = 7) {
  const MemorySource source(zip, "x.zip");
  try {
    return ZipReader(source).Read("a", max_bytes);
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    return e.what();
  }
}

std::string Deflate(std::string bytes) {
  z_stream stream = {};
  deflateInit2(&stream, 9, Z_DEFLATED, -15, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(bytes.data());
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  EXPECT_EQ(deflate(&stream, Z_FINISH), Z_STREAM_END);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

// Sets a field of 4 bytes in the directory's first entry.
std::string WithField(std::string zip, size_t offset, uint32_t value) {
  return zip.replace(zip.find("PK\x01\x02") + offset, 4, reinterpret_cast<const char*>(&value), 4);
}

TEST(StoredZipTest, RoundTrips) {
  const auto files = ReadStoredZip(StoredZip({{"a", "one"}, {"folder/b", std::string(300, '\0')}}));
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files.at("a"), "one");
  EXPECT_EQ(files.at("folder/b").size(), 300u);
  EXPECT_TRUE(ReadStoredZip(StoredZip({})).empty());
}

TEST(ZipReaderTest, ReadsStoredAndDeflatedRecords) {
  EXPECT_EQ(ReadA(StoredZip({{"a", "content"}, {"folder/a", ""}})), "content");
  const std::string content(5000, 'x'), packed = Deflate(content);
  std::string zip = WithField(MakeZip({{"a", packed, 8}}), 24, content.size());
  EXPECT_THAT(ReadA(zip, content.size()), HasSubstr("does not have its checksum"));
  const uLong checksum = crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size());
  zip = WithField(zip, 16, static_cast<uint32_t>(checksum));
  EXPECT_EQ(ReadA(zip, content.size()), content);
  EXPECT_THAT(ReadA(zip, content.size() - 1), HasSubstr("has 5000 bytes, more than 4999"));
  EXPECT_THAT(ReadA(WithField(zip, 24, 5001), 5001), HasSubstr("\"a\" is damaged"));
  EXPECT_THAT(ReadA(WithField(zip, 24, 4999), 5001), HasSubstr("\"a\" is damaged"));
}

TEST(ZipReaderTest, RefusesUnsafeNames) {
  for (const char* name : {"../a", "/etc/a", "a\nb", "a\x1b[2J", "a//b", "a\\b"}) {
    const std::string error = ReadA(StoredZip({{name, "content"}}));
    EXPECT_THAT(error, HasSubstr("not a plain relative path")) << name;
    EXPECT_EQ(error.find_first_of("\n\x1b"), std::string::npos) << "hostile bytes in a message";
  }
}

TEST(ZipReaderTest, RefusesDamagedRecords) {
  const std::string zip = StoredZip({{"a", "content"}});
  EXPECT_THAT(ReadA(StoredZip({{"a", "content"}, {"a", "other"}})), HasSubstr("twice"));
  EXPECT_THAT(ReadA(WithField(zip, 24, 0x7fffffff)), HasSubstr("which is impossible"));
  EXPECT_THAT(ReadA(WithField(zip, 10, 99)), HasSubstr("compressed by method 99"));
  EXPECT_THAT(ReadA(zip, 6), HasSubstr("has 7 bytes, more than 6"));
  EXPECT_THAT(ReadA(StoredZip({{"b", "content"}})), HasSubstr("there is no record \"a\""));
  std::string moved = zip;
  moved[30] = 'b';  // the name in the local header
  EXPECT_THAT(ReadA(moved), HasSubstr("is not where the zip directory says"));
  std::string changed = zip;
  changed[31] = 'C';  // the content
  EXPECT_THAT(ReadA(changed), HasSubstr("does not have its checksum"));
  EXPECT_THAT(ReadA(zip.substr(0, zip.size() - 1)), HasSubstr("cut short"));
  std::string part = zip;
  part[part.size() - 18] = 1;  // the number of this disk
  EXPECT_THAT(ReadA(part), HasSubstr("archive in several files"));
}

}  // namespace
}  // namespace color3d
