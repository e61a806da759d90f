#include "server/planning/planner.h"

#include <gmock/gmock.h>
#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "core/catalogue/stages.h"
#include "server/planning/job_spec.h"
#include "server/planning/presets.h"
#include "server/planning/spec_check.h"
#include "tests/support/service/planned_graphs.h"

namespace color3d {
namespace {
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(Planner, ColorizeSceneExpandsToTheWholeGraph) {
  const NewGraph graph = PlanJob(SceneSpec(), {}, kTwentyPhotos);
  ASSERT_EQ(graph.jobs.size(), 14u);
  EXPECT_EQ(graph.jobs.back().kind, "colorize_scene");
  EXPECT_EQ(graph.jobs.back().inputs.size(), 13u);
  EXPECT_THAT(InputKinds(graph, "select_key_view"), ElementsAre("import_scene"));
  EXPECT_THAT(InputKinds(graph, "reconstruct_geometry"), ElementsAre("import_scene"));
  EXPECT_THAT(InputKinds(graph, "personalize"),
              ElementsAre("import_scene",
                          "select_key_view",
                          "colorize_key_view",
                          "carry_color",
                          "reconstruct_geometry"));
  EXPECT_THAT(
      InputKinds(graph, "carry_color"),
      ElementsAre("import_scene", "select_key_view", "colorize_key_view", "reconstruct_geometry"));
  EXPECT_THAT(InputKinds(graph, "colorize_views"),
              ElementsAre("import_scene",
                          "personalize",
                          "carry_color",
                          "reconstruct_geometry",
                          "select_key_view",
                          "colorize_key_view"));
  EXPECT_THAT(InputKinds(graph, "solve_chroma"),
              ElementsAre("import_scene",
                          "select_key_view",
                          "colorize_key_view",
                          "colorize_views",
                          "reconstruct_geometry"));
  EXPECT_THAT(InputKinds(graph, "export"),
              ElementsAre("import_scene", "solve_chroma", "select_key_view"));
  for (const NewJob& job : graph.jobs) {
    const int index = IndexOf(graph, job.kind);
    for (const int input : job.inputs) EXPECT_LT(input, index);
  }
  EXPECT_EQ(graph.jobs[IndexOf(graph, "evaluate")].skip_reason, "") << "views are compared anyway";
  EXPECT_EQ(graph.jobs[IndexOf(graph, "render")].skip_reason, "");
  EXPECT_THAT(graph.jobs.back().blobs, ElementsAre(Sha256Hex("key")));
  EXPECT_EQ(SpecOf(graph, "colorize_key_view").colorize_key_view().source().image().sha256(),
            Sha256Hex("key"));
}

TEST(Planner, CorrectionsPrecedeChroma) {
  const NewGraph without = PlanJob(SceneSpec(), {}, kTwentyPhotos);
  EXPECT_THAT(without.jobs[IndexOf(without, "correct_colors")].skip_reason,
              HasSubstr("no corrections were given"));

  v1::JobSpec spec = SceneSpec();
  v1::CorrectColorsSpec* correct = spec.mutable_colorize_scene()->mutable_correct_colors();
  const NewGraph proposes = PlanJob(spec, {}, kTwentyPhotos);
  EXPECT_EQ(proposes.jobs[IndexOf(proposes, "correct_colors")].skip_reason, "");
  EXPECT_THAT(InputKinds(proposes, "solve_chroma"), Not(Contains("correct_colors")));

  v1::FurtherKeyView* stroke = correct->add_corrections();
  stroke->set_view("a");
  *stroke->mutable_color() = spec.colorize_scene().key_color();
  const NewGraph corrects = PlanJob(spec, {}, kTwentyPhotos);
  EXPECT_THAT(InputKinds(corrects, "correct_colors"), Contains("colorize_views"));
  EXPECT_THAT(InputKinds(corrects, "solve_chroma"), Contains("correct_colors"));
  EXPECT_THAT(InputKinds(corrects, "evaluate"), Contains("correct_colors"));
  stroke->mutable_color()->set_automatic(true);
  EXPECT_THROW(PlanJob(spec, {}, kTwentyPhotos), Error);
}

TEST(Planner, BaselinesSkipStagesThatTheyDoNotUse) {
  v1::JobSpec spec = SceneSpec();
  v1::ColorizeSceneSpec* scene = spec.mutable_colorize_scene();
  const auto reason = [&](const char* kind) {
    const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
    return graph.jobs[IndexOf(graph, kind)].skip_reason;
  };
  EXPECT_EQ(reason("personalize"), "");
  EXPECT_EQ(reason("carry_color"), "");
  scene->mutable_colorize_views()->set_method(v1::ColorizeViewsSpec::METHOD_FLOW);
  EXPECT_THAT(reason("personalize"), HasSubstr("METHOD_FLOW, which uses no colorizer"));
  EXPECT_THAT(reason("carry_color"), HasSubstr("METHOD_FLOW, which uses no carried colours"));
  EXPECT_THAT(InputKinds(PlanJob(spec, {}, kTwentyPhotos), "colorize_views"),
              Not(Contains("personalize")));
  scene->mutable_colorize_views()->set_method(v1::ColorizeViewsSpec::METHOD_CARRIED);
  EXPECT_THAT(reason("personalize"), HasSubstr("uses no colorizer"));
  EXPECT_EQ(reason("carry_color"), "");
  EXPECT_EQ(SpecOf(PlanJob(spec, {}, kTwentyPhotos), "colorize_views").colorize_views().method(),
            v1::ColorizeViewsSpec::METHOD_CARRIED);
  scene->mutable_colorize_views()->set_method(v1::ColorizeViewsSpec::METHOD_GRAY);
  scene->mutable_correct_colors();
  EXPECT_EQ(reason("personalize"), "") << "corrections use it";
}

TEST(Planner, AdditionalKeyViewsOfBaselinesAreCarried) {
  v1::JobSpec spec = SceneSpec();
  v1::ColorizeSceneSpec* scene = spec.mutable_colorize_scene();
  scene->mutable_colorize_views()->set_method(v1::ColorizeViewsSpec::METHOD_FLOW);
  v1::FurtherKeyView* key = scene->mutable_carry_color()->add_further_key_views();
  key->set_view("a");
  *key->mutable_color() = scene->key_color();
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  EXPECT_EQ(graph.jobs[IndexOf(graph, "carry_color")].skip_reason, "");
}

TEST(Planner, RefusesMethodsWithoutTheirInput) {
  v1::JobSpec spec = SceneSpec();
  v1::ColorizeSceneSpec* scene = spec.mutable_colorize_scene();
  scene->mutable_colorize_views()->set_method(v1::ColorizeViewsSpec::METHOD_CARRIED);
  scene->mutable_carry_color()->set_skip(true);
  EXPECT_THAT(PlanError(spec).message, HasSubstr("METHOD_CARRIED, but no colours are carried"));
  scene->mutable_colorize_views()->set_method(v1::ColorizeViewsSpec::METHOD_DECODER);
  scene->mutable_personalize()->set_iterations(0);
  EXPECT_THAT(PlanError(spec).message, HasSubstr("personalize.iterations is 0"));
  scene->mutable_colorize_views()->set_method(v1::ColorizeViewsSpec::METHOD_NEAREST_NEIGHBORS);
  EXPECT_NO_THROW(PlanJob(spec, {}, kTwentyPhotos));
  scene->mutable_personalize()->set_recipe(v1::PersonalizeSpec::RECIPE_PAPER);
  EXPECT_THAT(PlanError(spec).message, HasSubstr("the colorizer has no neighbours"));
  scene->mutable_colorize_views()->clear_method();
  scene->mutable_colorize_views()->set_encoder("tiny");
  EXPECT_THAT(PlanError(spec).message, HasSubstr("name it in personalize.encoder"));
}

TEST(Planner, MethodDecoderAlwaysTrainsDecoder) {
  for (const auto layout : {CaptureLayout::kColmap, CaptureLayout::kFilm}) {
    const SceneFacts facts{.pictures = 20, .layout = layout};
    v1::JobSpec spec = SceneSpec();
    spec.mutable_colorize_scene()->mutable_personalize()->set_min_decoder_share(0.5);
    EXPECT_EQ(SpecOf(PlanJob(spec, {}, facts), "personalize").personalize().min_decoder_share(),
              0.5);
    spec.mutable_colorize_scene()->mutable_colorize_views()->set_method(
        v1::ColorizeViewsSpec::METHOD_DECODER);
    EXPECT_EQ(SpecOf(PlanJob(spec, {}, facts), "personalize").personalize().min_decoder_share(),
              0.0);
  }
}

TEST(Planner, ExplicitFieldsWinOverThePreset) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_preset(v1::PRESET_PAPER);
  spec.mutable_colorize_scene()->mutable_personalize()->set_iterations(7);
  NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  const v1::ColorizeSceneSpec& paper = OptionsOf(v1::PRESET_PAPER);
  EXPECT_EQ(SpecOf(graph, "personalize").personalize().iterations(), 7);
  EXPECT_EQ(SpecOf(graph, "personalize").personalize().recipe(), v1::PersonalizeSpec::RECIPE_PAPER);
  EXPECT_TRUE(SpecOf(graph, "personalize").personalize().has_min_improvement());
  EXPECT_EQ(SpecOf(graph, "personalize").personalize().min_improvement(), 0.0)
      << "the paper's schedule runs to its end";
  EXPECT_EQ(SpecOf(graph, "select_key_view").select_key_view().strategy(),
            v1::SelectKeyViewSpec::STRATEGY_ENTROPY);
  EXPECT_EQ(SpecOf(graph, "reconstruct_geometry").reconstruct_geometry().max_gaussians(),
            paper.reconstruct_geometry().max_gaussians());
  EXPECT_EQ(SpecOf(graph, "render").render().max_side_px(), paper.max_side_px());
  spec.mutable_colorize_scene()->mutable_personalize()->set_min_improvement(0.25);
  graph = PlanJob(spec, {}, kTwentyPhotos);
  EXPECT_EQ(SpecOf(graph, "personalize").personalize().min_improvement(), 0.25);
  spec.mutable_colorize_scene()->set_max_side_px(333);
  graph = PlanJob(spec, {}, kTwentyPhotos);
  EXPECT_EQ(SpecOf(graph, "reconstruct_geometry").reconstruct_geometry().max_side_px(), 333);
  EXPECT_EQ(SpecOf(graph, "colorize_views").colorize_views().max_side_px(), 333);
  EXPECT_EQ(SpecOf(graph, "colorize_views").seed(), 1u);
}

TEST(Planner, KeyViewMakesTheSelectionManual) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->set_key_view("a.jpg");
  const v1::JobSpec select = SpecOf(PlanJob(spec, {}, kTwentyPhotos), "select_key_view");
  EXPECT_EQ(select.select_key_view().strategy(), v1::SelectKeyViewSpec::STRATEGY_MANUAL);
  EXPECT_EQ(select.select_key_view().view(), "a.jpg");
}

