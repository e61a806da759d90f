#include "server/worker/stage_options.h"

#include <google/protobuf/text_format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <set>

#include "core/base/error.h"
#include "core/catalogue/stages.h"
#include "proto/option_text.h"
#include "server/planning/job_spec.h"
#include "server/planning/presets.h"
#include "server/planning/spec_check.h"

namespace color3d {
namespace {
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

using Precision = ColorizerOptions::Precision;

template <class Work>
std::string Refusal(const Work& work) {
  try {
    work();
  } catch (const Error& e) {
    return e.what();
  }
  return "nothing was refused";
}

TEST(CarryOptionsFromTest, NamesAdditionalKeyViewsInOrder) {
  v1::CarryColorSpec spec;
  spec.add_further_key_views()->set_view("b");
  spec.add_further_key_views()->set_view("a");
  EXPECT_EQ(CarryOptionsFrom(spec).additional_key_views, (std::vector<std::string>{"b", "a"}));
}

// Planned before additional key views had their own jobs.
TEST(CarryOptionsFromTest, RefusesJobsOfEarlierVersions) {
  v1::FurtherKeyView key;
  key.set_view("b");
  key.mutable_color()->set_automatic(true);
  v1::CarryColorSpec carry;
  *carry.add_further_key_views() = key;
  EXPECT_NE(Refusal([&] { CarryOptionsFrom(carry); }).find("submit it again"), std::string::npos);
  v1::CorrectColorsSpec correct;
  *correct.add_corrections() = key;
  EXPECT_NO_THROW(CorrectOptionsFrom(correct)) << "a correction by strokes has its colours";
  correct.mutable_corrections(0)->set_begin_s(1.0);
  EXPECT_NE(Refusal([&] { CorrectOptionsFrom(correct); }).find("submit it again"),
            std::string::npos);
  correct.mutable_corrections(0)->clear_color();
  const CorrectColorsOptions options = CorrectOptionsFrom(correct);
  ASSERT_EQ(options.ranges.size(), 1u);
  EXPECT_EQ(options.ranges[0].begin_s, 1.0);
  EXPECT_FALSE(options.ranges[0].end_s);
}

// The bytes of a queued carry_color job as an earlier version stored it: the additional key view
// "b" is coloured automatically, by the stage itself.
TEST(CarryOptionsFromTest, RefusesStoredJobOfVersionBefore) {
  constexpr std::string_view kStored =
      "\x0a\x0bscenes/fern"
      "\x92\x01\x09"
      "\x32\x07\x0a\x01"
      "b"
      "\x12\x02\x30\x01";
  const v1::JobSpec spec = ParseSpec(std::string(kStored), "jobs/old");
  try {
    CarryOptionsFrom(spec.carry_color());
    ADD_FAILURE() << "the job was accepted";
  } catch (const Error& e) {
    EXPECT_EQ(e.code(), ErrorCode::kFailedPrecondition) << "not tried again";
    EXPECT_STREQ(e.what(),
                 "an earlier version of the server planned this job without a job that colours the "
                 "additional key view b; submit it again");
  }
}

TEST(StagesTest, CatalogueHasEveryStageOfTheApi) {
  const auto* stages = v1::JobSpec::descriptor()->FindOneofByName("stage");
  for (int i = 0; i < stages->field_count(); ++i) {
    const std::string& name = stages->field(i)->name();
    EXPECT_NE(FindStage(name), nullptr) << name;
  }
}

TEST(ColorizerOptionsFromTest, UnsetFieldsKeepDefaults) {
  ColorizerOptions defaults;
  defaults.seed = 17;
  EXPECT_EQ(ColorizerOptionsFrom(v1::PersonalizeSpec(), 17), defaults);
}

TEST(ColorizerOptionsFromTest, PaperRecipeCrops320PxUnlessGiven) {
  v1::PersonalizeSpec spec;
  spec.set_recipe(v1::PersonalizeSpec::RECIPE_PAPER);
  EXPECT_EQ(ColorizerOptionsFrom(spec, 1).crop_px, 320);
  spec.set_crop_px(128);
  EXPECT_EQ(ColorizerOptionsFrom(spec, 1).crop_px, 128);
}

TEST(ColorizerOptionsFromTest, ConvertsSetFields) {
  v1::PersonalizeSpec spec;
  spec.set_precision(v1::PersonalizeSpec::PRECISION_FLOAT32);
  spec.set_average_decay(0.0);
  spec.set_min_improvement(0.02);
  spec.set_min_decoder_share(0.25);
  ColorizerOptions options = ColorizerOptionsFrom(spec, 1);
  EXPECT_EQ(options.precision, Precision::kFloat32);
  EXPECT_EQ(options.average_decay, 0.0);
  EXPECT_EQ(options.min_improvement, 0.02);
  EXPECT_EQ(options.min_decoder_share, 0.25);
  spec.set_precision(v1::PersonalizeSpec::PRECISION_BFLOAT16);
  EXPECT_EQ(ColorizerOptionsFrom(spec, 1).precision, Precision::kBfloat16);
  spec.set_precision(v1::PersonalizeSpec::PRECISION_AUTO);
  EXPECT_EQ(ColorizerOptionsFrom(spec, 1).precision, Precision::kAuto);
}

TEST(ColorizeViewsOptionsFromTest, ConvertsEveryMethod) {
  const auto* methods = v1::ColorizeViewsSpec::Method_descriptor();
  std::set<ColorizeViewsOptions::Method> converted;
  for (int i = 1; i < methods->value_count(); ++i) {  // 0: unspecified
    v1::ColorizeViewsSpec spec;
    spec.set_method(static_cast<v1::ColorizeViewsSpec::Method>(methods->value(i)->number()));
    converted.insert(ColorizeViewsOptionsFrom(spec).method);
  }
  EXPECT_EQ(static_cast<int>(converted.size()), methods->value_count() - 1);
}

TEST(CarryOptionsFromTest, FlowCheckIsFlowTolerance) {
  v1::CarryColorSpec spec;
  spec.set_flow_tolerance_px(2.0);
  EXPECT_EQ(CarryOptionsFrom(spec).carry.flow_tolerance_px, 2.0);
  spec.set_flow_check(false);
  EXPECT_EQ(CarryOptionsFrom(spec).carry.flow_tolerance_px, 0.0);
}

// Conversion and validation of the options of a stage in the method library.
struct Method {
  std::function<void(const Message&)> validate;
  std::function<bool(const Message&, const Message&)> same;  // both specs give equal options
};

template <typename Spec, typename From>
Method MakeMethod(From from) {
  return {[from](const Message& spec) { from(static_cast<const Spec&>(spec)).Validate(); },
          [from](const Message& a, const Message& b) {
            return from(static_cast<const Spec&>(a)) == from(static_cast<const Spec&>(b));
          }};
}

// Working size, which some stages take in addition to their options.
struct MaxSide {
  int px;
  void Validate() const { CheckMaxSide(px); }
  bool operator==(const MaxSide&) const = default;
};
template <typename Spec>
MaxSide MaxSideFrom(const Spec& spec) {
  return {spec.has_max_side_px() ? spec.max_side_px() : kDefaultMaxSidePx};
}

struct SizedGeometry {
  GeometryOptions options;
  MaxSide size;
  void Validate() const {
    options.Validate();
    size.Validate();
  }
  bool operator==(const SizedGeometry&) const = default;
};

// Options of the import of photos, splats and films.
struct ImportMethod {
  ImportOptions photos;
  SplatViewOptions splat;
  FilmOptions film;
  void Validate() const {
    photos.Validate();
    splat.Validate();
    film.Validate();
  }
  bool operator==(const ImportMethod&) const = default;
};

// By the name of the stage in JobSpec; stages without options are omitted.
const std::map<std::string, Method>& Methods() {
  static const std::map<std::string, Method> methods = {
      {"import_scene", MakeMethod<v1::ImportSceneSpec>([](const auto& s) {
         return ImportMethod{ImportOptionsFrom(s), SplatViewOptionsFrom(s), FilmOptionsFrom(s)};
       })},
      {"select_key_view", MakeMethod<v1::SelectKeyViewSpec>([](const auto& s) {
         return SelectOptionsFrom(s).selection;
       })},
      {"colorize_key_view",
       MakeMethod<v1::ColorizeKeyViewSpec>([](const auto& s) { return HintOptionsFrom(s); })},
      {"generate_augmentations", MakeMethod<v1::GenerateAugmentationsSpec>([](const auto& s) {
         return AugmentationOptionsFrom(s);
       })},
      {"personalize",
       MakeMethod<v1::PersonalizeSpec>([](const auto& s) { return ColorizerOptionsFrom(s, 1); })},
      {"colorize_views", MakeMethod<v1::ColorizeViewsSpec>([](const auto& s) {
         return ColorizeViewsOptionsFrom(s);
       })},
      {"carry_color",
       MakeMethod<v1::CarryColorSpec>([](const auto& s) { return CarryOptionsFrom(s); })},
      {"correct_colors",
       MakeMethod<v1::CorrectColorsSpec>([](const auto& s) { return CorrectOptionsFrom(s); })},
      {"reconstruct_geometry", MakeMethod<v1::ReconstructGeometrySpec>([](const auto& s) {
         return SizedGeometry{GeometryOptionsFrom(s, 1), MaxSideFrom(s)};
       })},
      {"solve_chroma",
       MakeMethod<v1::SolveChromaSpec>([](const auto& s) { return ChromaOptionsFrom(s, 1); })},
      {"export", MakeMethod<v1::ExportSpec>([](const auto& s) { return ExportOptionsFrom(s); })},
      {"render", MakeMethod<v1::RenderSpec>([](const auto& s) { return RenderOptionsFrom(s); })},
  };
  return methods;
}

// Calls `check(kind, field, method)` for every option of every stage that can run.
template <typename Check>
void ForEachOption(Check check) {
  const auto* stages = v1::JobSpec::descriptor()->FindOneofByName("stage");
  for (int i = 0; i < stages->field_count(); ++i) {
    const FieldDescriptor* stage = stages->field(i);
    const auto method = Methods().find(stage->name());
    if (method == Methods().end()) continue;
    for (int f = 0; f < stage->message_type()->field_count(); ++f) {
      check(*stage, *stage->message_type()->field(f), method->second);
    }
  }
}

void SetNumber(const FieldDescriptor& field, double value, Message* message) {
  const auto* reflection = message->GetReflection();
  if (field.cpp_type() == FieldDescriptor::CPPTYPE_INT32) {
    reflection->SetInt32(message, &field, static_cast<int32_t>(value));
  } else {
    reflection->SetDouble(message, &field, value);
  }
}

// Answers of the server's check and of the method to one number.
struct Verdict {
  bool server = true;
  bool method = true;
};
Verdict Try(const FieldDescriptor& stage,
            const FieldDescriptor& field,
            const Method& method,
            double value) {
  v1::JobSpec spec;
  Message* options = spec.GetReflection()->MutableMessage(&spec, &stage);
  if (spec.has_colorize_key_view()) {
    spec.mutable_colorize_key_view()->mutable_source()->set_automatic(true);
  }
  SetNumber(field, value, options);
  Verdict verdict;
  try {
    CheckSpec(spec);
  } catch (const Error&) {
    verdict.server = false;
  }
  try {
    method.validate(*options);
  } catch (const Error&) {
    verdict.method = false;
  }
  return verdict;
}

// Every number has a range, which is equal in the proto and in Validate of the method.
TEST(OptionRanges, AreEqualInServerAndMethod) {
  int ranges = 0;
  ForEachOption(
      [&](const FieldDescriptor& stage, const FieldDescriptor& field, const Method& method) {
        const bool is_integer = field.cpp_type() == FieldDescriptor::CPPTYPE_INT32;
        if (!is_integer && field.cpp_type() != FieldDescriptor::CPPTYPE_DOUBLE) return;
        SCOPED_TRACE(field.full_name());
        const v1::OptionInfo& info = InfoOf(&field);
        ASSERT_TRUE(info.has_min() && info.has_max());
        ++ranges;
        for (const double inside : {info.min(), info.max()}) {
          const Verdict verdict = Try(stage, field, method, inside);
          EXPECT_TRUE(verdict.server) << inside;
          EXPECT_TRUE(verdict.method) << inside;
        }
        const double infinity = std::numeric_limits<double>::infinity();
        const double below = is_integer ? info.min() - 1.0 : std::nextafter(info.min(), -infinity);
        const double above = is_integer ? info.max() + 1.0 : std::nextafter(info.max(), infinity);
        for (const double outside : {below, above}) {
          const Verdict verdict = Try(stage, field, method, outside);
          EXPECT_FALSE(verdict.server) << outside;
          EXPECT_FALSE(verdict.method) << outside;
        }
      });
  EXPECT_GT(ranges, 30);
}

TEST(OptionDefaults, AreThoseOfProto) {
  ForEachOption(
      [&](const FieldDescriptor& stage, const FieldDescriptor& field, const Method& method) {
        const std::string& value = InfoOf(&field).default_value();
        if (value.empty() || field.name() == "skip") return;  // skip: an option of the planner only
        SCOPED_TRACE(field.full_name());
        const Message& unset = *google::protobuf::MessageFactory::generated_factory()->GetPrototype(
            stage.message_type());
        const std::unique_ptr<Message> told(unset.New());
        ASSERT_TRUE(
            google::protobuf::TextFormat::ParseFromString(field.name() + ": " + value, told.get()));
        EXPECT_TRUE(method.same(*told, unset)) << value;
      });
}

TEST(JointTrainingOptions, ReachTheMethod) {
  const v1::ColorizeSceneSpec& paper = OptionsOf(v1::PRESET_PAPER);
  const GeometryOptions geometry = GeometryOptionsFrom(paper.reconstruct_geometry(), 1);
  EXPECT_EQ(geometry.recipe, GeometryOptions::Recipe::kPaper);
  EXPECT_EQ(geometry.iterations, 30'000);
  EXPECT_EQ(geometry.warm_up, 0.5);
  EXPECT_EQ(geometry.sh_degree, 3);
  EXPECT_EQ(geometry.ssim_weight, 0.2);
  EXPECT_EQ(geometry.edge_weight, 1.0);
  v1::SolveChromaSpec chroma = paper.solve_chroma();
  EXPECT_EQ(ChromaOptionsFrom(chroma, 1).solver, ChromaOptions::Solver::kJoint);
  EXPECT_EQ(ChromaOptionsFrom(chroma, 1).color_space, ColorSpace::kLab);
  EXPECT_EQ(ChromaOptionsFrom(chroma, 1).chroma_sh_degree, 3);
  chroma.set_color_space(v1::SolveChromaSpec::COLOR_SPACE_RGB);
  EXPECT_EQ(ChromaOptionsFrom(chroma, 1).color_space, ColorSpace::kSrgb);
  chroma.set_solver(v1::SolveChromaSpec::SOLVER_ADAM);
  EXPECT_THROW(ChromaOptionsFrom(chroma, 1).Validate(), Error);
}

// The defaults of library and service are equal.
TEST(OptionDefaults, EqualFastPreset) {
  const v1::ColorizeSceneSpec fast = WithPreset({});
  EXPECT_EQ(GeometryOptionsFrom(fast.reconstruct_geometry(), 1), GeometryOptions());
  EXPECT_EQ(fast.reconstruct_geometry().max_side_px(), kDefaultMaxSidePx);
  EXPECT_EQ(ColorizerOptionsFrom(fast.personalize(), 1), ColorizerOptions());
  EXPECT_EQ(ChromaOptionsFrom(fast.solve_chroma(), 1), ChromaOptions());
  EXPECT_EQ(SelectOptionsFrom(fast.select_key_view()).selection, KeyViewOptions());
  EXPECT_EQ(CarryOptionsFrom(fast.carry_color()), CarryColorOptions());
  EXPECT_EQ(RenderOptionsFrom(fast.render()), RenderOptions());
}

}  // namespace
}  // namespace color3d
