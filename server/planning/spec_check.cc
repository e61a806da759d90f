#include "server/planning/spec_check.h"

#include <fmt/core.h>

#include <map>
#include <set>

#include "core/catalogue/artifacts.h"
#include "core/catalogue/stages.h"
#include "proto/option_text.h"
#include "server/base/service_error.h"
#include "server/planning/key_view_jobs.h"
#include "server/planning/spec_values.h"

namespace color3d {
namespace {
using google::protobuf::FieldDescriptor;

constexpr int kMaxRepeated = 10'000;
constexpr size_t kMaxTextBytes = 4096;

[[noreturn]] void Reject(const std::string& path, const std::string& why) {
  throw ServiceError(ErrorReason::kBadOption, path + why, {{path, path + why}});
}

void CheckNumber(const FieldDescriptor* field, double value, const std::string& path) {
  const std::string why = RangeError(field, value);
  if (!why.empty()) Reject(path, why);
}

void CheckText(const FieldDescriptor* field, size_t bytes, const std::string& path) {
  const int own = InfoOf(field).max_bytes();
  const size_t most = own > 0 ? static_cast<size_t>(own) : kMaxTextBytes;
  if (bytes > most) {
    Reject(path, fmt::format(" has {} bytes; at most {} are allowed", bytes, most));
  }
}

// `path`: of the first entry.
void CheckCount(const FieldDescriptor* field, int count, const std::string& path) {
  const int own = InfoOf(field).max_count();
  const int most = own > 0 ? own : kMaxRepeated;
  if (count > most) {
    Reject(path.substr(0, path.rfind('[')),
           fmt::format(" has {} entries; at most {} are allowed", count, most));
  }
}

void CheckDigest(const v1::Digest& digest, const std::string& path) {
  if (!IsSha256Hex(digest.sha256())) {
    Reject(path, ".sha256 must be 64 lower-case hexadecimal digits");
  }
  if (digest.size_bytes() < 1) {
    Reject(path, fmt::format(".size_bytes is {}; it must be positive", digest.size_bytes()));
  }
}

void CheckValue(const SpecValue& value) {
  const auto& [owner, field, index, message, path] = value;
  const google::protobuf::Reflection* reflection = owner.GetReflection();
  const bool is_entry = field->is_repeated();
  if (index == 0) CheckCount(field, reflection->FieldSize(owner, field), path);
  switch (field->cpp_type()) {
    case FieldDescriptor::CPPTYPE_MESSAGE:
      if (const auto* digest = dynamic_cast<const v1::Digest*>(message)) CheckDigest(*digest, path);
      return;
    case FieldDescriptor::CPPTYPE_ENUM: {
      const int number = is_entry ? reflection->GetRepeatedEnumValue(owner, field, index)
                                  : reflection->GetEnumValue(owner, field);
      if (field->enum_type()->FindValueByNumber(number) == nullptr) {
        Reject(path, fmt::format(" is {}, which is none of {}", number, ValuesText(field)));
      }
      if (is_entry && number == 0) {
        Reject(path, " is unspecified; name a value or leave the entry out");
      }
      return;
    }
    case FieldDescriptor::CPPTYPE_INT32:
      return CheckNumber(field,
                         is_entry ? reflection->GetRepeatedInt32(owner, field, index)
                                  : reflection->GetInt32(owner, field),
                         path);
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return CheckNumber(field,
                         is_entry ? reflection->GetRepeatedDouble(owner, field, index)
                                  : reflection->GetDouble(owner, field),
                         path);
    case FieldDescriptor::CPPTYPE_STRING:
      return CheckText(field,
                       (is_entry ? reflection->GetRepeatedString(owner, field, index)
                                 : reflection->GetString(owner, field))
                           .size(),
                       path);
    default:
      return;
  }
}

bool TakesModel(v1::KeyColorSource::SourceCase source) {
  return source == v1::KeyColorSource::kPrompt || source == v1::KeyColorSource::kAutomatic ||
         source == v1::KeyColorSource::kReference || source == v1::KeyColorSource::kReferences;
}

void CheckPrompt(const std::string& prompt, const std::string& path) {
  if (prompt.find_first_not_of(" \t\r\n") == std::string::npos) {
    Reject(path, " is empty; name objects with their colours, e.g. \"red brick, green lawn\"");
  }
}

// Without a backend its input may only be points, above the colours of the source.
void CheckPointsAbove(const v1::KeyColorSource& source, const std::string& path) {
  const bool is_layer = source.source_case() == v1::KeyColorSource::kPoints ||
                        source.source_case() == v1::KeyColorSource::kStrokes;
  const v1::BackendInput& input = source.backend_input();
  if (is_layer) {
    Reject(path, " is set, but points and strokes have nothing below them; give all as points");
  }
  if (!input.has_points() || input.has_reference() || input.has_mask() || !input.prompt().empty()) {
    Reject(path, " is set, but the source is no backend: only points may lie above its colours");
  }
}

// Options that some sources of colour take.
void CheckKeyColorExtras(const v1::KeyColorSource& source, const std::string& path) {
  if (!source.model().empty() && !TakesModel(source.source_case())) {
    Reject(
        path + ".model",
        fmt::format(
            " is '{}', but only prompt, automatic and references work with a model; leave it out",
            source.model()));
  }
  const bool is_points = source.source_case() == v1::KeyColorSource::kPoints;
  if (source.has_backend_input() && source.source_case() != v1::KeyColorSource::kBackend) {
    CheckPointsAbove(source, path + ".backend_input");
  }
  if (source.has_labels() && !is_points && !HasPointsAbove(source)) {
    Reject(path + ".labels", " is set, but only points refer to labels; leave it out");
  }
  if (source.has_backend_input() && !source.backend_input().prompt().empty()) {
    CheckPrompt(source.backend_input().prompt(), path + ".backend_input.prompt");
  }
}

void CheckKeyColor(const v1::KeyColorSource& source, const std::string& path) {
  CheckKeyColorExtras(source, path);
  switch (source.source_case()) {
    case v1::KeyColorSource::kImage:
    case v1::KeyColorSource::kStrokes:
    case v1::KeyColorSource::kPoints:
    case v1::KeyColorSource::kReference:
      return;
    case v1::KeyColorSource::kReferences:
      if (source.references().images().empty()) {
        Reject(path + ".references.images", " is empty; give at least one picture");
      }
      return;
    case v1::KeyColorSource::kPrompt:
      CheckPrompt(source.prompt(), path + ".prompt");
      if (source.model().empty()) {
        Reject(path + ".model",
               " is required with a prompt: the name of CLIP weights that the server was started "
               "with (--model NAME=FILE)");
      }
      return;
    case v1::KeyColorSource::kAutomatic:
      if (!source.automatic()) Reject(path + ".automatic", " is false; set it to true");
      return;
    case v1::KeyColorSource::kBackend:
      if (source.backend().empty()) Reject(path + ".backend", " is empty; name a backend");
      return;
    case v1::KeyColorSource::kScript:
      if (source.script().empty()) Reject(path + ".script", " is empty; name a model");
      return;
    case v1::KeyColorSource::kEdit:
      if (!source.edit().has_image()) {
        Reject(path + ".edit.image", " is required: the edited key photo");
      }
      return;
    case v1::KeyColorSource::SOURCE_NOT_SET:
      break;
  }
  Reject(
      path,
      fmt::format(" is required: where the key view's colour comes from (image, strokes, points, "
                  "automatic, ...). To learn which photo is the key view, first run {} and read "
                  "its artifact {}; `automatic` needs nothing of the user",
                  FindProducer(artifact::kKeyView)->kind,
                  artifact::kKeyView));
}

void CheckTruth(const google::protobuf::RepeatedPtrField<v1::TruthImage>& truth,
                const std::string& path) {
  for (int i = 0; i < truth.size(); ++i) {
    const std::string entry = fmt::format("{}[{}]", path, i);
    if (truth[i].view().empty()) Reject(entry, ".view is empty; name the view");
    if (!truth[i].has_image()) Reject(entry, ".image is missing");
  }
}

void CheckTraining(const google::protobuf::RepeatedPtrField<v1::TruthImage>& training,
                   bool has_truth,
                   const std::string& path) {
  CheckTruth(training, path);
  if (!training.empty() && !has_truth) {
    Reject(path, " is given without the truth of held-out views, which are scored; add it");
  }
}

void CheckStrategy(const v1::SelectKeyViewSpec& spec, const std::string& path) {
  if (spec.strategy() == v1::SelectKeyViewSpec::STRATEGY_MANUAL && spec.view().empty()) {
    Reject(path, ".view is required with STRATEGY_MANUAL: the name of a photo");
  }
}

void CheckRange(const v1::FurtherKeyView& key, const std::string& entry) {
  if (!key.has_begin_s() || !key.has_end_s() || key.end_s() >= key.begin_s()) return;
  Reject(entry + ".end_s",
         fmt::format(" is {}, before begin_s, {}; swap them", key.end_s(), key.begin_s()));
}

// `of_whole_scene`: the job also corrects colours.
void CheckCarryColor(const v1::CarryColorSpec& spec, bool of_whole_scene, const std::string& path) {
  for (int i = 0; i < spec.further_key_views_size(); ++i) {
    const v1::FurtherKeyView& key = spec.further_key_views(i);
    const std::string entry = fmt::format("{}.further_key_views[{}]", path, i);
    if (key.view().empty()) Reject(entry + ".view", " is empty; name a view");
    CheckKeyColor(key.color(), entry + ".color");
    CheckRange(key, entry);
    if (HasRange(key) && !of_whole_scene) {
      Reject(entry,
             fmt::format(" has a range of time: it corrects a coloured film and belongs to {}",
                         kind::kCorrectColors));
    }
    if (!HasRange(key) && spec.skip() && !spec.train_jointly()) {
      Reject(path + ".skip",
             " is set, but further_key_views need the stage; leave one of them out, or set "
             "train_jointly");
    }
  }
  if (spec.train_jointly() && !of_whole_scene) {
    Reject(path + ".train_jointly",
           fmt::format(" is set, but it is an option of {}, for it concerns other stages; leave it "
                       "out",
                       kind::kColorizeScene));
  }
}

void CheckCorrections(const v1::CorrectColorsSpec& spec, const std::string& path) {
  for (int i = 0; i < spec.corrections_size(); ++i) {
    const std::string entry = fmt::format("{}.corrections[{}]", path, i);
    const v1::FurtherKeyView& correction = spec.corrections(i);
    if (correction.view().empty()) Reject(entry + ".view", " is empty; name a view");
    CheckRange(correction, entry);
    if (HasRange(correction)) {
      CheckKeyColor(correction.color(), entry + ".color");
      continue;
    }
    CheckKeyColorExtras(correction.color(), entry + ".color");
    if (HasPointsAbove(correction.color())) {
      Reject(
          entry + ".color.backend_input",
          " is set, but a correction has one layer; give the points as a correction of their own");
    }
    switch (correction.color().source_case()) {
      case v1::KeyColorSource::kImage:
      case v1::KeyColorSource::kStrokes:
      case v1::KeyColorSource::kPoints:
        continue;
      default:
        Reject(entry + ".color", " must be strokes, points or image, painted on the view");
    }
  }
}

void CheckRender(const v1::RenderSpec& spec, bool of_whole_scene, const std::string& path) {
  const bool moves =
      spec.path() != v1::RenderSpec::PATH_UNSPECIFIED && spec.path() != v1::RenderSpec::PATH_VIEWS;
  if (moves && of_whole_scene) {
    Reject(path + ".path",
           " is set, but the report shows pictures of views; render a movie by a separate job when "
           "the scene is coloured (`color3d turntable`, `color3d render`)");
  }
  if (moves && spec.has_video() && !spec.video() && !spec.pictures()) {
    Reject(path + ".video", " is false, and so is pictures: nothing would be written");
  }
  const bool by_cameras = spec.path() == v1::RenderSpec::PATH_CAMERAS;
  if (by_cameras && !spec.has_cameras()) {
    Reject(path + ".cameras", " is required with PATH_CAMERAS: a transforms.json");
  }
  if (!by_cameras && spec.has_cameras()) {
    Reject(path + ".cameras", " is set, but only PATH_CAMERAS reads it; leave it out");
  }
}

void CheckRoutes(const v1::PersonalizeScenesSpec& spec) {
  const std::string routes = fmt::format("{}.routes", kind::kPersonalizeScenes);
  if (spec.routes().empty()) Reject(routes, " is empty; name a scene");
  std::set<std::string> scenes;
  for (int i = 0; i < spec.routes_size(); ++i) {
    const std::string path = fmt::format("{}[{}].scene", routes, i);
    const std::string& scene = spec.routes(i).scene();
    if (scene.empty()) Reject(path, " is empty; name a scene");
    if (!scenes.insert(scene).second) {
      Reject(path, fmt::format(" is '{}' again; name each scene once", scene));
    }
  }
}

// `has_inputs`: the colour may come from an input job, which the planner checks.
void CheckColorizeScene(const v1::ColorizeSceneSpec& spec, bool has_inputs) {
  const bool in_options = !spec.has_key_color() && spec.colorize_key_view().has_source();
  if (!has_inputs || spec.has_key_color() || in_options) {
    CheckKeyColor(in_options ? spec.colorize_key_view().source() : spec.key_color(), "key_color");
  }
  if (!spec.colorize_key_view().view().empty()) {
    Reject(fmt::format("{}.view", kind::kColorizeKeyView),
           " is set, but a whole scene names its key view in key_view and additional ones in "
           "carry_color.further_key_views");
  }
  if (!spec.colorize_views().encoder().empty()) {
    Reject(fmt::format("{}.encoder", kind::kColorizeViews),
           " is set, but a whole scene is coloured with the encoder that its colorizer is trained "
           "with; name it in personalize.encoder");
  }
  if (spec.key_view().empty()) CheckStrategy(spec.select_key_view(), kind::kSelectKeyView);
  CheckCarryColor(spec.carry_color(), /*of_whole_scene=*/true, kind::kCarryColor);
  CheckCorrections(spec.correct_colors(), kind::kCorrectColors);
  CheckRender(spec.render(), /*of_whole_scene=*/true, kind::kRender);
  CheckTruth(spec.truth(), "truth");
  CheckTraining(spec.training_truth(), !spec.truth().empty(), "training_truth");
}

}  // namespace

std::string KindOf(const v1::JobSpec& spec) {
  const google::protobuf::OneofDescriptor* stage = spec.GetDescriptor()->FindOneofByName("stage");
  const FieldDescriptor* field = spec.GetReflection()->GetOneofFieldDescriptor(spec, stage);
  if (field == nullptr) {
    throw InvalidArgument("spec has no stage; set one, e.g. spec.{}", kind::kColorizeScene);
  }
  return field->name();
}

void CheckSpec(const v1::JobSpec& spec) {
  const std::string kind = KindOf(spec);
  if (spec.ByteSizeLong() > kMaxSpecBytes) {
    Reject("spec",
           fmt::format(" has {} bytes; at most {} are allowed: give fewer entries or shorter texts",
                       spec.ByteSizeLong(),
                       kMaxSpecBytes));
  }
  ForEachValue(spec, CheckValue);
  if (spec.has_colorize_scene()) CheckColorizeScene(spec.colorize_scene(), spec.inputs_size() > 0);
  if (spec.has_colorize_key_view()) {
    CheckKeyColor(spec.colorize_key_view().source(), kind + ".source");
  }
  if (spec.has_personalize_scenes()) CheckRoutes(spec.personalize_scenes());
  // The options of another stage are empty, and pass.
  CheckCarryColor(spec.carry_color(), /*of_whole_scene=*/false, kind);
  CheckCorrections(spec.correct_colors(), kind);
  CheckStrategy(spec.select_key_view(), kind);
  CheckRender(spec.render(), /*of_whole_scene=*/false, kind);
  CheckTruth(spec.evaluate().truth(), kind + ".truth");
  CheckTraining(
      spec.evaluate().training_truth(), !spec.evaluate().truth().empty(), kind + ".training_truth");
}

void CheckJointTraining(const v1::ColorizeSceneSpec& scene) {
  const v1::ReconstructGeometrySpec& geometry = scene.reconstruct_geometry();
  const v1::SolveChromaSpec& chroma = scene.solve_chroma();
  const bool leaves_part = geometry.has_warm_up() && geometry.warm_up() < 1.0;
  const bool joint = chroma.solver() == v1::SolveChromaSpec::SOLVER_JOINT;
  const std::string warm_up = fmt::format("{}.warm_up", kind::kReconstructGeometry);
  if (leaves_part && geometry.recipe() != v1::ReconstructGeometrySpec::RECIPE_PAPER) {
    Reject(warm_up, fmt::format(" is {}, which needs recipe=paper", geometry.warm_up()));
  }
  if (leaves_part && !joint) {
    Reject(
        warm_up,
        fmt::format(" is {}, so that {} has to train the rest; choose {}.solver=joint or warm_up "
                    "1",
                    geometry.warm_up(),
                    kind::kSolveChroma,
                    kind::kSolveChroma));
  }
  if (joint && !leaves_part) {
    Reject(fmt::format("{}.solver", kind::kSolveChroma),
           fmt::format(" is joint, but {} trains to the end; give {} below 1 (the paper: 0.5) and "
                       "recipe=paper",
                       kind::kReconstructGeometry,
                       warm_up));
  }
  if (joint && chroma.chroma_sh_degree() > geometry.sh_degree()) {
    Reject(fmt::format("{}.chroma_sh_degree", kind::kSolveChroma),
           fmt::format(" is {}, above the degree {} of luminance, from which a and b start; lower "
                       "it or raise {}.sh_degree",
                       chroma.chroma_sh_degree(),
                       geometry.sh_degree(),
                       kind::kReconstructGeometry));
  }
}

std::vector<FileDigest> SpecBlobs(const v1::JobSpec& spec) {
  std::map<std::string, FileDigest> digests;
  ForEachValue(spec, [&](const SpecValue& value) {
    if (const auto* digest = dynamic_cast<const v1::Digest*>(value.message)) {
      digests[digest->sha256()] = {digest->sha256(), digest->size_bytes()};
    }
  });
  std::vector<FileDigest> result;
  for (const auto& [sha256, digest] : digests) result.push_back(digest);
  return result;
}

}  // namespace color3d
