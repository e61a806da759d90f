#include "client/studio/correct/versions.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/io/zero_copy_stream_impl_lite.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/digest.h"
#include "core/base/error.h"

namespace color3d::client {
namespace {

constexpr size_t kIdDigits = 16;

std::string Deterministic(const google::protobuf::Message& message) {
  std::string bytes;
  {
    google::protobuf::io::StringOutputStream stream(&bytes);
    google::protobuf::io::CodedOutputStream coded(&stream);
    coded.SetSerializationDeterministic(true);
    message.SerializeToCodedStream(&coded);
  }
  return bytes;
}

std::optional<double> ToneNumber(const nlohmann::json& tone,
                                 const char* field,
                                 double low,
                                 double high) {
  const auto value = tone.find(field);
  if (value == tone.end()) return std::nullopt;
  const double number = value->is_number() ? value->get<double>() : std::nan("");
  if (!(number >= low && number <= high)) {
    throw InvalidArgument(
        "{} is {}; it must be between {} and {}", field, value->dump().substr(0, 20), low, high);
  }
  return number;
}

void RemoveCorrection(const std::string& id, v1::CorrectColorsSpec* correct) {
  for (int i = correct->corrections_size() - 1; i >= 0; --i) {
    if (CorrectionId(correct->corrections(i)) != id) continue;
    correct->mutable_corrections()->DeleteSubrange(i, 1);
    return;
  }
  throw Error(ErrorCode::kFailedPrecondition,
              "this correction is not there any more; another page has removed it");
}

}  // namespace

std::string WithoutCorrections(const v1::JobSpec& spec) {
  v1::JobSpec plain = spec;
  plain.set_skip_cache(false);
  v1::ColorizeSceneSpec* scene = plain.mutable_colorize_scene();
  scene->clear_correct_colors();
  if (scene->has_solve_chroma()) {
    v1::SolveChromaSpec* solve = scene->mutable_solve_chroma();
    solve->clear_saturation();
    solve->clear_tint();
    solve->clear_warmth();
    if (Deterministic(*solve).empty()) scene->clear_solve_chroma();
  }
  return Deterministic(plain);
}

std::string CorrectionId(const v1::FurtherKeyView& correction) {
  return Sha256Hex(Deterministic(correction)).substr(0, kIdDigits);
}

nlohmann::ordered_json ToneJson(const v1::JobSpec& spec) {
  const v1::SolveChromaSpec& solve = spec.colorize_scene().solve_chroma();
  return {{"saturation", solve.has_saturation() ? solve.saturation() : 1.0},
          {"tint", solve.tint()},
          {"warmth", solve.warmth()}};
}

VersionChange ReadVersionChange(const nlohmann::json& json) {
  VersionChange change;
  if (const auto remove = json.find("remove"); remove != json.end()) {
    if (!remove->is_array()) throw InvalidArgument("remove is not a list of ids");
    for (const nlohmann::json& id : *remove) {
      if (!id.is_string()) throw InvalidArgument("remove is not a list of ids");
      change.remove.push_back(id.get<std::string>());
    }
  }
  if (const auto tone = json.find("tone"); tone != json.end()) {
    if (!tone->is_object()) throw InvalidArgument("tone is not an object");
    change.saturation = ToneNumber(*tone, "saturation", 0.0, 4.0);
    change.tint = ToneNumber(*tone, "tint", -50.0, 50.0);
    change.warmth = ToneNumber(*tone, "warmth", -50.0, 50.0);
  }
  return change;
}

v1::JobSpec Changed(v1::JobSpec spec, const VersionChange& change) {
  spec.set_skip_cache(false);
  v1::ColorizeSceneSpec* scene = spec.mutable_colorize_scene();
  v1::CorrectColorsSpec* correct = scene->mutable_correct_colors();
  for (const std::string& id : change.remove) RemoveCorrection(id, correct);
  if (change.add) *correct->add_corrections() = *change.add;
  // Proposals of further places take as long as a correction.
  correct->set_proposals(0);
  if (correct->corrections().empty()) scene->clear_correct_colors();
  v1::SolveChromaSpec* solve = scene->mutable_solve_chroma();
  if (change.saturation) solve->set_saturation(*change.saturation);
  if (change.tint) solve->set_tint(*change.tint);
  if (change.warmth) solve->set_warmth(*change.warmth);
  return spec;
}

}  // namespace color3d::client
