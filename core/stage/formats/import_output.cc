#include "core/stage/formats/import_output.h"

#include "core/base/files.h"
#include "core/stage/formats/artifact_io.h"

namespace color3d {
void WriteImported(const ImportResult& result,
                   StageContext& context,
                   const std::map<std::string, std::string>& films,
                   const std::optional<FilmFindings>& film) {
  CheckStemsAreUnique(result.scene);
  for (const std::string& warning : result.warnings) context.Warn(warning);
  ImportFacts facts;
  facts.layout = result.layout;
  facts.ran_structure_from_motion = result.ran_structure_from_motion;
  facts.sfm_plan = result.sfm.plan;
  facts.undistorted = result.undistorted;
  facts.random_points = result.random_points;
  facts.photos_found = result.photos_found;
  facts.photos_registered = result.photos_registered;
  facts.masked_views = result.masked_views;
  facts.film = film;
  for (const std::string& camera : result.cameras) {
    if (result.cameras.size() < 2) break;
    const auto film = films.find(camera);
    facts.cameras.push_back({camera, film != films.end() ? film->second : ""});
  }
  context.progress().OnError(
      result.photos_found, "photos_without_pose", result.photos_found - result.photos_registered);
  context.WriteOutput(artifact::kScene, SceneToJson(result.scene));
  context.WriteOutput(artifact::kImportFacts, ImportFactsToJson(facts));
  if (result.ran_structure_from_motion) {
    context.WriteOutput(artifact::kSfmLog, ReadFile(result.sfm.log));
  }
}

}  // namespace color3d
