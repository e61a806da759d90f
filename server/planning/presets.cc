#include "server/planning/presets.h"

#include <google/protobuf/text_format.h>

#include <algorithm>
#include <memory>
#include <utility>

#include "core/base/error.h"
#include "server/planning/job_spec.h"
#include "server/planning/key_view_jobs.h"
#include "server/planning/preset_files.h"
#include "server/planning/spec_check.h"

namespace color3d {
namespace {
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;
using google::protobuf::Reflection;

std::vector<Preset> ReadPresets() {
  std::vector<Preset> presets;
  for (const PresetFile& file : PresetFiles()) {
    Preset preset{file.name, {}};
    if (!google::protobuf::TextFormat::ParseFromString(file.text, &preset.options)) {
      throw Error(ErrorCode::kInternal, "the preset {} cannot be read", file.name);
    }
    presets.push_back(std::move(preset));
  }
  return presets;
}

// True for messages that are replaced as a whole: merging two sources of colour would make a third.
bool IsOneValue(const Message& message) {
  return message.GetDescriptor()->real_oneof_decl_count() > 0;
}

// Unlike MergeFrom, lists are replaced, sources are taken whole, and an unspecified enum is no
// value.
void MergeOver(const Message& given, Message* base) {
  const Reflection* reflection = given.GetReflection();
  std::vector<const FieldDescriptor*> fields;
  reflection->ListFields(given, &fields);
  const std::unique_ptr<Message> rest(given.New());  // the fields left to MergeFrom
  rest->CopyFrom(given);
  for (const FieldDescriptor* field : fields) {
    if (field->is_repeated()) {
      reflection->ClearField(base, field);
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_ENUM &&
               reflection->GetEnumValue(given, field) == 0) {
      reflection->ClearField(rest.get(), field);
    } else if (field->cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      const Message& part = reflection->GetMessage(given, field);
      if (IsOneValue(part)) {
        reflection->ClearField(base, field);
      } else {
        MergeOver(part, reflection->MutableMessage(base, field));
        reflection->ClearField(rest.get(), field);
      }
    }
  }
  base->MergeFrom(*rest);
}

// Makes corrections of key views with a range of time: the film coloured before is reused.
void MoveRangesToCorrections(v1::ColorizeSceneSpec* spec) {
  auto* further = spec->mutable_carry_color()->mutable_further_key_views();
  if (std::none_of(further->begin(), further->end(), HasRange)) return;
  v1::CorrectColorsSpec* corrections = spec->mutable_correct_colors();
  for (const v1::FurtherKeyView& key : *further) {
    if (HasRange(key)) *corrections->add_corrections() = key;
  }
  further->erase(std::remove_if(further->begin(), further->end(), HasRange), further->end());
}

}  // namespace

const std::vector<Preset>& Presets() {
  static const std::vector<Preset> presets = ReadPresets();
  return presets;
}

const v1::ColorizeSceneSpec& OptionsOf(v1::Preset preset) {
  const v1::Preset wanted = preset == v1::PRESET_UNSPECIFIED ? v1::PRESET_FAST : preset;
  for (const Preset& known : Presets()) {
    if (known.options.preset() == wanted) return known.options;
  }
  throw InvalidArgument("there is no preset of number {}", static_cast<int>(preset));
}

v1::ColorizeSceneSpec WithPreset(const v1::ColorizeSceneSpec& given) {
  v1::ColorizeSceneSpec merged = OptionsOf(given.preset());
  MergeOver(given, &merged);
  MoveRangesToCorrections(&merged);
  // Additional key views are carried, even if the preset skips that, or trained on jointly.
  v1::CarryColorSpec* carry = merged.mutable_carry_color();
  if (carry->train_jointly()) {
    if (!given.carry_color().has_skip()) carry->set_skip(true);
  } else if (!carry->further_key_views().empty()) {
    carry->clear_skip();
  }
  const auto take_size = [&](auto* stage) {
    if (!stage->has_max_side_px()) stage->set_max_side_px(merged.max_side_px());
  };
  take_size(merged.mutable_carry_color());
  take_size(merged.mutable_colorize_views());
  take_size(merged.mutable_reconstruct_geometry());
  take_size(merged.mutable_render());
  if (merged.personalize().recipe() == v1::PersonalizeSpec::RECIPE_PAPER) {
    take_size(merged.mutable_personalize());
    if (merged.has_generate_augmentations()) take_size(merged.mutable_generate_augmentations());
  }
  return merged;
}

void FillStage(const v1::ColorizeSceneSpec& scene, v1::JobSpec* spec) {
  const std::string kind = KindOf(*spec);
  const FieldDescriptor* options = scene.GetDescriptor()->FindFieldByName(kind);
  if (options == nullptr) return;
  Message* given = MutableStage(spec, kind);
  const std::unique_ptr<Message> own(given->New());
  own->CopyFrom(*given);
  given->CopyFrom(scene.GetReflection()->GetMessage(scene, options));
  MergeOver(*own, given);
}

void TrainAtFrameSize(int frames_max_side_px, v1::PersonalizeSpec* spec) {
  constexpr int kMostLearntAtPx = 800;
  if (spec->has_max_side_px() || spec->recipe() == v1::PersonalizeSpec::RECIPE_PAPER) return;
  spec->set_max_side_px(std::min(frames_max_side_px, kMostLearntAtPx));
}

}  // namespace color3d
