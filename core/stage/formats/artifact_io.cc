#include "core/stage/formats/artifact_io.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "core/base/error.h"
#include "core/carry/confidence.h"
#include "core/catalogue/stages.h"
#include "core/image/codec.h"
#include "core/image/fill_holes.h"
#include "core/image/weighted_resize.h"
#include "core/stage/context/stage_context.h"
#include "core/stage/formats/json_artifact.h"

namespace color3d {

std::string ViewArtifact(std::string_view folder, const View& view, std::string_view extension) {
  const std::filesystem::path stem = std::filesystem::path(view.name).replace_extension();
  return std::string(folder) + stem.generic_string() + std::string(extension);
}

void CheckStemsAreUnique(const Scene& scene) {
  std::map<std::string, std::string> seen;
  const auto check = [&](const std::vector<View>& views) {
    for (const View& view : views) {
      const auto [found, fresh] = seen.emplace(ViewArtifact("", view, ""), view.name);
      if (!fresh) {
        throw InvalidArgument(
            "{} and {} differ only in their extension; remove or rename one of them",
            found->second,
            view.name);
      }
    }
  };
  check(scene.views);
  check(scene.unplaced);
}

std::string ImportFactsToJson(const ImportFacts& f) {
  nlohmann::ordered_json json{{"layout", InfoOf(f.layout).name},
                              {"ran_structure_from_motion", f.ran_structure_from_motion},
                              {"sfm_plan", f.sfm_plan},
                              {"undistorted", f.undistorted},
                              {"random_points", f.random_points},
                              {"photos_found", f.photos_found},
                              {"photos_registered", f.photos_registered}};
  if (f.masked_views > 0) json["masked_views"] = f.masked_views;
  if (f.film) {
    json["film"] = {{"poses_found", f.film->poses_found},
                    {"frames_placed", f.film->frames_placed},
                    {"camera_stands_still", f.film->camera_stands_still},
                    {"background_px", f.film->background_px},
                    {"path_unevenness", f.film->path_unevenness},
                    {"motion_energy", f.film->motion_energy}};
  }
  for (const FilmingCamera& camera : f.cameras) {
    json["cameras"].push_back({{"name", camera.name}, {"film", camera.film}});
  }
  return json.dump(1) + "\n";
}

ImportFacts ImportFactsFromJson(std::string_view json) {
  return ParseArtifact(artifact::kImportFacts, json, [](const nlohmann::ordered_json& value) {
    ImportFacts f;
    f.layout = LayoutOfName(value.at("layout").get<std::string>());
    f.ran_structure_from_motion = value.at("ran_structure_from_motion");
    f.sfm_plan = value.at("sfm_plan");
    f.undistorted = value.at("undistorted");
    f.random_points = value.at("random_points");
    f.photos_found = value.at("photos_found");
    f.photos_registered = value.at("photos_registered");
    f.masked_views = value.value("masked_views", 0);
    if (value.contains("film")) {
      const auto& film = value.at("film");
      f.film = {.poses_found = film.at("poses_found"),
                .frames_placed = film.at("frames_placed"),
                .camera_stands_still = film.at("camera_stands_still"),
                .background_px = film.at("background_px"),
                .path_unevenness = film.at("path_unevenness"),
                .motion_energy = film.at("motion_energy")};
    }
    for (const auto& camera : value.value("cameras", nlohmann::ordered_json::array())) {
      f.cameras.push_back({.name = camera.at("name"), .film = camera.at("film")});
    }
    return f;
  });
}

Scene ReadScene(const StageContext& context) {
  return SceneFromJson(context.ReadInput(artifact::kScene));
}

const CaptureKindInfo& ColoredAs(const StageContext& context, const Scene& scene) {
  const CaptureKindInfo& capture = scene.capture();
  const bool has_geometry =
      context.HasInput(artifact::kGeometry) || context.HasInput(artifact::kModel);
  return capture.is_dynamic && !has_geometry ? InfoOf(CaptureKind::kFilm) : capture;
}

int ReadKeyView(const StageContext& context, const Scene& scene) {
  return ParseArtifact(context, artifact::kKeyView, [&](const nlohmann::ordered_json& value) {
    return scene.FindView(value.at("view").get<std::string>());
  });
}

nlohmann::ordered_json ReadJson(const StageContext& context, const std::string& name) {
  return ParseArtifact(context, name, [](nlohmann::ordered_json json) { return json; });
}

Error DamagedArtifact(std::string_view name, const nlohmann::json::exception& error) {
  const Stage* writer = FindProducer(name);
  return InvalidArgument("{} is damaged: {}; run {} again",
                         name,
                         error.what(),
                         writer != nullptr ? writer->kind : "its stage");
}

Image ReadPicture(const StageContext& context, const std::string& name) {
  return DecodeImage(context.ReadInput(name), name);
}

AbMap ReadAbMap(const StageContext& context, const std::string& name) {
  return DecodeAbPng(context.ReadInput(name), name);
}

CarriedColor ReadKeyColor(const StageContext& context, int width, int height) {
  const AbMap map = ReadAbMap(context, artifact::kKeyColor);
  const auto unpainted = [](float confidence) { return confidence == 0.0f; };
  if (std::ranges::none_of(map.confidence.data, unpainted)) {
    return {Resize(map.ab, width, height), Resize(map.confidence, width, height)};
  }
  Image painted = map.confidence;
  for (float& value : painted.data) value = unpainted(value) ? 0.0f : 1.0f;
  CarriedColor color{ResizeWeighted(map.ab, painted, width, height),
                     Resize(map.confidence, width, height)};
  painted = Resize(painted, width, height);
  for (size_t i = 0; i < painted.data.size(); ++i) {
    if (painted.data[i] < 0.5f) color.confidence.data[i] = 0.0f;
  }
  return color;
}

CarriedColor ReadCarried(const StageContext& context, const View& view, int width, int height) {
  const std::string name = ViewArtifact(artifact::kCarried, view);
  if (!context.HasInput(name)) return {Image(width, height, 2), Image(width, height, 1)};
  AbMap map = ReadAbMap(context, name);
  FillHoles(map.confidence, &map.ab);
  return {ResizeWeighted(map.ab, map.confidence, width, height),
          Resize(map.confidence, width, height)};
}

int ColoredSide(const StageContext& context, const View& view) {
  const std::string name = ViewArtifact(artifact::kViewsAb, view);
  const ImageInfo info = ProbeImage(context.ReadInput(name), name);
  return std::max(info.width, info.height);
}

std::string ViewAbArtifact(const StageContext& context, const View& view) {
  const std::string corrected = ViewArtifact(artifact::kCorrectedAb, view);
  return context.HasInput(corrected) ? corrected : ViewArtifact(artifact::kViewsAb, view);
}

std::string ProvenanceArtifact(const StageContext& context, const View& view) {
  const std::string corrected = ViewArtifact(artifact::kCorrectedProvenance, view);
  return context.HasInput(corrected) ? corrected : ViewArtifact(artifact::kProvenance, view);
}

Image ReadViewAb(const StageContext& context, const View& view, int width, int height) {
  const std::string name = ViewAbArtifact(context, view);
  AbMap map = ReadAbMap(context, name);
  if (map.ab.width == width && map.ab.height == height) return std::move(map.ab);
  return Resize(map.ab, width, height);
}

Image ReadTargetAb(
    const StageContext& context, const View& view, bool is_key, int width, int height) {
  Image ab = ReadViewAb(context, view, width, height);
  if (!is_key || context.HasInput(ViewArtifact(artifact::kCorrectedAb, view))) return ab;
  const CarriedColor own = ReadKeyColor(context, width, height);
  for (int c = 0; c < 2; ++c) {
    for (size_t i = 0; i < own.confidence.data.size(); ++i) {
      if (own.confidence.data[i] > 0.0f) ab.Plane(c)[i] = own.ab.Plane(c)[i];
    }
  }
  return ab;
}

Image ReadProvenance(const StageContext& context, const View& view, int width, int height) {
  const std::string name = ProvenanceArtifact(context, view);
  if (!context.HasInput(name)) return {};
  const Image shares = ReadPicture(context, name);
  if (shares.channels != 3) throw InvalidArgument("{} is grey; it must be RGB", name);
  return Resize(shares, width, height);
}

Image ReadViewConfidence(const StageContext& context, const View& view, int width, int height) {
  const Image shares = ReadProvenance(context, view, width, height);
  if (shares.Empty()) return {};
  Image confidence(width, height, 1);
  for (size_t i = 0; i < confidence.data.size(); ++i) {
    confidence.data[i] =
        ShownConfidence(shares.Plane(kSeenPlane)[i], shares.Plane(kInferredPlane)[i]);
  }
  return confidence;
}

}  // namespace color3d