TEST(Planner, TruthGoesToEvaluation) {
  v1::JobSpec spec = SceneSpec();
  v1::TruthImage* truth = spec.mutable_colorize_scene()->add_truth();
  truth->set_view("b.jpg");
  *truth->mutable_image() = SomeDigest("truth");
  truth = spec.mutable_colorize_scene()->add_training_truth();
  truth->set_view("c.jpg");
  *truth->mutable_image() = SomeDigest("training truth");
  const NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  EXPECT_EQ(SpecOf(graph, "evaluate").evaluate().truth(0).view(), "b.jpg");
  EXPECT_EQ(SpecOf(graph, "evaluate").evaluate().training_truth(0).view(), "c.jpg");
  EXPECT_EQ(graph.jobs.back().blobs.size(), 3u);
}

TEST(Planner, SingleStagesBringPrerequisites) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  *spec.mutable_colorize_key_view()->mutable_source()->mutable_image() = SomeDigest("key");
  NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  ASSERT_EQ(graph.jobs.size(), 3u);
  EXPECT_EQ(graph.jobs.back().kind, "colorize_key_view");
  EXPECT_EQ(graph.jobs.back().inputs.size(), 2u);
  JobRecord import;
  import.name = "jobs/i";
  import.kind = "import_scene";
  import.scene = "scenes/test";
  import.state = JobState::kRunning;
  graph = PlanJob(spec, {import}, kTwentyPhotos);
  ASSERT_EQ(graph.jobs.size(), 2u);
  EXPECT_THAT(graph.jobs[0].input_jobs, ElementsAre("jobs/i"));
  EXPECT_THAT(graph.jobs[1].input_jobs, ElementsAre("jobs/i"));
}

