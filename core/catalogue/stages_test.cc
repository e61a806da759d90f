#include "core/catalogue/stages.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "core/base/error.h"
#include "core/catalogue/artifacts.h"

namespace color3d {
namespace {

TEST(StageCatalogueTest, EarlierStagesWriteEveryInput) {
  std::set<std::string_view> made;
  for (const Stage& stage : StageCatalogue()) {
    for (const auto* list : {&stage.needs, &stage.reads}) {
      for (const char* name : *list) {
        const bool of_an_earlier_job = stage.kind == std::string_view(kind::kSelectKeyView) &&
                                       name == std::string_view(artifact::kGeometry);
        EXPECT_TRUE(made.contains(name) || of_an_earlier_job) << stage.kind << " reads " << name;
      }
    }
    made.insert(stage.outputs.begin(), stage.outputs.end());
  }
}

TEST(StageCatalogueTest, EveryArtifactHasOneWriter) {
  std::set<std::string_view> made;
  for (const Stage& stage : StageCatalogue()) {
    for (const char* name : stage.outputs) EXPECT_TRUE(made.insert(name).second) << name;
  }
}

TEST(StageCatalogueTest, ResultsAreOutputsOfTheirStage) {
  for (const Stage& stage : StageCatalogue()) {
    const std::set<std::string_view> made(stage.outputs.begin(), stage.outputs.end());
    for (const char* name : stage.results) EXPECT_TRUE(made.contains(name)) << name;
  }
}

TEST(StageCatalogueTest, FindsWriterByNameAndFolder) {
  EXPECT_STREQ(FindProducer(artifact::kModel)->kind, kind::kSolveChroma);
  EXPECT_STREQ(FindProducer(std::string(artifact::kViewsAb) + "0001.png")->kind,
               kind::kColorizeViews);
  EXPECT_STREQ(FindProducer(artifact::kKeyViewColored)->kind, kind::kColorizeKeyView);
  EXPECT_EQ(FindProducer("nothing.txt"), nullptr);
}

TEST(StageCatalogueTest, FindsOrRefusesKinds) {
  EXPECT_STREQ(StageOf(kind::kPersonalize).kind, kind::kPersonalize);
  EXPECT_EQ(FindStage("colour"), nullptr);
  EXPECT_THROW(StageOf("colour"), Error);
}

}  // namespace
}  // namespace color3d
