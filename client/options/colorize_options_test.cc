#include "client/options/colorize_options.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "client/options/option_fields.h"
#include "client/options/preset_file.h"
#include "core/base/error.h"
#include "core/base/files.h"
#include "core/catalogue/limits.h"

namespace color3d::client {
namespace {
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class ColorizeOptionsTest : public ::testing::Test {
 protected:
  std::string File(const std::string& text) {
    const std::filesystem::path file = folder_.path() / "mine.textproto";
    WriteFileAtomic(file, text);
    return file.string();
  }

  // Returns the spec of `color3d colorize --scene scenes/s -o out ARGUMENTS`.
  v1::ColorizeSceneSpec Spec(std::vector<std::string> arguments) {
    ColorizeOptions options;
    CLI::App app;
    DeclareOptions(app, &options);
    arguments.insert(arguments.begin(), {"--scene", "scenes/s", "-o", "out", "--auto"});
    std::reverse(arguments.begin(), arguments.end());
    app.parse(arguments);
    options.Check();
    return ColorizeSpec(options, "scenes/s").colorize_scene();
  }
  // Returns the error message, or an empty string.
  std::string Complaint(const std::vector<std::string>& arguments) {
    try {
      Spec(arguments);
    } catch (const std::exception& e) {
      return e.what();
    }
    return "";
  }

 private:
  const ScratchFolder folder_;
};

TEST_F(ColorizeOptionsTest, FlagsAndSettingsSetFields) {
  const v1::ColorizeSceneSpec spec = Spec({"--max-side=640",
                                           "--colorizer-iterations=7",
                                           "--augment-backend=mine",
                                           "--set=carry_color.depth_tolerance=0.05",
                                           "--set",
                                           "solve_chroma.solver=adam",
                                           "--set",
                                           "select_key_view.strategy=STRATEGY_TRACKS",
                                           "--set=personalize.min_improvement=0",
                                           "--set=select_key_view.exclude_self=true"});
  EXPECT_EQ(spec.preset(), v1::PRESET_FAST);
  EXPECT_EQ(spec.max_side_px(), 640);
  EXPECT_EQ(spec.personalize().iterations(), 7);
  EXPECT_EQ(spec.generate_augmentations().backend(), "mine");
  EXPECT_FALSE(spec.generate_augmentations().has_samples());
  EXPECT_EQ(spec.carry_color().depth_tolerance(), 0.05);
  EXPECT_EQ(spec.solve_chroma().solver(), v1::SolveChromaSpec::SOLVER_ADAM);
  EXPECT_EQ(spec.select_key_view().strategy(), v1::SelectKeyViewSpec::STRATEGY_TRACKS);
  EXPECT_TRUE(spec.personalize().has_min_improvement());
  EXPECT_TRUE(spec.select_key_view().exclude_self());
}

TEST_F(ColorizeOptionsTest, PngRequestsFrames) {
  EXPECT_TRUE(Spec({"--png"}).render().pictures());
  EXPECT_FALSE(Spec({}).render().pictures());
}

TEST_F(ColorizeOptionsTest, UsesAugmentFilesOnRequest) {
  EXPECT_FALSE(Spec({"--augment=4"}).generate_augmentations().files());
  const v1::ColorizeSceneSpec spec = Spec({"--augment-files"});
  EXPECT_TRUE(spec.generate_augmentations().files());
  EXPECT_FALSE(spec.generate_augmentations().has_samples());
  ColorizeOptions options;
  PhotoFolder folder;
  folder.root = "photos";
  EXPECT_NO_THROW(RequireAugmentFiles(options, folder));
  options.settings = {"generate_augmentations.files=true"};
  try {
    RequireAugmentFiles(options, folder);
    FAIL() << "there are no pictures";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("photos/augment"));
  }
  folder.augment_files.push_back({"augment/a.png", "a.png"});
  EXPECT_NO_THROW(RequireAugmentFiles(options, folder));
}

TEST_F(ColorizeOptionsTest, NamesRangeOfWrongValue) {
  EXPECT_THAT(Complaint({"--max-side=12"}),
              AllOf(HasSubstr("max_side_px is '12'"), HasSubstr("64 to 4096 px")));
  EXPECT_THAT(Complaint({"--set=personalize.iterations=many"}), HasSubstr("0 to 100000"));
  EXPECT_THAT(Complaint({"--set=personalize.iterations=1.5"}), HasSubstr("0 to 100000"));
  EXPECT_THAT(Complaint({"--set=personalize.average_decay=nan"}), HasSubstr("0 to 0.9999"));
  EXPECT_THAT(Complaint({"--set=solve_chroma.solver=magic"}),
              HasSubstr("conjugate_gradients, adam"));
  EXPECT_THAT(Complaint({"--set=select_key_view.exclude_self=1"}), HasSubstr("true or false"));
  EXPECT_THAT(Complaint({"--set=personalize.iterations"}), HasSubstr("has no value"));
}

TEST_F(ColorizeOptionsTest, MasksNeedPhotos) {
  EXPECT_THAT(Complaint({"--masks=m"}), HasSubstr("has its masks already"));
  EXPECT_THAT(Complaint({"--masks=m", "--film"}), HasSubstr("--film takes frames as they are"));
}

TEST_F(ColorizeOptionsTest, RequiresFileOfOtherColorizer) {
  EXPECT_THAT(Complaint({"--colorizer=none.c3c"}),
              AllOf(HasSubstr("no file none.c3c"), HasSubstr("colorizer.c3c")));
  EXPECT_EQ(Complaint({"--colorizer=" + File("any")}), "");
}

TEST_F(ColorizeOptionsTest, PosesFlagRequestsPoses) {
  ColorizeOptions options;
  EXPECT_FALSE(ImportSpec(options, "scenes/s").import_scene().has_film_poses());
  options.poses = true;
  for (const v1::ImportSceneSpec& spec :
       {ImportSpec(options, "scenes/s").import_scene(),
        ColorizeSpec(options, "scenes/s").colorize_scene().import_scene()}) {
    EXPECT_EQ(spec.film_poses(), v1::ImportSceneSpec::FILM_POSES_AUTO);
  }
}

TEST_F(ColorizeOptionsTest, SelectionImportsFilmWithItsOptions) {
  const auto import = [](std::vector<std::string> arguments) {
    ColorizeOptions options;
    CLI::App app;
    DeclareImportOptions(app, &options);
    std::reverse(arguments.begin(), arguments.end());
    app.parse(arguments);
    return ImportSpec(options, "scenes/s").import_scene();
  };
  EXPECT_EQ(import({}).ByteSizeLong(), 0u) << "the server imports by default";
  const v1::ImportSceneSpec spec = import({"--poses",
                                           "--deflicker",
                                           "--set=import_scene.film_stride=3",
                                           "--set",
                                           "import_scene.film_begin_s=1.5"});
  EXPECT_EQ(spec.film_poses(), v1::ImportSceneSpec::FILM_POSES_AUTO);
  EXPECT_TRUE(spec.film_deflicker());
  EXPECT_EQ(spec.film_stride(), 3);
  EXPECT_EQ(spec.film_begin_s(), 1.5);
  EXPECT_THROW(import({"--set=personalize.iterations=7"}), CLI::ValidationError);
  EXPECT_THROW(import({"--set=import_scene.film_stride=0"}), CLI::ValidationError);
}

TEST_F(ColorizeOptionsTest, SuggestsSimilarOption) {
  EXPECT_THAT(Complaint({"--set=personalise.iterations=3"}),
              HasSubstr("did you mean personalize.iterations?"));
  EXPECT_THAT(Complaint({"--set=iterations=3"}),
              AllOf(HasSubstr("personalize.iterations"), HasSubstr("solve_chroma.iterations")));
  EXPECT_THAT(Complaint({"--set=carry_color"}), HasSubstr("carry_color.depth_side_px"));
  EXPECT_THAT(Complaint({"--set=zzz=3"}), HasSubstr("README"));
  EXPECT_THAT(Complaint({"--set=key_color.prompt=red"}), HasSubstr("there is no option"));
}

TEST_F(ColorizeOptionsTest, HelpShowsRangesOfProto) {
  EXPECT_EQ(DescribeOption("personalize.crop_px"), "64 to 1024 px, default 256");
  EXPECT_EQ(DescribeOption("max_side_px"), "64 to 4096 px, default by preset");
  EXPECT_EQ(DescribeOption("solve_chroma.solver"),
            "conjugate_gradients, adam, joint, default by preset");
  ColorizeOptions options;
  CLI::App app;
  DeclareOptions(app, &options);
  EXPECT_THAT(app.help(), AllOf(HasSubstr("1 to 10000000"), HasSubstr("fast, best, paper")));
}

TEST_F(ColorizeOptionsTest, PresetIsNameOrFile) {
  EXPECT_EQ(Spec({"--preset=best"}).preset(), v1::PRESET_BEST);
  const std::string file = File(
      "preset: PRESET_BEST  # the rest is best's\n"
      "personalize {\n  iterations: 90\n  crop_px: 128\n}\n");
  const v1::ColorizeSceneSpec spec =
      Spec({"--preset", file, "--colorizer-iterations=80", "--max-side=700"});
  EXPECT_EQ(spec.preset(), v1::PRESET_BEST);
  EXPECT_EQ(spec.personalize().crop_px(), 128);
  EXPECT_EQ(spec.personalize().iterations(), 80) << "flags win over the file";
  EXPECT_EQ(spec.max_side_px(), 700);
  EXPECT_FALSE(Spec({"--preset", File("max_side_px: 300\n")}).has_preset()) << "the server's";
  EXPECT_EQ(Spec({"--preset", File("\xef\xbb\xbfmax_side_px: 300\n")}).max_side_px(), 300);
  EXPECT_THAT(Complaint({"--preset=turbo"}),
              AllOf(HasSubstr("fast, best, paper"), HasSubstr("no such file")));
}

TEST_F(ColorizeOptionsTest, ReadsAdditionalKeyViewsWithRange) {
  const AdditionalKeyView range = ParseAdditionalKeyView("f000012=auto@10-14.5");
  EXPECT_EQ(range.view, "f000012");
  EXPECT_TRUE(range.color.automatic);
  EXPECT_EQ(range.begin_s, 10.0);
  EXPECT_EQ(range.end_s, 14.5);
  EXPECT_EQ(ParseAdditionalKeyView("a=auto@0.25-").begin_s, 0.25);
  EXPECT_FALSE(ParseAdditionalKeyView("a=auto@0.25-").end_s);
  EXPECT_FALSE(ParseAdditionalKeyView("a=auto@-3").begin_s);
  EXPECT_FALSE(ParseAdditionalKeyView("a=auto").HasRange());
  EXPECT_THAT(Complaint({"--add-key-view=a=auto@5-2"}),
              HasSubstr("ends at 2 s, before it begins at 5"));
  for (const char* text : {"@10", "@-", "@", "@1-2-3", "@1.2.3-4"}) {
    EXPECT_THAT(Complaint({std::string("--add-key-view=a=auto") + text}),
                HasSubstr("is not a range of time; write seconds of the film, BEGIN-END"))
        << text;
  }
  EXPECT_THAT(Complaint({"--add-key-view=a=painted@2x.png"}), HasSubstr("painted@2x.png"));
}

TEST_F(ColorizeOptionsTest, TakesKeyViewsByFormerFlagToo) {
  EXPECT_THAT(Complaint({"--more-key=a=auto@5-2"}), HasSubstr("--add-key-view a: the range"));
  std::vector<std::string> arguments;
  for (int i = 0; i <= kMaxAdditionalKeyViews; ++i) {
    arguments.push_back(
        fmt::format("--{}=view{}=auto", i % 2 == 0 ? "add-key-view" : "more-key", i));
  }
  EXPECT_THAT(Complaint(arguments), HasSubstr("--add-key-view is given 17 times; at most 16"));
}

TEST_F(ColorizeOptionsTest, NamesLineOfErrorInPresetFile) {
  EXPECT_THAT(Complaint({"--preset", File("max_side_px: 300\npersonalize {\n  iteration: 3\n}\n")}),
              AllOf(HasSubstr("mine.textproto, line 3: there is no field 'iteration'"),
                    HasSubstr("did you mean iterations?")));
  EXPECT_THAT(Complaint({"--preset", File("\nsolve_chroma { solver: MAGIC }\n")}),
              AllOf(HasSubstr("line 2"), HasSubstr("MAGIC"), HasSubstr("server presets")));
  EXPECT_THAT(Complaint({"--preset", File("render {\n\n  max_views: 0\n}\n")}),
              HasSubstr("line 3: max_views is 0; the range is 1 to 1000"));
  EXPECT_THAT(Complaint({"--preset", File("key_view: \"a.jpg\"\n")}),
              AllOf(HasSubstr("any scene"), Not(HasSubstr("line"))));
}

}  // namespace
}  // namespace color3d::client
