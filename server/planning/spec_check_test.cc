// Checks of sources of key colour, and names of models in plans and cache keys.
#include "server/planning/spec_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "server/base/service_error.h"
#include "server/planning/planner.h"
#include "server/planning/presets.h"
#include "server/planning/spec_names.h"
#include "server/planning/stage_key.h"

namespace color3d {
namespace {
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

v1::Digest SomeDigest(const std::string& text) {
  v1::Digest digest;
  digest.set_sha256(Sha256Hex(text));
  digest.set_size_bytes(10);
  return digest;
}

template <typename Change>
std::string CheckMessage(Change change) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  change(spec.mutable_colorize_scene()->mutable_key_color());
  try {
    CheckSpec(spec);
  } catch (const ServiceError& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    EXPECT_EQ(e.reason(), ErrorReason::kBadOption);
    return e.what();
  }
  return "accepted";
}

TEST(KeyColorSpec, EverySourceIsAccepted) {
  EXPECT_EQ(CheckMessage([](auto* s) { *s->mutable_reference() = SomeDigest("r"); }), "accepted");
  EXPECT_EQ(CheckMessage([](auto* s) {
              *s->mutable_references()->add_images() = SomeDigest("r");
              s->set_model("tiny");
            }),
            "accepted");
  EXPECT_EQ(CheckMessage([](auto* s) {
              s->set_prompt("red brick");
              s->set_model("clip");
            }),
            "accepted");
  EXPECT_EQ(CheckMessage([](auto* s) { s->set_automatic(true); }), "accepted");
  EXPECT_EQ(CheckMessage([](auto* s) {
              s->set_backend("b");
              s->mutable_backend_input()->set_prompt("red brick");
            }),
            "accepted");
  EXPECT_EQ(CheckMessage([](auto* s) { s->set_script("mine"); }), "accepted");
  EXPECT_EQ(CheckMessage([](auto* s) { *s->mutable_edit()->mutable_image() = SomeDigest("e"); }),
            "accepted");
}

TEST(KeyColorSpec, NamesWhatASourceLacks) {
  EXPECT_THAT(CheckMessage([](auto* s) { s->set_prompt("red brick"); }),
              AllOf(HasSubstr("key_color.model is required"), HasSubstr("--model NAME=FILE")));
  EXPECT_THAT(CheckMessage([](auto* s) {
                s->set_prompt(" \n");
                s->set_model("clip");
              }),
              HasSubstr("key_color.prompt is empty"));
  EXPECT_THAT(CheckMessage([](auto* s) { s->set_automatic(false); }), HasSubstr("set it to true"));
  EXPECT_THAT(CheckMessage([](auto* s) { s->set_backend(""); }), HasSubstr("name a backend"));
  EXPECT_THAT(CheckMessage([](auto* s) { s->set_script(""); }), HasSubstr("name a model"));
  EXPECT_THAT(CheckMessage([](auto* s) { s->mutable_references(); }),
              HasSubstr("references.images is empty"));
  EXPECT_THAT(CheckMessage([](auto* s) {
                for (int i = 0; i < 17; ++i) {
                  *s->mutable_references()->add_images() = SomeDigest(std::to_string(i));
                }
              }),
              HasSubstr("references.images has 17 entries; at most 16"));
  EXPECT_THAT(CheckMessage([](auto* s) { s->mutable_edit(); }), HasSubstr("key_color.edit.image"));
}

TEST(KeyColorSpec, RefusesOptionsOfOtherSources) {
  EXPECT_THAT(CheckMessage([](auto* s) {
                s->set_script("mine");
                s->set_model("clip");
              }),
              HasSubstr("key_color.model is 'clip'"));
  EXPECT_THAT(CheckMessage([](auto* s) {
                s->set_automatic(true);
                s->mutable_backend_input();
              }),
              HasSubstr("key_color.backend_input"));
  EXPECT_THAT(CheckMessage([](auto* s) {
                *s->mutable_strokes() = SomeDigest("s");
                *s->mutable_labels() = SomeDigest("l");
              }),
              HasSubstr("key_color.labels"));
  EXPECT_THAT(CheckMessage([](auto* s) {
                *s->mutable_points() = SomeDigest("p");
                *s->mutable_backend_input()->mutable_points() = SomeDigest("a");
              }),
              HasSubstr("backend_input is set, but points and strokes have nothing below"));
  EXPECT_THAT(CheckMessage([](auto* s) {
                s->set_automatic(true);
                *s->mutable_backend_input()->mutable_mask() = SomeDigest("m");
              }),
              HasSubstr("only points may lie above"));
  EXPECT_EQ(CheckMessage([](auto* s) {
              s->set_automatic(true);
              *s->mutable_backend_input()->mutable_points() = SomeDigest("a");
              *s->mutable_labels() = SomeDigest("l");
            }),
            "accepted");
}

// The refusal of the paper's preset with these options, or "accepted".
std::string JointMessage(const std::function<void(v1::ColorizeSceneSpec*)>& change) {
  v1::ColorizeSceneSpec scene;
  scene.set_preset(v1::PRESET_PAPER);
  change(&scene);
  try {
    CheckJointTraining(WithPreset(scene));
  } catch (const Error& error) {
    return error.what();
  }
  return "accepted";
}

TEST(JointTrainingSpec, HasBothHalvesOrNeither) {
  EXPECT_EQ(JointMessage([](auto*) {}), "accepted");
  EXPECT_EQ(JointMessage([](auto* s) { s->set_preset(v1::PRESET_FAST); }), "accepted");
  EXPECT_EQ(JointMessage([](auto* s) {
              s->mutable_solve_chroma()->set_solver(v1::SolveChromaSpec::SOLVER_ADAM);
              s->mutable_reconstruct_geometry()->set_warm_up(1.0);
            }),
            "accepted");
  EXPECT_THAT(JointMessage([](auto* s) {
                s->mutable_solve_chroma()->set_solver(v1::SolveChromaSpec::SOLVER_ADAM);
              }),
              HasSubstr("reconstruct_geometry.warm_up is 0.5"));
  EXPECT_THAT(JointMessage([](auto* s) {
                s->set_preset(v1::PRESET_FAST);
                s->mutable_solve_chroma()->set_solver(v1::SolveChromaSpec::SOLVER_JOINT);
              }),
              HasSubstr("solve_chroma.solver is joint"));
  EXPECT_THAT(
      JointMessage([](auto* s) {
        s->mutable_reconstruct_geometry()->set_recipe(v1::ReconstructGeometrySpec::RECIPE_COLOR3D);
      }),
      HasSubstr("needs recipe=paper"));
  EXPECT_THAT(JointMessage([](auto* s) { s->mutable_reconstruct_geometry()->set_sh_degree(2); }),
              HasSubstr("chroma_sh_degree is 3, above the degree 2"));
}

v1::JobSpec SpecWithNames() {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  v1::ColorizeSceneSpec* scene = spec.mutable_colorize_scene();
  scene->mutable_key_color()->set_backend("uni");
  scene->mutable_select_key_view()->set_features("clip");
  scene->mutable_personalize()->set_encoder("tiny");
  return spec;
}

std::string NameError(const v1::JobSpec& spec, const UserModels& models) {
  try {
    CheckNames(spec, models);
  } catch (const ServiceError& e) {
    EXPECT_EQ(e.code(), ErrorCode::kInvalidArgument);
    return ReasonOf(e) + ": " + e.what();
  }
  return "";
}

TEST(SpecNames, RefusesUnknownNames) {
  UserModels models{{{"clip", "/m/clip"}, {"tiny", "/m/tiny"}}, {{"uni", "127.0.0.1:1"}}};
  EXPECT_EQ(NameError(SpecWithNames(), models), "");
  models.files.erase("tiny");
  EXPECT_THAT(NameError(SpecWithNames(), models),
              AllOf(HasSubstr("UNKNOWN_MODEL"),
                    HasSubstr("colorize_scene.personalize.encoder"),
                    HasSubstr("'tiny'"),
                    HasSubstr("it has: clip"),
                    HasSubstr("--model NAME=FILE")));
  models.backends.clear();
  models.files["tiny"] = "/m/tiny";
  EXPECT_THAT(NameError(SpecWithNames(), models),
              AllOf(HasSubstr("UNKNOWN_BACKEND"), HasSubstr("it has: none")));
}

// The planner adds the digests of the files to the key.
TEST(SpecNames, CacheKeysNameTheirFiles) {
  const NewGraph graph =
      PlanJob(SpecWithNames(), {}, {.pictures = 20, .layout = CaptureLayout::kColmap});
  std::map<std::string, StageKeyPart> parts;
  for (const NewJob& job : graph.jobs) {
    v1::JobSpec stage;
    ASSERT_TRUE(stage.ParseFromString(job.spec));
    parts[job.kind] = KeyPartOf(stage);
  }
  EXPECT_THAT(parts["select_key_view"].models, ElementsAre("clip"));
  EXPECT_THAT(parts["personalize"].models, ElementsAre("tiny"));
  EXPECT_THAT(parts["colorize_views"].models, ElementsAre("tiny"));
  EXPECT_THAT(parts["colorize_key_view"].backends, ElementsAre("uni"));
  EXPECT_TRUE(parts["solve_chroma"].models.empty());
}

TEST(SpecNames, ColorizerKeepsItsEncoder) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  spec.mutable_colorize_views();
  JobRecord import;
  import.name = "jobs/i";
  import.kind = "import_scene";
  import.scene = "scenes/test";
  v1::JobSpec trained;
  trained.mutable_personalize()->set_encoder("tiny");
  JobRecord personalize = import;
  personalize.name = "jobs/p";
  personalize.kind = "personalize";
  personalize.spec = trained.SerializeAsString();
  const NewGraph graph =
      PlanJob(spec, {import, personalize}, {.pictures = 20, .layout = CaptureLayout::kColmap});
  v1::JobSpec planned;
  ASSERT_TRUE(planned.ParseFromString(graph.jobs.back().spec));
  EXPECT_EQ(planned.colorize_views().encoder(), "tiny");
}

