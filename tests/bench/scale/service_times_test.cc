#include "tests/bench/scale/service_times.h"

#include <gtest/gtest.h>

#include "core/base/error.h"
#include "core/base/files.h"

namespace color3d {
namespace {

TEST(ServiceTimesTest, ReadsWhatItWrites) {
  const ScratchFolder scratch;
  const std::filesystem::path file = scratch.path() / "store.json";
  ServiceTimes times = TimesOfDatabase("postgresql");
  times.claim_read = 0.0125;
  WriteFileAtomic(file, nlohmann::json{{"service_ms", TimesToJson(times)}}.dump());
  const ServiceTimes read = ReadTimes(file, TimesOfDatabase("sqlite"));
  EXPECT_DOUBLE_EQ(read.claim_read, 0.0125);
  EXPECT_DOUBLE_EQ(read.publish_write, times.publish_write);
}

TEST(ServiceTimesTest, KeepsTimesThatTheFileLacks) {
  const ScratchFolder scratch;
  const std::filesystem::path file = scratch.path() / "store.json";
  WriteFileAtomic(file, R"({"service_ms": {"claim_read": 7}})");
  const ServiceTimes base = TimesOfDatabase("sqlite"), read = ReadTimes(file, base);
  EXPECT_DOUBLE_EQ(read.claim_read, 0.007);
  EXPECT_DOUBLE_EQ(read.claim_write, base.claim_write);
}

TEST(ServiceTimesTest, RefusesOtherFilesAndNames) {
  const ScratchFolder scratch;
  const std::filesystem::path file = scratch.path() / "store.json";
  for (const char* text : {"",
                           "[]",
                           "{}",
                           R"({"service_ms": 1})",
                           R"({"service_ms": {"claim": 1}})",
                           R"({"service_ms": {"claim_read": -1}})",
                           R"({"service_ms": {"claim_read": "1"}})"}) {
    WriteFileAtomic(file, text);
    EXPECT_THROW(ReadTimes(file, {}), Error) << text;
  }
  EXPECT_THROW(TimesOfDatabase("mysql"), Error);
}

}  // namespace
}  // namespace color3d
