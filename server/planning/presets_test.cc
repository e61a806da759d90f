#include "server/planning/presets.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "server/planning/planner.h"
#include "server/planning/spec_check.h"

namespace color3d {
namespace {
using ::testing::ElementsAre;

constexpr SceneFacts kTwentyPhotos = {.pictures = 20, .layout = CaptureLayout::kColmap};

v1::ColorizeSceneSpec Given(v1::Preset preset) {
  v1::ColorizeSceneSpec spec;
  spec.set_preset(preset);
  return spec;
}

TEST(Presets, EachPassesTheCheckOfOptions) {
  std::vector<std::string> names;
  for (const Preset& preset : Presets()) {
    names.push_back(preset.name);
    v1::JobSpec spec;
    *spec.mutable_colorize_scene() = preset.options;
    spec.mutable_colorize_scene()->mutable_key_color()->set_automatic(true);
    EXPECT_NO_THROW(CheckSpec(spec)) << preset.name;
  }
  EXPECT_THAT(names, ElementsAre("fast", "best", "paper"));
  EXPECT_EQ(&OptionsOf(v1::PRESET_UNSPECIFIED), &OptionsOf(v1::PRESET_FAST));
}

TEST(Presets, HaveTheDocumentedPlans) {
  const v1::ColorizeSceneSpec fast = WithPreset({});
  EXPECT_EQ(fast.max_side_px(), 500);
  EXPECT_EQ(fast.personalize().iterations(), 100);
  EXPECT_EQ(fast.reconstruct_geometry().iterations(), 1500);
  EXPECT_EQ(fast.reconstruct_geometry().max_gaussians(), 40'000);
  EXPECT_EQ(fast.reconstruct_geometry().max_side_px(), 500);
  EXPECT_EQ(fast.solve_chroma().iterations(), 300);
  EXPECT_FALSE(fast.carry_color().skip());
  EXPECT_FALSE(fast.has_generate_augmentations());
  const v1::ColorizeSceneSpec best = WithPreset(Given(v1::PRESET_BEST));
  EXPECT_EQ(best.max_side_px(), 800);
  EXPECT_EQ(best.personalize().iterations(), 1200);
  EXPECT_EQ(best.personalize().min_improvement(), 0.1);
  EXPECT_EQ(best.reconstruct_geometry().iterations(), 5000);
  EXPECT_EQ(best.reconstruct_geometry().max_gaussians(), 120'000);
  EXPECT_EQ(best.solve_chroma().iterations(), 800);
  EXPECT_EQ(best.render().max_side_px(), 800);
  const v1::ColorizeSceneSpec paper = WithPreset(Given(v1::PRESET_PAPER));
  EXPECT_EQ(paper.max_side_px(), 1600);
  EXPECT_EQ(paper.personalize().iterations(), 4000);
  EXPECT_EQ(paper.reconstruct_geometry().iterations(), 30'000);
  EXPECT_EQ(paper.reconstruct_geometry().warm_up(), 0.5);
  EXPECT_EQ(paper.reconstruct_geometry().sh_degree(), 3);
  EXPECT_EQ(paper.reconstruct_geometry().densify_gradient(), 2e-4);
  EXPECT_EQ(paper.solve_chroma().solver(), v1::SolveChromaSpec::SOLVER_JOINT);
  EXPECT_EQ(paper.solve_chroma().chroma_sh_degree(), 3);
  EXPECT_TRUE(paper.carry_color().skip());
  EXPECT_EQ(paper.generate_augmentations().samples(), 8);
}

TEST(WithPreset, GivenZeroWins) {
  v1::ColorizeSceneSpec given = Given(v1::PRESET_BEST);
  given.mutable_personalize()->set_min_improvement(0.0);
  given.mutable_personalize()->set_encoder("tiny");
  given.mutable_solve_chroma()->set_iterations(0);
  given.mutable_carry_color()->set_skip(false);
  const v1::ColorizeSceneSpec merged = WithPreset(given);
  EXPECT_EQ(merged.personalize().min_improvement(), 0.0);
  EXPECT_EQ(merged.personalize().iterations(), 1200) << "its neighbours stay the preset's";
  EXPECT_EQ(merged.personalize().encoder(), "tiny");
  EXPECT_TRUE(merged.solve_chroma().has_iterations());
  EXPECT_EQ(merged.solve_chroma().iterations(), 0);
}

TEST(WithPreset, UnspecifiedEnumIsUnset) {
  v1::ColorizeSceneSpec given = Given(v1::PRESET_UNSPECIFIED);
  given.mutable_select_key_view()->set_strategy(v1::SelectKeyViewSpec::STRATEGY_UNSPECIFIED);
  given.mutable_personalize()->set_recipe(v1::PersonalizeSpec::RECIPE_UNSPECIFIED);
  const v1::ColorizeSceneSpec merged = WithPreset(given);
  EXPECT_EQ(merged.preset(), v1::PRESET_FAST);
  EXPECT_EQ(merged.select_key_view().strategy(), v1::SelectKeyViewSpec::STRATEGY_COVERAGE);
  EXPECT_EQ(merged.personalize().recipe(), v1::PersonalizeSpec::RECIPE_COLOR3D);
}

TEST(WithPreset, SizeOfAStageWinsOverThatOfTheScene) {
  v1::ColorizeSceneSpec given;
  given.set_max_side_px(640);
  given.mutable_render()->set_max_side_px(100);
  const v1::ColorizeSceneSpec merged = WithPreset(given);
  EXPECT_EQ(merged.carry_color().max_side_px(), 640);
  EXPECT_EQ(merged.reconstruct_geometry().max_side_px(), 640);
  EXPECT_EQ(merged.render().max_side_px(), 100);
}

TEST(WithPreset, PaperTrainsAtTheSizeOfTheScene) {
  v1::ColorizeSceneSpec given = Given(v1::PRESET_PAPER);
  given.set_max_side_px(640);
  EXPECT_EQ(WithPreset(given).personalize().max_side_px(), 640);
  EXPECT_EQ(WithPreset(given).generate_augmentations().max_side_px(), 640);
  given.mutable_personalize()->set_max_side_px(400);
  EXPECT_EQ(WithPreset(given).personalize().max_side_px(), 400);
  EXPECT_FALSE(WithPreset({}).personalize().has_max_side_px());
}

TEST(WithPreset, AdditionalKeyViewsAreCarriedUnlessTrainedJointly) {
  v1::ColorizeSceneSpec given = Given(v1::PRESET_PAPER);
  given.mutable_carry_color()->add_further_key_views()->set_view("a");
  EXPECT_TRUE(WithPreset(given).carry_color().skip());
  given.mutable_carry_color()->set_train_jointly(false);
  EXPECT_FALSE(WithPreset(given).carry_color().skip());
  given.set_preset(v1::PRESET_FAST);
  given.mutable_carry_color()->set_train_jointly(true);
  EXPECT_TRUE(WithPreset(given).carry_color().skip());
  given = Given(v1::PRESET_PAPER);
  given.mutable_carry_color()->set_skip(false);
  EXPECT_FALSE(WithPreset(given).carry_color().skip());
}

TEST(FillStage, ReplacesListsAndSources) {
  v1::ColorizeSceneSpec scene;
  scene.mutable_colorize_key_view()->mutable_source()->set_backend("other");
  scene.mutable_colorize_key_view()->mutable_source()->mutable_backend_input()->set_prompt("red");
  scene.mutable_colorize_key_view()->set_hint_sigma(2.0);
  scene.mutable_render()->add_views("a");
  v1::JobSpec spec;
  spec.mutable_colorize_key_view()->mutable_source()->set_automatic(true);
  FillStage(scene, &spec);
  EXPECT_TRUE(spec.colorize_key_view().source().automatic());
  EXPECT_FALSE(spec.colorize_key_view().source().has_backend_input());
  EXPECT_EQ(spec.colorize_key_view().hint_sigma(), 2.0);
  spec.mutable_render()->add_views("b");
  FillStage(scene, &spec);
  EXPECT_THAT(spec.render().views(), ElementsAre("b"));
}

TEST(FillStage, SingleStageTakesTheFastPreset) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  spec.mutable_reconstruct_geometry()->set_sh_degree(0);
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  v1::JobSpec planned;
  ASSERT_TRUE(planned.ParseFromString(graph.jobs.back().spec));
  EXPECT_EQ(planned.reconstruct_geometry().iterations(), 1500);
  EXPECT_EQ(planned.reconstruct_geometry().max_side_px(), 500);
  EXPECT_EQ(planned.reconstruct_geometry().sh_degree(), 0);
}

}  // namespace
}  // namespace color3d
