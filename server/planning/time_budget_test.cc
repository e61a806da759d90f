#include "server/planning/time_budget.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/catalogue/stages.h"
#include "proto/option_text.h"
#include "server/planning/job_spec.h"
#include "server/planning/spec_check.h"
#include "tests/support/service/planned_graphs.h"

namespace color3d {
namespace {
using ::testing::HasSubstr;

TEST(Planner, DividesTheTimeBudget) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(90);
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  const double geometry =
      SpecOf(graph, "reconstruct_geometry").reconstruct_geometry().time_limit_seconds();
  const double personalize = SpecOf(graph, "personalize").personalize().time_limit_seconds();
  const double chroma = SpecOf(graph, "solve_chroma").solve_chroma().time_limit_seconds();
  EXPECT_GT(geometry, 5.0);
  EXPECT_GT(personalize, geometry);
  EXPECT_GT(chroma, 1.0);
  EXPECT_NEAR(geometry + personalize + chroma + FixedSeconds(kTwentyPhotos), 90.0, 1e-6);
}

TEST(Planner, GeometryOfASplatTakesNoTime) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(90);
  const SceneFacts splat = {.layout = CaptureLayout::kSplat};
  const NewGraph graph = PlanJob(spec, {}, splat);
  const double personalize = SpecOf(graph, "personalize").personalize().time_limit_seconds();
  const double chroma = SpecOf(graph, "solve_chroma").solve_chroma().time_limit_seconds();
  EXPECT_NEAR(personalize + chroma + FixedSeconds(splat), 90.0, 1e-6);
}

TEST(Planner, BudgetsAllViewsOfASplat) {
  const SceneFacts splat = {.layout = CaptureLayout::kSplat};
  const SceneFacts photos = {.pictures = 200, .layout = CaptureLayout::kColmap};
  v1::ImportSceneSpec import;
  EXPECT_EQ(FixedSeconds(splat, import),
            FixedSeconds({.pictures = 24, .layout = CaptureLayout::kColmap}));
  import.set_splat_views(200);
  EXPECT_EQ(FixedSeconds(splat, import), FixedSeconds(photos));
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(90);
  *spec.mutable_colorize_scene()->mutable_import_scene() = import;
  EXPECT_THROW(PlanJob(spec, {}, splat), Error) << "200 views take more than 90 s";
}

TEST(Planner, DefaultSplatViewsAreThoseOfTheApi) {
  const auto* field = v1::ImportSceneSpec::descriptor()->FindFieldByName("splat_views");
  EXPECT_EQ(InfoOf(field).default_value(), std::to_string(kSplatViews));
}

double PersonalizeSeconds(const v1::JobSpec& spec, const SceneFacts& facts) {
  return SpecOf(PlanJob(spec, {}, facts), "personalize").personalize().time_limit_seconds();
}

TEST(Planner, BudgetOfAFilmGoesToPersonalization) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(120);
  const SceneFacts film = {.pictures = 65, .layout = CaptureLayout::kFilm};
  EXPECT_NEAR(FixedSeconds(film), 27.0, 1.0);
  EXPECT_NEAR(PersonalizeSeconds(spec, film) + FixedSeconds(film), 120.0, 1e-6);
  v1::ImportSceneSpec* import = spec.mutable_colorize_scene()->mutable_import_scene();
  import->set_film_poses(v1::ImportSceneSpec::FILM_POSES_AUTO);
  const NewGraph graph = PlanJob(spec, {}, film);
  const double geometry =
      SpecOf(graph, "reconstruct_geometry").reconstruct_geometry().time_limit_seconds();
  EXPECT_GT(FixedSeconds(film, *import), FixedSeconds(film) + 30.0);
  EXPECT_NEAR(geometry, 0.25 * (120.0 - FixedSeconds(film, *import)), 1e-6);
}