template <typename Change>
std::string CheckRender(Change change, bool of_whole_scene = false) {
  v1::JobSpec spec;
  spec.set_scene("scenes/test");
  if (of_whole_scene) spec.mutable_colorize_scene()->mutable_key_color()->set_automatic(true);
  change(of_whole_scene ? spec.mutable_colorize_scene()->mutable_render() : spec.mutable_render());
  try {
    CheckSpec(spec);
  } catch (const ServiceError& e) {
    EXPECT_EQ(e.reason(), ErrorReason::kBadOption);
    return e.what();
  }
  return "accepted";
}

TEST(RenderSpecTest, NamesMissingAndUselessOptions) {
  using Spec = v1::RenderSpec;
  EXPECT_EQ(CheckRender([](Spec* s) { s->set_path(Spec::PATH_ORBIT); }), "accepted");
  EXPECT_EQ(CheckRender([](Spec* s) {
              s->set_path(Spec::PATH_CAMERAS);
              *s->mutable_cameras() = SomeDigest("cameras");
            }),
            "accepted");
  EXPECT_THAT(CheckRender([](Spec* s) { s->set_path(Spec::PATH_CAMERAS); }),
              HasSubstr("render.cameras is required"));
  EXPECT_THAT(CheckRender([](Spec* s) { *s->mutable_cameras() = SomeDigest("cameras"); }),
              HasSubstr("only PATH_CAMERAS"));
  EXPECT_THAT(CheckRender([](Spec* s) {
                s->set_path(Spec::PATH_PHOTOS);
                s->set_video(false);
              }),
              HasSubstr("nothing would be written"));
  EXPECT_THAT(CheckRender([](Spec* s) { s->set_frames(18'001); }), HasSubstr("1 to 18000"));
  EXPECT_THAT(CheckRender([](Spec* s) { s->set_frames(0); }), HasSubstr("1 to 18000"));
  EXPECT_THAT(CheckRender([](Spec* s) { s->set_path(Spec::PATH_ORBIT); }, true),
              HasSubstr("color3d turntable"));
}

TEST(SpecCheckTest, NamesEntryOfListByPath) {
  const auto complaint = [](auto change) {
    v1::JobSpec spec;
    spec.set_scene("scenes/test");
    change(&spec);
    try {
      CheckSpec(spec);
    } catch (const ServiceError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_THAT(complaint([](v1::JobSpec* spec) {
                auto* augmentations = spec->mutable_generate_augmentations();
                augmentations->add_kinds(v1::GenerateAugmentationsSpec::KIND_OUTPAINT);
                augmentations->add_kinds(v1::GenerateAugmentationsSpec::KIND_UNSPECIFIED);
              }),
              HasSubstr("generate_augmentations.kinds[1] is unspecified"));
  EXPECT_THAT(complaint([](v1::JobSpec* spec) {
                spec->mutable_render()->add_views("0001");
                spec->mutable_render()->add_views(std::string(5000, 'a'));
              }),
              HasSubstr("render.views[1] has 5000 bytes; at most 4096"));
  EXPECT_THAT(complaint([](v1::JobSpec* spec) {
                v1::TruthImage* truth = spec->mutable_evaluate()->add_truth();
                truth->set_view("0001");
                truth->mutable_image();  // empty
              }),
              HasSubstr("evaluate.truth[0].image.sha256 must be 64"));
  EXPECT_EQ(complaint([](v1::JobSpec* spec) { spec->mutable_render()->add_views("0001"); }), "");
}

TEST(SpecCheckTest, CollectsDigestsOfListsOnce) {
  v1::JobSpec spec;
  auto* source = spec.mutable_colorize_key_view()->mutable_source();
  for (const char* text : {"a", "b", "a"}) {
    *source->mutable_references()->add_images() = SomeDigest(text);
  }
  EXPECT_EQ(SpecBlobs(spec).size(), 2u);
}

}  // namespace
}  // namespace color3d
