#include "core/catalogue/artifacts.h"

#include <gtest/gtest.h>

#include <fstream>
#include <iterator>
#include <regex>
#include <set>
#include <string>

#include "core/catalogue/stages.h"

namespace color3d {
namespace {

// The constants of a namespace cannot be listed in C++: read from the header.
std::set<std::string> NamesInHeader() {
  std::ifstream in(COLOR3D_ARTIFACTS_HEADER);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const std::regex constant("inline constexpr char k[A-Za-z0-9]+\\[\\] = \"([^\"]+)\";");
  std::set<std::string> names;
  for (std::sregex_iterator i(text.begin(), text.end(), constant), end; i != end; ++i) {
    names.insert((*i)[1]);
  }
  return names;
}

TEST(ArtifactCatalogueTest, EveryNameHasARow) {
  const std::set<std::string> names = NamesInHeader();
  EXPECT_GT(names.size(), 40u);
  for (const std::string& name : names) EXPECT_NE(FindArtifact(name), nullptr) << name;
}

TEST(ArtifactCatalogueTest, EveryRowHasAStageAndAMediaType) {
  std::set<std::string> names;
  for (const Artifact& artifact : ArtifactCatalogue()) {
    EXPECT_TRUE(names.insert(artifact.name).second) << artifact.name;
    EXPECT_NE(std::string_view(artifact.media_type).find('/'), std::string_view::npos);
    if (artifact.stage != nullptr) {
      EXPECT_NE(FindStage(artifact.stage), nullptr) << artifact.name;
    }
    EXPECT_TRUE(artifact.label == nullptr || artifact.is_result) << artifact.name;
  }
}

TEST(ArtifactCatalogueTest, FilesHaveTheMediaTypeOfTheirFolder) {
  EXPECT_STREQ(MediaTypeOf("report.html"), "text/html");
  EXPECT_STREQ(MediaTypeOf("renders/a/0001.png"), "image/png");
  EXPECT_STREQ(MediaTypeOf("truths/0001.jpg"), "image/jpeg");
  EXPECT_STREQ(MediaTypeOf("curves/personalize.csv"), "text/csv");
  EXPECT_STREQ(MediaTypeOf("sfm.log"), "text/plain");
  EXPECT_STREQ(MediaTypeOf("film.mp4"), "video/mp4");
  EXPECT_STREQ(MediaTypeOf("model.c3g"), "application/octet-stream");
  EXPECT_STREQ(MediaTypeOf("nothing.txt"), "application/octet-stream");
}

}  // namespace
}  // namespace color3d