TEST(Planner, UnusedFramesTakeNoTime) {
  const SceneFacts film = {.pictures = 3000, .layout = CaptureLayout::kFilm};
  const auto same_as = [&](int frames, const v1::ImportSceneSpec& import) {
    EXPECT_NEAR(FixedSeconds(film, import),
                FixedSeconds({.pictures = frames, .layout = CaptureLayout::kFilm}),
                1e-6);
  };
  v1::ImportSceneSpec import;
  import.set_film_stride(7);
  same_as(429, import);
  import.set_film_begin_s(10.0);  // of pictures that are shown at 25 a second
  import.set_film_end_s(20.0);
  same_as(36, import);
  import.set_film_frames_per_second(16);
  same_as(23, import);
  import.set_film_begin_s(1e6);
  import.clear_film_end_s();
  same_as(0, import);
  import.Clear();
  import.set_film_stride(7);
  const auto seconds = [&](int frames, const v1::ImportSceneSpec& with) {
    return FixedSeconds({.pictures = frames, .layout = CaptureLayout::kFilms}, with);
  };
  EXPECT_NEAR(seconds(3000, import), seconds(429, {}), 1e-6) << "of several cameras";
}

TEST(Planner, BudgetsFilmsOfUnknownLength) {
  const SceneFacts video = {.pictures = 0, .layout = CaptureLayout::kFilm};
  const SceneFacts rig = {.layout = CaptureLayout::kTransforms};
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(30);
  for (const SceneFacts& facts : {video, rig}) {
    const double seconds = PersonalizeSeconds(spec, facts);
    EXPECT_GT(seconds, 10.0);
    EXPECT_LT(seconds, 20.0) << "some is left for the frames";
  }
}

TEST(Planner, RefusalOfAFilmSpeaksOfFrames) {
  const auto complaint = [](double seconds, const SceneFacts& facts) {
    v1::JobSpec spec = SceneSpec();
    spec.mutable_colorize_scene()->set_time_budget_seconds(seconds);
    try {
      PlanJob(spec, {}, facts);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("nothing");
  };
  EXPECT_THAT(complaint(40, {.pictures = 65, .layout = CaptureLayout::kFilm}),
              HasSubstr("65 frames take about 28 s in stages that cannot be shortened; give at "
                        "least 43 s, or fewer frames (film_stride"));
  EXPECT_THAT(complaint(12, {.pictures = 0, .layout = CaptureLayout::kFilm}),
              HasSubstr("a film takes, without its frames, about 6 s"));
}

TEST(Planner, SharesStayWithinTheLimitOfAStage) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(604'800);
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  for (const char* kind : {"reconstruct_geometry", "personalize", "solve_chroma"}) {
    EXPECT_NO_THROW(CheckSpec(SpecOf(graph, kind))) << kind;
  }
}

TEST(Planner, StagesWithATimeLimitGetAShare) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(90);
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  for (const Stage& stage : StageCatalogue()) {
    if (std::string_view(stage.kind) == kind::kPersonalizeScenes) continue;
    v1::JobSpec planned = SpecOf(graph, stage.kind);
    const google::protobuf::Message* options = MutableStage(&planned, stage.kind);
    const auto* limit = options->GetDescriptor()->FindFieldByName("time_limit_seconds");
    const bool limited = limit != nullptr && options->GetReflection()->HasField(*options, limit);
    EXPECT_EQ(limited, stage.keeps_time_limit) << stage.kind;
  }
}

TEST(Planner, TimeLimitOfAStageWins) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(90);
  spec.mutable_colorize_scene()->mutable_reconstruct_geometry()->set_time_limit_seconds(3);
  EXPECT_EQ(SpecOf(PlanJob(spec, {}, kTwentyPhotos), "reconstruct_geometry")
                .reconstruct_geometry()
                .time_limit_seconds(),
            3.0);
}

TEST(Planner, RefusesATooShortBudget) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_time_budget_seconds(20);
  const Thrown thrown = PlanError(spec);
  EXPECT_EQ(thrown.code, ErrorCode::kInvalidArgument);
  EXPECT_EQ(thrown.reason, "BAD_OPTION");
  EXPECT_THAT(thrown.message, HasSubstr("20 photos"));
  EXPECT_THAT(thrown.message, HasSubstr("at least"));
}

}  // namespace
}  // namespace color3d