TEST(Planner, OtherStagesNameTheMissingInput) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  spec.mutable_solve_chroma();
  std::vector<JobRecord> inputs;
  for (const char* kind :
       {"import_scene", "select_key_view", "colorize_key_view", "colorize_views"}) {
    JobRecord input;
    input.name = std::string("jobs/") + kind;
    input.kind = kind;
    input.scene = "scenes/test";
    input.state = JobState::kSucceeded;
    inputs.push_back(input);
  }
  Thrown error = PlanError(spec, inputs);
  EXPECT_EQ(error.code, ErrorCode::kFailedPrecondition);
  EXPECT_THAT(error.message, HasSubstr("geometry.c3g"));
  EXPECT_THAT(error.message, HasSubstr("reconstruct_geometry"));
  inputs.push_back(inputs[0]);
  inputs.back().kind = "reconstruct_geometry";
  inputs.back().name = "jobs/g";
  const NewGraph graph = PlanJob(spec, inputs, kTwentyPhotos);
  ASSERT_EQ(graph.jobs.size(), 1u);
  EXPECT_EQ(graph.jobs[0].input_jobs.size(), 5u);
  inputs.back().state = JobState::kFailed;
  EXPECT_EQ(PlanError(spec, inputs).reason, "INPUT_MISSING");
  inputs.back().state = JobState::kSucceeded;
  inputs.push_back(inputs.back());
  inputs.back().name = "jobs/g2";
  EXPECT_EQ(PlanError(spec, inputs).code, ErrorCode::kInvalidArgument) << "two geometries";
  inputs.pop_back();
  inputs[0].scene = "scenes/other";
  EXPECT_THAT(PlanError(spec, inputs).message, HasSubstr("scenes/other"));
}

