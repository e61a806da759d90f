#include "core/catalogue/export_formats.h"

#include <gtest/gtest.h>

#include <string_view>

#include "core/catalogue/stages.h"

namespace color3d {
namespace {

TEST(ExportFormatsTest, EachIsAnArtifactOfExport) {
  std::set<std::string_view> options, artifacts;
  for (const ExportFormatInfo& info : kExportFormats) {
    EXPECT_EQ(&InfoOf(info.format), &info) << "two rows of one format";
    EXPECT_TRUE(options.insert(info.option).second) << info.option;
    EXPECT_TRUE(artifacts.insert(info.artifact).second) << info.artifact;
    const Artifact* artifact = FindArtifact(info.artifact);
    ASSERT_NE(artifact, nullptr) << info.artifact;
    EXPECT_STREQ(artifact->stage, kind::kExport);
    EXPECT_TRUE(artifact->is_result);
    EXPECT_NE(ExportFormatNames().find(info.option), std::string::npos);
  }
}

TEST(ExportFormatsTest, DefaultIsPlySogAndSplat4d) {
  EXPECT_EQ(
      DefaultExportFormats(),
      (std::set<ExportFormat>{ExportFormat::kPly, ExportFormat::kSog, ExportFormat::kSplat4d}));
}

}  // namespace
}  // namespace color3d
