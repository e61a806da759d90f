// Stages and options of films.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/catalogue/stages.h"
#include "server/planning/planner.h"
#include "tests/support/service/planned_graphs.h"

namespace color3d {
namespace {
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Planner, FilmIsColoredNotReconstructed) {
  v1::JobSpec spec = SceneSpec();
  const SceneFacts film{.pictures = 0, .layout = CaptureLayout::kFilm};
  const NewGraph graph = PlanJob(spec, {}, film);
  for (const char* kind : {"reconstruct_geometry", "solve_chroma", "export"}) {
    EXPECT_THAT(graph.jobs[IndexOf(graph, kind)].skip_reason, HasSubstr("film")) << kind;
  }
  for (const char* kind : {"carry_color", "personalize", "colorize_views", "render", "evaluate"}) {
    EXPECT_EQ(graph.jobs[IndexOf(graph, kind)].skip_reason, "") << kind;
  }
  EXPECT_THAT(InputKinds(graph, "carry_color"),
              ElementsAre("import_scene", "select_key_view", "colorize_key_view"));
  EXPECT_THAT(InputKinds(graph, "render"), Contains("colorize_views"));
  EXPECT_THAT(InputKinds(graph, "render"), Not(Contains("solve_chroma")));
  v1::JobSpec with_poses = spec;
  with_poses.mutable_colorize_scene()->mutable_import_scene()->set_film_poses(
      v1::ImportSceneSpec::FILM_POSES_AUTO);
  const NewGraph decided_later = PlanJob(with_poses, {}, film);
  for (const char* kind : {"reconstruct_geometry", "solve_chroma", "export"}) {
    EXPECT_EQ(decided_later.jobs[IndexOf(decided_later, kind)].skip_reason, "") << kind;
  }
  spec.mutable_colorize_scene()->mutable_correct_colors()->add_corrections()->set_view("a");
  const auto refused = [&] { PlanJob(spec, {}, film); };
  EXPECT_THROW(refused(), Error);
}

TEST(Planner, TrainsAtTheSizeOfFrames) {
  v1::JobSpec spec = SceneSpec();
  const auto size = [&](bool is_film) {
    const NewGraph graph =
        PlanJob(spec, {}, {.layout = is_film ? CaptureLayout::kFilm : CaptureLayout::kPhotos});
    return SpecOf(graph, "personalize").personalize().max_side_px();
  };
  EXPECT_EQ(size(true), 500);
  EXPECT_EQ(size(false), 0) << "photos: its own";
  spec.mutable_colorize_scene()->set_max_side_px(1200);
  EXPECT_EQ(size(true), 800);
  spec.mutable_colorize_scene()->mutable_personalize()->set_max_side_px(320);
  EXPECT_EQ(size(true), 320);
  spec.mutable_colorize_scene()->clear_personalize();
  spec.mutable_colorize_scene()->set_preset(v1::PRESET_PAPER);
  EXPECT_EQ(size(true), 1200) << "the paper's: that of the scene";
  EXPECT_EQ(size(false), 1200);
}

// As `color3d key accept` leaves it for `colorize --scene`.
JobRecord GivenImport(const v1::ImportSceneSpec& options) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  *spec.mutable_import_scene() = options;
  JobRecord import;
  import.name = "jobs/i";
  import.kind = kind::kImportScene;
  import.scene = spec.scene();
  import.spec = spec.SerializeAsString();
  import.state = JobState::kSucceeded;
  return import;
}

TEST(Planner, TakesFilmPosesFromTheInputImport) {
  const SceneFacts film{.pictures = 0, .layout = CaptureLayout::kFilm};
  v1::JobSpec spec = SceneSpec();
  v1::ImportSceneSpec options;
  const NewGraph colored = PlanJob(spec, {GivenImport(options)}, film);
  options.set_film_poses(v1::ImportSceneSpec::FILM_POSES_AUTO);
  const NewGraph with_poses = PlanJob(spec, {GivenImport(options)}, film);
  for (const char* kind : {"reconstruct_geometry", "solve_chroma", "export"}) {
    EXPECT_THAT(colored.jobs[IndexOf(colored, kind)].skip_reason, HasSubstr("film")) << kind;
    EXPECT_EQ(with_poses.jobs[IndexOf(with_poses, kind)].skip_reason, "") << kind;
  }
  v1::FurtherKeyView* key =
      spec.mutable_colorize_scene()->mutable_carry_color()->add_further_key_views();
  key->set_view("a");
  *key->mutable_color() = spec.colorize_scene().key_color();
  key->set_begin_s(1.0);
  EXPECT_NO_THROW(PlanJob(spec, {GivenImport({})}, film));
  EXPECT_THROW(PlanJob(spec, {GivenImport(options)}, film), Error) << "a range of time";
}

TEST(Planner, KeyViewWithRangeIsACorrection) {
  const SceneFacts film{.pictures = 0, .layout = CaptureLayout::kFilm};
  v1::JobSpec spec = SceneSpec();
  v1::ColorizeSceneSpec* scene = spec.mutable_colorize_scene();
  scene->set_preset(v1::PRESET_PAPER);  // carries no colour
  const NewGraph without = PlanJob(spec, {}, film);
  v1::FurtherKeyView* key = scene->mutable_carry_color()->add_further_key_views();
  key->set_view("a");
  *key->mutable_color() = scene->key_color();
  key->set_begin_s(10.0);
  key->set_end_s(14.5);
  const NewGraph with = PlanJob(spec, {}, film);
  const v1::JobSpec correct = SpecOf(with, "correct_colors");
  ASSERT_EQ(correct.correct_colors().corrections_size(), 1);
  EXPECT_FALSE(correct.correct_colors().corrections(0).has_color());
  EXPECT_EQ(with.jobs.size(), without.jobs.size() + 1) << "its colours are a job's";
  EXPECT_EQ(correct.correct_colors().corrections(0).end_s(), 14.5);
  EXPECT_EQ(with.jobs[IndexOf(with, "correct_colors")].skip_reason, "");
  EXPECT_THAT(InputKinds(with, "render"), Contains("correct_colors"));
  for (const char* kind : {"carry_color", "personalize", "colorize_views"}) {
    const NewJob &one = without.jobs[IndexOf(without, kind)],
                 &other = with.jobs[IndexOf(with, kind)];
    EXPECT_EQ(one.spec, other.spec) << kind;
    EXPECT_EQ(one.skip_reason, other.skip_reason) << kind;
  }

  const auto complaint = [&](const SceneFacts& facts) {
    try {
      PlanJob(spec, {}, facts);
    } catch (const Error& e) {
      return std::string(e.what());
    }
    return std::string("nothing");
  };
  EXPECT_THAT(complaint(kTwentyPhotos), HasSubstr("a has a range of time"));
  scene->mutable_import_scene()->set_film_poses(v1::ImportSceneSpec::FILM_POSES_AUTO);
  EXPECT_THAT(complaint(film), HasSubstr("or import the film without import_scene.film_poses"));
  scene->clear_import_scene();
  key->set_begin_s(15.0);
  EXPECT_THAT(complaint(film),
              HasSubstr("carry_color.further_key_views[0].end_s is 14.5, before begin_s, 15"));
  key->clear_begin_s();
  v1::JobSpec alone;
  alone.set_scene("scenes/test");
  *alone.mutable_carry_color() = scene->carry_color();
  EXPECT_THAT(PlanError(alone).message, HasSubstr("belongs to correct_colors"));
}

}  // namespace
}  // namespace color3d