TEST(Planner, SkipsAugmentationsUnlessRequested) {
  v1::JobSpec spec = SceneSpec();
  NewGraph graph = PlanJob(spec, {}, kTwentyPhotos);
  EXPECT_THAT(graph.jobs[IndexOf(graph, "generate_augmentations")].skip_reason,
              HasSubstr("key view alone"));
  EXPECT_THAT(InputKinds(graph, "personalize"), Not(Contains("generate_augmentations")));

  SceneFacts with_files = kTwentyPhotos;
  with_files.augment_files = 2;
  graph = PlanJob(spec, {}, with_files);
  EXPECT_THAT(graph.jobs[IndexOf(graph, "generate_augmentations")].skip_reason,
              HasSubstr("2 files, which are used if generate_augmentations.files"))
      << "not requested";
  EXPECT_THAT(InputKinds(graph, "personalize"), Not(Contains("generate_augmentations")));

  spec.mutable_colorize_scene()->mutable_generate_augmentations()->set_files(true);
  graph = PlanJob(spec, {}, with_files);
  EXPECT_EQ(graph.jobs[IndexOf(graph, "generate_augmentations")].skip_reason, "");
  EXPECT_EQ(SpecOf(graph, "generate_augmentations").generate_augmentations().samples(), 0)
      << "only the user's own";
  EXPECT_THAT(InputKinds(graph, "personalize"), Contains("generate_augmentations"));
  EXPECT_THAT(PlanError(spec).message, HasSubstr("no pictures in augment/"));

  spec.mutable_colorize_scene()->mutable_generate_augmentations()->set_files(false);
  graph = PlanJob(spec, {}, kTwentyPhotos);
  EXPECT_EQ(graph.jobs[IndexOf(graph, "generate_augmentations")].skip_reason, "");
  EXPECT_EQ(SpecOf(graph, "generate_augmentations").generate_augmentations().samples(), 8);
  EXPECT_FALSE(SpecOf(graph, "generate_augmentations").generate_augmentations().files());
  EXPECT_THAT(InputKinds(graph, "generate_augmentations"), Contains("reconstruct_geometry"));

  spec.mutable_colorize_scene()->mutable_generate_augmentations()->set_samples(0);
  graph = PlanJob(spec, {}, kTwentyPhotos);
  EXPECT_THAT(graph.jobs[IndexOf(graph, "generate_augmentations")].skip_reason,
              HasSubstr("no samples"));

  spec = SceneSpec();
  spec.mutable_colorize_scene()->set_preset(v1::PRESET_PAPER);
  graph = PlanJob(spec, {}, kTwentyPhotos);
  EXPECT_EQ(graph.jobs[IndexOf(graph, "generate_augmentations")].skip_reason, "");
  EXPECT_EQ(SpecOf(graph, "generate_augmentations").generate_augmentations().samples(), 8);
}

