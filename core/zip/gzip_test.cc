#include "core/zip/gzip.h"

#include <gtest/gtest.h>
#include <zlib.h>

namespace color3d {
namespace {

TEST(GzipTest, RoundTrips) {
  const std::string bytes(100000, 'a'), packed = Gzip(bytes);
  EXPECT_LT(packed.size(), 400u);
  std::string back(bytes.size(), '\0');
  z_stream stream{};
  ASSERT_EQ(inflateInit2(&stream, 15 + 16), Z_OK);
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(back.data());
  stream.avail_out = static_cast<uInt>(back.size());
  EXPECT_EQ(inflate(&stream, Z_FINISH), Z_STREAM_END);
  inflateEnd(&stream);
  EXPECT_EQ(back, bytes);
}

}  // namespace
}  // namespace color3d
