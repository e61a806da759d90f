#include "core/stage/formats/training_pictures.h"

#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/color/lab.h"
#include "core/image/codec.h"
#include "core/stage/formats/artifact_io.h"
#include "core/stage/formats/json_artifact.h"

namespace color3d {

std::vector<TrainingPicture> TrainingPicturesFrom(
    std::string_view facts,
    const std::function<std::string(const std::string& name)>& read,
    int max_side_px,
    double share) {
  std::vector<TrainingPicture> pictures;
  ParseArtifact(artifact::kAugmentationFacts, facts, [&](const nlohmann::ordered_json& json) {
    for (const auto& sample : json.at("samples")) {
      const std::string stem = artifact::kAugmentations + sample.at("name").get<std::string>();
      const Image srgb = DecodeImage(read(stem + ".png"), stem + ".png");
      const AbMap color = DecodeAbPng(read(stem + ".ab.png"), stem + ".ab.png");
      const Image weight = DecodeImage(read(stem + ".weight.png"), stem + ".weight.png");
      TrainingPicture& picture = pictures.emplace_back();
      picture.name = sample.at("name");
      picture.luminance = FitWithin(LuminanceFromSrgb(srgb), max_side_px);
      picture.ab = FitWithin(color.ab, max_side_px);
      picture.weight = FitWithin(weight, max_side_px);
    }
  });
  for (TrainingPicture& picture : pictures) {
    picture.share = share / static_cast<double>(pictures.size());
  }
  return pictures;
}

}  // namespace color3d