TEST(Planner, RefusesToSelectSeveralKeyViews) {
  v1::JobSpec spec = SceneSpec();
  spec.mutable_colorize_scene()->mutable_select_key_view()->set_count(3);
  EXPECT_THAT(PlanError(spec).message, HasSubstr("further_key_views"));
  EXPECT_EQ(PlanError(spec).code, ErrorCode::kInvalidArgument);
  v1::JobSpec select;
  select.set_scene("scenes/test");
  select.mutable_select_key_view()->set_count(3);
  EXPECT_EQ(PlanError(select).message, "");
  select.mutable_select_key_view()->set_count(18);
  EXPECT_THAT(PlanError(select).message, HasSubstr("1 to 17"));
}

TEST(Planner, AugmentationOptionsAreChecked) {
  v1::JobSpec spec = SceneSpec();
  auto* options = spec.mutable_colorize_scene()->mutable_generate_augmentations();
  options->add_kinds(static_cast<v1::GenerateAugmentationsSpec::Kind>(9));
  EXPECT_THAT(PlanError(spec).message, HasSubstr("colorize_scene.generate_augmentations.kinds[0]"));
  options->clear_kinds();
  options->add_kinds(v1::GenerateAugmentationsSpec::KIND_UNSPECIFIED);
  EXPECT_THAT(PlanError(spec).message, HasSubstr("unspecified"));
  options->clear_kinds();
  options->set_samples(65);
  EXPECT_THAT(PlanError(spec).message, HasSubstr("0 to 64"));
}

TEST(Planner, KeyColorIsRequired) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  spec.mutable_colorize_scene();
  EXPECT_EQ(PlanError(spec).code, ErrorCode::kInvalidArgument);
  EXPECT_THAT(PlanError(spec).message, HasSubstr("key_color is required"));
  EXPECT_THAT(PlanError(spec).message, HasSubstr("select_key_view"));
  EXPECT_THAT(PlanError(v1::JobSpec()).message, HasSubstr("no stage"));
}

TEST(Planner, BadOptionsNameFieldValueAndRange) {
  const auto message = [](auto&& change) {
    v1::JobSpec spec = SceneSpec();
    change(spec.mutable_colorize_scene());
    const Thrown error = PlanError(spec);
    EXPECT_EQ(error.code, ErrorCode::kInvalidArgument);
    return error.message;
  };
  EXPECT_EQ(message([](auto* s) { s->set_preset(static_cast<v1::Preset>(99)); }),
            "colorize_scene.preset is 99, which is none of PRESET_FAST, PRESET_BEST, PRESET_PAPER");
  EXPECT_EQ(message([](auto* s) { s->set_max_side_px(-5); }),
            "colorize_scene.max_side_px is -5; the range is 64 to 4096");
  EXPECT_THAT(message([](auto* s) { s->mutable_reconstruct_geometry()->set_ssim_weight(1.5); }),
              HasSubstr("colorize_scene.reconstruct_geometry.ssim_weight is 1.5"));
  EXPECT_EQ(message([](auto* s) { s->mutable_personalize()->set_average_decay(1.0); }),
            "colorize_scene.personalize.average_decay is 1; the range is 0 to 0.9999");
  EXPECT_EQ(message([](auto* s) { s->mutable_personalize()->set_min_improvement(0.6); }),
            "colorize_scene.personalize.min_improvement is 0.6; the range is 0 to 0.5");
  EXPECT_EQ(
      message([](auto* s) {
        s->mutable_personalize()->set_precision(static_cast<v1::PersonalizeSpec::Precision>(7));
      }),
      "colorize_scene.personalize.precision is 7, which is none of PRECISION_AUTO, "
      "PRECISION_FLOAT32, PRECISION_BFLOAT16");
  EXPECT_THAT(
      message([](auto* s) {
        s->mutable_select_key_view()->set_temperature(std::numeric_limits<double>::quiet_NaN());
      }),
      HasSubstr("not a finite number"));
  EXPECT_THAT(message([](auto* s) {
                s->mutable_key_color()->mutable_image()->set_sha256("../../etc/passwd");
              }),
              HasSubstr("64 lower-case hexadecimal digits"));
  EXPECT_THAT(message([](auto* s) { s->add_truth()->set_view("x"); }), HasSubstr("truth[0]"));
  EXPECT_THAT(message([](auto* s) {
                s->mutable_select_key_view()->set_strategy(v1::SelectKeyViewSpec::STRATEGY_MANUAL);
              }),
              HasSubstr("view is required"));
}

