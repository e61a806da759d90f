#include "core/base/equal_files.h"

#include <gtest/gtest.h>

#include <string>

#include "core/base/files.h"

namespace color3d {
namespace {

TEST(EqualFiles, ComparesBytesOnly) {
  const ScratchFolder folder;
  const auto write = [&](const char* name, const std::string& bytes) {
    WriteFileAtomic(folder.path() / name, bytes);
    return folder.path() / name;
  };
  const std::string large(3 << 18, 'x');
  const auto one = write("one", large), copy = write("copy", large);
  const auto longer = write("longer", large + "x");
  const auto other = write("other", large.substr(1) + "y");
  const auto empty = write("empty", ""), also_empty = write("also_empty", "");
  EXPECT_TRUE(HaveEqualBytes(one, copy));
  EXPECT_TRUE(HaveEqualBytes(one, one));
  EXPECT_TRUE(HaveEqualBytes(empty, also_empty));
  EXPECT_FALSE(HaveEqualBytes(one, longer));
  EXPECT_FALSE(HaveEqualBytes(one, other));
  EXPECT_FALSE(HaveEqualBytes(one, empty));
  EXPECT_FALSE(HaveEqualBytes(one, folder.path() / "none"));
  EXPECT_FALSE(HaveEqualBytes(folder.path(), folder.path()));
}

}  // namespace
}  // namespace color3d