TEST(Planner, SkipsAnExportOfNothingOnly) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  spec.mutable_export_()->set_ply(false);
  JobRecord import;
  import.name = "jobs/i";
  import.kind = "import_scene";
  import.scene = "scenes/test";
  JobRecord model = import;
  model.name = "jobs/m";
  model.kind = "solve_chroma";
  EXPECT_THAT(PlanJob(spec, {import, model}, kTwentyPhotos).jobs.back().skip_reason,
              HasSubstr("ply"));
  spec.mutable_export_()->set_splat(true);
  EXPECT_EQ(PlanJob(spec, {import, model}, kTwentyPhotos).jobs.back().skip_reason, "");
  for (const char* option : {"sog: true", "splat4d: true", "moments: 3"}) {
    ASSERT_TRUE(google::protobuf::TextFormat::ParseFromString(std::string("ply: false ") + option,
                                                              spec.mutable_export_()));
    EXPECT_EQ(PlanJob(spec, {import, model}, kTwentyPhotos).jobs.back().skip_reason, "") << option;
  }
}

TEST(PlanColorizeScene, TakesAnAcceptedKeyView) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  spec.mutable_colorize_scene();
  spec.add_inputs("jobs/colorize_key_view");
  std::vector<JobRecord> inputs{
      Done("import_scene"), Done("select_key_view"), Done("colorize_key_view")};
  const NewGraph graph = PlanJob(spec, inputs, kTwentyPhotos);
  for (const NewJob& job : graph.jobs) {
    EXPECT_NE(job.kind, "import_scene");
    EXPECT_NE(job.kind, "select_key_view");
    EXPECT_NE(job.kind, "colorize_key_view");
  }
  const NewJob& personalize = graph.jobs[IndexOf(graph, "personalize")];
  EXPECT_THAT(personalize.input_jobs,
              ElementsAre("jobs/import_scene", "jobs/select_key_view", "jobs/colorize_key_view"));
  EXPECT_EQ(graph.jobs.back().kind, "colorize_scene");
  EXPECT_EQ(graph.jobs.back().input_jobs.size(), 3u) << "the report shows them, too";

  spec.mutable_colorize_scene()->set_key_view("a.jpg");
  EXPECT_THAT(PlanError(spec, inputs).message, HasSubstr("jobs/select_key_view"));
  spec.mutable_colorize_scene()->clear_key_view();
  *spec.mutable_colorize_scene()->mutable_key_color()->mutable_image() = SomeDigest("key");
  EXPECT_THAT(PlanError(spec, inputs).message, HasSubstr("jobs/colorize_key_view"));
  spec.mutable_colorize_scene()->clear_key_color();
  inputs[2].state = JobState::kRunning;
  EXPECT_EQ(PlanError(spec, inputs).reason, "INPUT_MISSING");
  inputs[2].state = JobState::kSucceeded;
  inputs.erase(inputs.begin() + 1);
  EXPECT_THAT(PlanError(spec, inputs).message,
              HasSubstr("without its own input, the select_key_view"));
  EXPECT_THAT(PlanError(spec, {Done("import_scene")}).message, HasSubstr("key_color is required"));
  EXPECT_THAT(PlanError(spec, {Done("personalize")}).message, HasSubstr("personalize"));
}

}  // namespace
}  // namespace color3d
